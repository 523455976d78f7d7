"""A study as strict JSON: every number of it, no NaN and no infinity (null stands for them)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from .results import PaperStudy

DIGITS = 9
"""Significant digits of curves: far more than any verdict needs, half of what a double prints."""


def to_json(study: PaperStudy) -> dict[str, Any]:
    """The study as dictionaries, lists, strings, numbers and null.

    Complex curves become ``{"real": […], "imag": […]}``; arrays are given to nine significant
    digits, single numbers in full. The verdicts are listed once more under ``verdicts``.
    """
    result: dict[str, Any] = _plain(study)
    result["verdicts"] = [{"id": id, "verdict": str(verdict)} for id, verdict in study.verdicts]
    return result


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _array(values: np.ndarray[Any, Any]) -> Any:
    if np.iscomplexobj(values):
        return {"real": _array(values.real), "imag": _array(values.imag)}
    finite = np.isfinite(values)
    if finite.all():
        return _rounded(values).tolist()
    return [v if ok else None for v, ok in zip(_rounded(values).tolist(), finite, strict=True)]


def _rounded(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Each number to nine significant digits."""
    with np.errstate(all="ignore"):
        exponent = np.floor(np.log10(np.abs(values)))
        power = np.where(np.isfinite(exponent), DIGITS - 1 - exponent, 0.0)
        scaled = np.round(values * 10.0**power) / 10.0**power
    return np.asarray(np.where(np.isfinite(scaled), scaled, values))

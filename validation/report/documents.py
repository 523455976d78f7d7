"""The one writer of JSON: results as dicts and lists, strict, numbers to a stated length."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from mbs_models.model.parameters import Drivetrain

from ..checks.check import Check
from .digits import SIGNIFICANT_DIGITS
from .provenance import Provenance

SCHEMA_VERSION = 1


def document_head(
    drivetrain: Drivetrain,
    made: Provenance,
    *,
    verdict: str,
    agrees: bool | None,
    warnings: Sequence[str],
    seconds: Mapping[str, float],
    schema_version: int = SCHEMA_VERSION,
) -> dict[str, Any]:
    """What every file of numbers begins with: of what, with which verdict, when, by what.

    ``agrees`` is None where nothing was checked.
    """
    return {
        "schema_version": schema_version,
        "model": drivetrain.name,
        "verdict": verdict,
        "agrees": agrees,
        "warnings": list(warnings),
        "date": made.date,
        "platform": made.platform,
        "versions": made.versions,
        "parameters": drivetrain,
        "timings_s": seconds,
    }


def check_document(check: Check) -> dict[str, Any]:
    """A check with its verdict."""
    return {
        "name": check.name,
        "subject": check.subject,
        "routes": list(check.routes),
        "measure": check.measure,
        "value": check.value,
        "tolerance": check.tolerance,
        "reason": check.reason,
        "agrees": check.agrees,
        "findings": list(check.findings),
        "note": check.note,
    }


def document_text(document: Mapping[str, Any]) -> str:
    """A file of numbers: strict JSON, compact, null for what is not finite."""
    text = json.dumps(plain(document), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text + "\n"


def plain(value: Any, digits: int = SIGNIFICANT_DIGITS) -> Any:
    """Dicts, lists, texts, numbers and null, of what results are made of.

    Dataclasses become their fields, a `Check` has its verdict, models their file's keys; arrays are
    rounded to significant digits, complex ones are ``{"real": …, "imag": …}``; single numbers are
    written in full. NaN and infinity, for which JSON has no word, become null: `not_finite` names
    them.
    """
    if value is None or type(value) in (str, bool, int):
        return value
    if isinstance(value, float):  # NumPy's as well
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.ndarray):
        return rounded_lists(value, digits)
    if isinstance(value, Mapping):
        return {str(key): plain(item, digits) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        if _finite_floats(value):
            return list(value)
        return [plain(item, digits) for item in value]
    if isinstance(value, Check):
        return plain(check_document(value), digits)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = dataclasses.fields(value)
        return {field.name: plain(getattr(value, field.name), digits) for field in fields}
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", by_alias=True, exclude_none=True)
    if isinstance(value, Enum):
        return plain(value.value, digits)
    if isinstance(value, np.generic):
        return plain(value.item(), digits)
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no place in a JSON file")


def rounded_lists(values: NDArray[Any], digits: int = SIGNIFICANT_DIGITS) -> Any:
    """An array as lists of numbers with so many significant digits; null for what is not finite."""
    if np.iscomplexobj(values):
        return {
            "real": rounded_lists(values.real, digits),
            "imag": rounded_lists(values.imag, digits),
        }
    if values.ndim == 0:
        return plain(values.item(), digits)
    if values.ndim > 1:
        return [rounded_lists(row, digits) for row in values]
    if values.dtype.kind != "f":
        return values.tolist()
    # By way of a text: the shortest one of that many digits is what is written.
    form = f"%.{digits}g"
    if np.isfinite(values).all():
        return [float(form % value) for value in values.tolist()]
    return [float(form % value) if math.isfinite(value) else None for value in values.tolist()]


def not_finite(value: Any, where: str = "") -> Iterator[tuple[str, str]]:
    """Names of the numbers that JSON has no word for, and what they are."""
    if isinstance(value, float):
        if not math.isfinite(value):
            yield where, {math.inf: "Infinity", -math.inf: "-Infinity"}.get(value, "NaN")
    elif isinstance(value, np.ndarray):
        if _has_nulls(value):
            yield from not_finite(value.tolist(), where)
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from not_finite(item, f"{where}.{key}" if where else str(key))
    elif isinstance(value, (list, tuple)) and not _finite_floats(value):
        for number, item in enumerate(value):
            yield from not_finite(item, f"{where}[{number}]")


def _has_nulls(values: NDArray[Any]) -> bool:
    """Whether an array has values that become null."""
    return values.dtype.kind == "f" and not bool(np.isfinite(values).all())


def _finite_floats(values: Sequence[Any]) -> bool:
    """Whether a list holds finite floats only: long ones are passed over in one go."""
    return all(type(value) is float for value in values) and all(map(math.isfinite, values))

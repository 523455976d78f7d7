"""Checks of arrays and labels that several modules share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import AmbiguousDofError, FbsError, NonFiniteError, unknown_dof

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only view; memory order and the caller's own array stay as they are."""
    view = array.view()
    view.setflags(write=False)
    return view


def unique_labels(labels: Iterable[str], what: str) -> tuple[str, ...]:
    """Return the labels as a tuple of non-empty strings, no two alike."""
    if isinstance(labels, str):
        raise FbsError(f"{what} must be a sequence of labels, not the single string {labels!r}")
    result = tuple(labels)
    for label in result:
        if not isinstance(label, str) or not label:
            raise FbsError(f"{what} must be non-empty strings, got {label!r}")
    seen: set[str] = set()
    for label in result:
        if label in seen:
            raise AmbiguousDofError(f"{what} name {label!r} more than once")
        seen.add(label)
    return result


def positions(wanted: Iterable[str], known: Sequence[str], where: str) -> list[int]:
    """Return where each wanted label stands among the known ones."""
    index = {label: position for position, label in enumerate(known)}
    result = []
    for label in unique_labels(wanted, "the labels asked for"):
        if label not in index:
            raise unknown_dof(label, known, where)
        result.append(index[label])
    return result


def ascending_frequency(frequency: ArrayLike) -> FloatArray:
    """Return a frequency axis in Hz: one-dimensional, finite, >= 0, strictly ascending."""
    axis = np.array(frequency, dtype=float)
    if axis.ndim != 1 or axis.size == 0:
        raise FbsError(f"the frequency axis must be one-dimensional, got shape {axis.shape}")
    if not np.isfinite(axis).all():
        line = int(np.flatnonzero(~np.isfinite(axis))[0])
        raise NonFiniteError(f"the frequency axis holds {axis[line]} at line {line}")
    if axis[0] < 0:
        raise FbsError(f"frequencies must not be negative, the first is {axis[0]:.10g} Hz")
    falling = np.flatnonzero(np.diff(axis) <= 0)
    if falling.size:
        line = int(falling[0])
        raise FbsError(
            "the frequency axis must ascend strictly, but line "
            f"{line + 1} ({axis[line + 1]:.10g} Hz) follows {axis[line]:.10g} Hz"
        )
    return axis


def square_matrix(matrix: ArrayLike, size: int, name: str) -> FloatArray:
    """Return a finite real matrix of shape (size, size)."""
    raw = np.asarray(matrix)
    if np.iscomplexobj(raw):
        raise FbsError(f"the {name} matrix must be real; damping has a matrix of its own")
    result = np.array(raw, dtype=float)
    if result.shape != (size, size):
        raise FbsError(f"the {name} matrix has shape {result.shape}, {size} DoFs need {size, size}")
    if not np.isfinite(result).all():
        row, column = np.argwhere(~np.isfinite(result))[0].tolist()
        raise NonFiniteError(f"the {name} matrix holds {result[row, column]} at {row, column}")
    return result

"""Whether all values are finite, as fast as they are read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .checks import ComplexArray, FloatArray

RUN = 8192
"""Real numbers per dot product: from 10 000 on OpenBLAS would start threads of its own."""


def surely_finite(values: ComplexArray) -> bool:
    """Whether `square_sum` is finite; if it is not, a square may have overflowed, no more."""
    return bool(np.isfinite(square_sum(values)))


def square_sum(values: ComplexArray) -> float:
    """Return sum |v|^2: no number if a value is none, infinite if one is or a square overflows.

    Fast where the last axis is contiguous.
    """
    if values.flags.c_contiguous:
        values = values.reshape(1, -1)
    elif values.strides[-1] != values.itemsize:
        values = np.ascontiguousarray(values)
    parts = values.view(float)
    whole = parts.shape[-1] // RUN * RUN
    runs = parts[..., :whole].reshape(*parts.shape[:-1], -1, RUN)
    rest = parts[..., whole:]
    with np.errstate(invalid="ignore", over="ignore"):
        return float(np.vecdot(runs, runs).sum() + np.vecdot(rest, rest).sum())


def non_finite(values: FloatArray) -> NDArray[np.intp]:
    """Return where values are NaN or infinite, shape (n_found, values.ndim)."""
    with np.errstate(invalid="ignore", over="ignore"):
        total = values.sum()
    if np.isfinite(total):  # one pass without a mask; any NaN or infinity would have survived
        return np.empty((0, values.ndim), dtype=np.intp)
    return np.argwhere(~np.isfinite(values))

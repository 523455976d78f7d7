"""Curves of many lines: drawn with few points, and compared line by line.

No peak and no antiresonance is lost to the drawing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]


def extremes(position: FloatArray, values: FloatArray, columns: int) -> IndexArray:
    """Indices of the smallest and the largest value of each column, ascending.

    Parameters
    ----------
    position
        (n,) ascending positions along the axis as it is drawn (log₁₀ f on a log axis).
    values
        (n,) what is drawn; lines that are not finite are left out.
    columns
        How many columns of equal width there are.
    """
    lowest, highest = _lowest_and_highest(position, values, columns)
    return np.unique(np.concatenate([lowest, highest]))


def largest(position: FloatArray, values: FloatArray, columns: int) -> IndexArray:
    """Indices of the largest value of each column, ascending (see `extremes`)."""
    return _lowest_and_highest(position, values, columns)[1]


def relative_difference(reference: NDArray[Any], other: NDArray[Any]) -> FloatArray:
    """|ΔH|/|H| per line; not a number where both vanish."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: FloatArray = np.abs(other - reference) / np.abs(reference)
    return ratio


def _lowest_and_highest(
    position: FloatArray, values: FloatArray, columns: int
) -> tuple[IndexArray, IndexArray]:
    finite = np.flatnonzero(np.isfinite(values) & np.isfinite(position))
    if not len(finite):
        return finite, finite
    x = position[finite] - position[finite[0]]
    column = np.floor(x * (columns / (x[-1] or 1.0)))
    order = finite[np.lexsort((values[finite], column))]
    first = np.flatnonzero(np.diff(column, prepend=-1.0))
    last = np.append(first[1:], len(finite)) - 1
    return order[first], order[last]

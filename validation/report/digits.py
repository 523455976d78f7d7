"""Numbers for results.json, as short as they are exact."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

SIGNIFICANT_DIGITS = 9  # of curves; their differences are listed beside them, computed in full
ERROR_DIGITS = 5


def rounded(values: NDArray[Any], digits: int) -> list[float]:
    """To so many significant digits; a text of them is short, and so is its float's."""
    form = f"%.{digits}g"
    return [float(form % value) for value in values.tolist()]

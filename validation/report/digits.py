"""Numbers as they are written: for results.json as short as they are exact, or with a prefix."""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

SIGNIFICANT_DIGITS = 9  # of curves; their differences are listed beside them, computed in full
ERROR_DIGITS = 5
PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


def rounded(values: NDArray[Any], digits: int) -> list[float]:
    """To so many significant digits; a text of them is short, and so is its float's."""
    form = f"%.{digits}g"
    return [float(form % value) for value in values.tolist()]


def engineering(value: float, unit: str, digits: int = 3) -> str:
    """With the prefix that suits it: 12.3 kN, 4.56 µm; a dash for what is no number."""
    if not math.isfinite(value):
        return "–"
    rounded_value = float(f"{value:.{digits}g}")
    if rounded_value == 0.0:
        return f"0 {unit}"
    exponent = 3 * math.floor(math.log10(abs(rounded_value)) / 3.0)
    exponent = min(max(exponent, min(PREFIXES)), max(PREFIXES))
    scaled = f"{rounded_value / 10.0**exponent:.{digits}g}".replace("-", "−")
    return f"{scaled} {PREFIXES[exponent]}{unit}"

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


def scientific(value: float, digits: int = 2, *, signed: bool = False) -> str:
    """1.8e-16, with no zeros to pad the exponent; 0 where it is exactly that."""
    if value == 0.0 or not math.isfinite(value):
        return {math.inf: "∞", -math.inf: "−∞"}.get(value, "not a number") if value else "0"
    sign = "+" if signed else ""
    if 1e-3 <= abs(value) < 1e3:
        return f"{float(f'{value:.{digits + 1}g}'):{sign}g}".replace("-", "−")
    mantissa, exponent = f"{value:{sign}.{digits - 1}e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "−")


def hertz(value: float) -> str:
    """To a thousandth, in groups of three digits."""
    return f"{value:,.3f}".replace(",", "\u202f")


def grouped(value: int) -> str:
    """A count in groups of three digits."""
    return f"{value:,}".replace(",", "\u202f")

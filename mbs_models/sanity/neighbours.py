"""Stiffnesses that look like a wrong unit: a thousand times off their neighbours."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal
from statistics import median

from ..model.parameters import Coupling, Part
from .finding import Finding

DECADES = 3.0  # a thousand times: what N/mm for N/m, or a forgotten k, makes
COUNTABLE = 6.0  # decades up to which a factor is written out


def off_their_neighbours(part: Part | Coupling) -> Iterator[Finding]:
    """Stiffnesses more than a thousand times off the median of their part's or coupling's.

    They are pointed out, not refused: a soft coupling or a fixed ring may be meant.
    """
    # What a radius makes infinite is left to those who compute with it.
    given = [spring for spring in part.given_springs() if 0.0 < spring.value < math.inf]
    if len(given) < 2:
        return
    middle = median(math.log10(spring.value) for spring in given)
    for spring in given:
        decades = math.log10(spring.value) - middle
        if abs(decades) > DECADES:
            reason = f"{_times(decades)} its neighbours ({_power(middle)} N/m); is the unit right?"
            yield Finding(part.name, spring.key, spring.written, reason)


def _times(decades: float) -> str:
    """A factor of 10^decades in words."""
    if abs(decades) > COUNTABLE:
        return f"{_power(decades)} times"
    factor = f"{10.0 ** abs(decades):.0f}"
    return f"{factor} times" if decades > 0.0 else f"a {factor}th of"


def _power(decades: float) -> str:
    """10^decades in digits, though no float may hold it: 3.2e+152."""
    return f"{Decimal(10) ** Decimal(decades):.1e}"

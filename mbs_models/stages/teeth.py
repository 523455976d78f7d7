"""Gears with their tooth numbers, and what the digits of their radii in a file allow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from itertools import combinations
from typing import Self

# Teeth only say how often a mesh is passed; radii rounded more coarsely still fit them.
TEETH_TOLERANCE = 0.02


@dataclass(frozen=True)
class Gear:
    """Teeth and base radius (m) of a gear, with the least and largest radius its digits allow."""

    name: str
    teeth: int
    radius: float
    least: float
    largest: float

    @classmethod
    def written(cls, name: str, teeth: int, radius: float) -> Self:
        """A gear whose radius, or diameter, is rounded to the digits that the file has."""
        rounded = max(half_a_digit(radius), half_a_digit(2.0 * radius) / 2.0)
        half = min(rounded, radius / 2.0)  # the digit of 0.1 m is worth as much as the radius
        return cls(name, teeth, radius, radius - half, radius + half)


def half_a_digit(value: float) -> float:
    """Half of what the last digit of a number is worth: 0.0005 for 0.024."""
    exponent = Decimal(repr(value)).as_tuple().exponent
    assert isinstance(exponent, int)
    return 0.5 * 10.0**exponent


def check_teeth(gears: Mapping[str, tuple[int | None, float]]) -> None:
    """Refuse tooth numbers that are not as the base radii (key → teeth, base radius)."""
    given = [(key, teeth, radius) for key, (teeth, radius) in gears.items() if teeth is not None]
    for (first, z_1, r_1), (second, z_2, r_2) in combinations(given, 2):
        expected = z_1 * r_2 / r_1
        if abs(z_2 - expected) > TEETH_TOLERANCE * expected:
            slip = max(r_1, r_2) if not 0.1 < expected / z_2 < 10.0 else None
            in_mm = f"; is {slip:g} m in mm?" if slip else ""
            raise ValueError(
                f"{second} = {z_2}: contradicts {first} = {z_1}; base_radius {r_2:g} and {r_1:g} m "
                f"give {expected:.4g} (agree within {TEETH_TOLERANCE:.0%}, or leave one out){in_mm}"
            )

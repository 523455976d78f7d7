"""Tooth numbers that only rounding of the radii, or profile shift, explains."""

from __future__ import annotations

from collections.abc import Iterator

from ..model.tooth_numbers import another_is_nearer, expected, gear_pairs
from ..stages.part import Part
from .finding import Finding


def teeth_fit_radii(part: Part) -> Iterator[Finding]:
    """Tooth numbers that are explained by nothing but the rounding of the radii."""
    for first, second in gear_pairs(part):
        if another_is_nearer(first, second):
            reason = (
                f"{expected(first, second)}; only the rounding of the radii allows another number"
            )
            yield Finding(part.name, f"{second.name}.teeth", f"{second.teeth}", reason)


def ring_closes(part: Part) -> Iterator[Finding]:
    """A ring that is a tooth or two off z_s + 2 z_p, with one pressure angle for both meshes."""
    for planets in part.planet_sets():
        if planets.teeth_over:
            yield Finding(
                part.name,
                "ring.teeth",
                f"{planets.ring_teeth}",
                f"expected z_s + 2 z_p = {planets.standard_ring}; a profile-shifted set may "
                "differ, but its sun and ring meshes have different working pressure angles: give "
                "sun_pressure_angle and ring_pressure_angle",
            )

"""Tooth numbers that only rounding of the radii, or profile shift, explains."""

from __future__ import annotations

from collections.abc import Iterator

from ..model.parameters import Coupling, Part, PlanetaryStage
from ..model.tooth_numbers import another_is_nearer, expected, gear_pairs, standard_ring, teeth_over
from .finding import Finding


def teeth_fit_radii(part: Part | Coupling) -> Iterator[Finding]:
    """Tooth numbers that are explained by nothing but the rounding of the radii."""
    for first, second in gear_pairs(part):
        if another_is_nearer(first, second):
            reason = (
                f"{expected(first, second)}; only the rounding of the radii allows another number"
            )
            yield Finding(part.name, f"{second.name}.teeth", f"{second.teeth}", reason)


def ring_closes(part: Part | Coupling) -> Iterator[Finding]:
    """A ring that is a tooth or two off z_s + 2 z_p, with one pressure angle for both meshes."""
    if isinstance(part, PlanetaryStage) and teeth_over(part):
        standard = standard_ring(part)
        yield Finding(
            part.name,
            "ring.teeth",
            f"{part.ring.teeth}",
            f"expected z_s + 2 z_p = {standard}; a profile-shifted set may differ, but its sun and "
            "ring meshes have different working pressure angles: give sun_pressure_angle and "
            "ring_pressure_angle",
        )

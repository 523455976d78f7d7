"""Tooth numbers against base radii, each other, and the planets' places.

A base radius is r = m_t z cos α_t/2, and gears that mesh share the base pitch, whatever their
profile shift: radii are exactly as tooth numbers, z₁/z₂ = r₁/r₂. With z₁ the smaller number, z₂ is
noticed if another whole number is nearer to z₁ r₂/r₁: one tooth too many or too few at either gear
always is. Rounding may be why. A radius whose last digit is worth 10^e is anything in r ± h with
h = 10^e/2, or a quarter of what the last digit of its diameter is worth, and z₂ anything in

    z₁ (r₂ − h₂)/(r₁ + h₁) ≤ z₂ ≤ z₁ (r₂ + h₂)/(r₁ − h₁)

Outside the file contradicts itself and is refused; inside it is pointed out. Beyond 2 %
(`teeth.TEETH_TOLERANCE`) rounding is no excuse. All this is judged of a file as it is loaded:
what a program computes has no digits, there the 2 % alone hold.

The ring of a standard set has z_r = z_s + 2 z_p. With profile shift it may have some teeth more
(5-MW reference gearbox: three), but then the planets' centre distance gives sun and ring mesh
different working pressure angles, cos α_r/cos α_s = (z_r − z_p)/(z_s + z_p).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from ..errors import ModelError
from ..stages.part import Part
from ..stages.planet_set import PlanetSet, check_assembly
from ..stages.teeth import Gear
from .parameters import Drivetrain

# Teeth by which a ring may differ from z_s + 2 z_p by profile shift where one pressure angle, an
# average, is given for both meshes.
PROFILE_SHIFT = 2


def refuse_impossible(drivetrain: Drivetrain) -> None:
    """Refuse tooth numbers that no drivetrain can have.

    Raises
    ------
    ModelError
        Tooth numbers contradict the base radii or each other, or planets cannot be put in.
    """
    for stage in drivetrain.stages:
        _refuse_contradictions(stage)
        for planets in stage.planet_sets():
            _refuse_ring(planets)
            if planets.sun_teeth is not None and planets.ring_teeth is not None:
                check_assembly(planets)


def _refuse_contradictions(stage: Part) -> None:
    for first, second in gear_pairs(stage):
        low = first.teeth * second.least / first.largest
        high = first.teeth * second.largest / first.least
        if another_is_nearer(first, second) and not low <= second.teeth <= high:
            raise ModelError(
                f"stage '{stage.name}': {second.name}.teeth = {second.teeth}: contradicts the base "
                f"radii; {expected(first, second)}"
            )


def gear_pairs(part: Part) -> Iterator[tuple[Gear, Gear]]:
    """Gears of a train that have teeth, the one with fewer teeth first."""
    return combinations(sorted(part.gears(), key=lambda gear: gear.teeth), 2)


def another_is_nearer(first: Gear, second: Gear) -> bool:
    """Whether another whole number of teeth is nearer to the radii."""
    return abs(second.teeth - first.teeth * second.radius / first.radius) > 0.5


def expected(first: Gear, second: Gear) -> str:
    """Which number of teeth the radii lead to, in words."""
    return (
        f"expected {first.teeth * second.radius / first.radius:.0f} with {first.name}.teeth = "
        f"{first.teeth} and base radii of {first.radius:.6g} and {second.radius:.6g} m"
    )


def _refuse_ring(planets: PlanetSet) -> None:
    if abs(planets.teeth_over) > PROFILE_SHIFT:
        raise ModelError(
            f"stage '{planets.stage}': ring.teeth = {planets.ring_teeth}: contradicts z_s + 2 z_p ="
            f" {planets.standard_ring} of sun.teeth = {planets.sun_teeth} and planet.teeth = "
            f"{planets.planet_teeth}; with one pressure_angle for both meshes it may be off by "
            f"{PROFILE_SHIFT} at most"
        )

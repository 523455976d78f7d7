"""Tooth numbers against base radii, each other, and the planets' places.

A base radius is r = m_t z cos α_t/2, and gears that mesh share the base pitch, whatever their
profile shift: radii are exactly as tooth numbers, z₁/z₂ = r₁/r₂. With z₁ the smaller number, z₂ is
noticed if another whole number is nearer to z₁ r₂/r₁: one tooth too many or too few at either gear
always is. Rounding may be why. A radius whose last digit is worth 10^e is anything in r ± h with
h = 10^e/2, or a quarter of what the last digit of its diameter is worth, and z₂ anything in

    z₁ (r₂ − h₂)/(r₁ + h₁) ≤ z₂ ≤ z₁ (r₂ + h₂)/(r₁ − h₁)

Outside the file contradicts itself and is refused; inside it is pointed out. Beyond 2 %
(`parameters.TEETH_TOLERANCE`) rounding is no excuse. All this is judged of a file as it is loaded:
what a program computes has no digits, there the 2 % alone hold.

The ring of a standard set has z_r = z_s + 2 z_p. With profile shift it may have some teeth more
(5-MW reference gearbox: three), but then the planets' centre distance gives sun and ring mesh
different working pressure angles, cos α_r/cos α_s = (z_r − z_p)/(z_s + z_p).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from itertools import combinations

from ..errors import ModelError
from .mesh_phasing import check_assembly
from .parameters import Coupling, Drivetrain, ParallelStage, Part, PlanetaryStage

# Teeth by which a ring may differ from z_s + 2 z_p by profile shift where one pressure angle, an
# average, is given for both meshes.
PROFILE_SHIFT = 2


@dataclass(frozen=True)
class Gear:
    """Teeth and base radius (m) of a gear, with the least and largest radius its digits allow."""

    name: str
    teeth: int
    radius: float
    least: float
    largest: float


def refuse_impossible(drivetrain: Drivetrain) -> None:
    """Refuse tooth numbers that no drivetrain can have.

    Raises
    ------
    ModelError
        Tooth numbers contradict the base radii or each other, or planets cannot be put in.
    """
    for stage in drivetrain.stages:
        _refuse_contradictions(stage)
        if isinstance(stage, PlanetaryStage):
            _refuse_ring(stage)
            if stage.sun.teeth is not None and stage.ring.teeth is not None:
                check_assembly(stage)


def _refuse_contradictions(stage: ParallelStage | PlanetaryStage) -> None:
    for first, second in gear_pairs(stage):
        low = first.teeth * second.least / first.largest
        high = first.teeth * second.largest / first.least
        if another_is_nearer(first, second) and not low <= second.teeth <= high:
            raise ModelError(
                f"stage '{stage.name}': {second.name}.teeth = {second.teeth}: contradicts the base "
                f"radii; {expected(first, second)}"
            )


def another_is_nearer(first: Gear, second: Gear) -> bool:
    """Whether another whole number of teeth is nearer to the radii."""
    return abs(second.teeth - first.teeth * second.radius / first.radius) > 0.5


def expected(first: Gear, second: Gear) -> str:
    """Which number of teeth the radii lead to, in words."""
    return (
        f"expected {first.teeth * second.radius / first.radius:.0f} with {first.name}.teeth = "
        f"{first.teeth} and base radii of {first.radius:.6g} and {second.radius:.6g} m"
    )


def _refuse_ring(stage: PlanetaryStage) -> None:
    if abs(teeth_over(stage)) > PROFILE_SHIFT:
        raise ModelError(
            f"stage '{stage.name}': ring.teeth = {stage.ring.teeth}: contradicts z_s + 2 z_p = "
            f"{standard_ring(stage)} of sun.teeth = {stage.sun.teeth} and planet.teeth = "
            f"{stage.planet.teeth}; with one pressure_angle for both meshes it may be off by "
            f"{PROFILE_SHIFT} at most"
        )


def teeth_over(stage: PlanetaryStage) -> int:
    """z_r − (z_s + 2 z_p) where the set is said to be a standard one; 0 if it is not."""
    standard = standard_ring(stage)
    if standard is None or stage.ring.teeth is None or stage.pressure_angle is None:
        return 0
    return stage.ring.teeth - standard


def standard_ring(stage: PlanetaryStage) -> int | None:
    """z_s + 2 z_p, if both are given."""
    if stage.sun.teeth is None or stage.planet.teeth is None:
        return None
    return stage.sun.teeth + 2 * stage.planet.teeth


def gear_pairs(part: Part | Coupling) -> Iterator[tuple[Gear, Gear]]:
    """Gears of a train that have teeth, the one with fewer teeth first.

    A ring of a standard set has no radius of its own: its teeth are judged by the others'.
    """
    gears: list[Gear] = []
    if isinstance(part, ParallelStage):
        gears = [
            _gear(name, gear.teeth, gear.base_radius)
            for name, gear in (("pinion", part.pinion), ("wheel", part.wheel))
            if gear.teeth is not None
        ]
    elif isinstance(part, PlanetaryStage):
        gears = [*_sun_and_planet(part), *_ring(part)]
    yield from combinations(sorted(gears, key=lambda gear: gear.teeth), 2)


def _sun_and_planet(stage: PlanetaryStage) -> Iterator[Gear]:
    for name, gear in (("sun", stage.sun), ("planet", stage.planet)):
        if gear.teeth is not None:
            yield _gear(name, gear.teeth, gear.base_radius)


def _ring(stage: PlanetaryStage) -> Iterator[Gear]:
    """The ring where its own radius or two pressure angles are given."""
    teeth = stage.ring.teeth
    if teeth is None:
        return
    if stage.ring.base_radius is not None:
        yield _gear("ring", teeth, stage.ring.base_radius)
    elif stage.pressure_angle is None:
        yield Gear("ring", teeth, stage.ring_radius, *_ring_radii(stage))


def _ring_radii(stage: PlanetaryStage) -> tuple[float, float]:
    """Least and largest r_p + (r_s + r_p) cos α_r/cos α_s that the digits allow."""
    assert stage.sun_pressure_angle is not None
    assert stage.ring_pressure_angle is not None
    angles = []
    for angle in (stage.sun_pressure_angle, stage.ring_pressure_angle):
        half = half_a_digit(angle)
        angles.append((math.cos(math.radians(angle + half)), math.cos(math.radians(angle - half))))
    (sun_least, sun_largest), (ring_least, ring_largest) = angles
    s, p = stage.sun.base_radius, stage.planet.base_radius
    h_s, h_p = min(half_a_digit(s), s / 2.0), min(half_a_digit(p), p / 2.0)
    least = p - h_p + (s + p - h_s - h_p) * ring_least / sun_largest
    largest = p + h_p + (s + p + h_s + h_p) * ring_largest / sun_least
    return least, largest


def _gear(name: str, teeth: int, radius: float) -> Gear:
    rounded = max(half_a_digit(radius), half_a_digit(2.0 * radius) / 2.0)
    half = min(rounded, radius / 2.0)  # the digit of 0.1 m is worth as much as the radius
    return Gear(name, teeth, radius, radius - half, radius + half)


def half_a_digit(value: float) -> float:
    """Half of what the last digit of a number is worth: 0.0005 for 0.024."""
    exponent = Decimal(repr(value)).as_tuple().exponent
    assert isinstance(exponent, int)
    return 0.5 * 10.0**exponent

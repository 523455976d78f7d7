"""Stiffnesses that look like a wrong unit: a thousand times off their neighbours."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal
from statistics import median

from .parameters import Coupling, Drivetrain, Inertia, ParallelStage, PlanetaryStage

DECADES = 3.0  # a thousand times: what N/mm for N/m, or a forgotten k, makes
COUNTABLE = 6.0  # decades up to which a factor is written out


def suspicious_stiffnesses(drivetrain: Drivetrain) -> tuple[str, ...]:
    """Stiffnesses more than a thousand times off the median of their stage's or coupling's.

    They are pointed out, not refused: a soft coupling or a fixed ring may be meant.
    """
    return tuple(
        note
        for part in (*drivetrain.stages, *drivetrain.couplings)
        for note in _odd_ones(part.name, list(_stiffnesses(part)))
    )


def _odd_ones(name: str, values: list[tuple[str, float]]) -> Iterator[str]:
    # What a radius makes infinite is left to those who compute with it.
    given = [(key, value) for key, value in values if 0.0 < value < math.inf]
    if len(given) < 2:
        return
    middle = median(math.log10(value) for _, value in given)
    for key, value in given:
        decades = math.log10(value) - middle
        if abs(decades) > DECADES:
            yield (
                f"{name}: {key} = {value:g} N/m is {_times(decades)} its neighbours "
                f"({_power(middle)} N/m): is the unit right?"
            )


def _times(decades: float) -> str:
    """A factor of 10^decades in words."""
    if abs(decades) > COUNTABLE:
        return f"{_power(decades)} times"
    factor = f"{10.0 ** abs(decades):.0f}"
    return f"{factor} times" if decades > 0.0 else f"a {factor}th of"


def _power(decades: float) -> str:
    """10^decades in digits, though no float may hold it: 3.2e+152."""
    return f"{Decimal(10) ** Decimal(decades):.1e}"


def _stiffnesses(
    table: ParallelStage | PlanetaryStage | Inertia | Coupling,
) -> Iterator[tuple[str, float]]:
    """(key, N/m) of every stiffness of a table; rotary ones seen at the base radius."""
    if isinstance(table, ParallelStage):
        yield "mesh_stiffness", table.mesh_stiffness
        for name, gear in (("pinion", table.pinion), ("wheel", table.wheel)):
            (y, _), (_, z) = gear.support.stiffness
            yield f"{name}.bearing along y", y
            yield f"{name}.bearing along z", z
            yield f"{name}.bearing_rocking (over r²)", gear.rocking_stiffness
    elif isinstance(table, PlanetaryStage):
        for key, values in (("sun", table.sun_meshes), ("ring", table.ring_meshes)):
            yield from ((f"{key}_mesh_stiffness", value) for value in sorted(set(values)))
        (radial, _), (_, tangential) = table.planet_support.stiffness
        yield "planet bearing, radial", radial
        yield "planet bearing, tangential", tangential
        for name in table.bodies:
            member = getattr(table, name)
            (u, _), (_, v) = member.support.stiffness
            yield f"{name}.bearing along u", u
            yield f"{name}.bearing along v", v
            yield f"{name}.torsional_support", member.torsional_support_at(table.radius(name))
    elif isinstance(table, Coupling):
        for key in ("first_stiffness", "second_stiffness"):
            value = getattr(table, key)
            if not isinstance(value, str):
                yield key, value

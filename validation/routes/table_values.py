"""What the lumped equations need of a model file's tables, derived from the values as they stand.

Nothing of `mbs_models` that derives anything is used here – no placement, facings, radii, r²
conversions, planet angles or supports – so that the equations witness them all. What a stage type
of a user's own has, its ``members()`` say.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import singledispatch
from math import cos, pi, radians
from typing import Any

from mbs_models.model.parameters import Coupling, Drivetrain, Inertia, ParallelStage, PlanetaryStage
from mbs_models.stages.bodies import Matrix2
from mbs_models.stages.part import Part

# Of a coupling's translations, by either kind of stage's name: which direction it is
SIDEWAYS = {"u": 1, "y": 1, "v": 2, "x": 2, "z": 3}


def over_r2(table: Any, key: str, radius: float) -> float:
    """A rotary quantity as w = r·θ has it: the file's value, or its physical one over r²."""
    reduced: float | None = getattr(table, f"{key}_over_r2", None)
    return reduced if reduced is not None else float(getattr(table, key)) / radius**2


def torsional_support(table: Any, radius: float) -> float:
    """Of a central member or an inertia (N/m): in N/m already, or N m/rad over r², or none."""
    if table.torsional_stiffness is not None:
        return float(table.torsional_stiffness) / radius**2
    return float(table.torsional_support or 0.0)


def mesh_angles(stage: PlanetaryStage) -> tuple[float, float]:
    """Pressure angles of the sun's and the ring's meshes (rad)."""
    if stage.pressure_angle is not None:
        return radians(stage.pressure_angle), radians(stage.pressure_angle)
    assert stage.sun_pressure_angle is not None
    assert stage.ring_pressure_angle is not None
    return radians(stage.sun_pressure_angle), radians(stage.ring_pressure_angle)


def planet_angles(stage: PlanetaryStage) -> tuple[float, ...]:
    """Where the planets stand (rad): as listed, or 2π p/N."""
    if stage.planet_angles is not None:
        return tuple(radians(angle) for angle in stage.planet_angles)
    assert stage.planets is not None
    return tuple(2.0 * pi * number / stage.planets for number in range(stage.planets))


@dataclass(frozen=True)
class Shape:
    """What a part's bodies are to a coupling.

    Attributes
    ----------
    radii
        Body → r of w = r·θ (m).
    reversed
        Bodies whose positive w turns against the others'.
    translations
        Direction that frames share → the part's name for it.
    """

    radii: Mapping[str, float]
    reversed: frozenset[str]
    translations: Mapping[int, str]

    def sense(self, body: str) -> float:
        """−1 of a body that counts the other way."""
        return -1.0 if body in self.reversed else 1.0


@singledispatch
def shape(part: Part) -> Shape:
    """Of a stage type of a user's own: what its members say."""
    members = {member.body.partition(".")[2]: member for member in part.members()}
    return Shape(
        {body: member.radius for body, member in members.items()},
        frozenset(body for body, member in members.items() if member.sense < 0.0),
        {
            SIDEWAYS[dof]: dof
            for member in members.values()
            for dof in member.inertias
            if dof in SIDEWAYS
        },
    )


@shape.register
def _inertia(part: Inertia) -> Shape:
    return Shape({"": part.radius}, frozenset(), {})


@shape.register
def _parallel(part: ParallelStage) -> Shape:
    """Base radii; the pinion drives the wheel the other way round."""
    radii = {"pinion": part.pinion.base_radius, "wheel": part.wheel.base_radius}
    return Shape(radii, frozenset({"wheel"}), {1: "y", 3: "z"})


@shape.register
def _planetary(part: PlanetaryStage) -> Shape:
    """Base radii, and the circle of planet centres.

    Sun and planet roll on a centre distance d = (r_s + r_p)/cos α_s; at the same d the ring has
    r_r = r_p + d cos α_r.
    """
    sun, ring = mesh_angles(part)
    r_p = part.planet.base_radius
    distance = (part.sun.base_radius + r_p) / cos(sun)
    radii = {
        "sun": part.sun.base_radius,
        "ring": r_p + distance * cos(ring),
        "carrier": distance,
    }
    return Shape(radii, frozenset(), {1: "u", 2: "v"})


def matrix(both: Any, first: float | None = None, second: float | None = None) -> Matrix2:
    """A bearing's 2 × 2 matrix: given as such, as a number for both directions, or one for each."""
    if isinstance(both, tuple):
        return both
    if both is not None:
        return ((both, 0.0), (0.0, both))
    assert first is not None
    assert second is not None
    return ((first, 0.0), (0.0, second))


# Couplings


def split(body: str) -> tuple[str, str]:
    """``reducer.wheel`` as part and body; an inertia's body has no name."""
    part, _, name = body.partition(".")
    return part, name


def ends(coupling: Coupling) -> tuple[tuple[str, float | str], tuple[str, float | str]]:
    """Body and stiffness (N/m, or "rigid") of both ends."""
    return (
        (coupling.first, coupling.first_stiffness),
        (coupling.second, coupling.second_stiffness),
    )


def rigid_end(coupling: Coupling) -> tuple[str, float | str]:
    """The first rigid end, where a hub without inertia is cut."""
    first, second = ends(coupling)
    return first if first[1] == "rigid" else second


def sides(drivetrain: Drivetrain) -> dict[str, float]:
    """Which side each part is seen from (±1), so that coupled bodies turn alike.

    Through a coupling f_there s_there = f_here s_here, s the sense of the bodies; the first part
    of each group has +1. A coupling that closes a loop finds both parts' sides settled.
    """
    shapes = {part.name: shape(part) for part in drivetrain.parts}
    joined: dict[str, list[Coupling]] = {name: [] for name in shapes}
    for coupling in drivetrain.couplings:
        for body in (coupling.first, coupling.second):
            joined[split(body)[0]].append(coupling)
    found: dict[str, float] = {}
    passed: set[str] = set()
    for start in shapes:
        if start in found:
            continue
        found[start] = 1.0
        path: list[tuple[str, Iterator[Coupling]]] = [(start, iter(joined[start]))]
        while path:
            here, left = path[-1]
            over = next((c for c in left if c.name not in passed), None)
            if over is None:
                path.pop()
                continue
            passed.add(over.name)
            bodies = [split(body) for body in (over.first, over.second)]
            (own, near), (there, far) = bodies if bodies[0][0] == here else bodies[::-1]
            if there not in found:
                turning = found[own] * shapes[own].sense(near)
                found[there] = turning * shapes[there].sense(far)
                path.append((there, iter(joined[there])))
    return found


def hub_ratio(
    drivetrain: Drivetrain, side: Mapping[str, float], coupling: Coupling, body: str
) -> float:
    """w of the hub where it turns as a body does, per w of it: ± r_hub/r_body.

    Negative only in a loop that no sides can satisfy, of its second body.
    """
    (first_part, first), (part, name) = split(coupling.first), split(body)
    one, other = (shape(drivetrain.part(each)) for each in (first_part, part))
    turning = side[first_part] * one.sense(first) * side[part] * other.sense(name)
    return turning * coupling.radius / other.radii[name]


def translation_label(drivetrain: Drivetrain, body: str, direction: int) -> str:
    """The label of a body's translation along a direction that frames share."""
    return f"{body}.{shape(drivetrain.part(split(body)[0])).translations[direction]}"

"""The quantities of a part that rules judge, with the keys they have in the file.

The only place here that knows one kind of stage from another: a rule sees bodies, stiffnesses,
lengths and angles.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from ..model.bodies import Body, Matrix2, ParallelGear, Table
from ..model.mesh_tables import TransmissionError
from ..model.parameters import Coupling, ParallelStage, Part, PlanetaryStage


class BodyKind(Enum):
    """What shape a body has."""

    GEAR = "a gear"
    RING = "a ring"
    CARRIER = "a carrier"


class SpringKind(Enum):
    """What a spring is in the machine."""

    MESH = "a mesh"
    BEARING = "a bearing"
    ROCKING = "a bearing's rocking stiffness"
    SUPPORT = "a torsional support"
    SHAFT = "a shaft"


@dataclass(frozen=True)
class MomentOfInertia:
    """An inertia I of a body: its key, the file's value, and I/r² (kg)."""

    key: str
    given: float
    over_r2: float

    @property
    def twin(self) -> str:
        """The key of the other form."""
        suffix = "_over_r2"
        return self.key.removesuffix(suffix) if self.is_reduced else f"{self.key}{suffix}"

    @property
    def is_reduced(self) -> bool:
        """Whether the file gives I/r²."""
        return self.key.endswith("_over_r2")


@dataclass(frozen=True)
class Solid:
    """A body with a mass (kg) and a radius (m): what its inertias can be."""

    name: str
    kind: BodyKind
    mass: float
    radius: float
    polar: MomentOfInertia
    diametral: MomentOfInertia | None = None


@dataclass(frozen=True)
class Stiffness:
    """A spring of a part.

    Attributes
    ----------
    key, written
        Its key in the file, and its value there with the unit.
    value
        N/m; rotary ones seen at their body's radius.
    kind
        What it is.
    holds
        DoFs that it holds, without the part's name (bearings).
    diameter
        Pitch diameter of the smaller gear, for meshes (m).
    """

    key: str
    written: str
    value: float
    kind: SpringKind
    holds: tuple[str, ...] = ()
    diameter: float = 0.0


@dataclass(frozen=True)
class Quantity:
    """A length (m) or an angle (deg) under its key."""

    key: str
    value: float


def solids(part: Part | Coupling) -> Iterator[Solid]:
    """The bodies that have mass and radius."""
    if isinstance(part, ParallelStage):
        for name, gear in (("pinion", part.pinion), ("wheel", part.wheel)):
            yield _solid(name, gear, gear.base_radius, BodyKind.GEAR)
    elif isinstance(part, PlanetaryStage):
        yield _solid("sun", part.sun, part.sun.base_radius, BodyKind.GEAR)
        yield _solid("planet", part.planet, part.planet.base_radius, BodyKind.GEAR)
        yield _solid("ring", part.ring, part.ring_radius, BodyKind.RING)
        yield _solid("carrier", part.carrier, part.carrier_radius, BodyKind.CARRIER)


def _solid(name: str, body: Body, radius: float, kind: BodyKind) -> Solid:
    polar = _inertia(name, body, "polar_inertia", body.rotary_mass(radius))
    if not isinstance(body, ParallelGear):
        return Solid(name, kind, body.mass, radius, polar)
    diametral = _inertia(name, body, "diametral_inertia", body.rocking_mass)
    return Solid(name, kind, body.mass, radius, polar, diametral)


def _inertia(name: str, body: Body, key: str, over_r2: float) -> MomentOfInertia:
    written = _given(body, key, f"{key}_over_r2")
    return MomentOfInertia(f"{name}.{written}", getattr(body, written), over_r2)


def lengths(part: Part | Coupling) -> Iterator[Quantity]:
    """The radii that the file gives."""
    if isinstance(part, ParallelStage):
        for name, gear in (("pinion", part.pinion), ("wheel", part.wheel)):
            yield Quantity(f"{name}.base_radius", gear.base_radius)
    elif isinstance(part, PlanetaryStage):
        for name, member in (("sun", part.sun), ("planet", part.planet)):
            yield Quantity(f"{name}.base_radius", member.base_radius)
    else:
        yield Quantity("radius", part.radius)


def gaps(part: Part | Coupling) -> Iterator[Quantity]:
    """Backlash of the meshes (m)."""
    for key in ("mesh_backlash", "sun_mesh_backlash", "ring_mesh_backlash"):
        value = getattr(part, key, None)
        if value is not None:
            yield Quantity(key, value)


def transmission_errors(part: Part | Coupling) -> Iterator[Quantity]:
    """Largest amplitude of each transmission error (m)."""
    for mesh in ("", "sun_", "ring_"):
        key = f"{mesh}mesh_transmission_error"
        table: TransmissionError | None = getattr(part, key, None)
        if table is not None:
            largest = max((amplitude for amplitude, _ in table.harmonics), key=abs)
            yield Quantity(f"{key}.harmonics", largest)


def pressure_angles(part: Part | Coupling) -> Iterator[Quantity]:
    """Pressure angles (deg)."""
    keys = ("pressure_angle", "sun_pressure_angle", "ring_pressure_angle")
    for key in keys:
        value = getattr(part, key, None)
        if value is not None:
            yield Quantity(key, value)


def helix_angles(part: Part | Coupling) -> Iterator[Quantity]:
    """Helix angles (deg)."""
    if isinstance(part, ParallelStage):
        yield Quantity("helix_angle", part.helix_angle)


def stiffnesses(part: Part | Coupling) -> Iterator[Stiffness]:
    """Every spring of a part; rotary ones seen at the base radius."""
    if isinstance(part, ParallelStage):
        yield from _parallel(part)
    elif isinstance(part, PlanetaryStage):
        yield from _planetary(part)
    elif isinstance(part, Coupling):
        for key in ("first_stiffness", "second_stiffness"):
            value = getattr(part, key)
            if not isinstance(value, str):
                yield Stiffness(key, f"{value:g} N/m", value, SpringKind.SHAFT)


def _parallel(stage: ParallelStage) -> Iterator[Stiffness]:
    smaller = min(stage.pinion.base_radius, stage.wheel.base_radius)
    diameter = 2.0 * smaller / math.cos(math.radians(stage.pressure_angle))
    yield _mesh("mesh_stiffness", stage.mesh_stiffness, diameter)
    for name, gear in (("pinion", stage.pinion), ("wheel", stage.wheel)):
        yield from _bearings(gear, "bearing", ("y", "z"), (name,), gear.support.stiffness)
        rotary = gear.bearing_rocking is not None
        key = "bearing_rocking" if rotary else "bearing_rocking_over_r2"
        yield _rotary(
            f"{name}.{key}",
            gear.bearing_rocking,
            gear.rocking_stiffness,
            SpringKind.ROCKING,
            f"{name}.rho",
        )


def _planetary(stage: PlanetaryStage) -> Iterator[Stiffness]:
    planet = stage.planet.base_radius
    sun = 2.0 * min(stage.sun.base_radius, planet) / math.cos(stage.sun_mesh_angle)
    ring = 2.0 * planet / math.cos(stage.ring_mesh_angle)
    for value in sorted(set(stage.sun_meshes)):
        yield _mesh("sun_mesh_stiffness", value, sun)
    for value in sorted(set(stage.ring_meshes)):
        yield _mesh("ring_mesh_stiffness", value, ring)
    planets = tuple(f"planet{number}" for number in range(1, stage.planet_count + 1))
    yield from _bearings(
        stage, "planet_bearing", ("radial", "tangential"), planets, stage.planet_support.stiffness
    )
    for name in stage.bodies:
        member = getattr(stage, name)
        yield from _bearings(member, "bearing", ("u", "v"), (name,), member.support.stiffness)
        rotary = member.torsional_stiffness is not None
        key = "torsional_stiffness" if rotary else "torsional_support"
        seen = member.torsional_support_at(stage.radius(name))
        yield _rotary(f"{name}.{key}", member.torsional_stiffness, seen, SpringKind.SUPPORT)


def _mesh(key: str, value: float, diameter: float) -> Stiffness:
    return Stiffness(key, f"{value:g} N/m", value, SpringKind.MESH, diameter=diameter)


def _rotary(
    key: str, rotary: float | None, seen: float, kind: SpringKind, *holds: str
) -> Stiffness:
    written = f"{seen:g} N/m"
    if rotary is not None:
        written = f"{rotary:g} N m/rad ({written} at the radius)"
    return Stiffness(key, written, seen, kind, holds)


def _bearings(
    table: Table, key: str, directions: tuple[str, str], bodies: tuple[str, ...], matrix: Matrix2
) -> Iterator[Stiffness]:
    """A bearing's two directions: under keys of their own, or both under one."""
    prefix = "" if key.startswith("planet") else f"{bodies[0]}."
    dofs = ("y", "z") if directions == ("y", "z") else ("u", "v")
    (first, _), (_, second) = matrix
    values = dict(zip(directions, zip(dofs, (first, second), strict=True), strict=True))
    common = getattr(table, key) is not None
    if common and first == second:
        values = {"": ("", first)}
    for direction, (dof, value) in values.items():
        held = tuple(f"{body}.{each}" for body in bodies for each in ([dof] if dof else dofs))
        at = prefix + (key if common else f"{key}_{direction}")
        yield Stiffness(at, f"{value:g} N/m", value, SpringKind.BEARING, held)


def _given(table: Table, *keys: str) -> str:
    return next(key for key in keys if getattr(table, key) is not None)

"""The springs of a part as its model file has them: key, value, and what they are there for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from .bodies import CentralMember, Matrix2, ParallelGear, Table


class SpringKind(StrEnum):
    """What a spring is there for."""

    BEARING = "bearing"  # between a body's centre and ground, or the body that carries it
    ROCKING = "rocking support"
    TORSION = "torsional support"
    MESH = "mesh"
    SHAFT = "shaft"  # torsion spring between two bodies
    TRANSLATION = "coupled translation"


@dataclass(frozen=True)
class GivenSpring:
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
        DoFs that it holds, without the part's name (bearings and supports).
    diameter
        Pitch diameter of the smaller gear, for meshes (m).
    """

    key: str
    written: str
    value: float
    kind: SpringKind
    holds: tuple[str, ...] = ()
    diameter: float = 0.0


def mesh_spring(key: str, value: float, diameter: float) -> GivenSpring:
    """A mesh of gears of which the smaller has a pitch diameter (m)."""
    return GivenSpring(key, f"{value:g} N/m", value, SpringKind.MESH, diameter=diameter)


def shaft_spring(key: str, value: float) -> GivenSpring:
    """A torsion spring between two bodies, seen at a radius."""
    return GivenSpring(key, f"{value:g} N/m", value, SpringKind.SHAFT)


def gear_springs(name: str, gear: ParallelGear) -> Iterator[GivenSpring]:
    """Bearing and rocking support of a gear on a parallel shaft."""
    yield from bearing_springs(gear, "bearing", ("y", "z"), (name,), gear.support.stiffness)
    rotary = gear.bearing_rocking is not None
    key = "bearing_rocking" if rotary else "bearing_rocking_over_r2"
    seen, holds = gear.rocking_stiffness, f"{name}.rho"
    yield _rotary(f"{name}.{key}", gear.bearing_rocking, seen, SpringKind.ROCKING, holds)


def member_springs(name: str, member: CentralMember, radius: float) -> Iterator[GivenSpring]:
    """Bearing and torsional support of a central member."""
    yield from bearing_springs(member, "bearing", ("u", "v"), (name,), member.support.stiffness)
    rotary = member.torsional_stiffness is not None
    key = "torsional_stiffness" if rotary else "torsional_support"
    seen, holds = member.torsional_support_at(radius), f"{name}.w"
    yield _rotary(f"{name}.{key}", member.torsional_stiffness, seen, SpringKind.TORSION, holds)


def _rotary(
    key: str, rotary: float | None, seen: float, kind: SpringKind, holds: str
) -> GivenSpring:
    written = f"{seen:g} N/m"
    if rotary is not None:
        written = f"{rotary:g} N m/rad ({written} at the radius)"
    return GivenSpring(key, written, seen, kind, (holds,))


def bearing_springs(
    table: Table, key: str, directions: tuple[str, str], bodies: tuple[str, ...], matrix: Matrix2
) -> Iterator[GivenSpring]:
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
        yield GivenSpring(at, f"{value:g} N/m", value, SpringKind.BEARING, held)

"""The quantities that rules judge, with the keys they have in the file: bodies, lengths, angles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any

from ..stages.bodies import Body, ParallelGear, Table
from ..stages.mesh_tables import TransmissionError
from ..stages.part import Member, Part, Role


class BodyKind(Enum):
    """What shape a body has."""

    GEAR = "a gear"
    RING = "a ring"
    CARRIER = "a carrier"


SHAPES = {Role.RING: BodyKind.RING, Role.CARRIER: BodyKind.CARRIER}  # all others are gears


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
class Quantity:
    """A length (m) or an angle (deg) under its key."""

    key: str
    value: float


def solids(part: Part) -> Iterator[Solid]:
    """The bodies that have mass and radius, each table of the file once."""
    members = {member.table: member for member in part.members() if member.table}
    for name, member in members.items():
        yield _solid(name, getattr(part, name), member)


def _solid(name: str, body: Body, member: Member) -> Solid:
    kind = SHAPES.get(member.role, BodyKind.GEAR)
    polar = _inertia(name, body, "polar_inertia", body.rotary_mass(member.radius))
    diametral = None
    if isinstance(body, ParallelGear):
        diametral = _inertia(name, body, "diametral_inertia", body.rocking_mass)
    return Solid(name, kind, body.mass, member.radius, polar, diametral)


def _inertia(name: str, body: Body, key: str, over_r2: float) -> MomentOfInertia:
    written = next(k for k in (key, f"{key}_over_r2") if getattr(body, k) is not None)
    return MomentOfInertia(f"{name}.{written}", getattr(body, written), over_r2)


def lengths(item: Table) -> Iterator[Quantity]:
    """The radii that the file gives."""
    return _numbers(item, "radius")


def gaps(item: Table) -> Iterator[Quantity]:
    """Backlash of the meshes (m)."""
    return _numbers(item, "backlash")


def transmission_errors(item: Table) -> Iterator[Quantity]:
    """Largest amplitude of each transmission error (m)."""
    for key, value in _given(item):
        if isinstance(value, TransmissionError):
            largest = max((amplitude for amplitude, _ in value.harmonics), key=abs)
            yield Quantity(f"{key}.harmonics", largest)


def pressure_angles(item: Table) -> Iterator[Quantity]:
    """Pressure angles (deg)."""
    return _numbers(item, "pressure_angle")


def helix_angles(item: Table) -> Iterator[Quantity]:
    """Helix angles (deg)."""
    return _numbers(item, "helix_angle")


def _numbers(item: Table, ending: str) -> Iterator[Quantity]:
    """The numbers under all keys that end so."""
    for key, value in _given(item):
        if key.endswith(ending) and isinstance(value, float):
            yield Quantity(key, value)


def _given(table: Table, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted key, value) of a table and those in it."""
    for key, value in table:
        yield prefix + key, value
        if isinstance(value, Table):
            yield from _given(value, f"{prefix}{key}.")

"""Masses against radii, inertias against masses.

A disc of steel of radius r and face width b has m = ρ π r² b and I = m r²/2 about its shaft, a rim
I = m r². Radii here are base radii (carrier: planet-centre circle): the body may be larger, up to
twice, or sit on a shaft that is thinner.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from ..stages.bodies import Body, ParallelGear
from ..stages.part import Member, Part, Role
from .finding import Finding


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


STEEL = 7850.0  # kg/m³
# Face width over radius of a full steel disc of that mass. Wheels are 0.05 wide and may be webbed
# or of plastic (a thirtieth of the mass); pinions are 5 wide and may be one with a long shaft.
THINNEST, THICKEST = 1e-3, 100.0
# I/(m r²). Gears: 0.5 full discs, 1.3²/2 with the teeth of a small pinion, 2 wide rims; down to
# 0.1 one with a thin shaft. Rings: 1 at the base circle to 2.5 with an outer radius twice that, and
# half as much either way for teeth and flanges. Carriers: a hub alone to plates beyond the planets.
INERTIA_RANGES: Mapping[BodyKind, tuple[float, float]] = {
    BodyKind.GEAR: (0.1, 3.0),
    BodyKind.RING: (0.5, 4.0),
    BodyKind.CARRIER: (0.1, 5.0),
}
# Of rounding in a file: a thin disc has exactly I_d = I_p/2.
THIN_DISC = 0.99


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


def masses_fit_radii(part: Part) -> Iterator[Finding]:
    """Masses that no disc of the body's radius has, however thick it is."""
    for body in solids(part):
        if not _mass_fits(body):
            disc = STEEL * math.pi * body.radius**3
            reason = (
                f"expected {THINNEST * disc:.3g} to {THICKEST * disc:.3g} kg for a radius of "
                f"{body.radius:.4g} m (a steel disc {THINNEST:g} to {THICKEST:g} radii thick)"
            )
            yield Finding(part.name, f"{body.name}.mass", f"{body.mass:g} kg", reason)


def inertias_fit_masses(part: Part) -> Iterator[Finding]:
    """Polar inertias outside the range of their mass and radius.

    kg m² under a key for I/r², or the other way round, is off by r².
    """
    for body in solids(part):
        if _mass_fits(body) and not _polar_fits(body):
            low, high = (factor * body.mass for factor in INERTIA_RANGES[body.kind])
            yield Finding(
                part.name,
                body.polar.key,
                _written(body.polar),
                f"{_expected(body, body.polar, low, high)} for {body.kind.value} of "
                f"{body.mass:g} kg{_twin(body)}",
            )


def diametral_inertias_fit_polar(part: Part) -> Iterator[Finding]:
    """I_d ≥ I_p/2, which holds for every body, and I_d of a bar a hundred times as slender."""
    for body in solids(part):
        if body.diametral is None or not (_mass_fits(body) and _polar_fits(body)):
            continue
        low, high = body.polar.over_r2 / 2.0, 100.0 * body.mass
        if not THIN_DISC * low <= body.diametral.over_r2 <= high:
            yield Finding(
                part.name,
                body.diametral.key,
                _written(body.diametral),
                f"{_expected(body, body.diametral, low, high)}; about a diameter every body has "
                "at least half of its polar inertia",
            )


def _mass_fits(body: Solid) -> bool:
    disc = STEEL * math.pi * body.radius**3
    return THINNEST * disc <= body.mass <= THICKEST * disc


def _polar_fits(body: Solid) -> bool:
    low, high = INERTIA_RANGES[body.kind]
    return low * body.mass <= body.polar.over_r2 <= high * body.mass


def _written(inertia: MomentOfInertia) -> str:
    return f"{inertia.given:g} {'kg' if inertia.is_reduced else 'kg m²'}"


def _expected(body: Solid, inertia: MomentOfInertia, low: float, high: float) -> str:
    """A range of I/r² in the form that the file has."""
    scale, unit = (1.0, "kg") if inertia.is_reduced else (body.radius**2, "kg m²")
    return f"expected {scale * low:.3g} to {scale * high:.3g} {unit}"


def _twin(body: Solid) -> str:
    """Whether the number fits the key's twin."""
    low, high = INERTIA_RANGES[body.kind]
    over_r2 = body.polar.given / (body.radius**2 if body.polar.is_reduced else 1.0)
    if not low * body.mass <= over_r2 <= high * body.mass:
        return ""
    unit = "kg m²" if body.polar.is_reduced else "kg"
    return f"; it fits {body.polar.twin} ({unit})"

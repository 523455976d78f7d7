"""A planetary stage: sun, ring, carrier and planets (Lin & Parker 1999; the paper, Eq. 1).

In the stage's frame planet p stands at angle φ_p on the carrier; u is along x (planets: radial),
v along y (planets: tangential), w = r·θ counter-clockwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..contact.involute_mesh import InvolutePair
from .bodies import (
    MOST_PLANETS,
    Bearing,
    BearingMatrix,
    Body,
    Carrier,
    CentralMember,
    Damper,
    Planet,
    PlanetAngles,
    PressureAngle,
    Ring,
    Stiffness,
    Sun,
    bearing,
)
from .geometry import Frame, Vector, radial, tangential
from .given_springs import GivenSpring, bearing_springs, member_springs
from .mesh_tables import CONSTANT_STIFFNESS, Backlash, MeshVariation, Phase, TransmissionError
from .part import Builder, Member, MeshFamily, Part, RigidBody, Role
from .planet_set import PlanetSet, mesh_phases
from .teeth import Gear, check_teeth, half_a_digit

# A radius in a file is a drawing's, rounded to three digits; a wrong tooth count is 3 % or more.
RADIUS_TOLERANCE = 5e-3

MeshStiffness = (
    Stiffness
    | Annotated[
        tuple[Stiffness, ...],
        Field(strict=False, description="a list with one for each planet (N/m)"),
    ]
)


class PlanetaryStage(Part):
    """Sun, ring, carrier and N planets, three degrees of freedom each (Lin & Parker 1999).

    ``ring_mesh_phase``: how far a planet's ring mesh is behind its sun mesh (mesh periods).
    """

    type: Literal["planetary"]
    planets: Annotated[int, Field(ge=2, le=MOST_PLANETS)] | None = None
    planet_angles: PlanetAngles | None = None
    pressure_angle: PressureAngle | None = None
    sun_pressure_angle: PressureAngle | None = None
    ring_pressure_angle: PressureAngle | None = None
    sun_mesh_stiffness: MeshStiffness
    ring_mesh_stiffness: MeshStiffness
    sun_mesh_variation: MeshVariation = CONSTANT_STIFFNESS
    ring_mesh_variation: MeshVariation = CONSTANT_STIFFNESS
    sun_mesh_transmission_error: TransmissionError | None = None
    ring_mesh_transmission_error: TransmissionError | None = None
    sun_mesh_backlash: Backlash = 0.0
    ring_mesh_backlash: Backlash = 0.0
    ring_mesh_phase: Phase | None = None
    planet_bearing: Stiffness | BearingMatrix | None = None
    planet_bearing_radial: Stiffness | None = None
    planet_bearing_tangential: Stiffness | None = None
    planet_bearing_damping: Damper | BearingMatrix | None = None
    sun: Sun
    ring: Ring
    carrier: Carrier
    planet: Planet

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._require_one_of(("planets",), ("planet_angles",))
        self._require_one_of(("pressure_angle",), ("sun_pressure_angle", "ring_pressure_angle"))
        self._require_one_of(
            ("planet_bearing",), ("planet_bearing_radial", "planet_bearing_tangential")
        )
        self._check_radius("carrier.radius", self.carrier.radius, self.carrier_radius)
        self._check_radius("ring.base_radius", self.ring.base_radius, self.ring_radius)
        self._check_planet_spacing()
        check_teeth(
            {
                "sun.teeth": (self.sun.teeth, self.sun.base_radius),
                "planet.teeth": (self.planet.teeth, self.planet.base_radius),
                "ring.teeth": (self.ring.teeth, self.ring_radius),
            }
        )
        for key in ("sun_mesh_stiffness", "ring_mesh_stiffness"):
            self._check_one_per_planet(key)
        return self

    def _check_one_per_planet(self, key: str) -> None:
        given = getattr(self, key)
        if isinstance(given, tuple) and len(given) != self.planet_count:
            raise ValueError(
                f"{key} = {list(given)}: {len(given)} values for {self.planet_count} planets; "
                "give one number, or one for each planet"
            )

    def _check_radius(self, key: str, given: float | None, computed: float) -> None:
        if given is not None and abs(given - computed) > RADIUS_TOLERANCE * computed:
            raise ValueError(
                f"{key} = {given}: contradicts the geometry; the base radii and pressure angles "
                f"give {computed:.6g} m (agree within {RADIUS_TOLERANCE:.1%}, or leave the key out)"
            )

    def _check_planet_spacing(self) -> None:
        given = f"planets = {self.planets}"
        if self.planet_angles is not None:
            given = f"planet_angles = {list(self.planet_angles)}"
        pitch_radius = self.planet.base_radius / math.cos(self.sun_mesh_angle)
        for (i, first), (j, second) in combinations(enumerate(self.angles, start=1), 2):
            distance = 2.0 * self.carrier_radius * abs(math.sin((first - second) / 2.0))
            if distance < 1e-9 * self.carrier_radius:
                raise ValueError(
                    f"{given}: puts planets {i} and {j} at the same place; "
                    "every planet needs its own angle"
                )
            if distance < 2.0 * pitch_radius:
                raise ValueError(
                    f"{given}: makes planets {i} and {j} overlap; their centres are "
                    f"{distance:.4g} m apart, less than two pitch radii "
                    f"({2.0 * pitch_radius:.4g} m); use fewer or smaller planets, or wider angles"
                )

    @property
    def planet_count(self) -> int:
        """Number of planets N."""
        return len(self.angles)

    @property
    def angles(self) -> tuple[float, ...]:
        """Position angle of each planet (rad)."""
        if self.planet_angles is not None:
            return tuple(math.radians(angle) for angle in self.planet_angles)
        assert self.planets is not None
        return tuple(2.0 * math.pi * p / self.planets for p in range(self.planets))

    @property
    def sun_mesh_angle(self) -> float:
        """Pressure angle of the sun-planet meshes (rad)."""
        return math.radians(self._first_given(self.pressure_angle, self.sun_pressure_angle))

    @property
    def ring_mesh_angle(self) -> float:
        """Pressure angle of the ring-planet meshes (rad)."""
        return math.radians(self._first_given(self.pressure_angle, self.ring_pressure_angle))

    @staticmethod
    def _first_given(*values: float | None) -> float:
        return next(value for value in values if value is not None)

    @property
    def planet_support(self) -> Bearing:
        """A planet's bearing, radial and tangential."""
        each = (self.planet_bearing_radial, self.planet_bearing_tangential)
        return bearing(self.planet_bearing, each, self.planet_bearing_damping)

    @property
    def sun_meshes(self) -> tuple[float, ...]:
        """Stiffness of each planet's mesh with the sun (N/m)."""
        return self._per_planet(self.sun_mesh_stiffness)

    @property
    def ring_meshes(self) -> tuple[float, ...]:
        """Stiffness of each planet's mesh with the ring (N/m)."""
        return self._per_planet(self.ring_mesh_stiffness)

    def _per_planet(self, given: float | tuple[float, ...]) -> tuple[float, ...]:
        return given if isinstance(given, tuple) else (given,) * self.planet_count

    @property
    def carrier_radius(self) -> float:
        """(r_s + r_p)/cos α_s, the centre distance of sun and planet (m)."""
        return (self.sun.base_radius + self.planet.base_radius) / math.cos(self.sun_mesh_angle)

    @property
    def ring_radius(self) -> float:
        """r_p + d·cos α_r, the ring's base radius at the same centre distance d (m)."""
        return self.planet.base_radius + self.carrier_radius * math.cos(self.ring_mesh_angle)

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of a body (m)."""
        return {
            "sun": self.sun.base_radius,
            "ring": self.ring_radius,
            "carrier": self.carrier_radius,
        }[body]

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies a coupling can join: planets are none."""
        return ("sun", "ring", "carrier")

    def members(self) -> tuple[Member, ...]:
        """Sun, ring and carrier about one centre, and the planets on the carrier's circle."""
        to_pitch = 1.0 / math.cos(self.sun_mesh_angle)
        pitch = {
            Role.SUN: self.sun.base_radius * to_pitch,
            Role.RING: self.ring_radius / math.cos(self.ring_mesh_angle),
            Role.CARRIER: self.carrier_radius,
        }
        central = (
            self._member(role, role, self.radius(role), pitch_radius, np.zeros(3))
            for role, pitch_radius in pitch.items()
        )
        r = self.planet.base_radius
        planets = (
            self._member(
                f"planet{number}", Role.PLANET, r, r * to_pitch, self.carrier_radius * radial(angle)
            )
            for number, angle in enumerate(self.angles, start=1)
        )
        return (*central, *planets)

    def _member(
        self, name: str, role: Role, radius: float, pitch_radius: float, centre: Vector
    ) -> Member:
        body: Sun | Ring | Carrier | Planet = getattr(self, role)
        return Member(
            f"{self.name}.{name}",
            role,
            radius,
            {"u": body.mass, "v": body.mass, "w": body.rotary_mass(radius)},
            pitch_radius,
            centre,
            teeth=getattr(body, "teeth", None),
            table=role,
        )

    @property
    def drive_points(self) -> tuple[str, ...]:
        """The sun's, across and about its axis."""
        return (f"{self.name}.sun.u", f"{self.name}.sun.w")

    @property
    def caption(self) -> str:
        """How many planets."""
        return f"{self.planet_count} planets"

    def describe(self) -> str:
        """Planets, ratio and the radii that follow.

        w_s + w_r = w_c (cos α_s + cos α_r) where no mesh is strained (the paper, Eq. 1).
        """
        cosines = math.cos(self.sun_mesh_angle) + math.cos(self.ring_mesh_angle)
        ratio = self.carrier_radius * cosines / self.sun.base_radius
        n = self.planet_count
        return (
            f"planetary, {n} planets, sun to carrier {ratio:.4g} with the ring held, ring radius "
            f"{self.ring_radius:.4g} m, carrier radius {self.carrier_radius:.4g} m, "
            f"{9 + 3 * n} DoFs"
        )

    @property
    def planet_set(self) -> PlanetSet:
        """Its planets between sun and ring."""
        return PlanetSet(
            stage=self.name,
            sun=f"{self.name}.sun",
            ring=f"{self.name}.ring",
            carrier=f"{self.name}.carrier",
            planets=self._planets,
            angles=self.angles,
            counted=self.planets is not None,
            sun_teeth=self.sun.teeth,
            ring_teeth=self.ring.teeth,
            planet_teeth=self.planet.teeth,
            sun_angle=self.sun_mesh_angle,
            ring_angle=self.ring_mesh_angle,
            one_angle=self.pressure_angle is not None,
            ring_mesh_phase=self.ring_mesh_phase,
            meshes_alike=len(set(self.sun_meshes)) == len(set(self.ring_meshes)) == 1,
        )

    @property
    def _planets(self) -> tuple[str, ...]:
        return tuple(f"{self.name}.planet{p}" for p in range(1, self.planet_count + 1))

    def planet_sets(self) -> tuple[PlanetSet, ...]:
        """The one it has."""
        return (self.planet_set,)

    def mesh_families(self) -> tuple[MeshFamily, ...]:
        """The sun's meshes and the ring's."""
        r_p = self.planet.base_radius
        return (
            self._family("sun", self.sun_meshes, min(self.sun.base_radius, r_p)),
            self._family("ring", self.ring_meshes, r_p),
        )

    def _family(self, gear: str, stiffness: tuple[float, ...], smaller: float) -> MeshFamily:
        angle: float = getattr(self, f"{gear}_mesh_angle")
        return MeshFamily(
            f"{gear}_mesh",
            f"{self.name}.{gear}",
            self._planets,
            stiffness,
            2.0 * smaller / math.cos(angle),
            getattr(self, f"{gear}_mesh_variation"),
            getattr(self, f"{gear}_mesh_transmission_error"),
            getattr(self, f"{gear}_mesh_backlash"),
        )

    def mesh_phases(
        self, speeds: Mapping[str, float], flanks: Mapping[str, float]
    ) -> Mapping[str, float]:
        """The planets', one after the other as teeth pass them: see `planet_set`."""
        sun, ring = self.mesh_families()
        # Positive w is counter-clockwise in the stage's frame; a flank of 1: the sun pushes so.
        turning = speeds[f"{self.name}.sun"] - speeds[f"{self.name}.carrier"]
        pushes = flanks[sun.names[0]]
        phases = mesh_phases(self.planet_set, turning=turning, sun_drives=pushes * turning > 0.0)
        return dict(zip(sun.names + ring.names, phases.sun + phases.ring, strict=True))

    def gears(self) -> Sequence[Gear]:
        """Those that have teeth.

        The ring where its own radius or two pressure angles are given: that of a standard set has
        no radius of its own, its teeth are judged by the others'.
        """
        found = [gear for gear in super().gears() if gear.name != "ring"]
        teeth, given = self.ring.teeth, self.ring.base_radius
        if teeth is not None and given is not None:
            found.append(Gear.written("ring", teeth, given))
        elif teeth is not None and self.pressure_angle is None:
            found.append(Gear("ring", teeth, self.ring_radius, *self._ring_radii()))
        return found

    def _ring_radii(self) -> tuple[float, float]:
        """Least and largest r_p + (r_s + r_p) cos α_r/cos α_s that the digits allow."""
        assert self.sun_pressure_angle is not None
        assert self.ring_pressure_angle is not None
        given = self.sun_pressure_angle, self.ring_pressure_angle
        (sun_least, sun_largest), (ring_least, ring_largest) = (
            (math.cos(math.radians(angle + half)), math.cos(math.radians(angle - half)))
            for angle, half in ((angle, half_a_digit(angle)) for angle in given)
        )
        s, p = self.sun.base_radius, self.planet.base_radius
        h_s, h_p = min(half_a_digit(s), s / 2.0), min(half_a_digit(p), p / 2.0)
        least = p - h_p + (s + p - h_s - h_p) * ring_least / sun_largest
        largest = p + h_p + (s + p + h_s + h_p) * ring_largest / sun_least
        return least, largest

    def given_springs(self) -> Iterator[GivenSpring]:
        """The meshes, the planets' bearings, bearings and supports of the central members."""
        yield from super().given_springs()
        planets = tuple(planet.partition(".")[2] for planet in self._planets)
        matrix = self.planet_support.stiffness
        yield from bearing_springs(
            self, "planet_bearing", ("radial", "tangential"), planets, matrix
        )
        for name, member in (("sun", self.sun), ("ring", self.ring), ("carrier", self.carrier)):
            yield from member_springs(name, member, self.radius(name))

    def build(self, builder: Builder, frame: Frame) -> dict[str, RigidBody]:
        """Planar bodies on their bearings, the planets' on the carrier, and the meshes."""
        members = self.members()
        bodies: dict[str, RigidBody] = {}
        for member in members[:3]:
            bodies[member.body] = self._build_central(builder, member, frame)
        for number, (planet, angle) in enumerate(zip(members[3:], self.angles, strict=True)):
            body = _build_body(builder, planet, self.planet, angle, frame)
            bodies[planet.body] = body
            carrier = bodies[f"{self.name}.carrier"]
            axes = _planet_axes(angle, frame)
            _build_bearing(builder, self.planet_support, body, axes, carrier)
            for family, kind, radius in zip(
                self.mesh_families(),
                (1.0, -1.0),
                (self.sun.base_radius, self.ring_radius),
                strict=True,
            ):
                x, y, _ = body.centre - carrier.centre
                builder.mesh(
                    family.names[number],
                    bodies[family.gear],
                    body,
                    InvolutePair((float(x), float(y)), (radius, planet.radius), kind, frame.facing),
                    family.stiffness[number],
                )
        return bodies

    def _build_central(self, builder: Builder, member: Member, frame: Frame) -> RigidBody:
        table: CentralMember = getattr(self, member.role)
        body = _build_body(builder, member, table, 0.0, frame)
        _build_bearing(builder, table.support, body, frame.axes)
        builder.torsion_spring(body, table.torsional_support_at(member.radius) * member.radius**2)
        return body


def _build_body(
    builder: Builder, member: Member, table: Body, angle: float, frame: Frame
) -> RigidBody:
    """A body with u along the direction at ``angle``, v across, and w."""
    r = member.radius
    inertia = table.rotary_mass(r) * r**2
    body = builder.planar_body(frame.point(member.centre), table.mass, inertia)
    for dof, direction in (("u", radial(angle)), ("v", tangential(angle))):
        x, y, _ = frame.direction(direction)
        builder.add_dof(f"{member.body}.{dof}", (body, 0, x), (body, 1, y))
    builder.add_dof(f"{member.body}.w", (body, body.rotation, frame.facing / r))
    return body


def _build_bearing(
    builder: Builder,
    support: Bearing,
    body: RigidBody,
    axes: Vector,
    carrier: RigidBody | None = None,
) -> None:
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    stiffness[:2, :2] = support.stiffness
    damping[:2, :2] = support.damping_for(builder.beta)
    builder.bearing(body, stiffness, damping, support=carrier, axes=axes)


def _planet_axes(angle: float, frame: Frame) -> Vector:
    """Radial, tangential and axial direction of a planet, in global coordinates."""
    e_r, e_t = radial(angle), tangential(angle)
    return np.column_stack([frame.direction(e) for e in (e_r, e_t, np.cross(e_r, e_t))])

"""The parameters of a drivetrain: frozen, validated, SI.

One class per table of a model file, with the file's own keys (angles in degrees, as the file has
them; every property that computes with an angle returns radians). The tables of single bodies are
in `bodies`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from itertools import combinations
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ..representation import listing
from .bodies import (
    MOST_PLANETS,
    Bearing,
    BearingMatrix,
    Carrier,
    Damper,
    Degrees,
    Inertia,
    Name,
    ParallelGear,
    Planet,
    PlanetAngles,
    PressureAngle,
    Ring,
    Stiffness,
    Sun,
    Table,
    Title,
    bearing,
    physical,
)
from .couplings import DIRECTIONS, Coupling, Translation
from .dof_radii import dof_radii
from .excitation_tables import ExcitationTable, require_dof
from .graph import Joined, facings, groups, joined
from .mesh_tables import CONSTANT_STIFFNESS, Backlash, MeshVariation, Phase, TransmissionError
from .operation import Operation

__all__ = [
    "Carrier",
    "Coupling",
    "Damping",
    "Drivetrain",
    "Inertia",
    "Operation",
    "ParallelGear",
    "ParallelStage",
    "Part",
    "Planet",
    "PlanetaryStage",
    "Ring",
    "Sun",
    "Translation",
]

# A radius in a file is a drawing's, rounded to three digits; a wrong tooth count is 3 % or more.
RADIUS_TOLERANCE = 5e-3
# Teeth only say how often a mesh is passed; radii rounded more coarsely still fit them.
TEETH_TOLERANCE = 0.02


class Damping(Table):
    """Element-wise proportional damping: c = β k of every spring, α M on every inertia.

    ``stiffness_proportional`` is β (s), ``mass_proportional`` is α (1/s).
    """

    stiffness_proportional: Annotated[
        float, Field(ge=0.0, json_schema_extra={"unit": "s"}), physical(1e-15, 1.0, "s")
    ] = 0.0
    mass_proportional: Annotated[
        float, Field(ge=0.0, json_schema_extra={"unit": "1/s"}), physical(1e-12, 1e6, "1/s")
    ] = 0.0


def check_teeth(gears: Mapping[str, tuple[int | None, float]]) -> None:
    """Refuse tooth numbers that are not as the base radii (key → teeth, base radius)."""
    given = [(key, teeth, radius) for key, (teeth, radius) in gears.items() if teeth is not None]
    for (first, z_1, r_1), (second, z_2, r_2) in combinations(given, 2):
        expected = z_1 * r_2 / r_1
        if abs(z_2 - expected) > TEETH_TOLERANCE * expected:
            slip = max(r_1, r_2) if not 0.1 < expected / z_2 < 10.0 else None
            in_mm = f"; is {slip:g} m in mm?" if slip else ""
            raise ValueError(
                f"{second} = {z_2}: contradicts {first} = {z_1}; base_radius {r_2:g} and {r_1:g} m "
                f"give {expected:.4g} (agree within {TEETH_TOLERANCE:.0%}, or leave one out){in_mm}"
            )


MeshStiffness = (
    Stiffness
    | Annotated[
        tuple[Stiffness, ...],
        Field(strict=False, description="a list with one for each planet (N/m)"),
    ]
)


class ParallelStage(Table):
    """A pair of gears on parallel shafts (seed paper, Eqs. 4–9)."""

    type: Literal["parallel"]
    name: Name
    helix_angle: Annotated[Degrees, Field(gt=-90.0, lt=90.0)] = 0.0
    # It places the two bodies. The linear system does not depend on it: y is along the line of
    # action whatever the angle.
    pressure_angle: PressureAngle = 20.0
    mesh_stiffness: Stiffness
    mesh_variation: MeshVariation = CONSTANT_STIFFNESS
    mesh_transmission_error: TransmissionError | None = None
    mesh_backlash: Backlash = 0.0
    pinion: ParallelGear
    wheel: ParallelGear

    @model_validator(mode="after")
    def _teeth_fit(self) -> Self:
        gears = {"pinion": self.pinion, "wheel": self.wheel}
        check_teeth({f"{k}.teeth": (gear.teeth, gear.base_radius) for k, gear in gears.items()})
        return self

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies a coupling can join."""
        return ("pinion", "wheel")

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of a body (m)."""
        gear: ParallelGear = getattr(self, body)
        return gear.base_radius


class PlanetaryStage(Table):
    """Sun, ring, carrier and N planets, three degrees of freedom each (Lin & Parker 1999).

    ``ring_mesh_phase``: how far a planet's ring mesh is behind its sun mesh (mesh periods).
    """

    type: Literal["planetary"]
    name: Name
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
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies a coupling can join."""
        return ("sun", "ring", "carrier")

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


Stage = Annotated[ParallelStage | PlanetaryStage, Field(discriminator="type")]


Part = ParallelStage | PlanetaryStage | Inertia


class Drivetrain(Table):
    """A whole drivetrain: stages, plain inertias, and the couplings that join them."""

    name: Title
    source: Title = ""
    damping: Damping = Damping()
    operation: Operation | None = None
    stages: Annotated[
        tuple[Stage, ...],
        Field(alias="stage", strict=False, description="[[stage]] tables"),
    ] = ()
    inertias: Annotated[
        tuple[Inertia, ...],
        Field(alias="inertia", strict=False, description="[[inertia]] tables"),
    ] = ()
    couplings: Annotated[
        tuple[Coupling, ...],
        Field(alias="coupling", strict=False, description="[[coupling]] tables"),
    ] = ()
    excitations: Annotated[
        tuple[ExcitationTable, ...],
        Field(alias="excitation", strict=False, description="[[excitation]] tables"),
    ] = ()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not self.parts:
            raise ValueError("there is nothing in it; give at least one [[stage]] or [[inertia]]")
        names = Counter(item.name for item in (*self.parts, *self.couplings))
        name, times = names.most_common(1)[0]
        if times > 1:
            raise ValueError(
                f"name = '{name}': used {times} times; every stage, inertia and coupling needs a "
                "name of its own"
            )
        known = set(self.bodies)
        for i, coupling in enumerate(self.couplings):
            for key in ("first", "second"):
                if getattr(coupling, key) not in known:
                    raise ValueError(
                        f"coupling[{i}] '{coupling.name}': {key} = {getattr(coupling, key)!r}: "
                        f"not a body of this drivetrain; allowed: {listing(self.bodies)}"
                    )
            self._check_translations(i, coupling)
        self._check_operation()
        for i, excitation in enumerate(self.excitations):
            require_dof(f"excitation[{i}]: ", excitation.dof, dof_radii(self))
        return self

    def _check_operation(self) -> None:
        for key in ("input", "output"):
            body = getattr(self.operation, key, None)
            if body is not None and body not in self.bodies:
                raise ValueError(
                    f"operation: {key} = {body!r}: not a body of this drivetrain; "
                    f"allowed: {listing(self.bodies)}"
                )

    def _check_translations(self, i: int, coupling: Coupling) -> None:
        for dof in coupling.dofs:
            for body in (coupling.first, coupling.second):
                own = self.translations(body)
                if DIRECTIONS[dof] not in own:
                    has = f"only {', '.join(own.values())}" if own else "none"
                    raise ValueError(
                        f"coupling[{i}] '{coupling.name}': dofs.{dof}: {body} has no translation "
                        f"along it ({has}); both ends must have it"
                    )

    @property
    def parts(self) -> tuple[Part, ...]:
        """Stages and inertias: what couplings join, and what substructures are made of."""
        return (*self.stages, *self.inertias)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies a coupling can join."""
        of_stages = [f"{stage.name}.{body}" for stage in self.stages for body in stage.bodies]
        return (*of_stages, *(inertia.name for inertia in self.inertias))

    def part(self, name: str) -> Part:
        """The stage or inertia of that name."""
        return self._by_name[name]

    def stage(self, name: str) -> ParallelStage | PlanetaryStage:
        """The stage of that name."""
        return next(stage for stage in self.stages if stage.name == name)

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of ``<stage>.<body>`` or of an inertia (m)."""
        name, _, member = body.partition(".")
        part = self.part(name)
        return part.radius if isinstance(part, Inertia) else part.radius(member)

    def translations(self, body: str) -> dict[str, str]:
        """What a body's translations are called, by direction."""
        part = self.part(body.partition(".")[0])
        if isinstance(part, Inertia):
            return {}
        own = ("y", "z") if isinstance(part, ParallelStage) else ("u", "v")
        return {DIRECTIONS[dof]: dof for dof in own}

    @cached_property
    def _by_name(self) -> Mapping[str, Part]:
        return {part.name: part for part in self.parts}

    @cached_property
    def joined(self) -> Joined:
        """(own body, other body) of every coupling of a part, by its name."""
        return joined(self._by_name, self.couplings)

    @cached_property
    def facing(self) -> Mapping[str, float]:
        """Side each part is seen from (±1), so that coupled bodies turn the same way."""
        return facings(self)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values; what was derived from the old ones is left behind."""
        copy = super().model_copy(update=update, deep=deep)
        for name in ("_by_name", "joined", "facing"):
            copy.__dict__.pop(name, None)
        return copy

    def groups(self) -> tuple[frozenset[str], ...]:
        """Parts that turn together, as sets of names (connected through couplings)."""
        transmitting = (coupling for coupling in self.couplings if coupling.transmits)
        return tuple(map(frozenset, groups(joined(self._by_name, transmitting))))

    def warnings(self) -> tuple[str, ...]:
        """What is allowed but probably not meant."""
        main = max(self.groups(), key=len)
        others = listing(sorted(main))
        return tuple(
            f"{'inertia' if isinstance(part, Inertia) else 'stage'} '{part.name}' is not connected "
            f"to the rest: no torque passes, every FRF between it and {others} is "
            "zero, and each unconnected part has rigid-body modes of its own"
            for part in self.parts
            if part.name not in main
        )

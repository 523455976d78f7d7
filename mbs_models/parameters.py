"""The parameters of a drivetrain: frozen, validated, SI.

One class per table of a model file, with the file's own keys (angles in degrees, as the file has
them; every property that computes with an angle returns radians). Quantities that the file may
give as ``…_over_r2`` (seen at the base radius, the field's usual form) or physically are read
through methods that take the radius and return one of the two forms, so that nobody downstream
asks which was given.
"""

from __future__ import annotations

import math
from itertools import combinations
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

# Quantities: a number with its bounds and, for messages and the JSON schema, its unit.
Mass = Annotated[float, Field(gt=0.0, json_schema_extra={"unit": "kg"})]
Inertia = Annotated[float, Field(gt=0.0, json_schema_extra={"unit": "kg m²"})]
HubMass = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "kg"})]
HubInertia = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "kg m²"})]
Stiffness = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "N/m"})]
RotaryStiffness = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "N m/rad"})]
Radius = Annotated[float, Field(ge=1e-6, le=1e3, json_schema_extra={"unit": "m"})]
Angle = Annotated[float, Field(json_schema_extra={"unit": "deg"})]
PressureAngle = Annotated[Angle, Field(gt=0.0, le=45.0)]
PlanetAngles = Annotated[
    tuple[Angle, ...],
    Field(min_length=2, strict=False, description="a list of at least 2 angles (deg)"),
]
Name = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$"),
    Field(description="a letter or _, then letters, digits, _ or -"),
]

# A radius in a file is a drawing's, rounded to three digits; a wrong tooth count is 3 % or more.
RADIUS_TOLERANCE = 5e-3


class Table(BaseModel):
    """A table of a model file: frozen, unknown keys refused, numbers finite."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, strict=True, populate_by_name=True
    )

    def _require_one_of(self, *alternatives: tuple[str, ...]) -> None:
        """Refuse all but one of several ways to say the same thing."""
        given = [
            keys for keys in alternatives if any(getattr(self, key) is not None for key in keys)
        ]
        written = " or ".join(" and ".join(f"'{key}'" for key in keys) for keys in alternatives)
        if not given:
            raise ValueError(f"give exactly one of {written}; neither is there")
        if len(given) > 1:
            both = [key for keys in given for key in keys if getattr(self, key) is not None]
            values = ", ".join(f"{key} = {getattr(self, key)}" for key in both)
            raise ValueError(f"give exactly one of {written}; both are there ({values})")
        for key in given[0]:
            if getattr(self, key) is None:
                raise ValueError(f"'{key}' is missing; {written} must be given in full")

    def _over_r2(self, key: str, radius: float) -> float:
        """The quantity ``key`` seen at ``radius``, whichever of its two forms the file gives."""
        reduced: float | None = getattr(self, f"{key}_over_r2")
        return reduced if reduced is not None else getattr(self, key) / radius**2


class Body(Table):
    """A rigid gear body: its mass (kg) and polar moment of inertia (kg m², or I/r² in kg)."""

    mass: Mass
    polar_inertia: Inertia | None = None
    polar_inertia_over_r2: Mass | None = None

    @model_validator(mode="after")
    def _one_polar_inertia(self) -> Self:
        self._require_one_of(("polar_inertia",), ("polar_inertia_over_r2",))
        return self

    def rotary_mass(self, radius: float) -> float:
        """I/r², the inertia of the coordinate w = r·θ (kg)."""
        return self._over_r2("polar_inertia", radius)


class ParallelGear(Body):
    """Pinion or wheel of a parallel stage, with its bearing: y along the transverse line of action,
    z axial, rocking about y (Kahraman 1993; seed paper, Table 1)."""

    base_radius: Radius
    diametral_inertia: Inertia | None = None
    diametral_inertia_over_r2: Mass | None = None
    bearing_y: Stiffness
    bearing_z: Stiffness
    bearing_rocking: RotaryStiffness | None = None
    bearing_rocking_over_r2: Stiffness | None = None

    @model_validator(mode="after")
    def _one_form_each(self) -> Self:
        self._require_one_of(("diametral_inertia",), ("diametral_inertia_over_r2",))
        self._require_one_of(("bearing_rocking",), ("bearing_rocking_over_r2",))
        return self

    @property
    def rocking_mass(self) -> float:
        """I_diametral/r², the inertia of the rocking coordinate r·ρ (kg)."""
        return self._over_r2("diametral_inertia", self.base_radius)

    @property
    def rocking_stiffness(self) -> float:
        """The bearing's rocking stiffness seen at the base radius (N/m)."""
        return self._over_r2("bearing_rocking", self.base_radius)


class CentralMember(Body):
    """Sun, ring or carrier: a body on an (an)isotropic bearing and a torsional support.

    ``torsional_support`` is in N/m at the member's radius (base radius; carrier: planet-centre
    circle); its physical twin ``torsional_stiffness`` is in N m/rad.
    """

    bearing: Stiffness | None = None
    bearing_u: Stiffness | None = None
    bearing_v: Stiffness | None = None
    torsional_support: Stiffness | None = None
    torsional_stiffness: RotaryStiffness | None = None

    @model_validator(mode="after")
    def _one_form_of_each_support(self) -> Self:
        self._require_one_of(("bearing",), ("bearing_u", "bearing_v"))
        self._require_one_of(("torsional_support",), ("torsional_stiffness",))
        return self

    @property
    def bearing_stiffness(self) -> tuple[float, float]:
        """Bearing stiffness along u and v (N/m)."""
        if self.bearing is not None:
            return self.bearing, self.bearing
        assert self.bearing_u is not None
        assert self.bearing_v is not None
        return self.bearing_u, self.bearing_v

    def torsional_support_at(self, radius: float) -> float:
        """The torsional support seen at ``radius`` (N/m)."""
        if self.torsional_support is not None:
            return self.torsional_support
        assert self.torsional_stiffness is not None
        return self.torsional_stiffness / radius**2


class Sun(CentralMember):
    """The sun gear."""

    base_radius: Radius


class Ring(CentralMember):
    """The ring gear; its base radius follows from sun and planet, and is checked where given."""

    base_radius: Radius | None = None


class Carrier(CentralMember):
    """The carrier; the radius of its planet-centre circle follows, and is checked where given."""

    radius: Radius | None = None


class Planet(Body):
    """A planet gear (all planets of a stage are alike)."""

    base_radius: Radius


class Damping(Table):
    """Element-wise proportional damping: c = β k of every spring, α M on every inertia.

    ``stiffness_proportional`` is β (s), ``mass_proportional`` is α (1/s).
    """

    stiffness_proportional: Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "s"})] = 0.0
    mass_proportional: Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "1/s"})] = 0.0


class ParallelStage(Table):
    """A pair of gears on parallel shafts (seed paper, Eqs. 4–9)."""

    type: Literal["parallel"]
    name: Name
    helix_angle: Annotated[Angle, Field(gt=-90.0, lt=90.0)] = 0.0
    # It places the two bodies. The linear system does not depend on it: y is along the line of
    # action whatever the angle.
    pressure_angle: PressureAngle = 20.0
    mesh_stiffness: Stiffness
    pinion: ParallelGear
    wheel: ParallelGear

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies a coupling can join."""
        return ("pinion", "wheel")

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of a body (m)."""
        gear: ParallelGear = getattr(self, body)
        return gear.base_radius


class PlanetaryStage(Table):
    """Sun, ring, carrier and N planets, three degrees of freedom each (Lin & Parker 1999)."""

    type: Literal["planetary"]
    name: Name
    planets: Annotated[int, Field(ge=2, le=100)] | None = None
    planet_angles: PlanetAngles | None = None
    pressure_angle: PressureAngle | None = None
    sun_pressure_angle: PressureAngle | None = None
    ring_pressure_angle: PressureAngle | None = None
    sun_mesh_stiffness: Stiffness
    ring_mesh_stiffness: Stiffness
    planet_bearing: Stiffness | None = None
    planet_bearing_radial: Stiffness | None = None
    planet_bearing_tangential: Stiffness | None = None
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
        return self

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
    def planet_bearing_stiffness(self) -> tuple[float, float]:
        """Stiffness of a planet bearing, radial and tangential (N/m)."""
        if self.planet_bearing is not None:
            return self.planet_bearing, self.planet_bearing
        assert self.planet_bearing_radial is not None
        assert self.planet_bearing_tangential is not None
        return self.planet_bearing_radial, self.planet_bearing_tangential

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


class Coupling(Table):
    """A hub between two bodies: first body – spring – hub – spring – second body.

    Both springs act between r·θ of body and hub at ``radius``; ``"rigid"`` makes hub and body one,
    0 leaves them apart. When the stages are split, each takes half of the hub.
    """

    name: Name
    first: str
    second: str
    radius: Radius
    inertia: HubInertia | None = None
    inertia_over_r2: HubMass | None = None
    first_stiffness: Stiffness | Literal["rigid"]
    second_stiffness: Stiffness | Literal["rigid"]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._require_one_of(("inertia",), ("inertia_over_r2",))
        if self.first.partition(".")[0] == self.second.partition(".")[0]:
            raise ValueError(
                f"second = {self.second!r}: lies in the same stage as first = {self.first!r}; "
                "a coupling joins bodies of two stages"
            )
        if 0.0 in (self.inertia, self.inertia_over_r2) and not self.has_rigid_end:
            key = "inertia" if self.inertia is not None else "inertia_over_r2"
            raise ValueError(
                f"{key} = 0.0: a hub between two springs needs an inertia greater than 0; "
                'it may be 0 only where one end is "rigid"'
            )
        return self

    @property
    def hub_mass(self) -> float:
        """I/r² of the hub at the coupling's radius (kg)."""
        return self._over_r2("inertia", self.radius)

    @property
    def has_rigid_end(self) -> bool:
        """Whether the hub is one with a body."""
        return "rigid" in (self.first_stiffness, self.second_stiffness)

    @property
    def ends(self) -> tuple[tuple[str, float | Literal["rigid"]], ...]:
        """The two ends as (body, stiffness)."""
        return ((self.first, self.first_stiffness), (self.second, self.second_stiffness))

    @property
    def transmits(self) -> bool:
        """Whether both ends hold the hub, so that torque passes."""
        return self.first_stiffness != 0.0 and self.second_stiffness != 0.0


class Drivetrain(Table):
    """A whole drivetrain: stages and the couplings that join them."""

    name: str
    source: str = ""
    damping: Damping = Damping()
    stages: Annotated[
        tuple[Stage, ...],
        Field(
            alias="stage", min_length=1, strict=False, description="at least one [[stage]] table"
        ),
    ]
    couplings: Annotated[
        tuple[Coupling, ...],
        Field(alias="coupling", strict=False, description="[[coupling]] tables"),
    ] = ()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        names = [item.name for item in (*self.stages, *self.couplings)]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(
                    f"name = '{name}': used {names.count(name)} times; every stage and coupling "
                    "needs a name of its own"
                )
        ends = [f"{stage.name}.{body}" for stage in self.stages for body in stage.bodies]
        for i, coupling in enumerate(self.couplings):
            for key in ("first", "second"):
                if getattr(coupling, key) not in ends:
                    raise ValueError(
                        f"coupling[{i}] '{coupling.name}': {key} = {getattr(coupling, key)!r}: "
                        f"not a body of this drivetrain; allowed: {', '.join(ends)}"
                    )
        return self

    def stage(self, name: str) -> ParallelStage | PlanetaryStage:
        """The stage of that name."""
        return next(stage for stage in self.stages if stage.name == name)

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of ``<stage>.<body>`` (m)."""
        stage, _, part = body.partition(".")
        return self.stage(stage).radius(part)

    def groups(self) -> tuple[frozenset[str], ...]:
        """Stages that move together, as sets of names (connected through couplings)."""
        groups = [{stage.name} for stage in self.stages]
        for coupling in self.couplings:
            if coupling.transmits:
                ends = {coupling.first.partition(".")[0], coupling.second.partition(".")[0]}
                touched = [group for group in groups if group & ends]
                groups = [g for g in groups if g not in touched] + [set().union(*touched)]
        return tuple(frozenset(group) for group in groups)

    def warnings(self) -> tuple[str, ...]:
        """What is allowed but probably not meant."""
        main = max(self.groups(), key=len)
        return tuple(
            f"stage '{stage.name}' is not connected to the rest: no torque passes, every FRF "
            f"between it and {', '.join(sorted(main))} is zero, and each unconnected part has "
            "rigid-body modes of its own"
            for stage in self.stages
            if stage.name not in main
        )

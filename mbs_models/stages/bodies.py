"""The tables of a model file that describe a body: its inertias, and what supports it.

Quantities that the file may give as ``…_over_r2`` (seen at the base radius, the field's usual
form) or physically are read through methods that take the radius and return one of the two forms,
so that nobody downstream asks which was given.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

MOST_PLANETS = 100
# What steers a terminal or turns the direction of writing; SVG has no place for it either
STEERING = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]")
LONGEST_NAME = 200

Matrix2 = tuple[tuple[float, float], tuple[float, float]]


def _symmetric_semidefinite(matrix: Matrix2) -> Matrix2:
    (a, b), (c, d) = matrix
    if b != c:
        raise ValueError(
            f"the cross terms {b} and {c} differ: only symmetric bearings can be analysed"
        )
    if min(a, d) < 0.0 or a * d < b * c:
        raise ValueError("the matrix is not positive semi-definite: the bearing would push")
    return matrix


def physical(least: float, most: float, unit: str) -> AfterValidator:
    """Limits of what is physical, beyond which linear algebra has no digits left; 0 is none of it.

    The bounds a message names first, as 0 for a mass, are the field's own.
    """

    def check(value: float) -> float:
        if value and not least <= abs(value) <= most:
            limits = f"{least:g} to {most:g}".replace("e+0", "e").replace("e+", "e")
            sign = " in magnitude" if value < 0.0 else ""
            raise ValueError(f"must be within {limits}{unit and ' '}{unit}{sign}")
        return value

    return AfterValidator(check)


OF_MASS = physical(1e-15, 1e9, "kg")
OF_INERTIA = physical(1e-18, 1e15, "kg m²")
OF_STIFFNESS = physical(1e-3, 1e15, "N/m")
OF_DAMPER = physical(1e-9, 1e12, "N s/m")

# Quantities: a number with its bounds and, for messages and the JSON schema, its unit.
Mass = Annotated[float, Field(gt=0.0, json_schema_extra={"unit": "kg"}), OF_MASS]
PolarInertia = Annotated[float, Field(gt=0.0, json_schema_extra={"unit": "kg m²"}), OF_INERTIA]
HubMass = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "kg"}), OF_MASS]
HubInertia = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "kg m²"}), OF_INERTIA]
Stiffness = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "N/m"}), OF_STIFFNESS]
Damper = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "N s/m"}), OF_DAMPER]
_Entry = Annotated[float, physical(0.0, 1e15, "")]  # N/m, or N s/m
_Row = Annotated[tuple[_Entry, _Entry], Field(strict=False)]
BearingMatrix = Annotated[
    tuple[_Row, _Row],
    Field(strict=False, description="a symmetric matrix [[a, b], [b, d]]"),
    AfterValidator(_symmetric_semidefinite),
]
RotaryStiffness = Annotated[
    float, Field(ge=0.0, json_schema_extra={"unit": "N m/rad"}), physical(1e-9, 1e18, "N m/rad")
]
Radius = Annotated[float, Field(ge=1e-6, le=1e3, json_schema_extra={"unit": "m"})]
Teeth = Annotated[int, Field(ge=3, le=100000)]
Degrees = Annotated[float, Field(json_schema_extra={"unit": "deg"})]
Angle = Annotated[Degrees, physical(0.0, 3600.0, "deg")]
PressureAngle = Annotated[Degrees, Field(gt=0.0, le=45.0), physical(0.1, 45.0, "deg")]
PlanetAngles = Annotated[
    tuple[Angle, ...],
    Field(
        min_length=2,
        max_length=MOST_PLANETS,
        strict=False,
        description="a list of at least 2 angles (deg)",
    ),
]


def _written(text: str) -> str:
    """Refuse text that is none to read."""
    if found := STEERING.search(text):
        raise ValueError(f"has the character U+{ord(found[0]):04X}; must be printable")
    if len(text) > LONGEST_NAME:
        raise ValueError(f"has {len(text)} characters; at most {LONGEST_NAME} are possible")
    return text


Title = Annotated[str, AfterValidator(_written)]
Name = Annotated[
    Title,
    StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$"),
    Field(description="a letter or _, then letters, digits, _ or -"),
]


@dataclass(frozen=True)
class Bearing:
    """A bearing in two directions: stiffness (N/m) and damping (N s/m), each 2 × 2.

    ``damping`` is None where the file gives none: then it is β times the stiffness.
    """

    stiffness: Matrix2
    damping: Matrix2 | None

    def damping_for(self, beta: float) -> Matrix2:
        """The damping matrix, with β k where the bearing has none of its own (N s/m)."""
        if self.damping is not None:
            return self.damping
        (a, b), (c, d) = self.stiffness
        return (beta * a, beta * b), (beta * c, beta * d)


def isotropic(value: float | Matrix2) -> Matrix2:
    """A number as the same in both directions; a matrix as it is."""
    return value if isinstance(value, tuple) else ((value, 0.0), (0.0, value))


def bearing(
    both: float | Matrix2 | None,
    each: tuple[float | None, float | None],
    damping: float | Matrix2 | None,
) -> Bearing:
    """A bearing from the keys of a file: one value (or matrix), or one for each direction."""
    first, second = each
    if both is None:
        assert first is not None
        assert second is not None
        both = ((first, 0.0), (0.0, second))
    return Bearing(isotropic(both), None if damping is None else isotropic(damping))


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
    polar_inertia: PolarInertia | None = None
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
    z axial, rocking about y (Kahraman 1993; the paper, Table 1).

    ``bearing_y`` and ``bearing_z``, or ``bearing = [[yy, yz], [yz, zz]]``; ``bearing_damping`` (a
    number or such a matrix) takes the place of β k.
    """

    base_radius: Radius
    teeth: Teeth | None = None
    diametral_inertia: PolarInertia | None = None
    diametral_inertia_over_r2: Mass | None = None
    bearing: BearingMatrix | None = None
    bearing_y: Stiffness | None = None
    bearing_z: Stiffness | None = None
    bearing_damping: Damper | BearingMatrix | None = None
    bearing_rocking: RotaryStiffness | None = None
    bearing_rocking_over_r2: Stiffness | None = None

    @model_validator(mode="after")
    def _one_form_each(self) -> Self:
        self._require_one_of(("diametral_inertia",), ("diametral_inertia_over_r2",))
        self._require_one_of(("bearing_y", "bearing_z"), ("bearing",))
        self._require_one_of(("bearing_rocking",), ("bearing_rocking_over_r2",))
        return self

    @property
    def support(self) -> Bearing:
        """The bearing along y and z."""
        return bearing(self.bearing, (self.bearing_y, self.bearing_z), self.bearing_damping)

    @property
    def rocking_mass(self) -> float:
        """I_diametral/r², the inertia of the rocking coordinate r·ρ (kg)."""
        return self._over_r2("diametral_inertia", self.base_radius)

    @property
    def rocking_stiffness(self) -> float:
        """The bearing's rocking stiffness seen at the base radius (N/m)."""
        return self._over_r2("bearing_rocking", self.base_radius)


class CentralMember(Body):
    """Sun, ring or carrier: a body on a bearing and a torsional support.

    ``bearing`` is a number (the same in u and v) or a matrix [[uu, uv], [uv, vv]];
    ``bearing_damping`` (likewise) takes the place of β k.
    ``torsional_support`` is in N/m at the member's radius (base radius; carrier: planet-centre
    circle); its physical twin ``torsional_stiffness`` is in N m/rad.
    """

    bearing: Stiffness | BearingMatrix | None = None
    bearing_u: Stiffness | None = None
    bearing_v: Stiffness | None = None
    bearing_damping: Damper | BearingMatrix | None = None
    torsional_support: Stiffness | None = None
    torsional_stiffness: RotaryStiffness | None = None

    @model_validator(mode="after")
    def _one_form_of_each_support(self) -> Self:
        self._require_one_of(("bearing",), ("bearing_u", "bearing_v"))
        self._require_one_of(("torsional_support",), ("torsional_stiffness",))
        return self

    @property
    def support(self) -> Bearing:
        """The bearing along u and v."""
        return bearing(self.bearing, (self.bearing_u, self.bearing_v), self.bearing_damping)

    def torsional_support_at(self, radius: float) -> float:
        """The torsional support seen at ``radius`` (N/m)."""
        if self.torsional_support is not None:
            return self.torsional_support
        assert self.torsional_stiffness is not None
        return self.torsional_stiffness / radius**2


class Sun(CentralMember):
    """The sun gear."""

    base_radius: Radius
    teeth: Teeth | None = None


class Ring(CentralMember):
    """The ring gear; its base radius follows from sun and planet, and is checked where given."""

    base_radius: Radius | None = None
    teeth: Teeth | None = None


class Carrier(CentralMember):
    """The carrier; the radius of its planet-centre circle follows, and is checked where given."""

    radius: Radius | None = None


class Planet(Body):
    """A planet gear (all planets of a stage are alike)."""

    base_radius: Radius
    teeth: Teeth | None = None

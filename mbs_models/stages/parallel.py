"""A parallel stage: two gears on parallel shafts (Kahraman 1993; the paper, Eqs. 4–9).

In the stage's frame x is normal to the transverse line of action, y along it, z axial. The pinion
stands at the origin. Deflection of the mesh, from the geometry below:

    δ = cos β (w₁ − w₂ + y₁ − y₂) + sin β (z₁ − z₂ + ρ₁ − ρ₂)

where w and ρ are what rotation and rocking move the gear's tangent point along y and z.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..contact.involute_mesh import InvolutePair
from .bodies import Degrees, ParallelGear, PressureAngle, Stiffness
from .geometry import Frame, Vector, radial
from .given_springs import GivenSpring, gear_springs
from .mesh_tables import CONSTANT_STIFFNESS, Backlash, MeshVariation, TransmissionError
from .part import Builder, Kind, Member, MeshFamily, Part, RigidBody, Role, mesh_name
from .teeth import check_teeth


class ParallelStage(Part):
    """A pair of gears on parallel shafts (the paper, Eqs. 4–9)."""

    type: Literal["parallel"]
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

    axes = ("x", "y")
    mode_kind = Kind.PARALLEL_STAGE

    def radius(self, body: str) -> float:
        """The radius r of the rotation w = r·θ of a body (m)."""
        gear: ParallelGear = getattr(self, body)
        return gear.base_radius

    def members(self) -> tuple[Member, ...]:
        """Pinion and wheel; the wheel turns against the pinion."""
        angle = math.radians(self.pressure_angle)
        # Seen from the pinion the wheel stands at the pressure angle: so the line of action is y.
        distance = (self.pinion.base_radius + self.wheel.base_radius) / math.cos(angle)
        centre = distance * radial(angle)
        return (
            self._member(Role.PINION, self.pinion, np.zeros(3), 1.0),
            self._member(Role.WHEEL, self.wheel, centre, -1.0),
        )

    def _member(self, role: Role, gear: ParallelGear, centre: Vector, sense: float) -> Member:
        r = gear.base_radius
        return Member(
            f"{self.name}.{role}",
            role,
            r,
            {"w": gear.rotary_mass(r), "y": gear.mass, "z": gear.mass, "rho": gear.rocking_mass},
            pitch_radius=r / math.cos(math.radians(self.pressure_angle)),
            centre=centre,
            sense=sense,
            teeth=gear.teeth,
            table=role,
        )

    @property
    def drive_points(self) -> tuple[str, ...]:
        """The pinion's rotation, and along the line of action."""
        return (f"{self.name}.pinion.w", f"{self.name}.pinion.y")

    @property
    def caption(self) -> str:
        """With its helix angle, where it has one."""
        return "parallel stage" + (f", helix {self.helix_angle:g}°" if self.helix_angle else "")

    def describe(self) -> str:
        """Ratio and helix angle."""
        ratio = self.wheel.base_radius / self.pinion.base_radius
        return f"parallel, ratio {ratio:.4g}, helix angle {self.helix_angle:g}°, 8 DoFs"

    def mesh_families(self) -> tuple[MeshFamily, ...]:
        """Its one mesh."""
        smaller = min(self.pinion.base_radius, self.wheel.base_radius)
        return (
            MeshFamily(
                "mesh",
                f"{self.name}.pinion",
                (f"{self.name}.wheel",),
                (self.mesh_stiffness,),
                2.0 * smaller / math.cos(math.radians(self.pressure_angle)),
                self.mesh_variation,
                self.mesh_transmission_error,
                self.mesh_backlash,
            ),
        )

    def given_springs(self) -> Iterator[GivenSpring]:
        """The mesh, and both gears' bearings."""
        yield from super().given_springs()
        yield from gear_springs("pinion", self.pinion)
        yield from gear_springs("wheel", self.wheel)

    def build(self, builder: Builder, frame: Frame) -> dict[str, RigidBody]:
        """Two rocking bodies on their bearings, and the mesh between them."""
        members = self.members()
        bodies = {member.body: self._build_gear(builder, member, frame) for member in members}
        first, second = bodies.values()
        r_1, r_2 = self.pinion.base_radius, self.wheel.base_radius
        x, y, _ = second.centre - first.centre
        builder.mesh(
            mesh_name(*bodies),
            first,
            second,
            InvolutePair(
                (float(x), float(y)),
                (r_1, r_2),
                facing=frame.facing,
                helix=math.radians(self.helix_angle),
                levers=(r_1, -r_2),  # the line of action is y: it touches the base circles at ±r
            ),
            self.mesh_stiffness,
        )
        return bodies

    def _build_gear(self, builder: Builder, member: Member, frame: Frame) -> RigidBody:
        gear: ParallelGear = getattr(self, member.role)
        r, at, turn = gear.base_radius, member.body, member.sense
        polar, diametral = gear.rotary_mass(r) * r**2, gear.rocking_mass * r**2
        body = builder.rocking_body(frame.point(member.centre), gear.mass, polar, diametral)
        rocking = gear.rocking_stiffness * r**2
        stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
        stiffness[1:3, 1:3] = gear.support.stiffness
        damping[1:3, 1:3] = gear.support.damping_for(builder.beta)
        stiffness[4, 4], damping[4, 4] = rocking, builder.beta * rocking
        builder.bearing(body, stiffness, damping, axes=frame.axes)
        # The tangent point lies at x = ±r: rocking about +y moves it by −(±r) along z. The stage's
        # z axis is the global one up to the facing; y is the global y axis.
        builder.add_dof(f"{at}.w", (body, body.rotation, frame.facing * turn / r))
        builder.add_dof(f"{at}.y", (body, 1, 1.0))
        builder.add_dof(f"{at}.z", (body, 2, frame.facing))
        builder.add_dof(f"{at}.rho", (body, 4, -turn / r))
        return body

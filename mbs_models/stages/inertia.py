"""A plain inertia: a generator, a motor, a flywheel."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from .bodies import Mass, PolarInertia, Radius, RotaryStiffness, Stiffness
from .geometry import Frame
from .part import Builder, Kind, Member, Part, RigidBody, Role


class Inertia(Part):
    """A plain rotor (generator, motor, flywheel): one rotation w = r·θ at its ``radius``.

    ``torsional_support`` is in N/m at the radius, ``torsional_stiffness`` in N m/rad; none: free.
    """

    radius: Radius
    polar_inertia: PolarInertia | None = None
    polar_inertia_over_r2: Mass | None = None
    torsional_support: Stiffness | None = None
    torsional_stiffness: RotaryStiffness | None = None

    @model_validator(mode="after")
    def _one_form_each(self) -> Self:
        self._require_one_of(("polar_inertia",), ("polar_inertia_over_r2",))
        if self.torsional_support is not None or self.torsional_stiffness is not None:
            self._require_one_of(("torsional_support",), ("torsional_stiffness",))
        return self

    @property
    def rotary_mass(self) -> float:
        """I/r² (kg)."""
        return self._over_r2("polar_inertia", self.radius)

    @property
    def support_stiffness(self) -> float:
        """The torsional support seen at the radius (N/m)."""
        if self.torsional_stiffness is not None:
            return self.torsional_stiffness / self.radius**2
        return self.torsional_support or 0.0

    mode_kind = Kind.GLOBAL

    @property
    def bodies(self) -> tuple[str, ...]:
        """Itself, under its own name."""
        return ("",)

    def members(self) -> tuple[Member, ...]:
        """The one body it is."""
        return (Member(self.name, Role.ROTOR, self.radius, {"w": self.rotary_mass}),)

    @property
    def caption(self) -> str:
        """What it is."""
        return "inertia"

    def describe(self) -> str:
        """Its moment of inertia."""
        return f"{self.rotary_mass * self.radius**2:g} kg m²"

    def build(self, builder: Builder, frame: Frame) -> dict[str, RigidBody]:
        """A rotor on its torsional support."""
        r = self.radius
        body = builder.hub(self.rotary_mass * r**2)
        builder.add_dof(f"{self.name}.w", (body, body.rotation, frame.facing / r))
        builder.torsion_spring(body, self.support_stiffness * r**2)
        return {self.name: body}

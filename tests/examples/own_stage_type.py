"""A stage type of one's own: a shaft, two flanges of inertia I with a torsion spring between."""

from __future__ import annotations

from typing import Any, Literal

from mbs_models import Member, Part, Role, loads
from mbs_models.model.model_file import template
from validation import Band, Lumped, Spring, cross_check, register_stage


class Shaft(Part):
    """Its keys in a model file, its bodies, and how exudyn builds it."""

    type: Literal["shaft"]
    radius: float  # of w = r θ of both flanges (m)
    inertia: float  # kg m²
    stiffness: float  # N m/rad

    def members(self) -> Any:
        mass = self.inertia / self.radius**2
        names = (f"{self.name}.left", f"{self.name}.right")
        return tuple(Member(name, Role.ROTOR, self.radius, {"w": mass}) for name in names)

    def build(self, builder: Any, frame: Any) -> Any:
        flanges = {member.body: builder.hub(self.inertia) for member in self.members()}
        for name, body in flanges.items():
            builder.add_dof(f"{name}.w", (body, body.rotation, frame.facing / self.radius))
        left, right = flanges.values()
        builder.torsion_spring(left, self.stiffness, right)
        return flanges


def equations(shaft: Any) -> Any:
    """M and K = Σ k v vᵀ in w = r θ."""
    w = (f"{shaft.name}.left.w", f"{shaft.name}.right.w")
    m, k = shaft.inertia / shaft.radius**2, shaft.stiffness / shaft.radius**2
    return Lumped(inertias=((w[0], m), (w[1], m)), springs=(Spring(k, {w[0]: 1.0, w[1]: -1.0}),))


register_stage(Shaft, equations=equations)
SHAFT = """
[[stage]]
type = "shaft"
name = "shaft"
radius = 0.05
inertia = 2e-3
stiffness = 4e4

[[coupling]]
name = "joint"
first = "shaft.left"
second = "planetary.sun"
radius = 0.05
inertia = 0.0
first_stiffness = "rigid"
second_stiffness = 1e8
"""
drivetrain = loads(template("lin-parker-4") + SHAFT)
result = cross_check(drivetrain, Band(10.0, 5000.0, 10.0))

"""Bodies and springs of a planetary stage (Lin & Parker 1999; the paper, Eq. 1).

In the stage's frame planet p stands at angle φ_p on the carrier; u is along x (planets: radial),
v along y (planets: tangential), w = r·θ counter-clockwise.
"""

from __future__ import annotations

import numpy as np

from ..contact.involute_mesh import InvolutePair
from ..model.bodies import Bearing
from ..model.gear_geometry import radial, tangential
from ..model.parameters import PlanetaryStage
from ..model.placement import Frame
from ..system.components import mesh_name
from ..system.elements import Assembly, Matrix, RigidBody


def add_planetary_stage(
    assembly: Assembly, stage: PlanetaryStage, frame: Frame
) -> dict[str, RigidBody]:
    """Add a planetary stage to a system; returns its bodies by name.

    Parameters
    ----------
    assembly
        The system being put together.
    stage
        Its parameters.
    frame
        Where the stage stands and which way it faces.
    """
    bodies = {
        name: _add_central_member(assembly, stage, name, frame)
        for name in ("sun", "ring", "carrier")
    }
    for number, angle in enumerate(stage.angles, start=1):
        name = f"planet{number}"
        bodies[name] = _add_planet(assembly, stage, name, angle, frame)
        axes = _planet_axes(angle, frame)
        _add_bearing(assembly, stage.planet_support, bodies[name], axes, bodies["carrier"])
        _add_meshes(assembly, stage, bodies, number, frame)
    return bodies


def _add_central_member(
    assembly: Assembly, stage: PlanetaryStage, name: str, frame: Frame
) -> RigidBody:
    member = getattr(stage, name)
    r = stage.radius(name)
    body = assembly.planar_body(frame.point(np.zeros(3)), member.mass, member.rotary_mass(r) * r**2)
    _add_bearing(assembly, member.support, body, frame.axes)
    assembly.torsion_spring(body, member.torsional_support_at(r) * r**2)
    _add_dofs(assembly, f"{stage.name}.{name}", body, r, angle=0.0, frame=frame)
    return body


def _add_planet(
    assembly: Assembly, stage: PlanetaryStage, name: str, angle: float, frame: Frame
) -> RigidBody:
    planet, r = stage.planet, stage.planet.base_radius
    centre = stage.carrier_radius * radial(angle)
    body = assembly.planar_body(frame.point(centre), planet.mass, planet.rotary_mass(r) * r**2)
    _add_dofs(assembly, f"{stage.name}.{name}", body, r, angle, frame)
    return body


def _add_dofs(
    assembly: Assembly, prefix: str, body: RigidBody, r: float, angle: float, frame: Frame
) -> None:
    for label, direction in (("u", radial(angle)), ("v", tangential(angle))):
        x, y, _ = frame.direction(direction)
        assembly.add_dof(f"{prefix}.{label}", (body, 0, x), (body, 1, y))
    assembly.add_dof(f"{prefix}.w", (body, body.rotation, frame.facing / r))


def _add_bearing(
    assembly: Assembly,
    bearing: Bearing,
    body: RigidBody,
    axes: Matrix,
    support: RigidBody | None = None,
) -> None:
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    stiffness[:2, :2] = bearing.stiffness
    damping[:2, :2] = bearing.damping_for(assembly.damping.stiffness_proportional)
    assembly.bearing(body, stiffness, damping, support=support, axes=axes)


def _planet_axes(angle: float, frame: Frame) -> Matrix:
    """Radial, tangential and axial direction of a planet, in global coordinates."""
    e_r, e_t = radial(angle), tangential(angle)
    return np.column_stack([frame.direction(e) for e in (e_r, e_t, np.cross(e_r, e_t))])


def _add_meshes(
    assembly: Assembly,
    stage: PlanetaryStage,
    bodies: dict[str, RigidBody],
    number: int,
    frame: Frame,
) -> None:
    planet, r_p = bodies[f"planet{number}"], stage.planet.base_radius
    x, y, _ = planet.centre - bodies["carrier"].centre
    for member, radius, kind, stiffness in (
        ("sun", stage.sun.base_radius, 1.0, stage.sun_meshes[number - 1]),
        ("ring", stage.ring_radius, -1.0, stage.ring_meshes[number - 1]),
    ):
        assembly.mesh(
            mesh_name(f"{stage.name}.{member}", f"{stage.name}.planet{number}"),
            bodies[member],
            planet,
            InvolutePair((float(x), float(y)), (radius, r_p), kind, frame.facing),
            stiffness,
        )

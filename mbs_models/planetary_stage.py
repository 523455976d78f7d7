"""Bodies and springs of a planetary stage (Lin & Parker 1999; seed paper, Eq. 1).

In the stage's frame planet p stands at angle φ_p on the carrier; u is along x (planets: radial),
v along y (planets: tangential), w = r·θ counter-clockwise.
"""

from __future__ import annotations

import numpy as np

from .elements import Assembly, RigidBody
from .gear_geometry import Vector, external_mesh, internal_mesh, radial, tangential
from .parameters import PlanetaryStage
from .placement import Frame


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
        _add_planet_bearing(assembly, stage, bodies["carrier"], bodies[name], angle, frame)
        _add_meshes(assembly, stage, bodies, name, angle, frame)
    return bodies


def _add_central_member(
    assembly: Assembly, stage: PlanetaryStage, name: str, frame: Frame
) -> RigidBody:
    member = getattr(stage, name)
    r = stage.radius(name)
    body = assembly.planar_body(frame.point(np.zeros(3)), member.mass, member.rotary_mass(r) * r**2)
    assembly.bearing(body, member.bearing_stiffness)
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


def _add_planet_bearing(
    assembly: Assembly,
    stage: PlanetaryStage,
    carrier: RigidBody,
    planet: RigidBody,
    angle: float,
    frame: Frame,
) -> None:
    e_r, e_t = frame.direction(radial(angle)), frame.direction(tangential(angle))
    axes: Vector = np.column_stack([e_r, e_t, np.cross(e_r, e_t)])
    assembly.bearing(planet, stage.planet_bearing_stiffness, support=carrier, axes=axes)


def _add_meshes(
    assembly: Assembly,
    stage: PlanetaryStage,
    bodies: dict[str, RigidBody],
    planet: str,
    angle: float,
    frame: Frame,
) -> None:
    r_p = stage.planet.base_radius
    sun_line = external_mesh(stage.sun.base_radius, r_p, stage.sun_mesh_angle, angle)
    ring_line = internal_mesh(stage.ring_radius, r_p, stage.ring_mesh_angle, angle)
    for member, line, stiffness in (
        ("sun", sun_line, stage.sun_mesh_stiffness),
        ("ring", ring_line, stage.ring_mesh_stiffness),
    ):
        assembly.mesh_spring(
            bodies[member],
            frame.direction(line.first_point),
            bodies[planet],
            frame.direction(line.second_point),
            stiffness,
        )

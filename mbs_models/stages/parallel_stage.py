"""Bodies and springs of a parallel stage (Kahraman 1993; seed paper, Eqs. 4–9).

In the stage's frame x is normal to the transverse line of action, y along it, z axial. The pinion
stands at the origin. Deflection of the mesh, from the geometry below:

    δ = cos β (w₁ − w₂ + y₁ − y₂) + sin β (z₁ − z₂ + ρ₁ − ρ₂)

where w and ρ are what rotation and rocking move the gear's tangent point along y and z.
"""

from __future__ import annotations

import math

import numpy as np

from ..contact.involute_mesh import InvolutePair
from ..model.gear_geometry import Vector, centre_distance, radial
from ..model.graph import sense
from ..model.parameters import ParallelGear, ParallelStage
from ..model.placement import Frame
from ..system.components import mesh_name
from ..system.elements import Assembly, RigidBody


def body_centres(stage: ParallelStage) -> dict[str, Vector]:
    """Centres of the bodies in the stage's frame (m)."""
    angle = math.radians(stage.pressure_angle)
    distance = centre_distance(stage.pinion.base_radius, stage.wheel.base_radius, angle)
    # Seen from the pinion the wheel stands at the pressure angle: so the line of action is y.
    return {"pinion": np.zeros(3), "wheel": distance * radial(angle)}


def add_parallel_stage(
    assembly: Assembly, stage: ParallelStage, frame: Frame
) -> dict[str, RigidBody]:
    """Add a parallel stage to a system; returns its bodies by name.

    Parameters
    ----------
    assembly
        The system being put together.
    stage
        Its parameters.
    frame
        Where the stage stands and which way it faces.
    """
    centres = body_centres(stage)
    bodies = {
        name: _add_gear(assembly, stage.name, name, getattr(stage, name), centre, frame)
        for name, centre in centres.items()
    }
    _add_mesh(assembly, stage, bodies, frame)
    return bodies


def _add_gear(
    assembly: Assembly, stage: str, name: str, gear: ParallelGear, centre: Vector, frame: Frame
) -> RigidBody:
    r = gear.base_radius
    body = assembly.rocking_body(
        frame.point(centre), gear.mass, gear.rotary_mass(r) * r**2, gear.rocking_mass * r**2
    )
    _add_bearing(assembly, gear, body, frame)
    turn = sense(f"{stage}.{name}")
    # The tangent point lies at x = ±r: rocking about +y moves it by −(±r) along z. The stage's
    # z axis is the global one up to the facing; y is the global y axis.
    assembly.add_dof(f"{stage}.{name}.w", (body, body.rotation, frame.facing * turn / r))
    assembly.add_dof(f"{stage}.{name}.y", (body, 1, 1.0))
    assembly.add_dof(f"{stage}.{name}.z", (body, 2, frame.facing))
    assembly.add_dof(f"{stage}.{name}.rho", (body, 4, -turn / r))
    return body


def _add_bearing(assembly: Assembly, gear: ParallelGear, body: RigidBody, frame: Frame) -> None:
    beta = assembly.damping.stiffness_proportional
    rocking = gear.rocking_stiffness * gear.base_radius**2
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    stiffness[1:3, 1:3] = gear.support.stiffness
    damping[1:3, 1:3] = gear.support.damping_for(beta)
    stiffness[4, 4], damping[4, 4] = rocking, beta * rocking
    assembly.bearing(body, stiffness, damping, axes=frame.axes)


def _add_mesh(
    assembly: Assembly, stage: ParallelStage, bodies: dict[str, RigidBody], frame: Frame
) -> None:
    r_1, r_2 = stage.pinion.base_radius, stage.wheel.base_radius
    x, y, _ = bodies["wheel"].centre - bodies["pinion"].centre
    assembly.mesh(
        mesh_name(f"{stage.name}.pinion", f"{stage.name}.wheel"),
        bodies["pinion"],
        bodies["wheel"],
        InvolutePair(
            (float(x), float(y)),
            (r_1, r_2),
            facing=frame.facing,
            helix=math.radians(stage.helix_angle),
            levers=(r_1, -r_2),  # the line of action is y: it touches the base circles at x = ±r
        ),
        stage.mesh_stiffness,
    )

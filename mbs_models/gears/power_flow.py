"""What turns how fast and carries which torque: ratio, speeds, mesh frequencies, static torques.

Speeds follow from the free motion of the drivetrain, torques from static equilibrium of its
meshes. With the tension F of a mesh and its deflection δ a gear of the base radius r carries
T = F r ∂δ/∂w (w = r θ), a sun or ring the sum over its planets, and the carrier T_c = T_s + T_r
backwards, since the planets turn freely on their pins.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import ModelError
from ..model.parameters import Drivetrain
from ..model.placement import turnings
from ..system.components import Components, Spring, SpringKind
from ..system.drivetrain import build_drivetrain
from ..system.linearization import LinearizedSystem, linearize
from ..system.read_back import components
from .operating_point import operating_point
from .preload import preload
from .static_state import linear_mesh_forces


@dataclass(frozen=True)
class PowerFlow:
    """A drivetrain at work.

    Attributes
    ----------
    input, output
        Where power enters and leaves; no output where it is not plain, or supports take the torque.
    speed_rpm
        Of the input.
    speeds
        Body → rpm, positive in the input's sense of rotation.
    mesh_frequencies
        Stage → Hz, of the stages with teeth.
    torques
        Body → N m, without sign; empty without a torque.
    mesh_forces
        Mesh → N, without sign; empty without a torque.
    """

    input: str
    output: str | None
    speed_rpm: float
    speeds: Mapping[str, float]
    mesh_frequencies: Mapping[str, float]
    torques: Mapping[str, float]
    mesh_forces: Mapping[str, float]

    @property
    def ratio(self) -> float | None:
        """Speed of the input over that of the output, negative where the senses differ."""
        if self.output is None:
            return None
        return self.speeds[self.input] / self.speeds[self.output]


def power_flow(drivetrain: Drivetrain, speed_rpm: float, torque: float | None) -> PowerFlow:
    """Work it out.

    Parameters
    ----------
    drivetrain
        With an ``[operation]`` table, which names the input.
    speed_rpm
        Of the input.
    torque
        At the input (N m); None or 0: no torques.

    Raises
    ------
    ModelError
        The input cannot turn, a mesh that varies has no teeth, or no body takes the reaction to
        the torque.
    """
    operation = drivetrain.operation
    assert operation is not None
    point = operating_point(drivetrain, speed_rpm=speed_rpm, torque=0.0)
    system = build_drivetrain(drivetrain)
    linear, parts = linearize(system), components(system)
    output, tensions = _output(drivetrain, linear, parts), {}
    if torque:
        load, output = preload(drivetrain, linear, parts, torque, operation.output)
        tensions = linear_mesh_forces(linear, parts, load)
    turns = turnings(drivetrain)
    way = turns[operation.input] * math.copysign(1.0, speed_rpm)
    speeds = {
        body: speed * 60.0 / (2.0 * math.pi) * turns[body] * way
        for body, speed in point.speeds.items()
    }
    torques = _torques(drivetrain, linear, parts, tensions)
    if torque:
        torques = _at_the_ends(drivetrain, speeds, torque, output) | torques
    return PowerFlow(
        input=operation.input,
        output=output,
        speed_rpm=speed_rpm,
        speeds=speeds,
        mesh_frequencies=point.mesh_frequencies,
        torques=torques,
        mesh_forces={name: abs(force) for name, force in tensions.items()},
    )


def _output(drivetrain: Drivetrain, linear: LinearizedSystem, parts: Components) -> str | None:
    """Where power would leave, if the drivetrain has one other end."""
    assert drivetrain.operation is not None
    try:
        return preload(drivetrain, linear, parts, 1.0, drivetrain.operation.output)[1]
    except ModelError:
        return None


def _torques(
    drivetrain: Drivetrain,
    linear: LinearizedSystem,
    parts: Components,
    tensions: Mapping[str, float],
) -> dict[str, float]:
    """What the meshes of its stage exert on each body (N m)."""
    if not tensions:
        return {}
    families = drivetrain.mesh_families
    toothed = {body for family in families for body in (family.gear, *family.others)}
    found = {body: 0.0 for body in drivetrain.bodies if body in toothed}
    for spring in parts.springs:
        if spring.kind is SpringKind.MESH:
            for body in (end.body for end in spring.ends if end.body in found):
                arm = drivetrain.radius(body) * _along_w(linear, spring, body)
                found[body] += tensions[spring.name] * arm
    for stage in drivetrain.stages:
        for planets in stage.planet_sets():
            found[planets.carrier] = -(found[planets.sun] + found[planets.ring])
    return {body: abs(moment) for body, moment in found.items()}


def _along_w(linear: LinearizedSystem, spring: Spring, body: str) -> float:
    """∂δ/∂w of a mesh for the rotation w of one of its gears, a derived one too."""
    label = f"{body}.w"
    leader, factor = linear.derived.get(label, (label, 1.0))
    return float(spring.deflection[0, linear.dofs.index(leader)]) / factor


def _at_the_ends(
    drivetrain: Drivetrain, speeds: Mapping[str, float], torque: float, output: str | None
) -> dict[str, float]:
    """Torques where power enters and leaves: T_out = T_in |Ω_in/Ω_out|."""
    assert drivetrain.operation is not None
    driven = drivetrain.operation.input
    at = {driven: abs(torque)}
    if output is not None:
        at[output] = abs(torque * speeds[driven] / speeds[output])
    return at

"""One operating point: speed and torque of the input, and all that follows for meshes and loads.

Speeds and mesh frequencies come from the free motion of the drivetrain, mesh phases from tooth
numbers, the reaction to the torque from equilibrium of that motion, the flanks that press from the
static mesh forces. The drivetrain is seen from its turning gears: they vibrate about their mean
rotation, which itself enters by the mesh frequencies alone (no gyroscopic or centrifugal terms).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.mesh_excitation import CONSTANT, MeshLaw, at_mean
from ..errors import ModelError
from ..model.excitation import Excitation
from ..model.operation import SPEEDS, TORQUES
from ..model.parameters import Drivetrain
from ..model.placement import turnings
from ..stages.part import Part
from ..system.components import Components
from ..system.displaced import linearized_at
from ..system.drivetrain import build_drivetrain, build_stage
from ..system.linearization import LinearizedSystem, linearize
from ..system.read_back import components
from .orders import STANDS_STILL, speeds, teeth_passed
from .preload import Constant, preload
from .static_state import linear_mesh_forces, static_state

FloatArray = NDArray[np.float64]
AT_REST: Mapping[str, float] = {}


@dataclass(frozen=True)
class OperatingPoint:
    """What an operating point makes of a drivetrain.

    Attributes
    ----------
    speed_rpm
        Of the input; None: no mesh is passed.
    torque
        At the input (N m), positive along its positive w.
    output
        The body that takes the reaction; None without a torque, or where supports take it.
    speeds
        Body → rad/s along its positive w; empty without a speed.
    mesh_frequencies
        Stage → Hz, of the stages that have teeth; empty without a speed.
    phases
        Mesh → how much later it is (mesh periods), of stages with planets whose meshes vary.
    laws
        Mesh → its force law.
    loads
        The torque and its reaction.
    mesh_forces
        Mesh → static force (N), positive where the loaded flanks press.
    dofs, displacement
        Where a run starts: the static equilibrium (n_dof,) in m, with every mesh at its mean.
    linear
        The drivetrain linearised there: what it vibrates like under the torque.
    """

    speed_rpm: float | None
    torque: float
    output: str | None
    speeds: Mapping[str, float]
    mesh_frequencies: Mapping[str, float]
    phases: Mapping[str, float]
    laws: Mapping[str, MeshLaw]
    loads: tuple[Excitation[Constant], ...]
    mesh_forces: Mapping[str, float]
    dofs: tuple[str, ...]
    displacement: FloatArray
    linear: LinearizedSystem

    @property
    def start_state(self) -> tuple[FloatArray, FloatArray]:
        """Displacement and velocity to start from."""
        return self.displacement, np.zeros_like(self.displacement)


def operating_point(
    drivetrain: Drivetrain,
    *,
    speed_rpm: float | None = None,
    torque: float | None = None,
    output: str | None = None,
) -> OperatingPoint:
    """Work out an operating point.

    Parameters
    ----------
    drivetrain
        With an ``[operation]`` table, which names the input.
    speed_rpm, torque, output
        In place of the table's own; a speed of 0 is a standstill, every mesh at its mean.

    Raises
    ------
    ModelError
        The table or a key is missing, the input cannot turn, teeth do not fit, or there is no
        equilibrium.
    """
    operation = drivetrain.operation
    if operation is None:
        raise ModelError(
            f"{drivetrain.name}: no [operation] table; an operating point needs its input (and "
            "speed, torque)"
        )
    speed = _within("speed", operation.speed if speed_rpm is None else speed_rpm, SPEEDS, "rpm")
    moment = (
        _within("torque", operation.torque if torque is None else torque, TORQUES, "N m") or 0.0
    )
    system = build_drivetrain(drivetrain)
    linear, parts = linearize(system), components(system)
    if speed == 0.0:
        speed, drivetrain = None, _at_mean_stiffness(drivetrain)
    turns = _speeds(drivetrain, parts, speed)
    frequencies = _mesh_frequencies(drivetrain, turns)
    load, reaction = preload(drivetrain, linear, parts, moment, output or operation.output)
    flanks = _flanks(drivetrain, linear, parts, load)
    phases = _phases(drivetrain, turns, flanks)
    laws = _laws(drivetrain, frequencies, phases, flanks)
    start = static_state(drivetrain, linear, parts, load, laws)
    return OperatingPoint(
        speed_rpm=speed,
        torque=moment,
        output=reaction,
        speeds=turns,
        mesh_frequencies=frequencies,
        phases=phases,
        laws=laws,
        loads=tuple(
            Excitation(dof, Constant(float(force)))
            for dof, force in zip(linear.dofs, load, strict=True)
            if force
        ),
        mesh_forces=start.mesh_forces,
        dofs=linear.dofs,
        displacement=start.displacement,
        linear=start.linear,
    )


def linearized_part(drivetrain: Drivetrain, name: str, point: OperatingPoint) -> LinearizedSystem:
    """One stage (or inertia) alone, linearised where the torque has moved it.

    Coupled with the others' it is the loaded drivetrain's own linearisation.
    """
    system = build_stage(drivetrain, name, at_mean(point.laws))
    moved = dict(zip(point.dofs, point.displacement, strict=True))
    motion = []
    for dof in system.dofs:
        leader, factor = point.linear.derived.get(dof.label, (dof.label, 1.0))
        motion.append(factor * moved[leader])
    return linearized_at(system, np.array(motion))


def _within(key: str, value: float | None, limits: tuple[float, float], unit: str) -> float | None:
    least, most = limits
    if value and not least <= abs(value) <= most:
        raise ModelError(
            f"{key} = {value:g} {unit}: must be 0, or within {least:g} to {most:g} in magnitude"
        )
    return value


def _at_mean_stiffness(drivetrain: Drivetrain) -> Drivetrain:
    """The drivetrain without what varies as it turns."""
    stages = [
        stage.model_copy(
            update={
                name: type(stage).model_fields[name].default
                for name in type(stage).model_fields
                if name.endswith(("mesh_variation", "mesh_transmission_error"))
            }
        )
        for stage in drivetrain.stages
    ]
    return drivetrain.model_copy(update={"stages": tuple(stages)})


# Speeds and mesh frequencies


def _speeds(drivetrain: Drivetrain, parts: Components, speed: float | None) -> Mapping[str, float]:
    """Every body's speed along its positive w (rad/s)."""
    if speed is None:
        return AT_REST
    assert drivetrain.operation is not None
    driven = drivetrain.operation.input
    ratio = speeds(parts, driven)
    if not ratio:
        raise ModelError(f"operation: input = {driven!r}: cannot turn freely: it has no speed")
    turns = turnings(drivetrain)
    rate = speed * 2.0 * math.pi / 60.0 * turns[driven]
    return {body: rate * ratio[body] * turn for body, turn in turns.items()}


def _mesh_frequencies(drivetrain: Drivetrain, turns: Mapping[str, float]) -> dict[str, float]:
    """Stage → f_mesh (Hz) where teeth are given; a stage whose meshes vary must have them."""
    found: dict[str, float] = {}
    fastest = max(map(abs, turns.values()), default=0.0)
    for stage in drivetrain.stages:
        varying = [family.key for family in stage.mesh_families() if family.varies]
        if not turns:
            if varying:
                raise ModelError(
                    f"stage '{stage.name}': {varying[0]} varies with the rotation, but no speed is "
                    "given; give speed (rpm) in [operation] or with the operating point"
                )
            continue
        passed = teeth_passed(stage, turns)
        if passed > STANDS_STILL * fastest:
            found[stage.name] = passed / (2.0 * math.pi)
        elif varying:
            raise ModelError(_no_frequency(stage, varying[0]))
    return found


def _no_frequency(stage: Part, key: str) -> str:
    meshing = {body for f in stage.mesh_families() for body in (f.gear, *f.others)}
    gears = [body for body in stage.bodies if f"{stage.name}.{body}" in meshing]
    if all(stage.member(f"{stage.name}.{gear}").teeth is None for gear in gears):
        keys = " or ".join(f"{gear}.teeth" for gear in gears)
        return f"stage '{stage.name}': {key} needs the mesh frequency: {keys} is missing"
    return f"stage '{stage.name}': {key} needs a mesh frequency, but the stage does not turn"


# Meshes


def _flanks(
    drivetrain: Drivetrain, linear: LinearizedSystem, parts: Components, load: FloatArray
) -> dict[str, float]:
    """Sign of each mesh's deflection when its loaded flanks press.

    Without a static force it is 1: positive torque on the stage's first gear.
    """
    forces = linear_mesh_forces(linear, parts, load) if np.any(load) else {}
    names = (name for family in drivetrain.mesh_families for name in family.names)
    return {name: math.copysign(1.0, forces.get(name, 0.0)) for name in names}


def _phases(
    drivetrain: Drivetrain, turns: Mapping[str, float], flanks: Mapping[str, float]
) -> dict[str, float]:
    """Mesh → phase, where any mesh of its stage varies."""
    found: dict[str, float] = {}
    for stage in drivetrain.stages:
        if any(family.varies for family in stage.mesh_families()):
            found |= stage.mesh_phases(turns, flanks)
    return found


def _laws(
    drivetrain: Drivetrain,
    frequencies: Mapping[str, float],
    phases: Mapping[str, float],
    flanks: Mapping[str, float],
) -> dict[str, MeshLaw]:
    return {
        name: MeshLaw(
            frequency=frequencies[family.stage] if family.varies else 0.0,
            phase=phases.get(name, 0.0) if family.varies else 0.0,
            stiffness=family.variation.waveform,
            transmission_error=family.error.waveform if family.error else CONSTANT,
            backlash=family.backlash,
            flank=flanks[name],
        )
        for family in drivetrain.mesh_families
        for name in family.names
    }

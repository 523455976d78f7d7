"""Stages and couplings in one exudyn system, whole or split into one system per stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .elements import Assembly, Dof, RigidBody
from .errors import ModelError
from .gear_geometry import Vector
from .parallel_stage import SENSE, add_parallel_stage, body_centres
from .parameters import Coupling, Drivetrain, ParallelStage, PlanetaryStage
from .placement import Frame
from .planetary_stage import add_planetary_stage


@dataclass(frozen=True)
class MultibodySystem:
    """An assembled exudyn system and the names of its DoFs.

    Attributes
    ----------
    container, mbs
        exudyn's SystemContainer and MainSystem.
    dofs
        The independent DoFs, in order, with the exudyn coordinates each moves.
    derived
        Further labels: label → (DoF, factor), where a rigid hub makes two rotations one.
    locked
        (node, coordinate) pairs held by constraints to ground.
    """

    container: Any
    mbs: Any
    dofs: tuple[Dof, ...]
    derived: dict[str, tuple[str, float]]
    locked: tuple[tuple[int, int], ...]


def build_drivetrain(drivetrain: Drivetrain) -> MultibodySystem:
    """Build the whole drivetrain as one exudyn system.

    Raises
    ------
    ModelError
        A loop of couplings asks a stage to face both ways, or a loop of rigid couplings leaves
        nothing to turn.
    """
    frames = place_stages(drivetrain)
    assembly = Assembly(drivetrain.damping)
    bodies: dict[str, RigidBody] = {}
    for stage in drivetrain.stages:
        bodies |= _add_stage(assembly, stage, frames[stage.name])
    for coupling in drivetrain.couplings:
        _add_hub(assembly, drivetrain, coupling, bodies, frames, ends=coupling.ends, share=1.0)
    return _finish(assembly)


def build_stage(drivetrain: Drivetrain, name: str) -> MultibodySystem:
    """Build one stage alone, with its half of every hub it is coupled by.

    The hub's half hangs on the stage's own spring of the coupling; ``<coupling>.w`` is the
    interface DoF on both sides of the cut (seed paper, Eqs. 6 and 10).
    """
    frames = place_stages(drivetrain)
    assembly = Assembly(drivetrain.damping)
    bodies = _add_stage(assembly, drivetrain.stage(name), frames[name])
    for coupling in drivetrain.couplings:
        ends = tuple(end for end in coupling.ends if end[0] in bodies)
        if ends:
            _add_hub(assembly, drivetrain, coupling, bodies, frames, ends=ends, share=0.5)
    return _finish(assembly)


def place_stages(drivetrain: Drivetrain) -> dict[str, Frame]:
    """Where each stage stands, starting from the first: coupled bodies coaxial, turning alike."""
    frames: dict[str, Frame] = {}
    for stage in drivetrain.stages:
        if stage.name not in frames:
            frames[stage.name] = Frame()
            _place_neighbours(drivetrain, stage.name, frames)
    return frames


def _place_neighbours(drivetrain: Drivetrain, placed: str, frames: dict[str, Frame]) -> None:
    for coupling in drivetrain.couplings:
        for here, there in (
            (coupling.first, coupling.second),
            (coupling.second, coupling.first),
        ):
            if here.partition(".")[0] != placed:
                continue
            name = there.partition(".")[0]
            facing = frames[placed].facing * _sense(here) * _sense(there)
            if name not in frames:
                axis = frames[placed].point(_centre(drivetrain, here))
                turned = Frame(facing=facing).direction(_centre(drivetrain, there))
                frames[name] = Frame(axis - turned, facing)
                _place_neighbours(drivetrain, name, frames)
            elif frames[name].facing != facing:
                raise ModelError(
                    f"coupling '{coupling.name}' closes a loop in which '{name}' would have to "
                    "turn both ways: the mechanism is locked"
                )


def _sense(body: str) -> float:
    """Sign of w against counter-clockwise rotation, in the stage's own frame."""
    return SENSE.get(body.partition(".")[2], 1.0)


def _centre(drivetrain: Drivetrain, body: str) -> Vector:
    name, _, part = body.partition(".")
    stage = drivetrain.stage(name)
    return body_centres(stage)[part] if isinstance(stage, ParallelStage) else np.zeros(3)


def _add_stage(
    assembly: Assembly, stage: ParallelStage | PlanetaryStage, frame: Frame
) -> dict[str, RigidBody]:
    if isinstance(stage, ParallelStage):
        bodies = add_parallel_stage(assembly, stage, frame)
    else:
        bodies = add_planetary_stage(assembly, stage, frame)
    return {f"{stage.name}.{name}": body for name, body in bodies.items()}


def _add_hub(
    assembly: Assembly,
    drivetrain: Drivetrain,
    coupling: Coupling,
    bodies: dict[str, RigidBody],
    frames: dict[str, Frame],
    *,
    ends: tuple[tuple[str, Any], ...],
    share: float,
) -> None:
    """Add a share of a hub, sprung or welded to the ``ends`` that are in the system."""
    r = coupling.radius
    hub = assembly.hub(share * coupling.hub_mass * r**2)
    label = f"{coupling.name}.w"
    body_name = ends[0][0]
    turning = frames[body_name.partition(".")[0]].facing * _sense(body_name)
    assembly.add_dof(label, (hub, hub.rotation, turning / r))
    for body_name, stiffness in ends:
        body = bodies[body_name]
        if stiffness != "rigid":
            assembly.torsion_spring(hub, stiffness * r**2, body)
            continue
        assembly.weld_rotation(body, hub)
        ratio = r / drivetrain.radius(body_name)  # r·θ of the hub per r_body·θ of the body
        if label in assembly.dofs:
            assembly.derive_dof(label, f"{body_name}.w", ratio)
        else:
            assembly.derive_dof(f"{body_name}.w", label, 1.0 / ratio)


def _finish(assembly: Assembly) -> MultibodySystem:
    assembly.mbs.Assemble()
    return MultibodySystem(
        container=assembly.container,
        mbs=assembly.mbs,
        dofs=tuple(assembly.dofs.values()),
        derived=dict(assembly.derived),
        locked=tuple(assembly.locked),
    )

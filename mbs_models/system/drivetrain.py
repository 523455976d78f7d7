"""Stages and couplings in one exudyn system, whole or split into one system per stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..contact.mesh_excitation import MeshLaw
from ..errors import ModelError
from ..model.couplings import DIRECTIONS, Coupling
from ..model.gear_geometry import Vector
from ..model.graph import walk
from ..model.parameters import Drivetrain, Inertia, ParallelStage, Part
from ..model.placement import (
    Frame,
    axes_facing,
    facings,
    rigid_end,
    translation_ends,
    turning,
)
from ..representation import counted, html_table, listing
from ..stages.parallel_stage import add_parallel_stage, body_centres
from ..stages.planetary_stage import add_planetary_stage
from .elements import Assembly, Dof, Mesh, RigidBody

# The global axis along which each common direction lies: see `placement`.
GLOBAL_AXIS = {DIRECTIONS["u"]: 1, DIRECTIONS["v"]: 0, DIRECTIONS["z"]: 2}


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
    bodies
        Every rigid body by name; a coupling's hub has the coupling's name.
    meshes
        Every mesh by name, as in `components`.
    """

    container: Any
    mbs: Any
    dofs: tuple[Dof, ...]
    derived: dict[str, tuple[str, float]]
    locked: tuple[tuple[int, int], ...]
    bodies: Mapping[str, RigidBody] = field(default_factory=dict)
    meshes: Mapping[str, Mesh] = field(default_factory=dict)

    def __repr__(self) -> str:
        bodies = counted(len(self.bodies), "body", "bodies")
        meshes = counted(len(self.meshes), "mesh", "meshes")
        return f"<MultibodySystem: {bodies}, {meshes}, {counted(len(self.dofs), 'DoF')}>"

    def _repr_html_(self) -> str:
        rows = [
            ("bodies", listing(tuple(self.bodies))),
            ("meshes", listing(tuple(self.meshes))),
            ("DoFs", listing([dof.label for dof in self.dofs])),
            ("derived", listing(tuple(self.derived))),
        ]
        return html_table(repr(self).strip("<>"), [row for row in rows if row[1]])

    @property
    def has_backlash(self) -> bool:
        """Whether a mesh's force has kinks where its teeth part."""
        return any(mesh.law.backlash > 0.0 for mesh in self.meshes.values())


def build_drivetrain(
    drivetrain: Drivetrain, meshes: Mapping[str, MeshLaw] | None = None
) -> MultibodySystem:
    """Build the whole drivetrain as one exudyn system.

    Parameters
    ----------
    drivetrain
        Its parameters.
    meshes
        Force laws of meshes, by name as in `components`; the others are constant springs.

    Raises
    ------
    ModelError
        A loop of rigid couplings ties bodies that are one already, or a law has no mesh.
    """
    train = _Train(drivetrain, meshes or {})
    for part in drivetrain.parts:
        train.add_part(part)
    for coupling in drivetrain.couplings:
        train.add_hub(coupling, share=1.0)
        train.add_translations(coupling)
    _check_laws(train)
    return _finish(train)


def build_stage(
    drivetrain: Drivetrain, name: str, meshes: Mapping[str, MeshLaw] | None = None
) -> MultibodySystem:
    """Build one stage (or inertia) alone, with its half of every hub it is coupled by.

    The hub's half hangs on the stage's own spring of the coupling; ``<coupling>.w`` is the
    interface DoF on both sides of the cut (seed paper, Eqs. 6 and 10). A massless hub is cut at its
    rigid end: its spring is the joint, in neither of the two. Translations are joints too. Laws in
    ``meshes`` of other stages' meshes are left aside.
    """
    train = _Train(drivetrain, meshes or {})
    train.add_part(drivetrain.part(name))
    for coupling in drivetrain.couplings:
        train.add_hub(coupling, share=0.5)
    return _finish(train)


def place_parts(drivetrain: Drivetrain) -> dict[str, Frame]:
    """Where each part stands, starting from the first: coupled bodies coaxial, turning alike."""
    frames: dict[str, Frame] = {}
    for here, there in walk(drivetrain.joined):
        name = there.partition(".")[0]
        part = drivetrain.part(name)
        axes = axes_facing(part, drivetrain.facing[name])
        if not here:
            frames[name] = Frame(axes=axes)
            continue
        axis = frames[here.partition(".")[0]].point(_centre(drivetrain, here))
        frames[name] = Frame(axis - axes @ _centre(drivetrain, there), axes)
    return frames


def _centre(drivetrain: Drivetrain, body: str) -> Vector:
    """Centre of a body in its part's frame."""
    name, _, member = body.partition(".")
    part = drivetrain.part(name)
    return body_centres(part)[member] if isinstance(part, ParallelStage) else np.zeros(3)


class _Train:
    """A drivetrain being put together."""

    def __init__(self, drivetrain: Drivetrain, meshes: Mapping[str, MeshLaw]) -> None:
        self.drivetrain = drivetrain
        self.facing = facings(drivetrain)
        self.frames = place_parts(drivetrain)
        self.assembly = Assembly(drivetrain.damping, meshes)
        self.bodies: dict[str, RigidBody] = {}
        self.hubs: dict[str, RigidBody] = {}

    def add_part(self, part: Part) -> None:
        """Add the bodies and springs of a stage or an inertia."""
        frame = self.frames[part.name]
        if isinstance(part, Inertia):
            self._add_inertia(part)
            return
        if isinstance(part, ParallelStage):
            bodies = add_parallel_stage(self.assembly, part, frame)
        else:
            bodies = add_planetary_stage(self.assembly, part, frame)
        self.bodies |= {f"{part.name}.{name}": body for name, body in bodies.items()}

    def _add_inertia(self, part: Inertia) -> None:
        r = part.radius
        body = self.assembly.hub(part.rotary_mass * r**2)
        self.bodies[part.name] = body
        turn = turning(self.facing, part.name)
        self.assembly.add_dof(f"{part.name}.w", (body, body.rotation, turn / r))
        self.assembly.torsion_spring(body, part.support_stiffness * r**2)

    def add_hub(self, coupling: Coupling, share: float) -> None:
        """Add a share of a hub, sprung or welded to the bodies that are in the system."""
        ends = [end for end in coupling.ends if end[0] in self.bodies]
        if coupling.massless and share < 1.0:
            ends = [end for end in ends if end == rigid_end(coupling)]
        if not ends:
            return
        r, label = coupling.radius, f"{coupling.name}.w"
        turn = turning(self.facing, coupling.first)
        hub = self.hubs[coupling.name] = self.assembly.hub(share * coupling.hub_mass * r**2)
        self.assembly.add_dof(label, (hub, hub.rotation, turn / r))
        for name, stiffness in ends:
            if stiffness == "rigid":
                self._weld(coupling, hub, name)
            else:
                self.assembly.torsion_spring(hub, stiffness * r**2, self.bodies[name])

    def _weld(self, coupling: Coupling, hub: RigidBody, name: str) -> None:
        """Make hub and body one: their rotations are the same, their w as their radii."""
        body, own, of_hub = self.bodies[name], f"{name}.w", f"{coupling.name}.w"
        self.assembly.weld(body, body.rotation, hub, hub.rotation)
        ratio = coupling.radius / self.drivetrain.radius(name)
        ratio *= turning(self.facing, coupling.first) * turning(self.facing, name)
        if of_hub in self.assembly.dofs:
            self.assembly.derive_dof(of_hub, own, ratio)
        else:
            self.assembly.derive_dof(own, of_hub, 1.0 / ratio)

    def add_translations(self, coupling: Coupling) -> None:
        """Add the springs or welds between the translations of a coupling's two bodies."""
        first, second = self.bodies[coupling.first], self.bodies[coupling.second]
        for dof, spring in coupling.dofs.items():
            axis = GLOBAL_AXIS[DIRECTIONS[dof]]
            if spring.stiffness != "rigid":
                self.assembly.translation_spring(
                    first, second, axis, spring.stiffness, spring.damping
                )
                continue
            self.assembly.weld(first, axis, second, axis)
            leader, follower, sign = translation_ends(self.drivetrain, coupling, dof)
            self.assembly.derive_dof(follower, leader, sign)


def _check_laws(train: _Train) -> None:
    known = train.assembly.meshes
    for name in train.assembly.mesh_laws:
        if name not in known:
            raise ModelError(f"mesh law for '{name}': no such mesh; known: {', '.join(known)}")


def _finish(train: _Train) -> MultibodySystem:
    assembly = train.assembly
    assembly.mbs.Assemble()
    return MultibodySystem(
        container=assembly.container,
        mbs=assembly.mbs,
        dofs=tuple(assembly.dofs.values()),
        derived=dict(assembly.derived),
        locked=tuple(assembly.locked),
        bodies=train.bodies | train.hubs,
        meshes=dict(assembly.meshes),
    )

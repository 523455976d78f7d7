"""Stages and couplings in one exudyn system, whole or split into one system per stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..contact.mesh_excitation import MeshLaw
from ..errors import ModelError
from ..model.couplings import Coupling
from ..model.parameters import Drivetrain
from ..model.placement import hub_ratios, place_parts, rigid_end, translation_ends, turnings
from ..representation import counted, html_table, listing
from ..stages.geometry import DIRECTIONS
from ..stages.part import Part, RigidBody
from .elements import Assembly, Dof, Mesh

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
    interface DoF on both sides of the cut (the paper, Eqs. 6 and 10). A massless hub is cut at its
    rigid end: its spring is the joint, in neither of the two. Translations are joints too. Laws in
    ``meshes`` of other stages' meshes are left aside.
    """
    train = _Train(drivetrain, meshes or {})
    train.add_part(drivetrain.part(name))
    for coupling in drivetrain.couplings:
        train.add_hub(coupling, share=0.5)
    return _finish(train)


class _Train:
    """A drivetrain being put together."""

    def __init__(self, drivetrain: Drivetrain, meshes: Mapping[str, MeshLaw]) -> None:
        self.drivetrain = drivetrain
        self.turnings = turnings(drivetrain)
        self.ratios = hub_ratios(drivetrain)
        self.frames = place_parts(drivetrain)
        self.assembly = Assembly(drivetrain.damping, meshes)
        self.bodies: dict[str, RigidBody] = {}
        self.hubs: dict[str, RigidBody] = {}

    def add_part(self, part: Part) -> None:
        """Add the bodies and springs of a stage or an inertia."""
        self.bodies |= part.build(self.assembly, self.frames[part.name])

    def add_hub(self, coupling: Coupling, share: float) -> None:
        """Add a share of a hub, sprung or welded to the bodies that are in the system."""
        ends = [end for end in coupling.ends if end[0] in self.bodies]
        if coupling.massless and share < 1.0:
            ends = [end for end in ends if end == rigid_end(coupling)]
        if not ends:
            return
        r, label = coupling.radius, f"{coupling.name}.w"
        turn = self.turnings[coupling.first]
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
        ratio = self.ratios[coupling.name, name]
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

"""The few exudyn items a drivetrain is made of: bodies, bearings, meshes, torsion springs.

Every spring carries the damper c = β k beside it and every inertia the
damper α M to ground, so that the same element-wise damping reaches the linearised system and the
time domain.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    CoordinateConstraint,
    CoordinateSpringDamper,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    Node1D,
    NodePointGround,
    NodeRigidBody2D,
    NodeRigidBodyRxyz,
    ObjectGenericODE2,
    ObjectGround,
    ObjectRigidBody,
    ObjectRotationalMass1D,
    RigidBody2D,
    RigidBodySpringDamper,
    VObjectGenericODE2,
)
from numpy.typing import NDArray

from ..contact.involute_mesh import InvolutePair, gradient, transverse_mesh
from ..contact.mesh_element import mesh_forces_on_bodies, mesh_jacobian
from ..contact.mesh_excitation import LawSamples, MeshLaw, mesh_force
from ..errors import ModelError
from ..model.parameters import Damping
from ..stages.part import RigidBody
from .offset_moment import offset_jacobian, offset_moment

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
HELD = 1e12  # times a locked coordinate's own inertia


@dataclass(frozen=True)
class Mesh:
    """Two gears in mesh: exudyn's object, its bodies, and what it computes its force from.

    Attributes
    ----------
    object_number
        exudyn's.
    bodies
        First and second gear.
    pair
        Their geometry.
    stiffness, damping
        k_m (N/m) and c (N s/m).
    samples
        The law of the force, at the instants a run asks for.
    """

    object_number: int
    bodies: tuple[RigidBody, RigidBody]
    pair: InvolutePair
    stiffness: float
    damping: float
    samples: LawSamples

    @property
    def law(self) -> MeshLaw:
        """The law of its force."""
        return self.samples.law

    @property
    def row_at_rest(self) -> Vector:
        """∂δ/∂q of both bodies' coordinates, as placed."""
        return self.row(np.zeros(2 * self.bodies[0].coordinates))

    def row(self, q: Vector) -> Vector:
        """∂δ/∂q of both bodies' coordinates, where these are q: the line of action goes along."""
        size = self.bodies[0].coordinates
        _, n_x, n_y, _ = transverse_mesh(self.pair, math)(
            q[size] - q[0], q[size + 1] - q[1], q[size - 1], q[-1]
        )
        return np.array(gradient(self.pair, n_x, n_y, size))


@dataclass(frozen=True)
class Dof:
    """A labelled DoF: the exudyn coordinates that move with it, per unit of the DoF.

    ``components`` holds (node, coordinate of the node, factor). The transform between labels and
    exudyn's global coordinates is made of these alone.
    """

    label: str
    components: tuple[tuple[int, int, float], ...]


@dataclass
class Assembly:
    """A multibody system being put together (the one mutable object; frozen by ``drivetrain``)."""

    damping: Damping
    mesh_laws: Mapping[str, MeshLaw] = field(default_factory=dict)
    container: Any = field(default_factory=exu.SystemContainer)
    mbs: Any = field(init=False)
    dofs: dict[str, Dof] = field(default_factory=dict)
    derived: dict[str, tuple[str, float]] = field(default_factory=dict)
    locked: list[tuple[int, int]] = field(default_factory=list)
    meshes: dict[str, Mesh] = field(default_factory=dict)
    _ground_object: int = field(init=False)
    _ground_coordinate: int = field(init=False)

    def __post_init__(self) -> None:
        exu.config.printToConsole = False
        self.mbs = self.container.AddSystem()
        self._ground_object = self.mbs.AddObject(ObjectGround())
        ground_node = self.mbs.AddNode(NodePointGround())
        self._ground_coordinate = self.mbs.AddMarker(
            MarkerNodeCoordinate(nodeNumber=ground_node, coordinate=0)
        )

    @property
    def beta(self) -> float:
        """β of the damping c = β k (s)."""
        return self.damping.stiffness_proportional

    def planar_body(self, centre: Vector, mass: float, inertia: float) -> RigidBody:
        """A body moving in the plane of the gears (x, y, rotation)."""
        node = self.mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[centre[0], centre[1], 0.0]))
        number = self.mbs.AddObject(RigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
        body = RigidBody(number, node, centre, dimension=2)
        self._mass_damping(body, (mass, mass, inertia))
        return body

    def rocking_body(
        self, centre: Vector, mass: float, polar_inertia: float, diametral_inertia: float
    ) -> RigidBody:
        """A spatial body: y, z, rocking about y, rotation about z; x and its rotation locked."""
        inertia = [diametral_inertia, diametral_inertia, polar_inertia]
        node = self.mbs.AddNode(NodeRigidBodyRxyz(referenceCoordinates=[*centre, 0.0, 0.0, 0.0]))
        number = self.mbs.AddObject(
            ObjectRigidBody(mass=mass, inertia=[*inertia, 0.0, 0.0, 0.0], nodeNumber=node)
        )
        body = RigidBody(number, node, centre, dimension=3)
        self._lock(body, (mass, 0.0, 0.0, diametral_inertia, 0.0, 0.0))
        self._mass_damping(body, (mass, mass, mass, *inertia))
        return body

    def hub(self, inertia: float) -> RigidBody:
        """A rotor with its rotation alone."""
        node = self.mbs.AddNode(Node1D(referenceCoordinates=[0.0]))
        number = self.mbs.AddObject(ObjectRotationalMass1D(inertia=inertia, nodeNumber=node))
        body = RigidBody(number, node, np.zeros(3), dimension=1)
        self._mass_damping(body, (inertia,))
        return body

    def bearing(
        self,
        body: RigidBody,
        stiffness: Matrix,
        damping: Matrix,
        *,
        support: RigidBody | None = None,
        axes: Matrix,
    ) -> None:
        """Springs between a body's centre and the point of ``support`` (or ground) that lies there.

        ``stiffness`` and ``damping`` (6, 6) are along and about ``axes`` (3 × 3, columns in global
        coordinates), which turn with the support.
        """
        base = self._ground_object if support is None else support.object_number
        at = body.centre if support is None else body.centre - support.centre
        markers = [
            self._marker(base, at, axes),
            self._marker(body.object_number, np.zeros(3), axes),
        ]
        self.mbs.AddObject(
            RigidBodySpringDamper(
                markerNumbers=markers,
                stiffness=stiffness,
                damping=damping,
                # The intrinsic formulation is for large relative rotations about any axis; here the
                # support's axes are the bearing's, as they are in the shaft.
                useIntrinsicFormulation=False,
            )
        )
        along = (axes @ stiffness[:3, :3] @ axes.T)[:2, :2]
        if support is not None and not np.allclose(along, along[0, 0] * np.eye(2), rtol=1e-12):
            self._offset_moment(support, body, at[:2], along)

    def _offset_moment(
        self, support: RigidBody, body: RigidBody, at: Vector, stiffness: Matrix
    ) -> None:
        """What exudyn's bearing leaves out of the moment on its support: see `offset_moment`."""
        self.mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=[support.node_number, body.node_number],
                forceUserFunction=offset_moment(at, stiffness),
                jacobianUserFunction=offset_jacobian(at, stiffness),
                visualization=VObjectGenericODE2(show=False),
            )
        )

    def mesh(
        self,
        name: str,
        first: RigidBody,
        second: RigidBody,
        pair: InvolutePair,
        stiffness: float,
    ) -> None:
        """The teeth of two gears, unloaded as placed, with the force law of ``name``."""
        samples = LawSamples(self.mesh_laws.get(name, MeshLaw()))
        damping = self.beta * stiffness
        force = mesh_force(stiffness, damping, samples)
        number = self.mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=[first.node_number, second.node_number],
                forceUserFunction=mesh_forces_on_bodies(pair, first.coordinates, force),
                jacobianUserFunction=mesh_jacobian(pair, first.coordinates, force),
                visualization=VObjectGenericODE2(show=False),
            )
        )
        self.meshes[name] = Mesh(number, (first, second), pair, stiffness, damping, samples)

    def torsion_spring(
        self, body: RigidBody, stiffness: float, other: RigidBody | None = None
    ) -> None:
        """A torsion spring (N m/rad) between the rotations of a body and of another, or ground."""
        ends = (body, body.rotation), (other, other.rotation) if other else None
        self._coordinate_spring(*ends, stiffness, self.beta * stiffness)

    def translation_spring(
        self,
        body: RigidBody,
        other: RigidBody,
        coordinate: int,
        stiffness: float,
        damping: float | None,
    ) -> None:
        """A spring along a global axis (0, 1, 2) between displacements of two coaxial bodies."""
        own = self.beta * stiffness
        ends = (body, coordinate), (other, coordinate)
        self._coordinate_spring(*ends, stiffness, own if damping is None else damping)

    def weld(self, body: RigidBody, coordinate: int, other: RigidBody, of_other: int) -> None:
        """Make a coordinate of one body follow that of another."""
        markers = [
            self._coordinate_marker(body.node_number, coordinate),
            self._coordinate_marker(other.node_number, of_other),
        ]
        self.mbs.AddObject(CoordinateConstraint(markerNumbers=markers))

    def add_dof(self, label: str, *components: tuple[RigidBody, int, float]) -> None:
        """Name a DoF by the coordinates (body, coordinate, factor) that move with it."""
        self.dofs[label] = Dof(
            label, tuple((body.node_number, index, factor) for body, index, factor in components)
        )

    def derive_dof(self, label: str, master: str, factor: float) -> None:
        """Make DoF ``label`` follow: its value is ``factor`` times that of ``master``.

        Raises
        ------
        ModelError
            They are one already: a loop of rigid couplings.
        """
        own, inner = self.derived.get(label, (label, 1.0))
        leader, outer = self.derived.get(master, (master, 1.0))
        if own == leader:
            raise ModelError(
                f"rigid couplings tie {label} and {master} twice: they close a loop without a "
                "spring in it; give one of them a stiffness"
            )
        ratio = factor * outer / inner  # own = ratio·leader
        followed, base = self.dofs.pop(own), self.dofs[leader]
        moved = tuple((node, index, value * ratio) for node, index, value in followed.components)
        self.dofs[leader] = Dof(leader, base.components + moved)
        for other, (of, value) in self.derived.items():
            if of == own:
                self.derived[other] = (leader, value * ratio)
        self.derived[own] = (leader, ratio)

    def _marker(self, number: int, position: Vector, axes: Vector) -> int:
        frame = np.eye(4)
        frame[:3, :3] = axes
        frame[:3, 3] = position
        marker: int = self.mbs.AddMarker(MarkerBodyRigid(bodyNumber=number, localHT=frame))
        return marker

    def _coordinate_marker(self, node: int, coordinate: int) -> int:
        marker: int = self.mbs.AddMarker(
            MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate)
        )
        return marker

    def _coordinate_spring(
        self,
        end: tuple[RigidBody, int],
        other: tuple[RigidBody, int] | None,
        stiffness: float,
        damping: float,
    ) -> None:
        base = self._ground_coordinate
        if other is not None:
            base = self._coordinate_marker(other[0].node_number, other[1])
        marker = self._coordinate_marker(end[0].node_number, end[1])
        self.mbs.AddObject(
            CoordinateSpringDamper(
                markerNumbers=[base, marker], stiffness=stiffness, damping=damping
            )
        )

    def _coordinate_damper(self, node: int, coordinate: int, damping: float) -> None:
        markers = [self._ground_coordinate, self._coordinate_marker(node, coordinate)]
        self.mbs.AddObject(
            CoordinateSpringDamper(markerNumbers=markers, stiffness=0.0, damping=damping)
        )

    def _mass_damping(self, body: RigidBody, inertias: Sequence[float]) -> None:
        alpha = self.damping.mass_proportional
        if alpha > 0.0:
            for coordinate, inertia in enumerate(inertias):
                self._coordinate_damper(body.node_number, coordinate, alpha * inertia)

    def _lock(self, body: RigidBody, inertias: Sequence[float]) -> None:
        """Hold the coordinates that have an inertia here.

        A constraint to ground holds them in implicit steps; explicit ones put them back to zero
        only at their end. Between an explicit step's stages they would move, and make it one of
        first order: a great inertia keeps them from it.
        """
        for coordinate in np.flatnonzero(inertias).tolist():
            markers = [
                self._ground_coordinate,
                self._coordinate_marker(body.node_number, coordinate),
            ]
            self.mbs.AddObject(CoordinateConstraint(markerNumbers=markers))
            self.locked.append((body.node_number, coordinate))
        self.mbs.AddObject(
            ObjectGenericODE2(
                nodeNumbers=[body.node_number],
                massMatrix=HELD * np.diag(inertias),
                visualization=VObjectGenericODE2(show=False),
            )
        )

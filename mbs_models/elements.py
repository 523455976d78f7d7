"""The few exudyn items a drivetrain is made of: bodies, bearings, mesh springs, torsion springs.

Nothing here knows gears. Every spring carries the damper c = β k beside it and every inertia the
damper α M to ground, so that the same element-wise damping reaches the linearised system and the
time domain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
    ObjectGround,
    ObjectRigidBody,
    ObjectRotationalMass1D,
    RigidBody2D,
    RigidBodySpringDamper,
    SpringDamper,
)
from numpy.typing import NDArray

from .errors import ModelError
from .meshing.mesh_excitation import MeshLaw, force_law
from .parameters import Damping

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
ROTATION = {2: 2, 3: 5, 1: 0}  # coordinate of the rotation about the gear axis, by body dimension


@dataclass(frozen=True)
class RigidBody:
    """A body in the system: its exudyn object and node, its centre and what kind of node it has."""

    object_number: int
    node_number: int
    centre: Vector
    dimension: int  # 3: NodeRigidBodyRxyz, 2: NodeRigidBody2D, 1: Node1D

    @property
    def rotation(self) -> int:
        """Index of the rotation about the gear axis among the node's coordinates."""
        return ROTATION[self.dimension]


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
    meshes: dict[str, int] = field(default_factory=dict)
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
        for coordinate in (0, 3):
            self._lock(node, coordinate)
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

    def mesh_spring(
        self,
        name: str,
        first: RigidBody,
        first_point: Vector,
        second: RigidBody,
        second_point: Vector,
        stiffness: float,
    ) -> None:
        """A spring between two points of two bodies (each from its centre), unloaded as placed.

        Where there is a law of that ``name`` its force is the law's.
        """
        length = np.linalg.norm((second.centre + second_point) - (first.centre + first_point))
        markers = [
            self._marker(first.object_number, first_point, np.eye(3)),
            self._marker(second.object_number, second_point, np.eye(3)),
        ]
        damping = self.damping.stiffness_proportional * stiffness
        law = self.mesh_laws.get(name)
        self.meshes[name] = self.mbs.AddObject(
            SpringDamper(
                markerNumbers=markers,
                referenceLength=float(length),
                stiffness=stiffness,
                damping=damping,
                springForceUserFunction=_user_function(law, stiffness, damping) if law else 0,
            )
        )

    def torsion_spring(
        self, body: RigidBody, stiffness: float, other: RigidBody | None = None
    ) -> None:
        """A torsion spring (N m/rad) between the rotations of a body and of another, or ground."""
        ends = (body, body.rotation), (other, other.rotation) if other else None
        self._coordinate_spring(*ends, stiffness, self.damping.stiffness_proportional * stiffness)

    def translation_spring(
        self,
        body: RigidBody,
        other: RigidBody,
        coordinate: int,
        stiffness: float,
        damping: float | None,
    ) -> None:
        """A spring along a global axis (0, 1, 2) between displacements of two coaxial bodies."""
        own = self.damping.stiffness_proportional * stiffness
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

    def _lock(self, node: int, coordinate: int) -> None:
        markers = [self._ground_coordinate, self._coordinate_marker(node, coordinate)]
        self.mbs.AddObject(CoordinateConstraint(markerNumbers=markers))
        self.locked.append((node, coordinate))


def _user_function(law: MeshLaw, stiffness: float, damping: float) -> Callable[..., float]:
    """A mesh's force law as exudyn calls it.

    A Python function, not a symbolic one: that would be a third faster with eight meshes, but leaks
    40 kB each and takes no function that a waveform may be.
    """
    tension = force_law(law, stiffness, damping)

    def spring_force(
        mbs: Any, time: float, item: int, stretch: float, rate: float, *parameters: float
    ) -> float:
        return tension(time, stretch, rate)

    return spring_force

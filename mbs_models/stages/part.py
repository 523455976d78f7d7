"""`Part`: a stage or an inertia, and all that the rest of the package asks of it.

A stage type is one class: the table of its keys in a model file, what its bodies and teeth are, and
how exudyn builds it. Nobody else knows one type from another.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ..contact.involute_mesh import InvolutePair
from .bodies import Name, Table
from .geometry import DIRECTIONS, Frame, Vector
from .given_springs import GivenSpring, mesh_spring
from .mesh_tables import CONSTANT_STIFFNESS, MeshVariation, TransmissionError
from .planet_set import PlanetSet
from .teeth import Gear

Matrix = NDArray[np.float64]


class Role(StrEnum):
    """What a body is in the machine: how it is drawn, and what inertia it can have."""

    PINION = "pinion"
    WHEEL = "wheel"
    SUN = "sun"
    RING = "ring"
    CARRIER = "carrier"
    PLANET = "planet"
    ROTOR = "rotor"
    HUB = "hub"


class Kind(StrEnum):
    """The kinds of modes."""

    RIGID_BODY = "rigid-body"
    ROTATIONAL = "rotational"
    TRANSLATIONAL = "translational"
    PLANET = "planet"
    PARALLEL_STAGE = "parallel stage"
    STAGE = "stage"  # of a type that has no name of its own for its modes
    GLOBAL = "global"
    MIXED = "mixed"


def mesh_name(first: str, second: str) -> str:
    """What the mesh spring between two bodies is called."""
    stage, _, member = second.rpartition(".")
    return f"mesh {first} – {member if first.startswith(f'{stage}.') else second}"


@dataclass(frozen=True, eq=False)  # arrays do not compare
class Member:
    """A rigid body of a part.

    Attributes
    ----------
    body
        Its name in the drivetrain: ``planetary.sun``; an inertia's is the inertia's.
    role
        What it is in the machine.
    radius
        r of its rotation w = r·θ (m).
    inertias
        DoF → what moves with it (kg, rotations I/r²), in the order of the labels. Translations
        have the names of `DIRECTIONS`; all others are rotations.
    pitch_radius
        As drawn (m); None: its radius.
    centre
        In the part's frame (m).
    sense
        −1 where positive w is clockwise in the part's frame.
    teeth
        If they are given.
    table
        The key of its table in the model file, if it has one.
    """

    body: str
    role: Role
    radius: float
    inertias: Mapping[str, float]
    pitch_radius: float | None = None
    centre: Vector = field(default_factory=lambda: np.zeros(3))
    sense: float = 1.0
    teeth: int | None = None
    table: str = ""

    @property
    def label_inertias(self) -> dict[str, float]:
        """Label of each DoF → inertia (kg)."""
        return {f"{self.body}.{dof}": inertia for dof, inertia in self.inertias.items()}

    @property
    def label_radii(self) -> dict[str, float | None]:
        """Label of each DoF → radius r of a rotation carried as r·θ (m); None: a translation."""
        return {
            f"{self.body}.{dof}": None if dof in DIRECTIONS else self.radius
            for dof in self.inertias
        }

    @property
    def translations(self) -> dict[str, str]:
        """What its translations are called, by direction."""
        return {DIRECTIONS[dof]: dof for dof in self.inertias if dof in DIRECTIONS}


@dataclass(frozen=True)
class MeshFamily:
    """The meshes of one key of a stage: a gear, and those it meshes with in the same way.

    Attributes
    ----------
    key
        What its keys in the model file begin with: ``mesh``, ``sun_mesh``.
    gear, others
        The bodies.
    stiffness
        Of each mesh (N/m).
    diameter
        Pitch diameter of the smaller gear (m).
    variation, error, backlash
        What the model file says of every one of them.
    """

    key: str
    gear: str
    others: tuple[str, ...]
    stiffness: tuple[float, ...]
    diameter: float
    variation: MeshVariation = CONSTANT_STIFFNESS
    error: TransmissionError | None = None
    backlash: float = 0.0

    @property
    def stage(self) -> str:
        """Name of its stage."""
        return self.gear.partition(".")[0]

    @property
    def label(self) -> str:
        """What it is called: ``planetary sun meshes``, ``reducer mesh``."""
        return f"{self.stage} {self.key.replace('_', ' ')}{'es' if len(self.others) > 1 else ''}"

    @property
    def names(self) -> tuple[str, ...]:
        """Of its meshes."""
        return tuple(mesh_name(self.gear, other) for other in self.others)

    @property
    def varies(self) -> bool:
        """Whether it excites as the gears turn."""
        return self.variation != CONSTANT_STIFFNESS or self.error is not None


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
        return {3: 5, 2: 2, 1: 0}[self.dimension]

    @property
    def coordinates(self) -> int:
        """How many coordinates its node has."""
        return {3: 6, 2: 3, 1: 1}[self.dimension]


class Builder(Protocol):
    """What a part is built with; `system.elements.Assembly` makes exudyn items of it."""

    @property
    def beta(self) -> float:
        """β of the damping c = β k (s)."""

    def planar_body(self, centre: Vector, mass: float, inertia: float) -> RigidBody:
        """A body moving in the plane of the gears (x, y, rotation)."""

    def rocking_body(
        self, centre: Vector, mass: float, polar_inertia: float, diametral_inertia: float
    ) -> RigidBody:
        """A spatial body: y, z, rocking about y, rotation about z."""

    def hub(self, inertia: float) -> RigidBody:
        """A rotor with its rotation alone."""

    def bearing(
        self,
        body: RigidBody,
        stiffness: Matrix,
        damping: Matrix,
        *,
        support: RigidBody | None = None,
        axes: Matrix,
    ) -> None:
        """Springs and dampers (6, 6) along and about ``axes`` to a support, or ground."""

    def mesh(
        self, name: str, first: RigidBody, second: RigidBody, pair: InvolutePair, stiffness: float
    ) -> None:
        """The teeth of two gears, unloaded as placed."""

    def torsion_spring(
        self, body: RigidBody, stiffness: float, other: RigidBody | None = None
    ) -> None:
        """A torsion spring (N m/rad) to the rotation of another body, or ground."""

    def add_dof(self, label: str, *components: tuple[RigidBody, int, float]) -> None:
        """Name a DoF by the coordinates (body, coordinate, factor) that move with it."""


class Part(Table):
    """A stage or an inertia.

    A type of its own derives from it, has its keys as fields (a stage's ``type`` among them),
    and says what its bodies are and how exudyn builds them; what else it says is in addition.
    """

    name: Name

    # Its first two axes: translations have these names too (`DIRECTIONS`).
    axes: ClassVar[tuple[str, str]] = ("u", "v")
    # What a mode is that moves nothing but it.
    mode_kind: ClassVar[Kind] = Kind.STAGE

    @abstractmethod
    def members(self) -> tuple[Member, ...]:
        """Its bodies; those that a coupling can join come first."""

    @abstractmethod
    def build(self, builder: Builder, frame: Frame) -> dict[str, RigidBody]:
        """Add bodies, springs and DoFs, standing as ``frame`` says; returns the bodies by name."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names, without the part's, of the bodies that a coupling can join."""
        return tuple(member.body.partition(".")[2] for member in self.members())

    @property
    def drive_points(self) -> tuple[str, ...]:
        """DoFs whose drive point FRFs a report draws."""
        return (f"{self.members()[0].body}.w",)

    @property
    def caption(self) -> str:
        """What it is, in a word or two."""
        return type(self).__name__.lower()

    def describe(self) -> str:
        """What it was understood to be, in a line."""
        return f"{self.caption}, {sum(len(member.inertias) for member in self.members())} DoFs"

    def member(self, body: str) -> Member:
        """The body of that name in the drivetrain."""
        return next(member for member in self.members() if member.body == body)

    # Teeth

    def mesh_families(self) -> tuple[MeshFamily, ...]:
        """Its meshes."""
        return ()

    def planet_sets(self) -> tuple[PlanetSet, ...]:
        """Its planets, in sets between one sun and one ring."""
        return ()

    def planet_meshes(self) -> tuple[tuple[PlanetSet, MeshFamily, MeshFamily], ...]:
        """Each set of planets with the meshes of its sun and of its ring, planet by planet."""
        families = {family.gear: family for family in self.mesh_families()}
        return tuple((own, families[own.sun], families[own.ring]) for own in self.planet_sets())

    def gears(self) -> Sequence[Gear]:
        """Gears of a train that have teeth, with what the digits of their radii allow."""
        toothed = {
            member.table or member.body.partition(".")[2]: (member.teeth, member.radius)
            for member in self.members()
            if member.teeth is not None
        }
        return [Gear.written(name, *gear) for name, gear in toothed.items()]

    def mesh_phases(
        self, speeds: Mapping[str, float], flanks: Mapping[str, float]
    ) -> Mapping[str, float]:
        """Mesh → phase γ (mesh periods), of the meshes that are not in phase.

        ``speeds`` are along every body's positive w (rad/s), ``flanks`` the signs of the meshes'
        deflections when they press.
        """
        return {}

    # What may be typed wrong

    def given_springs(self) -> Iterator[GivenSpring]:
        """Every spring with its key; rotary ones seen at the radius."""
        for family in self.mesh_families():
            for value in sorted(set(family.stiffness)):
                yield mesh_spring(f"{family.key}_stiffness", value, family.diameter)

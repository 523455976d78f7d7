"""The turning drivetrain as the study computes it: constant system, meshes, bearings, families."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fbs.periodic.harmonic_balance import PeriodicResponse, steady_state
from fbs.periodic.periodic_springs import Lattice, PeriodicSpring, lattice
from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.components import Components, SpringKind
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.read_back import components

from ..arrays import FloatArray
from ..routes.periodic_meshes import PeriodicDrivetrain, parametric
from .plan import SpeedPlan

# Harmonics solved for beyond those shown: they leave 0.2 % in the last one shown where trapezoids
# excite modes up there, and 10 instead 5 %.
BEYOND = 20
# Combinations of several stages' meshes that are solved for (P of `Lattice`). With 3, a line of the
# wind turbine's shaft where two stages nearly cancel was 23 % off exudyn in time; with 10, 0.4 %.
COMBINED = 10


@dataclass(frozen=True)
class MeshFamily:
    """Meshes that share a line in a figure: one of a parallel stage, or all planets' with a gear.

    Attributes
    ----------
    name
        As ``planetary sun meshes``.
    stage
        Its stage.
    columns
        Where its meshes stand among all.
    """

    name: str
    stage: str
    columns: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Bearing:
    """A bearing as exudyn has it: force k G q + c G q̇ (N).

    Attributes
    ----------
    name
        The body it holds.
    rows, damping_rows
        (m, n_dof) k G and c G.
    """

    name: str
    rows: FloatArray
    damping_rows: FloatArray


@dataclass(frozen=True, eq=False)
class Turning:
    """What turns, in numbers.

    Attributes
    ----------
    plan
        What is asked.
    point
        The operating point at the highest speed: phases, flanks and static forces are those of
        every speed.
    periodic
        The constant system and its meshes.
    parts
        Bodies and springs as exudyn has them.
    lattice
        The lines that are shown; None where nothing excites. More harmonics are solved
        for, since the last ones of a balance miss what still higher ones give them back.
    families, bearings
        Of meshes, and what holds the bodies.
    """

    plan: SpeedPlan
    point: OperatingPoint
    periodic: PeriodicDrivetrain
    parts: Components
    lattice: Lattice | None
    families: tuple[MeshFamily, ...]
    bearings: tuple[Bearing, ...]

    @property
    def meshes(self) -> tuple[str, ...]:
        """Names of the meshes."""
        return tuple(spring.name for spring in self.periodic.springs)

    @property
    def static_forces(self) -> FloatArray:
        """(n_mesh,) N, positive where the loaded flanks press."""
        return np.array([spring.static_force for spring in self.periodic.springs])

    @property
    def lines(self) -> Lattice:
        """The lattice where something excites."""
        assert self.lattice is not None
        return self.lattice

    def steady_state(
        self, shaft_frequency: Sequence[float] | FloatArray, step: float | None = None
    ) -> PeriodicResponse:
        """The steady state on all lines solved for; see `fbs.steady_state`."""
        return steady_state(
            self.periodic.system,
            self.periodic.springs,
            shaft_frequency,
            harmonics=self.plan.harmonics + BEYOND,
            combinations=COMBINED,
            step=step,
        )


def shown_lines(shown: Lattice, solved: Lattice) -> NDArray[np.int64]:
    """Where the lines shown stand among those solved for."""
    place = {tuple(point): line for line, point in enumerate(solved.points.tolist())}
    return np.array([place[tuple(point)] for point in shown.points.tolist()])


def excited(springs: Sequence[PeriodicSpring]) -> bool:
    """Whether anything excites: a transmission error, or a stiffness that varies under load."""
    return any(
        bool(np.any(spring.error))
        or (spring.static_force != 0.0 and bool(np.any(spring.variation)))
        for spring in springs
    )


def turning(asked: SpeedPlan) -> Turning:
    """Build what a plan asks for.

    Raises
    ------
    ModelError
        There is no operating point: see `operating_point`.
    """
    drivetrain = asked.drivetrain
    point = operating_point(drivetrain, speed_rpm=float(asked.speeds[-1]), torque=asked.torque)
    parts = components(build_drivetrain(drivetrain))
    periodic = parametric(drivetrain, point)
    springs = periodic.springs
    return Turning(
        plan=asked,
        point=point,
        periodic=periodic,
        parts=parts,
        lattice=lattice(springs, asked.harmonics) if excited(springs) else None,
        families=mesh_families(drivetrain, tuple(spring.name for spring in springs)),
        bearings=bearings(parts),
    )


def mesh_families(drivetrain: Drivetrain, meshes: tuple[str, ...]) -> tuple[MeshFamily, ...]:
    """The families of all stages, by the places of their meshes."""
    return tuple(
        MeshFamily(
            family.label,
            family.stage,
            tuple(meshes.index(name) for name in family.names),
        )
        for family in drivetrain.mesh_families
    )


def bearings(parts: Components) -> tuple[Bearing, ...]:
    """Every bearing that exudyn was given."""
    return tuple(
        Bearing(
            spring.name.removeprefix(f"{SpringKind.BEARING} "),
            spring.stiffness @ spring.deflection,
            spring.damping @ spring.deflection,
        )
        for spring in parts.springs
        if spring.kind is SpringKind.BEARING
    )

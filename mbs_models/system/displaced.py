"""A system where a motion has moved it: its linearisation and the forces on it there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ..contact.mesh_excitation import MeshLaw
from ..interrupts import interrupts_held
from .drivetrain import MultibodySystem
from .linearization import (
    LinearizedSystem,
    coordinate_transform,
    linearize,
)


def linearized_at(system: MultibodySystem, motion: FloatArray) -> LinearizedSystem:
    """M, C and K about a position (n_dof,)."""
    with placed(system, motion):
        return linearize(system)


def forces_at(system: MultibodySystem, motion: FloatArray) -> FloatArray:
    """What all springs and meshes exert on the DoFs at rest in a position (N)."""
    mbs, transform = system.mbs, coordinate_transform(system)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    solver: Any = exu.MainSolverStatic()
    with interrupts_held(mbs), placed(system, motion):
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        forces = np.asarray(solver.GetSystemResidual())[: len(transform)]
        solver.FinalizeSolver(mbs, settings)
    on_dofs: FloatArray = transform.T @ forces
    return on_dofs


FloatArray = NDArray[np.float64]


class Displaced(Protocol):
    """A state away from the one a drivetrain is built in, such as an operating point."""

    @property
    def laws(self) -> Mapping[str, MeshLaw]:
        """Force laws of the meshes, by name."""

    @property
    def displacement(self) -> FloatArray:
        """(n_dof,) m."""


@contextmanager
def placed(system: MultibodySystem, motion: FloatArray) -> Iterator[None]:
    """The system with its initial state in a position (n_dof,); as built afterwards."""
    data, initial = system.mbs.systemData, exu.ConfigurationType.Initial
    as_built = data.GetODE2Coordinates(initial)
    data.SetODE2Coordinates((coordinate_transform(system) @ motion).tolist(), initial)
    try:
        yield
    finally:
        data.SetODE2Coordinates(as_built, initial)

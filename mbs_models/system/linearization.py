"""M, C and K of an exudyn system in labelled DoFs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ..interrupts import interrupts_held
from ..representation import counted, html_table, listing
from .drivetrain import MultibodySystem

Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]


@dataclass(frozen=True)
class LinearizedSystem:
    """M q̈ + C q̇ + K q = f about the state as built (the paper, Eq. 2).

    Attributes
    ----------
    mass, damping, stiffness
        (n, n) in kg, N s/m, N/m: rotations are carried as w = r·θ.
    dofs
        Labels of the rows.
    derived
        Further labels: label → (DoF, factor).
    """

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    dofs: tuple[str, ...]
    derived: Mapping[str, tuple[str, float]]

    def __repr__(self) -> str:
        also = f", {counted(len(self.derived), 'derived label')}" if self.derived else ""
        damped = "damped" if self.damping.any() else "undamped"
        return f"<LinearizedSystem: {counted(len(self.dofs), 'DoF')}{also}, {damped}>"

    def _repr_html_(self) -> str:
        ties = [f"{label} = {factor:g} {dof}" for label, (dof, factor) in self.derived.items()]
        rows = [("DoFs", listing(self.dofs)), ("derived", listing(ties))]
        return html_table(repr(self).strip("<>"), [row for row in rows if row[1]])

    @property
    def labels(self) -> tuple[str, ...]:
        """DoFs, then derived labels."""
        return self.dofs + tuple(self.derived)


def linearize(system: MultibodySystem) -> LinearizedSystem:
    """Let exudyn linearise a system, and express it in the labelled DoFs: Tᵀ(M, C, K)T.

    exudyn's own projection into the constraints' nullspace permutes coordinates; T keeps the
    labels instead: locked coordinates have no column, welded ones share one.
    """
    with interrupts_held(system.mbs):
        mass, stiffness, damping = system.mbs.ComputeLinearizedSystem()
    transform = coordinate_transform(system)

    def in_labels(matrix: Matrix) -> Matrix:
        return transform.T @ matrix @ transform

    return LinearizedSystem(
        mass=in_labels(mass),
        damping=in_labels(damping),
        stiffness=in_labels(stiffness),
        dofs=tuple(dof.label for dof in system.dofs),
        derived=system.derived,
    )


def round_off_force(system: MultibodySystem) -> float:
    """ε‖|K||x|‖, x exudyn's reference coordinates: what the springs' forces are known to (N)."""
    return round_off_forces(system)(0.0)


def round_off_forces(system: MultibodySystem) -> Callable[[Vector | float], float]:
    """ε‖|K|(|x| + |q|)‖ (N) over |q| (n_coordinate,), how far exudyn's coordinates have moved.

    Of an angle that has grown to many turns fewer digits are left for what strains a spring.
    """
    with interrupts_held(system.mbs):
        _, stiffness, _ = system.mbs.ComputeLinearizedSystem()
    stiffness = np.finfo(float).eps * np.abs(stiffness)
    total = system.mbs.systemData.GetODE2CoordinatesTotal(exu.ConfigurationType.Reference)
    position = np.abs(total)

    def force(moved: Vector | float) -> float:
        return float(np.linalg.norm(stiffness @ (position + moved)))

    return force


def coordinate_transform(system: MultibodySystem) -> Matrix:
    """T, (exudyn coordinates × DoFs): the one place where labels meet exudyn's coordinates."""
    n_coordinates = len(system.mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Initial))
    transform = np.zeros((n_coordinates, len(system.dofs)))
    for column, dof in enumerate(system.dofs):
        for node, coordinate, factor in dof.components:
            transform[system.mbs.GetNodeODE2Index(node) + coordinate, column] = factor
    return transform

"""Coordinates locked in the model: constraints on labelled DoFs, projected out by exudyn."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from exudyn.utilities import (
    CoordinateVectorConstraint,
    MarkerNodeCoordinates,
    NodePointGround,
)
from numpy.typing import NDArray

from ..errors import ModelError
from .drivetrain import MultibodySystem
from .elements import Dof
from .linearization import coordinate_transform


def lock_dofs(system: MultibodySystem, labels: Iterable[str]) -> MultibodySystem:
    """Hold labelled DoFs at zero by constraints to ground, and assemble the system again.

    Parameters
    ----------
    system
        An assembled system. It is changed: its exudyn system gets the constraints.
    labels
        DoFs to hold; a derived label holds the DoF it follows.

    Returns
    -------
    MultibodySystem
        The same exudyn system, with the DoFs that are left and the labels derived from them.

    Raises
    ------
    ModelError
        A label is unknown, or nothing is left to move.
    """
    by_label = {dof.label: dof for dof in system.dofs}
    known = (*by_label, *system.derived)
    held: dict[str, Dof] = {}
    for label in labels:
        if label not in known:
            raise ModelError(f"unknown DoF '{label}'; known: {', '.join(known)}")
        name = system.derived.get(label, (label, 1.0))[0]
        held[name] = by_label[name]
    if len(held) == len(by_label):
        raise ModelError("every DoF is locked: nothing is left to move")
    ground = system.mbs.AddMarker(
        MarkerNodeCoordinates(nodeNumber=system.mbs.AddNode(NodePointGround()))
    )
    for dof in held.values():
        _hold(system, dof, ground)
    system.mbs.Assemble()
    return MultibodySystem(
        container=system.container,
        mbs=system.mbs,
        dofs=tuple(dof for label, dof in by_label.items() if label not in held),
        derived={
            label: follows for label, follows in system.derived.items() if follows[0] not in held
        },
        locked=system.locked,
    )


def _hold(system: MultibodySystem, dof: Dof, ground: int) -> None:
    """Σ c·q = 0 over the node coordinates q that move with the DoF.

    One node is enough: what else moves with the DoF is welded to it.
    """
    node = dof.components[0][0]
    factors = {coordinate: factor for n, coordinate, factor in dof.components if n == node}
    marker = system.mbs.AddMarker(MarkerNodeCoordinates(nodeNumber=node))
    row = np.zeros((1, len(system.mbs.GetNode(node)["referenceCoordinates"])))
    for coordinate, factor in factors.items():
        row[0, coordinate] = factor / np.linalg.norm(list(factors.values()))
    system.mbs.AddObject(
        CoordinateVectorConstraint(
            markerNumbers=[ground, marker],
            scalingMarker0=np.zeros((1, 0)),  # ground has no coordinates
            scalingMarker1=row,
            offset=[0.0],
        )
    )


@dataclass(frozen=True)
class ProjectedSystem:
    """M z̈ + C ż + K z = Nᵀ Q: a system as exudyn projects it into its constraints' nullspace.

    Attributes
    ----------
    mass, damping, stiffness
        (n, n), in exudyn's own coordinates z of the nullspace.
    shapes
        (n_dof, n) labelled DoFs per unit of z.
    dofs
        Labels of the rows of ``shapes``.
    """

    mass: NDArray[np.float64]
    damping: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    shapes: NDArray[np.float64]
    dofs: tuple[str, ...]

    def receptance(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """H = S (K − ω²M + jωC)⁻¹ Sᵀ at frequencies in Hz; (n_frequency, n_dof, n_dof) m/N."""
        omega = 2.0 * np.pi * frequency[:, None, None]
        dynamic_stiffness = self.stiffness - omega**2 * self.mass + 1j * omega * self.damping
        motion = np.linalg.solve(dynamic_stiffness, self.shapes.T.astype(complex))
        return np.asarray(self.shapes @ motion)


def project(system: MultibodySystem) -> ProjectedSystem:
    """Let exudyn linearise a system and project its constraints out.

    The labelled DoFs are read off exudyn's coordinates; nobody but exudyn decides what is locked.
    """
    mass, stiffness, damping, _, nullspace = system.mbs.ComputeLinearizedSystem(
        projectIntoConstraintNullspace=True, returnConstraintNullspace=True
    )
    transform = coordinate_transform(system)
    # The columns of T do not overlap: each DoF is read off the coordinates it moves.
    reading = transform.T / np.sum(transform**2, axis=0)[:, None]
    return ProjectedSystem(
        mass=np.asarray(mass),
        damping=np.asarray(damping),
        stiffness=np.asarray(stiffness),
        shapes=reading @ np.asarray(nullspace).T,  # its rows span the nullspace
        dofs=tuple(dof.label for dof in system.dofs),
    )

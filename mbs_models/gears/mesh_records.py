"""Mesh forces of a run, from its motion: the law of each mesh at every sample."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..contact.involute_mesh import mesh_motion
from ..contact.mesh_excitation import mesh_forces
from ..system.drivetrain import MultibodySystem
from ..system.elements import Mesh

FloatArray = NDArray[np.float64]


def mesh_records(
    system: MultibodySystem, time: FloatArray, position: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force of every mesh (N), and which flanks touch; `mesh_excitation` has the equation.

    Parameters
    ----------
    system
        With its meshes.
    time
        (n,) s.
    position, velocity
        (n, n_coordinate) exudyn's displacements and their rates.

    Returns
    -------
    forces, contact
        (n, n_mesh): positive where the loaded flanks press; 1 for these, −1 for their backs, else
        0.
    """
    found = []
    for mesh in system.meshes.values():
        columns = mesh_coordinates(system, mesh)
        deflection, rate = mesh_motion(mesh.pair, position[:, columns], velocity[:, columns])
        found.append(mesh_forces(mesh.law, mesh.stiffness, mesh.damping, time, deflection, rate))
    forces, contact = zip(*found, strict=True)
    return np.stack(forces, axis=1), np.stack(contact, axis=1)


def mesh_coordinates(system: MultibodySystem, mesh: Mesh) -> NDArray[np.int_]:
    """Where both bodies' coordinates stand among exudyn's."""
    firsts = [int(system.mbs.GetNodeODE2Index(body.node_number)) for body in mesh.bodies]
    return np.concatenate([first + np.arange(mesh.bodies[0].coordinates) for first in firsts])

"""Energy of a run against the work that is done on it.

    E = ½ vᵀM v + Σ ½ lᵀk l + Σ ½ k(t) g(x)²,    E(t) − E(0) = W(t)

over springs and meshes. In a step of h from (q, v) to (q′, v′) the loads f, the dampers and what of
the meshes' forces F is not elastic do, by the trapezoidal rule,

    ΔW = (f + f′)/2 · Δq − h v̄ᵀC v̄ − Σ [(F + F′)/2 Δδ − Δ ½ k g²],    v̄ = (v + v′)/2

which is what the trapezoidal integrator does itself, whatever the step. Of another one it differs
by (ωh)²/12 of the energy that a motion of ω exchanges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..components import GROUND, Spring, SpringKind
from ..drivetrain import MultibodySystem
from ..linearization import LinearizedSystem, coordinate_transform
from ..meshing.involute_mesh import mesh_motion
from ..meshing.mesh_excitation import elastic_energy, mesh_force, mesh_forces
from ..meshing.mesh_records import mesh_coordinates
from ..read_back import components

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class CarriedBearing:
    """A bearing in a body that may turn: its coordinates, its place in it, and what it is."""

    support: NDArray[np.int_]  # x, y, θ
    body: NDArray[np.int_]  # x, y
    at: FloatArray  # (2,) m
    stiffness: FloatArray  # (2, 2) N/m
    damping: FloatArray  # (2, 2) N s/m

    def _turned(self, position: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A and A′ = dA/dθ of the support (n, 2, 2)."""
        cos, sin = np.cos(position[:, self.support[2]]), np.sin(position[:, self.support[2]])
        turned = np.array([[cos, -sin], [sin, cos]]).transpose(2, 0, 1)
        return turned, np.array([[-sin, -cos], [cos, -sin]]).transpose(2, 0, 1)

    def _apart(self, position: FloatArray) -> FloatArray:
        """d = u − u_s + a − A a, between the body's centre and the support's point (n, 2)."""
        turned, _ = self._turned(position)
        apart: FloatArray = position[:, self.body] - position[:, self.support[:2]] + self.at
        return apart - turned @ self.at

    def energy(self, position: FloatArray) -> FloatArray:
        """½ lᵀk l, l = Aᵀd (`offset_moment`)."""
        turned, _ = self._turned(position)
        offset = np.einsum("nji,nj->ni", turned, self._apart(position))
        return 0.5 * _quadratic(offset, self.stiffness)

    def work(self, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """−(F + F′)/2 · Δd of the damper's force F = A c Aᵀ ḋ, step by step."""
        turned, derivative = self._turned(position)
        rate = velocity[:, self.body] - velocity[:, self.support[:2]]
        rate = rate - velocity[:, self.support[2:]] * (derivative @ self.at)
        force = np.einsum("nij,jk,nlk,nl->ni", turned, self.damping, turned, rate)
        step = np.diff(self._apart(position), axis=0)
        return np.asarray(-np.sum((force[1:] + force[:-1]) / 2.0 * step, axis=1))


class EnergyBalance:
    """Energy and work of a system's motion."""

    def __init__(self, system: MultibodySystem, linear: LinearizedSystem) -> None:
        self.system, self.mass = system, linear.mass
        transform = coordinate_transform(system)
        self._labels = transform / np.sum(transform**2, axis=0)
        springs = components(system).springs
        self._carried = [self._bearing(spring) for spring in springs if _is_carried(spring)]
        self._stiffness = np.zeros_like(linear.stiffness)
        self._damping = linear.damping.copy()
        for spring in springs:
            if _is_carried(spring):
                self._damping -= spring.deflection.T @ spring.damping @ spring.deflection
            elif spring.kind is not SpringKind.MESH:
                self._stiffness += spring.deflection.T @ spring.stiffness @ spring.deflection
        for mesh in system.meshes.values():
            row = mesh.row_at_rest @ transform[mesh_coordinates(system, mesh)]
            at_rest = mesh_force(mesh.stiffness, mesh.damping, mesh.samples)(0.0, 0.0, 0.0)
            self._damping -= at_rest[2] * np.outer(row, row)  # none where teeth are apart there

    def energy_and_work(
        self, time: FloatArray, position: FloatArray, velocity: FloatArray, loads: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """E at every instant, and ΔW of every step between two (J).

        Parameters
        ----------
        time
            (n,) s.
        position, velocity
            (n, n_coordinate) of exudyn.
        loads
            (n, n_dof) N, conjugate to the DoFs.
        """
        q, v = position @ self._labels, velocity @ self._labels
        energy = 0.5 * (_quadratic(v, self.mass) + _quadratic(q, self._stiffness))
        mean = (v[1:] + v[:-1]) / 2.0
        work = np.sum((loads[1:] + loads[:-1]) / 2.0 * np.diff(q, axis=0), axis=1)
        work -= np.diff(time) * _quadratic(mean, self._damping)
        for bearing in self._carried:
            energy = energy + bearing.energy(position)
            work += bearing.work(position, velocity)
        for mesh in self.system.meshes.values():
            columns = mesh_coordinates(self.system, mesh)
            deflection, rate = mesh_motion(mesh.pair, position[:, columns], velocity[:, columns])
            force, _ = mesh_forces(mesh.law, mesh.stiffness, mesh.damping, time, deflection, rate)
            elastic = elastic_energy(mesh.law, mesh.stiffness, time, deflection)
            closed = mesh.law.flank * np.diff(deflection)
            work += np.diff(elastic) - (force[1:] + force[:-1]) / 2.0 * closed
            energy = energy + elastic
        return energy, work

    def _bearing(self, spring: Spring) -> CarriedBearing:
        support, body = (self.system.bodies[end.body] for end in spring.ends)
        first = [int(self.system.mbs.GetNodeODE2Index(b.node_number)) for b in (support, body)]
        along = spring.axes[:2]
        return CarriedBearing(
            first[0] + np.arange(3),
            first[1] + np.arange(2),
            (body.centre - support.centre)[:2],
            along @ spring.stiffness @ along.T,
            along @ spring.damping @ along.T,
        )


def _is_carried(spring: Spring) -> bool:
    return spring.kind is SpringKind.BEARING and spring.ends[0].body != GROUND


def _quadratic(motion: FloatArray, matrix: FloatArray) -> FloatArray:
    """xᵀA x of every row x."""
    return np.asarray(np.sum(motion @ matrix * motion, axis=1))

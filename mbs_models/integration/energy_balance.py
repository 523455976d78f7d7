"""Energy of a run against the work that is done on it.

    E = ½ vᵀM v + Σ ½ lᵀk l + Σ ½ k(t) g(x)²,    E(t) − E(0) = W(t)

over springs and meshes. In a step of h from (q, v) to (q′, v′) the loads f, the dampers and what of
the meshes' forces F is not elastic do, by the trapezoidal rule,

    ΔW = (f + f′)/2 · Δq − h v̄ᵀC v̄ − Σ [(F + F′)/2 Δδ − Δ ½ k g²],    v̄ = (v + v′)/2

which is what the trapezoidal integrator does itself, whatever the step. An explicit one knows
motion and forces at its steps to a higher order: there the power is integrated, through the four
instants about each step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.involute_mesh import mesh_motion
from ..contact.mesh_excitation import elastic_energy, mesh_force, mesh_forces
from ..gears.mesh_records import mesh_coordinates
from ..system.components import GROUND, Spring, SpringKind
from ..system.drivetrain import MultibodySystem
from ..system.linearization import LinearizedSystem, coordinate_transform
from ..system.read_back import components

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

    def damper(
        self, position: FloatArray, velocity: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Its force A c Aᵀ ḋ, d and ḋ, (n, 2) each."""
        turned, derivative = self._turned(position)
        rate = velocity[:, self.body] - velocity[:, self.support[:2]]
        rate = rate - velocity[:, self.support[2:]] * (derivative @ self.at)
        force = np.einsum("nij,jk,nlk,nl->ni", turned, self.damping, turned, rate)
        return force, self._apart(position), rate


class EnergyBalance:
    """Energy and work of a system's motion."""

    def __init__(
        self, system: MultibodySystem, linear: LinearizedSystem, *, explicit: bool
    ) -> None:
        self.system, self.mass, self.explicit = system, linear.mass, explicit
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
        # Forces, what they move, and how fast: loads and dampers, carried dampers, meshes.
        forces, moved, rates = [loads - v @ self._damping], [q], [v]
        for bearing in self._carried:
            energy = energy + bearing.energy(position)
            damper, apart, rate = bearing.damper(position, velocity)
            forces, moved, rates = [*forces, -damper], [*moved, apart], [*rates, rate]
        stored = np.zeros(len(time))
        for mesh in self.system.meshes.values():
            columns = mesh_coordinates(self.system, mesh)
            closed, closing = mesh_motion(mesh.pair, position[:, columns], velocity[:, columns])
            force, _ = mesh_forces(mesh.law, mesh.stiffness, mesh.damping, time, closed, closing)
            stored += elastic_energy(mesh.law, mesh.stiffness, time, closed)
            forces.append(-mesh.law.flank * force[:, None])
            moved, rates = [*moved, closed[:, None]], [*rates, closing[:, None]]
        pushed = np.hstack(forces)
        if self.explicit:
            power = np.sum(pushed * np.hstack(rates), axis=1)
            work = _integrals(power) * (time[1] - time[0])
        else:
            step = np.diff(np.hstack(moved), axis=0)
            work = np.sum((pushed[1:] + pushed[:-1]) / 2.0 * step, axis=1)
        return energy + stored, work + np.diff(stored)

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


def _integrals(power: FloatArray) -> FloatArray:
    """∫ from each sample to the next (n − 1): of a cubic, at the ends of a parabola.

    (−P₋₁ + 13 P₀ + 13 P₁ − P₂)/24, and (5 P₀ + 8 P₁ − P₂)/12, per step.
    """
    if len(power) < 4:
        return np.asarray((power[1:] + power[:-1]) / 2.0)
    inner = (-power[:-3] + 13.0 * power[1:-2] + 13.0 * power[2:-1] - power[3:]) / 24.0
    first = (5.0 * power[0] + 8.0 * power[1] - power[2]) / 12.0
    last = (5.0 * power[-1] + 8.0 * power[-2] - power[-3]) / 12.0
    return np.concatenate([[first], inner, [last]])


def _quadratic(motion: FloatArray, matrix: FloatArray) -> FloatArray:
    """xᵀA x of every row x."""
    return np.asarray(np.sum(motion @ matrix * motion, axis=1))

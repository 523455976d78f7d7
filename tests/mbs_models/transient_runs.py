"""Runs to try, and exact solutions of linearised systems from SciPy's matrix exponential."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from mbs_models.integration.integrators import Integrator
from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.lines import Harmonic
from mbs_models.system.drivetrain import MultibodySystem, build_drivetrain
from mbs_models.system.linearization import LinearizedSystem
from tests.strategies import damped

FloatArray = NDArray[np.float64]
SUN, PINION = "planetary.sun.w", "reducer.pinion.w"
SCALE = 1e5  # 1/s: makes displacement and velocity alike in size


def first_order(linear: LinearizedSystem) -> FloatArray:
    """A of ẏ = A y, y = (q, q̇/SCALE)."""
    n = len(linear.dofs)
    inverse = np.linalg.inv(linear.mass)
    blocks = [
        [np.zeros((n, n)), SCALE * np.eye(n)],
        [-inverse @ linear.stiffness / SCALE, -inverse @ linear.damping],
    ]
    return np.block(blocks)


def harmonic(
    linear: LinearizedSystem, dof: str, amplitude: float, frequency: float, step: float, count: int
) -> tuple[FloatArray, FloatArray]:
    """q and q̇ from rest under A cos(ωt): the force is two more states, cos and sin."""
    n, omega = len(linear.dofs), 2.0 * np.pi * frequency
    whole = np.zeros((2 * n + 2, 2 * n + 2))
    whole[: 2 * n, : 2 * n] = first_order(linear)
    force = np.zeros(n)
    force[linear.dofs.index(dof)] = amplitude
    whole[n : 2 * n, 2 * n] = np.linalg.solve(linear.mass, force) / SCALE
    whole[2 * n, 2 * n + 1], whole[2 * n + 1, 2 * n] = -omega, omega
    start = np.zeros(2 * n + 2)
    start[2 * n] = 1.0
    return _march(whole, start, step, count, n)


def free(
    linear: LinearizedSystem,
    displacement: FloatArray,
    velocity: FloatArray,
    step: float,
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """q and q̇ from a state on, without a force."""
    start = np.concatenate([displacement, velocity / SCALE])
    return _march(first_order(linear), start, step, count, len(linear.dofs))


def _march(
    matrix: FloatArray, start: FloatArray, step: float, count: int, n: int
) -> tuple[FloatArray, FloatArray]:
    transition, states = expm(matrix * step), [start]
    for _ in range(count - 1):
        states.append(transition @ states[-1])
    history = np.array(states)
    return history[:, :n], history[:, n : 2 * n] * SCALE


def planetary() -> MultibodySystem:
    return build_drivetrain(damped(load("lin-parker-4")))


def by(name: str, step: float) -> Integrator:
    return Integrator(name, step, "as given")


def at(dof: str, amplitude: float = 1.0, frequency: float = 1500.0) -> Excitation[Harmonic]:
    return Excitation(dof, Harmonic(amplitude, frequency))


def largest_error(found: Any, expected: Any) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())

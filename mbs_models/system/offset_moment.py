"""The moment of a bearing that is not alike in all directions, on the body that carries it.

With l = Aᵀ(u − u_s + a) − a a body's displacement in its support, A the support's rotation and a
the bearing's place in it, the potential ½ lᵀKl moves the support by lᵀK J(a + l), J a quarter turn.
exudyn's RigidBodySpringDamper takes the force to act at a, which leaves out lᵀKJl: nothing where K
is the same in all directions, else enough to turn a loaded drivetrain without a cause.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def offset_moment(at: Vector, stiffness: Matrix) -> Callable[..., list[float]]:
    """lᵀKJl on the support's rotation, as exudyn calls it."""
    (a, b), (_, d) = stiffness.tolist()

    def forces(mbs: Any, time: float, item: int, q: list[float], rates: list[float]) -> list[float]:
        x, y = _in_support(at, q)
        moment = (a * x + b * y) * -y + (b * x + d * y) * x
        return [0.0, 0.0, moment, 0.0, 0.0, 0.0]

    return forces


def offset_jacobian(at: Vector, stiffness: Matrix) -> Callable[..., Matrix]:
    """−∂(lᵀKJl)/∂q, as exudyn calls it."""
    by_offset = stiffness @ QUARTER_TURN - QUARTER_TURN @ stiffness

    def jacobian(
        mbs: Any,
        time: float,
        item: int,
        q: list[float],
        rates: list[float],
        of_position: float,
        of_velocity: float,
    ) -> Matrix:
        offset = np.array(_in_support(at, q))
        cos, sin = math.cos(q[2]), math.sin(q[2])
        back = np.array([[cos, sin], [-sin, cos]])  # Aᵀ
        turned = -QUARTER_TURN @ (offset + at)
        moves = np.column_stack([-back, turned, back, np.zeros(2)])  # ∂l/∂q
        jacobian = np.zeros((6, 6))
        jacobian[2] = -of_position * (by_offset @ offset) @ moves
        return jacobian

    return jacobian


def _in_support(at: Vector, q: list[float]) -> tuple[float, float]:
    """l of a body's centre from its place in the support, in the support's axes (m)."""
    cos, sin = math.cos(q[2]), math.sin(q[2])
    x, y = q[3] - q[0] + at[0], q[4] - q[1] + at[1]
    return cos * x + sin * y - at[0], cos * y - sin * x - at[1]

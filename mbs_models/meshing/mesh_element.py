"""The forces of a mesh on its two bodies, as exudyn asks for them: an object's user functions.

Springs between points of the two gears, which exudyn computes itself, are linkages: their points
leave the line of action as the gears turn. Python functions cost a few µs a call. Symbolic ones
would be faster, but leak memory, and numerical derivatives lose half the digits of K.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .involute_mesh import InvolutePair, curvature, gradient, transverse_deflection
from .mesh_excitation import MeshForce

Matrix = NDArray[np.float64]


def mesh_forces_on_bodies(
    pair: InvolutePair, size: int, force: MeshForce
) -> Callable[..., list[float]]:
    """−F ∂δ/∂q as exudyn calls it: a few µs, where C++ springs between points would be linkages."""
    motion = _motion(pair, size)

    def forces(mbs: Any, time: float, item: int, q: list[float], rates: list[float]) -> list[float]:
        deflection, row, _ = motion(q)
        rate = 0.0
        for share, velocity in zip(row, rates, strict=True):
            rate += share * velocity
        pressed = force(time, deflection, rate)[0]
        return [-pressed * share for share in row]

    return forces


def mesh_jacobian(pair: InvolutePair, size: int, force: MeshForce) -> Callable[..., Matrix]:
    """f_q (k ∂δ/∂q ∂δ/∂qᵀ + F ∂²δ/∂q²) + f_v c ∂δ/∂q ∂δ/∂qᵀ, exudyn's factors f."""
    motion = _motion(pair, size)

    def jacobian(
        mbs: Any,
        time: float,
        item: int,
        q: list[float],
        rates: list[float],
        of_position: float,
        of_velocity: float,
    ) -> Matrix:
        deflection, row, (n_x, n_y, length) = motion(q)
        across = np.array(row)
        pressed, stiffness, damping = force(time, deflection, float(across @ rates))
        jacobian: Matrix = (of_position * stiffness + of_velocity * damping) * np.outer(
            across, across
        )
        if pressed:
            jacobian += of_position * pressed * curvature(pair, n_x, n_y, length, size)
        return jacobian

    return jacobian


def _motion(
    pair: InvolutePair, size: int
) -> Callable[[list[float]], tuple[float, list[float], tuple[float, float, float]]]:
    """δ, ∂δ/∂q and the line of action (n_x, n_y, L) from both bodies' coordinates."""
    tilt, (z_1, b_1, z_2, b_2) = math.cos(pair.helix), pair.axial_row

    def motion(q: list[float]) -> tuple[float, list[float], tuple[float, float, float]]:
        try:
            deflection, n_x, n_y, length = transverse_deflection(
                math, pair, q[size] - q[0], q[size + 1] - q[1], q[size - 1], q[-1]
            )
        except (ValueError, OverflowError):
            # Centres nearer than the base circles allow, or far off: a run that has diverged.
            deflection = n_x = n_y = length = math.nan
        if size == 6:
            axial = z_1 * q[2] + b_1 * q[4] + z_2 * q[8] + b_2 * q[10]
            deflection = tilt * deflection + axial
        return deflection, gradient(pair, n_x, n_y, size), (n_x, n_y, length)

    return motion

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

from .involute_mesh import InvolutePair, curvature, gradient, transverse_mesh
from .mesh_excitation import MeshForce

Matrix = NDArray[np.float64]


def mesh_forces_on_bodies(
    pair: InvolutePair, size: int, force: MeshForce
) -> Callable[..., list[float]]:
    """−F ∂δ/∂q as exudyn calls it: for coordinates (x, y, θ) of a body, or (x, y, z, a, b, θ)."""
    motion, lost = transverse_mesh(pair, math), [math.nan] * (2 * size)
    tilt = math.cos(pair.helix)
    own, other = gradient(pair, 0.0, 0.0, 3)[2], gradient(pair, 0.0, 0.0, 3)[5]
    z_1, b_1, z_2, b_2 = pair.axial_row

    def planar(mbs: Any, time: float, item: int, q: list[float], v: list[float]) -> list[float]:
        try:
            deflection, n_x, n_y, _ = motion(q[3] - q[0], q[4] - q[1], q[2], q[5])
        except (ValueError, OverflowError):
            return lost
        rate = n_x * (v[0] - v[3]) + n_y * (v[1] - v[4]) + own * v[2] + other * v[5]
        pressed = force(time, deflection, rate)[0]
        along, across = pressed * n_x, pressed * n_y
        return [-along, -across, -pressed * own, along, across, -pressed * other]

    def spatial(mbs: Any, time: float, item: int, q: list[float], v: list[float]) -> list[float]:
        try:
            deflection, n_x, n_y, _ = motion(q[6] - q[0], q[7] - q[1], q[5], q[11])
        except (ValueError, OverflowError):
            return lost
        deflection = tilt * deflection + z_1 * q[2] + b_1 * q[4] + z_2 * q[8] + b_2 * q[10]
        n_x, n_y = tilt * n_x, tilt * n_y
        rate = n_x * (v[0] - v[6]) + n_y * (v[1] - v[7]) + own * v[5] + other * v[11]
        rate += z_1 * v[2] + b_1 * v[4] + z_2 * v[8] + b_2 * v[10]
        pressed = force(time, deflection, rate)[0]
        along, across = pressed * n_x, pressed * n_y
        return [
            -along, -across, -pressed * z_1, 0.0, -pressed * b_1, -pressed * own,
            along, across, -pressed * z_2, 0.0, -pressed * b_2, -pressed * other,
        ]  # fmt: skip

    # Centres nearer than the base circles allow, or far off, are a run that has diverged.
    return planar if size == 3 else spatial


def mesh_jacobian(pair: InvolutePair, size: int, force: MeshForce) -> Callable[..., Matrix]:
    """f_q (k ∂δ/∂q ∂δ/∂qᵀ + F ∂²δ/∂q²) + f_v c ∂δ/∂q ∂δ/∂qᵀ, exudyn's factors f."""
    motion, tilt = transverse_mesh(pair, math), math.cos(pair.helix)
    axial = np.array(gradient(pair, 0.0, 0.0, size))
    axial[[size - 1, -1]] = 0.0  # rotations are in the transverse deflection

    def jacobian(
        mbs: Any,
        time: float,
        item: int,
        q: list[float],
        rates: list[float],
        of_position: float,
        of_velocity: float,
    ) -> Matrix:
        try:
            deflection, n_x, n_y, length = motion(
                q[size] - q[0], q[size + 1] - q[1], q[size - 1], q[-1]
            )
        except (ValueError, OverflowError):
            return np.full((2 * size, 2 * size), math.nan)
        row = np.array(gradient(pair, n_x, n_y, size))
        deflection = tilt * deflection + float(axial @ q)
        pressed, stiffness, damping = force(time, deflection, float(row @ rates))
        matrix: Matrix = (of_position * stiffness + of_velocity * damping) * np.outer(row, row)
        if pressed:
            matrix += of_position * pressed * curvature(pair, n_x, n_y, length, size)
        return matrix

    return jacobian

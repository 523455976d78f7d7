"""The involute mesh: how far two gears press into each other, at any rotation.

Contact of two involutes is a belt between their base circles, crossed for an external mesh (σ = 1),
open for an internal one (σ = −1). With x from the first centre to the second, d = |x|, φ the angle
of x against the one at rest, R = r₁ + σ r₂, cos α = R/d and L = R tan α the length of the tangent:

    δ = f (r₁θ₁ + σ r₂θ₂) − R (φ + σ (inv α − inv α₀)),    inv α = tan α − α

    ∂δ/∂x = −n,  n = (σ L x + f R ẑ×x)/d²,    ∂δ/∂θ₁ = f r₁,  ∂δ/∂θ₂ = f σ r₂

n is the unit vector of the line of action: the forces k δ ∂δ/∂q have the potential ½kδ², act along
the line where it is (it tilts as the centres move) and on the arms r₁ and r₂ for ever. φ is counted
as the stage sees it: f = −1 where that looks along −z. A rigid roll leaves δ as it is, so that φ
may be taken in any turn: δ is the value nearest to 0 among those 2πR apart. Its second derivative
is −σ n′n′ᵀ/L with n′ across n: a strut as long as the tangent.

A helical mesh is the same in the transverse plane, tilted by the base helix angle β, and moved by
what the tangent points do along the shafts:

    δ_β = cos β δ + sin β (ζ₁ − ζ₂),    ζ = f z − x_T b

with z the axial displacement, b the rocking about y, x_T the tangent point's x from its centre.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Motion = tuple[Any, Any, Any, Any]  # δ (m), n_x, n_y, L (m)
FULL_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class InvolutePair:
    """Two gears in mesh, as placed; directions are global ones.

    Attributes
    ----------
    centre
        (x, y) of the second gear's centre from the first's (m).
    radii
        Base radii r₁, r₂ (m).
    kind
        σ: 1 external, −1 internal.
    facing
        f: 1 where the stage counts rotations as the global z axis does, −1 where against it.
    helix
        β (rad), at the base circle.
    levers
        x_T of the two tangent points (m); they count where β ≠ 0.
    """

    centre: tuple[float, float]
    radii: tuple[float, float]
    kind: float = 1.0
    facing: float = 1.0
    helix: float = 0.0
    levers: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def base_sum(self) -> float:
        """R (m)."""
        return self.radii[0] + self.kind * self.radii[1]

    @cached_property
    def involute_at_rest(self) -> float:
        """inv α₀."""
        ratio = math.sqrt(math.hypot(*self.centre) ** 2 - self.base_sum**2) / self.base_sum
        return ratio - math.atan(ratio)

    @cached_property
    def axial_row(self) -> tuple[float, float, float, float]:
        """sin β (f, −x_T, −f, x_T): ∂δ/∂(z₁, b₁, z₂, b₂)."""
        tilt, (first, second) = math.sin(self.helix), self.levers
        return tilt * self.facing, -tilt * first, -tilt * self.facing, tilt * second


def transverse_mesh(pair: InvolutePair, maths: Any) -> Callable[[Any, Any, Any, Any], Motion]:
    """δ, n and L in the transverse plane; the equations are this module's.

    Parameters
    ----------
    pair
        The gears.
    maths
        The module that computes: ``math`` for one instant, ``numpy`` for many.

    Returns
    -------
    A function of x and y of the second gear's displacement against the first's (m), and of θ₁, θ₂
    (rad), that gives δ (m), n_x, n_y, L (m): NaN (or ValueError, from ``math``) where the centres
    are nearer than the base circles allow.
    """
    # Names of its own: the function is called some ten thousand times a second.
    (x_0, y_0), (first, second) = pair.centre, pair.radii
    base, kind, facing, at_rest = pair.base_sum, pair.kind, pair.facing, pair.involute_at_rest
    sqrt, atan, atan2, floor = maths.sqrt, maths.atan, maths.atan2, maths.floor
    own, other = facing * first, facing * kind * second
    period, base_squared = FULL_TURN * base, base**2

    def motion(along: Any, across: Any, first_angle: Any, second_angle: Any) -> Motion:
        x, y = x_0 + along, y_0 + across
        square = x * x + y * y
        length = sqrt(square - base_squared)
        turned = facing * atan2(x_0 * y - y_0 * x, x_0 * x + y_0 * y)
        ratio = length / base
        involute = ratio - atan(ratio) - at_rest
        rolled = own * first_angle + other * second_angle
        deflection = rolled - base * (turned + kind * involute)
        deflection = deflection - period * floor(deflection / period + 0.5)
        n_x = (kind * length * x - facing * base * y) / square
        n_y = (kind * length * y + facing * base * x) / square
        return deflection, n_x, n_y, length

    return motion


def gradient(pair: InvolutePair, n_x: float, n_y: float, size: int) -> list[float]:
    """∂δ/∂q of both bodies' coordinates: (x, y, θ) each of planar, (x, y, z, a, b, θ) of spatial.

    Parameters
    ----------
    pair
        The gears.
    n_x, n_y
        The line of action in the transverse plane.
    size
        Coordinates of a body: 3 or 6.
    """
    tilt, (first, second) = math.cos(pair.helix), pair.radii
    x, y = tilt * n_x, tilt * n_y
    own = tilt * pair.facing * first
    other = tilt * pair.facing * pair.kind * second
    if size == 3:
        return [x, y, own, -x, -y, other]
    z_1, b_1, z_2, b_2 = pair.axial_row
    return [x, y, z_1, 0.0, b_1, own, -x, -y, z_2, 0.0, b_2, other]


def curvature(pair: InvolutePair, n_x: float, n_y: float, length: float, size: int) -> FloatArray:
    """∂²δ/∂q² (2·size, 2·size): −σ cos β n′n′ᵀ/L of the centres' relative motion."""
    row = np.zeros(2 * size)
    row[[0, 1, size, size + 1]] = -n_y, n_x, n_y, -n_x
    second: FloatArray = -pair.kind * math.cos(pair.helix) / length * np.outer(row, row)
    return second


def mesh_motion(
    pair: InvolutePair, position: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """δ and δ̇ at many instants.

    Parameters
    ----------
    pair
        The gears.
    position, velocity
        (n, 2·size) coordinates of both bodies and their rates.
    """
    size = position.shape[1] // 2
    first, second = position[:, :size].T, position[:, size:].T
    deflection, n_x, n_y, _ = transverse_mesh(pair, np)(
        second[0] - first[0], second[1] - first[1], first[-1], second[-1]
    )
    deflection = math.cos(pair.helix) * deflection
    unit = np.array(gradient(pair, 0.0, 0.0, size))
    fixed = unit.copy()
    fixed[[size - 1, -1]] = 0.0  # the rotations are in δ already; axial and rocking shares are left
    tilt = math.cos(pair.helix)
    closing = n_x * (velocity[:, 0] - velocity[:, size])
    closing = closing + n_y * (velocity[:, 1] - velocity[:, size + 1])
    return deflection + position @ fixed, velocity @ unit + tilt * closing


def tangent_points(pair: InvolutePair) -> tuple[FloatArray, FloatArray]:
    """Where the line of action touches the base circles at rest, (3,) m from each gear's centre."""
    _, n_x, n_y, _ = transverse_mesh(pair, math)(0.0, 0.0, 0.0, 0.0)
    towards = pair.facing * np.array([n_y, -n_x, 0.0])
    return pair.radii[0] * towards, -pair.kind * pair.radii[1] * towards

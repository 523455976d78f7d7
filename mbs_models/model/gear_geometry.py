"""Where gears stand: centre distances and directions (any gear-geometry text)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def centre_distance(first_radius: float, second_radius: float, pressure_angle: float) -> float:
    """d = (r₁ + r₂)/cos α of an external pair of base radii r₁, r₂ (m; α in rad)."""
    return (first_radius + second_radius) / math.cos(pressure_angle)


def radial(angle: float) -> Vector:
    """e_r at a position angle (rad)."""
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def tangential(angle: float) -> Vector:
    """e_t = ẑ × e_r at a position angle (rad)."""
    return np.array([-math.sin(angle), math.cos(angle), 0.0])

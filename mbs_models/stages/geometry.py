"""Where a part stands, and its bodies in it: frames and directions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
# Directions that all frames of coaxial bodies share, and what the two kinds of axes call a
# translation along them: the planetary stage's u is along the parallel stage's line of action.
DIRECTIONS: Mapping[str, str] = {
    "u": "first transverse",
    "y": "first transverse",
    "v": "second transverse",
    "x": "second transverse",
    "z": "axial",
}


@dataclass(frozen=True)
class Frame:
    """Origin (m, global) and axes (3 × 3, columns in global coordinates) of a part.

    The third axis is the global z axis, up to the sign ``facing``.
    """

    origin: Vector = field(default_factory=lambda: np.zeros(3))
    axes: Vector = field(default_factory=lambda: np.eye(3))

    @property
    def facing(self) -> float:
        """+1, or −1 for a part seen from behind."""
        return float(self.axes[2, 2])

    def direction(self, vector: Vector) -> Vector:
        """A vector of the part's frame in global coordinates."""
        return self.axes @ vector

    def point(self, position: Vector) -> Vector:
        """A point of the part's frame in global coordinates."""
        return self.origin + self.direction(position)


def radial(angle: float) -> Vector:
    """e_r at a position angle (rad)."""
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def tangential(angle: float) -> Vector:
    """e_t = ẑ × e_r at a position angle (rad)."""
    return np.array([-math.sin(angle), math.cos(angle), 0.0])

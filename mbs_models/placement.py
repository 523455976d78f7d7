"""The frame a stage stands in.

Coupled bodies share an axis and turn the same way. A wheel turns against its pinion, so that the
stage behind it may have to be seen from the other side: its frame is then turned by 180° about y.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .gear_geometry import Vector


@dataclass(frozen=True)
class Frame:
    """Origin (m, global) of a stage and the side it is seen from (+1, or −1: turned about y)."""

    origin: Vector = field(default_factory=lambda: np.zeros(3))
    facing: float = 1.0

    def direction(self, vector: Vector) -> Vector:
        """A vector of the stage's frame in global coordinates."""
        return np.array([self.facing, 1.0, self.facing]) * vector

    def point(self, position: Vector) -> Vector:
        """A point of the stage's frame in global coordinates."""
        return self.origin + self.direction(position)

"""Which way a part faces, and the frame it stands in.

Coupled bodies share an axis and turn the same way. A wheel turns against its pinion, so that the
part behind it may have to be seen from the other side. Every part's first transverse direction (the
line of action y of a parallel stage, u of a planetary one) is the global y axis, whatever it faces:
translations of coupled bodies are then along common axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .couplings import DIRECTIONS, Coupling
from .gear_geometry import Vector
from .graph import sense
from .parameters import Drivetrain, ParallelStage


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


def axes_facing(part: object, facing: float) -> Vector:
    """Axes of a part whose first transverse direction is the global y axis."""
    y, z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, facing])
    if isinstance(part, ParallelStage):
        return np.column_stack([np.cross(y, z), y, z])
    return np.column_stack([y, np.cross(z, y), z])


def facings(drivetrain: Drivetrain) -> Mapping[str, float]:
    """Side each part is seen from (±1), so that coupled bodies turn the same way."""
    return drivetrain.facing


def neighbours(drivetrain: Drivetrain, name: str) -> Sequence[tuple[str, str]]:
    """(own body, other body) of every coupling of a part."""
    return drivetrain.joined[name]


def turning(facing: Mapping[str, float], body: str) -> float:
    """Sign of positive w of a body against global counter-clockwise rotation."""
    return facing[body.partition(".")[0]] * sense(body)


def rigid_end(coupling: Coupling) -> tuple[str, float | str]:
    """The end at which a massless hub is cut: the (first) rigid one."""
    return next(end for end in coupling.ends if end[1] == "rigid")


def translation_ends(
    drivetrain: Drivetrain, coupling: Coupling, dof: str
) -> tuple[str, str, float]:
    """The two DoFs that a coupled translation joins, and the sign of the second along the first.

    The first transverse direction is everybody's; the others turn with the side a part faces.
    """
    direction = DIRECTIONS[dof]
    first, second = (
        f"{body}.{drivetrain.translations(body)[direction]}"
        for body in (coupling.first, coupling.second)
    )
    if direction == DIRECTIONS["u"]:
        return first, second, 1.0
    facing = facings(drivetrain)
    sides = [facing[body.partition(".")[0]] for body in (coupling.first, coupling.second)]
    return first, second, sides[0] * sides[1]

"""How a mode moves the picture: every body's shift and turn on the page, exaggerated.

The largest motion (a translation, or r·θ at the radius r) is drawn ``reach`` page units long. All
motions of a mode share that scale, so that gears roll on one another and rims move by w.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbs_models.system.components import GROUND, Components, End, Spring

from .layout import PAGE, Disc, Layout, Panel
from .symbols import Point

Array = NDArray[np.float64]

# exudyn's coordinates of a body among (x, y, z, rotations about them), by how many it has
PLACES = {1: [5], 3: [0, 1, 5], 6: [0, 1, 2, 3, 4, 5]}


@dataclass(frozen=True)
class Motion:
    """A body's or mesh's motion on the page at full swing.

    Attributes
    ----------
    x, y
        Shift (page units).
    turn
        Rotation (rad, clockwise on the page).
    axial
        Shift towards the reader, as a share of the mode's largest motion.
    rocking
        r·ρ, likewise: positive lifts the page's upper side.
    stretch
        Of a mesh spring: its elongation, as a share of its length.
    """

    x: float
    y: float
    turn: float
    axial: float = 0.0
    rocking: float = 0.0
    stretch: float = 0.0

    def visible(self, radius: float) -> bool:
        """Whether anything moves by more than a fraction of a page unit."""
        largest = max(abs(self.x), abs(self.y), abs(self.turn) * radius)
        return largest > 0.25 or max(abs(self.axial), abs(self.rocking)) > 0.02


def displacements(parts: Components, shape: Array) -> dict[str, Array]:
    """(x, y, z, rotations) of every body in a mode, global (m, rad)."""
    found = {}
    for body, motion in parts.motions.items():
        found[body] = np.zeros(6)
        found[body][PLACES[len(motion)]] = motion @ shape
    return found


def largest_motion(layout: Layout, moved: Mapping[str, Array]) -> float:
    """The largest translation or r·θ of any body (m)."""
    values = [
        max(
            math.hypot(*moved[disc.body][:2]),
            abs(moved[disc.body][2]),
            abs(moved[disc.body][4]) * disc.radius,
            abs(moved[disc.body][5]) * disc.radius,
        )
        for panel in layout.panels
        for disc in panel.discs
    ]
    return max(values) or 1.0


def body_motion(
    panel: Panel, disc: Disc, moved: Mapping[str, Array], largest: float, reach: float
) -> Motion:
    """A body's motion on its panel."""
    own = moved[disc.body] / largest
    x, y = reach * (PAGE @ own[:3])
    return Motion(
        float(x),
        float(y),
        turn=float(-own[5] * reach / panel.scale),
        axial=float(own[2]),
        rocking=float(own[4] * disc.radius),
    )


def mesh_motion(
    panel: Panel, one: Spring, moved: Mapping[str, Array], largest: float, reach: float
) -> Motion:
    """A mesh spring's motion, along and across its own line."""
    first, second = mesh_shifts(panel, one, moved, reach / largest)
    length = mesh_length(panel, one)
    new = (length + second[0] - first[0], second[1] - first[1])
    return Motion(
        first[0],
        first[1],
        turn=math.atan2(new[1], new[0]),
        stretch=math.hypot(*new) / length - 1.0,
    )


def mesh_length(panel: Panel, one: Spring) -> float:
    """Of a mesh spring on the page."""
    return math.dist(*(panel.at(end.point) for end in one.ends))


def mesh_shifts(
    panel: Panel, one: Spring, moved: Mapping[str, Array], gain: float
) -> tuple[Point, Point]:
    """How far both ends of a mesh spring move, along and across its own line."""
    along, across = _axes(*(panel.at(end.point) for end in one.ends))
    first, second = (
        (s[0] * along[0] + s[1] * along[1], s[0] * across[0] + s[1] * across[1])
        for s in (_shift(panel, end, moved, gain) for end in one.ends)
    )
    return first, second


def _axes(first: Point, second: Point) -> tuple[Point, Point]:
    length = math.dist(first, second)
    c, s = (second[0] - first[0]) / length, (second[1] - first[1]) / length
    return (c, s), (-s, c)


def _shift(panel: Panel, end: End, moved: Mapping[str, Array], gain: float) -> Point:
    """How far a point of a body moves on the page: u + θ × p, θ as large as it is drawn."""
    if end.body == GROUND:
        return 0.0, 0.0
    own = gain * moved[end.body]
    lever = end.point - panel.disc(end.body).centre
    x, y = PAGE @ (own[:3] + np.array([-own[5] * lever[1], own[5] * lever[0], 0.0]))
    return float(x), float(y)

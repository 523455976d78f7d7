"""Nodes and directions of a drivetrain's DoFs, for files that other software reads.

Every body is a node, numbered in the order of the model. Directions are those of the body's own
frame: z along its shaft and away from where its part is seen, as `placement` lays it; for a planet
x is radial and y tangential. A body whose positive rotation is clockwise there turns about −z.
"""

from __future__ import annotations

from collections.abc import Mapping

from fbs.files.uff import Channel
from mbs_models.model.dof_radii import dof_radii
from mbs_models.model.parameters import Drivetrain
from mbs_models.model.placement import sense

TRANSLATIONS = {"u": 1, "v": 2, "y": 2, "z": 3}
ABOUT_SHAFT, ROCKING = 6, 5


def dof_channels(drivetrain: Drivetrain) -> Mapping[str, Channel]:
    """Node, direction and radius of every DoF."""
    nodes: dict[str, int] = {}
    channels = {}
    for label, radius in dof_radii(drivetrain).items():
        body, _, dof = label.rpartition(".")
        node = nodes.setdefault(body, len(nodes) + 1)
        channels[label] = Channel(node, _direction(body, dof), radius or 1.0)
    return channels


def _direction(body: str, dof: str) -> int:
    """Code of dataset 58: 1 to 3 translations along x, y, z; 4 to 6 rotations about them."""
    if dof in TRANSLATIONS:
        return TRANSLATIONS[dof]
    turn = int(sense(body))
    return turn * ABOUT_SHAFT if dof == "w" else -turn * ROCKING

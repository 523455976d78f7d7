"""Nodes and directions of a drivetrain's DoFs, for files that other software reads.

Every body is a node, numbered in the order of the model. Directions are those of the frame its part
stands in, x, y, z right-handed: z along the shaft towards where the part is seen from, y the first
transverse direction (of a planet its own: radial), so that v is along −x. A body whose positive
rotation is clockwise there turns about −z.
"""

from __future__ import annotations

from collections.abc import Mapping

from fbs.files.uff_functions import Channel
from mbs_models.model.parameters import Drivetrain

TRANSLATIONS = {"u": 2, "v": -1, "x": 1, "y": 2, "z": 3}
ABOUT_SHAFT, ROCKING = 6, 5


def dof_channels(drivetrain: Drivetrain) -> Mapping[str, Channel]:
    """Node, direction and radius of every DoF."""
    nodes: dict[str, int] = {}
    channels = {}
    for label, radius in drivetrain.dof_radii().items():
        body, _, dof = label.rpartition(".")
        node = nodes.setdefault(body, len(nodes) + 1)
        turn = int(drivetrain.members[body].sense) if body in drivetrain.members else 1
        channels[label] = Channel(node, _direction(dof, turn), radius or 1.0)
    return channels


def _direction(dof: str, turn: int) -> int:
    """Code of dataset 58: 1 to 3 translations along x, y, z; 4 to 6 rotations about them."""
    if dof in TRANSLATIONS:
        return TRANSLATIONS[dof]
    return turn * ABOUT_SHAFT if dof == "w" else -turn * ROCKING

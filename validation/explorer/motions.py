"""How the drawing moves with the drivetrain's DoFs, as numbers for the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import FloatArray
from ..picture.layout import Layout, lay_out
from ..picture.mode_shapes import SWING, meshes, moving_keys, moving_picture, still_parts
from ..picture.motion import body_motion, displacements, mesh_length, mesh_shifts
from ..routes.multibody import ExudynSource


@dataclass(frozen=True)
class MovingPicture:
    """The drawing, what it refers to, and how its groups move.

    Attributes
    ----------
    svg, still_parts
        Groups of the class ``mv`` and a key each; the outlines at rest.
    motions
        What `shapes.js` calls Motions.
    """

    svg: str
    still_parts: str
    motions: Mapping[str, Any]


def moving_drawing(source: ExudynSource) -> MovingPicture:
    """Draw a drivetrain; every group's motion is linear in the DoFs, up to a mesh's stretch."""
    parts = source.components
    layout = lay_out(source.drivetrain, parts)
    keys = moving_keys(layout)
    units = [displacements(parts, row) for row in np.eye(len(parts.dofs))]
    motions = {
        "dofs": list(parts.dofs),
        "swing": SWING,
        "bodies": list(_bodies(layout, keys, units)),
        "meshes": list(_meshes(layout, keys, units)),
    }
    return MovingPicture(moving_picture(layout, keys), still_parts(layout), motions)


Units = list[dict[str, FloatArray]]  # of every body, per unit of one DoF


def _bodies(layout: Layout, keys: Mapping[str, str], units: Units) -> Iterator[dict[str, Any]]:
    """(x, y, turn, axial, rocking) per unit of each DoF, a page unit a metre."""
    for panel in layout.panels:
        for disc in panel.discs:
            found = [body_motion(panel, disc, moved, 1.0, 1.0) for moved in units]
            rows = [(m.x, m.y, m.turn, m.axial, m.rocking) for m in found]
            yield {
                "key": keys[disc.body],
                "radius": panel.scale * disc.radius,
                "rows": _rows(rows),
            }


def _meshes(layout: Layout, keys: Mapping[str, str], units: Units) -> Iterator[dict[str, Any]]:
    """Shifts of both ends, along and across the spring's line, likewise."""
    for panel in layout.panels:
        for one in meshes(panel):
            ends = [mesh_shifts(panel, one, moved, 1.0) for moved in units]
            yield {
                "key": keys[one.name],
                "length": mesh_length(panel, one),
                "rows": _rows([(*first, *second) for first, second in ends]),
            }


def _rows(columns: Sequence[tuple[float, ...]]) -> list[list[tuple[int, float]]]:
    """By motion, what is not zero: (DoF, factor)."""
    return [
        [(int(k), float(row[k])) for k in np.flatnonzero(row)]
        for row in np.array(columns, dtype=float).T
    ]

"""Mode shapes on the drawing: a still picture of each, and one that moves.

The moving picture is SVG and CSS alone. Each mode's shifts and turns are custom properties, which
a chosen mode's rule sets and one animation swings between plus and minus. Where there is no
animation (print, reduced motion) the bodies stand at full swing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbs_models.modal.mode_kinds import Mode, Modes
from mbs_models.stages.part import Role
from mbs_models.system.components import Components, Spring, SpringKind

from ..report.style import KIND_COLORS
from .drawing import draw_panel, page
from .layout import FOOTER, HEADER, Disc, Layout, Panel
from .motion import Motion, body_motion, displacements, largest_motion, mesh_motion
from .symbols import Point, arc_arrow, arrow, circle, group, line, number, path, text

Array = NDArray[np.float64]

MOST = 40  # modes drawn
SWING = 15.0  # page units of the largest motion in the moving picture
STILL = 17.0  # and of the outlines in the still ones; arrows are twice as long
LEAST_SHARE = 0.01  # of the kinetic energy: a part with less is left out of a still picture


@dataclass(frozen=True)
class ShapePicture:
    """A mode with its still picture.

    Attributes
    ----------
    number, mode
        Which mode.
    color
        Its kind's.
    svg
        The parts that take part in it, at full swing over their places at rest.
    """

    number: int
    mode: Mode
    color: str
    svg: str


@dataclass(frozen=True)
class ModeShapes:
    """Still pictures, the moving picture, its rules, and what the still pictures refer to."""

    pictures: tuple[ShapePicture, ...]
    still_parts: str
    moving: str
    rules: str
    total: int


def draw_mode_shapes(layout: Layout, parts: Components, modes: Modes) -> ModeShapes:
    """Draw the first modes (all, where they are few)."""
    rows = [modes.labels.index(dof) for dof in parts.dofs]
    count = min(len(modes.modes), MOST)
    keys = moving_keys(layout)
    pictures, rules = [], []
    for i in range(count):
        moved = displacements(parts, modes.shapes[rows, i].real)
        largest = largest_motion(layout, moved)
        mode = modes.modes[i]
        still = _still(layout, mode, i + 1, moved, largest)
        pictures.append(ShapePicture(i + 1, mode, KIND_COLORS[mode.kind], still))
        declared = "".join(_declarations(layout, keys, moved, largest))
        rules.append(f".player:has(#mode-{i + 1}:checked){{{declared}.of-{i + 1}{{display:flex}}}}")
    return ModeShapes(
        pictures=tuple(pictures),
        still_parts=still_parts(layout),
        moving=moving_picture(layout, keys),
        rules="\n".join(rules),
        total=len(modes.modes),
    )


# --- the moving picture ---------------------------------------------------------------------


def moving_keys(layout: Layout) -> dict[str, str]:
    """A short class for everything that moves."""
    names = [disc.body for panel in layout.panels for disc in panel.discs]
    names += [one.name for panel in layout.panels for one in meshes(panel)]
    return {name: f"k{i}" for i, name in enumerate(names)}


def meshes(panel: Panel) -> list[Spring]:
    """The mesh springs of a panel."""
    return [one for one in panel.springs if one.kind is SpringKind.MESH]


def moving_picture(layout: Layout, keys: Mapping[str, str]) -> str:
    """The drivetrain with a group of the class ``mv`` and its key for everything that moves."""

    def moving(key: str, at: Point, angle: float, content: str) -> str:
        x, y = map(number, at)
        turned = f" rotate({angle:.2f})" if angle else ""
        back = f"rotate({-angle:.2f}) " if angle else ""
        inner = group(content, transform=f"{back}translate({-at[0]:.1f} {-at[1]:.1f})")
        moved = group(inner, style=f"mv {keys[key]}")
        return group(moved, transform=f"translate({x} {y}){turned}")

    content = ""
    for panel in layout.panels:
        left, top = panel.corner
        content += text((left + panel.size[0] / 2.0, top + 13.0), panel.item.name, "title")
        content += f'<use class="ghost" href="#still-{panel.item.name}"/>'
        content += draw_panel(panel, moving, at_rest=False)
    return page(content, layout.height, "The chosen mode, moving", layout.sides)


def _declarations(
    layout: Layout, keys: Mapping[str, str], moved: Mapping[str, Array], largest: float
) -> Iterator[str]:
    """What a mode sets: ``.k3{--x:…;--y:…;--a:…}`` for everything that moves in it."""
    for panel in layout.panels:
        for disc in panel.discs:
            motion = body_motion(panel, disc, moved, largest, SWING)
            if motion.visible(panel.scale * disc.radius):
                yield _declaration(keys[disc.body], motion)
        for one in meshes(panel):
            motion = mesh_motion(panel, one, moved, largest, SWING)
            if motion.visible(10.0):
                yield _declaration(keys[one.name], motion)


def _declaration(key: str, motion: Motion) -> str:
    values = {
        "--x": (motion.x, "px", 1),
        "--y": (motion.y, "px", 1),
        "--a": (math.degrees(motion.turn), "deg", 1),
        "--s": (0.16 * motion.axial + motion.stretch, "", 3),
        "--k": (14.0 * motion.rocking, "deg", 1),
    }
    set_ = ";".join(
        f"{name}:{value:.{digits}f}{unit}"
        for name, (value, unit, digits) in values.items()
        if round(value, digits)
    )
    return f".{key}{{{set_}}}" if set_ else ""


# --- still pictures -------------------------------------------------------------------------


def still_parts(layout: Layout) -> str:
    """The parts' outlines, for the pictures that refer to them."""
    return "".join(_at_rest(panel) for panel in layout.panels)


def _at_rest(panel: Panel) -> str:
    """A part's outlines, which every still picture of it refers to."""
    drawn = "".join(_outline(panel, disc, (0.0, 0.0), "rest") for disc in panel.discs)
    return f'<g id="still-{panel.item.name}">{drawn}</g>'


def _outline(panel: Panel, disc: Disc, shift: Point, style: str) -> str:
    x, y = panel.at(disc.centre)
    radius = disc.pitch if disc.role is Role.RING else disc.radius
    return circle((x + shift[0], y + shift[1]), panel.scale * radius, style)


def _still(
    layout: Layout, mode: Mode, which: int, moved: Mapping[str, Array], largest: float
) -> str:
    shares = mode.shares.kinetic
    taking_part = [p for p in layout.panels if shares[p.item.name] >= LEAST_SHARE]
    content, right, tallest = "", 0.0, 0.0
    room = max(panel.size[1] - HEADER - FOOTER for panel in taking_part)
    for panel in taking_part:
        left, top = panel.corner
        height = panel.size[1] - HEADER - FOOTER
        down = (room - height) / 2.0 - top - HEADER
        drawn = f'<use href="#still-{panel.item.name}"/>'
        drawn += "".join(_arrows(panel, disc, moved, largest) for disc in panel.discs)
        content += group(drawn, transform=f"translate({right - left:.1f} {down:.1f})")
        right += panel.size[0]
        tallest = max(tallest, height)
    label = f"Shape of mode {which}, {mode.kind}, {mode.frequency_hz:.6g} Hz"
    return (
        f'<svg role="img" aria-label="{label}" class="model still" '
        f'viewBox="0 0 {number(right)} {number(tallest)}">{content}</svg>'
    )


def _arrows(panel: Panel, disc: Disc, moved: Mapping[str, Array], largest: float) -> str:
    """A body at full swing, with arrows for what it does."""
    motion = body_motion(panel, disc, moved, largest, STILL)
    r = panel.scale * disc.radius
    if not motion.visible(r):
        return ""
    x, y = panel.at(disc.centre)
    drawn = _outline(panel, disc, (motion.x, motion.y), f"moved {disc.role}")
    drawn += arrow((x, y), (x + 2.0 * motion.x, y + 2.0 * motion.y), "translation")
    drawn += _turned(disc, (x + motion.x, y + motion.y), r, motion.turn)
    if abs(motion.axial) > 0.05:
        drawn += _axial((x, y), motion.axial)
    if abs(motion.rocking) > 0.05:
        drawn += _axial((x, y - 0.6 * r), motion.rocking)
        drawn += _axial((x, y + 0.6 * r), -motion.rocking)
        drawn += line((x - 0.8 * r, y), (x + 0.8 * r, y), "pitch")
    return drawn


def _turned(disc: Disc, centre: Point, r: float, turn: float) -> str:
    """An arc as long as the rim's motion is drawn, beside the rim."""
    where = {Role.RING: 0.93, Role.CARRIER: 1.0}.get(disc.role, 0.72)
    start = {Role.CARRIER: -2.0, Role.RING: -0.95}.get(disc.role, -math.pi / 2.0)
    gain = 2.0 / where if disc.role is not Role.RING else 2.0
    return arc_arrow(centre, where * r, gain * turn, f"rotation {disc.role}", start)


def _axial(at: Point, amount: float) -> str:
    """⊙ towards the reader, ⊗ away, as large as the motion."""
    r = 3.0 + 6.0 * min(abs(amount), 1.0)
    drawn = circle(at, r, "axial")
    if amount > 0.0:
        return drawn + circle(at, 0.3 * r, "dot")
    d, (x, y) = 0.7 * r, at
    cross = path([(x - d, y - d), (x + d, y + d)]) + path([(x - d, y + d), (x + d, y - d)])
    return f'{drawn}<path class="axial" d="{cross}"/>'

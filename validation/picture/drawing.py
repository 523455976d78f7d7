"""The picture of the drivetrain: every part seen along its shafts, as exudyn has it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from html import escape

import numpy as np

from mbs_models.model.parameters import Coupling, Drivetrain
from mbs_models.stages.part import Part, Role
from mbs_models.system.components import GROUND, Spring, SpringKind

from .layout import PAGE, WIDTH, Disc, Layout, Panel
from .symbols import (
    Point,
    arrow,
    circle,
    grounded_spring,
    group,
    line,
    number,
    path,
    spring,
    text,
)

# (what moves, where it turns about, the angle (°) of its own x axis, its drawing) → moving drawing
Moving = Callable[[str, Point, float, str], str]

ORDER = (Role.RING, Role.CARRIER, Role.WHEEL, Role.PINION, Role.SUN, Role.PLANET)


def draw_model(drivetrain: Drivetrain, layout: Layout) -> str:
    """The whole drivetrain at rest."""
    content = "".join(panel_frame(panel) + draw_panel(panel) for panel in layout.panels)
    label = f"{drivetrain.name}: gears, bearings and meshes to scale"
    return page(content, layout.height, label, layout.sides)


def page(content: str, height: float, alternative: str, sides: Point = (0.0, WIDTH)) -> str:
    """Content as an SVG element to stand inside the report, cropped to what is used."""
    left, right = sides
    wide = right - left
    return (
        f'<svg role="img" aria-label="{escape(alternative)}" class="model sheet" '
        f'style="max-width:{number(1.15 * wide)}px;min-width:{number(0.6 * wide)}px" '
        f'viewBox="{number(left)} 0 {number(wide)} {number(height)}">{content}</svg>'
    )


# --- panels ---------------------------------------------------------------------------------


def panel_frame(panel: Panel) -> str:
    """What stands around a part: its name, what it is, its axes, and the scale."""
    left, top = panel.corner
    width, height = panel.size
    middle = left + width / 2.0
    about = _about(panel)
    words = text((middle, top + 13.0), panel.item.name, "title")
    words += text((middle, top + 27.0), about, "about")
    if isinstance(panel.item, Coupling):
        return words
    if panel.enlargement:
        words += _scale_bar(panel) + _axes((left + 16.0, top + height - 36.0), panel.item, panel)
    else:
        radius = max(disc.radius for disc in panel.discs)
        words += text((middle, top + height - 6.0), f"r = {radius:.4g} m", "about")
    return words


def _about(panel: Panel) -> str:
    item = panel.item
    if isinstance(item, Coupling):
        return "hub"
    behind = panel.enlargement and panel.frame.facing < 0.0
    return f"{item.caption}{', seen from behind' if behind else ''}"


def _scale_bar(panel: Panel) -> str:
    left, top = panel.corner
    width, height = panel.size
    longest = 0.35 * width / panel.scale
    decade = 10.0 ** math.floor(math.log10(longest))
    length = next(m * decade for m in (5.0, 2.0, 1.0) if m * decade <= longest)
    right, bottom = left + width - 6.0, top + height - 8.0
    start = right - length * panel.scale
    ticks = [path([(x, bottom - 3.0), (x, bottom + 3.0)]) for x in (start, right)]
    d = path([(start, bottom), (right, bottom)]) + "".join(ticks)
    words = f"{1e3 * length:g} mm" if length < 1.0 else f"{length:g} m"
    if panel.enlargement > 1:
        words += f" (enlarged {panel.enlargement}×)"
    return f'<path class="axis" d="{d}"/>' + text((right, bottom - 6.0), words, "about", "end")


def _axes(at: Point, item: Part, panel: Panel) -> str:
    """The part's two transverse directions, as its frame has them."""
    drawn = ""
    for name, direction in zip(item.axes, np.eye(3), strict=False):
        x, y = PAGE @ panel.frame.direction(direction)
        drawn += arrow(at, (at[0] + 20.0 * x, at[1] + 20.0 * y), "axis")
        drawn += text((at[0] + 27.0 * x, at[1] + 27.0 * y + 3.0), name, "about")
    return drawn


def standing(_key: str, _at: Point, _angle: float, content: str) -> str:
    """A drawing that does not move."""
    return content


def draw_panel(panel: Panel, moving: Moving = standing, *, at_rest: bool = True) -> str:
    """Bodies and springs of a panel; at rest, names and what goes to ground are drawn too.

    ``moving`` may put each body and mesh into a group of its own.
    """
    discs = sorted(
        panel.discs, key=lambda disc: ORDER.index(disc.role) if disc.role in ORDER else 0
    )
    drawn = "".join(
        moving(disc.body, panel.at(disc.centre), 0.0, draw_disc(panel, disc)) for disc in discs
    )
    for one in panel.springs:
        first, second = one.ends
        content = _draw_spring(panel, one)
        if not content or (first.body == GROUND and not at_rest):
            continue
        if one.kind is SpringKind.MESH:
            start, end = panel.at(first.point), panel.at(second.point)
            angle = math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))
            drawn += moving(one.name, start, angle, content)
        elif first.body != GROUND:
            centre = panel.at(panel.disc(second.body).centre)
            drawn += moving(second.body, centre, 0.0, content)
        else:
            drawn += content
    return drawn + ("".join(_labels(panel)) if at_rest else "")


def _labels(panel: Panel) -> Iterator[str]:
    for disc in panel.discs:
        x, y = panel.at(disc.centre)
        r = panel.scale * disc.pitch
        name = disc.body.rpartition(".")[2]
        match disc.role:
            case Role.PLANET:
                yield text((x, y - 0.62 * r + 3.0), name.removeprefix("planet"), "name")
            case Role.SUN:
                yield text((x + 0.4 * r, y - 0.32 * r), name, "name")
            case Role.PINION | Role.WHEEL if r < 26.0:
                mate = panel.at(next(d.centre for d in panel.discs if d is not disc))
                away = 7.0 if mate[1] < y else -1.0
                yield text((x + r + 4.0, y + away + 3.0), name, "name", "start")
            case Role.PINION | Role.WHEEL:
                yield text((x, y - 0.45 * r), name, "name")
            case Role.RING | Role.CARRIER:
                yield _rim_label(panel, disc, name)


def _rim_label(panel: Panel, disc: Disc, name: str) -> str:
    """The ring's and the carrier's names outside, with a line to what they name."""
    x, y = panel.at(disc.centre)
    ring = panel.scale * 1.1 * next(d.pitch for d in panel.discs if d.role is Role.RING)
    angle, reach = (0.8, 1.05) if disc.role is Role.RING else (0.0, 1.0)
    if disc.role is Role.CARRIER:
        angle = _gap_angle(panel, upwards=True)
    own = panel.scale * disc.pitch * reach
    c, s = math.cos(angle), math.sin(angle)
    tip, outside = (x + own * c, y + own * s), (x + (ring + 12.0) * c, y + (ring + 12.0) * s)
    at = (outside[0] + 3.0 * c, outside[1] + (9.0 if s > 0.0 else -3.0))
    words = text(at, name, "name", "start" if c > 0.0 else "end")
    return line(tip, outside, "leader") + words


# --- bodies ---------------------------------------------------------------------------------


def draw_disc(panel: Panel, disc: Disc) -> str:
    """A body: base circle in full, pitch circle in dashes, and a mark that shows it turn."""
    centre = panel.at(disc.centre)
    r, pitch = panel.scale * disc.radius, panel.scale * disc.pitch
    style = f"body {disc.role}"
    match disc.role:
        case Role.RING:
            content = _annulus(centre, pitch, panel.scale * disc.outer, style)
            content += circle(centre, r, "base ring") + circle(centre, pitch, "pitch")
            content += _marks(centre, pitch, panel.scale * disc.outer, 12)
        case Role.CARRIER:
            content = _spokes(panel, disc)
        case Role.HUB | Role.ROTOR:
            content = circle(centre, r, style) + _marks(centre, 0.0, r, 4)
        case _:
            content = circle(centre, pitch, f"{style} flank") + circle(centre, pitch, "pitch")
            content += circle(centre, r, f"base {disc.role}") + _marks(centre, 0.82 * r, r, 8)
            content += circle(centre, min(3.0, 0.2 * r), "pin")
    return group(content, title=f"{disc.body}: r = {1e3 * disc.radius:.4g} mm")


def _annulus(centre: Point, inner: float, outer: float, style: str) -> str:
    x, y = centre
    rings = "".join(
        f"M{number(x + r)} {number(y)}A{number(r)} {number(r)} 0 1 0 {number(x - r)} {number(y)}"
        f"A{number(r)} {number(r)} 0 1 0 {number(x + r)} {number(y)}z"
        for r in (inner, outer)
    )
    return f'<path class="{style}" fill-rule="evenodd" d="{rings}"/>'


def _marks(centre: Point, inner: float, outer: float, count: int) -> str:
    x, y = centre
    strokes = []
    for i in range(count):
        c, s = math.cos(2.0 * math.pi * i / count), math.sin(2.0 * math.pi * i / count)
        strokes.append(path([(x + inner * c, y + inner * s), (x + outer * c, y + outer * s)]))
    return f'<path class="mark" d="{"".join(strokes)}"/>'


def _spokes(panel: Panel, carrier: Disc) -> str:
    """The carrier: arms from the middle to every planet's pin, and the circle through them."""
    centre = panel.at(carrier.centre)
    pins = [panel.at(disc.centre) for disc in panel.discs if disc.role is Role.PLANET]
    arms = "".join(path([centre, pin]) for pin in pins)
    return circle(centre, panel.scale * carrier.radius, "base carrier") + (
        f'<path class="arm" d="{arms}"/>'
    )


# --- springs --------------------------------------------------------------------------------


def _draw_spring(panel: Panel, one: Spring) -> str:
    content = ""
    if one.kind is SpringKind.MESH:
        first, second = (panel.at(end.point) for end in one.ends)
        content = spring(first, second, "mesh", 3.6)
        content += circle(first, 1.7, "tangent") + circle(second, 1.7, "tangent")
    elif one.kind is SpringKind.BEARING:
        content = "".join(_bearing(panel, one))
    elif one.kind is SpringKind.TORSION:
        content = _torsion(panel, one)
    return group(content, title=_describe(one)) if content else ""


def _describe(one: Spring) -> str:
    values = " and ".join(f"{value:.4g}" for value in np.linalg.eigvalsh(one.stiffness))
    unit = "N m/rad" if one.kind in (SpringKind.TORSION, SpringKind.ROCKING) else "N/m"
    return f"{one.name}: {values} {unit}"


def _bearing(panel: Panel, one: Spring) -> Iterator[str]:
    """One spring along each principal direction that lies in the plane."""
    values, turns = np.linalg.eigh(one.stiffness)
    support, body = one.ends
    disc = panel.disc(body.body)
    for value, direction in zip(values, (one.axes @ turns).T, strict=True):
        x, y = PAGE @ direction
        flat = math.hypot(x, y)
        if value <= 0.0 or flat < 0.5:
            continue
        yield _bearing_spring(panel, disc, (x / flat, y / flat), grounded=support.body == GROUND)


def _bearing_spring(panel: Panel, disc: Disc, towards: Point, *, grounded: bool) -> str:
    x, y = towards
    if x > 0.1 or (abs(x) <= 0.1 and y < 0.0):  # to the left, or downwards
        x, y = -x, -y
    centre = panel.at(disc.centre)
    r = panel.scale * disc.outer
    start, length = {
        Role.RING: (r, 24.0),
        Role.PINION: (r, 26.0),
        Role.WHEEL: (r, 26.0),
        Role.SUN: (3.0, max(10.0, 0.72 * panel.scale * disc.radius)),
    }.get(disc.role, (0.0, 18.0))
    if not grounded:
        reach = max(8.0, 0.6 * panel.scale * disc.radius)
        end = (centre[0] + reach * x, centre[1] + reach * y)
        return spring(centre, end, "bearing", 2.6) + circle(end, 1.4, "tangent")
    if disc.role is Role.CARRIER:
        angle = _gap_angle(panel, upwards=False)
        centre = (
            centre[0] + panel.scale * disc.radius * math.cos(angle),
            centre[1] + panel.scale * disc.radius * math.sin(angle),
        )
    at = (centre[0] + start * x, centre[1] + start * y)
    return grounded_spring(at, (x, y), length, "bearing")


def _gap_angle(panel: Panel, *, upwards: bool) -> float:
    """Where on the page the carrier's circle is free: midway between two planets."""
    carrier = next(disc for disc in panel.discs if disc.role is Role.CARRIER)
    places = [PAGE @ (d.centre - carrier.centre) for d in panel.discs if d.role is Role.PLANET]
    angles = sorted(math.atan2(y, x) for x, y in places)
    wanted = math.radians(-80.0 if upwards else 50.0)
    gaps = [
        (b - a, (a + b) / 2.0)
        for a, b in zip(angles, [*angles[1:], angles[0] + 2.0 * math.pi], strict=True)
    ]
    widest = max(gap for gap, _ in gaps)
    wide = [middle for gap, middle in gaps if gap > 0.8 * widest]
    return min(wide, key=lambda angle: -math.cos(angle - wanted))


def _torsion(panel: Panel, one: Spring) -> str:
    """A spring along the rim, to ground."""
    disc = panel.disc(one.ends[1].body)
    x, y = panel.at(disc.centre)
    r = panel.scale * disc.outer
    angle = {Role.RING: 2.45, Role.SUN: 2.45, Role.CARRIER: _far(panel)}.get(disc.role, 0.8)
    c, s = math.cos(angle), math.sin(angle)
    return line((x + r * c, y + r * s), (x + (r + 8.0) * c, y + (r + 8.0) * s), "bearing") + (
        grounded_spring((x + (r + 8.0) * c, y + (r + 8.0) * s), (-s, c), 24.0, "torsion")
    )


def _far(panel: Panel) -> float:
    """A free place on the carrier's circle, away from its bearing."""
    if not any(disc.role is Role.PLANET for disc in panel.discs):
        return 0.0
    return _gap_angle(panel, upwards=True) + 0.12

"""The drivetrain on paper: its parts in the train's order, each in a panel, to scale.

Everything is seen along the shafts, from the same side. The page's x axis is the global y axis and
its y axis (downwards) the global x axis, so that every part's first transverse direction (u, or the
line of action y) points to the right. Circles come from the parameters, springs and their ends from
the exudyn system: where the two do not fit, it shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mbs_models.model.graph import walk
from mbs_models.model.parameters import Coupling, Drivetrain, Part
from mbs_models.model.placement import place_parts
from mbs_models.stages.geometry import Frame
from mbs_models.stages.part import Member, Role
from mbs_models.system.components import GROUND, Components, Spring, SpringKind

Array = NDArray[np.float64]
Point = tuple[float, float]
Item = Part | Coupling

PAGE = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # global (x, y, z) → page (right, down)
WIDTH = 1000.0
GAP, HEADER, FOOTER = 14.0, 34.0, 26.0
ENLARGEMENTS = [m * 10**e for e in range(9) for m in (1, 2, 5)]
ROOMS = ((3, 270.0), (6, 190.0), (1000, 150.0))  # the largest stage's size, by how many there are
LETTER = 8.2  # of a title
ROTOR, HUB = 44.0, 30.0  # drawn radius of what is not to scale


@dataclass(frozen=True)
class Disc:
    """A body: its centre (m, global), the radius r of w = r·θ, and its pitch radius."""

    body: str
    role: Role
    centre: Array
    radius: float
    pitch: float

    @classmethod
    def of(cls, member: Member, frame: Frame) -> Self:
        """A part's body where it stands."""
        pitch = member.radius if member.pitch_radius is None else member.pitch_radius
        return cls(member.body, member.role, frame.point(member.centre), member.radius, pitch)

    @property
    def to_scale(self) -> bool:
        """Whether its size is that of a gear: the radius of hubs and rotors says nothing."""
        return self.role not in (Role.HUB, Role.ROTOR)

    @property
    def outer(self) -> float:
        """The largest radius drawn (m)."""
        return 1.1 * self.pitch if self.role is Role.RING else self.pitch


@dataclass(frozen=True)
class Panel:
    """One part or hub on the page.

    Attributes
    ----------
    item
        The stage, inertia or coupling.
    discs, springs
        Its bodies, and the springs among them and to ground.
    frame
        Where it stands.
    corner, size
        Top left corner and size (page units).
    scale
        Page units per metre.
    enlargement
        How many times larger than the largest stage's scale; 0: not to scale.
    middle
        What lies in the middle (m, on the page).
    """

    item: Item
    discs: tuple[Disc, ...]
    springs: tuple[Spring, ...]
    frame: Frame
    corner: Point
    size: Point
    scale: float
    enlargement: int
    middle: Array

    def at(self, point: Array) -> Point:
        """Where a point (m, global) lies on the page."""
        x, y = self.scale * (PAGE @ point - self.middle)
        left, top = self.corner
        width, height = self.size
        return left + width / 2.0 + x, top + HEADER + (height - HEADER - FOOTER) / 2.0 + y

    def disc(self, body: str) -> Disc:
        """The body of that name."""
        return next(disc for disc in self.discs if disc.body == body)


@dataclass(frozen=True)
class Layout:
    """All panels, and the height they need."""

    panels: tuple[Panel, ...]
    height: float

    @property
    def sides(self) -> Point:
        """Left and right end of what is used of the page's width."""
        return (
            min(panel.corner[0] for panel in self.panels),
            max(panel.corner[0] + panel.size[0] for panel in self.panels),
        )


def lay_out(drivetrain: Drivetrain, parts: Components) -> Layout:
    """Every part and hub in its panel, in rows, in the train's order."""
    frames = place_parts(drivetrain)
    items = in_order(drivetrain)
    discs = [item_discs(drivetrain, item, frames) for item in items]
    scales = _scales(discs)
    panels: list[Panel] = []
    sizes = [
        _size(found, scale, item)
        for item, found, (scale, _) in zip(items, discs, scales, strict=True)
    ]
    corners, height = _rows(sizes)
    for item, found, (scale, factor), size, corner in zip(
        items, discs, scales, sizes, corners, strict=True
    ):
        low, high = _box(found)
        frame = frames[item.first.partition(".")[0] if isinstance(item, Coupling) else item.name]
        own = _springs_among(parts.springs, {disc.body for disc in found})
        panels.append(
            Panel(item, found, own, frame, corner, size, scale, factor, (low + high) / 2.0)
        )
    return Layout(tuple(panels), height)


def in_order(drivetrain: Drivetrain) -> list[Item]:
    """Parts and couplings along the train, from the end nearest to the first stage."""
    ends = [{body.partition(".")[0] for body in c.bodies} for c in drivetrain.couplings]
    first = drivetrain.parts[0].name
    near = {name for pair in ends if first in pair for name in pair}

    def from_the_end(part: Part) -> tuple[bool, int]:
        inside = sum(part.name in pair for pair in ends) > 1
        return inside, 0 if part.name == first else 1 if part.name in near else 2

    found: dict[str, Item] = {}
    names = [part.name for part in sorted(drivetrain.parts, key=from_the_end)]
    for coupling, _, there in walk(names, drivetrain.couplings):
        if coupling is not None:
            found[coupling.name] = coupling
        part = drivetrain.part(there.partition(".")[0])
        found.setdefault(part.name, part)
    return list(found.values())


def item_discs(drivetrain: Drivetrain, item: Item, frames: dict[str, Frame]) -> tuple[Disc, ...]:
    """The bodies of a stage, an inertia, or a coupling's hub, where they stand."""
    if isinstance(item, Coupling):
        frame = frames[item.first.partition(".")[0]]
        centre = frame.point(drivetrain.member(item.first).centre)
        return (Disc(item.name, Role.HUB, centre, item.radius, item.radius),)
    return tuple(Disc.of(member, frames[item.name]) for member in item.members())


def _springs_among(springs: Sequence[Spring], bodies: set[str]) -> tuple[Spring, ...]:
    return tuple(
        spring
        for spring in springs
        if spring.kind not in (SpringKind.SHAFT, SpringKind.TRANSLATION)
        and {end.body for end in spring.ends} <= bodies | {GROUND}
    )


def _box(discs: Sequence[Disc]) -> tuple[Array, Array]:
    centres = np.array([PAGE @ disc.centre for disc in discs])
    outer = np.array([[disc.outer] for disc in discs])
    return np.min(centres - outer, axis=0), np.max(centres + outer, axis=0)


def _scales(discs: Sequence[Sequence[Disc]]) -> list[tuple[float, int]]:
    """Scale and enlargement of every panel; a stage far smaller than the largest is enlarged."""
    sizes = [float(max(np.subtract(*reversed(_box(found))))) for found in discs]
    stages = [size for size, own in zip(sizes, discs, strict=True) if _to_scale(own)]
    room = next(height for most, height in ROOMS if len(stages) <= most)
    common = room / max(stages, default=1.0)
    found: list[tuple[float, int]] = []
    for size, own in zip(sizes, discs, strict=True):
        if _to_scale(own):
            drawn = size * common
            factor = next((f for f in ENLARGEMENTS if f * drawn >= 0.4 * room), ENLARGEMENTS[-1])
            found.append((common * factor, factor))
        else:
            largest = max(own, key=lambda disc: disc.radius)
            found.append(((HUB if largest.role is Role.HUB else ROTOR) / largest.radius, 0))
    return found


def _to_scale(discs: Sequence[Disc]) -> bool:
    return any(disc.to_scale for disc in discs)


def _size(discs: Sequence[Disc], scale: float, item: Item) -> Point:
    low, high = _box(discs)
    width, height = scale * (high - low)
    margin = 110.0 if _to_scale(discs) else 34.0
    title = LETTER * len(item.name)
    return max(float(width) + margin, title), float(height) + margin * 0.6 + HEADER + FOOTER


def _rows(sizes: Sequence[Point]) -> tuple[list[Point], float]:
    """Corners of panels set in rows, each row in the middle of the page."""
    rows: list[list[Point]] = [[]]
    for size in sizes:
        if rows[-1] and sum(w + GAP for w, _ in rows[-1]) + size[0] > WIDTH:
            rows.append([])
        rows[-1].append(size)
    corners: list[Point] = []
    top = 0.0
    for row in rows:
        left = (WIDTH - sum(w for w, _ in row) - GAP * (len(row) - 1)) / 2.0
        tallest = max(h for _, h in row)
        for width, height in row:
            corners.append((left, top + (tallest - height) / 2.0))
            left += width + GAP
        top += tallest + GAP
    return corners, top - GAP

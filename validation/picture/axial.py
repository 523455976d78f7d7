"""The shafts from the side: what is joined to what, by which spring, and held by what.

Heights are to scale (where a body's axis lies, and how large it is); along the shafts the parts are
spread out in the train's order. A planetary stage is drawn as the usual stick diagram.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mbs_models.model.parameters import Coupling, Drivetrain
from mbs_models.stages.part import Role
from mbs_models.system.components import GROUND, Components, Spring, SpringKind

from .drawing import page
from .layout import PAGE, WIDTH, Disc, Layout, Panel
from .symbols import Point, grounded_spring, group, line, number, path, spring, text

HEIGHT, TOP, BOTTOM = 210.0, 56.0, 34.0
THICK = 13.0  # of a gear
LEAST = 7.0  # half height of the smallest body
BESIDE = 26.0  # from one rotor of a part to the next


@dataclass(frozen=True)
class Column:
    """A part's place along the shafts."""

    panel: Panel
    x: float
    width: float


@dataclass(frozen=True)
class SideView:
    """Where things are drawn: columns by name, and heights in page units per metre."""

    columns: dict[str, Column]
    hubs: dict[str, tuple[str, ...]]  # body → couplings at it
    scale: float
    lowest: float

    def column(self, body: str) -> Column:
        """The column of a body or hub."""
        return self.columns[body.partition(".")[0]]

    def disc(self, body: str) -> Disc:
        """The body of that name."""
        return self.column(body).panel.disc(body)

    def height(self, disc: Disc) -> float:
        """Where a body's axis lies."""
        return float(TOP + self.scale * ((PAGE @ disc.centre)[1] - self.lowest))

    def half(self, disc: Disc) -> float:
        """Half of a body's height; that of hubs and inertias says nothing."""
        match disc.role:
            case Role.HUB:
                return 13.0
            case Role.ROTOR:
                return 34.0
        return max(LEAST, self.scale * disc.outer)

    def x(self, disc: Disc) -> float:
        """Where along the shafts a body's own disc stands; the carrier beside its planets."""
        column = self.column(disc.body)
        match disc.role:
            case Role.CARRIER:
                return column.x + 19.0 * self.carrier_side(column)
            case Role.SUN | Role.PLANET | Role.RING:
                return column.x - 19.0 * self.carrier_side(column)
            case Role.ROTOR:
                rotors = [d.body for d in column.panel.discs if d.role is Role.ROTOR]
                return column.x + BESIDE * (rotors.index(disc.body) - (len(rotors) - 1) / 2.0)
        return column.x

    def at(self, body: str) -> Point:
        """The middle of a body."""
        disc = self.disc(body)
        return self.x(disc), self.height(disc)

    def side(self, body: str) -> float:
        """On which side (±1) a body is coupled; 0: on none, or on both."""
        here = self.column(body).x
        sides = {1.0 if self.column(hub).x > here else -1.0 for hub in self.hubs.get(body, ())}
        return sides.pop() if len(sides) == 1 else 0.0

    def carrier_side(self, column: Column) -> float:
        """On which side of its planets the carrier lies: away from what the sun is coupled to."""
        name = column.panel.item.name
        return self.side(f"{name}.carrier") or -self.side(f"{name}.sun") or -1.0


def draw_shafts(drivetrain: Drivetrain, layout: Layout, parts: Components) -> str:
    """The side view of the whole drivetrain."""
    view = _view(drivetrain, layout)
    hubs = [coupling.name for coupling in drivetrain.couplings]
    drawn = "".join(
        _shafts(drivetrain, view, coupling, parts.springs) for coupling in drivetrain.couplings
    )
    for one in parts.springs:
        first, second = (end.body for end in one.ends)
        if one.kind is SpringKind.SHAFT and not {first, second} & {*hubs}:
            drawn += _shaft(one, view.at(first), view.at(second))
    for column in view.columns.values():
        drawn += _part(view, column)
    drawn += _headings(list(view.columns.values()))
    for one in parts.springs:
        if one.ends[0].body == GROUND:
            drawn += _support(view, one)
        elif one.kind is SpringKind.TRANSLATION:
            drawn += _translation(view, one)
    label = f"{drivetrain.name}: shafts and couplings, from the side"
    ends = [c.x + side * c.width / 2.0 for c in view.columns.values() for side in (-1.0, 1.0)]
    return page(drawn, TOP + HEIGHT + BOTTOM, label, (min(ends) - 20.0, max(ends) + 20.0))


def _view(drivetrain: Drivetrain, layout: Layout) -> SideView:
    weights = [_spread(panel) for panel in layout.panels]
    unit = min(WIDTH / sum(weights), 165.0)
    left = (WIDTH - unit * sum(weights)) / 2.0
    columns: dict[str, Column] = {}
    for panel, weight in zip(layout.panels, weights, strict=True):
        columns[panel.item.name] = Column(panel, left + unit * weight / 2.0, unit * weight)
        left += unit * weight
    discs = [d for p in layout.panels for d in p.discs if d.to_scale]
    discs = discs or [d for p in layout.panels for d in p.discs]
    middle = [float((PAGE @ disc.centre)[1]) for disc in discs]
    low = min(y - d.outer for y, d in zip(middle, discs, strict=True))
    high = max(y + d.outer for y, d in zip(middle, discs, strict=True))
    ends = [(end, coupling.name) for coupling in drivetrain.couplings for end, _ in coupling.ends]
    hubs = {body: tuple(hub for end, hub in ends if end == body) for body, _ in ends}
    return SideView(columns, hubs, HEIGHT / (high - low), low)


def _spread(panel: Panel) -> float:
    """How much room along the shafts a panel's bodies take."""
    roles = [disc.role for disc in panel.discs]
    if Role.CARRIER in roles:
        return 2.0
    rotors = 0.8 + BESIDE / 165.0 * (roles.count(Role.ROTOR) - 1)
    return 0.9 if Role.HUB in roles else rotors if Role.ROTOR in roles else 1.3


def _headings(columns: Sequence[Column]) -> str:
    """Parts in the first line; couplings below, where need be in two lines."""
    drawn, last = "", -WIDTH
    low = False
    for column in columns:
        name = column.panel.item.name
        if isinstance(column.panel.item, Coupling):
            half = 3.0 * len(name)
            low = column.x - half < last + 6.0 and not low
            last = column.x + half
            drawn += text((column.x, 41.0 if low else 29.0), name, "about")
        else:
            half = 4.1 * len(name)
            x = min(max(column.x, half), WIDTH - half)
            drawn += text((x, 14.0), name, "title")
    return drawn


# --- bodies ---------------------------------------------------------------------------------


def _part(view: SideView, column: Column) -> str:
    if {Role.SUN, Role.RING, Role.CARRIER, Role.PLANET} <= {d.role for d in column.panel.discs}:
        return _planetary(view, column)
    return "".join(_bar(view, disc) for disc in column.panel.discs)


def _bar(view: SideView, disc: Disc) -> str:
    """A body from the side."""
    wide = 9.0 if disc.role is Role.HUB else THICK
    y, half = view.height(disc), view.half(disc)
    return group(_rectangle(view.x(disc), y, wide, half, f"solid {disc.role}"), title=disc.body)


def _rectangle(x: float, y: float, wide: float, half: float, style: str) -> str:
    return (
        f'<rect class="{style}" x="{number(x - wide / 2.0)}" y="{number(y - half)}" '
        f'width="{number(wide)}" height="{number(2.0 * half)}" rx="1.5"/>'
    )


def _planetary(view: SideView, column: Column) -> str:
    """Sun, two of the planets, ring and carrier."""
    discs = {disc.role: disc for disc in column.panel.discs}
    sun, ring, carrier, planet = (
        discs[role] for role in (Role.SUN, Role.RING, Role.CARRIER, Role.PLANET)
    )
    x, y = view.at(sun.body)
    arm, r = view.scale * carrier.radius, view.scale * planet.pitch
    inner, outer = view.scale * ring.pitch, view.scale * ring.outer
    plate = view.x(carrier)
    pin = x + (9.0 if x > plate else -9.0)
    drawn = _rectangle(plate, y, 6.0, arm + 5.0, "solid carrier")
    for side in (-1.0, 1.0):
        drawn += line((plate, y + side * arm), (pin, y + side * arm), "shaft")
        drawn += _rectangle(x, y + side * arm, THICK, r, "solid planet")
        rim = y + side * (inner + outer) / 2.0
        drawn += _rectangle(x, rim, 2.0 * THICK, (outer - inner) / 2.0, "solid ring")
    return drawn + _rectangle(x, y, THICK, max(4.0, view.scale * sun.pitch), "solid sun")


# --- shafts ---------------------------------------------------------------------------------


def _shafts(
    drivetrain: Drivetrain, view: SideView, coupling: Coupling, springs: Sequence[Spring]
) -> str:
    """From both bodies to the hub: a spring, a rigid shaft, or nothing."""
    drawn = ""
    found = {
        frozenset(end.body for end in one.ends): one
        for one in springs
        if one.kind is SpringKind.SHAFT
    }
    hub = view.at(coupling.name)
    for body, stiffness in coupling.ends:
        start = _shaft_end(view, body, hub[0])
        one = found.get(frozenset((body, coupling.name)))
        if one is not None:
            drawn += _shaft(one, start, hub)
        elif stiffness == "rigid":
            drawn += line(start, hub, "shaft")
        else:
            drawn += _open(start, hub)
    return drawn


def _shaft(one: Spring, start: Point, end: Point) -> str:
    words = f"{one.name}: {float(one.stiffness[0, 0]):.4g} N m/rad"
    return group(_sprung(start, end), title=words)


def _shaft_end(view: SideView, body: str, towards: float) -> Point:
    """Where a body's shaft begins; the ring's at the side of its rim."""
    x, y = view.at(body)
    disc = view.disc(body)
    if disc.role is Role.RING:
        return x + (THICK if towards > x else -THICK), y - view.half(disc) * 0.95
    return x, y


def _sprung(start: Point, end: Point) -> str:
    """A shaft with its torsion spring in the middle."""
    a = (start[0] + 0.3 * (end[0] - start[0]), start[1] + 0.3 * (end[1] - start[1]))
    b = (start[0] + 0.85 * (end[0] - start[0]), start[1] + 0.85 * (end[1] - start[1]))
    return line(start, a, "shaft") + spring(a, b, "torsion", 5.0) + line(b, end, "shaft")


def _translation(view: SideView, one: Spring) -> str:
    """A coupled translation: a spring from body to body, below the shaft."""
    (x1, y1), (x2, y2) = (view.at(end.body) for end in one.ends)
    first, second = (x1, y1 + 15.0), (x2, y2 + 15.0)
    words = f"{one.name}: {float(one.stiffness[0, 0]):.4g} N/m"
    return group(spring(first, second, "bearing", 3.0), title=words)


def _open(start: Point, end: Point) -> str:
    """Shafts that do not meet."""
    a = (start[0] + 0.35 * (end[0] - start[0]), start[1] + 0.35 * (end[1] - start[1]))
    b = (start[0] + 0.7 * (end[0] - start[0]), start[1] + 0.7 * (end[1] - start[1]))
    crosses = path([(b[0] - 4, b[1] - 4), (b[0] + 4, b[1] + 4)])
    crosses += path([(b[0] - 4, b[1] + 4), (b[0] + 4, b[1] - 4)])
    broken = f'<path class="broken" d="{crosses}"/>'
    return group(line(start, a, "shaft") + broken, title="not connected")


# --- supports -------------------------------------------------------------------------------


def _support(view: SideView, one: Spring) -> str:
    """A bearing below the body, its other supports beside it."""
    body = one.ends[1].body
    disc, (x, y) = view.disc(body), view.at(body)
    if disc.role is Role.RING:
        aside = {SpringKind.BEARING: 9.0, SpringKind.TORSION: -9.0}[one.kind]
        return _held((x + aside, y + view.half(disc)), one)
    carrier = view.carrier_side(view.column(body))
    free = {Role.CARRIER: carrier, Role.SUN: -carrier}.get(disc.role, -view.side(body) or 1.0)
    start = (x + free * (14.0 if one.kind is SpringKind.BEARING else 26.0), y)
    return line((x, y), start, "shaft") + _held(start, one)


def _held(start: Point, one: Spring) -> str:
    style = "bearing" if one.kind is SpringKind.BEARING else "torsion"
    return group(grounded_spring(start, (0.0, 1.0), 20.0, style), title=one.name)

"""The few symbols the model is drawn with, as SVG: springs, ground, arrows, arcs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape

Point = tuple[float, float]


def number(value: float) -> str:
    """A coordinate to a tenth, which is finer than any line."""
    text = f"{value:.1f}".removesuffix(".0")
    return "0" if text == "-0" else text


def path(points: Iterable[Point], *, close: bool = False) -> str:
    """Path data through points."""
    found = "L".join(f"{number(x)} {number(y)}" for x, y in points)
    return f"M{found}{'z' if close else ''}"


def line(first: Point, second: Point, style: str) -> str:
    """A straight line."""
    return f'<path class="{style}" d="{path((first, second))}"/>'


def circle(centre: Point, radius: float, style: str) -> str:
    """A circle."""
    x, y = map(number, centre)
    return f'<circle class="{style}" cx="{x}" cy="{y}" r="{number(radius)}"/>'


def text(at: Point, words: str, style: str = "", anchor: str = "middle") -> str:
    """A line of text."""
    x, y = map(number, at)
    css = f' class="{style}"' if style else ""
    aligned = "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text{css} x="{x}" y="{y}"{aligned}>{escape(words)}</text>'


def group(content: str, *, style: str = "", transform: str = "", title: str = "") -> str:
    """A group, with the words that show when it is pointed at."""
    css = f' class="{style}"' if style else ""
    placed = f' transform="{transform}"' if transform else ""
    words = f"<title>{escape(title)}</title>" if title else ""
    return f"<g{css}{placed}>{words}{content}</g>"


def zigzag(length: float, height: float = 4.0) -> list[Point]:
    """A spring from the origin along x: straight ends, and teeth in between."""
    lead = min(0.2 * length, 6.0)
    coils = max(3, min(7, round((length - 2.0 * lead) / (1.6 * height))))
    step = (length - 2.0 * lead) / (2 * coils)
    teeth = [(lead + (i + 0.5) * step, height * (-1) ** i) for i in range(2 * coils)]
    return [(0.0, 0.0), (lead, 0.0), *teeth, (length - lead, 0.0), (length, 0.0)]


def spring(first: Point, second: Point, style: str, height: float = 4.0) -> str:
    """A spring between two points."""
    d = path(zigzag(distance(first, second), height))
    return along(first, second, f'<path class="{style}" d="{d}"/>')


def along(first: Point, second: Point, content: str) -> str:
    """Content drawn along x from the origin, laid from one point towards another."""
    angle = math.degrees(math.atan2(second[1] - first[1], second[0] - first[0]))
    x, y = map(number, first)
    return group(content, transform=f"translate({x} {y}) rotate({angle:.2f})")


def grounded_spring(start: Point, direction: Point, length: float, style: str) -> str:
    """A spring from a point to a hatched piece of ground."""
    drawn = path(zigzag(length, 3.4))
    ground = path([(length, -7.0), (length, 7.0)])
    hatch = "".join(path([(length, y), (length + 4.0, y - 4.0)]) for y in (-3.0, 1.0, 5.0))
    content = f'<path class="{style}" d="{drawn}"/><path class="ground" d="{ground}{hatch}"/>'
    end = (start[0] + direction[0], start[1] + direction[1])
    return along(start, end, content)


def arrow(start: Point, end: Point, style: str) -> str:
    """An arrow; nothing where it would be shorter than its head."""
    length = distance(start, end)
    if length < 2.0:
        return ""
    head = min(6.0, 0.6 * length)
    tip = [(length - head, -0.45 * head), (length, 0.0), (length - head, 0.45 * head)]
    d = path([(0.0, 0.0), (length, 0.0)]) + path(tip)
    return along(start, end, f'<path class="{style}" d="{d}"/>')


def arc_arrow(centre: Point, radius: float, angle: float, style: str, start: float) -> str:
    """An arc from position angle ``start`` through ``angle`` (rad, clockwise), with a head."""
    if abs(angle) * radius < 2.0:
        return ""
    x, y = centre
    end = start + angle
    a = (x + radius * math.cos(start), y + radius * math.sin(start))
    b = (x + radius * math.cos(end), y + radius * math.sin(end))
    large, sweep = int(abs(angle) > math.pi), int(angle > 0.0)
    head = min(6.0, 0.6 * abs(angle) * radius)
    forward = end + math.copysign(math.pi / 2.0, angle)
    wings = []
    for turn in (0.8 * math.pi, -0.8 * math.pi):
        wings.append(
            (b[0] + head * math.cos(forward + turn), b[1] + head * math.sin(forward + turn))
        )
    r = number(radius)
    d = f"{path([a])}A{r} {r} 0 {large} {sweep} {number(b[0])} {number(b[1])}"
    return f'<path class="{style}" d="{d}{path([wings[0], b, wings[1]])}"/>'


def distance(first: Point, second: Point) -> float:
    """Between two points."""
    return math.hypot(second[0] - first[0], second[1] - first[1])

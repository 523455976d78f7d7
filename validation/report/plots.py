"""Plots over frequency as SVG, written as text: lines, markers, areas, ticks and names, no more.

A page has some thirty of these axes, and a drawing library makes an object of every tick, label and
grid line: a second and a half for what is written here in a few hundredths. Lengths are points.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from math import ceil, floor, log10
from typing import Any

import numpy as np

from ..arrays import FloatArray
from .style import INK, MUTED, decade_labels, is_logarithmic

INCH = 72.0
BESIDE = 9.0  # points to the right of a frame that are its own
Box = tuple[float, float, float, float]  # left, top, width, height
Dash = str | tuple[float, tuple[float, ...]]

FONT, SMALL = 8.5, 8.0
GRID = "#e6eaee"
HAIR = 0.8
DASHED = (0.0, (3.7, 1.6))
HANDLE, GAP, LINE = 26.0, 6.0, 11.9  # of a legend: sample, space after it, height of a row
MARKS = {".": (0.25, True), "o": (0.5, True), "x": (0.5, False)}  # radius over size; filled


@dataclass(frozen=True, eq=False)
class _Line:
    x: FloatArray
    y: FloatArray
    style: LegendEntry


@dataclass(frozen=True)
class LegendEntry:
    """How a line is drawn; ``name`` is its legend entry."""

    name: str
    color: str
    width: float = 1.0
    dash: Dash = "solid"
    marker: str = ""
    size: float = 3.0

    @property
    def attributes(self) -> str:
        """Of a path."""
        text = f'fill="none" stroke="{self.color}" stroke-width="{self.width:g}"'
        dash = DASHED if self.dash in ("dashed", "--") else self.dash
        if isinstance(dash, str):
            return f'{text} stroke-linejoin="round"'
        offset, lengths = dash
        # as matplotlib has it: in widths of the line
        numbers = " ".join(f"{length * self.width:g}" for length in lengths)
        start = f' stroke-dashoffset="{offset * self.width:g}"' if offset else ""
        return f'{text} stroke-linejoin="round" stroke-dasharray="{numbers}"{start}'


@dataclass(eq=False)
class Axes:
    """One frame of a plot.

    Attributes
    ----------
    box
        Where it is.
    x
        First and last frequency; the axis is logarithmic as `is_logarithmic` has it, or as told.
    labelled
        Whether frequencies are written below it.
    x_ticks
        Places below it and their names, upright, in the place of frequencies.
    """

    box: Box
    x: tuple[float, float]
    logarithmic: bool
    labelled: bool = True
    title: str = ""
    y: tuple[float, float] | None = None
    y_ticks: Sequence[tuple[float, str]] | None = None
    x_ticks: Sequence[tuple[float, str]] | None = None
    y_log: bool = False
    y_name: str = ""
    frame: bool = True
    named_x: bool = True
    _below: list[tuple[FloatArray, FloatArray, FloatArray, str, float]] = field(
        default_factory=list
    )
    _beyond: list[FloatArray] = field(default_factory=list)
    _marks: list[str] = field(default_factory=list)
    _lines: list[_Line] = field(default_factory=list)
    _words: list[str] = field(default_factory=list)

    @classmethod
    def over(cls, box: Box, first: float, last: float, **options: Any) -> Axes:
        """Over a band, on the axis that suits it."""
        return cls(box, (first, last), is_logarithmic(first, last), **options)

    def plot(self, x: Any, y: Any, **style: Any) -> None:
        """A line through points, as matplotlib's."""
        width = float(style.get("linewidth", style.get("lw", 1.0)))
        drawn = LegendEntry(
            style.get("label", ""),
            style["color"],
            width,
            style.get("linestyle", style.get("ls", "solid")) or "solid",
            style.get("marker", ""),
            float(style.get("markersize", style.get("ms", 3.0))),
        )
        self._lines.append(_Line(np.asarray(x, float), np.asarray(y, float), drawn))

    def fill_between(self, x: Any, low: Any, high: Any, **style: Any) -> None:
        """An area between two lines, as matplotlib's; ``fitted``: the vertical axis holds it."""
        lower, upper = (np.broadcast_to(np.asarray(v, float), np.shape(x)) for v in (low, high))
        self._below.append(
            (np.asarray(x, float), lower, upper, style["color"], float(style.get("alpha", 1.0)))
        )
        if style.get("fitted", True):
            self._beyond += [lower, upper]

    def mark(self, first: FloatArray, last: FloatArray, color: str) -> None:
        """Shade the frame from bottom to top between frequencies; no less than a hair wide."""
        left, top, _, height = self.box
        starts, ends = left + self._along(first), left + self._along(last)
        self._marks += [
            f'<rect x="{a:.2f}" y="{top:.2f}" width="{max(b - a, HAIR):.2f}" '
            f'height="{height:.2f}" fill="{color}"/>'
            for a, b in zip(starts.tolist(), ends.tolist(), strict=True)
        ]

    def set_ylabel(self, name: str) -> None:
        """The name of the vertical axis."""
        self.y_name = name

    def across(self, y: float, color: str, width: float, dash: Dash = "solid") -> None:
        """A line from end to end."""
        self.plot(self.x, (y, y), color=color, lw=width, ls=dash)

    def through(self, x: float, color: str, width: float) -> None:
        """A faint line from bottom to top."""
        left, top, _, height = self.box
        (at,) = self._along(np.array([x]))
        self._words.append(
            f'<path d="M{left + at:.2f} {top:.2f}v{height:.2f}" stroke="{color}" '
            f'stroke-width="{width:g}" stroke-opacity="0.45"/>'
        )

    def ticks(self, x: FloatArray, y: tuple[float, float], color: str, width: float) -> None:
        """Short vertical lines between two heights (shares of the frame, from its top)."""
        left, top, _, height = self.box
        start, length = top + y[0] * height, (y[1] - y[0]) * height
        path = "".join(f"M{left + at:.2f} {start:.2f}v{length:.2f}" for at in self._along(x))
        self._words.append(f'<path d="{path}" stroke="{color}" stroke-width="{width:g}"/>')

    def bars(self, x: FloatArray, low: FloatArray, high: FloatArray, color: str) -> None:
        """Bars four fifths of a unit wide."""
        left, top, _, _ = self.box
        ends = self._along(x - 0.4), self._along(x + 0.4), self._up(high), self._up(low)
        path = "".join(
            f"M{left + a:.2f} {top + c:.2f}H{left + b:.2f}V{top + d:.2f}H{left + a:.2f}z"
            for a, b, c, d in zip(*ends, strict=True)
        )
        self._words.append(f'<path d="{path}" fill="{color}" stroke="#fff" stroke-width="0.5"/>')

    def decades(self, lowest: int, highest: int, most: int = 7) -> None:
        """Make the vertical axis logarithmic over whole decades, ``most`` of them labelled."""
        self.y_log, self.y = True, (10.0**lowest, 10.0**highest)
        self.y_ticks = list(decade_labels(lowest, highest, most).items())

    def note(self, words: str) -> None:
        """Words in the middle."""
        left, top, width, height = self.box
        self._words.append(text(left + width / 2.0, top + height / 2.0, words, anchor="middle"))

    def _along(self, x: FloatArray) -> FloatArray:
        first, last = self.x
        if self.logarithmic:
            x, first, last = np.log10(x), log10(first), log10(last)
        return np.asarray((x - first) / ((last - first) or 1.0) * self.box[2])

    def _up(self, y: FloatArray) -> FloatArray:
        assert self.y is not None
        low, high = self.y
        if self.y_log:
            with np.errstate(divide="ignore", invalid="ignore"):
                y, low, high = np.log10(y), log10(low), log10(high)
        return np.asarray((high - y) / (high - low) * self.box[3])

    def svg(self, name: str) -> str:
        """The frame and what is in it; ``name`` is unique in a page."""
        if self.y is None:
            self.y = self._fitted()
        left, top, width, height = self.box
        parts = [f'<g id="{name}">', self._scales() if self.frame else ""]
        parts.append(
            f'<clipPath id="{name}-clip"><rect x="{left:.2f}" y="{top:.2f}" '
            f'width="{width:.2f}" height="{height:.2f}"/></clipPath>'
            f'<g clip-path="url(#{name}-clip)">'
        )
        parts += self._marks
        for x, low, high, color, alpha in self._below:
            outline = _path(
                left + self._along(np.append(x, x[::-1])),
                top + self._up(np.append(high, low[::-1])),
            )
            opacity = f' fill-opacity="{alpha:g}"' if alpha < 1.0 else ""
            parts.append(f'<path d="{outline}Z" fill="{color}"{opacity}/>')
        for line in self._lines:
            x, y = left + self._along(line.x), top + self._up(line.y)
            if line.style.width:
                parts.append(f'<path d="{_path(x, y)}" {line.style.attributes}/>')
            if line.style.marker:
                parts.append(_dots(x, y, line.style))
        parts.append("</g>")
        if self.title:
            parts.append(text(left, top - 6.0, self.title, size=9.0, bold=True))
        return "".join([*parts, *self._words, "</g>"])

    def _fitted(self) -> tuple[float, float]:
        """The range of what is drawn, and a twentieth more."""
        values = [line.y[np.isfinite(line.y)] for line in self._lines]
        values += [v[np.isfinite(v)] for v in self._beyond]
        drawn = np.concatenate([np.empty(0), *values])
        if not drawn.size:
            return 0.0, 1.0
        low, high = float(drawn.min()), float(drawn.max())
        more = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
        return low - more, high + more

    def _scales(self) -> str:
        assert self.y is not None
        left, top, width, height = self.box
        bottom = top + height
        ticks = self.y_ticks
        if ticks is None:
            values = round_values(*self.y, 6, (1.0, 2.0, 5.0))
            ticks = [(v, f"{v:g}".replace("-", "−")) for v in values]
        low, high = self.y
        ticks = [(value, label) for value, label in ticks if low <= value <= high]
        at_y = top + self._up(np.array([value for value, _ in ticks], float))
        values_x = self._frequencies() if self.x_ticks is None else np.empty(0)
        at_x = left + self._along(values_x)
        grid = "".join(f"M{left:.2f} {y:.2f}h{width:.2f}" for y in at_y)
        grid += "".join(f"M{x:.2f} {top:.2f}v{height:.2f}" for x in at_x)
        marks = "".join(f"M{left:.2f} {y:.2f}h-3.5" for y in at_y)
        marks += "".join(f"M{x:.2f} {bottom:.2f}v3.5" for x in at_x)
        marks += "".join(f"M{left + x:.2f} {bottom:.2f}v2" for x in self._along(self._digits()))
        parts = [
            f'<path d="{grid}" stroke="{GRID}" stroke-width="0.6"/>',
            f'<path d="M{left:.2f} {top:.2f}v{height:.2f}h{width:.2f}{marks}" fill="none" '
            f'stroke="{MUTED}" stroke-width="0.7"/>',
        ]
        parts += [
            text(left - 7.0, y + 3.0, label, anchor="end")
            for y, (_, label) in zip(at_y, ticks, strict=True)
        ]
        if self.labelled and self.x_ticks is None:
            for x, value in zip(at_x, values_x, strict=True):
                name = f"{value:,.6g}".replace(",", " ")
                inside = left + width + BESIDE - 0.31 * FONT * len(name)  # a digit is 0.62 wide
                parts.append(text(min(x, inside), bottom + 14.0, name, anchor="middle"))
            if self.named_x:
                parts.append(
                    text(left + width / 2.0, bottom + 27.0, "Frequency (Hz)", anchor="middle")
                )
        parts += [upright(left + x, bottom + 6.0, name) for x, name in self._named_places()]
        if self.y_name:
            x, y = left - 40.0, top + height / 2.0
            turned = f'transform="translate({x:.1f} {y:.1f}) rotate(-90)"'
            parts.append(text(0.0, 0.0, self.y_name, anchor="middle", more=turned))
        return "".join(parts)

    def _named_places(self) -> list[tuple[float, str]]:
        ticks = self.x_ticks or ()
        at = self._along(np.array([place for place, _ in ticks], float))
        return [(float(x), name) for x, (_, name) in zip(at, ticks, strict=True)]

    def _frequencies(self) -> FloatArray:
        """Where frequencies are written."""
        first, last = self.x
        if self.logarithmic:
            powers = np.arange(ceil(log10(first) - 1e-9), floor(log10(last) + 1e-9) + 1)
            return np.asarray(10.0**powers)
        return round_values(first, last, 9, (1.0, 2.0, 2.5, 5.0))

    def _digits(self) -> FloatArray:
        """2, 3, … 9 in each decade of a logarithmic axis."""
        if not self.logarithmic or self.x_ticks is not None:
            return np.empty(0)
        first, last = self.x
        decades = 10.0 ** np.arange(floor(log10(first)), ceil(log10(last)))
        digits = np.outer(decades, np.arange(2, 10)).ravel()
        return digits[(digits >= first) & (digits <= last)]


def round_values(low: float, high: float, most: int, steps: Sequence[float]) -> FloatArray:
    """Multiples of the least round step that puts at most ``most`` + 1 of them in a range.

    Parameters
    ----------
    steps
        Round steps of one decade, ascending from 1.
    """
    least = (high - low) / most
    if not least > 0.0:
        return np.array([low])
    power = 10.0 ** floor(log10(least))
    slack = 1e-9  # of a step: what a division rounds
    step = next(s * power for s in (*steps, 10.0, 20.0) if s * power >= least * (1.0 - slack))
    numbers = np.arange(ceil(low / step - slack), floor(high / step + slack) + 1)
    return np.asarray(step * numbers)


def _path(x: FloatArray, y: FloatArray) -> str:
    """Path data through points; a gap where one is not finite."""
    finite = np.isfinite(x) & np.isfinite(y)
    starts = finite & ~np.append(False, finite[:-1])
    return "".join(
        f"{'M' if first else 'L'}{a:.2f} {b:.2f}"
        for first, a, b in zip(
            starts[finite].tolist(), x[finite].tolist(), y[finite].tolist(), strict=True
        )
    )


def _dots(x: FloatArray, y: FloatArray, style: LegendEntry) -> str:
    """Markers, as one path: dots, circles or crosses."""
    finite = np.isfinite(x) & np.isfinite(y)
    share, filled = MARKS[style.marker]
    r = share * style.size
    shape = f"a{r:g} {r:g} 0 1 0 {2 * r:g} 0a{r:g} {r:g} 0 1 0 {-2 * r:g} 0"
    if not filled:
        shape = f"m0 {-r:g}l{2 * r:g} {2 * r:g}m0 {-2 * r:g}l{-2 * r:g} {2 * r:g}"
    path = "".join(
        f"M{a - r:.2f} {b:.2f}{shape}"
        for a, b in zip(x[finite].tolist(), y[finite].tolist(), strict=True)
    )
    pen = "" if filled else ' fill="none" stroke-width="1"'
    return f'<path d="{path}" {"fill" if filled else "stroke"}="{style.color}"{pen}/>'


def text(
    x: float,
    y: float,
    words: str,
    *,
    anchor: str = "start",
    size: float = FONT,
    bold: bool = False,
    more: str = "",
) -> str:
    """Words with their baseline at a point."""
    weight = ' font-weight="bold"' if bold else ""
    place = more or f'x="{x:.2f}" y="{y:.2f}"'
    return (
        f'<text {place} text-anchor="{anchor}" font-size="{size:g}" fill="{INK}"{weight}>'
        f"{escape(words)}</text>"
    )


def upright(x: float, y: float, words: str, size: float = 7.0) -> str:
    """Words from bottom to top that end below a point."""
    turned = f'transform="translate({x + 0.35 * size:.2f} {y:.2f}) rotate(-90)"'
    return text(0.0, 0.0, words, anchor="end", size=size, more=turned)


def legend(
    entries: Iterable[LegendEntry], left: float, top: float, columns: int, column_width: float
) -> str:
    """Samples with their names, column by column; every name once."""
    named = list({entry.name: entry for entry in reversed(list(entries))}.values())[::-1]
    rows = ceil(len(named) / max(columns, 1))
    parts = []
    for number, entry in enumerate(named):
        column, row = divmod(number, rows)
        x, y = left + column * column_width, top + (row + 0.5) * LINE
        if entry.width:
            parts.append(f'<path d="M{x:.1f} {y:.1f}h{HANDLE:g}" {entry.attributes}/>')
        if entry.marker:
            middle = np.array([x + HANDLE / 2.0]), np.array([y])
            parts.append(_dots(*middle, entry))
        parts.append(text(x + HANDLE + GAP, y + 3.0, entry.name, size=SMALL))
    return "".join(parts)


def plot_svg(
    size: tuple[float, float], axes: Sequence[Axes], name: str, alternative: str, *more: str
) -> str:
    """Axes, and what else there is, as an SVG element to stand inside a page.

    Parameters
    ----------
    size
        Width and height.
    axes
        The frames.
    name
        Prefix that keeps the ids of several plots in one page apart.
    alternative
        What it shows, for those who cannot see it.
    more
        Other elements, such as a legend.
    """
    frames = "".join(each.svg(f"{name}-{number}") for number, each in enumerate(axes))
    return (
        f'<svg role="img" aria-label="{escape(alternative)}" xmlns="http://www.w3.org/2000/svg" '
        f'viewBox="0 0 {size[0]:g} {size[1]:g}">{frames}{"".join(more)}</svg>'
    )

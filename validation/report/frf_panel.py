"""The one FRF panel: modes, magnitude, phase and differences over one frequency axis.

Curves are thinned to the extreme values of narrow columns (`curves.extremes`), so that no peak and
no antiresonance is lost; differences to the largest of each.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, IndexArray
from .curves import extremes, largest
from .plots import INCH, Axes, Dash, LegendEntry, legend, plot_svg, text
from .style import (
    LOWEST_ERROR,
    MUTED,
    REFERENCE_COLOR,
    VERMILLION,
    WIDTH,
    Canvas,
    is_logarithmic,
    route_colors,
)

COLUMNS_PER_INCH = 100  # of a panel: what a page at its full width can show
DASH = 5.0  # points: coincident curves take turns, each a dash of this length
ROW, MAGNITUDE, PHASE, DIFFERENCE = 0.14, 2.4, 1.15, 1.1  # inches: a row of modes, and panels
LEFT, RIGHT, AXIS, TITLE, LEGEND = 0.78, 0.15, 0.46, 0.22, 0.165  # inches around them
MARGIN = 0.05  # inches above the first text
DOUBT = "#f6dcc8"  # as the page's warnings
LEAST_RANGE_DB = 1.0  # of a linear difference's axis: what is smaller lies on zero


@dataclass(frozen=True, eq=False)
class Curve:
    """A line over frequency.

    Attributes
    ----------
    name
        Its legend entry; empty: none.
    values
        (n,) an FRF (m/N), complex or its modulus; of a difference, what is drawn.
    color, width, dash, marker
        How it is drawn; a width of 0 leaves the markers alone.
    frequency
        (n,) Hz, where its lines are not those of the panel.
    """

    name: str
    values: NDArray[Any]
    color: str = REFERENCE_COLOR
    width: float = 1.2
    dash: Dash = "solid"
    marker: str = ""
    size: float = 3.0
    frequency: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Band:
    """What lies between two levels (n_frequency,), dB, as that of most samples.

    ``fitted``: whether the vertical axis holds it all.
    """

    name: str
    low: FloatArray
    high: FloatArray
    color: str
    alpha: float = 1.0
    fitted: bool = True


@dataclass(frozen=True, eq=False)
class Marked:
    """Lines that are shaded from bottom to top, as those in doubt.

    Attributes
    ----------
    name
        Its legend entry.
    lines
        (n_frequency,) which.
    """

    name: str
    lines: NDArray[np.bool_]
    color: str = DOUBT


@dataclass(frozen=True)
class Mode:
    """A natural frequency: a long tick in its row where the FRF shows it, a short one elsewhere."""

    row: str
    frequency_hz: float
    color: str
    visible: bool = True


@dataclass(frozen=True, eq=False)
class Difference:
    """A panel below the FRF.

    Attributes
    ----------
    label
        Of its axis, with the unit.
    curves
        What is drawn.
    logarithmic
        The modulus over decades; else linear about zero.
    decades
        How many at most, below the largest value.
    allowed
        (n_frequency,) or one number: a tolerance, drawn as a dashed line.
    """

    label: str
    curves: tuple[Curve, ...]
    logarithmic: bool = True
    decades: int = 18
    allowed: FloatArray | float | None = None


@dataclass(frozen=True, eq=False)
class FrfPanel:
    """One FRF by several routes, or before and after.

    Attributes
    ----------
    frequency
        (n_frequency,) Hz.
    curves
        The reference first: the others are drawn over it.
    differences
        Panels below.
    modes
        Ticks above, a row of them for each name, in their order.
    through
        Whether modes that are visible go on as lines through the magnitude.
    phase
        Whether the phase is drawn.
    unit, symbol
        Of the FRF.
    title
        Above; empty: the page says it.
    width
        Inches; the page scales it.
    from_zero
        Whether the axis is linear and begins at 0 Hz, whatever the band.
    bands
        Behind the curves.
    marked
        Lines shaded in all frames.
    """

    frequency: FloatArray
    curves: tuple[Curve, ...]
    differences: tuple[Difference, ...] = ()
    modes: tuple[Mode, ...] = ()
    through: bool = False
    phase: bool = False
    unit: str = "m/N"
    symbol: str = "H"
    title: str = ""
    width: float = WIDTH
    from_zero: bool = False
    bands: tuple[Band, ...] = ()
    marked: Marked | None = None

    @property
    def logarithmic(self) -> bool:
        """Whether the frequency axis is."""
        return not self.from_zero and is_logarithmic(self.frequency[0], self.frequency[-1])

    def positions(self, frequency: FloatArray) -> FloatArray:
        """Where along the axis lines are drawn."""
        return np.log10(frequency) if self.logarithmic else frequency


def reference_curve(name: str, values: NDArray[Any], width: float = 4.0) -> Curve:
    """The curve that others are held against: broad and grey."""
    return Curve(name, values, REFERENCE_COLOR, width)


def coincident_curves(values: Mapping[str, NDArray[Any]], width: float = 1.2) -> tuple[Curve, ...]:
    """Curves that may lie on one another: their dashes take turns, so that each shows."""
    colors, count = route_colors(list(values)), len(values)
    return tuple(
        Curve(name, each, colors[name], width, _turn(number, count))
        for number, (name, each) in enumerate(values.items())
    )


def _turn(number: int, of: int) -> Dash:
    """A dash pattern that leaves room for all other curves' dashes."""
    return (number * DASH, (DASH, (of - 1) * DASH)) if of > 1 else (0.0, (DASH, DASH / 2.0))


def differences_of(curves: Iterable[Curve], values: Mapping[str, FloatArray]) -> tuple[Curve, ...]:
    """The curves' differences, each in its curve's colour; curves without one are left out.

    Differences that may coincide are dashed over solid ones, the dashed ones in turn.
    """
    return tuple(
        replace(curve, values=values[curve.name], dash=_dashed(number, curve.dash))
        for number, curve in enumerate(curve for curve in curves if curve.name in values)
    )


def _dashed(number: int, dash: Dash) -> Dash:
    if not _takes_turns(dash):
        return dash
    return "solid" if number < 2 else (number * DASH, (DASH, DASH))


def decibels(values: NDArray[Any]) -> FloatArray:
    """20 log₁₀|H|; −inf where it is zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(values)))


def frf_figure(panel: FrfPanel, name: str, alternative: str) -> str:
    """A panel as an SVG element.

    Parameters
    ----------
    panel
        What is drawn.
    name
        Prefix of the figure's ids.
    alternative
        What it shows, for those who cannot see it.
    """
    rows = list(dict.fromkeys(mode.row for mode in panel.modes))
    heights = [ROW * len(rows)] if rows else []
    heights += [MAGNITUDE, *([PHASE] if panel.phase else [])]
    heights += [DIFFERENCE] * len(panel.differences)
    left = max(LEFT, 0.16 + 0.056 * max(map(len, rows), default=0))
    entries = _entries(panel)
    columns = _legend_columns(entries, panel.width - left)
    above = LEGEND * ceil(len(entries) / columns) + 0.1 if entries else 0.1
    above += (TITLE if panel.title else 0.0) + MARGIN
    width = INCH * (panel.width - left - RIGHT)
    first, last = float(panel.frequency[0]), float(panel.frequency[-1])
    frames, top = [], INCH * above
    for height in heights:
        box = (INCH * left, top, width, INCH * height)
        reach = (0.0 if panel.from_zero else first, last)
        frames.append(Axes(box, reach, panel.logarithmic, labelled=False))
        top += INCH * (height + 0.1)
    frames[-1].labelled = True
    thin = int(COLUMNS_PER_INCH * width / INCH)
    remaining = list(frames)
    words = []
    if panel.marked is not None:
        for axes in frames[bool(rows) :]:
            _mark(axes, panel, panel.marked, thin)
    if rows:
        words.append(_draw_modes(remaining.pop(0), panel.modes, rows))
    magnitude = remaining.pop(0)
    draw_magnitude(magnitude, panel, thin)
    for mode in panel.modes if panel.through else ():
        if mode.visible:
            magnitude.through(mode.frequency_hz, mode.color, 0.6)
    if panel.phase:
        _draw_phase(remaining.pop(0), panel, thin)
    for axes, difference in zip(remaining, panel.differences, strict=True):
        _draw_difference(axes, panel, difference, thin // 2)
    start, over = INCH * (left - 0.06), INCH * MARGIN
    if panel.title:
        words.append(text(start, over + 8.0, panel.title, size=9.0, bold=True))
        over += INCH * TITLE
    each = INCH * (panel.width - left) / columns if entries else 0.0
    longest = max((len(entry.name) for entry in entries), default=0)
    words.append(legend(entries, start, over, columns, min(each, 45.0 + 4.9 * longest)))
    size = INCH * panel.width, top + INCH * (AXIS - 0.1)
    return plot_svg(size, frames, name, alternative, *words)


def _mark(axes: Axes, panel: FrfPanel, marked: Marked, columns: int) -> None:
    """Shade each run of columns with such a line, half a line to either side."""
    f = panel.frequency
    columns_start = _evenly(panel.positions(f), columns)
    lines = np.logical_or.reduceat(marked.lines, columns_start).astype(int)
    between = np.concatenate([f[:1], (f[1:] + f[:-1]) / 2])[columns_start]
    edges = np.append(between, f[-1])
    starts, ends = (np.flatnonzero(np.diff(lines, prepend=0, append=0))[n::2] for n in (0, 1))
    axes.mark(edges[starts], edges[ends], marked.color)


def _draw_modes(axes: Axes, modes: Sequence[Mode], rows: Sequence[str]) -> str:
    """A row of ticks for each name, and the names."""
    axes.frame, axes.y = False, (0.0, 1.0)
    kinds: dict[tuple[str, str, bool], list[float]] = {}
    for mode in modes:
        kinds.setdefault((mode.row, mode.color, mode.visible), []).append(mode.frequency_hz)
    for (row, color, visible), frequencies in kinds.items():
        half, width = (0.4, 1.8) if visible else (0.16, 0.9)
        at = rows.index(row) + 0.5
        reach = (at - half) / len(rows), (at + half) / len(rows)
        axes.ticks(np.array(frequencies), reach, color, width)
    left, top, _, height = axes.box
    step = height / len(rows)
    return "".join(
        text(left - 5.0, top + (number + 0.5) * step + 2.5, row, anchor="end", size=7.0)
        for number, row in enumerate(rows)
    )


def draw_magnitude(axes: Canvas, panel: FrfPanel, columns: int) -> None:
    """The curves' levels (dB), over the bands."""
    for band in panel.bands:
        starts = _evenly(panel.positions(panel.frequency), columns)
        axes.fill_between(
            panel.frequency[starts], np.minimum.reduceat(band.low, starts),
            np.maximum.reduceat(band.high, starts), color=band.color, alpha=band.alpha, lw=0.0,
            label=band.name, **({} if band.fitted else {"fitted": False}),
        )  # fmt: skip
    for curve in panel.curves:
        frequency = panel.frequency if curve.frequency is None else curve.frequency
        level = decibels(curve.values)
        at = extremes(panel.positions(frequency), level, columns)
        _plot(axes, frequency[at], level[at], curve)
    axes.set_ylabel(f"|{panel.symbol}| (dB re 1 {panel.unit})")


def _plot(axes: Canvas, x: FloatArray, y: FloatArray, curve: Curve) -> None:
    axes.plot(
        x, y, color=curve.color, linewidth=curve.width, linestyle=curve.dash if curve.width else "",
        marker=curve.marker, markersize=curve.size, dash_capstyle="butt", label=curve.name,
    )  # fmt: skip


def _draw_phase(axes: Axes, panel: FrfPanel, columns: int) -> None:
    """Phases, thinned evenly (their extremes would be nothing but the ends of the axis).

    From −270° to 90°: resonances pass through −90°, and −180° is not at the edge. Curves are drawn
    by how far they are off the first, so that a jump of one alone is none of the axis.
    """
    thin = _evenly(panel.positions(panel.frequency), columns)
    shown = [curve.values[thin] for curve in panel.curves]  # whose ratio may be beyond floats
    turns = [np.where(values == 0.0, np.nan, np.exp(1j * np.angle(values))) for values in shown]
    angle = np.degrees(np.angle(turns[0]))
    angle = np.where(angle > 90.0, angle - 360.0, angle)
    for curve, turn in zip(panel.curves, turns, strict=True):
        off = np.degrees(np.angle(turn * turns[0].conj()))
        frequency, phase = panel.frequency[thin], angle + off
        jumps = np.flatnonzero(np.abs(np.diff(phase)) > 180.0) + 1  # all the way round: no line
        at = np.insert(frequency, jumps, frequency[jumps])
        _plot(axes, at, np.insert(phase, jumps, np.nan), curve)
    axes.y = (-280.0, 100.0)
    axes.y_ticks = [(-270.0, "−270"), (-180.0, "−180"), (-90.0, "−90"), (0.0, "0"), (90.0, "90")]
    axes.set_ylabel("Phase (°)")


def _evenly(positions: FloatArray, columns: int) -> IndexArray:
    places = np.linspace(positions[0], positions[-1], columns)
    return np.unique(np.searchsorted(positions, places))


def _draw_difference(axes: Axes, panel: FrfPanel, shown: Difference, columns: int) -> None:
    if shown.logarithmic:
        _draw_decades(axes, panel, shown, columns)
    else:
        axes.across(0.0, MUTED, 0.7)
        most = LEAST_RANGE_DB
        for curve in shown.curves:
            frequency = panel.frequency if curve.frequency is None else curve.frequency
            at = extremes(panel.positions(frequency), curve.values, columns)
            _plot(axes, frequency[at], curve.values[at], curve)
            most = max(most, 1.1 * float(np.abs(curve.values[at]).max(initial=0.0)))
        axes.y = (-most, most)
    axes.set_ylabel(shown.label)


def _draw_decades(axes: Axes, panel: FrfPanel, shown: Difference, columns: int) -> None:
    positions = panel.positions(panel.frequency)
    lowest, highest = difference_decades(shown)
    for curve in shown.curves:
        at = largest(positions, curve.values, columns)
        _plot(axes, panel.frequency[at], np.maximum(curve.values[at], 10.0**lowest), curve)
    if not any((curve.values > 0.0).any() for curve in shown.curves):
        axes.note("no difference at any line")
    if shown.allowed is not None:
        # The smallest of each column: what lies above the line is beyond what is allowed there.
        limit = np.broadcast_to(shown.allowed, panel.frequency.shape)
        at = largest(positions, -limit, columns)
        axes.plot(panel.frequency[at], limit[at], color=VERMILLION, lw=1.0, ls="--")
    axes.decades(lowest, highest, most=4)


def difference_decades(shown: Difference) -> tuple[int, int]:
    """Whole decades that hold the values and what is allowed."""
    values = np.concatenate([curve.values for curve in shown.curves])
    positive = values[np.isfinite(values) & (values > 0.0)]
    allowed = 0.0 if shown.allowed is None else float(np.max(shown.allowed))
    top = max(float(positive.max(initial=0.0)), allowed)
    if top == 0.0:
        return LOWEST_ERROR + 2, LOWEST_ERROR + 6
    highest = ceil(log10(1.2 * top))
    lowest = floor(log10(float(positive.min(initial=top))))
    return min(max(lowest, highest - shown.decades, LOWEST_ERROR), highest - 2), highest


def _entries(panel: FrfPanel) -> list[LegendEntry]:
    """Legend entries: every name once."""
    differences = panel.differences
    curves = (*panel.curves, *(curve for each in differences for curve in each.curves))
    named: dict[str, Curve] = {}
    for curve in curves:
        named.setdefault(curve.name, curve)
    entries = [
        LegendEntry(
            name, curve.color, max(curve.width, 1.6) if curve.width else 0.0,
            "solid" if _takes_turns(curve.dash) else curve.dash, curve.marker, curve.size,
        )
        for name, curve in named.items()
        if name
    ]  # fmt: skip
    entries += [LegendEntry(band.name, band.color, 6.0) for band in panel.bands if band.name]
    if panel.marked is not None and panel.marked.lines.any():
        entries.append(LegendEntry(panel.marked.name, panel.marked.color, 9.0))
    if any(each.allowed is not None for each in differences):
        entries.append(LegendEntry("allowed", VERMILLION, 1.0, "--"))
    return entries


def _takes_turns(dash: Dash) -> bool:
    """Whether a pattern is there for curves that coincide, and says nothing by itself."""
    return not isinstance(dash, str) and dash[1][0] == DASH


def _legend_columns(entries: Sequence[LegendEntry], width: float) -> int:
    """As many columns as the longest entry leaves room for."""
    longest = max((len(entry.name) for entry in entries), default=1)
    return max(1, min(len(entries), int(width / (0.066 * longest + 0.62))))

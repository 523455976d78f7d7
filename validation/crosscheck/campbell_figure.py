"""The picture of a Campbell diagram.

Both axes are linear, so that an order is a straight line through the origin. Orders far below the
highest are drawn once more in a panel of their own, a zoom into the lowest frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mbs_models.gears.resonances import CLOSE, Crossing, Margin
from mbs_models.modal.mode_kinds import Kind, Mode

from ..report.figure import styled, svg
from ..report.style import (
    FLOOR_COLOR,
    INK,
    KIND_COLORS,
    MUTED,
    VERMILLION,
    WIDTH,
    spread,
)
from .resonances import Resonances

ZOOM = 15.0  # a panel's height over the highest order that is drawn again below it
ABOVE = 1.25  # a panel's height over its highest order
HEIGHT, ZOOMED_HEIGHT = 4.6, 2.8  # inches of the first panel, and of the others
LABEL_HEIGHT = 0.135  # inches from name to name at the right end
LEFT, RIGHT, GAP, TOP, BOTTOM = 0.75, 1.9, 0.3, 0.6, 0.5  # inches around the panels
PAPER: Mapping[str, Any] = {"fc": "white", "ec": "none", "pad": 0.6, "alpha": 0.85}

Dashes = str | tuple[float, tuple[float, ...]]


@dataclass(frozen=True)
class _Line:
    """A harmonic of an order: its name, frequency per rpm of the input, and how it is drawn."""

    name: str
    slope: float
    color: str
    dashes: Dashes
    width: float


@dataclass(frozen=True)
class _Panel:
    """Frequencies up to ``top``; those up to ``zoomed`` are drawn in the next panel (Hz)."""

    top: float
    zoomed: float
    labelled: tuple[_Line, ...]
    least_height: float

    @property
    def height(self) -> float:
        """Inches; every name finds room."""
        names = LABEL_HEIGHT * (len(self.labelled) + 1)
        return max(self.least_height, names)

    def holds(self, frequency: float) -> bool:
        """Whether what lies at a frequency is drawn here."""
        return self.zoomed <= frequency < self.top


def campbell_figure(found: Resonances, modes: Sequence[Mode]) -> str:
    """The diagram as an SVG element."""
    lines = tuple(_lines(found))
    elastic = [mode for mode in modes if mode.kind != Kind.RIGID_BODY]
    panels = _panels(lines, found.speed_range[1], [mode.frequency_hz for mode in elastic])
    total = sum(panel.height + GAP for panel in panels) - GAP + TOP + BOTTOM
    with styled():
        figure = Figure(figsize=(WIDTH, total))
        upper = total - TOP
        for panel in panels:
            box = (LEFT, upper - panel.height, WIDTH - LEFT - RIGHT, panel.height)
            size = (WIDTH, total, WIDTH, total)
            axes = figure.add_axes(tuple(np.divide(box, size)))
            _draw_panel(axes, panel, found, elastic, lines)
            upper -= panel.height + GAP
            if panel is not panels[-1]:
                axes.tick_params(labelbottom=False)
        _name_speed(figure.axes[0], found.speed_rpm)
        figure.axes[-1].set_xlabel(f"Speed of {found.operation.input} (rpm)")
        figure.align_ylabels()
        _legend(figure, panels, found, elastic)
        return svg(figure, "campbell", "Campbell diagram: natural frequencies, orders, crossings")


def _lines(found: Resonances) -> Iterator[_Line]:
    for order in found.orders:
        color = INK if order.rows else MUTED
        for harmonic in order.harmonics:
            yield _Line(
                name=order.label(harmonic),
                slope=order.frequency(harmonic, 1.0),
                color=color,
                dashes=_dashes(harmonic),
                width=1.4 if order.rows else 1.0,
            )


def _dashes(harmonic: int) -> Dashes:
    """Solid for the first harmonic; then a dash, and a dot for each one above the second."""
    return "solid" if harmonic == 1 else (0.0, (6.0, 2.0, *(1.0, 2.0) * (harmonic - 2)))


def _panels(lines: Sequence[_Line], last: float, natural: Sequence[float]) -> list[_Panel]:
    """The panels from the highest frequencies down; a zoom without a natural frequency is none."""
    ends = {line: line.slope * last for line in lines}
    tops = [ABOVE * max(ends.values())]
    while low := [end for end in ends.values() if end < tops[-1] / ZOOM]:
        top = ABOVE * max(low)
        if min(natural) >= top:
            break
        tops.append(top)
    zooms, heights = [*tops[1:], 0.0], [HEIGHT, *[ZOOMED_HEIGHT] * (len(tops) - 1)]
    return [
        _Panel(top, low, tuple(line for line in lines if _own(ends[line], top, low)), height)
        for top, low, height in zip(tops, zooms, heights, strict=True)
    ]


def _own(end: float, top: float, zoomed: float) -> bool:
    return zoomed / ABOVE * (1.0 + 1e-12) < end <= top


def _draw_panel(
    axes: Axes, panel: _Panel, found: Resonances, elastic: Sequence[Mode], lines: Sequence[_Line]
) -> None:
    first, last = found.speed_range
    axes.set_xlim(first, last)
    axes.set_ylim(0.0, panel.top)
    axes.set_ylabel("Frequency (Hz)")
    if panel.zoomed:
        axes.axhspan(0.0, panel.zoomed, color=FLOOR_COLOR, lw=0.0, zorder=0)
    for mode in elastic:
        if panel.holds(mode.frequency_hz):
            axes.axhline(mode.frequency_hz, color=KIND_COLORS[mode.kind], lw=0.8, alpha=0.55)
    for line in lines:
        faint = 1.0 if line in panel.labelled else 0.35
        axes.plot(
            [first, last],
            [line.slope * first, line.slope * last],
            color=line.color, ls=line.dashes, lw=line.width, alpha=faint,
        )  # fmt: skip
    for crossing in reversed(found.crossings):
        if panel.holds(crossing.frequency_hz):
            _draw_crossing(axes, crossing)
    _draw_operating_speed(axes, panel, found)
    _label_ends(axes, panel, last)


def _draw_crossing(axes: Axes, crossing: Crossing) -> None:
    """Filled where it is a resonance, hollow where phasing suppresses it, else nothing."""
    share = crossing.share if crossing.telling else crossing.energy
    face, edge, order = (VERMILLION, "white", 5) if crossing.telling else ("none", MUTED, 4)
    if crossing.telling or crossing.suppressed:
        axes.plot(
            [crossing.speed_rpm], [crossing.frequency_hz], "o", zorder=order, clip_on=False,
            ms=_marker_size(share), mfc=face, mec=edge, mew=0.7, alpha=0.9,
        )  # fmt: skip


def _marker_size(share: float) -> float:
    return 3.0 + 9.0 * math.sqrt(share)


def _draw_operating_speed(axes: Axes, panel: _Panel, found: Resonances) -> None:
    """The speed, what is within a tenth of it, and by how much each close resonance is off."""
    speed = found.speed_rpm
    if speed is None:
        return
    band = ((1.0 - CLOSE) * speed, (1.0 + CLOSE) * speed)
    axes.axvspan(*band, color=VERMILLION, alpha=0.08, lw=0.0, zorder=0)
    axes.axvline(speed, color=VERMILLION, lw=1.2, zorder=3)
    close = [margin for margin in found.close if panel.holds(margin.mode_hz)]
    points = [((1.0 + m.change) * speed, m.mode_hz, _margin_words(m)) for m in close]
    first, last = found.speed_range
    right = last - band[1] >= band[0] - first  # where there is more room
    if points:
        _label_points(axes, panel, points, band[1] if right else band[0], to_the_right=right)


def _name_speed(axes: Axes, speed: float | None) -> None:
    if speed is not None:
        axes.annotate(
            f"{speed:g} rpm ± {100.0 * CLOSE:g} %", (speed, 1.0), (0.0, 3.0),
            xycoords=("data", "axes fraction"), textcoords="offset points", ha="center",
        )  # fmt: skip


def _margin_words(margin: Margin) -> str:
    change = f"{100.0 * margin.change:+.1f} %".replace("-", "−")
    return f"{margin.order.label(margin.harmonic)}: {change}"


def _label_points(
    axes: Axes,
    panel: _Panel,
    points: Sequence[tuple[float, float, str]],
    at: float,
    *,
    to_the_right: bool,
) -> None:
    """A column of names at a speed, each with a leader to its point (speed, frequency)."""
    ascending = sorted(points, key=lambda point: point[1])
    heights = np.array([frequency / panel.top for _, frequency, _ in ascending])
    places = spread(heights, LABEL_HEIGHT / panel.height)
    for (speed, frequency, words), height in zip(ascending, places, strict=True):
        axes.annotate(
            words, (speed, frequency), (at, height), textcoords=("data", "axes fraction"),
            fontsize=7.5, va="center", ha="left" if to_the_right else "right", zorder=7, bbox=PAPER,
            arrowprops=_leader(INK, 0.0 if to_the_right else 1.0),
        )  # fmt: skip


def _label_ends(axes: Axes, panel: _Panel, last: float) -> None:
    """Names at the right end of a panel's own lines, with a leader where they are moved apart."""
    lines = sorted(panel.labelled, key=lambda line: line.slope)
    ends = np.array([line.slope * last / panel.top for line in lines])
    for line, end, at in zip(lines, ends, spread(ends, LABEL_HEIGHT / panel.height), strict=True):
        axes.annotate(
            line.name, (1.0, end), (1.03, at), xycoords="axes fraction",
            textcoords="axes fraction", color=line.color, fontsize=7.5, va="center",
            arrowprops=_leader(line.color, 0.0),
        )  # fmt: skip


def _leader(color: str, side: float) -> dict[str, Any]:
    """From a name's left (0) or right (1) end."""
    line = {"arrowstyle": "-", "color": color, "lw": 0.5, "shrinkA": 0.0, "shrinkB": 0.0}
    return line | {"relpos": (side, 0.5)}


def _legend(
    figure: Figure, panels: Sequence[_Panel], found: Resonances, elastic: Sequence[Mode]
) -> None:
    drawn = [mode.kind for mode in elastic if mode.frequency_hz < panels[0].top]
    entries: list[Artist] = [
        Line2D([], [], color=KIND_COLORS[kind], label=kind) for kind in dict.fromkeys(drawn)
    ]
    if any(crossing.telling for crossing in found.crossings):
        entries.append(_dot("excited", VERMILLION, "white"))
    if any(crossing.suppressed for crossing in found.crossings):
        entries.append(_dot("suppressed by planet phasing", "none", MUTED))
    if len(panels) > 1:
        entries.append(Patch(color=FLOOR_COLOR, label="drawn again below"))
    if entries:
        left = LEFT / WIDTH
        figure.legend(
            handles=entries, ncols=len(entries), loc="upper left", bbox_to_anchor=(left, 1.0),
            borderaxespad=0.2, handlelength=1.6, columnspacing=1.4,
        )  # fmt: skip


def _dot(label: str, face: str, edge: str) -> Line2D:
    return Line2D([], [], marker="o", ls="", ms=6.0, mfc=face, mec=edge, label=label)

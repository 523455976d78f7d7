"""The paper's figures, each part one picture: its modes, its curves, and their differences."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..report.curves import extremes, largest
from ..report.style import (
    INK,
    KIND_COLORS,
    MUTED,
    REFERENCE_COLOR,
    ROUTE_COLORS,
    WIDTH,
    decades,
    log_axis,
    svg,
)
from .results import Curve, Difference, Figure, FloatArray

HALF = 4.9  # inches; two pictures side by side
COLUMNS_PER_INCH = 100
DECADES = 8  # of the differences, below the largest one
DASHES: tuple[str | tuple[float, tuple[float, ...]], ...] = (
    "solid",
    (0.0, (5.0, 2.0)),
    (0.0, (1.2, 1.4)),
    (0.0, (7.0, 1.6, 1.4, 1.6)),
    (0.0, (3.0, 1.4)),
    (0.0, (9.0, 3.0)),
)
ONE_BY_ONE = re.compile(r"(\d+) left out")
WITNESS = "no mode left out"  # shows that nothing but the truncation is at work


@dataclass(frozen=True)
class Stroke:
    """How a curve is drawn; ``legend`` is empty where another curve's entry stands for it."""

    name: str
    legend: str
    color: str
    width: float
    dash: str | tuple[float, tuple[float, ...]] = "solid"


def draw(figure: Figure, *, wide: bool) -> str:
    """A part of a figure as SVG; to be called inside `style.styled`.

    Parameters
    ----------
    figure
        What to draw.
    wide
        Whether the picture has the page's width for itself; otherwise half of it.
    """
    strokes = _strokes(figure.curves)
    marks = _rows(figure)
    entries = [stroke for stroke in strokes if stroke.legend]
    width = WIDTH if wide else HALF
    columns = _legend_columns(entries, width)
    legend, axis = 0.08 + 0.143 * ceil(len(entries) / columns), 0.46
    heights = [0.135 * max(len(marks), 1), 2.1, 1.05]
    height = legend + sum(heights) + axis + 0.25
    picture = Picture(figsize=(width, height))
    strip, level, difference = picture.subplots(3, 1, sharex=True, height_ratios=heights)
    left = max(0.62, 0.16 + 0.056 * max((len(name) for name in marks), default=0))
    picture.subplots_adjust(
        left=left / width,
        right=1.0 - 0.27 / width,
        top=1.0 - legend / height,
        bottom=axis / height,
        hspace=0.07,
    )
    count = int(COLUMNS_PER_INCH * (width - left))
    _modes(strip, level, marks)
    _levels(level, figure, strokes, count)
    _differences(difference, figure, {stroke.name: stroke for stroke in strokes}, count)
    difference.set_xlim(0.0, figure.frequency[-1])
    difference.xaxis.set_major_formatter(FuncFormatter(lambda f, _: f"{f:,.0f}".replace(",", " ")))
    difference.set_xlabel("Frequency (Hz)")
    picture.legend(
        handles=[
            Line2D([], [], color=s.color, lw=s.width, ls=s.dash, label=s.legend) for s in entries
        ],
        loc="upper left",
        ncols=columns,
        handlelength=3.4,
        columnspacing=1.4,
        labelspacing=0.25,
        bbox_to_anchor=((left - 0.06) / width, 1.0),
        borderaxespad=0.0,
        borderpad=0.1,
    )
    return svg(picture, figure.id, f"{figure.place}: {figure.title}, by {len(strokes)} curves")


def _strokes(curves: Sequence[Curve]) -> list[Stroke]:
    """The first curve broad and grey, those of a series thin, every other in a style of its own."""
    first, *others = (curve.name for curve in curves)
    series = [name for name in others if ONE_BY_ONE.fullmatch(name)]
    named = [name for name in others if name not in (*series, WITNESS)]
    strokes = [Stroke(first, first.replace("'", "’"), REFERENCE_COLOR, 4.0)]
    if series:
        numbers = [int(name.split()[0]) for name in series]
        entry = f"{min(numbers)}, {min(numbers) + 1}, … {max(numbers)} left out, from the top"
        strokes += [
            Stroke(name, "" if number else entry, MUTED, 0.6) for number, name in enumerate(series)
        ]
    if WITNESS in others:
        strokes.append(Stroke(WITNESS, WITNESS, INK, 0.8, (0.0, (1.0, 3.0))))
    strokes += [
        Stroke(name, name.replace("'", "’"), color, 1.3, dash)
        for name, color, dash in zip(named, ROUTE_COLORS, DASHES, strict=False)
    ]
    return strokes


def _legend_columns(entries: Sequence[Stroke], width: float) -> int:
    """As many columns as the longest entry leaves room for."""
    longest = max(len(stroke.legend) for stroke in entries)
    return max(1, min(len(entries), int((width - 0.7) / (0.066 * longest + 0.62))))


def _rows(figure: Figure) -> dict[str, list[tuple[float, bool, str]]]:
    """Row of the strip → its modes: frequency, whether the FRF shows it, kind."""
    systems = {mark.system for mark in figure.resonances}
    rows: dict[str, list[tuple[float, bool, str]]] = {}
    for mark in figure.resonances:
        name = f"{mark.system}: {mark.kind}" if len(systems) > 1 else mark.kind
        rows.setdefault(str(name), []).append((mark.frequency_hz, mark.visible, mark.kind))
    return rows


def _modes(strip: Axes, level: Axes, rows: dict[str, list[tuple[float, bool, str]]]) -> None:
    """Long marks where this FRF shows a mode, short ones where a mode leaves it untouched."""
    for row, marks in enumerate(rows.values()):
        for frequency, visible, kind in marks:
            color, half = KIND_COLORS[kind], 0.4 if visible else 0.16
            width = 1.8 if visible else 0.9
            strip.vlines(frequency, row - half, row + half, color=color, linewidth=width)
            if visible:
                level.axvline(frequency, color=color, linewidth=0.6, alpha=0.45, zorder=0.5)
    strip.set_ylim(max(len(rows), 1) - 0.4, -0.6)
    strip.set_yticks(range(len(rows)), list(rows), fontsize=7.0)
    strip.tick_params(length=0.0, which="both", labelbottom=False)
    strip.spines[["left", "bottom"]].set_visible(False)
    strip.grid(visible=False, axis="x")


def _levels(axes: Axes, figure: Figure, strokes: Sequence[Stroke], columns: int) -> None:
    for curve, stroke in _in_order(figure.curves, strokes):
        with np.errstate(divide="ignore"):
            level = 20.0 * np.log10(np.abs(curve.values))
        at = extremes(figure.frequency, level, columns)
        _line(axes, figure.frequency[at], level[at], stroke)
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−")))
    axes.set_ylabel("|H| (dB re 1 m/N)")
    axes.tick_params(axis="x", labelbottom=False)


def _in_order(curves: Sequence[Curve], strokes: Sequence[Stroke]) -> Iterator[tuple[Curve, Stroke]]:
    """Curves with their strokes, in the strokes' order."""
    by_name = {curve.name: curve for curve in curves}
    return ((by_name[stroke.name], stroke) for stroke in strokes)


def _differences(axes: Axes, figure: Figure, strokes: dict[str, Stroke], columns: int) -> None:
    """|difference| of each curve to the first, in dB; scaled where the first one is zero."""
    in_decibel = any(np.isfinite(each.decibel).any() for each in figure.differences)
    found = {each.curve: _modulus(each, in_decibel) for each in figure.differences}
    lowest, highest = decades(list(found.values()))
    lowest = max(lowest, highest - DECADES)
    for name, stroke in strokes.items():
        if name in found:
            at = largest(figure.frequency, found[name], columns // 2)
            shown = np.maximum(found[name][at], 10.0**lowest)
            _line(axes, figure.frequency[at], shown, stroke)
    if not any((values > 0.0).any() for values in found.values()):
        axes.text(
            0.5, 0.5, "no difference at any line", color=INK, ha="center", transform=axes.transAxes
        )
    log_axis(axes, lowest, highest, most=4)
    axes.set_ylabel("|Difference| (dB)" if in_decibel else "|ΔH| / √(hᵢ hⱼ)")


def _modulus(difference: Difference, in_decibel: bool) -> FloatArray:
    values: FloatArray = np.abs(difference.decibel) if in_decibel else difference.scaled
    return values


def _line(axes: Axes, x: FloatArray, y: FloatArray, stroke: Stroke) -> None:
    axes.plot(x, y, color=stroke.color, linewidth=stroke.width, linestyle=stroke.dash)

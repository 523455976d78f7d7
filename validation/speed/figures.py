"""Figures of a speed study: curves over speed, waterfalls, maps of orders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import EngFormatter, FuncFormatter, MaxNLocator

from ..arrays import FloatArray
from ..report.figure import styled, svg
from ..report.style import (
    INK,
    MUTED,
    PART_COLORS,
    REFERENCE_COLOR,
    ROUTE_COLORS,
    VERMILLION,
    WIDTH,
    spread,
)
from .findings import SpeedRange

DASHES = ("solid", (0, (5, 1.5)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)))
COLOURS = "YlGnBu"  # pale where there is little
MAP_DECIBELS = 60.0  # below the largest line
RAY_DECIBELS = 40.0  # the same for rays
NAME_HEIGHT = 0.05  # of an axis: a line of text
MOST_ROWS = 14  # of an order map
UNSTABLE, PARTED = "#f6d3c0", "#fff0c4"


@dataclass(frozen=True)
class Mark:
    """A numbered peak on a curve."""

    number: int
    speed_rpm: float
    value: float


@dataclass(frozen=True)
class Shades:
    """Speed ranges that are shaded: unstable ones, and those where teeth part."""

    unstable: Sequence[SpeedRange] = ()
    parted: Sequence[SpeedRange] = ()


def curves_figure(
    name: str,
    title: str,
    rpm: FloatArray,
    curves: Mapping[str, FloatArray],
    label: str,
    *,
    unit: str = "",
    marks: Sequence[Mark] = (),
    shades: Shades = Shades(),
    floor_at: float | None = None,
) -> str:
    """Curves over the speed, as SVG.

    Parameters
    ----------
    name, title
        Prefix of the figure's ids, and what it shows.
    rpm
        (n,) speeds.
    curves
        Legend entry → (n,) values.
    label, unit
        Of the values; with a unit, numbers are given prefixes.
    marks
        Peaks, numbered as in the table.
    shades
        Ranges behind the curves.
    floor_at
        Where the axis begins; None: where the curves do.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
        axes = figure.subplots()
        _shade(axes, rpm, shades)
        for (legend, values), style in zip(curves.items(), _styles(len(curves)), strict=True):
            axes.plot(rpm, values, label=legend, lw=1.2, marker=_marker(rpm), ms=3, **style)
        for mark in marks:
            axes.annotate(
                str(mark.number), (mark.speed_rpm, mark.value), xytext=(0, 5),
                textcoords="offset points", ha="center", fontsize=7.5, fontweight="bold",
                color=INK,
            )  # fmt: skip
        _speed_axis(axes, rpm)
        axes.set_ylabel(label)
        if unit:
            axes.yaxis.set_major_formatter(EngFormatter(unit))
        if floor_at is not None:
            axes.set_ylim(bottom=floor_at)
        axes.margins(y=0.12)
        handles = axes.get_legend_handles_labels()[0] + _shade_handles(shades)
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
        return svg(figure, name, f"{title} over speed")


def _styles(count: int) -> list[dict[str, Any]]:
    """Colours first, then dashes: curves stay apart in grey too."""
    colours = len(ROUTE_COLORS)
    return [
        {"color": ROUTE_COLORS[i % colours], "ls": DASHES[(i // colours + i) % len(DASHES)]}
        for i in range(count)
    ]


def _marker(rpm: FloatArray) -> str:
    return "o" if len(rpm) < 30 else ""


def _speed_axis(axes: Axes, rpm: FloatArray, *, label: bool = True) -> None:
    first, last = float(rpm[0]), float(rpm[-1])
    if first == last:
        first, last = 0.9 * first, 1.1 * last
    axes.set_xlim(first, last)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda n, _: f"{n:,.6g}".replace(",", " ")))
    if label:
        axes.set_xlabel("Speed of the input (rpm)")


def _shade(axes: Axes, rpm: FloatArray, shades: Shades) -> None:
    half = 0.5 * float(np.median(np.diff(rpm))) if len(rpm) > 1 else 0.01 * float(rpm[0])
    for ranges, color in ((shades.parted, PARTED), (shades.unstable, UNSTABLE)):
        for reach in ranges:
            axes.axvspan(reach.first - half, reach.last + half, color=color, lw=0, zorder=0)


def _shade_handles(shades: Shades) -> list[Patch]:
    handles = []
    if shades.unstable:
        handles.append(Patch(color=UNSTABLE, label="unstable"))
    if shades.parted:
        handles.append(Patch(color=PARTED, label="teeth part"))
    return handles


@dataclass(frozen=True, eq=False)
class LineMap:
    """Amplitudes of lines over the speed.

    Attributes
    ----------
    title
        Of what.
    orders, names
        (n_line,) periods per turn of the input, and what each is.
    amplitude
        (n_speed, n_line).
    unit
        Of the amplitudes.
    """

    title: str
    orders: FloatArray
    names: Sequence[str]
    amplitude: FloatArray
    unit: str


def waterfall_figure(
    name: str, rpm: FloatArray, maps: Sequence[LineMap], natural: Mapping[float, str]
) -> str:
    """Every line as a ray over speed and frequency, coloured by its amplitude, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    rpm
        (n,) speeds.
    maps
        One below the other.
    natural
        Natural frequency (Hz) → the number of the peaks it makes.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 3.2 * len(maps)), layout="constrained", dpi=150)
        panels = figure.subplots(len(maps), 1, sharex=True, squeeze=False)[:, 0]
        for axes, shown in zip(panels, maps, strict=True):
            _draw_waterfall(figure, axes, rpm, shown, natural)
            _speed_axis(axes, rpm, label=axes is panels[-1])
        return svg(
            figure, name, f"Lines over speed and frequency: {', '.join(m.title for m in maps)}"
        )


def _draw_waterfall(
    figure: Figure, axes: Axes, rpm: FloatArray, shown: LineMap, natural: Mapping[float, str]
) -> None:
    level, top = _decibels(shown.amplitude)
    visible = np.flatnonzero((level > top - RAY_DECIBELS).any(axis=0))
    segments, colors = [], []
    for line in visible[np.argsort(level[:, visible].max(axis=0))]:  # the loudest on top
        points = np.column_stack([rpm, shown.orders[line] * rpm / 60.0])
        segments.append(np.stack([points[:-1], points[1:]], axis=1))
        colors.append(np.maximum(level[:-1, line], level[1:, line]))
    rays = LineCollection(
        list(np.concatenate(segments)), array=np.concatenate(colors), cmap=COLOURS, lw=2.2,
        capstyle="butt",
    )  # fmt: skip
    rays.set_clim(top - RAY_DECIBELS, top)
    rays.set_rasterized(True)
    axes.add_collection(rays)
    highest = float(shown.orders[visible].max() * rpm[-1] / 60.0)
    axes.set_ylim(0.0, 1.02 * highest)
    _draw_natural(axes, {f: name for f, name in natural.items() if f < highest}, highest)
    axes.set_ylabel("Frequency")
    axes.yaxis.set_major_formatter(EngFormatter("Hz"))
    axes.set_title(shown.title)
    bar = figure.colorbar(rays, ax=axes, pad=0.035, extend="min")
    bar.set_label(f"dB re 1 {shown.unit}")
    bar.outline.set_visible(False)


def _draw_natural(axes: Axes, natural: Mapping[float, str], highest: float) -> None:
    """Dashed lines at natural frequencies, with the numbers of their peaks beside them."""
    frequencies = np.array(sorted(natural))
    if not len(frequencies):
        return
    for frequency, height in zip(
        frequencies, spread(frequencies / (1.02 * highest), NAME_HEIGHT), strict=True
    ):
        axes.axhline(frequency, color=VERMILLION, lw=0.6, ls=(0, (4, 3)))
        axes.annotate(
            natural[frequency], (1.0, frequency), xycoords=("axes fraction", "data"),
            xytext=(1.02, height), textcoords="axes fraction", fontsize=7.0, va="center",
            color=VERMILLION, arrowprops={"arrowstyle": "-", "color": VERMILLION, "lw": 0.4},
        )  # fmt: skip


def order_map_figure(name: str, rpm: FloatArray, shown: LineMap) -> str:
    """The loudest lines as rows over the speed, coloured by amplitude, as SVG."""
    loudest = np.nanmax(shown.amplitude, axis=0)
    rows = np.argsort(-loudest)[:MOST_ROWS]
    rows = rows[loudest[rows] > loudest.max() * 10.0 ** (-MAP_DECIBELS / 20.0)]
    rows = rows[np.argsort(shown.orders[rows])]
    level, top = _decibels(shown.amplitude[:, rows])
    edges = _edges(rpm)
    with styled():
        figure = Figure(figsize=(WIDTH, 1.1 + 0.24 * len(rows)), layout="constrained", dpi=150)
        axes = figure.subplots()
        image = axes.pcolormesh(
            edges, np.arange(len(rows) + 1), np.maximum(level, top - MAP_DECIBELS).T,
            cmap=COLOURS, vmin=top - MAP_DECIBELS, vmax=top, rasterized=True,
        )  # fmt: skip
        axes.grid(visible=False)
        axes.set_yticks(
            np.arange(len(rows)) + 0.5,
            [f"{shown.names[row]}  ({shown.orders[row]:.5g})" for row in rows],
        )
        axes.tick_params(axis="y", length=0)
        _speed_axis(axes, rpm)
        axes.set_title(shown.title)
        bar = figure.colorbar(image, ax=axes, pad=0.015, extend="min")
        bar.set_label(f"dB re 1 {shown.unit}")
        bar.outline.set_visible(False)
        return svg(figure, name, f"Orders over speed: {shown.title}")


def _decibels(amplitude: FloatArray) -> tuple[FloatArray, float]:
    """Levels (dB), and the highest."""
    values = np.nan_to_num(amplitude)
    level = 20.0 * np.log10(np.maximum(values, np.finfo(float).tiny))
    return level, float(level.max(initial=-300.0))


def _edges(rpm: FloatArray) -> FloatArray:
    """Borders of the columns around every speed."""
    if len(rpm) == 1:
        return np.array([0.9 * rpm[0], 1.1 * rpm[0]])
    middles = 0.5 * (rpm[:-1] + rpm[1:])
    first, last = 1.5 * rpm[0] - 0.5 * rpm[1], 1.5 * rpm[-1] - 0.5 * rpm[-2]
    edges: FloatArray = np.concatenate([[first], middles, [last]])
    return edges


def growth_figure(name: str, rpm: FloatArray, growth: FloatArray, shades: Shades) -> str:
    """Growth of the fastest growing motion over the speed, as SVG."""
    with styled():
        figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        _shade(axes, rpm, shades)
        axes.axhline(0.0, color=MUTED, lw=0.8)
        axes.plot(rpm, growth, color=PART_COLORS[0], lw=1.2, marker=_marker(rpm), ms=3)
        _speed_axis(axes, rpm)
        axes.set_ylabel("Growth rate (1/s)")
        axes.yaxis.set_major_locator(MaxNLocator(5))
        return svg(figure, name, "Growth rate of the fastest growing motion over speed")


def reference_figure(
    name: str,
    frequency: FloatArray,
    channels: Mapping[str, tuple[FloatArray, FloatArray]],
    unit: str,
) -> str:
    """Amplitudes of lines by both routes, channel below channel, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    frequency
        (n_line,) Hz.
    channels
        Title → amplitudes by harmonic balance and from exudyn, NaN where they are not compared.
    unit
        Of the amplitudes.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 0.6 + 1.9 * len(channels)), layout="constrained")
        panels = figure.subplots(len(channels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (title, (balance, time)) in zip(panels, channels.items(), strict=True):
            axes.vlines(frequency, 0.0, balance, color=REFERENCE_COLOR, lw=3.0)
            axes.plot(frequency, balance, "o", ms=7, mfc="none", mec=ROUTE_COLORS[0], mew=1.2)
            axes.plot(frequency, time, "x", ms=5, color=ROUTE_COLORS[1], mew=1.2)
            axes.set_title(title)
            axes.set_ylim(bottom=0.0)
            axes.yaxis.set_major_formatter(EngFormatter(unit))
            axes.yaxis.set_major_locator(MaxNLocator(4))
        panels[-1].xaxis.set_major_formatter(EngFormatter("Hz"))
        panels[-1].set_xlim(left=0.0)
        handles = [
            Line2D(
                [], [], ls="", marker="o", mfc="none", mec=ROUTE_COLORS[0], label="harmonic balance"
            ),
            Line2D([], [], ls="", marker="x", color=ROUTE_COLORS[1], label="exudyn in time"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
        return svg(figure, name, f"Amplitudes by two routes: {', '.join(channels)}")

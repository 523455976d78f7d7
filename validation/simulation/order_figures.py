"""The spectrum of a turning gearbox: mesh harmonics and sidebands, each with its name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from mbs_models.gears.gear_lines import MeasuredLine

from ..arrays import FloatArray
from ..report.figure import log_axis, styled, svg
from ..report.style import (
    BLUE,
    INK,
    MUTED,
    ORANGE,
    REFERENCE_COLOR,
    VERMILLION,
    WIDTH,
    spread,
)
from .record_figures import draw_spectrum, spectrum_decades

LABEL_WIDTH, ZOOM_LABEL_WIDTH = 0.013, 0.03  # of an axis: a label on its side
LABEL_SIZE = 6.5  # points
CHARACTER = 0.62 * LABEL_SIZE / 72.0  # inches, wide ones too
LEADER = 0.22  # inches from the highest curve to the labels
WHOLE, ZOOM = 3.4, 2.7  # inches the panels are high; DECORATION of it are titles and ticks
DECORATION = 0.6
ZOOM_COLUMNS = 2
FAINT = 1e-3  # of the largest line: the whole spectrum leaves fainter sidebands to the zooms
BEYOND = 1.7  # turns of the carrier a zoom reaches beyond its last sideband


@dataclass(frozen=True, eq=False)
class Theory:
    """Where lines should be, and how large: (n,) Hz and amplitudes."""

    frequency: FloatArray
    amplitude: FloatArray


def order_figure(
    name: str,
    frequency: FloatArray,
    amplitude: FloatArray,
    lines: Sequence[MeasuredLine],
    unit: str,
    title: str,
    *,
    theory: Theory | None = None,
) -> str:
    """A spectrum with its lines marked, and a zoom on each mesh harmonic with sidebands, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    frequency, amplitude
        (nf,) Hz, uniform, and amplitudes.
    lines
        Named lines read out of it.
    unit, title
        Of the amplitudes, and of the figure.
    theory
        What the lines should be, if known.
    """
    zooms = _with_sidebands(lines)
    rows = ceil(len(zooms) / ZOOM_COLUMNS)
    with styled():
        figure = Figure(figsize=(WIDTH, WHOLE + ZOOM * rows), layout="constrained")
        grid = figure.add_gridspec(1 + rows, ZOOM_COLUMNS, height_ratios=[WHOLE] + [ZOOM] * rows)
        whole = figure.add_subplot(grid[0, :])
        _draw_whole(whole, frequency, amplitude, lines, unit)
        figure.suptitle(title, x=0.01, ha="left", fontsize=9.0, fontweight="bold")
        decades = spectrum_decades(amplitude)
        for number, zoom in enumerate(zooms):
            axes = figure.add_subplot(grid[1 + number // ZOOM_COLUMNS, number % ZOOM_COLUMNS])
            _draw_zoom(axes, frequency, amplitude, zoom, decades, theory)
            if number % ZOOM_COLUMNS == 0:
                axes.set_ylabel(unit)
            if number >= len(zooms) - ZOOM_COLUMNS:
                axes.set_xlabel("Frequency (Hz)")
        figure.legend(
            handles=_handles(bool(zooms), theory is not None), loc="outside upper right", ncols=4
        )
        return svg(figure, name, f"Spectrum of {title} with mesh harmonics and sidebands marked")


def _with_sidebands(lines: Sequence[MeasuredLine]) -> list[list[MeasuredLine]]:
    """The lines of each mesh harmonic that has sidebands."""
    groups: dict[tuple[str, int], list[MeasuredLine]] = {}
    for line in lines:
        groups.setdefault((line.line.tone.name, line.line.harmonic), []).append(line)
    return [group for group in groups.values() if len(group) > 1]


def _handles(sidebands: bool, theory: bool) -> list[Line2D]:
    handles = [Line2D([], [], color=BLUE, lw=0, marker="o", ms=4, label="mesh harmonic")]
    if sidebands:
        handles.append(Line2D([], [], color=ORANGE, lw=0, marker="o", ms=4, label="sideband"))
    if sidebands and theory:
        handles.append(
            Line2D([], [], mec=VERMILLION, mfc="none", lw=0, marker="o", ms=8, label="theory")
        )
    return handles


def _draw_whole(
    axes: Axes,
    frequency: FloatArray,
    amplitude: FloatArray,
    lines: Sequence[MeasuredLine],
    unit: str,
) -> None:
    draw_spectrum(axes, frequency, amplitude, REFERENCE_COLOR)
    lowest, _ = spectrum_decades(amplitude)
    least = FAINT * max((x.amplitude for x in lines), default=0.0)
    drawn = [x for x in lines if not x.line.offset or x.amplitude >= least]
    _draw_lines(axes, drawn, 10.0**lowest, 3.0)
    axes.set_xlim(float(frequency[0]), float(frequency[-1]))
    axes.set_xlabel("Frequency (Hz)")
    axes.set_ylabel(unit)
    harmonics = [line for line in lines if line.line.offset == 0]
    _draw_labels(
        axes, [x.line.frequency for x in harmonics], [x.amplitude for x in harmonics],
        [x.name for x in harmonics], LABEL_WIDTH, WHOLE - DECORATION,
    )  # fmt: skip


def _draw_zoom(
    axes: Axes,
    frequency: FloatArray,
    amplitude: FloatArray,
    lines: Sequence[MeasuredLine],
    decades: tuple[int, int],
    theory: Theory | None,
) -> None:
    passing = abs(lines[0].line.tone.carrier_frequency)
    first, last = (
        lines[0].line.frequency - BEYOND * passing,
        lines[-1].line.frequency + BEYOND * passing,
    )
    shown = (frequency >= first) & (frequency <= last)
    lowest, highest = decades
    axes.plot(
        frequency[shown], np.maximum(amplitude[shown], 10.0**lowest), color=REFERENCE_COLOR, lw=0.9
    )
    if theory is not None:
        near = (theory.frequency >= first) & (theory.frequency <= last)
        near &= theory.amplitude > 10.0**lowest
        axes.plot(
            theory.frequency[near], theory.amplitude[near], "o", ms=8, mfc="none", mec=VERMILLION,
            mew=0.9,
        )  # fmt: skip
    _draw_lines(axes, lines, 10.0**lowest, 3.6)
    log_axis(axes, lowest, highest, most=4)
    axes.set_xlim(first, last)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.7g}"))
    axes.set_title(f"{lines[0].line.harmonic}·{lines[0].line.tone.name}", fontsize=8.0)
    _draw_labels(
        axes, [x.line.frequency for x in lines], [x.amplitude for x in lines],
        [_short(x) for x in lines], ZOOM_LABEL_WIDTH, ZOOM - DECORATION,
    )  # fmt: skip


def _short(line: MeasuredLine) -> str:
    """What follows the mesh harmonic in the name: "− 1·planet pass"; "mesh" where nothing does."""
    if not line.line.offset:
        return "mesh"
    return line.name.removeprefix(f"{line.line.harmonic}·{line.line.tone.name} ")


def _draw_lines(axes: Axes, lines: Sequence[MeasuredLine], lowest: float, size: float) -> None:
    for sidebands, color in ((True, ORANGE), (False, BLUE)):
        shown = [x for x in lines if bool(x.line.offset) == sidebands and x.amplitude > lowest]
        if shown:
            at = [x.line.frequency for x in shown]
            amplitude = [x.amplitude for x in shown]
            axes.vlines(at, lowest, amplitude, color=color, lw=0.9)
            axes.plot(at, amplitude, "o", color=color, ms=size)


def _draw_labels(
    axes: Axes,
    frequency: Sequence[float],
    amplitude: Sequence[float],
    labels: Sequence[str],
    width: float,
    height: float,
) -> None:
    """Labels on their side above the axes' curves, moved apart, each tied to its line.

    The axis, ``height`` inches high, is stretched upwards to make room: nothing is covered.
    """
    if not labels:
        return
    low, high = axes.get_ylim()
    first, last = axes.get_xlim()
    gap = LEADER / height
    room = gap + CHARACTER * max(map(len, labels)) / height
    axes.set_ylim(low, low * (high / low) ** (1.0 / (1.0 - room)))
    wanted = (np.asarray(frequency) - first) / (last - first)
    for x, at, value, label in zip(
        spread(wanted, width), frequency, amplitude, labels, strict=True
    ):
        axes.annotate(
            label,
            (at, max(value, low)),
            xytext=(float(x), 1.0 - room + gap),
            textcoords="axes fraction",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=LABEL_SIZE,
            color=INK,
            arrowprops={"arrowstyle": "-", "color": MUTED, "lw": 0.4, "shrinkA": 0, "shrinkB": 3},
        )

"""Figures of a record: time history, spectrum, spectrogram, RMS of the bodies, mesh forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor, log10, sqrt

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, FuncFormatter, MaxNLocator

from mbs_models.gears.gear_response import MeshLoad

from ..arrays import FloatArray
from ..report.curves import extremes
from ..report.digits import engineering
from ..report.figure import (
    frequency_axis,
    log_axis,
    styled,
    svg,
)
from ..report.style import (
    BLUE,
    CURVE_COLUMNS,
    MUTED,
    PART_COLORS,
    REFERENCE_COLOR,
    VERMILLION,
    WIDTH,
    along_axis,
    part_colors,
)

ROW = 1.35  # inches a panel is high
MOST_DECADES = 12  # of a spectrum below its peak: double precision has no more to show
MAP_COLUMNS, MAP_ROWS = 1000, 400
DYNAMIC_RANGE_DB = 80.0


def history_figure(
    name: str, time: FloatArray, channels: Mapping[str, FloatArray], unit: str
) -> str:
    """Time histories below each other, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    time
        (n,) ascending (s).
    channels
        Title → (n,) samples; of many samples the smallest and largest of each column are drawn.
    unit
        Of the samples.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 0.45 + ROW * len(channels)), layout="constrained")
        panels = figure.subplots(len(channels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (title, values) in zip(panels, channels.items(), strict=True):
            draw_history(axes, time, values, unit)
            axes.set_title(title)
        panels[-1].set_xlabel("Time (s)")
        return svg(figure, name, f"Time history of {', '.join(channels)}")


def draw_history(axes: Axes, time: FloatArray, values: FloatArray, unit: str) -> None:
    """The band that a channel fills, or its line where it has few samples."""
    if len(values) <= 2 * CURVE_COLUMNS:
        axes.plot(time, values, color=BLUE, lw=0.8)
    else:
        starts = np.linspace(0, len(values), CURVE_COLUMNS, endpoint=False, dtype=int)
        low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
        axes.fill_between(time[starts], low, high, color=BLUE, lw=0.4)
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.yaxis.set_major_formatter(EngFormatter(unit))
    axes.yaxis.set_major_locator(MaxNLocator(4))


def spectrum_figure(
    name: str,
    frequency: FloatArray,
    channels: Mapping[str, FloatArray],
    unit: str,
    *,
    natural: Sequence[float] = (),
) -> str:
    """Spectra below each other on a logarithmic scale, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    frequency
        (nf,) Hz; a logarithmic axis where it starts above 0 and spans more than a decade.
    channels
        Title → (nf,) amplitudes or densities.
    unit
        Of the values.
    natural
        Natural frequencies (Hz), marked.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 0.45 + 1.5 * ROW * len(channels)), layout="constrained")
        panels = figure.subplots(len(channels), 1, sharex=True, squeeze=False)[:, 0]
        inside = [f for f in natural if frequency[0] <= f <= frequency[-1]]
        for axes, (title, values) in zip(panels, channels.items(), strict=True):
            for line in inside:
                axes.axvline(line, color=REFERENCE_COLOR, lw=0.7)
            draw_spectrum(axes, frequency, values, BLUE)
            axes.set_title(title)
            axes.set_ylabel(unit)
            frequency_axis(axes, frequency[0], frequency[-1], label=axes is panels[-1])
        if inside:
            lines = Line2D([], [], color=REFERENCE_COLOR, lw=0.9, label="natural frequencies")
            figure.legend(handles=[lines], loc="outside upper right")
        return svg(figure, name, f"Spectrum of {', '.join(channels)}")


def draw_spectrum(axes: Axes, frequency: FloatArray, values: FloatArray, color: str) -> None:
    """One spectrum and its decades."""
    lowest, highest = spectrum_decades(values)
    at = extremes(along_axis(frequency), values, CURVE_COLUMNS)
    axes.plot(frequency[at], np.maximum(values[at], 10.0**lowest), color=color, lw=0.9)
    log_axis(axes, lowest, highest, most=5)


def spectrum_decades(values: FloatArray) -> tuple[int, int]:
    """Whole decades around the values, at most ``MOST_DECADES``."""
    positive = values[values > 0.0]
    if not len(positive):
        return -1, 0
    highest = ceil(log10(1.05 * positive.max()))
    return max(min(floor(log10(positive.min())), highest - 2), highest - MOST_DECADES), highest


def spectrogram_figure(
    name: str, time: FloatArray, frequency: FloatArray, values: FloatArray, unit: str, title: str
) -> str:
    """Amplitudes over time and frequency, dB re 1 unit down to 80 dB below the largest, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    time, frequency
        (nt,) s and (nf,) Hz, uniform.
    values
        (nt, nf) amplitudes.
    unit, title
        Of the values, and of the figure.
    """
    shown = _coarser(_coarser(values, MAP_COLUMNS).T, MAP_ROWS)
    peak = float(shown.max())
    level = 20.0 * np.log10(np.maximum(shown, np.finfo(float).tiny))
    top = 20.0 * log10(peak) if peak > 0.0 else 0.0
    with styled():
        figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
        axes = figure.subplots()
        half_t, half_f = _half_step(time), _half_step(frequency)
        image = axes.imshow(
            level,
            origin="lower",
            aspect="auto",
            interpolation="nearest",
            cmap="viridis",
            vmin=top - DYNAMIC_RANGE_DB,
            vmax=top,
            extent=(time[0] - half_t, time[-1] + half_t, frequency[0], frequency[-1] + half_f),
        )
        axes.grid(visible=False)
        axes.set_title(title)
        axes.set_xlabel("Time (s)")
        axes.set_ylabel("Frequency (Hz)")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda f, _: f"{f:,.6g}".replace(",", " ")))
        bar = figure.colorbar(image, ax=axes, pad=0.015, extend="min")
        bar.set_label(f"dB re 1 {unit}")
        bar.outline.set_visible(False)
        return svg(figure, name, f"Spectrogram of {title}")


def _half_step(axis: FloatArray) -> float:
    return float(axis[1] - axis[0]) / 2.0 if len(axis) > 1 else 0.5


def _coarser(values: FloatArray, most: int) -> FloatArray:
    """At most so many rows, each the largest of those it stands for: no line is lost."""
    if len(values) <= most:
        return values
    starts = np.linspace(0, len(values), most, endpoint=False, dtype=int)
    return np.asarray(np.maximum.reduceat(values, starts, axis=0))


def rms_figure(name: str, rms: Mapping[str, Mapping[str, float]], unit: str) -> str:
    """RMS of every body, and a dot for each of its DoFs, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    rms
        Body → DoF → RMS; the bar is the root of the sum of squares.
    unit
        Of the values.
    """
    totals = {body: sqrt(sum(v**2 for v in dofs.values())) for body, dofs in rms.items()}
    stages = list(dict.fromkeys(body.partition(".")[0] for body in rms))
    shades = part_colors(stages)
    dofs = list(dict.fromkeys(dof for own in rms.values() for dof in own))
    with styled():
        figure = Figure(figsize=(WIDTH, 0.9 + 0.24 * len(rms)), layout="constrained")
        axes = figure.subplots()
        for row, (body, total) in enumerate(totals.items()):
            shade = shades[body.partition(".")[0]]
            axes.barh(row, total, 0.66, color=shade, alpha=0.45)
            axes.annotate(
                engineering(total, unit), (total, row), xytext=(7, 0), textcoords="offset points",
                va="center", fontsize=7.5,
            )  # fmt: skip
        for number, dof in enumerate(dofs):
            dots = [(v[dof], row) for row, v in enumerate(rms.values()) if dof in v]
            axes.plot(
                *np.transpose(dots), _MARKERS[number % len(_MARKERS)], ms=4.5, mec="white",
                mew=0.5, color=PART_COLORS[-1 - number % len(PART_COLORS)], label=dof, zorder=3,
            )  # fmt: skip
        axes.set_yticks(range(len(rms)), list(rms))
        axes.set_ylim(len(rms) - 0.4, -0.6)
        axes.set_xlim(0.0, 1.12 * max([*totals.values(), np.finfo(float).tiny]))
        axes.xaxis.set_major_formatter(EngFormatter(unit))
        axes.grid(visible=False, axis="y")
        axes.set_xlabel("RMS about the mean (bars: all DoFs of a body)")
        figure.legend(loc="outside upper right", ncols=len(dofs), handletextpad=0.1)
        return svg(figure, name, "RMS of every body")


_MARKERS = ("o", "s", "D", "^", "v", "P")


def mesh_figure(name: str, time: FloatArray, forces: FloatArray, loads: Sequence[MeshLoad]) -> str:
    """Force of every mesh with its mean, dynamic factor and loss of contact, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    time
        (n,) s.
    forces
        (n, n_mesh) N, columns as ``loads``: all of them, or a few mesh periods.
    loads
        What was found in all of them.
    """
    columns = min(3, len(loads))
    rows = ceil(len(loads) / columns)
    with styled():
        figure = Figure(figsize=(WIDTH, 0.45 + 1.25 * ROW * rows), layout="constrained")
        panels = list(figure.subplots(rows, columns, sharex=True, squeeze=False).flat)
        for axes, load, force in zip(panels, loads, forces.T, strict=False):
            draw_history(axes, 1e3 * (time - time[0]), force, "N")
            axes.axhline(load.mean, color=VERMILLION, lw=1.0, ls="--")
            if min(force.min(), 0.0) < 0.0 < max(force.max(), 0.0) or load.open_share:
                axes.axhline(0.0, color=MUTED, lw=0.7)
            axes.set_title(f"{load.name}\n{_described(load)}", fontsize=8.0)
        for number, axes in enumerate(panels):
            axes.set_visible(number < len(loads))
        for axes in panels[max(len(loads) - columns, 0) : len(loads)]:
            axes.set_xlabel(f"Time from {time[0]:.4g} s on (ms)")
            axes.tick_params(labelbottom=True)
        mean = Line2D([], [], color=VERMILLION, lw=1.0, ls="--", label="mean")
        figure.legend(handles=[mean], loc="outside upper right")
        return svg(figure, name, "Force of every mesh over time")


def _described(load: MeshLoad) -> str:
    """Mean, dynamic factor and loss of contact in few words."""
    words = [f"mean {engineering(load.mean, 'N')}"]
    if load.dynamic_factor is not None:
        words.append(f"max/mean {load.dynamic_factor:.3g}")
    if load.open_share:
        words.append(f"open {100.0 * load.open_share:.2g} %")
    if load.reversed_share and load.dynamic_factor is not None:
        words.append(f"reversed {100.0 * load.reversed_share:.2g} %")
    return ", ".join(words)

"""Figures of FRFs from runs: beside a reference, held from a sweep, and over the drive level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

from ..report.curves import extremes, largest
from ..report.digits import engineering
from ..report.style import (
    BLUE,
    CURVE_COLUMNS,
    ERROR_COLUMNS,
    MUTED,
    REFERENCE_COLOR,
    VERMILLION,
    WIDTH,
    along_axis,
    frequency_axis,
    log_axis,
    styled,
    svg,
)

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LEAST_DB, LEAST_DEGREES = 1e-6, 1e-6  # of the error axes: round-off lies on the edge
MOST_DECADES = 6  # of an error axis


@dataclass(frozen=True, eq=False)
class FrfPair:
    """An FRF from a run beside its reference.

    Attributes
    ----------
    title
        "response ← excitation".
    estimate, reference
        (nf,) complex, of one unit.
    compared
        (nf,) lines on which the two are compared; all if None.
    """

    title: str
    estimate: ComplexArray
    reference: ComplexArray
    compared: NDArray[np.bool_] | None = None


@dataclass(frozen=True, eq=False)
class LevelCurve:
    """An FRF at one drive level.

    Attributes
    ----------
    force
        N.
    frf
        (nf,) complex; None where the motion diverged.
    worst_db, median_db
        How far it is off the reference; infinite where it diverged.
    """

    force: float
    frf: ComplexArray | None
    worst_db: float
    median_db: float


def frf_figure(
    name: str,
    frequency: FloatArray,
    pair: FrfPair,
    unit: str,
    *,
    names: tuple[str, str] = ("exudyn in time", "FBS"),
    allowed: tuple[FloatArray | float, FloatArray | float] = (0.1, 1.0),
) -> str:
    """Magnitude, phase and the errors of both of an estimated FRF, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    frequency
        (nf,) Hz.
    pair
        The two FRFs.
    unit
        Of the FRFs: "m/N".
    names
        Of the estimate and of the reference.
    allowed
        dB and degrees, drawn as lines.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 5.6), layout="constrained")
        panels = figure.subplots(4, 1, sharex=True, height_ratios=(3.0, 1.5, 1.4, 1.4))
        magnitude, phase, decibels, degrees = panels
        _draw_magnitudes(magnitude, frequency, pair, unit)
        _draw_phases(phase, frequency, pair)
        ratio = _ratio(pair)
        _draw_error(
            decibels, frequency, np.abs(_decibels(ratio)), allowed[0], LEAST_DB, "Error (dB)"
        )
        _draw_error(
            degrees, frequency, np.degrees(np.abs(np.angle(ratio))), allowed[1], LEAST_DEGREES,
            "Error (°)",
        )  # fmt: skip
        for axes in panels:
            frequency_axis(axes, frequency[0], frequency[-1], label=axes is degrees)
        figure.suptitle(pair.title, x=0.01, ha="left", fontsize=9.0, fontweight="bold")
        handles = [
            Line2D([], [], color=REFERENCE_COLOR, lw=3.5, label=names[1]),
            Line2D([], [], color=BLUE, lw=1.6, label=names[0]),
            Line2D([], [], color=VERMILLION, lw=1.0, ls="--", label="allowed"),
        ]
        figure.legend(handles=handles, loc="outside upper right", ncols=3)
        return svg(figure, name, f"FRF {pair.title} by {names[0]} and by {names[1]}")


def _ratio(pair: FrfPair) -> ComplexArray:
    """Estimate over reference; not a number on lines not compared."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = pair.estimate / pair.reference
    if pair.compared is not None:
        ratio = np.where(pair.compared, ratio, np.nan)
    return np.asarray(ratio)


def _draw_magnitudes(axes: Axes, frequency: FloatArray, pair: FrfPair, unit: str) -> None:
    reference, estimate = _decibels(pair.reference), _decibels(pair.estimate)
    at = extremes(along_axis(frequency), reference, CURVE_COLUMNS)
    axes.plot(frequency[at], reference[at], color=REFERENCE_COLOR, lw=3.5)
    at = extremes(along_axis(frequency), estimate, CURVE_COLUMNS)
    axes.plot(frequency[at], estimate[at], color=BLUE, lw=1.0)
    axes.set_ylabel(f"dB re 1 {unit}")


def _draw_phases(axes: Axes, frequency: FloatArray, pair: FrfPair) -> None:
    """Phases, thinned evenly (their extremes would be nothing but the ends of the axis)."""
    position = along_axis(frequency)
    columns = np.linspace(position[0], position[-1], CURVE_COLUMNS)
    thin = np.unique(np.searchsorted(position, columns))
    reference = _phase(pair.reference[thin])
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.degrees(np.angle(pair.estimate[thin] / pair.reference[thin]))
    for angle, color, width in ((reference, REFERENCE_COLOR, 3.5), (reference + off, BLUE, 1.0)):
        jumps = np.flatnonzero(np.abs(np.diff(angle)) > 180.0) + 1  # all the way round: no line
        at = np.insert(frequency[thin], jumps, frequency[thin][jumps])
        axes.plot(at, np.insert(angle, jumps, np.nan), color=color, lw=width)
    axes.set_ylim(-280.0, 100.0)
    axes.set_yticks([-270.0, -180.0, -90.0, 0.0, 90.0])
    axes.set_ylabel("Phase (°)")


def _phase(values: ComplexArray) -> FloatArray:
    """Phase from -270° to 90°: resonances pass through -90°, and -180° is not at the edge."""
    angle = np.degrees(np.angle(values))
    return np.asarray(np.where(angle > 90.0, angle - 360.0, angle))


def _draw_error(
    axes: Axes,
    frequency: FloatArray,
    error: FloatArray,
    allowed: FloatArray | float,
    least: float,
    label: str,
) -> None:
    finite = error[np.isfinite(error)]
    limit = np.broadcast_to(allowed, error.shape)
    top = max(float(finite.max(initial=least)), float(limit.max()))
    highest = ceil(log10(1.5 * top))
    low = max(float(finite.min(initial=top)), least)
    lowest = max(min(floor(log10(low)), highest - 2), highest - MOST_DECADES)
    at = largest(along_axis(frequency), error, ERROR_COLUMNS)
    axes.plot(
        frequency[at], np.maximum(error[at], 10.0**lowest), ".", color=BLUE, ms=2.4, clip_on=False
    )
    # The smallest of each column: what lies above the line is beyond what is allowed there.
    at = largest(along_axis(frequency), -limit, ERROR_COLUMNS)
    axes.plot(frequency[at], limit[at], color=VERMILLION, lw=1.0, ls="--")
    log_axis(axes, lowest, highest, most=4)
    axes.set_ylabel(label)


def peak_hold_figure(
    name: str,
    held_frequency: FloatArray,
    held: FloatArray,
    frequency: FloatArray,
    frf: ComplexArray,
    unit: str,
    title: str,
    *,
    predicted: tuple[FloatArray, FloatArray] | None = None,
) -> str:
    """A sweep's peak-hold over the FRF, their difference below, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    held_frequency, held
        (n,) Hz, ascending, and the largest |y|/F held there.
    frequency, frf
        (nf,) Hz and the FRF; the difference is taken at the held lines, between its lines linearly
        in dB.
    unit, title
        Of the FRF, and of the figure.
    predicted
        Frequencies (Hz) and magnitudes of the peaks as the sweep's rate should leave them.
    """
    with styled():
        figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
        magnitude, difference = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1.0))
        level, held_level = _decibels(frf), 20.0 * np.log10(held)
        at = extremes(along_axis(frequency), level, CURVE_COLUMNS)
        magnitude.plot(frequency[at], level[at], color=REFERENCE_COLOR, lw=3.5, label="FRF")
        magnitude.plot(
            held_frequency, held_level, color=BLUE, lw=1.0, marker=".", ms=2.5,
            label="peak-hold of the sweep",
        )  # fmt: skip
        if predicted is not None:
            magnitude.plot(
                predicted[0], 20.0 * np.log10(predicted[1]), "x", color=VERMILLION, ms=7, mew=1.4,
                label="peaks at this sweep rate (theory)",
            )  # fmt: skip
        magnitude.set_ylabel(f"dB re 1 {unit}")
        figure.suptitle(title, x=0.01, ha="left", fontsize=9.0, fontweight="bold")
        figure.legend(loc="outside upper right", ncols=3)
        difference.axhline(0.0, color=MUTED, lw=0.7)
        difference.plot(
            held_frequency, held_level - np.interp(held_frequency, frequency, level), color=BLUE,
            lw=1.0,
        )  # fmt: skip
        difference.set_ylabel("Difference (dB)")
        for axes in (magnitude, difference):
            frequency_axis(axes, frequency[0], frequency[-1], label=axes is difference)
        return svg(figure, name, f"Peak-hold of a sweep over the FRF {title}")


def level_figure(
    name: str,
    frequency: FloatArray,
    reference: ComplexArray,
    levels: Sequence[LevelCurve],
    unit: str,
    title: str,
    threshold_db: float,
) -> str:
    """FRFs at rising drive levels, and how far they leave the reference, as SVG.

    Parameters
    ----------
    name
        Prefix of the figure's ids.
    frequency, reference
        (nf,) Hz and the FRF by FBS.
    levels
        By rising force.
    unit, title
        Of the FRFs, and of the figure.
    threshold_db
        Above it FBS no longer applies.
    """
    colors = _rising(len(levels))
    with styled():
        figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
        magnitude, deviation = figure.subplots(2, 1, height_ratios=(2.2, 1.6))
        level = _decibels(reference)
        at = extremes(along_axis(frequency), level, CURVE_COLUMNS)
        magnitude.plot(frequency[at], level[at], color=REFERENCE_COLOR, lw=4.0)
        for curve, color in zip(levels, colors, strict=True):
            if curve.frf is not None:
                level = _decibels(curve.frf)
                at = extremes(along_axis(frequency), level, CURVE_COLUMNS)
                magnitude.plot(frequency[at], level[at], color=color, lw=1.0)
        magnitude.set_ylabel(f"dB re 1 {unit}")
        frequency_axis(magnitude, frequency[0], frequency[-1])
        _draw_deviations(deviation, levels, colors, threshold_db)
        figure.suptitle(title, x=0.01, ha="left", fontsize=9.0, fontweight="bold")
        figure.legend(handles=_level_handles(levels, colors), loc="outside right upper")
        return svg(figure, name, f"FRF {title} at rising drive levels")


def _rising(count: int) -> list[str]:
    """Colours from dark to light; the lightest would not show on white."""
    shades = matplotlib.colormaps["plasma"](np.linspace(0.0, 0.85, max(count, 1)))
    return [to_hex(shade) for shade in shades]


def _level_handles(levels: Sequence[LevelCurve], colors: Sequence[str]) -> list[Line2D]:
    handles = [Line2D([], [], color=REFERENCE_COLOR, lw=4.0, label="FBS")]
    for curve, color in zip(levels, colors, strict=True):
        label = engineering(curve.force, "N") + (" (diverged)" if curve.frf is None else "")
        handles.append(Line2D([], [], color=color, lw=1.6, label=label))
    return handles


def _draw_deviations(
    axes: Axes, levels: Sequence[LevelCurve], colors: Sequence[str], threshold: float
) -> None:
    finite = [x for x in levels if np.isfinite(x.worst_db)]
    force = [x.force for x in finite]
    values = [v for x in finite for v in (x.worst_db, x.median_db) if v > 0.0]
    highest = ceil(log10(1.5 * max([*values, threshold])))
    lowest = max(min([floor(log10(v)) for v in values] + [highest - 2]), highest - 2 * MOST_DECADES)
    least = 10.0**lowest
    axes.plot(force, [max(x.worst_db, least) for x in finite], color=MUTED, lw=1.0, zorder=1)
    axes.plot(
        force, [max(x.median_db, least) for x in finite], color=MUTED, lw=0.8, ls=":", zorder=1
    )
    for curve, color in zip(levels, colors, strict=True):
        if np.isfinite(curve.worst_db):
            axes.plot(curve.force, max(curve.worst_db, least), "o", color=color, ms=5)
            axes.plot(curve.force, max(curve.median_db, least), "s", mfc="white", mec=color, ms=4)
        else:
            axes.plot(curve.force, 10.0**highest, "X", color=color, ms=8, clip_on=False)
    axes.axhline(threshold, color=VERMILLION, lw=1.0, ls="--")
    axes.annotate(
        f"above {threshold:g} dB FBS no longer applies", (0.0, threshold),
        xycoords=("axes fraction", "data"), xytext=(5, 3), textcoords="offset points",
        color=VERMILLION, fontsize=8.0,
    )  # fmt: skip
    forces = [x.force for x in levels]
    axes.set_xscale("log")
    axes.set_xlim(min(forces) / 1.6, max(forces) * 1.6)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.xaxis.set_major_formatter(EngFormatter("N"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    log_axis(axes, lowest, highest, most=5)
    axes.set_xlabel("Force (peak)")
    axes.set_ylabel("Off FBS (dB)")
    axes.legend(
        handles=[
            Line2D([], [], color=MUTED, marker="o", lw=1.0, ms=5, label="largest"),
            Line2D([], [], color=MUTED, marker="s", mfc="w", lw=0.8, ls=":", ms=4, label="median"),
        ],
        loc="lower right",
        ncols=2,
    )  # fmt: skip


def _decibels(values: ComplexArray) -> FloatArray:
    with np.errstate(divide="ignore"):
        level: FloatArray = 20.0 * np.log10(np.abs(values))
    return level

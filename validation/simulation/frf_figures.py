"""FRFs from runs: beside a reference, held from a sweep, and over the drive level."""

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

from ..arrays import BoolArray, ComplexArray, FloatArray
from ..report.digits import engineering
from ..report.figure import (
    frequency_axis,
    level_axis,
    log_axis,
    styled,
    svg,
)
from ..report.frf_panel import (
    Curve,
    Difference,
    FrfPanel,
    decibels,
    draw_magnitude,
    reference_curve,
)
from ..report.style import (
    BLUE,
    CURVE_COLUMNS,
    MUTED,
    REFERENCE_COLOR,
    VERMILLION,
    WIDTH,
)

MOST_DECADES = 6  # of an error axis


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


def estimate_panel(
    title: str,
    frequency: FloatArray,
    estimate: ComplexArray,
    reference: ComplexArray,
    compared: BoolArray,
    allowed: tuple[FloatArray | float, FloatArray | float],
) -> FrfPanel:
    """An estimated FRF beside FBS': magnitude, phase, and the errors of both.

    Parameters
    ----------
    title
        "response ← excitation".
    frequency, estimate, reference
        (nf,) Hz and the FRFs.
    compared
        (nf,) lines on which they are compared.
    allowed
        dB and degrees.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(compared, estimate / reference, np.nan)
    errors = (
        ("Error (dB)", np.abs(decibels(ratio)), allowed[0]),
        ("Error (°)", np.degrees(np.abs(np.angle(ratio))), allowed[1]),
    )
    return FrfPanel(
        frequency,
        (reference_curve("FBS", reference, 3.5), Curve("exudyn in time", estimate, BLUE, 1.0)),
        tuple(
            Difference(
                label, (Curve("", values, BLUE, 0.0, marker=".", size=2.4),), decades=MOST_DECADES,
                allowed=limit,
            )
            for label, values, limit in errors
        ),
        phase=True,
        title=title,
    )  # fmt: skip


def peak_hold_panel(
    title: str,
    frequency: FloatArray,
    frf: ComplexArray,
    held_frequency: FloatArray,
    held: FloatArray,
    predicted: tuple[FloatArray, FloatArray] | None = None,
) -> FrfPanel:
    """A sweep's peak-hold over the FRF, their difference below.

    Parameters
    ----------
    title
        "response ← excitation".
    frequency, frf
        (nf,) Hz and the FRF; the difference is taken at the held lines, between its lines linearly
        in dB.
    held_frequency, held
        (n,) Hz, ascending, and the largest |y|/F held there.
    predicted
        Frequencies (Hz) and magnitudes of the peaks as the sweep's rate should leave them.
    """
    curves = [
        reference_curve("FRF", frf, 3.5),
        Curve("peak-hold of the sweep", held, BLUE, 1.0, marker=".", size=2.5,
              frequency=held_frequency),
    ]  # fmt: skip
    if predicted is not None:
        at, height = predicted
        name = "peaks at this sweep rate (theory)"
        curves.append(Curve(name, height, VERMILLION, 0.0, marker="x", size=7.0, frequency=at))
    off = decibels(held) - np.interp(held_frequency, frequency, decibels(frf))
    difference = Difference(
        "Difference (dB)", (Curve("", off, BLUE, 1.0, frequency=held_frequency),), logarithmic=False
    )
    return FrfPanel(frequency, tuple(curves), (difference,), title=title)


def level_figure(
    name: str,
    frequency: FloatArray,
    reference: ComplexArray,
    levels: Sequence[LevelCurve],
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
    title
        Of the figure.
    threshold_db
        Above it FBS no longer applies.
    """
    colors = _rising(len(levels))
    with styled():
        figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
        magnitude, deviation = figure.subplots(2, 1, height_ratios=(2.2, 1.6))
        curves = [
            Curve("", curve.frf, color, 1.0)
            for curve, color in zip(levels, colors, strict=True)
            if curve.frf is not None
        ]
        panel = FrfPanel(frequency, (reference_curve("", reference), *curves))
        draw_magnitude(magnitude, panel, CURVE_COLUMNS)
        level_axis(magnitude)
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

"""The report's section on a swap: what to show, and its figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..checks.peaks import Peak, Resonance
from ..report.curves import extremes
from ..report.style import (
    BLUE,
    CURVE_COLUMNS,
    MUTED,
    REFERENCE_COLOR,
    VERMILLION,
    WIDTH,
    along_axis,
    frequency_axis,
    styled,
    svg,
)
from .results import CurveChange, Swap
from .swap import headline

FloatArray = NDArray[np.float64]

MOST_RESONANCES = 30
LEAST_RANGE_DB = 1.0  # of the difference's axis: what is smaller lies on zero


@dataclass(frozen=True)
class SwappedPart:
    """A part from a file, in words."""

    name: str
    file: Path
    compared: int
    of: int
    interface: tuple[str, ...]
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class ChangedCurve:
    """An FRF before and after; ``part`` names the part it is of, alone (empty: the assembly)."""

    part: str
    curve: CurveChange
    svg: str


@dataclass(frozen=True)
class ResonanceRow:
    """A resonance in words; ``shift`` holds Hz, % and the level's dB where it is in both."""

    dof: str
    before: str
    after: str
    shift: tuple[str, str, str] | None


@dataclass(frozen=True)
class SwapSection:
    """What the section shows."""

    headline: str
    parts: tuple[SwappedPart, ...]
    curves: tuple[ChangedCurve, ...]
    resonances: tuple[ResonanceRow, ...]
    further_resonances: int


def swap_section(swap: Swap, frequency: FloatArray) -> SwapSection:
    """The section's words, numbers and figures."""
    curves = [("", c) for c in sorted(swap.curves, key=lambda c: c.scaled_error, reverse=True)]
    curves += [(part, curve) for part, found in swap.alone.items() for curve in found]
    telling = sorted(swap.resonances, key=lambda r: r.prominence_db, reverse=True)
    shown = sorted(telling[:MOST_RESONANCES], key=lambda r: r.frequency_hz)
    with styled():
        drawn = tuple(
            ChangedCurve(part, curve, _figure(number, part, curve, frequency))
            for number, (part, curve) in enumerate(curves, start=1)
        )
    return SwapSection(
        headline=headline(swap),
        parts=tuple(
            SwappedPart(
                name=r.part,
                file=r.path,
                compared=len(set(r.frf.responses) | set(r.frf.excitations)),
                of=len(set(r.frf.responses) | set(r.frf.excitations) | set(r.left_out)),
                interface=r.interface,
                left_out=r.left_out,
            )
            for r in swap.replacements
        ),
        curves=drawn,
        resonances=tuple(_row(resonance) for resonance in shown),
        further_resonances=len(telling) - len(shown),
    )


def _row(resonance: Resonance) -> ResonanceRow:
    before, after = resonance.before, resonance.after
    shift = None
    if before is not None and after is not None:
        moved = after.frequency_hz - before.frequency_hz
        percent = 100.0 * moved / before.frequency_hz
        shift = (signed(moved), signed(percent), signed(after.level_db - before.level_db, 1))
    return ResonanceRow(resonance.dof, _place(before), _place(after), shift)


def _place(peak: Peak | None) -> str:
    return "–" if peak is None else f"{peak.frequency_hz:.2f}"


def signed(value: float, digits: int = 2) -> str:
    """−4.86; 0.00 has no sign."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0.0 else text.replace("-", "−")


def _figure(number: int, part: str, curve: CurveChange, frequency: FloatArray) -> str:
    """|H| before and after, peaks marked, and the difference in dB below."""
    figure = Figure(figsize=(WIDTH, 3.9))
    magnitude, difference = figure.subplots(2, 1, sharex=True, height_ratios=(2.3, 1.2))
    figure.subplots_adjust(left=0.08, right=0.985, top=0.93, bottom=0.12, hspace=0.1)
    names = ("model", "file") if part else ("before (model)", "after (with the file)")
    _draw(magnitude, frequency, _decibels(curve.before), REFERENCE_COLOR, 3.5)
    _draw(magnitude, frequency, _decibels(curve.after), VERMILLION, 1.2)
    _mark(magnitude, [r.before for r in curve.resonances], MUTED, 4.5)
    _mark(magnitude, [r.after for r in curve.resonances], VERMILLION, 3.0)
    magnitude.set_ylabel("|H| (dB re 1 m/N)")
    magnitude.tick_params(axis="x", labelbottom=False)
    _draw(difference, frequency, curve.decibel, BLUE, 1.1)
    most = np.nanmax(np.abs(curve.decibel), initial=LEAST_RANGE_DB / 1.1)
    difference.set_ylim(-1.1 * most, 1.1 * most)
    difference.set_ylabel("Difference (dB)")
    frequency_axis(difference, frequency[0], frequency[-1])
    handles = [
        Line2D([], [], color=REFERENCE_COLOR, lw=3.5, label=names[0]),
        Line2D([], [], color=VERMILLION, lw=1.6, label=names[1]),
        Line2D([], [], color=MUTED, marker="o", ms=3.5, lw=0.0, label="resonances found"),
        Line2D([], [], color=BLUE, lw=1.6, label="difference"),
    ]
    figure.legend(
        handles=handles,
        loc="upper left",
        ncols=4,
        bbox_to_anchor=(0.07, 1.0),
        borderaxespad=0.0,
    )
    whose = f"{part} alone" if part else "the whole"
    return svg(figure, f"swap{number}", f"FRF {curve.name} of {whose} before and after the swap")


def _decibels(receptance: NDArray[Any]) -> FloatArray:
    with np.errstate(divide="ignore"):
        level: FloatArray = 20.0 * np.log10(np.abs(receptance))
    return level


def _draw(
    axes: Axes, frequency: FloatArray, values: FloatArray, color: str, linewidth: float
) -> None:
    at = extremes(along_axis(frequency), values, CURVE_COLUMNS)
    axes.plot(frequency[at], values[at], color=color, linewidth=linewidth)


def _mark(axes: Axes, peaks: Sequence[Peak | None], color: str, size: float) -> None:
    found = [(peak.frequency_hz, peak.level_db) for peak in peaks if peak is not None]
    if found:
        axes.plot(*np.transpose(found), "o", color=color, markersize=size)

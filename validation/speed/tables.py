"""Tables of a speed study, for its page and for the terminal."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray
from ..report.digits import engineering
from ..report.page import Table
from .describe import peak_energy, peak_mode
from .findings import family_heights
from .lines import line_names
from .result import SpeedResult
from .steady import SteadyStates

LISTED_MARGINS = 12


def static_table(result: SpeedResult) -> Table:
    """Static forces of the meshes."""
    turning = result.turning
    rows = tuple(
        (name, engineering(force, "N", 4))
        for name, force in zip(turning.meshes, turning.static_forces, strict=True)
    )
    return Table(("Mesh", "Static force"), rows, frozenset({1}))


def resonance_table(result: SpeedResult) -> Table:
    """The peaks, numbered as in the figure."""
    names = line_names(result.turning)
    loaded = bool(np.any(result.turning.static_forces > 0.0))
    rows = tuple(
        (
            str(number),
            f"{peak.speed_rpm:.5g}",
            peak.family,
            f"{names[peak.line]} ({peak.order:.5g})",
            f"{peak.frequency_hz:.5g}",
            peak_mode(result, peak),
            peak_energy(result, peak),
            f"{peak.height:.3f}" if loaded else "–",
            engineering(peak.swing, "N"),
        )
        for number, peak in enumerate(result.peaks, start=1)
    )
    headings = (
        "#", "Speed, rpm", "Felt most by", "Harmonic (order)", "Frequency, Hz", "Mode",
        "Its strain energy", "Dynamic factor", "Above mean",
    )  # fmt: skip
    return Table(headings, rows, frozenset({0, 1, 4, 7, 8}))


def family_table(result: SpeedResult, states: SteadyStates) -> Table:
    """Forces of every family of meshes over the speed range."""
    turning, static = result.turning, result.turning.static_forces
    heights = family_heights(turning, states)
    loaded = bool(np.any(static > 0.0))
    rows = []
    for family in turning.families:
        columns = list(family.columns)
        most = int(np.nanargmax(np.nan_to_num(heights[family.name])))
        mean = states.mesh[:, 0, columns].real
        rows.append(
            (
                family.name,
                engineering(float(static[columns].max()), "N", 4),
                engineering(float(np.nanmax(states.mesh_max[:, columns])), "N", 4),
                engineering(float(np.nanmin(states.mesh_min[:, columns])), "N", 4),
                engineering(float(np.nanmax(states.mesh_rms[:, columns])), "N"),
                f"{heights[family.name][most]:.3f}" if loaded else "–",
                f"{states.rpm[most]:.5g}",
                _drift(mean, static[columns]),
            )
        )
    headings = (
        "Meshes", "Static", "Largest", "Smallest", "RMS about mean", "Dynamic factor",
        "at, rpm", "Mean off static by",
    )  # fmt: skip
    return Table(headings, tuple(rows), frozenset(range(1, 8)))


def _drift(mean: FloatArray, static: FloatArray) -> str:
    if not np.any(static):
        return "–"
    share = 100.0 * float(np.nanmax(np.abs(mean - static)) / np.abs(static).max())
    return f"{share:.2g} %" if share >= 1e-3 else "< 0.001 %"


def margin_table(result: SpeedResult) -> Table:
    """The nearest resonance of every order at the operating speed, the closest first."""
    rows = tuple(
        (
            margin.order.label(margin.harmonic),
            f"{margin.order_hz:.5g}",
            f"{margin.mode_hz:.5g}",
            f"{margin.kind}" + (f" (×{margin.repeated})" if margin.repeated > 1 else ""),
            f"{100.0 * margin.change:+.2g} %".replace("-", "−"),
            f"{100.0 * margin.share:.2g} %",
        )
        for margin in result.margins[:LISTED_MARGINS]
    )
    headings = ("Order", "Its frequency, Hz", "Mode, Hz", "Kind", "Margin", "Energy reached")
    return Table(headings, rows, frozenset({1, 2, 4, 5}))

"""The report's section on the time domain: FRFs of exudyn's integration beside FBS'."""

from __future__ import annotations

from math import floor, log10
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..checks.time_domain import DECIBEL_TOLERANCE
from ..report.digits import rounded
from ..report.style import BLUE, MUTED, REFERENCE_COLOR, VERMILLION, WIDTH, log_axis, styled, svg
from ..routes.time_domain import TimeDomain

FloatArray = NDArray[np.float64]

DRAWN = 6  # responses: the excited DoF, and the largest others


def time_figure(result: TimeDomain) -> str:
    """FRFs by both routes, and their difference over frequency, as SVG."""
    with styled():
        figure = Figure(figsize=(WIDTH, 7.2), layout="constrained")
        grid = figure.add_gridspec(4, 2, height_ratios=(3, 3, 3, 2.4))
        for place, number in enumerate(_drawn(result)):
            _draw_frf(figure.add_subplot(grid[place // 2, place % 2]), result, number)
        _draw_difference(figure.add_subplot(grid[3, :]), result)
        return svg(
            figure,
            "time-domain",
            f"FRFs excited at {result.excitation}, by time integration and by FBS",
        )


def time_document(result: TimeDomain | None) -> dict[str, Any] | None:
    """The section's numbers for results.json."""
    if result is None:
        return None
    return {
        "excitation": result.excitation,
        "responses": list(result.labels),
        "frequency_hz": rounded(result.frequency, 12),
        "damping": result.damping.model_dump(),
        "step_s": result.step,
        "periods": result.shots,
        "closure": result.closure,
        "even_share": result.even_share,
        "worst_db": rounded(result.worst_db, 6),
        "worst_degrees": rounded(result.worst_degrees, 6),
        "transient": _complex(result.transient),
        "substructured": _complex(result.substructured),
    }


def _complex(values: NDArray[np.complex128]) -> dict[str, Any]:
    return {
        "real": [rounded(row, 9) for row in values.real.T],
        "imag": [rounded(row, 9) for row in values.imag.T],
    }


def _drawn(result: TimeDomain) -> list[int]:
    """The excited DoF first, then the largest responses of other bodies, one a body."""
    peaks = np.abs(result.substructured).max(axis=0)
    order = sorted(range(len(peaks)), key=lambda i: -peaks[i])
    chosen = [i for i in order if result.labels[i] == result.excitation]
    bodies = {result.labels[i].rpartition(".")[0] for i in chosen}
    for i in order:
        body = result.labels[i].rpartition(".")[0]
        if body not in bodies and len(chosen) < DRAWN:
            chosen.append(i)
            bodies.add(body)
    return chosen


def _draw_frf(axes: Axes, result: TimeDomain, number: int) -> None:
    fbs, time = (
        20.0 * np.log10(np.abs(values[:, number]))
        for values in (result.substructured, result.transient)
    )
    axes.plot(result.frequency, fbs, color=REFERENCE_COLOR, lw=3.0, label="FBS")
    axes.plot(result.frequency, time, color=BLUE, lw=0, marker=".", ms=2.2, label="exudyn in time")
    axes.set_title(f"{result.labels[number]} ← {result.excitation}")
    axes.set_ylabel("dB re 1 m/N")
    axes.set_xlim(0.0, float(result.frequency[-1]))
    axes.legend(loc="upper right", ncols=2)


def _draw_difference(axes: Axes, result: TimeDomain) -> None:
    reference = np.abs(result.substructured)
    ratio = np.where(result.compared, np.abs(result.transient) / reference, 1.0)
    largest = np.abs(20.0 * np.log10(ratio)).max(axis=1)
    axes.plot(result.frequency, np.maximum(largest, 1e-6), color=BLUE, lw=1.0)
    log_axis(axes, max(floor(log10(max(largest.min(), 1e-6))), -6), 0)
    axes.axhline(DECIBEL_TOLERANCE, color=VERMILLION, lw=1.0, ls="--")
    axes.annotate(
        "allowed", (0.0, DECIBEL_TOLERANCE), xytext=(4, 3), textcoords="offset points", color=MUTED
    )
    axes.set_title(f"Largest difference over all {len(result.labels)} responses")
    axes.set_ylabel("dB")
    axes.set_xlabel("Frequency (Hz)")
    axes.set_xlim(0.0, float(result.frequency[-1]))

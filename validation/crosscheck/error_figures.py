"""The report's figures of errors: over frequency, over DoFs, and in the coupling."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, log10

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ..checks.frfs import FRF_TOLERANCE, FrfComparison
from ..report.curves import extremes, largest
from ..report.style import (
    BLACK,
    BLUE,
    CURVE_COLUMNS,
    ERROR_COLUMNS,
    FLOOR_COLOR,
    SKY,
    VERMILLION,
    WIDTH,
    along_axis,
    decades,
    envelope,
    frequency_axis,
    log_axis,
    power_of_ten,
    svg,
)
from .results import CrossCheck


def worst_comparison(result: CrossCheck) -> FrfComparison:
    """The route with the largest scaled error (one that is not a number is larger than any)."""
    return max(result.comparisons, key=largest_error)


def largest_error(comparison: FrfComparison) -> float:
    """Largest scaled error of a route, infinite where it is not a number."""
    return float(np.nan_to_num(comparison.line_max, nan=np.inf).max())


def error_figure(result: CrossCheck) -> str:
    """Largest and median scaled error by line, one panel for each route."""
    comparisons = result.comparisons
    rows = ceil((len(comparisons) + 1) / 2)
    height = 1.75 * rows + 0.5
    figure = Figure(figsize=(WIDTH, height))
    panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False).ravel()
    figure.subplots_adjust(
        left=0.07,
        right=0.99,
        top=1.0 - 0.25 / height,
        bottom=0.5 / height,
        hspace=0.24,
        wspace=0.06,
    )
    allowed = np.maximum(FRF_TOLERANCE, result.round_off)
    lowest, highest = decades(
        [e for c in comparisons for e in (c.line_max, c.line_median)], 10.0 * FRF_TOLERANCE
    )
    for axes, comparison in zip(panels, comparisons, strict=False):
        bottom = 10.0**lowest
        f = result.frequency
        at = largest(along_axis(f), result.round_off, ERROR_COLUMNS)
        axes.fill_between(f[at], bottom, result.round_off[at], color=FLOOR_COLOR, linewidth=0.0)
        envelope(axes, f, comparison.line_median, bottom, color=SKY, linewidth=0.9)
        envelope(axes, f, comparison.line_max, bottom, color=BLUE, linewidth=1.1)
        envelope(axes, f, allowed, bottom, color=VERMILLION, linewidth=1.0, linestyle="dashed")
        axes.set_title(comparison.route)
        log_axis(axes, lowest, highest, most=5)
        frequency_axis(axes, f[0], f[-1], label=False)
    for axes in panels[len(comparisons) :]:
        axes.set_axis_off()
    for axes in (panels[len(comparisons) - 1], panels[len(comparisons) - 2]):
        axes.set_xlabel("Frequency (Hz)")
        axes.tick_params(axis="x", labelbottom=True)
    handles = [
        Line2D([], [], color=BLUE, lw=1.6, label="largest over all FRFs"),
        Line2D([], [], color=SKY, lw=1.6, label="median over all FRFs"),
        Line2D([], [], color=VERMILLION, lw=1.2, ls="dashed", label="tolerance"),
        Patch(color=FLOOR_COLOR, label="what round-off of K alone can cause"),
    ]
    panels[len(comparisons)].legend(
        handles=handles, loc="center", fontsize=8.5, labelspacing=0.8, handlelength=2.6
    )
    return svg(figure, "errors", "Scaled error over frequency, by route")


MANY_DOFS = 60  # more than that cannot be labelled one by one


def heat_map(comparison: FrfComparison, dofs: Sequence[str]) -> str:
    """Largest scaled error over all lines of every pair of DoFs, a colour for each decade."""
    count = len(dofs)
    side = min(max(0.2 * count, 2.6), 6.6)
    left, bottom, top, right = 1.35, 1.35, 0.08, 1.35
    width, height = left + side + right, bottom + side + top
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((left / width, bottom / height, side / width, side / height))
    lowest, highest = decades([comparison.pair_max])
    step = ceil((highest - lowest) / 12)
    bounds = np.arange(lowest, highest + step, step)
    colors = colormaps["Blues"].resampled(len(bounds) - 1)
    exponent = np.log10(np.clip(comparison.pair_max, 10.0**lowest, None))
    many = count > MANY_DOFS
    mesh = axes.pcolormesh(
        exponent,
        cmap=colors,
        norm=BoundaryNorm(bounds, colors.N),
        edgecolor="none" if many else "white",
        linewidth=0.3,
        rasterized=many,  # tens of thousands of cells would be megabytes of paths
    )
    size = 7.5 if many else min(7.5, 7.5 * 30 / count)
    ticks, names = part_ticks(dofs) if many else (np.arange(count) + 0.5, list(dofs))
    axes.set_xticks(ticks, names, rotation=90, fontsize=size)
    axes.set_yticks(ticks, names, fontsize=size)
    axes.tick_params(length=0.0)
    axes.set_xlabel("Excitation")
    axes.set_ylabel("Response")
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    bar_axes = figure.add_axes(
        (
            (left + side + 0.25) / width,
            (bottom + 0.15 * side) / height,
            0.16 / width,
            0.7 * side / height,
        )
    )
    bar = figure.colorbar(mesh, cax=bar_axes, ticks=bounds)
    bar.ax.set_yticklabels([power_of_ten(int(e)) for e in bounds])
    bar.ax.tick_params(length=0.0)
    bar.outline.set_visible(False)
    bar.set_label(
        "Largest scaled error", rotation=90, rotation_mode="anchor", ha="center", va="top"
    )
    return svg(figure, "heatmap", f"Largest scaled error of every FRF, {comparison.route}")


def part_ticks(dofs: Sequence[str]) -> tuple[NDArray[np.float64], list[str]]:
    """One tick in the middle of every run of DoFs of the same part."""
    parts = [dof.partition(".")[0] for dof in dofs]
    starts = [i for i, part in enumerate(parts) if i == 0 or part != parts[i - 1]]
    ends = [*starts[1:], len(parts)]
    middles = np.array([(a + b) / 2.0 for a, b in zip(starts, ends, strict=True)])
    return middles, [parts[i] for i in starts]


def kernel_figure(result: CrossCheck) -> str:
    """How much the interface kernel amplifies a relative error of the stages' FRFs."""
    values = result.kernel_condition
    if not len(values):
        return ""
    figure = Figure(figsize=(WIDTH, 2.3))
    axes = figure.subplots()
    figure.subplots_adjust(left=0.07, right=0.99, top=0.96, bottom=0.2)
    position = along_axis(result.frequency)
    at = extremes(position, values, CURVE_COLUMNS)
    axes.plot(result.frequency[at], values[at], color=BLACK, linewidth=1.0)
    finite = values[np.isfinite(values) & (values > 0.0)]
    low, high = (floor(log10(finite.min())), ceil(log10(finite.max()))) if len(finite) else (0, 1)
    log_axis(axes, low, max(high, low + 1), most=5)
    axes.set_ylim(bottom=0.6 * 10.0**low)  # a kernel that amplifies nothing shows as a line
    frequency_axis(axes, result.frequency[0], result.frequency[-1])
    axes.set_ylabel("Amplification")
    return svg(figure, "kernel", "Conditioning of the interface kernel over frequency")

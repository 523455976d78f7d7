"""The report's figures, each an SVG element."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, log10

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from mbs_models.modal.mode_kinds import Kind

from ..checks.frfs import FRF_TOLERANCE, FrfComparison, Pair
from ..checks.time_domain import DECIBEL_TOLERANCE
from ..report.curves import extremes, largest, relative_difference
from ..report.frf_panel import (
    Curve,
    Difference,
    FrfPanel,
    Mode,
    coincident_curves,
    differences_of,
    draw_magnitude,
    frf_figure,
    reference_curve,
)
from ..report.style import (
    BLACK,
    BLUE,
    CURVE_COLUMNS,
    ERROR_COLUMNS,
    FLOOR_COLOR,
    KIND_COLORS,
    MUTED,
    REFERENCE_COLOR,
    SKY,
    VERMILLION,
    WIDTH,
    along_axis,
    decades,
    envelope,
    frequency_axis,
    log_axis,
    part_colors,
    power_of_ten,
    svg,
)
from ..routes.time_domain import TimeDomain
from .describe import short_frequency
from .result import CrossCheck

MANY_DOFS = 60  # more than that cannot be labelled one by one
DRAWN = 6  # responses of the run in time: the excited DoF, and the largest others


def shares_figure(result: CrossCheck) -> str:
    """Kinetic and strain energy of every mode by stage and coupling, as stacked bars."""
    modes = result.modes.modes
    drivetrain = result.drivetrain
    parts = [part.name for part in drivetrain.items]
    figure = Figure(figsize=(WIDTH, 3.9))
    top, bottom = figure.subplots(2, 1, sharex=True)
    figure.subplots_adjust(left=0.075, right=0.995, top=0.91, bottom=0.14, hspace=0.16)
    numbers = np.arange(1, len(modes) + 1)
    for axes, energy in ((top, "kinetic"), (bottom, "strain")):
        base = np.zeros(len(modes))
        for part, color in part_colors(parts).items():
            share = np.array([getattr(mode.shares, energy)[part] for mode in modes])
            axes.bar(numbers, share, 0.8, base, color=color, edgecolor="white", linewidth=0.5)
            base += share
        axes.set_ylim(0.0, 1.0)
        axes.set_yticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
        axes.set_ylabel(f"{energy.capitalize()} energy")
        axes.grid(visible=False, axis="x")
    step = ceil(len(modes) / 45)
    bottom.set_xticks(
        numbers[::step],
        [short_frequency(mode.frequency_hz) for mode in modes[::step]],
        rotation=90,
        fontsize=7.0,
    )
    bottom.set_xlim(0.4, len(modes) + 0.6)
    handles = [Patch(color=color, label=part) for part, color in part_colors(parts).items()]
    figure.legend(handles=handles, loc="upper left", ncols=8, bbox_to_anchor=(0.065, 1.0))
    return svg(figure, "shares", "Energy shares of every mode by stage and coupling")


def curve_figure(result: CrossCheck, number: int, pair: Pair) -> str:
    """|H| by every route, the modes above it, and every route's relative difference below it."""
    by_route = dict(result.curves[pair])
    reference = by_route.pop(result.reference)
    routes = coincident_curves(by_route)
    differences = {name: relative_difference(reference, h) for name, h in by_route.items()}
    panel = FrfPanel(
        frequency=result.frequency,
        curves=(reference_curve(f"{result.reference} (reference)", reference), *routes),
        differences=(Difference("|ΔH| / |H|", differences_of(routes, differences)),),
        modes=_modes_in_band(result),
    )
    return frf_figure(panel, f"curve{number}", f"FRF {pair[0]} over {pair[1]} by every route")


def _modes_in_band(result: CrossCheck) -> tuple[Mode, ...]:
    """Natural frequencies within the band, a row for each kind."""
    first, last = result.frequency[0], result.frequency[-1]
    return tuple(
        Mode(kind, mode.frequency_hz, KIND_COLORS[kind])
        for kind in Kind
        for mode in result.modes.modes
        if mode.kind == kind and first <= mode.frequency_hz <= last
    )


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


def time_figure(result: TimeDomain) -> str:
    """FRFs by both routes, and their difference over frequency."""
    figure = Figure(figsize=(WIDTH, 7.2))
    grid = figure.add_gridspec(
        4, 2, height_ratios=(3, 3, 3, 2.4), left=0.06, right=0.99, top=0.94, bottom=0.06,
        hspace=0.45, wspace=0.16,
    )  # fmt: skip
    for place, number in enumerate(_drawn(result)):
        panel = FrfPanel(
            result.frequency,
            (
                Curve("FBS", result.substructured[:, number], REFERENCE_COLOR, 3.0),
                Curve(
                    "exudyn in time", result.transient[:, number], BLUE, 0.0, marker=".", size=2.2
                ),
            ),
            from_zero=True,
        )
        axes = figure.add_subplot(grid[place // 2, place % 2])
        draw_magnitude(axes, panel, CURVE_COLUMNS)
        for line, curve in zip(axes.lines, panel.curves, strict=True):
            line.set_label(curve.name)
        axes.set_title(f"{result.labels[number]} ← {result.excitation}")
        axes.set_xlim(0.0, float(result.frequency[-1]))
    figure.legend(handles=axes.lines, loc="upper right", ncols=2)
    _draw_difference(figure.add_subplot(grid[3, :]), result)
    return svg(
        figure,
        "time-domain",
        f"FRFs excited at {result.excitation}, by time integration and by FBS",
    )


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

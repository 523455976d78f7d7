"""The report's figures, each an SVG element."""

from __future__ import annotations

from math import ceil, floor, log10

import numpy as np

from mbs_models.modal.mode_kinds import Kind

from ..checks.frfs import FRF_TOLERANCE, Pair
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
from ..report.plots import INCH, Axes, Box, LegendEntry, legend, plot_svg
from ..report.style import (
    BLACK,
    BLUE,
    CURVE_COLUMNS,
    ERROR_COLUMNS,
    FLOOR_COLOR,
    KIND_COLORS,
    REFERENCE_COLOR,
    SKY,
    VERMILLION,
    WIDTH,
    along_axis,
    decade_labels,
    decades,
    envelope,
    part_colors,
)
from ..routes.time_domain import TimeDomain
from .describe import short_frequency
from .result import CrossCheck

DRAWN = 6  # responses of the run in time: the excited DoF, and the largest others


def shares_figure(result: CrossCheck) -> str:
    """Kinetic and strain energy of every mode by stage and coupling, as stacked bars."""
    modes = result.modes.modes
    drivetrain = result.drivetrain
    parts = [part.name for part in drivetrain.items]
    colors = part_colors(parts)
    numbers = np.arange(1.0, len(modes) + 1.0)
    reach = (0.4, len(modes) + 0.6)
    step = ceil(len(modes) / 45)
    places = [
        (number + 1.0, short_frequency(modes[number].frequency_hz))
        for number in range(0, len(modes), step)
    ]
    frames = []
    for top, energy, named in ((26.0, "kinetic", ()), (146.0, "strain", places)):
        axes = Axes((50.0, top, 663.0, 98.0), reach, False, x_ticks=named, y=(0.0, 1.0))
        axes.y_ticks = [(0.0, "0"), (0.5, "50 %"), (1.0, "100 %")]
        axes.set_ylabel(f"{energy.capitalize()} energy")
        base = np.zeros(len(modes))
        for part, color in colors.items():
            share = np.array([getattr(mode.shares, energy)[part] for mode in modes])
            axes.bars(numbers, base, base + share, color)
            base = base + share
        frames.append(axes)
    columns = min(len(parts), 8)
    key = legend(
        [LegendEntry(part, color, 7.0) for part, color in colors.items()],
        50.0, 0.0, columns, 663.0 / columns,
    )  # fmt: skip
    words = "Energy shares of every mode by stage and coupling"
    return plot_svg((INCH * WIDTH, 284.0), frames, "shares", words, key)


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
    comparisons, f = result.comparisons, result.frequency
    rows = ceil((len(comparisons) + 1) / 2)
    allowed = np.maximum(FRF_TOLERANCE, result.round_off)
    lowest, highest = decades(
        [e for c in comparisons for e in (c.line_max, c.line_median)], 10.0 * FRF_TOLERANCE
    )
    at, bottom = largest(along_axis(f), result.round_off, ERROR_COLUMNS), 10.0**lowest
    frames = []
    for number, comparison in enumerate(comparisons):
        row, column = divmod(number, 2)
        box = (50.0 + 338.0 * column, 18.0 + 124.0 * row, 322.0, 98.0)
        last = number >= len(comparisons) - 2
        axes = Axes.over(box, f[0], f[-1], title=comparison.route, labelled=last)
        axes.fill_between(f[at], bottom, result.round_off[at], color=FLOOR_COLOR)
        envelope(axes, f, comparison.line_median, bottom, color=SKY, linewidth=0.9)
        envelope(axes, f, comparison.line_max, bottom, color=BLUE, linewidth=1.1)
        envelope(axes, f, allowed, bottom, color=VERMILLION, linewidth=1.0, linestyle="--")
        axes.decades(lowest, highest, most=5)
        if column:  # as on the left
            axes.y_ticks = [(value, "") for value in decade_labels(lowest, highest, 5)]
        frames.append(axes)
    entries = (
        LegendEntry("largest over all FRFs", BLUE, 1.6),
        LegendEntry("median over all FRFs", SKY, 1.6),
        LegendEntry("tolerance", VERMILLION, 1.2, "--"),
        LegendEntry("what round-off of K alone can cause", FLOOR_COLOR, 7.0),
    )
    row, column = divmod(len(comparisons), 2)
    key = legend(entries, 110.0 + 342.0 * column, 48.0 + 124.0 * row, 1, 0.0)
    size = INCH * WIDTH, 124.0 * rows + 30.0
    return plot_svg(size, frames, "errors", "Scaled error over frequency, by route", key)


def kernel_figure(result: CrossCheck) -> str:
    """How much the interface kernel amplifies a relative error of the stages' FRFs."""
    values = result.kernel_condition
    if not len(values):
        return ""
    f = result.frequency
    at = extremes(along_axis(f), values, CURVE_COLUMNS)
    finite = values[np.isfinite(values) & (values > 0.0)]
    low, high = (floor(log10(finite.min())), ceil(log10(finite.max()))) if len(finite) else (0, 1)
    axes = Axes.over((50.0, 7.0, 663.0, 126.0), f[0], f[-1])
    axes.plot(f[at], values[at], color=BLACK, lw=1.0)
    axes.decades(low, max(high, low + 1), most=5)
    axes.y = (0.6 * 10.0**low, 10.0 ** max(high, low + 1))  # what amplifies nothing shows as a line
    axes.set_ylabel("Amplification")
    words = "Conditioning of the interface kernel over frequency"
    return plot_svg((INCH * WIDTH, 166.0), (axes,), "kernel", words)


def time_figure(result: TimeDomain) -> str:
    """FRFs by both routes, and their difference over frequency."""
    f, frames = result.frequency, []
    reach = (0.0, float(f[-1]))
    for place, number in enumerate(_drawn(result)):
        row, column = divmod(place, 2)
        box = (50.0 + 364.0 * column, 38.0 + 138.0 * row, 288.0, 98.0)
        name = f"{result.labels[number]} ← {result.excitation}"
        axes = Axes(box, reach, logarithmic=False, title=name, named_x=False)
        curves = (
            Curve("FBS", result.substructured[:, number], REFERENCE_COLOR, 3.0),
            Curve("exudyn in time", result.transient[:, number], BLUE, 0.0, marker=".", size=4.0),
        )
        draw_magnitude(axes, FrfPanel(f, curves, from_zero=True), CURVE_COLUMNS)
        frames.append(axes)
    top = 38.0 + 138.0 * ceil(len(frames) / 2)
    frames.append(_difference(result, (50.0, top, 663.0, 88.0), reach))
    entries = (
        LegendEntry("FBS", REFERENCE_COLOR, 3.0),
        LegendEntry("exudyn in time", BLUE, 0.0, marker=".", size=4.0),
    )
    words = f"FRFs excited at {result.excitation}, by time integration and by FBS"
    key = legend(entries, 520.0, 2.0, 2, 80.0)
    return plot_svg((INCH * WIDTH, top + 124.0), frames, "time-domain", words, key)


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


def _difference(result: TimeDomain, box: Box, reach: tuple[float, float]) -> Axes:
    """The largest difference of any response, line by line, and what is allowed."""
    reference = np.abs(result.substructured)
    ratio = np.where(result.compared, np.abs(result.transient) / reference, 1.0)
    decibel = np.abs(20.0 * np.log10(ratio)).max(axis=1)
    words = f"Largest difference over all {len(result.labels)} responses; dashed: allowed"
    axes = Axes(box, reach, logarithmic=False, title=words)
    axes.plot(result.frequency, np.maximum(decibel, 1e-6), color=BLUE, lw=1.0)
    axes.decades(max(floor(log10(max(decibel.min(), 1e-6))), -6), 0)
    axes.across(DECIBEL_TOLERANCE, VERMILLION, 1.0, "--")
    axes.set_ylabel("dB")
    return axes

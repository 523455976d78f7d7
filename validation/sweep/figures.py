"""Pictures of a sweep: FRFs, percentile bands, loci, metrics, sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import StringIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..arrays import FloatArray, IndexArray
from ..report.figure import (
    frequency_axis,
    level_axis,
    styled,
    svg,
)
from ..report.frf_panel import Band, Curve, FrfPanel, draw_magnitude
from ..report.style import (
    BLUE,
    CURVE_COLUMNS,
    INK,
    KIND_COLORS,
    MUTED,
    VERMILLION,
    WIDTH,
)
from .axes import MANY, constant_limits, logarithmic, metric_axis, parameter_axis, varying
from .grid_figures import Rows, draw_frfs, draw_metrics, metric_panels
from .metrics import decibels
from .result import SweepResult
from .sensitivity import Sensitivity, is_slope, sensitivities

PERCENTILES = (5, 25, 50, 75, 95)
LINES_AT_ONCE = 512  # one page of a file holds as many
RANKED = 15  # sensitivities shown
NEGLIGIBLE = 1e-6  # not worth a bar: round-off is far below


@dataclass(frozen=True)
class SweepPicture:
    """A picture of a sweep.

    Attributes
    ----------
    file, title, words
        Its file's name, what it is, and how to read it.
    text, inline
        The SVG as a file of its own, and to stand in a page.
    """

    file: str
    title: str
    words: str
    text: str
    inline: str

    @property
    def name(self) -> str:
        """The file's, without its ending."""
        return self.file.removesuffix(".svg")


def pictures(sweep: SweepResult) -> tuple[SweepPicture, ...]:
    """Draw what the sweep has data for."""
    grid = not sweep.samples.sampled and bool(varying(sweep))
    drawn = []
    if sweep.has_frf and grid:
        words = "The FRF over frequency, for each value of the parameters."
        drawn.append(_drawn(sweep, "frf_map.svg", "FRF over the parameters", words, draw_frfs))
    if sweep.has_frf and sweep.samples.sampled:
        words = "Line by line, how much of the samples lies where."
        drawn.append(_drawn(sweep, "bands.svg", "FRF with its scatter", words, _bands))
    if rows := _metrics_shown(sweep):
        words = "Each metric, " + ("as often as it is found." if not grid else "over the grid.")

        def metrics(sweep: SweepResult, figure: Figure) -> None:
            (draw_metrics if grid else _spreads)(sweep, figure, rows)

        drawn.append(_drawn(sweep, "metrics.svg", "Metrics", words, metrics))
    if any(abs(s.value) > NEGLIGIBLE for s in sensitivities(sweep)):
        words = (
            "Relative change of a metric for a relative change of the parameter, mean over its "
            "range: +1 is in proportion."
            if is_slope(sweep)
            else "Spearman’s rank correlation ρ: +1 or −1 where the metric only ever grows or "
            "falls with the parameter, whatever else varies; near 0 where others decide."
        )
        drawn.append(_drawn(sweep, "sensitivity.svg", "Sensitivities", words, _sensitivity))
    if sweep.results.frequency_hz.size and varying(sweep):
        words = "Natural frequencies of all samples, coloured by the kind of mode."
        drawn.append(_drawn(sweep, "frequencies.svg", "Natural frequencies", words, _loci))
    return tuple(drawn)


def _metrics_shown(sweep: SweepResult) -> Rows:
    """The metrics, each with the samples that have a value."""
    if not (sweep.samples.sampled or varying(sweep)):
        return {}
    with_value = {
        name: np.flatnonzero(sweep.results.ok & np.isfinite(column))
        for name, column in sweep.metrics.items()
    }
    return {name: rows for name, rows in with_value.items() if len(rows)}


def _drawn(
    sweep: SweepResult,
    file: str,
    title: str,
    words: str,
    draw: Callable[[SweepResult, Figure], None],
) -> SweepPicture:
    with styled():
        figure = Figure(figsize=(WIDTH, 0.55 * WIDTH), layout="constrained", dpi=150)
        draw(sweep, figure)
        stream = StringIO()
        figure.savefig(stream, format="svg", facecolor="white", metadata={"Date": None})
        inline = svg(figure, file.removesuffix(".svg"), f"{sweep.title}: {title}")
    return SweepPicture(file, title, words, stream.getvalue(), inline)


def _bands(sweep: SweepResult, figure: Figure) -> None:
    """Percentiles of |H| over the samples, line by line."""
    levels = percentiles(sweep.results.magnitude, np.flatnonzero(sweep.results.ok))
    bands = (
        Band("5 – 95 %", levels[0], levels[4], BLUE, 0.2),
        Band("25 – 75 %", levels[1], levels[3], BLUE, 0.4),
    )
    median = Curve("median", 10.0 ** (levels[2] / 20.0), INK, 0.8)
    axes = figure.subplots()
    draw_magnitude(axes, FrfPanel(sweep.frequency, (median,), bands=bands), CURVE_COLUMNS)
    level_axis(axes)
    frequency_axis(axes, sweep.frequency[0], sweep.frequency[-1])
    axes.set_title(f"{sweep.title}: {sweep.frf_name}, {sweep.results.ok.sum()} samples")
    axes.legend(ncols=3)


def percentiles(magnitude: FloatArray, rows: IndexArray) -> FloatArray:
    """(5, n_frequency) percentiles of the level (dB re 1 m/N) over some samples.

    Some lines at a time: |H| may be a file larger than the memory.
    """
    n_lines = magnitude.shape[1]
    levels = np.empty((len(PERCENTILES), n_lines))
    for start in range(0, n_lines, LINES_AT_ONCE):
        lines = slice(start, start + LINES_AT_ONCE)
        part = np.ascontiguousarray(decibels(magnitude[rows, lines]).T)
        levels[:, lines] = np.percentile(part, PERCENTILES, axis=1, overwrite_input=True)
    return levels


def _loci(sweep: SweepResult, figure: Figure) -> None:
    """Natural frequencies over each parameter that varies (up to four), coloured by kind."""
    shown = varying(sweep)[:4]
    ok = sweep.results.ok
    every = sweep.results.frequency_hz
    found = (every > 0.0) & ok[:, None]
    all_axes = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for k, axes in zip(shown, all_axes, strict=True):
        values = np.broadcast_to(sweep.values[:, k, None], every.shape)
        for name, color in KIND_COLORS.items():
            mask = (sweep.results.kind == str(name)) & found
            if mask.any():
                axes.plot(
                    values[mask], every[mask], ".", ms=5, color=color, label=str(name), mew=0,
                    rasterized=found.sum() > MANY,
                )  # fmt: skip
        parameter_axis(axes, sweep.parameter_labels[k], sweep.values[ok, k], vertical=False)
    all_axes[0].set(ylabel="Natural frequency (Hz)", title=sweep.title)
    handles, labels = all_axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(
            handles, labels, loc="outside lower center", ncols=len(handles), markerscale=2
        )


def _sensitivity(sweep: SweepResult, figure: Figure) -> None:
    """The largest sensitivities of metrics and of natural frequencies, one bar each."""
    largest = [s for s in sensitivities(sweep) if abs(s.value) > NEGLIGIBLE]
    of_metrics = [s for s in largest if s.metric in sweep.metrics]
    of_frequencies = [s for s in largest if s.metric not in sweep.metrics]
    panels = [panel[:RANKED] for panel in (of_metrics, of_frequencies) if panel]
    rows = [len(panel) for panel in panels]
    figure.set_size_inches(WIDTH, 0.5 + 0.5 * len(panels) + 0.24 * sum(rows))
    all_axes = figure.subplots(len(panels), 1, squeeze=False, height_ratios=rows)[:, 0]
    measure = "|∂log metric/∂log parameter|" if is_slope(sweep) else "|Spearman's ρ|"
    for axes, shown in zip(all_axes, panels, strict=True):
        _bars(sweep, axes, shown)
        axes.set(xlabel=measure)
    all_axes[0].set_title(f"{sweep.title}: sensitivities (blue: grows with the parameter)")


def _bars(sweep: SweepResult, axes: Axes, shown: Sequence[Sensitivity]) -> None:
    values = [abs(s.value) for s in shown]
    colors = [BLUE if s.value >= 0.0 else VERMILLION for s in shown]
    axes.barh(range(len(shown)), values, color=colors)
    axes.set_yticks(
        range(len(shown)), [f"{_words(sweep, s.metric)} ← {s.parameter}" for s in shown]
    )
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.15 * max(values))  # room for the numbers
    for row, s in enumerate(shown):
        axes.annotate(
            f"{s.value:+.2g}", (abs(s.value), row), xytext=(3, 0), textcoords="offset points",
            va="center", color=MUTED, fontsize="small",
        )  # fmt: skip


def _words(sweep: SweepResult, metric: str) -> str:
    """A metric's label without its unit; ``f2`` is the second natural frequency."""
    label = sweep.metric_labels.get(metric, f"Natural frequency {metric[1:]} (Hz)")
    return label.rpartition(" (")[0]


def _spreads(sweep: SweepResult, figure: Figure, shown: Rows) -> None:
    """How often each metric is where."""
    panels = metric_panels(figure, len(shown))
    for axes, (name, rows) in zip(panels, shown.items(), strict=True):
        _spread(axes, sweep.metric_labels[name], sweep.metrics[name][rows])
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)


def _spread(axes: Axes, label: str, values: FloatArray) -> None:
    """A histogram with its median and the ranges that hold half and 90 % of the samples."""
    low, quarter, median, three_quarters, high = np.percentile(values, PERCENTILES)
    axes.hist(values, bins=_bins(values), color=MUTED)
    axes.axvspan(low, high, color=BLUE, alpha=0.15, lw=0, label="5 – 95 %")
    axes.axvspan(quarter, three_quarters, color=BLUE, alpha=0.25, lw=0, label="25 – 75 %")
    axes.axvline(median, color=INK, lw=0.8, label="median")
    metric_axis(axes, label, values, vertical=False)
    axes.set(ylabel="Samples")


def _bins(values: FloatArray) -> list[float]:
    """Edges of the bars: √n of them, equally wide as drawn; one around what is constant."""
    if limits := constant_limits(values):
        return list(limits)
    count = len(np.histogram_bin_edges(values, bins="sqrt"))
    space = np.geomspace if logarithmic(values) else np.linspace
    return [float(edge) for edge in space(values.min(), values.max(), count)]

"""Pictures of a sweep: FRF map, percentile bands, loci, metrics, sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray
from scipy.stats import rankdata

from ..report.style import BLUE, INK, KIND_COLORS, MUTED, VERMILLION, WIDTH, styled
from .metrics import decibels
from .output import Sweep, Writer

FloatArray = NDArray[np.float64]

MAP_COLUMNS, MAP_ROWS = 1200, 400
PERCENTILES = (5, 25, 50, 75, 95)
LINES_AT_ONCE = 512  # one page of a file holds as many
RANKED = 15  # sensitivities shown
ROUND_OFF = 1e-9  # a metric that varies less is constant
NEGLIGIBLE = 1e-6  # not worth a bar: round-off is far below


def pictures(sweep: Sweep) -> dict[str, Writer]:
    """File name → what writes the picture; only those the sweep has data for."""
    drawn: dict[str, Callable[[Sweep, Figure], None]] = {}
    if sweep.has_frf and len(_varying(sweep)) == 1 and not sweep.design.sampled:
        drawn["frf_map.svg"] = _frf_map
    if sweep.has_frf and sweep.design.sampled:
        drawn["bands.svg"] = _bands
    if sweep.outcome.frequency_hz.size and _varying(sweep):
        drawn["frequencies.svg"] = _loci
    if _metrics_shown(sweep):
        drawn["metrics.svg"] = _metrics
    if any(abs(s.value) > NEGLIGIBLE for s in sensitivities(sweep)):
        drawn["sensitivity.svg"] = _sensitivity
    return {name: _writer(sweep, draw) for name, draw in drawn.items()}


def _metrics_shown(sweep: Sweep) -> dict[str, NDArray[np.intp]]:
    """Metrics to draw, over one parameter or as drawn samples spread; and the samples with one."""
    if not sweep.design.sampled and len(_varying(sweep)) != 1:
        return {}
    with_value = {
        name: np.flatnonzero(sweep.outcome.ok & np.isfinite(column))
        for name, column in sweep.metrics.items()
    }
    return {name: rows for name, rows in with_value.items() if len(rows)}


def _writer(sweep: Sweep, draw: Callable[[Sweep, Figure], None]) -> Writer:
    def write(path: Path) -> None:
        with styled():
            figure = Figure(figsize=(WIDTH, 0.55 * WIDTH), layout="constrained")
            draw(sweep, figure)
            figure.savefig(path, format="svg", facecolor="white", metadata={"Date": None}, dpi=150)

    return write


def _varying(sweep: Sweep) -> list[int]:
    """Parameters that take more than one value."""
    return [k for k in range(len(sweep.design.paths)) if np.ptp(sweep.values[:, k]) > 0.0]


def _logarithmic(values: FloatArray) -> bool:
    """Whether values are better shown on a logarithmic axis."""
    return bool(values.min() > 0.0 and values.max() / values.min() > 20.0)


def _parameter_axis(axes: Axes, name: str, values: FloatArray, *, vertical: bool) -> None:
    scale = "log" if _logarithmic(values) else "linear"
    if vertical:
        axes.set(ylabel=name, yscale=scale)
    else:
        axes.set(xlabel=name, xscale=scale)
    if scale == "log":
        axis = axes.yaxis if vertical else axes.xaxis
        axis.set_major_formatter(FuncFormatter(_number))
        axis.set_minor_formatter(NullFormatter())


def _number(value: float, _: object = None) -> str:
    """A tick's number: 12000 or 1e5, not 100000 or 1e+05."""
    text = f"{value:.6g}" if abs(value) < 1e5 else f"{value:.3g}"
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}e{int(exponent)}" if e else text


def _metric_axis(axes: Axes, name: str, values: FloatArray, *, vertical: bool) -> None:
    """A metric's scale and short numbers; what is constant up to round-off is drawn so."""
    scale = "log" if _logarithmic(values) else "linear"
    low, high = float(values.min()), float(values.max())
    constant = high - low <= ROUND_OFF * max(abs(low), abs(high))
    half = 0.05 * abs(low) or 1.0
    limits = (low - half, high + half) if constant else None
    if vertical:
        axes.set(ylabel=name, yscale=scale, ylim=limits)
    else:
        axes.set(xlabel=name, xscale=scale, xlim=limits)
    axis = axes.yaxis if vertical else axes.xaxis
    axis.set_major_formatter(FuncFormatter(_number))
    axis.set_minor_formatter(NullFormatter())


def _frf_map(sweep: Sweep, figure: Figure) -> None:
    """The FRF over frequency and the parameter; each column is the highest of its lines."""
    (k,) = _varying(sweep)
    rows = np.flatnonzero(sweep.outcome.ok)
    rows = rows[np.argsort(sweep.values[rows, k], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, MAP_ROWS).astype(int))]
    starts = np.unique(np.linspace(0, len(sweep.frequency) - 1, MAP_COLUMNS).astype(int))
    level = decibels(
        np.array([np.maximum.reduceat(sweep.outcome.magnitude[row], starts) for row in rows])
    )
    low, high = np.percentile(level[np.isfinite(level)], (1.0, 99.5))
    axes = figure.subplots()
    picture = axes.pcolormesh(
        sweep.frequency[starts],
        sweep.values[rows, k],
        level,
        shading="nearest",
        cmap="viridis",
        vmin=low,
        vmax=high,
        rasterized=True,
    )
    _parameter_axis(axes, sweep.design.paths[k], sweep.values[rows, k], vertical=True)
    axes.grid(visible=False)
    axes.set(xlabel="frequency, Hz", title=f"{sweep.title}: {sweep.frf_name}")
    figure.colorbar(picture, label="|H|, dB re 1 m/N")


def _bands(sweep: Sweep, figure: Figure) -> None:
    """Percentiles of |H| over the samples, line by line."""
    levels = percentiles(sweep.outcome.magnitude, np.flatnonzero(sweep.outcome.ok))
    axes = figure.subplots()
    for low, high, alpha, name in ((0, 4, 0.2, "5 – 95 %"), (1, 3, 0.4, "25 – 75 %")):
        axes.fill_between(
            sweep.frequency, levels[low], levels[high], color=BLUE, alpha=alpha, lw=0, label=name
        )
    axes.plot(sweep.frequency, levels[2], color=INK, lw=0.8, label="median")
    axes.set(xlabel="frequency, Hz", ylabel="|H|, dB re 1 m/N")
    axes.set_title(f"{sweep.title}: {sweep.frf_name}, {sweep.outcome.ok.sum()} samples")
    axes.legend(ncols=3)


def percentiles(magnitude: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
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


def _loci(sweep: Sweep, figure: Figure) -> None:
    """Natural frequencies over each parameter that varies (up to four), coloured by kind."""
    shown = _varying(sweep)[:4]
    ok = sweep.outcome.ok
    frequency, kind = sweep.outcome.frequency_hz[ok], sweep.outcome.kind[ok]
    all_axes = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for k, axes in zip(shown, all_axes, strict=True):
        values = np.broadcast_to(sweep.values[ok, k][:, None], frequency.shape)
        for name, color in KIND_COLORS.items():
            mask = (kind == str(name)) & (frequency > 0.0)
            if mask.any():
                axes.plot(
                    values[mask], frequency[mask], ".", ms=5, color=color, label=str(name), mew=0
                )
        _parameter_axis(axes, sweep.design.paths[k], sweep.values[ok, k], vertical=False)
    all_axes[0].set(ylabel="natural frequency, Hz", title=sweep.title)
    if all_axes[0].get_legend_handles_labels()[0]:
        all_axes[0].legend(markerscale=2)


@dataclass(frozen=True)
class Sensitivity:
    """How a metric follows a parameter: a logarithmic slope, or a rank correlation."""

    metric: str
    parameter: str
    value: float


def sensitivities(sweep: Sweep) -> tuple[Sensitivity, ...]:
    """Those of the metrics, then those of the natural frequencies; each by size."""
    frequencies = enumerate(sweep.outcome.frequency_hz.T, start=1)
    return (
        *_ranked(sweep, {name: _ratio(name, column) for name, column in sweep.metrics.items()}),
        *_ranked(sweep, {f"f{k}": column for k, column in frequencies}),
    )


def _ratio(name: str, column: FloatArray) -> FloatArray:
    """A metric as a ratio: what is in dB as the amplitude it stands for."""
    return np.asarray(10.0 ** (column / 20.0)) if name.endswith("_db") else column


def _ranked(sweep: Sweep, columns: Mapping[str, FloatArray]) -> list[Sensitivity]:
    """∂log m/∂log p if one parameter varies (mean over its range), else Spearman's ρ; by size.

    Of the samples that have a value; a metric that is zero or negative somewhere has none.
    """
    measure = log_slope if is_slope(sweep) else spearman
    found = []
    for name, column in columns.items():
        rows = sweep.outcome.ok & np.isfinite(column)
        if rows.sum() < 2 or (column[rows] <= 0.0).any():
            continue
        found += [
            Sensitivity(name, sweep.design.paths[k], measure(sweep.values[rows, k], column[rows]))
            for k in _varying(sweep)
        ]
    return sorted(found, key=lambda s: -abs(s.value))


def is_slope(sweep: Sweep) -> bool:
    """Whether sensitivities are slopes: one positive parameter varies."""
    varying = _varying(sweep)
    return len(varying) == 1 and bool((sweep.values[:, varying[0]] > 0.0).all())


def log_slope(parameter: FloatArray, metric: FloatArray) -> float:
    """Slope of the line through (log p, log metric), least squares."""
    p, m = np.log(parameter), np.log(metric)
    p, m = p - p.mean(), m - m.mean()
    return float(p @ m / (p @ p)) if p.any() else 0.0


def spearman(parameter: FloatArray, metric: FloatArray) -> float:
    """Spearman's rank correlation ρ; 0 where either does not vary."""
    # what differs by round-off only does not vary
    p, m = (rankdata(np.round(x / np.abs(x).max(), 11)) for x in (parameter, metric))
    p, m = p - p.mean(), m - m.mean()
    size = np.sqrt((p @ p) * (m @ m))
    return float(p @ m / size) if size > 0.0 else 0.0


def _sensitivity(sweep: Sweep, figure: Figure) -> None:
    """The largest sensitivities of metrics and of natural frequencies, one bar each."""
    largest = [s for s in sensitivities(sweep) if abs(s.value) > NEGLIGIBLE]
    of_metrics = [s for s in largest if s.metric in sweep.metrics]
    of_frequencies = [s for s in largest if s.metric not in sweep.metrics]
    panels = [panel[:RANKED] for panel in (of_metrics, of_frequencies) if panel]
    rows = max(map(len, panels), default=1)
    figure.set_size_inches(WIDTH, 1.2 + 0.26 * rows)
    all_axes = figure.subplots(1, max(len(panels), 1), squeeze=False)[0]
    measure = "|∂log metric/∂log parameter|" if is_slope(sweep) else "|Spearman's ρ|"
    for axes, shown in zip(all_axes, panels, strict=False):
        _bars(axes, shown, rows)
        axes.set(xlabel=measure)
    all_axes[0].set_title(f"{sweep.title}: sensitivities (blue: grows with the parameter)")


def _bars(axes: Axes, shown: Sequence[Sensitivity], rows: int) -> None:
    values = [abs(s.value) for s in shown]
    colors = [BLUE if s.value >= 0.0 else VERMILLION for s in shown]
    axes.barh(range(len(shown)), values, color=colors)
    axes.set_yticks(range(len(shown)), [f"{s.metric} ← {s.parameter}" for s in shown])
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_xlim(0.0, 1.15 * max(values))  # room for the numbers
    for row, s in enumerate(shown):
        axes.annotate(
            f" {s.value:+.2g}", (abs(s.value), row), va="center", color=MUTED, fontsize="small"
        )


def _metrics(sweep: Sweep, figure: Figure) -> None:
    """Each metric: over the parameter that varies, or how often it is where samples are drawn."""
    shown = _metrics_shown(sweep)
    across = min(len(shown), 3)
    down = -(-len(shown) // across)
    figure.set_size_inches(WIDTH, 0.4 + 2.4 * down)
    panels = figure.subplots(down, across, squeeze=False).ravel()
    for axes, (name, rows) in zip(panels, shown.items(), strict=False):
        column = sweep.metrics[name]
        if sweep.design.sampled:
            _spread(axes, name, column[rows])
        else:
            (k,) = _varying(sweep)
            order = rows[np.argsort(sweep.values[rows, k], kind="stable")]
            axes.plot(sweep.values[order, k], column[order], ".-", color=BLUE, ms=3, lw=0.8)
            _parameter_axis(axes, sweep.design.paths[k], sweep.values[order, k], vertical=False)
            _metric_axis(axes, name, column[rows], vertical=True)
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    what = f": {sweep.frf_name}" if sweep.has_frf else ""
    panels[0].set_title(f"{sweep.title}{what}")
    if sweep.design.sampled:
        panels[0].legend()


def _spread(axes: Axes, name: str, values: FloatArray) -> None:
    """A histogram with its median and the ranges that hold half and 90 % of the samples."""
    low, quarter, median, three_quarters, high = np.percentile(values, PERCENTILES)
    edges = np.histogram_bin_edges(values, bins="sqrt")
    if _logarithmic(values):
        edges = np.geomspace(values.min(), values.max(), len(edges))
    axes.hist(values, bins=edges.tolist(), color=MUTED)
    axes.axvspan(low, high, color=BLUE, alpha=0.15, lw=0, label="5 – 95 %")
    axes.axvspan(quarter, three_quarters, color=BLUE, alpha=0.25, lw=0, label="25 – 75 %")
    axes.axvline(median, color=INK, lw=0.8, label="median")
    _metric_axis(axes, name, values, vertical=False)
    axes.set(ylabel="samples")

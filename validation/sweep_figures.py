"""Pictures of a sweep: FRF map, percentile bands, frequency loci, sensitivities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray
from scipy.stats import rankdata

from .report.style import BLUE, INK, KIND_COLORS, MUTED, VERMILLION, WIDTH, styled
from .sweep_output import Sweep, Writer

FloatArray = NDArray[np.float64]

MAP_COLUMNS, MAP_ROWS = 1200, 400
RANKED = 15  # sensitivities shown
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
    if sensitivities(sweep):
        drawn["sensitivity.svg"] = _sensitivity
    return {name: _writer(sweep, draw) for name, draw in drawn.items()}


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
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def _frf_map(sweep: Sweep, figure: Figure) -> None:
    """The FRF over frequency and the parameter; each column is the highest of its lines."""
    (k,) = _varying(sweep)
    rows = np.flatnonzero(sweep.outcome.ok)
    rows = rows[np.argsort(sweep.values[rows, k], kind="stable")]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, MAP_ROWS).astype(int))]
    starts = np.unique(np.linspace(0, len(sweep.frequency) - 1, MAP_COLUMNS).astype(int))
    level = np.maximum.reduceat(sweep.level_db[rows], starts, axis=1)
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
    levels = np.percentile(sweep.level_db[sweep.outcome.ok], (5, 25, 50, 75, 95), axis=0)
    axes = figure.subplots()
    for low, high, alpha, name in ((0, 4, 0.2, "5 – 95 %"), (1, 3, 0.4, "25 – 75 %")):
        axes.fill_between(
            sweep.frequency, levels[low], levels[high], color=BLUE, alpha=alpha, lw=0, label=name
        )
    axes.plot(sweep.frequency, levels[2], color=INK, lw=0.8, label="median")
    axes.set(xlabel="frequency, Hz", ylabel="|H|, dB re 1 m/N")
    axes.set_title(f"{sweep.title}: {sweep.frf_name}, {sweep.outcome.ok.sum()} samples")
    axes.legend(ncols=3)


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
    """∂log f/∂log p if one parameter varies (mean over its range), else Spearman's ρ; by size."""
    ok = sweep.outcome.ok
    varying = _varying(sweep)
    if ok.sum() < 2 or not varying:
        return ()
    slopes = is_slope(sweep)
    measure = log_slope if slopes else spearman
    metrics = {f"f{k}": column for k, column in enumerate(sweep.outcome.frequency_hz.T, start=1)}
    if sweep.has_frf:
        metrics["frequency of the peak"] = sweep.metrics["peak_hz"]
        metrics["rms"] = sweep.metrics["rms_m_per_n"]
    found = [
        Sensitivity(name, sweep.design.paths[k], measure(sweep.values[ok, k], column[ok]))
        for name, column in metrics.items()
        for k in varying
        if np.isfinite(column[ok]).all() and (column[ok] > 0.0).all()
    ]
    return tuple(sorted(found, key=lambda s: -abs(s.value)))


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
    """The largest sensitivities, one bar each."""
    shown = [s for s in sensitivities(sweep) if abs(s.value) > NEGLIGIBLE][:RANKED]
    values = [abs(s.value) for s in shown]
    colors = [BLUE if s.value >= 0.0 else VERMILLION for s in shown]
    axes = figure.subplots()
    axes.barh(range(len(shown)), values, color=colors)
    axes.set_yticks(range(len(shown)), [f"{s.metric} ← {s.parameter}" for s in shown])
    axes.invert_yaxis()
    for row, s in enumerate(shown):
        axes.annotate(
            f" {s.value:+.2g}", (abs(s.value), row), va="center", color=MUTED, fontsize="small"
        )
    measure = "|∂log metric/∂log parameter|" if is_slope(sweep) else "|Spearman's ρ|"
    axes.set(xlabel=f"{measure}; blue: grows with the parameter", title=sweep.title)

"""How much each metric and natural frequency follows each varied parameter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata

from ..arrays import FloatArray
from .axes import varying
from .result import SweepResult


@dataclass(frozen=True)
class Sensitivity:
    """How a metric follows a parameter: a logarithmic slope, or a rank correlation."""

    metric: str
    parameter: str
    value: float


def sensitivities(sweep: SweepResult) -> tuple[Sensitivity, ...]:
    """Those of the metrics, then those of the natural frequencies; each by size."""
    frequencies = enumerate(sweep.results.frequency_hz.T, start=1)
    return (
        *_ranked(sweep, {name: _ratio(name, column) for name, column in sweep.metrics.items()}),
        *_ranked(sweep, {f"f{k}": column for k, column in frequencies}),
    )


def _ratio(name: str, column: FloatArray) -> FloatArray:
    """A metric as a ratio: what is in dB as the amplitude it stands for."""
    return np.asarray(10.0 ** (column / 20.0)) if name.endswith("_db") else column


def _ranked(sweep: SweepResult, columns: Mapping[str, FloatArray]) -> list[Sensitivity]:
    """∂log m/∂log p if one parameter varies (mean over its range), else Spearman's ρ; by size.

    Of the samples that have a value; a metric that is zero or negative somewhere has none.
    """
    measure = log_slope if is_slope(sweep) else spearman
    values = []
    for name, column in columns.items():
        rows = sweep.results.ok & np.isfinite(column)
        if rows.sum() < 2 or (column[rows] <= 0.0).any():
            continue
        values += [
            Sensitivity(name, sweep.samples.paths[k], measure(sweep.values[rows, k], column[rows]))
            for k in varying(sweep)
        ]
    return sorted(values, key=lambda s: -abs(s.value))


def is_slope(sweep: SweepResult) -> bool:
    """Whether sensitivities are slopes: one positive parameter varies."""
    along = varying(sweep)
    return len(along) == 1 and bool((sweep.values[:, along[0]] > 0.0).all())


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

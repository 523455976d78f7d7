"""What is asked of a sweep, and what it finds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ..routes.bands import Band
from .metrics import Metric, ModeMetric, columns
from .parameters import Values

FloatArray = NDArray[np.float64]

REFERENCE_STEP = 1e3  # reference springs of one sweep are this factor apart


@dataclass(frozen=True)
class Task:
    """What is computed of every sample; made by `task`, hashable and small enough to send.

    Attributes
    ----------
    model
        The drivetrain as JSON.
    paths
        The varied parameters.
    anchors
        Of each varied coupling spring the middle of its values, on a logarithmic scale (N/m);
        None for other parameters.
    band, response, excitation
        The FRF asked for; no labels, no FRF.
    n_modes
        How many natural frequencies.
    route
        Where M, C, K come from: exudyn or equations.
    metrics
        Scalars computed of every sample.
    """

    model: str
    paths: tuple[str, ...]
    anchors: tuple[float | None, ...]
    band: Band
    response: str | None = None
    excitation: str | None = None
    n_modes: int = 10
    route: str = "exudyn"
    metrics: tuple[Metric, ...] = ()

    @property
    def n_lines(self) -> int:
        """Lines of the FRF; 0 if none is asked for."""
        return len(self.band.frequency()) if self.response else 0

    @property
    def modes_needed(self) -> float:
        """How many of the first modes matter: inf if those of a kind are counted."""
        asked = [metric for metric in self.metrics if isinstance(metric, ModeMetric)]
        return max(self.n_modes, *(math.inf if m.kind else m.number for m in asked), 0)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a sweep finds, sample by sample; NaN and "" where a sample failed.

    Attributes
    ----------
    status
        (n,) "ok", or why the sample failed.
    magnitude
        (n, n_frequency) |H| (m/N).
    frequency_hz, kind
        (n, n_modes) natural frequencies and kinds of modes.
    metrics
        (n, n_column) values of the task's metrics.
    """

    status: NDArray[np.str_]
    magnitude: FloatArray
    frequency_hz: FloatArray
    kind: NDArray[np.str_]
    metrics: FloatArray

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which samples succeeded."""
        return np.asarray(self.status == "ok")


def blank(task: Task, n_samples: int, magnitude: FloatArray | None = None) -> Outcome:
    """Room for the results of some samples; |H| goes to fresh memory, or where it is told to."""
    if magnitude is None:
        magnitude = np.empty((n_samples, task.n_lines))
    return Outcome(
        np.full(n_samples, "ok"),
        magnitude,
        np.full((n_samples, task.n_modes), np.nan),
        np.full((n_samples, task.n_modes), "", dtype="U24"),
        np.full((n_samples, len(columns(task.metrics))), np.nan),
    )


def failed(task: Task, n_samples: int, why: str) -> Outcome:
    """Samples that all failed, and why."""
    outcome = blank(task, n_samples)
    outcome.magnitude.fill(np.nan)
    return replace(outcome, status=np.full(n_samples, why))


def joined(outcomes: Sequence[Outcome]) -> Outcome:
    """Outcomes of some samples, one after the other."""
    names = [field.name for field in fields(Outcome)]
    return Outcome(*(np.concatenate([getattr(o, name) for o in outcomes]) for name in names))


def reference(anchor: float, stiffness: float) -> float:
    """k₀ of a stiffness: anchor · 1000ⁿ, the nearest to it; 0 for none."""
    if stiffness <= 0.0:
        return stiffness
    n = round(math.log(stiffness / anchor) / math.log(REFERENCE_STEP))
    return float(anchor * REFERENCE_STEP**n)


def base_values(task: Task, values: Values) -> Values:
    """A sample's values with every varied coupling spring at its reference."""
    return tuple(
        value if anchor is None else reference(anchor, value)
        for value, anchor in zip(values, task.anchors, strict=True)
    )

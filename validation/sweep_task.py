"""What is asked of a sweep, and what it finds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .results import Band
from .sweep_parameters import Values

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
    """

    model: str
    paths: tuple[str, ...]
    anchors: tuple[float | None, ...]
    band: Band
    response: str | None = None
    excitation: str | None = None
    n_modes: int = 10
    route: str = "exudyn"


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
    """

    status: NDArray[np.str_]
    magnitude: FloatArray
    frequency_hz: FloatArray
    kind: NDArray[np.str_]

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which samples succeeded."""
        return np.asarray(self.status == "ok")


def blank(task: Task, n_samples: int) -> Outcome:
    """Room for the results of some samples, all of them yet to come."""
    n_lines = len(task.band.frequency()) if task.response else 0
    return Outcome(
        np.full(n_samples, "ok"),
        np.full((n_samples, n_lines), np.nan),
        np.full((n_samples, task.n_modes), np.nan),
        np.full((n_samples, task.n_modes), "", dtype="U24"),
    )


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

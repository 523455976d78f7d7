"""What is asked of a sweep, and what is computed of its samples."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from fbs.errors import unknown_dof
from mbs_models.model.parameters import Drivetrain
from mbs_models.stages.part import Kind

from ..arrays import BoolArray, FloatArray
from ..errors import CommandError
from ..routes.bands import Band
from ..routes.memory import MOST_BYTES
from ..routes.model_parameters import model_data
from .metrics import Metric, ModeMetric, columns, metrics
from .parameters import Samples, Values

MOST_MODES = 1000
KIND = np.dtype(f"U{max(map(len, Kind))}")
REFERENCE_STEP = 1e3  # reference springs of one sweep are this factor apart


@dataclass(frozen=True)
class SweepPlan:
    """What is computed of every sample; made by `sweep_plan`, hashable and small enough to send.

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


def sweep_plan(
    drivetrain: Drivetrain,
    samples: Samples,
    band: Band,
    pair: tuple[str, str] | None = None,
    n_modes: int = 10,
    route: str = "exudyn",
    asked: Sequence[str] = (),
    *,
    streamed: bool = False,
) -> SweepPlan:
    """What is computed of some samples.

    Parameters
    ----------
    drivetrain, samples
        What is varied, and how.
    band, pair
        Lines, response and excitation of the FRF; no pair, no FRF.
    n_modes
        How many natural frequencies.
    route
        exudyn or equations.
    asked
        Metrics as `metrics.metrics` reads them.
    streamed
        Whether |H| goes to a file piece by piece, and may exceed `MOST_BYTES`.

    Raises
    ------
    CommandError
        There is no such route or metric, nothing to stream, or the result would be too large.
    FbsError
        There is no such DoF.
    """
    if route not in ("exudyn", "equations"):
        raise CommandError(f"--route = {route!r}: must be exudyn or equations")
    if not 0 <= n_modes <= MOST_MODES:
        raise CommandError(f"--modes = {n_modes}: must be from 0 to {MOST_MODES}")
    if streamed and pair is None:
        raise CommandError("--stream: there is no FRF; give --response and --excitation")
    if not any(path.endswith(".planets") for path in samples.paths):  # else samples know others
        known = drivetrain.dof_radii()
        for label in pair or ():
            if label not in known:
                raise unknown_dof(label, tuple(known), "the drivetrain")
    frequency = band.frequency() if pair else None
    n_kept = 0 if frequency is None or streamed else len(frequency)
    _require_memory(len(samples.rows), n_kept, n_modes)
    springs = {
        f"{c.name}.{key}"
        for c in drivetrain.couplings
        for key in ("first_stiffness", "second_stiffness")
    }
    anchors = tuple(
        _anchor([sample[i] for sample in samples.rows]) if path in springs else None
        for i, path in enumerate(samples.paths)
    )
    response, excitation = pair or (None, None)
    model = json.dumps(model_data(drivetrain))
    return SweepPlan(
        model, samples.paths, anchors, band, response, excitation, n_modes, route,
        metrics(asked, frequency),
    )  # fmt: skip


def _require_memory(n_samples: int, n_lines: int, n_modes: int) -> None:
    """Refuse a table that takes more than `MOST_BYTES`."""
    size = n_samples * (8.0 * n_lines + (8.0 + KIND.itemsize) * n_modes)
    if size > MOST_BYTES:
        stream = ", or --stream to write lines to disk piece by piece" if n_lines else ""
        raise CommandError(
            f"{n_samples} samples of {n_lines} lines and {n_modes} modes take {size / 1e9:.1f} "
            f"GB, more than {MOST_BYTES / 1e9:g} GB; give a larger --df, a narrower band, fewer "
            f"--modes or fewer samples{stream}"
        )


def dof_pair(response: str | None, excitation: str | None) -> tuple[str, str] | None:
    """The FRF asked for, if any.

    Raises
    ------
    CommandError
        Only one of the two is given.
    """
    if response is None and excitation is None:
        return None
    if response is None or excitation is None:
        raise CommandError("--response and --excitation: give both, or neither")
    return response, excitation


def _anchor(values: Sequence[float]) -> float:
    positive = [value for value in values if value > 0.0]
    return math.sqrt(min(positive) * max(positive)) if positive else 0.0


@dataclass(frozen=True, eq=False)
class SampleResults:
    """What is computed, sample by sample; NaN and "" where a sample failed.

    Attributes
    ----------
    status
        (n,) "ok", or why the sample failed.
    magnitude
        (n, n_frequency) |H| (m/N).
    frequency_hz, kind
        (n, n_modes) natural frequencies and kinds of modes.
    metrics
        (n, n_column) values of the plan's metrics.
    """

    status: NDArray[np.str_]
    magnitude: FloatArray
    frequency_hz: FloatArray
    kind: NDArray[np.str_]
    metrics: FloatArray

    @property
    def ok(self) -> BoolArray:
        """Which samples succeeded."""
        return np.asarray(self.status == "ok")


def blank(plan: SweepPlan, n_samples: int, magnitude: FloatArray | None = None) -> SampleResults:
    """Room for the results of some samples; |H| goes to fresh memory, or where it is told to."""
    if magnitude is None:
        magnitude = np.empty((n_samples, plan.n_lines))
    return SampleResults(
        np.full(n_samples, "ok"),
        magnitude,
        np.full((n_samples, plan.n_modes), np.nan),
        np.full((n_samples, plan.n_modes), "", dtype=KIND),
        np.full((n_samples, len(columns(plan.metrics))), np.nan),
    )


def failed(plan: SweepPlan, n_samples: int, why: str) -> SampleResults:
    """Samples that all failed, and why."""
    results = blank(plan, n_samples)
    results.magnitude.fill(np.nan)
    return replace(results, status=np.full(n_samples, why))


def joined(pieces: Sequence[SampleResults]) -> SampleResults:
    """Results of some samples, one after the other."""
    names = [field.name for field in fields(SampleResults)]
    return SampleResults(*(np.concatenate([getattr(o, name) for o in pieces]) for name in names))


def reference(anchor: float, stiffness: float) -> float:
    """k₀ of a stiffness: anchor · 1000ⁿ, the nearest to it; 0 for none."""
    if stiffness <= 0.0:
        return stiffness
    n = round(math.log(stiffness / anchor) / math.log(REFERENCE_STEP))
    return float(anchor * REFERENCE_STEP**n)


def base_values(plan: SweepPlan, values: Values) -> Values:
    """A sample's values with every varied coupling spring at its reference."""
    return tuple(
        value if anchor is None else reference(anchor, value)
        for value, anchor in zip(values, plan.anchors, strict=True)
    )

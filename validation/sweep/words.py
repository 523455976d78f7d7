"""A sweep in words: what was computed, what was found, what failed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mbs_models.model.parameters import Drivetrain

from ..routes.source import equations_source
from .metrics import BandMetric
from .output import Sweep
from .task import base_values


def conclusions(sweep: Sweep) -> tuple[str, ...]:
    """What to say of a sweep on the screen."""
    ok = sweep.outcome.ok
    how = f"; {method(sweep)}" if sweep.has_frf else ""
    said = [f"{sweep.title}: {ok.sum()} of {len(ok)} samples computed{how}"]
    if ok.any() and sweep.metrics:
        what = f"{sweep.frf_name}: " if sweep.has_frf else ""
        said.append(f"{what}{'percentiles 5, 50, 95' if sweep.design.sampled else 'range'}")
        said += [_of_metric(sweep, name, column) for name, column in sweep.metrics.items()]
    return tuple(said)


def failures(sweep: Sweep, most: int) -> tuple[str, ...]:
    """The samples that failed, each with its parameters and the reason."""
    failed = np.flatnonzero(~sweep.outcome.ok)
    told = [
        f"sample {i} ({sample_in_words(sweep, i)}): {sweep.outcome.status[i]}"
        for i in failed[:most]
    ]
    if len(failed) > most:
        told.append(f"{len(failed) - most} more samples failed: see sweep.csv")
    return tuple(told)


def hints(sweep: Sweep, drivetrain: Drivetrain) -> tuple[str, ...]:
    """What a reader of the metrics should know."""
    of_peaks = any(isinstance(metric, BandMetric) for metric in sweep.task.metrics)
    if not (of_peaks and equations_source(drivetrain).whole.undamped):
        return ()
    return (
        "the model has no damping: how high a peak is depends on how near a line it lies; give the "
        "model [damping], or ask for frequency:N, level:F and drop:F",
    )


def method(sweep: Sweep) -> str:
    """How the FRFs were computed."""
    bases = len({base_values(sweep.task, values) for values in sweep.design.samples})
    joined = any(anchor is not None for anchor in sweep.task.anchors)
    springs = ", the varied springs joined by interface solves" if joined else ""
    return f"FRFs solved line by line and coupled {bases} times{springs}"


def sample_in_words(sweep: Sweep, sample: int | np.integer) -> str:
    """The parameters of a sample."""
    pairs = zip(sweep.design.paths, sweep.design.samples[sample], strict=True)
    return ", ".join(f"{path} = {in_words(value)}" for path, value in pairs)


def in_words(value: object) -> str:
    """A number to six digits; anything else as it is."""
    return f"{value:.6g}" if isinstance(value, int | float | np.number) else str(value)


def _of_metric(sweep: Sweep, name: str, column: NDArray[np.float64]) -> str:
    """A metric's percentiles, or its extremes and where they are."""
    rows = np.flatnonzero(sweep.outcome.ok & np.isfinite(column))
    if not len(rows):
        return f"  {name}: no sample has one"
    missing = int(sweep.outcome.ok.sum()) - len(rows)
    note = f" ({missing} samples have none)" if missing else ""
    if sweep.design.sampled:
        percentiles = (in_words(value) for value in np.percentile(column[rows], (5, 50, 95)))
        return f"  {name}: {', '.join(percentiles)}{note}"
    low, high = rows[np.argmin(column[rows])], rows[np.argmax(column[rows])]
    if in_words(column[low]) == in_words(column[high]):
        return f"  {name}: {in_words(column[low])} throughout{note}"
    ends = (f"{in_words(column[i])} at {sample_in_words(sweep, i)}" for i in (low, high))
    return f"  {name}: {' … '.join(ends)}{note}"

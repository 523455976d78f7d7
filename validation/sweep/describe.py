"""A sweep in sentences: what was computed, what failed, what to mind."""

from __future__ import annotations

import numpy as np

from ..routes.source import equations_source
from .metrics import BandMetric
from .plan import base_values
from .result import SweepResult


def verdict(sweep: SweepResult) -> str:
    """How many samples were computed, of which FRF."""
    ok = sweep.results.ok
    of_what = f": {sweep.frf_name}" if sweep.has_frf else ""
    return f"{ok.sum()} of {len(ok)} samples computed{of_what}"


def failures(sweep: SweepResult, most: int) -> tuple[str, ...]:
    """The samples that failed, each with its parameters and the reason."""
    failed = np.flatnonzero(~sweep.results.ok)
    described = [
        f"sample {i} ({describe_sample(sweep, i)}): {sweep.results.status[i]}"
        for i in failed[:most]
    ]
    if len(failed) > most:
        described.append(f"{len(failed) - most} more samples failed: see sweep.csv")
    return tuple(described)


def hints(sweep: SweepResult) -> tuple[str, ...]:
    """What a reader of the metrics should know."""
    of_peaks = any(isinstance(metric, BandMetric) for metric in sweep.plan.metrics)
    if not (of_peaks and equations_source(sweep.drivetrain).whole.undamped):
        return ()
    return (
        "the model has no damping: how high a peak is depends on how near a line it lies; give the "
        "model [damping], or ask for frequency:N, level:F and drop:F",
    )


def method(sweep: SweepResult) -> str:
    """How the FRFs were computed."""
    bases = len({base_values(sweep.plan, values) for values in sweep.samples.rows})
    joined = any(anchor is not None for anchor in sweep.plan.anchors)
    springs = ", the varied springs joined by interface solves" if joined else ""
    return f"FRFs solved line by line and coupled {bases} times{springs}"


def describe_sample(sweep: SweepResult, sample: int | np.integer) -> str:
    """The parameters of a sample."""
    pairs = zip(sweep.samples.paths, sweep.samples.rows[sample], strict=True)
    return ", ".join(f"{path} = {describe_value(value)}" for path, value in pairs)


def describe_value(value: object) -> str:
    """A number to six digits; anything else as it is."""
    return f"{value:.6g}" if isinstance(value, int | float | np.number) else str(value)

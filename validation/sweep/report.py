"""sweep.html: what a sweep found, in one file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbs_models.model.model_file import dumps
from mbs_models.model.parameters import Drivetrain

from ..report.pages import environment
from ..report.provenance import Provenance
from .figures import Picture
from .output import Sweep
from .parameters import known_parameters
from .words import failures, hints, in_words, method, sample_in_words

MOST_FAILURES = 20  # in the table
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ParameterRow:
    """A varied parameter: as the model has it, its values' range and how many there are."""

    path: str
    nominal: str
    lowest: str
    highest: str
    count: int


@dataclass(frozen=True)
class MetricRow:
    """A metric: percentiles of samples drawn, or the extremes of a grid and where they are."""

    name: str
    values: tuple[str, ...]
    missing: int


def sweep_html(
    sweep: Sweep, drivetrain: Drivetrain, pictures: Sequence[Picture], made: Provenance
) -> str:
    """The text of sweep.html."""
    return (
        environment()
        .get_template("sweep.html")
        .render(
            sweep=sweep,
            source=drivetrain.source,
            method=method(sweep),
            computed=int(sweep.outcome.ok.sum()),
            parameters=_parameters(sweep, drivetrain),
            metrics=[_metric(sweep, name, column) for name, column in sweep.metrics.items()],
            pictures=pictures,
            failures=failures(sweep, MOST_FAILURES),
            hints=hints(sweep, drivetrain),
            model=dumps(drivetrain),
            made=made,
        )
    )


def _parameters(sweep: Sweep, drivetrain: Drivetrain) -> list[ParameterRow]:
    known = known_parameters(drivetrain)
    return [
        ParameterRow(
            path,
            in_words(known[path]),
            in_words(values.min()),
            in_words(values.max()),
            len(np.unique(values)),
        )
        for path, values in zip(sweep.design.paths, sweep.values.T, strict=True)
    ]


def _metric(sweep: Sweep, name: str, column: FloatArray) -> MetricRow:
    rows = np.flatnonzero(sweep.outcome.ok & np.isfinite(column))
    missing = int(sweep.outcome.ok.sum()) - len(rows)
    if not len(rows):
        return MetricRow(name, (), missing)
    if sweep.design.sampled:
        found = np.percentile(column[rows], (5, 50, 95))
        return MetricRow(name, tuple(map(in_words, found)), missing)
    low, high = rows[np.argmin(column[rows])], rows[np.argmax(column[rows])]
    ends = [(in_words(column[i]), sample_in_words(sweep, i)) for i in (low, high)]
    return MetricRow(name, tuple(text for end in ends for text in end), missing)

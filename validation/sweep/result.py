"""What a sweep finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .labels import parameter_labels, unit_of
from .metrics import columns, labels
from .parameters import Samples
from .plan import SampleResults, SweepPlan

if TYPE_CHECKING:
    from .figures import SweepPicture

LISTED_FAILURES = 5  # told one by one


@dataclass(frozen=True, eq=False)
class SweepResult:
    """A sweep and what it found.

    Attributes
    ----------
    drivetrain
        As it is, before anything is varied.
    plan, samples, results
        What was computed, of which samples, and what came out.
    streamed
        The file |H| went to; None: it is part of the results.
    seconds
        How long each step took.
    """

    files: ClassVar = ("sweep.html", "sweep.json")
    checks: ClassVar[tuple[Check, ...]] = ()

    drivetrain: Drivetrain
    plan: SweepPlan
    samples: Samples
    results: SampleResults
    streamed: Path | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The drivetrain's name."""
        return self.drivetrain.name

    @property
    def has_frf(self) -> bool:
        """Whether an FRF was asked for."""
        return self.plan.response is not None

    @property
    def frf_name(self) -> str:
        """The FRF asked for, response first."""
        return f"{self.plan.response} ← {self.plan.excitation}"

    @cached_property
    def frequency(self) -> FloatArray:
        """(n_frequency,) Hz."""
        return self.plan.band.frequency()

    @cached_property
    def values(self) -> FloatArray:
        """(n_sample, n_parameter)."""
        return np.array(self.samples.rows, dtype=float)

    @property
    def metrics(self) -> dict[str, FloatArray]:
        """Column → (n_sample,) values."""
        return dict(zip(columns(self.plan.metrics), self.results.metrics.T, strict=True))

    @cached_property
    def parameter_labels(self) -> tuple[str, ...]:
        """Of each parameter, for an axis: its words and unit."""
        return parameter_labels(self.drivetrain, self.samples.paths)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Of each parameter; empty of a number of things."""
        return tuple(unit_of(self.drivetrain, path) for path in self.samples.paths)

    @cached_property
    def metric_labels(self) -> dict[str, str]:
        """Column → its words and unit."""
        return labels(self.plan.metrics)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Samples that failed, and what a reader of the metrics should know."""
        from .describe import failures, hints

        return (*failures(self, LISTED_FAILURES), *hints(self))

    @cached_property
    def pictures(self) -> tuple[SweepPicture, ...]:
        """Drawn once, for the page and as files."""
        from .figures import pictures

        return pictures(self)

    def page(self) -> Page:
        """What sweep.html says."""
        from .sections import sweep_page

        return sweep_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What sweep.json holds."""
        from .document import sweep_document

        return sweep_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """The table as CSV and npz, and the pictures."""
        from .files import tables

        return tables(self) | {picture.file: picture.text for picture in self.pictures}

"""What a comparison of reductions finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from ..arrays import ComplexArray, FloatArray
from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .plan import ReductionPlan


@dataclass(frozen=True)
class Trial:
    """A method with a number of coordinates.

    Attributes
    ----------
    method, size
        Which, and how many.
    error, bound
        Largest true and largest guaranteed error, dB or scaled; infinite where there is none.
    unbounded
        Lines without a guarantee.
    reason
        Why there is no such reduction; empty if there is.
    """

    method: str
    size: int
    error: float
    bound: float
    unbounded: int
    reason: str = ""


@dataclass(frozen=True, eq=False)
class ReducedFrf:
    """An FRF of the choice, (n_frequency,) each: reduced, exact, and errors in dB or scaled."""

    pair: tuple[str, str]
    reduced: ComplexArray
    exact: ComplexArray
    bound: FloatArray
    error: FloatArray


@dataclass(frozen=True, eq=False)
class ReductionResult:
    """What a comparison of reductions finds.

    Attributes
    ----------
    plan
        What was asked.
    frequency
        (n_frequency,) Hz.
    dofs
        Of the stage.
    trials
        Methods and sizes.
    choice
        The least size whose FRFs are guaranteed to meet the tolerance, else the least that does;
        None: none does.
    frfs
        Of the choice.
    checks, warnings, seconds
        Verdicts, what to mind, and how long it took.
    """

    files: ClassVar = ("reduction.html", "reduction.json")

    plan: ReductionPlan
    frequency: FloatArray
    dofs: int
    trials: tuple[Trial, ...]
    choice: Trial | None
    frfs: tuple[ReducedFrf, ...]
    checks: tuple[Check, ...]
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        """Whether no true error exceeds its bound."""
        return all(check.agrees for check in self.checks)

    @property
    def methods(self) -> tuple[str, ...]:
        """In the order of the trials."""
        return tuple(dict.fromkeys(trial.method for trial in self.trials))

    def least(self, method: str, *, guaranteed: bool) -> Trial | None:
        """The least size that meets the tolerance."""
        limit = self.plan.tolerance.value
        found = (
            t
            for t in self.trials
            if t.method == method and (t.bound if guaranteed else t.error) <= limit
        )
        return min(found, key=lambda t: t.size, default=None)

    def page(self) -> Page:
        """What reduction.html says."""
        from .sections import reduction_page  # pictures take their time to load

        return reduction_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What reduction.json holds."""
        from .document import reduction_document

        return reduction_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """Nothing else."""
        return {}

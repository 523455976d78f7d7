"""What `crosscheck explain` finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .fit import Change, Explanation, covariance
from .identifiability import Identifiability, SeparatingFrf
from .plan import ExplanationPlan
from .search import Answer

SIGMAS = 2.0  # of an interval: 95 %


@dataclass(frozen=True, eq=False)
class ExplanationResult:
    """What is found.

    Attributes
    ----------
    plan
        What was asked.
    answer
        What the difference comes from.
    identifiability
        What the evidence can tell.
    separating
        For each explanation like the best, by its number, the FRF that would tell; None: none.
    seconds
        How long each step took.
    """

    files: ClassVar = ("explanation.html", "explanation.json")

    plan: ExplanationPlan
    answer: Answer
    identifiability: Identifiability
    separating: tuple[SeparatingFrf | None, ...]
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to mind about the files."""
        return self.plan.warnings

    @property
    def agrees(self) -> bool:
        """Whether there is no difference, or one that is explained."""
        return self.answer.settled

    @property
    def checks(self) -> tuple[Check, ...]:
        """Whether noise or round-off is all that is left."""
        from .describe import check  # it needs this module

        return (check(self),)

    @cached_property
    def intervals(self) -> Mapping[str, tuple[float, float]]:
        """95 % intervals of the best explanation's parameters, by name: at its first place."""
        best = self.answer.best
        if not best.changes:
            return {}
        spread = SIGMAS * np.sqrt(np.diag(covariance(best)))
        return {
            change.parameter.name: _interval(change, float(s))
            for change, s in zip(best.changes, spread, strict=True)
        }

    @property
    def first_explanations(self) -> tuple[Explanation, ...]:
        """The best, and those the evidence cannot tell from it."""
        return (self.answer.best, *self.answer.alike)

    def page(self) -> Page:
        """What explanation.html says."""
        from .sections import explanation_page  # pictures take their time to load

        return explanation_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What explanation.json holds."""
        from .document import explanation_document

        return explanation_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """Nothing else."""
        return {}


def _interval(change: Change, spread: float) -> tuple[float, float]:
    ends = (change.parameter.value(change.log + s * spread) for s in (-1.0, 1.0))
    low, high = sorted(ends)
    return low, high

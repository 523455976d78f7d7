"""The study of an explanation: search, what the evidence can tell, what would tell more."""

from __future__ import annotations

from dataclasses import replace

from ..runtime.clock import Clock
from ..runtime.progress import Progress
from .candidates import parameters
from .fit import Explanation
from .identifiability import Identifiability, identifiability, separating_frf
from .plan import ExplanationPlan
from .result import ExplanationResult
from .search import MOST_CAUSES, explain

MOST_ALIKE = 8


def run(asked: ExplanationPlan, progress: Progress) -> ExplanationResult:
    """Find what a difference comes from, and what the evidence can tell of the model.

    Raises
    ------
    FbsError
        A line lies on an undamped pole of the model (named).
    """
    clock = Clock()
    answer = clock.timed("search", lambda: explain(asked.case, asked.candidates, progress))
    answer = replace(answer, alike=answer.alike[:MOST_ALIKE])
    progress("what the data can tell", MOST_CAUSES, MOST_CAUSES + 1)
    told = clock.timed(
        "identifiability",
        lambda: _told(asked, answer.best),
    )
    separating = clock.timed(
        "separating FRFs",
        lambda: tuple(separating_frf(answer.best, other) for other in answer.alike),
    )
    progress("what the data can tell", MOST_CAUSES + 1, MOST_CAUSES + 1)
    return ExplanationResult(asked, answer, told, separating, clock.seconds)


def _told(asked: ExplanationPlan, best: Explanation) -> Identifiability:
    """What the evidence tells of the candidates where they explain it best."""
    names = {candidate.name for candidate in asked.candidates}
    there = [p for p in parameters(best.case.drivetrain) if p.name in names]
    return identifiability(best.case.thinned(), there, best.remainder)

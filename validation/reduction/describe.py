"""A comparison of reductions in sentences and tables."""

from __future__ import annotations

import math

from ..report.page import Table
from .result import ReductionResult, Trial


def verdict(result: ReductionResult) -> str:
    """The outcome in a sentence."""
    plan, choice = result.plan, result.choice
    asked, end = error_words(result, plan.tolerance.value), f"to {plan.band.fmax:g} Hz"
    if not result.agrees:
        return "A true error exceeds its bound: the guarantee is broken"
    if choice is None:
        return f"No reduction tried meets {asked} {end}"
    kept = f"{choice.method} with {choice.size} of {result.dofs} coordinates"
    if choice.bound <= plan.tolerance.value:
        return f"{kept} is guaranteed to meet {asked} {end}"
    return f"{kept} meets {asked} {end} as measured; no reduction tried is guaranteed to"


def conclusions(result: ReductionResult) -> tuple[str, ...]:
    """What else matters."""
    choice = result.choice
    if choice is None:
        return ()
    fewest = [t for m in result.methods if (t := result.least(m, guaranteed=False)) is not None]
    least = min(fewest, key=lambda t: t.size)
    sentences = [f"Its true error is {error_words(result, choice.error)}."]
    if least.size < choice.size:
        found = error_words(result, least.error)
        sentences.append(f"As measured, {least.method} with {least.size} does: {found}.")
    return tuple(sentences)


def error_words(result: ReductionResult, error: float) -> str:
    """An error with its unit."""
    if not math.isfinite(error):
        return "none"
    return f"{error:.2g}{' scaled' if result.plan.tolerance.scaled else ' dB'}"


def least_table(result: ReductionResult) -> Table:
    """The least size of every method."""
    rows = []
    for method in result.methods:
        measured, guaranteed = (result.least(method, guaranteed=yes) for yes in (False, True))
        rows.append((method, _trial(result, measured), _trial(result, guaranteed)))
    headings = ("method", "fewest coordinates as measured", "fewest guaranteed")
    return Table(headings, tuple(rows), frozenset({1, 2}))


def _trial(result: ReductionResult, trial: Trial | None) -> str:
    return "–" if trial is None else str(trial.size)


def size_table(result: ReductionResult, *, guaranteed: bool) -> Table:
    """Errors, method by size."""
    found = {(t.method, t.size): t for t in result.trials}
    methods = result.methods
    rows = []
    for size in sorted({t.size for t in result.trials}):
        cells = []
        for method in methods:
            trial = found.get((method, size))
            error = math.nan if trial is None else trial.bound if guaranteed else trial.error
            cells.append("" if trial is None else "–" if math.isinf(error) else f"{error:.2g}")
        rows.append((str(size), *cells))
    return Table(("size", *methods), tuple(rows), frozenset(range(len(methods) + 1)))


def reason_table(result: ReductionResult) -> Table:
    """Why a method has no reduction of some sizes."""
    reasons: dict[tuple[str, str], list[str]] = {}
    for trial in result.trials:
        if trial.reason:
            words = trial.reason.partition(";")[0]
            reasons.setdefault((trial.method, words), []).append(str(trial.size))
    rows = tuple((method, ", ".join(sizes), words) for (method, words), sizes in reasons.items())
    return Table(("method", "sizes", "why there is none"), rows)

"""From a difference to causes: gross ones and single parameters first, then two, then three."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..runtime.progress import Progress, silent
from .candidates import Case, Parameter, parameters, steps_of
from .evidence import NEGLIGIBLE, FrfEvidence
from .file_hypotheses import Hypothesis, file_hypotheses
from .fit import (
    FAILURES,
    Change,
    Explanation,
    fitted,
    log_likelihood_ratio,
    scanned,
)
from .matrix_hypotheses import matrix_hypotheses
from .model_hypotheses import model_hypotheses

MOST_CAUSES = 3
FITTED = 8  # candidates of one cause, best by their scan, that are fitted on all lines
BEAM = 4  # explanations of one cause from which two are looked for, and of two for three
SCANNED = 16  # causes to add, by their slope
SECONDS = 4  # causes added to each, best by their scan, and as many by their slope
ALIKE = math.log(1e3)  # ln of a likelihood ratio below which two explanations are one answer
ALMOST_ALL = 1.0 - 1e-12  # a share of 1 would gain without end
TOLD = math.log(1e2)  # that another cause must gain beyond its number of parameters' ln n/2


@dataclass(frozen=True, eq=False)
class Answer:
    """What a difference comes from.

    Attributes
    ----------
    before
        The model as it is.
    best
        The sparsest explanation that leaves no structure, or that leaves least.
    alike
        Others that these data cannot tell from it.
    others
        What comes next, best first.
    settled
        Whether nothing but noise or round-off is left.
    """

    before: Explanation
    best: Explanation
    alike: tuple[Explanation, ...]
    others: tuple[Explanation, ...]
    settled: bool

    @property
    def agrees(self) -> bool:
        """Whether there is nothing to explain."""
        return self.settled and not self.best.causes

    @property
    def explained(self) -> float:
        """Share of the difference, of mean squares beyond the noise, that is explained."""
        noise = min(self.best.remainder.noise**2, self.best.power) if self.settled else 0.0
        before = self.before.power - noise
        return 1.0 - max(self.best.power - noise, 0.0) / before if before > 0.0 else 1.0

    @property
    def margin(self) -> float:
        """ln of how much more likely the best is than the next that is another answer."""
        return log_likelihood_ratio(self.best, self.others[0]) if self.others else math.inf


def explain(
    case: Case, candidates: Sequence[Parameter] | None = None, progress: Progress = silent
) -> Answer:
    """The sparsest explanation of what a case's residual shows.

    Parameters
    ----------
    case
        The model against the evidence.
    candidates
        Parameters that may be wrong; None: all.
    progress
        Told the steps.
    """
    before = Explanation(case)
    chosen = parameters(case.drivetrain) if candidates is None else tuple(candidates)
    if not _unfinished(before, chosen):
        return Answer(before, before, (), (), True)
    found = _first(case, chosen, progress)
    if not before.remainder.structured and not _gains(before, found[0]):
        return Answer(before, before, (), (), True)
    for number in range(2, MOST_CAUSES + 1):
        best = found[0]
        if not _unfinished(best, chosen):
            break
        progress(f"looking for {number} causes", number, MOST_CAUSES + 1)
        more = _more(found[:BEAM], chosen, number)
        if not more or not _gains(best, more[0]):
            break
        found = sorted((*more, *found), key=_rank)
    best = found[0]
    same = [other for other in found[1:] if _alike(best, other)]
    rest = [other for other in found[1:] if other not in same and other.causes <= best.causes]
    return Answer(
        before, best, tuple(_distinct(same)), tuple(rest[:FITTED]), not best.remainder.structured
    )


def _rank(explanation: Explanation) -> tuple[float, bool, int, int]:
    """What is left, to what is alike; of equals the one that says less."""
    left = math.log(max(explanation.power, explanation.case.evidence.alike**2))
    paths = sum(len(change.parameter.paths) for change in explanation.changes)
    return (round(left, 3), explanation.remainder.structured, explanation.free, paths)


def _alike(best: Explanation, other: Explanation) -> bool:
    if other.causes > best.causes:
        return False
    if best.remainder.structured or other.remainder.structured:
        return False
    if max(best.power, other.power) <= best.case.evidence.alike**2:
        return True
    return log_likelihood_ratio(best, other) < ALIKE


def _gains(one: Explanation, more: Explanation) -> bool:
    """Whether another cause is worth its parameters: BIC, and a likelihood ratio of 100."""
    cost = _cost(more.remainder.effective, max(more.free - one.free, 1))
    return log_likelihood_ratio(more, one) > cost


def _unfinished(explanation: Explanation, candidates: Sequence[Parameter]) -> bool:
    """Whether more than noise is left, or noise that goes with a candidate's slope.

    A slope that has the share ρ² of a residual takes n/2·ln 1/(1 − ρ²) of its likelihood's
    logarithm: what another cause must gain. Sharp resonances a little moved keep no phase from line
    to line where few lines lie in each, but they go with a slope.
    """
    remainder = explanation.remainder
    if remainder.structured or remainder.rms <= NEGLIGIBLE:
        return remainder.structured
    if not isinstance(explanation.case.evidence, FrfEvidence):
        return False
    others = _others(explanation, candidates)
    share = max((each for _, each in _slopes(explanation, explanation.case, others)), default=0.0)
    n = remainder.effective
    return share > 0.0 and -0.5 * n * math.log1p(-min(share, ALMOST_ALL)) > _cost(n, 1)


def _others(explanation: Explanation, candidates: Sequence[Parameter]) -> list[Parameter]:
    """Candidates, as they are after the explanation's causes, that it does not change yet."""
    names = {p.name for p in candidates}
    own = {path for change in explanation.changes for path in change.parameter.paths}
    there = parameters(explanation.case.drivetrain)
    return [p for p in there if p.name in names and not own & set(p.paths)]


def _cost(n: float, free: int) -> float:
    """BIC's of so many numbers more, and a likelihood ratio of 100."""
    return 0.5 * free * math.log(max(n, 2.0)) + TOLD


def _distinct(found: Iterable[Explanation]) -> list[Explanation]:
    return list({each.key: each for each in reversed(list(found))}.values())[::-1]


def hypotheses(case: Case) -> list[Hypothesis]:
    """All gross causes that this kind of evidence can have."""
    data = file_hypotheses if isinstance(case.evidence, FrfEvidence) else matrix_hypotheses
    return [*data(case), *model_hypotheses(case)]


def _first(case: Case, candidates: Sequence[Parameter], progress: Progress) -> list[Explanation]:
    """Explanations by one cause, best first: on some lines all, on all lines the best."""
    little = case.thinned()
    ranked: list[tuple[float, Hypothesis | Change]] = []
    progress("trying gross causes", 0, MOST_CAUSES + 1)
    for hypothesis in hypotheses(little):
        try:
            power = float(np.mean(hypothesis.undone(little).residual ** 2))
        except FAILURES:
            continue
        ranked.append((power, hypothesis))
    progress("trying parameters", 1, MOST_CAUSES + 1)
    for parameter in candidates:
        power, log = scanned(little, parameter)
        ranked.append((power, Change(parameter, log)))
    ranked.sort(key=lambda each: each[0])
    start = Explanation(case)
    found = []
    for _, cause in ranked[: 2 * FITTED]:
        if isinstance(cause, Hypothesis):
            found.append(Explanation(cause.undone(case), (cause.words,)))
        elif len(found) < FITTED + len([e for e in found if e.gross]):
            fit = fitted(start, [cause])
            found += [fit] if fit is not None else []
    return sorted(_safe(found), key=_rank)


def _safe(found: Iterable[Explanation]) -> list[Explanation]:
    kept = []
    for each in found:
        try:
            _ = each.power
        except FAILURES:
            continue
        kept.append(each)
    return kept


def _more(
    beam: Sequence[Explanation], chosen: Sequence[Parameter], number: int
) -> list[Explanation]:
    """Explanations by one cause more than those given, best first."""
    found: list[Explanation] = []
    for explanation in beam:
        if explanation.causes != number - 1:
            continue
        found += _added(explanation, chosen)
        if any(not each.remainder.structured for each in found):
            break
    return sorted(found, key=_rank)


def _added(explanation: Explanation, chosen: Sequence[Parameter]) -> list[Explanation]:
    """An explanation with one cause more: its best parameters, by scan and by slope."""
    case = explanation.case
    candidates = _others(explanation, chosen)
    little = case.thinned()
    by_name = {p.name: p for p in candidates}
    steepest = _steepest(explanation, candidates)
    scans = {name: scanned(little, by_name[name]) for name in steepest}
    best = sorted(scans, key=lambda name: scans[name][0])[:SECONDS] + steepest[:SECONDS]
    thin = replace(explanation, start=explanation.start.thinned())
    fits = []
    for name in dict.fromkeys(best):
        parameter = _original(explanation, by_name[name])
        first = Change(parameter, scans[name][1])
        fit = fitted(thin, [*explanation.changes, first])
        if fit is not None:
            fits.append(fit)
    fits.sort(key=_rank)
    refined = [fitted(replace(explanation, changes=()), fit.changes) for fit in fits[:2]]
    return _safe(fit for fit in refined if fit is not None)


def _original(explanation: Explanation, parameter: Parameter) -> Parameter:
    """The parameter as it is before the explanation's changes, which do not touch it."""
    return next(
        (p for p in parameters(explanation.start.drivetrain) if p.name == parameter.name), parameter
    )


def _steepest(explanation: Explanation, candidates: Sequence[Parameter]) -> list[str]:
    """Those whose slope goes with the residual most."""
    shares = _slopes(explanation, explanation.case.thinned(), candidates)
    order = sorted(shares, key=lambda each: -each[1])[:SCANNED]
    return [name for name, _ in order]


def _slopes(
    explanation: Explanation, case: Case, candidates: Sequence[Parameter]
) -> list[tuple[str, float]]:
    """Each one's name, and the share of the residual's square along its slope.

    Both beyond what the changes made already span.
    """
    residual = case.residual
    active = [c.parameter for c in explanation.changes]
    names = {p.name for p in active}
    kept, systems, steps = steps_of(case, [*active, *candidates])
    slopes = case.evidence.sensitivities(case.system, systems, steps)
    count = len([p for p in kept if p.name in names])
    if count:
        basis = np.linalg.qr(slopes[:, :count])[0]
        slopes = slopes - basis @ (basis.T @ slopes)
        residual = residual - basis @ (basis.T @ residual)
    sizes = np.linalg.norm(slopes[:, count:], axis=0) * np.linalg.norm(residual)
    along = np.abs(residual @ slopes[:, count:]) / np.where(sizes > 0.0, sizes, np.inf)
    return [(p.name, float(a**2)) for p, a in zip(kept[count:], along, strict=True)]

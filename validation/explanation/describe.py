"""An explanation in sentences, as page and terminal say them."""

from __future__ import annotations

import math

from ..checks.check import Check
from ..checks.diagnosis import number
from ..report.page import Table
from ..routes.model_parameters import known_parameters
from .evidence import FEWEST_STEPS, NEGLIGIBLE, FrfEvidence
from .fit import Change, Explanation
from .result import ExplanationResult
from .search import Answer

# Ratios that say more than a percentage
FACTORS = (
    (1e3, "1000 times: N/mm for N/m, or g for kg"),
    (1e-3, "a thousandth: mm for m, or t for kg"),
    (2.0, "twice: a diameter for a radius, or two for one"),
    (0.5, "half: a radius for a diameter, or one for two"),
    (9.80665, "9.81 times: a weight for a mass"),
    (math.pi / 180.0, "degrees read as radians"),
    (180.0 / math.pi, "radians read as degrees"),
)
SAME = 1e-3  # relative: a value that is another one's, or a ratio that is one of these
SHOWN = 12  # names in a sentence


def verdict(result: ExplanationResult) -> str:
    """The outcome in a sentence."""
    answer = result.answer
    if answer.agrees:
        return f"No difference beyond noise and round-off in {result.plan.case.evidence.count}"
    share = percent(answer.explained)
    if not answer.settled:
        return (
            f"None of these: the best explanation takes away {share} of the difference, and what "
            "is left is no noise"
        )
    what = " and ".join(causes(answer.best))
    if answer.alike:
        return f"{what} – or {len(answer.alike)} other changes that these data cannot tell from it"
    return f"{what}: explains {share} of the difference"


def percent(share: float) -> str:
    """A share that is never said to be all where it is not."""
    return f"{100.0 * share:.3g} %" if share < 0.9995 else "all but noise"


def causes(explanation: Explanation) -> list[str]:
    """Its causes in words."""
    return [*explanation.gross, *(change_words(explanation, c) for c in explanation.changes)]


def change_words(explanation: Explanation, change: Change) -> str:
    """``planetary.sun.mass is 0.42 instead of 0.4 (+5 %)``."""
    parameter, value = change.parameter, change.value
    before = parameter.values[0]
    what = f"{parameter.name} is {number(value)} instead of {number(before)}"
    if len(parameter.paths) > 1:
        times, first = number(value / before), parameter.paths[0]
        what = f"{parameter.name}: {times} times, {first} is {number(value)}"
    elif before:
        what += f" ({100.0 * math.expm1(change.log):+.3g} %)"
    told = recognised(explanation, change)
    return f"{what}; {told}" if told else what


def recognised(explanation: Explanation, change: Change) -> str:
    """What a new value is besides: another parameter's, or a usual factor too much."""
    parameter = change.parameter
    if parameter.values[0]:
        ratio = math.exp(change.log)
        for factor, words in FACTORS:
            if abs(ratio / factor - 1.0) < SAME:
                return words
    key = parameter.paths[0].rpartition(".")[2]
    dimension = "inertia" if "inertia" in key or key == "mass" else key.partition("_")[0]
    for path, value in known_parameters(explanation.start.drivetrain).items():
        other = path.rpartition(".")[2]
        like = "inertia" if "inertia" in other or other == "mass" else other.partition("_")[0]
        if (
            isinstance(value, float)
            and path not in parameter.paths
            and dimension == like
            and value
            and abs(change.value / value - 1.0) < SAME
        ):
            return f"that is what {path} has"
    return ""


def conclusions(result: ExplanationResult) -> tuple[str, ...]:
    """What else matters."""
    answer, found = result.answer, []
    for name, (low, high) in result.intervals.items():
        found.append(f"{name}: {number(low)} to {number(high)} (95 %, by what is left).")
    if answer.best.case.system.loss_factor:
        loss = answer.best.case.system.loss_factor
        found.append(f"The loss factor that leaves least is {loss:.4g}.")
    found += _alike(result)
    if answer.others and answer.settled and answer.best.causes:
        found.append(f"The next best, {_named(answer.others[0])}, is {likelihood(answer)}.")
    if not answer.settled:
        best = " and ".join(causes(answer.best))
        if answer.best.causes:
            found.append(f"The best explanation of up to three causes: {best}.")
        evidence = result.plan.case.evidence
        if isinstance(evidence, FrfEvidence) and len(evidence.lines) <= FEWEST_STEPS:
            found.append(
                f"On {len(evidence.lines)} lines noise cannot be told from a difference; that "
                f"takes more than {FEWEST_STEPS}."
            )
        found.append(
            "What is left keeps its phase from line to line, is as large as the FRFs themselves, "
            "or is larger than the digits given: the cause is not among the parameters and gross "
            "causes tried, or there are more."
        )
    large = {c.parameter.name for each in result.first_explanations for c in each.changes}
    invisible = [
        p.name
        for p in result.identifiability.invisible
        if len(p.paths) == 1 and p.name not in large
    ]
    if invisible:
        found.append(
            f"These data cannot tell anything about {listed(invisible)}: small changes of them "
            "move nothing of what was given."
        )
    return tuple(found)


def _alike(result: ExplanationResult) -> list[str]:
    found = []
    for other, frf in zip(result.answer.alike, result.separating, strict=True):
        what = f"These data fit as well: {_named(other)}"
        if frf is None:
            found.append(f"{what}; no FRF between any DoFs in this band tells them apart.")
        else:
            found.append(
                f"{what}; the FRF {frf.response} ← {frf.excitation} would tell, most of all near "
                f"{frf.frequency_hz:.4g} Hz."
            )
    return found


def _named(explanation: Explanation) -> str:
    return " and ".join(causes(explanation))


def likelihood(answer: Answer) -> str:
    """How much less likely the next is: ``more than 1e6 times less likely``."""
    if answer.margin > math.log(1e6):
        return "more than a million times less likely"
    return f"{math.exp(answer.margin):.2g} times less likely"


def listed(names: list[str]) -> str:
    """Names in a row, and how many more there are."""
    shown, more = names[:SHOWN], len(names) - SHOWN
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def check(result: ExplanationResult) -> Check:
    """What is left against what noise or digits may leave."""
    remainder = result.answer.best.remainder
    allowed = max(remainder.noise, NEGLIGIBLE)
    value = min(remainder.rms, allowed) if result.answer.settled else max(remainder.rms, allowed)
    if not result.answer.settled and value <= allowed:
        value = math.nextafter(allowed, math.inf)
    return Check(
        "What the explanation leaves",
        result.plan.case.evidence.count,
        (result.plan.theirs.name, "the model with the causes"),
        "rms residual",
        value,
        allowed,
        "noise that is independent from line to line keeps no phase; of lists and matrices the "
        "digits given",
        () if result.answer.settled else (verdict(result),),
    )


def ranking_table(result: ExplanationResult) -> Table:
    """Explanations tried, best first."""
    answer = result.answer
    rows = []
    before = answer.before.power
    for tag, group in (
        ("best", (answer.best,)), ("as good", answer.alike), ("next", answer.others),
    ):  # fmt: skip
        for each in group:
            share = 1.0 - each.power / before if before else 0.0
            left = "structure" if each.remainder.structured else "noise or round-off"
            numbers = f"{100.0 * share:.5g} %", f"{each.remainder.rms:.2g}"
            rows.append((tag, _named(each), *numbers, left))
    if not answer.best.causes:
        rows = []
    headings = ("", "what is different", "explains", "rms left", "what is left")
    return Table(headings, tuple(rows), frozenset({2, 3}), empty="There is nothing to explain.")


def identifiability_table(result: ExplanationResult) -> Table:
    """Every parameter, and the smallest change of it that the evidence shows."""
    found = result.identifiability
    groups = {p.name: n for n, group in enumerate(found.alike, 1) for p in group}
    rows = [
        (p.name, _change(change, p.unit), _group(groups, p.name))
        for change, p in sorted(
            ((v.smallest_change, v.parameter) for v in found.visible), key=lambda each: each[0]
        )
    ]
    rows += [(p.name, "cannot tell", "") for p in found.invisible]
    return Table(
        ("parameter", "smallest change that shows", "looks like the others of"),
        tuple(rows),
        frozenset({1}),
    )


def _group(groups: dict[str, int], name: str) -> str:
    return f"group {groups[name]}" if name in groups else ""


def _change(change: float, unit: float) -> str:
    if unit:
        return f"{number(change * unit, '.2g')} (from 0)"
    return f"{100.0 * change:.2g} %" if change < 1.0 else "more than 100 %"

"""The page of an explanation: answer, before and after in pictures, ranking, what the data tell."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mbs_models.model.model_file import dumps

from ..report.frf_panel import Curve, Difference, FrfPanel, frf_figure, reference_curve
from ..report.page import (
    Block,
    Bullets,
    Fact,
    Note,
    Page,
    Picture,
    Section,
    Table,
    Verdict,
    Verdicts,
    model_section,
    source_of,
)
from ..report.style import BLUE, VERMILLION
from .describe import (
    conclusions,
    identifiability_table,
    percent,
    ranking_table,
    verdict,
)
from .evidence import FrfEvidence
from .few_numbers import FrequencyEvidence
from .fit import Explanation
from .result import ExplanationResult

DRAWN = 6  # FRFs, those that differ most
METHOD = (
    "A residual is e = (theirs − ours)/(|theirs| + |ours| + 1 % of the line’s level): bounded, so "
    "that no resonance or antiresonance decides alone.",
    "Gross causes are undone one by one; every parameter of the model file is scanned over factors "
    "from 0.01 to 100 and fitted in its logarithm (Gauss–Newton). Where M, C, K are affine in it, "
    "the scan is exact by Woodbury’s formula. Sensitivities are −H (∂Z/∂p) H.",
    "Explanations are ranked by what they leave. A second and a third cause are looked for only "
    "while what is left has structure, and kept if they gain more than BIC asks.",
    "What is left is noise where neither its numbers nor their phases go together from line to "
    "line (5 standard deviations).",
)


def explanation_page(result: ExplanationResult) -> Page:
    """What explanation.html says."""
    plan, answer = result.plan, result.answer
    visible = len(result.identifiability.visible)
    total = visible + len(result.identifiability.invisible)
    return Page(
        eyebrow="Drivetrain cross-check · why they differ",
        heading=plan.drivetrain.name,
        title="explanation",
        source=source_of(plan.drivetrain.source),
        verdict=Verdict(verdict(result), result.agrees),
        conclusions=conclusions(result),
        warnings=result.warnings,
        facts=(
            Fact("Explained", percent(answer.explained), f"of {plan.case.evidence.count}"),
            Fact("Causes", str(answer.best.causes), "the fewest that leave no structure"),
            Fact("Seen", f"{visible} of {total}", "parameters that these data show"),
        ),
        sections=(
            Section("answer", "What is different", (ranking_table(result),)),
            Section("pictures", "Before and after", tuple(_pictures(result))),
            Section("data", "What these data can tell", tuple(_data(result))),
            Section("checks", "Check and method", (Verdicts(result.checks), Bullets(METHOD))),
            model_section(dumps(plan.drivetrain)),
        ),
        timings=result.seconds,
        footer="all numbers are in explanation.json beside it",
    )


def _data(result: ExplanationResult) -> Iterator[Block]:
    told = result.identifiability
    yield (
        f"The sensitivities of {len(told.visible)} visible parameters have rank {told.rank}: so "
        "many changes can be told apart at once."
    )
    yield identifiability_table(result)
    for number, group in enumerate(told.alike, 1):
        yield Note(
            f"Group {number}: small changes of {', '.join(p.name for p in group)} look alike."
        )


def _pictures(result: ExplanationResult) -> Iterator[Block]:
    before, after = result.answer.before, result.answer.best
    if isinstance(before.case.evidence, FrfEvidence):
        yield from _frf_pictures(before, after)
    elif isinstance(before.case.evidence, FrequencyEvidence):
        yield _frequency_table(before, after)
    else:
        yield (
            f"RMS of the entries’ relative differences: {before.remainder.rms:.3g} before, "
            f"{after.remainder.rms:.3g} after."
        )


def _frf_pictures(before: Explanation, after: Explanation) -> Iterator[Block]:
    theirs, corrected = before.case.evidence, after.case.evidence
    assert isinstance(theirs, FrfEvidence)
    assert isinstance(corrected, FrfEvidence)
    ours, new = theirs.ours(before.case.system), corrected.ours(after.case.system)
    first, second = (
        np.hypot(*each.case.residual.reshape(2, *ours.shape)) for each in (before, after)
    )
    theirs_now = "theirs, gross causes undone" if after.gross else "theirs"
    worst = np.argsort(-np.mean(first**2, axis=0), axis=None)[:DRAWN]
    for count, (i, j) in enumerate(zip(*np.unravel_index(worst, ours.shape[1:]), strict=True)):
        name = f"{theirs.frf.responses[i]} ← {theirs.frf.excitations[j]}"
        panel = FrfPanel(
            theirs.lines,
            (
                reference_curve("theirs", theirs.frf.values[:, i, j]),
                Curve("the model as it is", ours[:, i, j], VERMILLION),
            ),
            (
                Difference(
                    "Residual",
                    (
                        Curve("residual before", first[:, i, j], VERMILLION),
                        Curve("residual after", np.maximum(second[:, i, j], 1e-12), BLUE),
                    ),
                    decades=12,
                ),
            ),
            phase=False,
        )
        yield Picture(
            frf_figure(panel, f"before{count}", f"{name}: theirs and ours"), name, "Before"
        )
        if after.causes:
            panel = FrfPanel(
                corrected.lines,
                (
                    reference_curve(theirs_now, corrected.frf.values[:, i, j]),
                    Curve("the model with the causes", new[:, i, j], BLUE),
                ),
            )
            svg = frf_figure(panel, f"after{count}", f"{name}: theirs and ours after the change")
            yield Picture(svg, "", "After")
    if ours[0].size > DRAWN:
        yield Note(f"The {DRAWN} of {ours[0].size} FRFs that differ most.")


def _frequency_table(before: Explanation, after: Explanation) -> Table:
    evidence, corrected = before.case.evidence, after.case.evidence
    assert isinstance(evidence, FrequencyEvidence)
    assert isinstance(corrected, FrequencyEvidence)
    old, new = evidence.modelled(before.case.system), corrected.modelled(after.case.system)
    rows = tuple(
        (
            f"{theirs:g}", f"{a:.6g}", f"{100 * (a / theirs - 1):+.3g} %", f"{b:.6g}",
            f"{100 * (b / fixed - 1):+.2g} %",
        )
        for theirs, fixed, a, b in zip(
            evidence.frequencies_hz, corrected.frequencies_hz, old, new, strict=True
        )
    )  # fmt: skip
    headings = ("theirs, Hz", "model, Hz", "off by", "with the causes, Hz", "off by")
    return Table(headings, rows, frozenset(range(5)))

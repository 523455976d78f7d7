"""The page of a study of truncation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mbs_models.model.model_file import dumps

from ..report.digits import grouped
from ..report.frf_panel import Curve, Difference, FrfPanel, Mode, frf_figure, reference_curve
from ..report.page import (
    Bullets,
    Fact,
    Note,
    Page,
    Picture,
    Section,
    Verdict,
    Verdicts,
    model_section,
    source_of,
)
from ..report.style import BLUE, MUTED, ORANGE, VERMILLION
from .describe import (
    alternative_table,
    conclusions,
    error_words,
    line_table,
    pair_words,
    stage_table,
    verdict,
)
from .result import TruncatedFrf, TruncationResult

DRAWN = 12  # FRFs
METHOD = (
    "Each stage is cut to some of its modes; statics give the residuals of the others. What is "
    "still missing is enclosed by the next residuals and a remainder, without the left-out modes, "
    "and carried through the joints by Woodbury’s formula: exact, and with a norm below 1 of what "
    "the joints make of it the assembly has no further pole. Derivation: fbs.truncation_bound, "
    "fbs.coupled_bound.",
    "Round-off has a share of its own. A bound b of |ΔH| is −20 log₁₀(1 − b/|H|) dB; where b "
    "reaches |H| there is no error in dB.",
    "The smallest basis is searched by the bounds alone. The exact FRFs beside it, solved line by "
    "line with all modes, are only there to be seen.",
)
RULES_NOTE = (
    "Rules of thumb keep every mode of the stages that may be cut up to a multiple of the band’s "
    "end, here without residuals and with the static one."
)


def truncation_page(result: TruncationResult) -> Page:
    """What truncation.html says."""
    plan = result.plan
    agrees = None if result.agrees else False
    return Page(
        eyebrow="Drivetrain cross-check · truncation with a guarantee",
        heading=plan.drivetrain.name,
        title="truncation",
        source=source_of(plan.drivetrain.source),
        verdict=Verdict(verdict(result), agrees),
        conclusions=conclusions(result),
        warnings=result.warnings,
        facts=(
            Fact("Modes", f"{result.kept} of {result.modes}", f"of {', '.join(plan.stages)}"),
            Fact("Guaranteed", error_words(result, result.guaranteed), _asked(result)),
            Fact(
                "Band",
                f"{result.frequency[0]:g}–{result.frequency[-1]:g} Hz",
                f"{grouped(len(result.frequency))} lines, {len(result.frfs)} FRFs",
            ),
        ),
        sections=(
            Section("basis", "Modes that each stage needs", (stage_table(result),)),
            Section("frfs", "Bound and true error", tuple(_pictures(result))),
            Section("lines", "Lines without a guarantee", (line_table(result),)),
            Section(
                "rules", "Other choices and rules of thumb",
                (alternative_table(result), Note(RULES_NOTE)),
            ),
            Section("checks", "Check", (Verdicts(result.checks), Bullets(METHOD))),
            model_section(dumps(plan.drivetrain)),
        ),
        timings=result.seconds,
        footer="bounds and errors of every line are in truncation.json beside it",
    )  # fmt: skip


def _asked(result: TruncationResult) -> str:
    return f"asked: {error_words(result, result.plan.tolerance.value)}"


def _pictures(result: TruncationResult) -> Iterator[Picture | Note]:
    for number, frf in enumerate(result.frfs[:DRAWN]):
        yield Picture(_figure(result, frf, number), pair_words(frf))
    if len(result.frfs) > DRAWN:
        yield Note(f"{len(result.frfs) - DRAWN} more FRFs are in truncation.json.")


def _figure(result: TruncationResult, frf: TruncatedFrf, number: int) -> str:
    label = "Scaled error" if result.plan.tolerance.scaled else "Error (dB)"
    panel = FrfPanel(
        result.frequency,
        (reference_curve("all modes", frf.exact), Curve("modes kept", frf.truncated, BLUE)),
        (
            Difference(
                label,
                (
                    Curve("guaranteed bound", _drawn(frf.bound), VERMILLION, 1.4),
                    Curve("true error", _drawn(frf.error), BLUE, 0.9),
                ),
                allowed=result.plan.tolerance.value,
            ),
        ),
        modes=tuple(
            Mode(stage.stage, float(hertz), ORANGE if kept else MUTED, kept)
            for stage in result.stages
            for kept, hertz in _in_band(result, stage.kept_hz, stage.first_left_out_hz)
        ),
    )  # fmt: skip
    alternative = (
        f"{pair_words(frf)} with all modes and with those kept; below, the guaranteed bound and "
        "the true error"
    )
    return frf_figure(panel, f"frf{number}", alternative)


def _in_band(
    result: TruncationResult, kept: np.ndarray, first: float
) -> Iterator[tuple[bool, float]]:
    low, high = result.frequency[0], result.frequency[-1]
    for hertz in kept:
        if low <= hertz <= high:
            yield True, hertz
    if low <= first <= high:
        yield False, first


def _drawn(error: np.ndarray) -> np.ndarray:
    """A gap where there is no bound."""
    return np.where(np.isfinite(error), error, np.nan)

"""The page of a comparison of reductions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mbs_models.model.model_file import dumps

from ..report.digits import grouped
from ..report.frf_panel import Curve, Difference, FrfPanel, frf_figure, reference_curve
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
from ..report.style import BLUE, VERMILLION
from .describe import conclusions, error_words, least_table, reason_table, size_table, verdict
from .result import ReducedFrf, ReductionResult

METHOD = (
    "Guyan, dynamic (exact at the band’s middle) and IRS keep the ports and the DoFs of least "
    "K_ii/M_ii (Henshell & Ong 1975); SEREP the lowest modes, told apart by pivots; Craig–Bampton, "
    "Rubin, MacNeal and the dual Craig–Bampton the ports and the lowest modes; Krylov the motions "
    "at lines chosen by the residual. Derivations: fbs.reduction, fbs.large.krylov.",
    "Every method’s motions are columns of a matrix: the error of the system projected on them is "
    "bounded by its residual over a distance that damping leaves (fbs.galerkin_bound); where a "
    "method’s matrices are no projection, their difference to it is added.",
    "The exact FRFs are solved line by line. A bound b of |ΔH| is −20 log₁₀(1 − b/|H|) dB; where b "
    "reaches |H| there is none.",
)


def reduction_page(result: ReductionResult) -> Page:
    """What reduction.html says."""
    plan, choice = result.plan, result.choice
    unit = "scaled" if plan.tolerance.scaled else "dB"
    asked = f"asked: {error_words(result, plan.tolerance.value)}"
    found = "none" if choice is None else f"{choice.size} of {result.dofs}"
    guaranteed = "none" if choice is None else error_words(result, choice.bound)
    return Page(
        eyebrow="Drivetrain cross-check · reductions compared",
        heading=f"{plan.drivetrain.name}: {plan.stage}",
        title="reduction",
        source=source_of(plan.drivetrain.source),
        verdict=Verdict(verdict(result), None if result.agrees else False),
        conclusions=conclusions(result),
        warnings=result.warnings,
        facts=(
            Fact("Coordinates", found, "" if choice is None else choice.method),
            Fact("Guaranteed", guaranteed, asked),
            Fact(
                "Band",
                f"{result.frequency[0]:g}–{result.frequency[-1]:g} Hz",
                f"{grouped(len(result.frequency))} lines, {len(plan.ports)} ports: "
                f"{', '.join(plan.ports)}",
            ),
        ),
        sections=(
            Section("least", "Fewest coordinates", (least_table(result),)),
            Section("frfs", "FRFs of the choice", tuple(_pictures(result))),
            Section(
                "sizes", "Method by size",
                (
                    Section("true", f"True error, {unit}", (size_table(result, guaranteed=False),)),
                    Section("bound", f"Guaranteed, {unit}", (size_table(result, guaranteed=True),)),
                    Note("– no reduction of this size, or no guarantee at some line."),
                    reason_table(result),
                ),
            ),
            Section("checks", "Check", (Verdicts(result.checks), Bullets(METHOD))),
            model_section(dumps(plan.drivetrain)),
        ),
        timings=result.seconds,
        footer="errors and bounds of every trial are in reduction.json beside it",
    )  # fmt: skip


def _pictures(result: ReductionResult) -> Iterator[Picture | Note]:
    for number, frf in enumerate(result.frfs):
        yield Picture(_figure(result, frf, number), " ← ".join(frf.pair))
    if not result.frfs:
        yield Note("Nothing meets the tolerance.")


def _figure(result: ReductionResult, frf: ReducedFrf, number: int) -> str:
    label = "Scaled error" if result.plan.tolerance.scaled else "Error (dB)"
    bound = np.where(np.isfinite(frf.bound), frf.bound, np.nan)
    panel = FrfPanel(
        result.frequency,
        (reference_curve("stage", frf.exact), Curve("reduced", frf.reduced, BLUE)),
        (
            Difference(
                label,
                (
                    Curve("guaranteed bound", bound, VERMILLION, 1.4),
                    Curve("true error", frf.error, BLUE, 0.9),
                ),
                allowed=result.plan.tolerance.value,
            ),
        ),
    )  # fmt: skip
    return frf_figure(panel, f"frf{number}", f"{' ← '.join(frf.pair)}, reduced and exact")

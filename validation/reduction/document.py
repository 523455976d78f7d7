"""The numbers of a comparison of reductions."""

from __future__ import annotations

from typing import Any

from ..report.documents import document_head, rounded_lists
from ..report.provenance import Provenance
from .describe import conclusions, verdict
from .result import ReductionResult

CURVE_DIGITS = 6


def reduction_document(result: ReductionResult, made: Provenance) -> dict[str, Any]:
    """Trials, the choice and its curves as nested dicts and lists."""
    plan, choice = result.plan, result.choice
    head = document_head(
        plan.drivetrain, made, verdict=verdict(result), agrees=result.agrees,
        warnings=result.warnings, seconds=result.seconds,
    )  # fmt: skip
    return head | {
        "conclusions": conclusions(result),
        "stage": plan.stage,
        "ports": plan.ports,
        "dofs": result.dofs,
        "tolerance": plan.tolerance.value,
        "measure": "scaled" if plan.tolerance.scaled else "dB",
        "loss_factor_lent": plan.loss_factor,
        "choice": None if choice is None else {"method": choice.method, "size": choice.size},
        "trials": [
            {
                "method": t.method,
                "size": t.size,
                "true_error": t.error,
                "guaranteed": t.bound,
                "lines_without_bound": t.unbounded,
                "reason": t.reason,
            }
            for t in result.trials
        ],
        "frequency_hz": result.frequency,
        "frfs": [
            {
                "response": frf.pair[0],
                "excitation": frf.pair[1],
                "reduced": rounded_lists(frf.reduced, CURVE_DIGITS),
                "exact": rounded_lists(frf.exact, CURVE_DIGITS),
                "bound": rounded_lists(frf.bound, CURVE_DIGITS),
                "true_error": rounded_lists(frf.error, CURVE_DIGITS),
            }
            for frf in result.frfs
        ],
        "checks": result.checks,
    }

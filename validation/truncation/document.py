"""The numbers of a study of truncation."""

from __future__ import annotations

from typing import Any

from fbs import Reason

from ..report.documents import document_head, rounded_lists
from ..report.provenance import Provenance
from .describe import conclusions, verdict
from .result import TruncationResult

CURVE_DIGITS = 6


def truncation_document(result: TruncationResult, made: Provenance) -> dict[str, Any]:
    """Bases, bounds and errors as nested dicts and lists; null where there is no bound."""
    plan = result.plan
    head = document_head(
        plan.drivetrain, made, verdict=verdict(result), agrees=result.agrees,
        warnings=result.warnings, seconds=result.seconds,
    )  # fmt: skip
    return head | {
        "conclusions": conclusions(result),
        "tolerance": plan.tolerance.value,
        "measure": "scaled" if plan.tolerance.scaled else "dB",
        "loss_factor_lent": plan.loss_factor,
        "guaranteed": result.guaranteed,
        "meets": result.meets,
        "stages": [
            {
                "stage": stage.stage,
                "modes": stage.modes,
                "rigid_body_modes": stage.rigid,
                "kept": stage.kept,
                "kept_hz": stage.kept_hz,
                "first_left_out_hz": stage.first_left_out_hz,
                "silent": stage.silent,
                "residual_order": stage.residual_order,
            }
            for stage in result.stages
        ],
        "alternatives": [
            {
                "name": found.name,
                "modes": found.modes,
                "guaranteed": found.bound,
                "true_error": found.error,
                "lines_without_bound": found.unbounded,
            }
            for found in result.alternatives
        ],
        "frequency_hz": result.frequency,
        "no_bound": [
            None if r == Reason.BOUNDED else Reason(r).name.lower() for r in result.reason
        ],
        "frfs": [
            {
                "response": frf.pair[0],
                "excitation": frf.pair[1],
                "truncated": rounded_lists(frf.truncated, CURVE_DIGITS),
                "exact": rounded_lists(frf.exact, CURVE_DIGITS),
                "bound": rounded_lists(frf.bound, CURVE_DIGITS),
                "true_error": rounded_lists(frf.error, CURVE_DIGITS),
                "unreachable_lines": int(lost.sum()),
                "unreachable_hz": result.frequency[lost],
            }
            for frf, lost in zip(result.frfs, result.unreachable, strict=True)
        ],
        "checks": result.checks,
    }

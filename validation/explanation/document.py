"""The numbers of an explanation."""

from __future__ import annotations

from typing import Any

from ..report.documents import document_head
from ..report.provenance import Provenance
from .describe import causes, conclusions, verdict
from .fit import Change, Explanation
from .result import ExplanationResult


def explanation_document(result: ExplanationResult, made: Provenance) -> dict[str, Any]:
    """Answer, ranking and identifiability as nested dicts and lists."""
    plan, answer, told = result.plan, result.answer, result.identifiability
    head = document_head(
        plan.drivetrain, made, verdict=verdict(result), agrees=result.agrees,
        warnings=result.warnings, seconds=result.seconds,
    )  # fmt: skip
    return head | {
        "conclusions": conclusions(result),
        "evidence": plan.case.evidence.count,
        "theirs": plan.theirs.name,
        "ours": None if plan.ours is None else plan.ours.name,
        "stage": plan.stage or None,
        "settled": answer.settled,
        "explained": answer.explained,
        "best": _explanation(answer.best, result),
        "alike": [
            _explanation(other, None)
            | {
                "separated_by": None if frf is None else {
                    "response": frf.response,
                    "excitation": frf.excitation,
                    "frequency_hz": frf.frequency_hz,
                }
            }
            for other, frf in zip(answer.alike, result.separating, strict=True)
        ],
        "others": [_explanation(other, None) for other in answer.others],
        "log_likelihood_ratio_to_next": answer.margin,
        "visible": [
            {"parameter": v.parameter.name, "smallest_change": v.smallest_change}
            for v in told.visible
        ],
        "invisible": [p.name for p in told.invisible],
        "indistinguishable": [[p.name for p in group] for group in told.alike],
        "rank": told.rank,
        "checks": result.checks,
    }  # fmt: skip


def _explanation(explanation: Explanation, result: ExplanationResult | None) -> dict[str, Any]:
    found: dict[str, Any] = {
        "words": causes(explanation),
        "gross": explanation.gross,
        "changes": [_change(change, result) for change in explanation.changes],
        "rms_left": explanation.remainder.rms,
        "structure_left": explanation.remainder.structured,
    }
    return found


def _change(change: Change, result: ExplanationResult | None) -> dict[str, Any]:
    found: dict[str, Any] = {
        "parameters": change.parameter.paths,
        "values": change.parameter.values,
        "first_value": change.value,
        "log_change": change.log,
    }
    if result is not None:
        found["interval"] = result.intervals[change.parameter.name]
    return found

"""Rows of the one table of verdicts: margins on a strip, and reasons as footnotes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..checks.check import Check

MARGIN_DECADES = (-12.0, 6.0)  # value / tolerance that the margin strip spans
SHOWN = 6  # findings of a check that are not folded away


@dataclass(frozen=True)
class VerdictRow:
    """A check, the number of its reason's footnote, and where its value lies on the strip (%)."""

    check: Check
    reason: int
    position: float


@dataclass(frozen=True)
class VerdictTable:
    """All rows, the reasons by their numbers, and where the tolerance lies on the strip (%)."""

    rows: tuple[VerdictRow, ...]
    reasons: tuple[str, ...]
    tolerance_at: float


def verdict_table(checks: Sequence[Check]) -> VerdictTable:
    """What the table shows of some checks."""
    reasons = list(dict.fromkeys(check.reason for check in checks))
    rows = (VerdictRow(c, reasons.index(c.reason) + 1, along_strip(margin(c))) for c in checks)
    return VerdictTable(tuple(rows), tuple(reasons), along_strip(1.0))


def margin(check: Check) -> float:
    """Value / tolerance; infinite where nothing is allowed and something is there."""
    if check.tolerance:
        return check.value / check.tolerance
    return math.inf if check.value > 0.0 else 0.0 if check.value <= 0.0 else math.nan


def along_strip(ratio: float) -> float:
    """Where value / tolerance lies on the margin strip (% of its length)."""
    first, last = MARGIN_DECADES
    if not ratio > 0.0:
        return 100.0 if math.isnan(ratio) else 0.0
    decade = min(max(math.log10(ratio), first), last)
    return round(100.0 * (decade - first) / (last - first), 1)


def telling(check: Check) -> tuple[bool, float]:
    """How telling a disagreement is: one that says where, then the one furthest out."""
    ratio = margin(check)
    return bool(check.findings), math.inf if math.isnan(ratio) else ratio


def in_numbers(check: Check) -> str:
    """What is off, where no finding says it."""
    return (
        f"{check.name.lower()} ({check.subject}): {check.measure} {check.value:.3g}, "
        f"{check.tolerance:.3g} allowed"
    )

"""A check: two routes, a value, a tolerance, a verdict."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One comparison and its verdict.

    Attributes
    ----------
    name, subject
        What was compared, of what.
    routes
        The two routes; the first is the reference.
    measure, value, tolerance, reason
        The number compared, the most it may be, and why that much.
    findings
        Where and by what the routes disagree, in words; empty where they agree.
    note
        What else a reader should know.
    """

    name: str
    subject: str
    routes: tuple[str, str]
    measure: str
    value: float
    tolerance: float
    reason: str
    findings: tuple[str, ...] = ()
    note: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the value is within the tolerance (a NaN is not)."""
        return bool(self.value <= self.tolerance)

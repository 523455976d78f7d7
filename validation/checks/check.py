"""A check: two routes, a value, a tolerance, a verdict."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

# What goes wrong inside a route: matrices that are none, labels that are not there, divisions by 0.
# Whoever asks for lines on poles is told so before, by the reference.
ROUTE_ERRORS = (ValueError, ArithmeticError, LookupError)


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


def failed(name: str, subject: str, routes: tuple[str, str], error: BaseException) -> Check:
    """A route that cannot be computed, of a drivetrain whose reference can: a disagreement."""
    return Check(
        name,
        subject,
        routes,
        "a route that cannot be computed",
        math.inf,
        0.0,
        f"{routes[0]} computes the same drivetrain",
        (f"{routes[1]}: {error} ({type(error).__name__})",),
    )


def or_failed(
    name: str, subject: str, routes: tuple[str, str], compared: Callable[[], list[Check]]
) -> list[Check]:
    """The checks of a comparison, or the one that says that its second route fails."""
    try:
        return compared()
    except ROUTE_ERRORS as error:
        return [failed(name, subject, routes, error)]

"""Whether the routes of the paper's study agree with one another, whatever the paper says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..checks.frfs import FRF_TOLERANCE
from .results import Figure, PaperStudy


@dataclass(frozen=True)
class RouteCheck:
    """Two routes to the same quantity.

    Attributes
    ----------
    subject
        What was compared.
    routes
        By which two ways.
    measure
        What ``value`` is.
    value, tolerance
        The largest difference found, and what it may be.
    where
        Where it was found.
    """

    subject: str
    routes: tuple[str, str]
    measure: str
    value: float
    tolerance: float
    where: str

    @property
    def agrees(self) -> bool:
        """Whether the value is within the tolerance (one that is not a number is not)."""
        return self.value <= self.tolerance


def route_checks(study: PaperStudy) -> tuple[RouteCheck, ...]:
    """Every pair of routes in a study, at its worst."""
    return (
        *_figures(study),
        *_all_frfs(study),
        *_stiffness(study),
        *_locked(study),
        *_untruncated(study),
    )


def compares_routes(figure: Figure) -> bool:
    """Whether a figure's curves are one FRF, each by a route of its own."""
    return len({curve.route for curve in figure.curves}) == len(figure.curves)


def _worst(
    subject: str,
    routes: tuple[str, str],
    found: list[tuple[float, str]],
    tolerance: float = FRF_TOLERANCE,
    measure: str = "scaled error",
) -> Iterator[RouteCheck]:
    """The largest of all values found, and where; none if nothing was."""
    if found:
        at = int(np.argmax([value for value, _ in found]))  # the first NaN, if there is one
        yield RouteCheck(subject, routes, measure, found[at][0], tolerance, found[at][1])


def _figures(study: PaperStudy) -> Iterator[RouteCheck]:
    figures = [figure for figure in study.figures if compares_routes(figure)]
    found: dict[tuple[str, str], list[tuple[float, str]]] = {}
    for figure in figures:
        reference, *others = (curve.route for curve in figure.curves)
        for route, difference in zip(others, figure.differences, strict=True):
            place = f"{figure.id}, {difference.worst_scaled_hz:g} Hz"
            found.setdefault((reference, route), []).append((difference.worst_scaled, place))
    for routes, values in found.items():
        yield from _worst(f"FRFs of {len(values)} pictures", routes, values)


def _all_frfs(study: PaperStudy) -> Iterator[RouteCheck]:
    for claim in study.claims:
        if claim.id == "coupled-equals-full":
            yield from _worst(
                "all FRFs of the drivetrain",
                ("exudyn", "FBS of exudyn stages"),
                [(claim.numbers["worst"], "10 Hz to 15 kHz")],
            )


def _stiffness(study: PaperStudy) -> Iterator[RouteCheck]:
    found = [
        (row.routes_scaled, f"{row.dof.label}, {row.shaft_stiffness:.0e} N/m")
        for row in study.stiffness
    ]
    yield from _worst(f"{len(found)} FRFs over k_sw", ("exudyn", "FBS of exudyn stages"), found)


def _locked(study: PaperStudy) -> Iterator[RouteCheck]:
    checks = study.condensation
    if not checks:
        return
    tolerance = min(check.tolerance for check in checks)
    for other, measure, name in (
        ("blocked matrices", "relative difference of frequencies", "frequency_error"),
        ("blocked matrices", "scaled error", "matrix_error"),
        ("condensation formula", "scaled error", "formula_error"),
    ):
        found = [(getattr(check, name), check.name) for check in checks]
        subject = f"{len(found)} condensed systems"
        yield from _worst(subject, ("exudyn, locked", other), found, tolerance, measure)


def _untruncated(study: PaperStudy) -> Iterator[RouteCheck]:
    rows = study.truncation.rows if study.truncation else ()
    found = [
        (value, frf)
        for row in rows
        if row.left_out == 0 and row.residual_order is None
        for frf, value in row.worst_scaled.items()
    ]
    routes = ("exudyn", "FBS, subsystem B by modal synthesis")
    yield from _worst(f"{len(found)} FRFs with every mode kept", routes, found)

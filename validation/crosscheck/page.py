"""report.html: what the cross-check found, in one file that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mbs_models.modal.mode_kinds import Mode
from mbs_models.model.model_file import dumps

from ..checks.check import Check
from ..checks.frfs import FrfComparison
from ..checks.pole_checks import PoleRow
from ..report.pages import environment
from ..report.provenance import Provenance
from ..report.style import CURVE_COLUMNS, ERROR_COLUMNS, part_colors
from ..routes.time_domain import TimeDomain
from .anatomy import draw_anatomy, first_shown, kinds_drawn, short_frequency
from .error_figures import largest_error, worst_comparison
from .figures import draw_figures
from .results import CrossCheck
from .swap_figures import swap_section
from .time_figures import time_figure
from .words import disagreements, pair_in_words, route_in_words, verdict

MARGIN_DECADES = (-12.0, 6.0)  # value / tolerance that the margin strip spans


def report_html(result: CrossCheck, made: Provenance) -> str:
    """The text of report.html."""
    drivetrain = result.drivetrain
    parts = [part.name for part in drivetrain.items]
    reasons = list(dict.fromkeys(check.reason for check in result.checks))
    worst = worst_comparison(result)
    routes = [result.reference, *(c.route for c in result.comparisons)]
    return (
        environment()
        .get_template("report.html")
        .render(
            result=result,
            made=made,
            verdict=verdict(result),
            disagreements=disagreements(result),
            worst=worst,
            largest_error=largest_error(worst),
            agreed=sum(check.agrees for check in result.checks),
            frf_count=len(result.dofs) ** 2,
            reasons=reasons,
            checks=[_check_row(check, reasons) for check in result.checks],
            tolerance_at=_along_strip(1.0),
            mode_columns=_mode_columns(result),
            modes=[
                _mode_row(mode, pole, result.reference)
                for mode, pole in zip(result.modes.modes, result.poles, strict=True)
            ],
            parts=part_colors(parts),
            comparisons=[_comparison_row(comparison) for comparison in result.comparisons],
            figures=draw_figures(result),
            anatomy=draw_anatomy(result),
            short=short_frequency,
            shape_kinds=kinds_drawn(result),
            shown=first_shown(result),
            time=_time_section(result),
            swap=swap_section(result.swap, result.frequency) if result.swap else None,
            pair_in_words=lambda response, excitation: pair_in_words(
                drivetrain, response, excitation
            ),
            routes={route: route_in_words(route) for route in routes},
            columns=CURVE_COLUMNS,
            error_columns=ERROR_COLUMNS,
            parameters=dumps(drivetrain),
        )
    )


@dataclass(frozen=True)
class TimeSection:
    """The time-domain route: numbers, figure, and whether its damping is not the model's."""

    result: TimeDomain
    svg: str
    borrowed: bool


def _time_section(result: CrossCheck) -> TimeSection | None:
    if result.time_domain is None:
        return None
    borrowed = result.time_domain.damping != result.drivetrain.damping
    return TimeSection(result.time_domain, time_figure(result.time_domain), borrowed)


@dataclass(frozen=True)
class CheckRow:
    """A check, the number of its reason's footnote, and where its value lies on the strip (%)."""

    check: Check
    reason: int
    position: float


@dataclass(frozen=True)
class ModeRow:
    """A mode: the reference's frequency, and every other route's relative difference from it."""

    mode: Mode
    pole: PoleRow
    differences: Mapping[str, float]
    damping_difference: float
    mac_defect: float


@dataclass(frozen=True)
class ComparisonRow:
    """A route's FRFs against the reference's, in numbers."""

    comparison: FrfComparison
    largest: float
    median: float


def _check_row(check: Check, reasons: list[str]) -> CheckRow:
    beyond = math.inf if check.value else 0.0
    ratio = check.value / check.tolerance if check.tolerance else beyond
    return CheckRow(check, reasons.index(check.reason) + 1, _along_strip(ratio))


def _along_strip(ratio: float) -> float:
    """Where value / tolerance lies on the margin strip (% of its length)."""
    first, last = MARGIN_DECADES
    if not ratio > 0.0:
        return 100.0 if math.isnan(ratio) else 0.0
    decade = min(max(math.log10(ratio), first), last)
    return round(100.0 * (decade - first) / (last - first), 1)


def _mode_columns(result: CrossCheck) -> list[str]:
    """The routes that have poles, the reference first."""
    return list(dict.fromkeys(route for pole in result.poles for route in pole.frequency_hz))


def _mode_row(mode: Mode, pole: PoleRow, reference: str) -> ModeRow:
    f = pole.frequency_hz[reference]
    zeta = pole.damping_ratio[reference]
    return ModeRow(
        mode=mode,
        pole=pole,
        differences={
            route: (other - f) / f if f else other
            for route, other in pole.frequency_hz.items()
            if route != reference
        },
        damping_difference=max(abs(other - zeta) for other in pole.damping_ratio.values()),
        mac_defect=max((0.0, *(1.0 - mac for mac in pole.subspace_mac.values()))),
    )


def _comparison_row(comparison: FrfComparison) -> ComparisonRow:
    return ComparisonRow(
        comparison=comparison,
        largest=largest_error(comparison),
        median=float(np.median(comparison.line_max)),
    )

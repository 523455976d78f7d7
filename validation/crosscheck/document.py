"""results.json: every number of the report."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ..checks.check import Check
from ..checks.frfs import FRF_TOLERANCE, FrfComparison
from ..report.curves import relative_difference
from ..report.digits import ERROR_DIGITS, SIGNIFICANT_DIGITS, rounded
from ..report.provenance import Provenance
from .resonances import crossings_document, margins_document, resonances
from .results import CrossCheck
from .swap_json import swap_document
from .time_figures import time_document
from .words import verdict

SCHEMA_VERSION = 1

CONVENTIONS = {
    "frf": "H(w) = (K - w^2 M + j w C)^-1, e^{+jwt}; receptance in m/N",
    "rotations": "carried as w = r*theta (m); the conjugate force is torque / r",
    "scaled_error": "|dH_ij| / sqrt(h_i h_j) per line, h_i the norm of row i of the reference H",
    "relative_difference": "|dH_ij| / |H_ij| per line",
    "frac": "shown, never trusted alone: the few lines at the peaks decide it",
}


def results_text(result: CrossCheck, made: Provenance) -> str:
    """The text of results.json: strict JSON, compact, what is not finite null and named."""
    document = results_document(result, made)
    document["notes"] = [f"{where} is {value}; written as null" for where, value in _odd(document)]
    text = json.dumps(_strict(document), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text + "\n"


def results_document(result: CrossCheck, made: Provenance) -> dict[str, Any]:
    """Everything a report says as nested dicts and lists of numbers."""
    met = resonances(result)
    return {
        "schema_version": SCHEMA_VERSION,
        "model": result.drivetrain.name,
        "source": result.drivetrain.source,
        "agrees": result.agrees,
        "verdict": verdict(result),
        "warnings": list(result.warnings),
        "date": made.date,
        "platform": made.platform,
        "versions": dict(made.versions),
        "timings_s": dict(result.timings),
        "conventions": CONVENTIONS,
        "parameters": result.drivetrain.model_dump(mode="json", by_alias=True, exclude_none=True),
        "checks": [_check(check) for check in result.checks],
        "modes": [_mode(result, number) for number in range(len(result.modes.modes))],
        "band_hz": {"fmin": result.band.fmin, "fmax": result.band.fmax, "df": result.band.df},
        "frequency_hz": rounded(result.frequency, 12),
        "reference": result.reference,
        "dofs": list(result.dofs),
        "frf_tolerance": FRF_TOLERANCE,
        "round_off": rounded(result.round_off, ERROR_DIGITS),
        "comparisons": [_comparison(comparison) for comparison in result.comparisons],
        "kernel_condition": rounded(result.kernel_condition, ERROR_DIGITS),
        "curves": [_curve(result, pair) for pair in result.curves],
        "campbell_crossings": crossings_document(met),
        "operating_speed": margins_document(met),
        "time_domain": time_document(result.time_domain),
        "swap": None if result.swap is None else swap_document(result.swap),
    }


def _check(check: Check) -> dict[str, Any]:
    return {
        "name": check.name,
        "subject": check.subject,
        "routes": list(check.routes),
        "measure": check.measure,
        "value": check.value,
        "tolerance": check.tolerance,
        "reason": check.reason,
        "agrees": check.agrees,
        "findings": list(check.findings),
        "note": check.note,
    }


def _mode(result: CrossCheck, number: int) -> dict[str, Any]:
    mode, pole = result.modes.modes[number], result.poles[number]
    shares = result.component_energy
    return {
        "number": number + 1,
        "kind": str(mode.kind),
        "frequency_hz": dict(pole.frequency_hz),
        "damping_ratio": dict(pole.damping_ratio),
        "subspace_mac": dict(pole.subspace_mac),
        "round_off_hz": pole.round_off_hz,
        "kinetic_shares": dict(mode.shares.kinetic),
        "strain_shares": dict(mode.shares.strain),
        "family_shares": dict(mode.shares.families),
        "component_kinetic_shares": dict(
            zip(shares.bodies, rounded(shares.kinetic[:, number], ERROR_DIGITS), strict=True)
        ),
        "component_strain_shares": dict(
            zip(shares.springs, rounded(shares.strain[:, number], ERROR_DIGITS), strict=True)
        ),
    }


def _comparison(comparison: FrfComparison) -> dict[str, Any]:
    at, response, excitation = comparison.worst
    smallest, curve = comparison.frac
    return {
        "route": comparison.route,
        "worst": {
            "scaled_error": float(comparison.line_max.max()),
            "frequency_hz": at,
            "response": response,
            "excitation": excitation,
        },
        "smallest_frac": {"value": smallest, "curve": curve},
        "line_max": rounded(comparison.line_max, ERROR_DIGITS),
        "line_median": rounded(comparison.line_median, ERROR_DIGITS),
        "pair_max": [rounded(row, ERROR_DIGITS) for row in comparison.pair_max],
    }


def _curve(result: CrossCheck, pair: tuple[str, str]) -> dict[str, Any]:
    by_route = result.curves[pair]
    reference = by_route[result.reference]
    routes = {}
    for route, values in by_route.items():
        routes[route] = {
            "real": rounded(values.real, SIGNIFICANT_DIGITS),
            "imag": rounded(values.imag, SIGNIFICANT_DIGITS),
        }
        if route != result.reference:
            difference = relative_difference(reference, values)
            routes[route]["relative_difference"] = rounded(difference, ERROR_DIGITS)
    return {"response": pair[0], "excitation": pair[1], "receptance_m_per_n": routes}


def _odd(value: Any, where: str = "") -> Iterator[tuple[str, str]]:
    """Names of the numbers that JSON has no word for, and what they are."""
    if isinstance(value, float):
        if not math.isfinite(value):
            yield where, {math.inf: "Infinity", -math.inf: "-Infinity"}.get(value, "NaN")
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _odd(item, f"{where}.{key}" if where else str(key))
    elif isinstance(value, Sequence) and not isinstance(value, str):
        if _all_finite(value):
            return
        for number, item in enumerate(value):
            yield from _odd(item, f"{where}[{number}]")


def _strict(value: Any) -> Any:
    """The same with null for what is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _strict(item) for key, item in value.items()}
    if isinstance(value, list):
        return value if _all_finite(value) else [_strict(item) for item in value]
    return value


def _all_finite(values: Sequence[Any]) -> bool:
    """Whether a list holds finite floats only: long ones are passed over in one go."""
    return all(type(value) is float for value in values) and all(map(math.isfinite, values))

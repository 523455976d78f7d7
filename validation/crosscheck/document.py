"""results.json: the numbers of the report; results.npz: every line of its curves."""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from fbs.measured.quality import Defect

from ..arrays import ComplexArray, FloatArray
from ..checks.frfs import FRF_TOLERANCE, FrfComparison, Pair
from ..checks.metrics import frac
from ..checks.part_uncertainty import Known
from ..checks.peaks import Peak, Resonance
from ..report.curves import relative_difference
from ..report.digits import ERROR_DIGITS
from ..report.documents import check_document, document_head, not_finite, rounded_lists
from ..report.provenance import Provenance
from ..routes.substitution import Substitution
from ..routes.time_domain import TimeDomain
from ..runtime.output_folder import Writer
from .describe import verdict
from .resonances import crossings_document, margins_document
from .result import ARRAYS, Changes, CrossCheck, CurveChange
from .substitution import headline

LEAST_SHARE = 0.01  # of an error, in results.json; all are in results.npz

CONVENTIONS = {
    "frf": "H(w) = (K - w^2 M + j w C)^-1, e^{+jwt}; receptance in m/N",
    "rotations": "carried as w = r*theta (m); the conjugate force is torque / r",
    "scaled_error": "|dH_ij| / sqrt(h_i h_j) per line, h_i the norm of row i of the reference H",
    "relative_difference": "|dH_ij| / |H_ij| per line",
    "frac": "shown, never trusted alone: the few lines at the peaks decide it",
}


def results_document(result: CrossCheck, made: Provenance) -> dict[str, Any]:
    """Everything a report says as nested dicts and lists of numbers."""
    document = {
        **document_head(
            result.drivetrain,
            made,
            verdict=verdict(result),
            agrees=result.agrees,
            warnings=result.warnings,
            seconds=result.timings,
        ),
        "source": result.drivetrain.source,
        "conventions": CONVENTIONS,
        "arrays": ARRAYS,
        "checks": [check_document(check) for check in result.checks],
        "modes": [_mode(result, number) for number in range(len(result.modes.modes))],
        "band_hz": {"fmin": result.band.fmin, "fmax": result.band.fmax, "df": result.band.df},
        "lines": len(result.frequency),
        "reference": result.reference,
        "dofs": result.dofs,
        "frf_tolerance": FRF_TOLERANCE,
        "comparisons": [
            {
                **_comparison(each),
                "smallest_frac": dict(zip(("value", "curve"), each.frac, strict=True)),
            }
            for each in result.comparisons
        ],
        "kernel_condition": _largest(result.frequency, result.kernel_condition),
        "curves": [_curve(result, pair) for pair in result.curves],
        "campbell_crossings": crossings_document(result.resonances),
        "operating_speed": margins_document(result.resonances),
        "time_domain": None if result.time_domain is None else _time(result.time_domain),
        "swap": None if result.substitution is None else _swap(result.substitution),
    }
    document["notes"] = [
        f"{where} is {value}; written as null" for where, value in not_finite(document)
    ]
    return document


def _mode(result: CrossCheck, number: int) -> dict[str, Any]:
    mode, pole = result.modes.modes[number], result.poles[number]
    shares = result.component_energy

    def by_component(names: tuple[str, ...], values: FloatArray) -> dict[str, float]:
        return dict(zip(names, rounded_lists(values[:, number], ERROR_DIGITS), strict=True))

    return {
        "number": number + 1,
        "kind": str(mode.kind),
        "frequency_hz": pole.frequency_hz,
        "damping_ratio": pole.damping_ratio,
        "subspace_mac": pole.subspace_mac,
        "round_off_hz": pole.round_off_hz,
        "kinetic_shares": mode.shares.kinetic,
        "strain_shares": mode.shares.strain,
        "family_shares": mode.shares.families,
        "component_kinetic_shares": by_component(shares.bodies, shares.kinetic),
        "component_strain_shares": by_component(shares.springs, shares.strain),
    }


def _comparison(comparison: FrfComparison) -> dict[str, Any]:
    at, response, excitation = comparison.worst
    return {
        "route": comparison.route,
        "worst": {
            "scaled_error": float(comparison.line_max.max()),
            "frequency_hz": at,
            "response": response,
            "excitation": excitation,
        },
        "median_line": float(np.median(comparison.line_max)),
    }


def _largest(frequency: FloatArray, values: FloatArray) -> dict[str, float] | None:
    if not len(values):
        return None
    line = int(np.argmax(values))
    return {"largest": float(values[line]), "frequency_hz": float(frequency[line])}


def _curve(result: CrossCheck, pair: Pair) -> dict[str, Any]:
    """The reference's extremes, and each route's largest relative difference and FRAC."""
    by_route = result.curves[pair]
    reference = by_route[result.reference]
    size = np.abs(reference)
    routes = {}
    for route, values in by_route.items():
        if route != result.reference:
            difference = relative_difference(reference, values)
            finite = np.flatnonzero(np.isfinite(difference))
            line = int(finite[difference[finite].argmax()]) if finite.size else 0
            routes[route] = {
                "largest_relative_difference": float(difference[line]),
                "at_hz": float(result.frequency[line]),
                "frac": frac(reference, values),
            }
    return {
        "response": pair[0],
        "excitation": pair[1],
        "largest_m_per_n": float(size.max()),
        "largest_at_hz": float(result.frequency[size.argmax()]),
        "smallest_m_per_n": float(size.min()),
        "smallest_at_hz": float(result.frequency[size.argmin()]),
        "routes": routes,
    }


def _time(found: TimeDomain) -> dict[str, Any]:
    return {
        "excitation": found.excitation,
        "responses": found.labels,
        "damping": found.damping,
        "step_s": found.step,
        "periods": found.periods,
        "closure": found.closure,
        "even_share": found.even_share,
        "worst_db": rounded_lists(found.worst_db, 6),
        "worst_degrees": rounded_lists(found.worst_degrees, 6),
    }


def _swap(found: Changes) -> dict[str, Any]:
    return {
        "headline": headline(found),
        "changes": found.changes,
        "parts": [
            {
                "name": each.part,
                "file": each.path,
                "interface": each.interface,
                "left_out": each.left_out,
                "unknown": each.unknown,
                "warnings": each.warnings,
                "doubts": [_doubt(each, defect) for defect in each.quality.defects],
            }
            for each in found.substitutions
        ],
        "responses": found.responses,
        "excitations": found.excitations,
        "worst": _comparison(found.comparison)["worst"],
        "curves": [_change(curve) for curve in found.curves],
        "not_compared": found.not_compared,
        "alone": {
            part: [_change(curve) for curve in curves] for part, curves in found.alone.items()
        },
        "resonances": [_resonance(resonance) for resonance in found.resonances],
        "known": [
            _known(curve, known, found.substitutions[0].frf.frequency)
            for curve in found.curves
            if (known := found.known.get((curve.response, curve.excitation))) is not None
        ],
    }


def _doubt(each: Substitution, defect: Defect) -> dict[str, Any]:
    """A property that does not hold, and the bands (Hz) in which it does not."""
    edges = np.flatnonzero(np.diff(defect.lines.astype(int), prepend=0, append=0))
    axis = each.quality.frequency
    return {
        "property": defect.what,
        "dofs": defect.labels,
        "worst": defect.worst,
        "at_hz": defect.at,
        "bands_hz": [
            (float(axis[first]), float(axis[last - 1]))
            for first, last in zip(edges[::2], edges[1::2], strict=True)
        ],
    }


def _known(curve: CurveChange, known: Known, axis: FloatArray) -> dict[str, Any]:
    """How well an FRF is known: 95 %, and the measured FRFs most of its error comes from."""
    at = int(np.argmin(np.abs(axis - curve.at_hz)))
    return {
        "response": curve.response,
        "excitation": curve.excitation,
        "method": known.method,
        "median_db": float(np.median(known.level)),
        "at_largest_change_db": float(known.level[at]),
        "lines_beyond": int(known.exceeded(curve.decibel).sum()),
        "shares": [share for share in known.shares if share.share >= LEAST_SHARE],
    }


def _change(curve: CurveChange) -> dict[str, Any]:
    return {
        "response": curve.response,
        "excitation": curve.excitation,
        "largest_db": curve.largest_db,
        "at_hz": curve.at_hz,
        "rms_db": curve.rms_db,
        "scaled_error": curve.scaled_error,
        "frac": curve.frac,
        "resonances": [_resonance(resonance) for resonance in curve.resonances],
    }


def _resonance(resonance: Resonance) -> dict[str, Peak | float | str | None]:
    return {
        "drive_point": resonance.dof,
        "before": resonance.before,
        "after": resonance.after,
        "relative_shift": resonance.shift,
    }


# --- results.npz ----------------------------------------------------------------------------


def arrays_writer(result: CrossCheck) -> Writer:
    """What writes results.npz."""

    def write(file: BinaryIO) -> None:
        np.savez(file, allow_pickle=False, **result_arrays(result))

    return write


def result_arrays(result: CrossCheck) -> dict[str, NDArray[Any]]:
    """Every curve in full: lines last; routes, DoFs and curves in the order of their names."""
    routes = [result.reference, *(comparison.route for comparison in result.comparisons)]
    found: dict[str, NDArray[Any]] = {
        "frequency_hz": result.frequency,
        "dofs": np.array(result.dofs),
        "routes": np.array(routes),  # the reference first
        **_errors(result.comparisons),
        "round_off": result.round_off,
        "kernel_condition": result.kernel_condition,
        **_pairs("curve", list(result.curves)),
        "receptance_m_per_n": np.array(
            [[by_route[route] for route in routes] for by_route in result.curves.values()]
        ),
    }
    if result.time_domain is not None:
        found |= _time_arrays(result.time_domain)
    if result.substitution is not None:
        found |= _swap_arrays(result.substitution)
    return found


def _errors(comparisons: tuple[FrfComparison, ...]) -> dict[str, NDArray[Any]]:
    """Of all routes but the reference."""
    return {
        "line_max": np.array([each.line_max for each in comparisons]),
        "line_median": np.array([each.line_median for each in comparisons]),
        "pair_max": np.array([each.pair_max for each in comparisons]),
    }


def _pairs(name: str, pairs: list[Pair]) -> dict[str, NDArray[Any]]:
    return {
        f"{name}_response": np.array([response for response, _ in pairs], dtype=str),
        f"{name}_excitation": np.array([excitation for _, excitation in pairs], dtype=str),
    }


def _time_arrays(found: TimeDomain) -> dict[str, NDArray[Any]]:
    return {
        "time_frequency_hz": found.frequency,
        "time_response": np.array(found.labels),
        "time_transient_m_per_n": found.transient.T,
        "time_substructured_m_per_n": found.substructured.T,
    }


def _swap_arrays(found: Changes) -> dict[str, NDArray[Any]]:
    errors = {f"swap_{name}": values[0] for name, values in _errors((found.comparison,)).items()}
    alone = [(part, curve) for part, curves in found.alone.items() for curve in curves]
    return {
        **errors,
        **_changes("swap", list(found.curves)),
        "swap_alone_part": np.array([part for part, _ in alone], dtype=str),
        **_changes("swap_alone", [curve for _, curve in alone]),
        **_known_arrays(found),
    }


def _known_arrays(found: Changes) -> dict[str, NDArray[Any]]:
    """Bands (dB from and to, 95 %) line by line, and every error's split by the files' FRFs.

    ``swap_error_share_PART`` is (curves, responses, excitations of the file).
    """
    if not found.known:
        return {}
    arrays = {
        **_pairs("swap_known", list(found.known)),
        "swap_known_db": np.array([(known.low, known.high) for known in found.known.values()]),
    }
    for each in found.substitutions:
        rows, columns = each.frf.responses, each.frf.excitations
        arrays |= {
            f"swap_error_response_{each.part}": np.array(rows),
            f"swap_error_excitation_{each.part}": np.array(columns),
            f"swap_error_share_{each.part}": np.array(
                [known.split(each.part, rows, columns) for known in found.known.values()]
            ),
        }
    return arrays


def _changes(name: str, curves: list[CurveChange]) -> dict[str, NDArray[Any]]:
    return {
        **_pairs(name, [(curve.response, curve.excitation) for curve in curves]),
        f"{name}_before_m_per_n": _stacked([curve.before for curve in curves]),
        f"{name}_after_m_per_n": _stacked([curve.after for curve in curves]),
    }


def _stacked(curves: list[ComplexArray]) -> ComplexArray:
    return np.array(curves, dtype=complex)

"""A swap in results.json."""

from __future__ import annotations

from typing import Any

from ..checks.peaks import Peak, Resonance
from ..report.digits import ERROR_DIGITS, SIGNIFICANT_DIGITS, rounded
from ..routes.substitution import Replacement
from .results import CurveChange, Swap
from .swap import headline


def swap_document(swap: Swap) -> dict[str, Any]:
    """Everything the report says of a swap as nested dicts and lists of numbers."""
    at, response, excitation = swap.comparison.worst
    return {
        "headline": headline(swap),
        "changes": swap.changes,
        "parts": [_part(replacement) for replacement in swap.replacements],
        "responses": list(swap.responses),
        "excitations": list(swap.excitations),
        "worst": {
            "scaled_error": float(swap.comparison.line_max.max()),
            "frequency_hz": at,
            "response": response,
            "excitation": excitation,
        },
        "line_max": rounded(swap.comparison.line_max, ERROR_DIGITS),
        "line_median": rounded(swap.comparison.line_median, ERROR_DIGITS),
        "pair_max": [rounded(row, ERROR_DIGITS) for row in swap.comparison.pair_max],
        "curves": [_curve(curve) for curve in swap.curves],
        "not_compared": [list(pair) for pair in swap.not_compared],
        "alone": {part: [_curve(curve) for curve in curves] for part, curves in swap.alone.items()},
        "resonances": [_resonance(resonance) for resonance in swap.resonances],
    }


def _part(replacement: Replacement) -> dict[str, Any]:
    return {
        "name": replacement.part,
        "file": str(replacement.path),
        "interface": list(replacement.interface),
        "left_out": list(replacement.left_out),
        "unknown": list(replacement.unknown),
        "warnings": list(replacement.warnings),
    }


def _curve(curve: CurveChange) -> dict[str, Any]:
    return {
        "response": curve.response,
        "excitation": curve.excitation,
        "largest_db": curve.largest_db,
        "at_hz": curve.at_hz,
        "rms_db": curve.rms_db,
        "scaled_error": curve.scaled_error,
        "frac": curve.frac,
        "resonances": [_resonance(resonance) for resonance in curve.resonances],
        "receptance_m_per_n": {
            name: {
                "real": rounded(values.real, SIGNIFICANT_DIGITS),
                "imag": rounded(values.imag, SIGNIFICANT_DIGITS),
            }
            for name, values in (("before", curve.before), ("after", curve.after))
        },
    }


def _resonance(resonance: Resonance) -> dict[str, Any]:
    return {
        "drive_point": resonance.dof,
        "before": _peak(resonance.before),
        "after": _peak(resonance.after),
        "relative_shift": resonance.shift,
    }


def _peak(peak: Peak | None) -> dict[str, float] | None:
    if peak is None:
        return None
    return {
        "frequency_hz": peak.frequency_hz,
        "level_db": peak.level_db,
        "prominence_db": peak.prominence_db,
    }

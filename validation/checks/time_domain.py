"""Verdicts on FRFs from time integration."""

from __future__ import annotations

from dataclasses import replace

from ..arrays import FloatArray
from ..routes.time_domain import TimeDomain
from .check import Check

DECIBEL_TOLERANCE = 0.1  # at most, 80 dB below the peak

REASON = (
    "the run's own error: 0.017 dB and 0.11° (2e-3) near a response's peak, where a line is known "
    "to 1e-3; the orbit is closed to 1e-6 of each motion, which 80 dB below the peak is 1 %: 0.09 "
    "dB and 0.6°; the trapezoidal rule bends frequencies to ω′ = (2/h) tan(ωh/2) exactly, and FBS "
    "is asked there"
)


def time_domain_checks(result: TimeDomain) -> list[Check]:
    """Verdicts on the FRFs from time integration: magnitude and phase."""
    subject, routes = f"{len(result.labels)} FRFs from {result.excitation}", result.routes

    def findings(share: FloatArray, worst: FloatArray, unit: str) -> tuple[str, ...]:
        return tuple(
            f"{label} ← {result.excitation}: up to {value:.3g} {unit}, {times:.3g} times what is "
            "allowed"
            for label, value, times in zip(result.labels, worst, share, strict=True)
            if not times <= 1.0
        )

    check = Check(
        "FRFs from time integration, magnitude", subject, routes,
        "largest difference / what is allowed",
        float(result.db_share.max()), 1.0, REASON,
        findings(result.db_share, result.worst_db, "dB"), result.comparable,
    )  # fmt: skip
    return [
        check,
        replace(
            check,
            name="FRFs from time integration, phase",
            value=float(result.degree_share.max()),
            findings=findings(result.degree_share, result.worst_degrees, "°"),
        ),
    ]

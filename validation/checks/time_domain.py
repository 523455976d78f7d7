"""Verdicts on FRFs from time integration."""

from __future__ import annotations

from dataclasses import replace

from ..arrays import FloatArray
from ..routes.time_domain import TimeDomain
from .check import Check

DECIBEL_TOLERANCE = 0.1

DEGREE_TOLERANCE = 1.0

REASON = (
    "the orbit is closed to 1e-6 of each motion, which on a line 80 dB below a response's peak is "
    "1 %: 0.09 dB and 0.6°; further below only lines that are better known are compared; the "
    "trapezoidal rule bends frequencies to ω′ = (2/h) tan(ωh/2) exactly, and FBS is asked there"
)


def time_domain_checks(result: TimeDomain) -> list[Check]:
    """Verdicts on the FRFs from time integration: magnitude and phase."""
    subject, routes = f"{len(result.labels)} FRFs from {result.excitation}", result.routes

    def findings(values: FloatArray, allowed: float, unit: str) -> tuple[str, ...]:
        return tuple(
            f"{label} ← {result.excitation}: {value:.3g} {unit}"
            for label, value in zip(result.labels, values, strict=True)
            if not value <= allowed
        )

    check = Check(
        "FRFs from time integration, magnitude", subject, routes, "largest difference, dB",
        float(result.worst_db.max()), DECIBEL_TOLERANCE, REASON,
        findings(result.worst_db, DECIBEL_TOLERANCE, "dB"), result.comparable,
    )  # fmt: skip
    return [
        check,
        replace(
            check,
            name="FRFs from time integration, phase",
            measure="largest difference, degrees",
            value=float(result.worst_degrees.max()),
            tolerance=DEGREE_TOLERANCE,
            findings=findings(result.worst_degrees, DEGREE_TOLERANCE, "°"),
        ),
    ]

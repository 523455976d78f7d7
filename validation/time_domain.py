"""The fourth route: FRFs of exudyn's own time integration, against FBS.

No linear algebra of ours is in it: exudyn integrates the multibody system over its periodic orbit
under a multisine, and the records are transformed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fbs import SecondOrderSystem, direct_frf, frequency_axis
from mbs_models.errors import OrbitError
from mbs_models.parameters import Damping, Drivetrain

from .judged import known, within_range
from .results import Check, TimeDomain
from .routes import build_model, couple_stages, exudyn_source

if TYPE_CHECKING:
    from mbs_models.integration.periodic_orbit import PeriodicRecord

FloatArray = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

ROUTE = "exudyn in time"
FBS = "FBS of exudyn stages"

# A drivetrain without damping has no steady state to integrate; it is given this, in both routes.
RAYLEIGH = (0.005, 40.0, 1000.0)  # damping ratio, at these two frequencies (Hz)

DECIBEL_TOLERANCE = 0.1
DEGREE_TOLERANCE = 1.0
REASON = (
    "the orbit is closed to 1e-6 of each motion, which on a line 80 dB below a response's peak is "
    "1 %: 0.09 dB and 0.6°; further below only lines are judged that are better known; the "
    "trapezoidal rule bends frequencies to ω′ = (2/h) tan(ωh/2) exactly, and FBS is asked there"
)
# Largest motion of any DoF at every line (m). The smallest first, where geometry is linear; where
# springs are so stiff that it drowns in their round-off, the next.
AMPLITUDES = (1e-8, 1e-6)
# DoFs that symmetry keeps still: their FRF is zero, and what moves them is not linear.
ZERO = 1e-9


def rayleigh_damping(ratio: float, first: float, second: float) -> Damping:
    """Damping with ζ = (β ω + α/ω)/2 equal to ``ratio`` at two frequencies (Hz)."""
    w_1, w_2 = 2.0 * np.pi * first, 2.0 * np.pi * second
    beta = 2.0 * ratio / (w_1 + w_2)
    return Damping(stiffness_proportional=beta, mass_proportional=beta * w_1 * w_2)


def time_domain(
    drivetrain: Drivetrain,
    excitation: str,
    *,
    fmax: float = 4000.0,
    df: float = 20.0,
    progress: Progress | None = None,
) -> TimeDomain:
    """Integrate a drivetrain under a multisine and hold the FRFs against FBS'.

    Parameters
    ----------
    drivetrain
        What is run; without damping of its own it is given Rayleigh damping, in both routes.
    excitation
        The DoF excited.
    fmax, df
        Lines df, 2 df, … fmax (Hz).
    Raises
    ------
    ModelError
        The DoF is unknown, or the orbit does not close.
    """
    drivetrain = with_damping(drivetrain)
    model = build_model(exudyn_source(), drivetrain)
    record = _record(drivetrain, model.whole, excitation, frequency_axis(df, fmax, df), progress)
    coupled = couple_stages(model, record.frequency).frf.select(record.labels, [excitation])
    reference, found = coupled.values[:, :, 0], record.receptance()

    peak = np.abs(reference).max(axis=0)
    responding = peak > ZERO * peak.max()
    reference, found = reference[:, responding], found[:, responding]
    unknown = record.unknown()[:, responding]
    compared = within_range(np.abs(reference)) | known(record.frequency, np.abs(found), unknown)
    ratio = np.where(compared, found / np.where(compared, reference, 1.0), 1.0)
    return TimeDomain(
        excitation=excitation,
        labels=tuple(np.array(record.labels)[responding].tolist()),
        frequency=record.frequency,
        transient=found,
        substructured=reference,
        damping=drivetrain.damping,
        step=record.step,
        shots=record.shots,
        closure=record.closure,
        even_share=record.even_share,
        compared=compared,
        worst_db=np.abs(20.0 * np.log10(np.abs(ratio))).max(axis=0),
        worst_degrees=np.degrees(np.abs(np.angle(ratio))).max(axis=0),
    )


def _record(
    drivetrain: Drivetrain,
    system: SecondOrderSystem,
    excitation: str,
    lines: FloatArray,
    progress: Progress | None,
) -> PeriodicRecord:
    """A record at the smallest amplitude whose orbit closes."""
    from mbs_models.excitation import Excitation
    from mbs_models.integration.periodic_orbit import periodic_response
    from mbs_models.signals.lines import schroeder_multisine

    for displacement in AMPLITUDES:
        amplitudes = even_amplitudes(system, excitation, lines, displacement)
        signal = schroeder_multisine(lines[0], lines[-1], lines[0], amplitudes)
        try:
            return periodic_response(drivetrain, Excitation(excitation, signal), progress=progress)
        except OrbitError:
            if displacement == AMPLITUDES[-1]:
                raise
    raise AssertionError("unreachable: the last amplitude returns or raises")


def even_amplitudes(
    system: SecondOrderSystem, dof: str, frequency: FloatArray, displacement: float
) -> FloatArray:
    """A_k = x / max_j |H_ji(ω_k)|: at every line the largest motion of any DoF is the same (N)."""
    column = direct_frf(system, frequency, system.dofs, [dof]).values[:, :, 0]
    amplitudes: FloatArray = displacement / np.abs(column).max(axis=1)
    return amplitudes


def with_damping(drivetrain: Drivetrain) -> Drivetrain:
    """The drivetrain itself if it is damped, else with Rayleigh damping of 0.5 %."""
    if drivetrain.damping.stiffness_proportional > 0.0:
        return drivetrain
    return drivetrain.model_copy(update={"damping": rayleigh_damping(*RAYLEIGH)})


def time_domain_checks(result: TimeDomain) -> list[Check]:
    """Verdicts on the FRFs from time integration: magnitude and phase."""
    subject, routes = f"{len(result.labels)} FRFs from {result.excitation}", (FBS, ROUTE)

    def findings(values: FloatArray, allowed: float, unit: str) -> tuple[str, ...]:
        return tuple(
            f"{label} ← {result.excitation}: {value:.3g} {unit}"
            for label, value in zip(result.labels, values, strict=True)
            if not value <= allowed
        )

    check = Check(
        "FRFs from time integration, magnitude", subject, routes, "largest difference, dB",
        float(result.worst_db.max()), DECIBEL_TOLERANCE, REASON,
        findings(result.worst_db, DECIBEL_TOLERANCE, "dB"), result.judged,
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

"""The fourth route: FRFs of exudyn's own time integration, against FBS.

No linear algebra of ours is in it: exudyn integrates the multibody system over its periodic orbit
under a multisine, and the records are transformed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fbs import SecondOrderSystem, direct_frf, frequency_axis
from mbs_models.errors import OrbitError
from mbs_models.model.parameters import Damping, Drivetrain

from .comparable_lines import judged, known, within_range
from .routes import build_model, couple_stages, exudyn_source

if TYPE_CHECKING:
    from mbs_models.integration.periodic_orbit import PeriodicRecord

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[Any]
Progress = Callable[[str, int, int], None]

ROUTE = "exudyn in time"
FBS = "FBS of exudyn stages"

# A drivetrain without damping has no steady state to integrate; it is given this, in both routes.
RAYLEIGH = (0.005, 40.0, 1000.0)  # damping ratio, at these two frequencies (Hz)

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
    from mbs_models.integration.periodic_orbit import periodic_response
    from mbs_models.model.excitation import Excitation
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


@dataclass(frozen=True)
class TimeDomain:
    """FRFs from one multisine run, beside FBS'.

    Attributes
    ----------
    excitation
        The excited DoF.
    labels
        The responses compared (those that are not zero by symmetry).
    frequency
        (n_line,) Hz.
    transient, substructured
        (n_line, n_label) receptance (m/N).
    damping
        What both routes used.
    step, shots, closure, even_share
        As in `PeriodicRecord`.
    compared
        (n_line, n_label) the lines judged.
    worst_db, worst_degrees
        (n_label,) largest differences over the lines compared.
    """

    excitation: str
    labels: tuple[str, ...]
    frequency: FloatArray
    transient: ComplexArray
    substructured: ComplexArray
    damping: Damping
    step: float
    shots: int
    closure: float
    even_share: float
    compared: BoolArray
    worst_db: FloatArray
    worst_degrees: FloatArray

    @property
    def judged(self) -> str:
        """On how many lines a verdict on them rests, and where it leaves out half of the band."""
        names = [f"{label} ← {self.excitation}" for label in self.labels]
        return judged(names, self.frequency, self.compared)

"""The route through time: FRFs of exudyn's own time integration, against FBS.

No linear algebra of ours is in it: exudyn integrates the multibody system over its periodic orbit
under a multisine, and the records are transformed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem, direct_frf, frequency_axis
from mbs_models.errors import OrbitError
from mbs_models.model.parameters import Damping, Drivetrain

from ..arrays import BoolArray, FloatArray
from .comparable_lines import KNOWN_TO, describe, known, within_range
from .routes import Labels, fbs_route

if TYPE_CHECKING:
    from mbs_models.integration.periodic_orbit import PeriodicRecord

    from .multibody import ExudynSource

ComplexArray = NDArray[Any]
Progress = Callable[[str, int, int], None]

# A drivetrain without damping has no steady state to integrate; it is given this, in both routes.
RAYLEIGH = (0.005, 40.0, 1000.0)  # damping ratio, at these two frequencies (Hz)

# Largest motion of any DoF at every line (m). Geometry is linear at the first; where springs are so
# stiff that it drowns in their round-off, the second.
AMPLITUDES = (1e-8, 1e-6)
# DoFs that symmetry keeps still: their FRF is zero, and what moves them is not linear.
ZERO = 1e-9
CLOSED = 1e-6  # of a motion: how far an orbit's ends may be apart
LARGEST_ERROR = 1e-2  # CLOSED, 80 dB below the peak


def rayleigh_damping(ratio: float, first: float, second: float) -> Damping:
    """Damping with ζ = (β ω + α/ω)/2 equal to ``ratio`` at two frequencies (Hz)."""
    w_1, w_2 = 2.0 * np.pi * first, 2.0 * np.pi * second
    beta = 2.0 * ratio / (w_1 + w_2)
    return Damping(stiffness_proportional=beta, mass_proportional=beta * w_1 * w_2)


@dataclass(frozen=True)
class TimeRoute:
    """FRFs from multisines on their periodic orbits; the source's drivetrain must be damped.

    An FRF's lines are f′ = tan(πfh)/(πh), what the trapezoidal rule makes of the lines asked for.
    """

    source: ExudynSource
    progress: Progress | None = None
    name: str = "exudyn in time"

    def frf(self, lines: FloatArray, responses: Labels = None, excitations: Labels = None) -> Frf:
        """One run for each excitation (None: each DoF)."""
        dofs = self.source.whole.dofs if excitations is None else tuple(excitations)
        records = [self.record(lines, dof) for dof in dofs]
        values = np.stack([record.receptance() for record in records], axis=2)
        frf = Frf(records[0].frequency, values, records[0].labels, dofs)
        return frf.select(responses)

    def record(self, lines: FloatArray, excitation: str) -> PeriodicRecord:
        """A run at the smallest amplitude whose orbit closes, lines df, 2 df, … (Hz).

        Raises
        ------
        ModelError
            The DoF is unknown, or (OrbitError) the orbit does not close.
        """
        from mbs_models.integration.periodic_orbit import periodic_response, trapezoidal
        from mbs_models.integration.time_integration import SimulationError
        from mbs_models.model.excitation import Excitation
        from mbs_models.signals.lines import schroeder_multisine

        source = self.source
        for displacement in AMPLITUDES:
            amplitudes = even_amplitudes(source.whole, excitation, lines, displacement)
            signal = schroeder_multisine(lines[0], lines[-1], lines[0], amplitudes)
            driven = Excitation(excitation, signal)
            try:
                record = periodic_response(
                    source.system, source.linear, driven, trapezoidal(signal),
                    progress=self.progress,
                )  # fmt: skip
            except SimulationError as error:
                raise OrbitError(str(error)) from error
            if record.closed:
                return record
        raise OrbitError(
            f"the periodic orbit under the multisine at {excitation} does not close: its ends "
            f"differ by {record.closure:.1e} of the motion; the amplitude is too large for "
            "geometry to be linear, or so small that it drowns in the round-off of stiff springs"
        )


def time_domain(
    source: ExudynSource,
    excitation: str,
    *,
    fmax: float = 4000.0,
    df: float = 20.0,
    progress: Progress | None = None,
) -> TimeDomain:
    """Integrate a drivetrain under a multisine and hold the FRFs against FBS'.

    Parameters
    ----------
    source
        What is run; its drivetrain must be damped (`with_damping`).
    excitation
        The DoF excited.
    fmax, df
        Lines df, 2 df, … fmax (Hz).

    Raises
    ------
    ModelError
        The DoF is unknown, or the orbit does not close.
    """
    route, reference = TimeRoute(source, progress), fbs_route(source)
    record = route.record(frequency_axis(df, fmax, df), excitation)
    coupled = reference.frf(record.frequency, record.labels, [excitation])
    expected, found = coupled.values[:, :, 0], record.receptance()

    peak = np.abs(expected).max(axis=0)
    responding = peak > ZERO * peak.max()
    expected, found = expected[:, responding], found[:, responding]
    unknown = record.unknown()[:, responding]
    compared = within_range(np.abs(expected)) | known(record.frequency, np.abs(found), unknown)
    ratio = np.where(compared, found / np.where(compared, expected, 1.0), 1.0)
    decibels, degrees = np.abs(20.0 * np.log10(np.abs(ratio))), np.abs(np.angle(ratio, deg=True))
    allowed = own_error(np.abs(expected))
    return TimeDomain(
        routes=(reference.name, route.name),
        excitation=excitation,
        labels=tuple(np.array(record.labels)[responding].tolist()),
        frequency=record.frequency,
        transient=found,
        substructured=expected,
        damping=source.drivetrain.damping,
        step=record.integrator.step,
        periods=record.periods,
        closure=record.closure,
        even_share=record.even_share,
        compared=compared,
        worst_db=decibels.max(axis=0),
        worst_degrees=degrees.max(axis=0),
        db_share=(decibels / (20.0 * np.log10(1.0 + allowed))).max(axis=0),
        degree_share=(degrees / np.degrees(allowed)).max(axis=0),
    )


def own_error(size: FloatArray) -> FloatArray:
    """What an FRF from time may be off by, relative: 2 `KNOWN_TO` + `CLOSED` · peak/|H|, ≤ 1 %.

    A line is known to `KNOWN_TO` by the record, and no worse by its reference; the orbit is closed
    to `CLOSED` of each motion, most of which is at the peak. Lines so far below the peak that this
    is more than 1 % are compared only where they are better known.

    Parameters
    ----------
    size
        (n_line, n_label) |H|.
    """
    below = size.max(axis=0) / np.maximum(size, np.finfo(float).tiny)
    return np.asarray(np.minimum(2.0 * KNOWN_TO + CLOSED * below, LARGEST_ERROR))


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
    routes
        The reference's name, and the run's.
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
    step
        Of the trapezoidal rule (s).
    periods, closure, even_share
        As in `PeriodicRecord`.
    compared
        (n_line, n_label) the comparable lines.
    worst_db, worst_degrees
        (n_label,) largest differences over the lines compared.
    db_share, degree_share
        (n_label,) the same over what the run's own error allows at each line.
    """

    routes: tuple[str, str]
    excitation: str
    labels: tuple[str, ...]
    frequency: FloatArray
    transient: ComplexArray
    substructured: ComplexArray
    damping: Damping
    step: float
    periods: int
    closure: float
    even_share: float
    compared: BoolArray
    worst_db: FloatArray
    worst_degrees: FloatArray
    db_share: FloatArray
    degree_share: FloatArray

    @property
    def comparable(self) -> str:
        """On how many lines a verdict on them rests, and where it leaves out half of the band."""
        names = [f"{label} ← {self.excitation}" for label in self.labels]
        return describe(names, self.frequency, self.compared)

"""How a run is laid out: from which state, how long, with which integrator, sampled how."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from mbs_models.errors import ModelError
from mbs_models.gears.operating_point import OperatingPoint
from mbs_models.integration.integrators import (
    KNOWN_BEND,
    PARTING_STEP_COST,
    STEP_COST,
    TRAPEZOIDAL,
    VARYING_STEP_COST,
    Integrator,
    choose_integrator,
)
from mbs_models.integration.steady_state import slowest_decay, steady_start, superposed
from mbs_models.modal.mode_kinds import rigid_body_count
from mbs_models.model.excitation import Excitation, check_record
from mbs_models.signals.lines import Harmonic, Multisine, Signal
from mbs_models.system.linearization import LinearizedSystem

from ..arrays import FloatArray
from .options import Options

DECAYED = 1e-4  # what the slowest mode may keep of its motion at the end of a transient
SETTLED = 1e-2  # and at the end of a run-in, before a spectrum is measured
PERIODS = 2  # on the periodic orbit: one would do, the second shows that it repeats
# Meshes excite to beyond this multiple of their frequency with little force.
SEEN_BEND = 2e-3  # of frequencies at speed, where nothing takes it out: less than damping smears
MESH_HARMONICS = 6
LOWEST_FMAX = 1000.0  # Hz; a turning gearbox is looked at up to here at least
WINDOW_PERIODS = 6.0  # a four-term window is four lines wide to either side
MESH_PERIODS = 200  # of the slowest mesh that are measured
CARRIER_TURNS = 10  # and of the slowest carrier: sidebands are one turn's frequency apart
LONGEST = 60.0  # s of a run whose length nobody asked for


@dataclass(frozen=True)
class RunPlan:
    """The run as laid out.

    Attributes
    ----------
    integrator, sampling_frequency
        As for `simulate`.
    duration, run_in
        s, of which run-in.
    fmax
        End of the band of interest (Hz).
    least_duration
        How long a run must last to tell means and growth (s).
    static
        (n_dof,) m, the equilibrium under preload.
    dynamic
        (displacement, velocity) on top of it: the steady state of what is periodic.
    """

    integrator: Integrator
    sampling_frequency: float
    duration: float
    run_in: float
    fmax: float
    least_duration: float
    static: FloatArray
    dynamic: tuple[FloatArray, FloatArray]


def plan(linear: LinearizedSystem, options: Options, point: OperatingPoint | None) -> RunPlan:
    """Lay a run out.

    - On its periodic orbit from the start (multisines, sines), two periods, no run-in;
    - from rest under what ends, until the slowest mode has died out after it;
    - otherwise (noise, turning gears) after a run-in of that length.

    Raises
    ------
    ModelError
        The band lies beyond Nyquist, the duration is shorter than a period or a signal, the step
        is unstable, or a DoF is unknown.
    """
    _check_dofs(linear, options)
    if options.duration is not None and not 0.0 < options.duration < np.inf:
        raise ModelError(f"duration = {options.duration:g} s: must be finite and above 0")
    fmax = _fmax(options, point)
    period = _common_period(options.excitations)
    bend = SEEN_BEND if _turns(point) else KNOWN_BEND
    integrator, rate = _integrator(linear, options, fmax, period, bend, _step_cost(point))
    static = np.zeros(len(linear.dofs)) if point is None else point.displacement
    dynamic = _steady_start(linear, options.excitations, integrator)
    # The start of varying meshes excites every mode; forces of a band hardly those above it.
    decay = slowest_decay(linear, np.inf if _turns(point) else fmax)
    duration, run_in = _duration(options, point, period, decay)
    least = _least_duration(linear, point, decay)
    if options.duration is None:
        duration = max(duration, least)
    _check_records(options, duration, rate)
    return RunPlan(integrator, rate, duration, run_in, fmax, least, static, dynamic)


def _check_dofs(linear: LinearizedSystem, options: Options) -> None:
    asked = [("excitation at", excitation.dof) for excitation in options.excitations]
    asked += [("response", label) for label in options.responses or ()]
    for what, label in asked:
        if label not in linear.labels:
            raise ModelError(f"{what} '{label}': no such DoF; known: {', '.join(linear.labels)}")


def _fmax(options: Options, point: OperatingPoint | None) -> float:
    """End of the band of interest (Hz)."""
    highest = max((excitation.signal.band[1] for excitation in options.excitations), default=0.0)
    fastest = max(point.mesh_frequencies.values(), default=0.0) if point is not None else 0.0
    if options.fmax is not None:
        if not options.fmax >= highest:
            raise ModelError(
                f"fmax = {options.fmax:g} Hz: the excitation reaches {highest:g} Hz; give at least "
                "that, or leave fmax out"
            )
        if not options.fmax >= fastest:
            raise ModelError(
                f"fmax = {options.fmax:g} Hz: teeth pass at {fastest:g} Hz; give at least that, or "
                "leave fmax out"
            )
        return options.fmax
    return max(highest, excited_by_meshes(point), 0.0 if highest else LOWEST_FMAX)


def excited_by_meshes(point: OperatingPoint | None) -> float:
    """How far up meshes excite (Hz); 0 where none turns."""
    meshes = point.mesh_frequencies.values() if point is not None else ()
    return MESH_HARMONICS * max(meshes, default=0.0)


def _turns(point: OperatingPoint | None) -> bool:
    """Whether gears turn."""
    return point is not None and bool(point.mesh_frequencies)


def _step_cost(point: OperatingPoint | None) -> float:
    """What a step of RK44 costs, in the trapezoidal rule's.

    Of FRFs the trapezoidal rule's bend is taken out, which is worth a slower step.
    """
    laws = point.laws.values() if point is not None and _turns(point) else ()
    if any(law.backlash for law in laws):
        return PARTING_STEP_COST
    return VARYING_STEP_COST if any(law.varies for law in laws) else STEP_COST


def _common_period(excitations: Sequence[Excitation[Signal]]) -> float | None:
    """The period of all excitations, where they share one."""
    periods = {
        excitation.signal.period
        for excitation in excitations
        if isinstance(excitation.signal, Multisine | Harmonic)
    }
    if len(periods) != 1 or any(
        not isinstance(excitation.signal, Multisine | Harmonic) for excitation in excitations
    ):
        return None
    return periods.pop()


def _integrator(
    linear: LinearizedSystem,
    options: Options,
    fmax: float,
    period: float | None,
    bend: float,
    step_cost: float,
) -> tuple[Integrator, float]:
    """Integrator and sampling frequency; a period is a whole number of samples."""

    def chosen(rate: float | None) -> Integrator:
        return choose_integrator(
            linear,
            fmax,
            sampling_frequency=rate,
            method=options.integrator,
            step=options.step,
            bend=bend,
            step_cost=step_cost,
        )

    if options.sampling_frequency is not None:
        return chosen(options.sampling_frequency), options.sampling_frequency
    integrator = chosen(None)
    rate = 1.0 / integrator.step
    if period is not None and options.step is None:
        rate = math.ceil(period * rate * (1.0 - 1e-12)) / period
        integrator = chosen(rate)
    return integrator, rate


def _steady_start(
    linear: LinearizedSystem,
    excitations: Sequence[Excitation[Signal]],
    integrator: Integrator,
) -> tuple[FloatArray, FloatArray]:
    """The state at t = 0 of the steady state under what is periodic; at rest under the others."""
    rest = np.zeros(len(linear.dofs))
    states = [(rest, rest)]
    warped = integrator.step if integrator.name == TRAPEZOIDAL else None
    for excitation in excitations:
        signal = excitation.signal
        if isinstance(signal, Multisine):
            lines = signal.frequency, signal.spectrum
        elif isinstance(signal, Harmonic):
            line = signal.amplitude * np.exp(1j * signal.phase)
            lines = np.array([signal.frequency]), np.array([line])
        else:
            continue
        states.append(steady_start(linear, excitation.dof, *lines, warped))
    return superposed(states)


def _duration(
    options: Options, point: OperatingPoint | None, period: float | None, decay: float
) -> tuple[float, float]:
    """Duration and the run-in in it (s); ``decay`` of the slowest mode (1/s)."""
    turning = _turns(point)
    ends = [excitation.signal.duration for excitation in options.excitations]
    if period is not None and not turning:
        return _given(options, PERIODS * period), 0.0
    if ends and all(end is not None for end in ends) and not turning:
        last = max(end for end in ends if end is not None)
        return _given(options, last + _until(DECAYED, decay)), 0.0
    run_in = _until(SETTLED, decay)
    if options.duration is not None:
        return options.duration, min(run_in, options.duration / 2.0)
    measured = LONGEST / 2.0
    if turning and point is not None:
        turns = max((CARRIER_TURNS / rate for rate in carrier_rates(point).values()), default=0.0)
        measured = max(MESH_PERIODS / min(point.mesh_frequencies.values()), turns, 1.0)
    return run_in + measured, run_in


def _least_duration(linear: LinearizedSystem, point: OperatingPoint | None, decay: float) -> float:
    """A run-in, and so many periods of the slowest of meshes and elastic modes that a window keeps
    them out of a mean; nothing where nothing varies (s).
    """
    if point is None or not any(law.varies for law in point.laws.values()):
        return 0.0
    squares = eigh(linear.stiffness, linear.mass, eigvals_only=True)
    elastic = squares[rigid_body_count(linear.stiffness) :]
    slowest = float(np.sqrt(max(elastic.min(initial=np.inf), 0.0))) / (2.0 * np.pi)
    slowest = min(slowest, *point.mesh_frequencies.values())
    return _until(SETTLED, decay) + WINDOW_PERIODS / slowest


def _given(options: Options, otherwise: float) -> float:
    return otherwise if options.duration is None else options.duration


def carrier_rates(point: OperatingPoint) -> dict[str, float]:
    """Planetary stage → how often its carrier passes the ring (Hz), of those that turn."""
    speeds = point.speeds
    rates = {
        stage: abs(speeds[f"{stage}.carrier"] - speeds[f"{stage}.ring"]) / (2.0 * np.pi)
        for stage in point.mesh_frequencies
        if f"{stage}.carrier" in speeds
    }
    return {stage: rate for stage, rate in rates.items() if rate > 0.0}


def _until(share: float, decay: float) -> float:
    """How long until a mode keeps but a share of its motion (s)."""
    return min(math.log(1.0 / share) / decay, LONGEST) if decay > 0.0 else LONGEST


def _check_records(options: Options, duration: float, rate: float) -> None:
    for excitation in options.excitations:
        check_record(excitation, duration=duration, sampling_frequency=rate)
        lasts = excitation.signal.duration
        if lasts is not None and duration < lasts * (1.0 - 1e-9):
            raise ModelError(
                f"duration = {duration:g} s: the excitation at {excitation.dof} lasts {lasts:g} s; "
                "run at least as long"
            )

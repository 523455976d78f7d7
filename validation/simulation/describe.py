"""A run in sentences: what excites it, and what came out."""

from __future__ import annotations

import numpy as np

from mbs_models.model.excitation import Excitation
from mbs_models.signals.lines import BandNoise, Harmonic, Multisine, Signal
from mbs_models.signals.sampled import Sampled
from mbs_models.signals.sines import HalfSine, SteppedSine, Sweep

from ..checks.check import Check
from ..routes.comparable_lines import percent
from .gear_run import GearRun
from .result import SimulationResult


def describe_excitation(excitation: Excitation[Signal]) -> str:
    """What excites, and where: "multisine of 400 lines, 10 to 4000 Hz, at reducer.pinion.w"."""
    return f"{_signal(excitation.signal)}, at {excitation.dof}"


def _signal(signal: Signal) -> str:
    fmin, fmax = signal.band
    match signal:
        case Multisine():
            return f"multisine of {len(signal.harmonics)} lines, {fmin:g} to {fmax:g} Hz"
        case Harmonic():
            return f"sine of {signal.amplitude:g} N at {signal.frequency:g} Hz"
        case Sweep():
            first, last = (fmax, fmin) if signal.down else (fmin, fmax)
            kind = "logarithmic" if signal.logarithmic else "linear"
            return (
                f"{kind} sweep of {signal.amplitude:g} N, {first:g} to {last:g} Hz in "
                f"{signal.duration:g} s"
            )
        case SteppedSine():
            return f"stepped sine of {signal.amplitude:g} N, {fmin:g} to {fmax:g} Hz"
        case BandNoise():
            return f"noise of {signal.rms:g} N rms, {fmin:g} to {fmax:g} Hz"
        case HalfSine():
            return f"half-sine impact of {signal.peak:g} N, {signal.contact_time:g} s long"
        case Sampled():
            return f"recorded force of {signal.duration:g} s at {signal.sampling_frequency:g} Hz"
    return type(signal).__name__


def verdict(result: SimulationResult) -> str:
    """The run in a sentence."""
    sentences = []
    if result.estimated:
        sentences.append(_against_fbs(result))
    if result.gears is not None and not result.excitations:
        sentences.append(_operated(result.gears))
    broken = [
        check.name for check in result.checks if not check.agrees and check not in _frf(result)
    ]
    if broken:
        sentences.append(f"the run contradicts mechanics: {', '.join(broken)}")
    return "; ".join(sentences) or "The drivetrain was run in time"


def _frf(result: SimulationResult) -> tuple[Check, ...]:
    """The checks on FRFs."""
    return tuple(check for check in result.checks if check.name.startswith("FRFs"))


def _against_fbs(result: SimulationResult) -> str:
    checks = _frf(result)
    worst = max(check.value for check in checks if "magnitude" in check.name)
    alike = all(check.agrees for check in checks)
    agree = "agree with FBS" if alike else "do not agree with FBS everywhere"
    size = f"{worst:.2g} dB" if worst >= 1e-3 else "below 0.001 dB"
    averaged = any(part.estimate.kind == "H1" for part in result.estimated)
    beyond = ", the estimate’s own scatter allowed for" if averaged else ""
    compared = np.concatenate([part.compared.ravel() for part in result.estimated])
    lines = "all lines" if compared.all() else f"the lines compared, {percent(compared)} of all"
    return (
        f"FRFs from exudyn’s time integration {agree}: largest difference {size} on {lines}{beyond}"
    )


def _operated(gears: GearRun) -> str:
    point = gears.point
    where = [f"{point.speed_rpm:g} rpm"] if point.speed_rpm else ["At standstill"]
    where += [f"{point.torque:g} N m"] if point.torque else []
    factors = [load.dynamic_factor for load in gears.loads if load.dynamic_factor is not None]
    largest = f"largest dynamic factor {max(factors):.3g}" if factors else "meshes without load"
    return f"{' and '.join(where)}: {largest}"

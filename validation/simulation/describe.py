"""Excitations in words."""

from __future__ import annotations

from mbs_models.model.excitation import Excitation
from mbs_models.signals.lines import BandNoise, Harmonic, Multisine, Signal
from mbs_models.signals.sampled import Sampled
from mbs_models.signals.sines import HalfSine, SteppedSine, Sweep


def in_words(excitation: Excitation[Signal]) -> str:
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

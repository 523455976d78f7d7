"""Signals that end: sines of stepped and of gliding frequency, and the blow of a hammer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from .lines import FloatArray, require, require_band


@dataclass(frozen=True)
class SteppedSine:
    """f(t) = A r(t) sin φ(t), φ' = 2π fᵢ during step i; φ is continuous.

    φ(t) = 2π (Σ_{j<i} f_j d_j + fᵢ (t − tᵢ)); r is 1, with a half cosine at both ends.

    Attributes
    ----------
    frequencies
        fᵢ (Hz), in the order they are driven.
    dwells
        dᵢ, how long each is held (s).
    amplitude
        A (N).
    ramp
        Length of each of the two half cosines (s).

    Raises
    ------
    ModelError
        No frequency, one dwell too few, or a value out of its range.
    """

    frequencies: tuple[float, ...]
    dwells: tuple[float, ...]
    amplitude: float
    ramp: float = 0.0

    def __post_init__(self) -> None:
        name = "stepped-sine"
        if not self.frequencies or len(self.frequencies) != len(self.dwells):
            raise ModelError(
                f"{name}: {len(self.frequencies)} frequencies and {len(self.dwells)} dwells: must "
                "be one of each for every step"
            )
        for frequency in self.frequencies:
            require(name, "Hz", frequencies=frequency)
        for dwell in self.dwells:
            require(name, "s", dwell=dwell)
        require(name, "N", amplitude=self.amplitude)
        _require_ramp(name, self.ramp, self.duration)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest step."""
        return min(self.frequencies), max(self.frequencies)

    @property
    def period(self) -> None:
        """It does not repeat."""
        return None

    @property
    def duration(self) -> float:
        """Σ dᵢ (s)."""
        return float(sum(self.dwells))

    @property
    def starts(self) -> FloatArray:
        """tᵢ, when each step begins (s)."""
        return np.concatenate([[0.0], np.cumsum(self.dwells)[:-1]])

    def instantaneous_frequency(self, time: FloatArray) -> FloatArray:
        """fᵢ of the step that each instant lies in (Hz)."""
        return np.asarray(np.array(self.frequencies)[self._step(np.asarray(time, dtype=float))])

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        instants = np.asarray(time, dtype=float)
        frequency, step = np.array(self.frequencies), self._step(instants)
        before = np.concatenate([[0.0], np.cumsum(frequency * self.dwells)[:-1]])
        cycles = np.mod(before, 1.0)[step] + frequency[step] * (instants - self.starts[step])
        envelope = _envelope(instants, self.duration, self.ramp)
        return np.asarray(self.amplitude * envelope * np.sin(2.0 * np.pi * cycles))

    def _step(self, time: FloatArray) -> NDArray[np.int_]:
        return np.clip(np.searchsorted(self.starts, time, side="right") - 1, 0, None)


def stepped_sine(
    frequencies: tuple[float, ...], amplitude: float, *, periods: float, ramp: float = 0.0
) -> SteppedSine:
    """A `SteppedSine` that holds each frequency for so many of its periods.

    Raises
    ------
    ModelError
        As for `SteppedSine`.
    """
    require("stepped-sine", "", periods=periods)
    for frequency in frequencies:
        require("stepped-sine", "Hz", frequencies=frequency)
    return SteppedSine(frequencies, tuple(periods / f for f in frequencies), amplitude, ramp)


@dataclass(frozen=True)
class Sweep:
    """f(t) = A r(t) sin φ(t), the frequency gliding from fmin to fmax in the duration D.

    Linear: φ = 2π (f₀ t + (f₁ − f₀) t²/2D). Logarithmic: φ = 2π f₀ D/ln(f₁/f₀) ((f₁/f₀)^{t/D} − 1).
    r is 1, with a half cosine of length ``taper`` at both ends.

    Attributes
    ----------
    fmin, fmax
        The band (Hz).
    duration
        D (s).
    amplitude
        A (N).
    logarithmic
        Octaves per second are constant instead of hertz per second.
    down
        From fmax to fmin.
    taper
        Length of each of the two half cosines (s).

    Raises
    ------
    ModelError
        fmin is not below fmax, or a value is out of its range.
    """

    fmin: float
    fmax: float
    duration: float
    amplitude: float
    logarithmic: bool = False
    down: bool = False
    taper: float = 0.0

    def __post_init__(self) -> None:
        require_band("sweep", self.fmin, self.fmax)
        require("sweep", "s", duration=self.duration)
        require("sweep", "N", amplitude=self.amplitude)
        _require_ramp("sweep", self.taper, self.duration, key="taper")
        mean = (self.fmax - self.fmin) / np.log(self.fmax / self.fmin)
        cycles = self.duration * (mean if self.logarithmic else (self.fmin + self.fmax) / 2.0)
        if cycles < 1.0:
            raise ModelError(
                f"sweep: duration = {self.duration:g} s: is {cycles:.3g} of a period; must be at "
                f"least {self.duration / cycles:.4g} s"
            )

    @property
    def band(self) -> tuple[float, float]:
        """(fmin, fmax): what the instantaneous frequency passes."""
        return self.fmin, self.fmax

    @property
    def period(self) -> None:
        """It does not repeat."""
        return None

    @property
    def _ends(self) -> tuple[float, float]:
        return (self.fmax, self.fmin) if self.down else (self.fmin, self.fmax)

    def instantaneous_frequency(self, time: FloatArray) -> FloatArray:
        """φ'/2π (Hz) at instants 0 ≤ t ≤ D (s)."""
        first, last = self._ends
        share = np.asarray(time, dtype=float) / self.duration
        if self.logarithmic:
            return np.asarray(first * (last / first) ** share)
        return np.asarray(first + (last - first) * share)

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        instants = np.asarray(time, dtype=float)
        first, last = self._ends
        share = np.clip(instants / self.duration, 0.0, 1.0)
        if self.logarithmic:
            rate = np.log(last / first)
            cycles = first * self.duration / rate * np.expm1(rate * share)
        else:
            cycles = self.duration * share * (first + (last - first) * share / 2.0)
        envelope = _envelope(instants, self.duration, self.taper)
        return np.asarray(self.amplitude * envelope * np.sin(2.0 * np.pi * cycles))


@dataclass(frozen=True)
class HalfSine:
    """f(t) = F sin(π (t − t₀)/τ) for t₀ ≤ t ≤ t₀ + τ, else 0: a hammer's blow.

    |F(f)| = (2Fτ/π) |cos(πfτ) / (1 − (2fτ)²)|: −9.5 dB of its value at 0 Hz at f = 1/τ, and zero
    for the first time at f = 1.5/τ.

    Attributes
    ----------
    peak
        F (N).
    contact_time
        τ (s).
    start
        t₀ (s).

    Raises
    ------
    ModelError
        F or τ not above zero, or t₀ below.
    """

    peak: float
    contact_time: float
    start: float = 0.0

    def __post_init__(self) -> None:
        require("impulse", "N", amplitude=self.peak)
        require("impulse", "s", contact_time=self.contact_time)
        require("impulse", "s", least=0.0, start=self.start)

    @property
    def band(self) -> tuple[float, float]:
        """From 0 Hz to the spectrum's first zero, 1.5/τ."""
        return 0.0, 1.5 / self.contact_time

    @property
    def period(self) -> None:
        """It does not repeat."""
        return None

    @property
    def duration(self) -> float:
        """t₀ + τ: the force is zero from then on (s)."""
        return self.start + self.contact_time

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        share = (np.asarray(time, dtype=float) - self.start) / self.contact_time
        inside = (share >= 0.0) & (share <= 1.0)
        return np.asarray(self.peak * np.where(inside, np.sin(np.pi * share), 0.0))


def _require_ramp(signal: str, ramp: float, duration: float, key: str = "ramp") -> None:
    require(signal, "s", least=0.0, **{key: ramp})
    if 2.0 * ramp > duration:
        raise ModelError(
            f"{signal}: {key} = {ramp:g} s: must be at most half of the signal's {duration:g} s"
        )


def _envelope(time: FloatArray, duration: float, ramp: float) -> FloatArray:
    """1 within 0 ≤ t ≤ duration and 0 outside, with a half cosine at both ends."""
    inside = np.minimum(time, duration - time)
    if ramp == 0.0:
        return np.asarray(inside >= 0.0, dtype=float)
    return np.asarray((1.0 - np.cos(np.pi * np.clip(inside / ramp, 0.0, 1.0))) / 2.0)

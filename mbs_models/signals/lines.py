"""Signals a drivetrain is excited with: a force (N) over time, and what band it fills.

All are functions of time, not samples: an integrator asks for any instants. This module has the
periodic ones, `sine_signals` stepped and swept sines and the hammer's blow, `sampled_signal` what
was measured.

A sum of sines whose frequencies are multiples of 1/period has no leakage when one period of the
steady state is transformed, and Schroeder's phases keep its peak near that of a sweep (Schroeder
1970, IEEE Trans. Inf. Theory 16, 85–89).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from .line_sum import LineSum

FloatArray = NDArray[np.float64]

ROUNDING = 1e-9  # by so much (relative) a whole number may be missed, and is still meant
MOST_LINES = 5_000_000  # of one signal: its grid in memory is then 160 MB


class Signal(Protocol):
    """A force over time."""

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency of what it contains (Hz)."""

    @property
    def period(self) -> float | None:
        """After how long it repeats (s); None if it does not."""

    @property
    def duration(self) -> float | None:
        """How long it lasts (s); None if without end."""

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants t ≥ 0 (s)."""


def require(signal: str, unit: str, *, least: float | None = None, **given: float) -> None:
    """Refuse a parameter that is not finite, below ``least``, or (without ``least``) not above 0.

    Raises
    ------
    ModelError
        Naming the signal, the key, its value and what is allowed.
    """
    for key, value in given.items():
        if least is None:
            fits, allowed = value > 0.0, "finite and greater than 0"
        else:
            fits, allowed = value >= least, f"finite and at least {least:g}"
        if not (fits and np.isfinite(value)):
            raise ModelError(f"{signal}: {key} = {value:g} {unit}: must be {allowed}")


def require_band(signal: str, fmin: float, fmax: float) -> None:
    """Refuse all but 0 < fmin < fmax < ∞."""
    require(signal, "Hz", fmin=fmin, fmax=fmax)
    if fmin >= fmax:
        raise ModelError(f"{signal}: fmin = {fmin:g} Hz: must be less than fmax = {fmax:g} Hz")


@dataclass(frozen=True)
class Harmonic:
    """f(t) = A cos(2π f t + φ).

    Attributes
    ----------
    amplitude
        A (N).
    frequency
        f (Hz).
    phase
        φ (rad).

    Raises
    ------
    ModelError
        A or f not above zero, or something not finite.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        require("harmonic", "N", amplitude=self.amplitude)
        require("harmonic", "Hz", frequency=self.frequency)
        require("harmonic", "rad", least=-1e6, phase=self.phase)

    @property
    def band(self) -> tuple[float, float]:
        """(f, f)."""
        return self.frequency, self.frequency

    @property
    def period(self) -> float:
        """1/f (s)."""
        return 1.0 / self.frequency

    @property
    def duration(self) -> None:
        """It has no end."""
        return None

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        angle = 2.0 * np.pi * self.frequency * np.asarray(time, dtype=float) + self.phase
        return np.asarray(self.amplitude * np.cos(angle))


@dataclass(frozen=True, eq=False)
class Multisine:
    """f(t) = Σ_k A_k cos(2π k t/T + φ_k).

    Attributes
    ----------
    period
        T (s).
    harmonics
        (n_line,) the numbers k.
    amplitudes, phases
        (n_line,) A_k (N) and φ_k (rad).

    Raises
    ------
    ModelError
        No line, a harmonic below 1 or twice, or a value out of its range.
    """

    period: float
    harmonics: NDArray[np.int_]
    amplitudes: FloatArray
    phases: FloatArray

    def __post_init__(self) -> None:
        require("multisine", "s", period=self.period)
        count = len(self.harmonics)
        if count == 0 or {len(self.amplitudes), len(self.phases)} != {count}:
            raise ModelError(
                f"multisine: {count} harmonics, {len(self.amplitudes)} amplitudes and "
                f"{len(self.phases)} phases: must be one of each for every line"
            )
        if self.harmonics.min() < 1 or len(np.unique(self.harmonics)) != count:
            raise ModelError("multisine: harmonics: must be whole numbers from 1 on, each once")
        if not (np.isfinite(self.amplitudes).all() and np.isfinite(self.phases).all()):
            raise ModelError("multisine: amplitudes and phases: must be finite")
        require("multisine", "N", amplitude=float(self.amplitudes.min()))

    @property
    def frequency(self) -> FloatArray:
        """The excited lines (Hz)."""
        return self.harmonics / self.period

    @property
    def band(self) -> tuple[float, float]:
        """First and last line (Hz)."""
        return float(self.frequency.min()), float(self.frequency.max())

    @property
    def duration(self) -> None:
        """It has no end."""
        return None

    @property
    def spectrum(self) -> NDArray[np.complex128]:
        """(n_line,) complex amplitudes A_k e^{jφ_k} of e^{+jωt}."""
        spectrum: NDArray[np.complex128] = self.amplitudes * np.exp(1j * self.phases)
        return spectrum

    @cached_property
    def _lines(self) -> LineSum:
        return LineSum(self.period, self.harmonics, self.spectrum)

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        return self._lines.values(time)

    def share(self, index: int, count: int) -> Multisine:
        """The lines k with k mod count = index: one of ``count`` inputs' share.

        Raises
        ------
        ModelError
            There is no such line.
        """
        mine = self.harmonics % count == index
        if not mine.any():
            raise ModelError(
                f"multisine: {len(self.harmonics)} lines cannot be shared out to {count} inputs; "
                "must be a finer spacing or a wider band"
            )
        return Multisine(
            self.period, self.harmonics[mine], self.amplitudes[mine], self.phases[mine]
        )

    def samples(self, count: int) -> FloatArray:
        """``count`` samples over one period, from t = 0.

        Raises
        ------
        ModelError
            The highest line is not below half the sampling frequency.
        """
        highest = int(self.harmonics.max())
        if 2 * highest >= count:
            raise ModelError(
                f"multisine: {count} samples per period resolve lines below "
                f"{count / (2 * self.period):g} Hz, the highest is {highest / self.period:g} Hz"
            )
        return self._lines.samples(count)


def schroeder_multisine(
    fmin: float, fmax: float, df: float, amplitudes: FloatArray | float
) -> Multisine:
    """The multiples of df from fmin to fmax with Schroeder's phases φ_k = −π k(k−1)/n.

    Parameters
    ----------
    fmin, fmax, df
        Hz; the period is 1/df.
    amplitudes
        N, of all lines or of each.

    Raises
    ------
    ModelError
        The band is none or holds no line, or an amplitude is not above zero.
    """
    harmonics = _harmonics("multisine", fmin, fmax, df)
    order = np.arange(len(harmonics))
    phases = -np.pi * order * (order - 1) / len(order)
    return Multisine(1.0 / df, harmonics, _each(amplitudes, harmonics), phases)


def random_multisine(
    fmin: float, fmax: float, df: float, amplitudes: FloatArray | float, seed: int
) -> Multisine:
    """The multiples of df from fmin to fmax with phases drawn evenly from 0 to 2π.

    Parameters
    ----------
    fmin, fmax, df, amplitudes
        As for `schroeder_multisine`.
    seed
        The same seed draws the same phases.

    Raises
    ------
    ModelError
        As for `schroeder_multisine`.
    """
    harmonics = _harmonics("multisine", fmin, fmax, df)
    phases = _generator("multisine", seed).uniform(0.0, 2.0 * np.pi, len(harmonics))
    return Multisine(1.0 / df, harmonics, _each(amplitudes, harmonics), phases)


def fitted_spacing(duration: float, df: float, sampling_frequency: float | None = None) -> float:
    """The spacing nearest below df whose period fits a record a whole number of times (Hz).

    T = duration / n with the largest n that leaves 1/T ≤ df, so that the record holds n periods
    and every line of the multisine is a line of its transform. With a sampling frequency, T is a
    whole number of samples, and n periods may end less than n samples before the record does.

    Parameters
    ----------
    duration
        Of the record (s).
    df
        The spacing wanted (Hz).
    sampling_frequency
        Of the record (Hz).

    Raises
    ------
    ModelError
        The record is shorter than one period of df.
    """
    require("multisine", "s", duration=duration)
    require("multisine", "Hz", df=df)
    periods = int(np.floor(duration * df * (1.0 + ROUNDING)))
    if periods < 1:
        raise ModelError(
            f"multisine: df = {df:g} Hz: a record of {duration:g} s is shorter than one period of "
            f"{1.0 / df:g} s; record longer, or use df of {1.0 / duration:.4g} Hz or more"
        )
    if sampling_frequency is None:
        return periods / duration
    require("multisine", "Hz", sampling_frequency=sampling_frequency)
    samples = int(np.floor(duration * sampling_frequency * (1.0 + ROUNDING)))
    return sampling_frequency / (samples // periods)


@dataclass(frozen=True)
class BandNoise:
    """f(t) = Re Σ_k c_k e^{j2πkt/T}, fmin ≤ k/T ≤ fmax: Gaussian noise of a flat spectrum.

    Real and imaginary parts of the c_k are independent and normally distributed, all of one
    variance, so f is Gaussian and stationary; they are then scaled so that a period has the RMS
    value asked for. Outside the band there is nothing. It repeats after T (Shinozuka & Deodatis
    1991, Appl. Mech. Rev. 44, 191–204): longer than the record, it is noise to whoever reads it.

    Attributes
    ----------
    fmin, fmax
        The band (Hz).
    rms
        N.
    period
        T (s).
    seed
        The same seed gives the same noise.

    Raises
    ------
    ModelError
        The band is none or holds no line, or a value is out of its range.
    """

    fmin: float
    fmax: float
    rms: float
    period: float
    seed: int = 0

    def __post_init__(self) -> None:
        require("noise", "N", amplitude=self.rms)
        require("noise", "s", period=self.period)
        _harmonics("noise", self.fmin, self.fmax, 1.0 / self.period)
        _generator("noise", self.seed)

    @property
    def band(self) -> tuple[float, float]:
        """(fmin, fmax)."""
        return self.fmin, self.fmax

    @property
    def duration(self) -> None:
        """It has no end."""
        return None

    @cached_property
    def _lines(self) -> LineSum:
        harmonics = _harmonics("noise", self.fmin, self.fmax, 1.0 / self.period)
        real, imaginary = _generator("noise", self.seed).standard_normal((2, len(harmonics)))
        lines = real + 1j * imaginary
        scale = self.rms / np.sqrt(np.sum(np.abs(lines) ** 2) / 2.0)
        return LineSum(self.period, harmonics, scale * lines)

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        return self._lines.values(time)


# Several inputs at once


def own_seeds(seed: int, count: int) -> tuple[int, ...]:
    """Seeds of independent signals, one for each of several inputs, all from one seed."""
    children = np.random.SeedSequence(seed).spawn(count)
    return tuple(int(child.generate_state(1)[0]) for child in children)


def _harmonics(signal: str, fmin: float, fmax: float, df: float) -> NDArray[np.int_]:
    """The numbers k with fmin ≤ k·df ≤ fmax (a limit missed by rounding alone counts)."""
    require_band(signal, fmin, fmax)
    require(signal, "Hz", df=df)
    first = int(np.ceil(fmin / df * (1.0 - ROUNDING)))
    last = int(np.floor(fmax / df * (1.0 + ROUNDING)))
    if last < first:
        raise ModelError(
            f"{signal}: no multiple of {df:g} Hz (a period of {1.0 / df:g} s) lies between "
            f"fmin = {fmin:g} and fmax = {fmax:g} Hz; must be a finer spacing or a wider band"
        )
    if last > MOST_LINES:
        raise ModelError(
            f"{signal}: {fmax:g} Hz is line {last} of a period of {1.0 / df:g} s: must be at most "
            f"line {MOST_LINES}; use a period of {MOST_LINES / fmax:.4g} s or less"
        )
    return np.arange(first, last + 1)


def _each(amplitudes: FloatArray | float, harmonics: NDArray[np.int_]) -> FloatArray:
    return np.broadcast_to(np.asarray(amplitudes, dtype=float), harmonics.shape)


def _generator(signal: str, seed: int) -> np.random.Generator:
    if seed < 0:
        raise ModelError(f"{signal}: seed = {seed}: must be at least 0")
    return np.random.default_rng(seed)

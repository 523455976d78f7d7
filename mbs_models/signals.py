"""Signals a drivetrain is excited with: a force (N) over time, and what band it fills.

A sum of sines whose frequencies are multiples of 1/period has no leakage when one period of the
steady state is transformed, and Schroeder's phases keep its peak near that of a sweep (Schroeder
1970, IEEE Trans. Inf. Theory 16, 85–89).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import ModelError

FloatArray = NDArray[np.float64]


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


@dataclass(frozen=True)
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
    """

    period: float
    harmonics: NDArray[np.int_]
    amplitudes: FloatArray
    phases: FloatArray

    @property
    def frequency(self) -> FloatArray:
        """The excited lines (Hz)."""
        return self.harmonics / self.period

    @property
    def band(self) -> tuple[float, float]:
        """First and last line (Hz)."""
        return float(self.frequency.min()), float(self.frequency.max())

    @property
    def duration(self) -> float | None:
        """It has no end."""
        return None

    @property
    def spectrum(self) -> NDArray[np.complex128]:
        """(n_line,) complex amplitudes A_k e^{jφ_k} of e^{+jωt}."""
        spectrum: NDArray[np.complex128] = self.amplitudes * np.exp(1j * self.phases)
        return spectrum

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        angle = np.multiply.outer(2.0 * np.pi * time, self.frequency) + self.phases
        force: FloatArray = np.cos(angle) @ self.amplitudes
        return force

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
        bins = np.zeros(count // 2 + 1, dtype=complex)
        bins[self.harmonics] = self.spectrum * count / 2
        return np.fft.irfft(bins, count)


def schroeder_multisine(
    fmin: float, fmax: float, df: float, amplitudes: FloatArray | float
) -> Multisine:
    """Lines fmin, fmin + df, … fmax with Schroeder's phases φ_k = −π k(k−1)/n.

    Parameters
    ----------
    fmin, fmax, df
        Lines (Hz), multiples of df; the period is 1/df.
    amplitudes
        N, of all lines or of each.

    Raises
    ------
    ModelError
        The band is none, or an amplitude is not above zero.
    """
    if not (0.0 < df <= fmin < fmax):
        raise ModelError(f"multisine: need 0 < df ≤ fmin < fmax, got {df:g}, {fmin:g}, {fmax:g} Hz")
    harmonics = np.arange(round(fmin / df), round(fmax / df) + 1)
    each = np.broadcast_to(np.asarray(amplitudes, dtype=float), harmonics.shape)
    if not np.all(each > 0.0):
        raise ModelError(f"multisine: every amplitude must be above 0 N, got {each.min():g} N")
    order = np.arange(len(harmonics))
    return Multisine(1.0 / df, harmonics, each, -np.pi * order * (order - 1) / len(order))

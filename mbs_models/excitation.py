"""Multisine excitation: all lines of a band at once, in one period.

A sum of sines whose frequencies are multiples of 1/period has no leakage when one period of the
steady state is transformed, and Schroeder's phases keep its peak near that of a sweep (Schroeder
1970, IEEE Trans. Inf. Theory 16, 85–89).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import ModelError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Multisine:
    """f(t) = Σ_k A_k cos(2π k t/T + φ_k), at one DoF.

    Attributes
    ----------
    dof
        Label of the DoF; the force is the one conjugate to it (rotations: torque / r), in N.
    period
        T (s).
    harmonics
        (n_line,) the numbers k.
    amplitudes, phases
        (n_line,) A_k (N) and φ_k (rad).
    """

    dof: str
    period: float
    harmonics: NDArray[np.int_]
    amplitudes: FloatArray
    phases: FloatArray

    @property
    def frequency(self) -> FloatArray:
        """The excited lines (Hz)."""
        return self.harmonics / self.period

    @property
    def spectrum(self) -> NDArray[np.complex128]:
        """(n_line,) complex amplitudes A_k e^{jφ_k} of e^{+jωt}."""
        spectrum: NDArray[np.complex128] = self.amplitudes * np.exp(1j * self.phases)
        return spectrum

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
                f"multisine at {self.dof}: {count} samples per period resolve lines below "
                f"{count / (2 * self.period):g} Hz, the highest is {highest / self.period:g} Hz"
            )
        bins = np.zeros(count // 2 + 1, dtype=complex)
        bins[self.harmonics] = self.spectrum * count / 2
        return np.fft.irfft(bins, count)


def schroeder_multisine(
    dof: str, fmin: float, fmax: float, df: float, amplitudes: FloatArray | float
) -> Multisine:
    """Lines fmin, fmin + df, … fmax with Schroeder's phases φ_k = −π k(k−1)/n.

    Parameters
    ----------
    dof
        Label of the DoF.
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
    return Multisine(dof, 1.0 / df, harmonics, each, -np.pi * order * (order - 1) / len(order))

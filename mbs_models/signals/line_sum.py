"""Sums of sines on a common grid of frequencies, at any instants.

A sum of K lines at n instants costs K·n cosines when it is written down; here it costs one FFT and
a few multiplications per instant, to the last digits: the non-uniform FFT of type 2 (Dutt &
Rokhlin 1993, SIAM J. Sci. Comput. 14, 1368–1393) with the Kaiser–Bessel kernel (Potts, Steidl &
Tasche 2001, in Modern Sampling Theory, ch. 12).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# Grid points under the kernel, and how much finer than needed the grid is. The kernel's error is
# about exp(−π WIDTH √(1 − 1/OVERSAMPLING)) = 4e-16 of Σ|c_k| (Potts et al.): round-off.
WIDTH = 16
OVERSAMPLING = 2.0
SHAPE = np.pi * WIDTH * (1.0 - 1.0 / (2.0 * OVERSAMPLING))
BLOCK = 8192  # instants at once: their kernels stay in the cache


@dataclass(frozen=True, eq=False)
class LineSum:
    """f(t) = Re Σ_k c_k e^{j2πkt/T}.

    Attributes
    ----------
    period
        T (s).
    harmonics
        (n_line,) the numbers k ≥ 0, each once.
    coefficients
        (n_line,) c_k, complex.
    """

    period: float
    harmonics: NDArray[np.int_]
    coefficients: NDArray[np.complex128]

    def values(self, time: FloatArray) -> FloatArray:
        """f at any instants (s), in their shape."""
        instants = np.asarray(time, dtype=float)
        flat = instants.reshape(-1)
        result = np.empty(len(flat))
        for block in _blocks(len(flat)):
            result[block] = self._interpolated(flat[block])
        return result.reshape(instants.shape)

    def samples(self, count: int) -> FloatArray:
        """``count`` samples over one period from t = 0; the lines must lie below count/2."""
        bins = np.zeros(count // 2 + 1, dtype=complex)
        bins[self.harmonics] = self.coefficients * count / 2
        bins[0] *= 2.0
        return np.fft.irfft(bins, count)

    @cached_property
    def _grid(self) -> FloatArray:
        """f on a grid, its spectrum divided by the kernel's; the ends are repeated."""
        least = 2.0 * OVERSAMPLING * max(int(self.harmonics.max()), WIDTH)
        count = fast_length(int(np.ceil(least)))
        lines = self.coefficients / _kernel_transform(self.harmonics / count)
        grid = LineSum(self.period, self.harmonics, lines).samples(count)
        return np.concatenate([grid[-WIDTH:], grid, grid[:WIDTH]])

    def _interpolated(self, time: FloatArray) -> FloatArray:
        grid = self._grid
        # The remainder is exact, however late the instant.
        position = np.mod(time, self.period) / self.period * (len(grid) - 2 * WIDTH)
        first = np.floor(position).astype(np.int64) - WIDTH // 2 + 1
        index = first[:, None] + np.arange(WIDTH)
        kernel = _kernel(position[:, None] - index)
        value: FloatArray = np.einsum("ij,ij->i", kernel, grid[index + WIDTH])
        return value


def fast_length(least: int) -> int:
    """The least 2ᵃ3ᵇ5ᶜ that is no smaller: a length whose Fourier transform is fast.

    SciPy's `next_fast_len`, whose package takes as long to load as a short run to compute.
    """
    odd: list[int] = [3**b * 5**c for b in range(41) for c in range(28)]
    return min(n << max(-(-least // n) - 1, 0).bit_length() for n in odd)


def _kernel(distance: FloatArray) -> FloatArray:
    """e^{−b} I₀(b √(1 − x²)), x the distance (grid points) over half the width."""
    from scipy.special import i0e

    root = SHAPE * np.sqrt(np.maximum(1.0 - (2.0 * distance / WIDTH) ** 2, 0.0))
    kernel: FloatArray = i0e(root) * np.exp(root - SHAPE)
    return kernel


def _kernel_transform(frequency: FloatArray) -> FloatArray:
    """The kernel's Fourier transform at a frequency (cycles per grid point): W e^{−b} sinh(s)/s."""
    root = np.sqrt(SHAPE**2 - (np.pi * WIDTH * frequency) ** 2)
    transform: FloatArray = WIDTH * np.exp(root - SHAPE) * -np.expm1(-2.0 * root) / (2.0 * root)
    return transform


def _blocks(count: int) -> Iterator[slice]:
    return (slice(start, start + BLOCK) for start in range(0, count, BLOCK))

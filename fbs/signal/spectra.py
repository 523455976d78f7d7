"""Spectra of records: amplitudes of lines, power spectral density, spectrogram, RMS.

A transform of n samples x_i, weighted by a window w_i, is X_k = sum_i w_i x_i exp(-2 pi j i k / n).
A sine of amplitude A on line k gives |X_k| = A sum(w) / 2, noise of density G gives
E |X_k|^2 = G fs sum(w^2) / 2 (Harris 1978, Proc. IEEE 66, 51-83): the two need different scales,
and a spectrum is either of amplitudes or of densities, never both. 0 Hz and Nyquist have no
mirror image, and half the scale.

Segments are transformed one after the other, so that a record may be a memory map.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.checks import ComplexArray, FloatArray, numbers
from .._kernels.door import door
from .._kernels.finite import non_finite
from ..errors import FbsError, NonFiniteError

Window = Literal["boxcar", "hann", "flattop"]
"""boxcar: none, for whole periods. hann: in general; a line between two bins reads up to 15 % low.
flattop: amplitudes, 0.1 % low at worst between two bins, at 3.8 bins' width."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitudes or densities over frequency.

    Parameters
    ----------
    frequency : array, shape (nf,), Hz
    values : array, shape (nf, ...)
        The record's further axes are kept.
    n_averages : int
        Segments averaged.
    noise_bandwidth : float, Hz
        Of one line: fs sum(w^2) / sum(w)^2. A density is amplitude^2 / 2 over this.
    """

    frequency: FloatArray
    values: FloatArray
    n_averages: int
    noise_bandwidth: float


@dataclass(frozen=True, eq=False)
class Spectrogram:
    """Amplitudes over time and frequency.

    Parameters
    ----------
    time : array, shape (nt,), s
        Middle of each segment, counted from the first sample.
    frequency : array, shape (nf,), Hz
    values : array, shape (nt, nf)
    """

    time: FloatArray
    frequency: FloatArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class _Segments:
    """A record cut into `count` segments of `weights.size` samples, one every `hop`."""

    samples: FloatArray
    rate: float
    weights: FloatArray
    hop: int

    @property
    def size(self) -> int:
        return len(self.weights)

    @property
    def count(self) -> int:
        return 1 + (len(self.samples) - self.size) // self.hop

    @property
    def frequency(self) -> FloatArray:
        return np.asarray(np.arange(self.size // 2 + 1) * self.rate / self.size)

    @property
    def noise_bandwidth(self) -> float:
        return float(self.rate * np.sum(self.weights**2) / np.sum(self.weights) ** 2)

    @property
    def sided(self) -> FloatArray:
        """2 for lines with a mirror image, else 1."""
        twice = np.full(self.size // 2 + 1, 2.0)
        twice[0] = 1.0
        if self.size % 2 == 0:
            twice[-1] = 1.0
        return twice

    def amplitudes(self) -> Iterator[FloatArray]:
        """|X| (1 or 2) / sum(w) of each segment, (nf, ...)."""
        further = (1,) * (self.samples.ndim - 1)
        weights = self.weights.reshape(-1, *further)
        scale = (self.sided / self.weights.sum()).reshape(-1, *further)
        for number in range(self.count):
            part = self.samples[number * self.hop : number * self.hop + self.size]
            yield scale * np.abs(np.fft.rfft(weights * part, axis=0))

    def mean_square(self) -> FloatArray:
        """Mean of the squared amplitudes."""
        total = np.zeros((self.size // 2 + 1, *self.samples.shape[1:]))
        for amplitude in self.amplitudes():
            total += amplitude**2
        return np.asarray(total / self.count)


@door
def amplitude_spectrum(
    samples: ArrayLike,
    sampling_frequency: float,
    *,
    resolution: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
) -> Spectrum:
    """Peak amplitude A_k = 2 |X_k| / sum(w) of the sine on each line.

    Exact for a sine on a line whose distance from 0 Hz and Nyquist is at least the window's half
    width (hann 2 lines, flattop 5); the value at 0 Hz is |mean|.

    Parameters
    ----------
    samples : array, shape (n,) or (n, ...)
    sampling_frequency : float, Hz
    resolution : float, Hz, or None
        Distance of the lines (to the nearest whole number of samples per segment): root mean
        square over segments that long. None takes the record as one segment.
    window : Window
    overlap : float
        Share of a segment that the next one repeats. What remains after the last whole segment is
        not used.

    Raises
    ------
    FbsError, NonFiniteError
    """
    cut = _cut(samples, sampling_frequency, resolution, window, overlap)
    return Spectrum(cut.frequency, np.sqrt(cut.mean_square()), cut.count, cut.noise_bandwidth)


@door
def power_spectral_density(
    samples: ArrayLike,
    sampling_frequency: float,
    *,
    resolution: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
) -> Spectrum:
    """One-sided density G_k = 2 <|X_k|^2> / (fs sum(w^2)), unit^2 / Hz (Welch 1967).

    Its integral over a band is the mean square in it: exactly that of the weighted record for the
    whole band, and of the record itself for one boxcar segment (Parseval).

    Parameters and errors as for `amplitude_spectrum`.
    """
    cut = _cut(samples, sampling_frequency, resolution, window, overlap)
    further = (1,) * (cut.samples.ndim - 1)
    scale = 1.0 / (cut.sided.reshape(-1, *further) * cut.noise_bandwidth)
    return Spectrum(cut.frequency, scale * cut.mean_square(), cut.count, cut.noise_bandwidth)


@door
def spectrogram(
    samples: ArrayLike,
    sampling_frequency: float,
    *,
    resolution: float,
    window: Window = "hann",
    overlap: float = 0.75,
) -> Spectrogram:
    """Amplitude spectra of one channel, segment by segment.

    Parameters and errors as for `amplitude_spectrum`, but that samples have shape (n,).
    """
    cut = _cut(samples, sampling_frequency, resolution, window, overlap)
    if cut.samples.ndim != 1:
        raise FbsError(f"a spectrogram is of one channel, got shape {cut.samples.shape}")
    middle = np.asarray((np.arange(cut.count) * cut.hop + cut.size / 2) / cut.rate, dtype=float)
    return Spectrogram(middle, cut.frequency, np.stack(list(cut.amplitudes())))


@door
def line_amplitudes(
    samples: ArrayLike,
    sampling_frequency: float,
    frequency: ArrayLike,
    *,
    window: Window = "hann",
) -> ComplexArray:
    """A e^{j phi} of the sine A cos(2 pi f t + phi) at given frequencies, t from the first sample.

    2 sum_i w_i x_i exp(-2 pi j f i / fs) / sum(w), at any f: a line that is known beforehand need
    not lie on one of the transform's, and reads its full amplitude.

    Parameters
    ----------
    samples : array, shape (n,) or (n, ...)
    sampling_frequency : float, Hz
    frequency : array, shape (nf,), Hz
        Above 0 and below Nyquist.
    window : Window
        How far other lines leak.

    Returns
    -------
    array, shape (nf, ...)

    Raises
    ------
    FbsError, NonFiniteError
    """
    cut = _cut(samples, sampling_frequency, None, window, 0.0)
    at = np.atleast_1d(np.asarray(frequency, dtype=float))
    if not ((at > 0) & (at < cut.rate / 2)).all():
        raise FbsError(
            f"lines must be above 0 and below the Nyquist frequency {cut.rate / 2:.10g} Hz, got "
            f"{at.min():.10g} to {at.max():.10g} Hz"
        )
    steps = np.arange(cut.size) / cut.rate
    scale = 2.0 / cut.weights.sum()
    values = np.empty((at.size, *cut.samples.shape[1:]), dtype=complex)
    for number, line in enumerate(at):
        angle = 2.0 * np.pi * line * steps
        for part, wave in ((values.real, np.cos(angle)), (values.imag, -np.sin(angle))):
            part[number] = scale * np.tensordot(cut.weights * wave, cut.samples, axes=(0, 0))
    return values


@door
def rms(
    samples: ArrayLike, sampling_frequency: float, band: tuple[float, float] | None = None
) -> FloatArray:
    """Root mean square; within a band by Parseval, sum |X_k|^2 / n^2 over its lines.

    Parameters
    ----------
    samples : array, shape (n,) or (n, ...)
    sampling_frequency : float, Hz
    band : (float, float), Hz, or None
        Lines of the whole record's transform with first <= f <= last. None: all of the record,
        its mean included.

    Returns
    -------
    array, shape (...)

    Raises
    ------
    FbsError, NonFiniteError
        As for `amplitude_spectrum`, or the band holds no line.
    """
    if band is None:
        record = finite_samples(samples)
        return np.asarray(np.sqrt(np.einsum("i...,i...->...", record, record) / len(record)))
    cut = _cut(samples, sampling_frequency, None, "boxcar", 0.0)
    first, last = band
    inside = (cut.frequency >= first) & (cut.frequency <= last)
    if not inside.any():
        raise FbsError(
            f"no line between {first:.10g} and {last:.10g} Hz; {cut.size} samples at "
            f"{cut.rate:.10g} Hz have one every {cut.rate / cut.size:.10g} Hz"
        )
    further = (1,) * (cut.samples.ndim - 1)
    mean_square = cut.mean_square() / cut.sided.reshape(-1, *further)
    return np.asarray(np.sqrt(mean_square[inside].sum(axis=0)))


def _cut(
    samples: ArrayLike, rate: float, resolution: float | None, window: Window, overlap: float
) -> _Segments:
    from scipy.signal import get_window

    record = finite_samples(samples)
    if not (np.isfinite(rate) and rate > 0):
        raise FbsError(f"the sampling frequency must be positive and finite, got {rate} Hz")
    if not 0 <= overlap < 1:
        raise FbsError(f"overlap must be at least 0 and below 1, got {overlap}")
    if resolution is not None and not (np.isfinite(resolution) and 0 < resolution <= rate / 4):
        raise FbsError(
            f"the resolution must be above 0 and at most a quarter of the sampling frequency, "
            f"{rate / 4:.10g} Hz; got {resolution} Hz"
        )
    size = len(record) if resolution is None else round(rate / resolution)
    if size > len(record):
        raise FbsError(
            f"lines every {resolution:.10g} Hz need {size} samples, the record has {len(record)}"
        )
    weights = np.asarray(get_window(window, size, fftbins=True))
    return _Segments(record, float(rate), weights, max(1, round(size * (1 - overlap))))


def finite_samples(samples: ArrayLike) -> FloatArray:
    """Return real, finite samples, time along the first axis, two of them or more."""
    record = numbers(samples, "the samples")
    if record.ndim == 0 or len(record) < 2:
        raise FbsError(f"2 samples or more are needed, got shape {record.shape}")
    wrong = non_finite(record)
    if wrong.size:
        place = tuple(int(i) for i in wrong[0])
        raise NonFiniteError(
            f"the record is {record[place]} at sample {place[0]}"
            + (f", channel {place[1]}" if len(place) > 1 else "")
            + f" ({len(wrong)} values in all)"
        )
    return record

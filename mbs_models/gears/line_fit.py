"""Amplitudes of tones whose frequencies are known, however they lie to a record's length.

    min Σ_i w_i (x_i − Σ_k Re z_k exp(2πj ν_k i))²,    ν_k = f_k/f_s,    i = 0 … n − 1

over all tones and the mean (ν = 0) at once: a tone between two lines of the record's Fourier
transform is read in full, and none leaks into another. Weights w_i = ½ − ½ cos(2πi/n) (Hann) keep
out what is not in the list. With

    S(ν) = Σ_i w_i exp(−2πj ν i) = ½ D(ν) − ¼ D(ν − 1/n) − ¼ D(ν + 1/n),
    D(ν) = exp(−jπν(n − 1)) sin(πνn)/sin(πν)

Σ w cos cos = ½ Re [S(ν_k − ν_l) + S(ν_k + ν_l)] and the like are the normal equations' matrix. S is
zero two lines (2/n) off and small beyond: tones that far apart are as good as orthogonal. Nearer
ones cannot be told apart; what is read at the frequency of such a one is all that they make there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ModelError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

APART = 2.0  # lines of the record's Fourier transform between tones that can be told apart
LEAST = APART * (1.0 - 1e-9)  # exactly two lines are two, to round-off
# Eigenvalues of the normal equations (unit diagonal) below this belong to tones that cannot be told
# apart: those 2/n apart or more leave a smallest of 0.9, S being 3 % of its largest at most.
INDISTINCT = 1e-6
BLOCK, SEGMENT = 1 << 12, 1 << 18  # samples multiplied and held at once


@dataclass(frozen=True)
class ToneFit:
    """Tones in a record.

    Attributes
    ----------
    amplitudes
        (n_tone, n_channel) z: the tone is Re z exp(2πj f t), t from the first sample.
    distinct
        (n_tone,) whether the record is long enough to tell a tone from every other and the mean.
    """

    amplitudes: ComplexArray
    distinct: NDArray[np.bool_]


def fit_tones(samples: ArrayLike, sampling_frequency: float, frequencies: ArrayLike) -> ToneFit:
    """Fit tones of known frequencies to a record; the equations are this module's.

    Parameters
    ----------
    samples
        (n, n_channel), whatever unit.
    sampling_frequency
        f_s (Hz).
    frequencies
        (n_tone,) above 0 and up to f_s/2 (Hz), in any order.

    Raises
    ------
    ModelError
        A record of another shape, shorter than 4 samples or with numbers that are not finite, or a
        frequency beyond f_s/2.
    """
    record = np.asarray(samples)
    turns = np.asarray(frequencies, dtype=float) / sampling_frequency
    _check(record, turns, sampling_frequency)
    size = len(record)
    nu = np.concatenate([[0.0], turns])  # the mean is a tone of no frequency
    moments = _moments(record, nu)
    mean = moments[0].real / _weight_sum(np.zeros(1), size).real
    moments = moments - _weight_sum(nu, size)[:, None] * mean
    fitted = _solve(nu, size, moments)
    near = _near(turns, size)
    beside_zero = np.min(_circular(turns[:, None] + np.array([0.0, *turns])), axis=1, initial=1.0)
    distinct = (near.sum(axis=1) == 1) & (size * beside_zero >= LEAST)
    for tone in np.flatnonzero(~distinct):
        others = np.concatenate([[beside_zero[tone] * size >= APART], ~near[tone]])
        rest = moments[tone + 1] - _made_by(nu[others], fitted[others], turns[tone], size)
        fitted[tone + 1] = 2.0 / _weight_sum(np.zeros(1), size).real * rest
    return ToneFit(fitted[1:], distinct)


def _check(record: NDArray[np.float64], turns: FloatArray, rate: float) -> None:
    if record.ndim != 2 or len(record) < 4:
        raise ModelError(
            f"record: shape {record.shape}; (n, n_channel) with 4 samples or more is needed"
        )
    wrong = turns[~((turns > 0.0) & (turns <= 0.5))]
    if len(wrong):
        raise ModelError(
            f"record: {wrong[0] * rate:g} Hz is not above 0 and up to half the sampling frequency, "
            f"{rate / 2.0:g} Hz"
        )


def _moments(record: FloatArray, nu: FloatArray) -> ComplexArray:
    """Σ_i w_i x_i exp(−2πj ν i) of every tone and channel."""
    size, channels = record.shape
    inner = np.exp(-2j * np.pi * nu[:, None] * np.arange(BLOCK))
    found = np.zeros((len(nu), channels), dtype=complex)
    for first in range(0, size, SEGMENT):
        piece = np.asarray(record[first : first + SEGMENT], dtype=float)
        if not np.isfinite(piece).all():
            raise ModelError("record: holds numbers that are not finite")
        weights = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(first, first + len(piece)) / size)
        blocks = -(-len(piece) // BLOCK)
        padded = np.zeros((blocks * BLOCK, channels))
        padded[: len(piece)] = weights[:, None] * piece
        parts = padded.reshape(blocks, BLOCK, channels)
        sums = inner.real @ parts + 1j * (inner.imag @ parts)
        starts = first + BLOCK * np.arange(blocks)
        outer = np.exp(-2j * np.pi * (nu * starts[:, None] % 1.0))
        found += np.einsum("bl,blc->lc", outer, sums)
    return found


def _weight_sum(nu: FloatArray, size: int) -> ComplexArray:
    """S(ν)."""
    step = 1.0 / size
    whole = 0.5 * _dirichlet(nu, size)
    return whole - 0.25 * (_dirichlet(nu - step, size) + _dirichlet(nu + step, size))


def _dirichlet(nu: FloatArray, size: int) -> ComplexArray:
    """D(ν), of period 1."""
    within = nu - np.round(nu)
    kernel = size * np.sinc(size * within) / np.sinc(within)
    return np.asarray(kernel * np.exp(-1j * np.pi * within * (size - 1)))


def _solve(nu: FloatArray, size: int, moments: ComplexArray) -> ComplexArray:
    """z of the mean and all tones: of least norm where they cannot be told apart."""
    minus = _weight_sum(nu[:, None] - nu, size)
    plus = _weight_sum(nu[:, None] + nu, size)
    cosines, sines = 0.5 * (minus + plus).real, 0.5 * (minus - plus).real
    mixed = 0.5 * (minus - plus).imag  # Σ w cos_k sin_l; Σ w sin = −Im S
    normal = np.block([[cosines, mixed], [mixed.T, sines]])
    diagonal = np.diag(normal)
    # The mean and a tone at f_s/2 have no sine.
    used = diagonal > INDISTINCT * diagonal.max()
    scale = np.sqrt(diagonal[used])
    right = np.concatenate([moments.real, -moments.imag])[used] / scale[:, None]
    inverse = np.linalg.pinv(
        normal[np.ix_(used, used)] / np.outer(scale, scale), rcond=INDISTINCT, hermitian=True
    )
    both = np.zeros((2 * len(nu), moments.shape[1]))
    both[used] = inverse @ right / scale[:, None]
    return np.asarray(both[: len(nu)] - 1j * both[len(nu) :])


def _made_by(nu: FloatArray, tones: ComplexArray, at: float, size: int) -> ComplexArray:
    """Σ_i w_i x_i exp(−2πj ν i) at one ν of a sum of tones (n_channel,)."""
    ahead, behind = _weight_sum(at - nu, size), _weight_sum(at + nu, size)
    return np.asarray(0.5 * (ahead @ tones + behind @ tones.conj()))


def _circular(nu: FloatArray) -> FloatArray:
    """Distance from the next whole number."""
    return np.asarray(np.abs(nu - np.round(nu)))


def _near(turns: FloatArray, size: int) -> NDArray[np.bool_]:
    """Which tones hang together, from one to the next, closer than can be told apart."""
    order = np.argsort(turns, kind="stable")
    group = np.zeros(len(turns), dtype=int)
    group[order[1:]] = np.cumsum(size * np.diff(turns[order]) >= LEAST)
    return np.asarray(group[:, None] == group)

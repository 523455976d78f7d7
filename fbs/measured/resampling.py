"""FRFs on another frequency axis, by rational interpolation with its error.

FRFs are rational functions of frequency, and near a resonance nothing else follows them: a straight
line between lines that are half a bandwidth apart is 10 % off. Interpolated is in barycentric form

    r(z) = Σ w_j f_j / (z − z_j) / Σ w_j / (z − z_j)

with weights w that make all FRFs agree best with the lines that are no supports z_j: one set of
weights, since all have the same poles. Nakatsukasa, Sète & Trefethen (2018), The AAA algorithm for
rational approximation, SIAM J. Sci. Comput. 40(3); for several functions Lietaert et al. (2022).

The axis is taken in stretches, each with the lines beside it, and with as many supports as foretell
best, from every other line, the lines in between: more would follow noise, with poles where there
are none. The error is what is left there, or how far the two interpolations, with all lines and
with every other, are apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.checks import ComplexArray, FloatArray, ascending_frequency
from ..errors import AxisMismatchError, FbsError
from ..frf import Frf

STRETCH, BESIDE = 32, 16
"""Lines of the given axis that one rational function serves, and those on either side it also
follows."""

MOST_SUPPORTS = 16
GOOD_ENOUGH = 1e-13
"""Of the largest value of a stretch: round-off, beyond which more supports follow noise."""

FEWEST = 8
"""Lines an axis needs: fewer have no shape to follow."""


@dataclass(frozen=True, eq=False)
class Resampled:
    """FRFs on another axis.

    Attributes
    ----------
    frf : Frf
    error : array, shape (nf,)
        |ΔH| over the largest |H| of that line (each FRF as a share of its peak nearby), from
        interpolating with every other line; the interpolation with all of them is better.
    variance : array, shape of the FRF's values
        E |ΔH|² of each FRF by the same, the mean over the lines nearby; 0 on the FRF's own lines.
    """

    frf: Frf
    error: FloatArray
    variance: FloatArray


def resample(frf: Frf, frequency: ArrayLike) -> Resampled:
    """Interpolate FRFs; nothing is extrapolated.

    Parameters
    ----------
    frf : Frf
    frequency : array, Hz
        Within the axis of the FRF. Lines that are the FRF's own keep their values.

    Raises
    ------
    AxisMismatchError
        Frequencies beyond the axis: the overlap is named.
    FbsError
        Fewer than `FEWEST` lines.
    """
    wanted = ascending_frequency(frequency)
    given = frf.frequency
    if given.size < FEWEST:
        raise FbsError(
            f"{given.size} lines are too few to interpolate; at least {FEWEST} are needed"
        )
    if wanted[0] < given[0] * (1 - 1e-12) or wanted[-1] > given[-1] * (1 + 1e-12):
        raise AxisMismatchError(
            f"lines from {wanted[0]:.6g} to {wanted[-1]:.6g} Hz are wanted, the FRFs run from "
            f"{given[0]:.6g} to {given[-1]:.6g} Hz; {overlap(given, wanted)}"
        )
    flat = frf.values.reshape(given.size, -1)
    values = np.empty((wanted.size, flat.shape[1]), dtype=complex)
    error, variance = np.zeros(wanted.size), np.zeros(values.shape)
    for first in range(0, given.size, STRETCH):
        last = min(first + STRETCH, given.size)
        upper = given[last] if last < given.size else np.inf
        here = (wanted >= (given[first] if first else -np.inf)) & (wanted < upper)
        if not here.any():
            continue
        near = slice(max(0, first - BESIDE), min(given.size, last + BESIDE + 1))
        values[here], error[here], variance[here] = _interpolated(
            given[near], flat[near], wanted[here]
        )
    same = np.isin(wanted, given)
    values[same] = flat[np.isin(given, wanted)]
    error[same], variance[same] = 0.0, 0.0
    shape = (wanted.size, *frf.values.shape[1:])
    ordered = np.ascontiguousarray(values.reshape(shape).transpose(1, 2, 0)).transpose(2, 0, 1)
    return Resampled(replace(frf, frequency=wanted, values=ordered), error, variance.reshape(shape))


def overlap(first: FloatArray, second: FloatArray) -> str:
    """Name the band two axes have in common."""
    low, high = max(first[0], second[0]), min(first[-1], second[-1])
    if low > high:
        return "they have no frequency in common"
    return f"they have {low:.6g} to {high:.6g} Hz in common"


def _interpolated(
    axis: FloatArray, values: ComplexArray, wanted: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return values at `wanted`, their largest relative error, and the variance of each FRF.

    Errors count by the size of a line, the largest of its FRFs of peak 1: it grows by powers of
    ten towards 0 Hz of what is free, and noise with it.
    """
    peak = np.abs(values).max(axis=0)
    peak = np.where(peak > 0, peak, 1.0)
    scaled = values / peak
    size = np.abs(scaled).max(axis=1)
    size = np.maximum(size, np.finfo(float).eps)
    half, rest = slice(0, None, 2), slice(1, axis.size - 1 if axis.size % 2 == 0 else None, 2)
    off, count = np.full(scaled[rest].shape, np.inf), 1
    for supports, weights in _rationals(axis[half], scaled[half], size[half]):
        left = _evaluated(axis[half][supports], scaled[half][supports], weights, axis[rest])
        left = np.abs(left - scaled[rest]) / size[rest, None]
        if not np.linalg.norm(left) < np.linalg.norm(off):
            continue
        off, count = left, len(supports)
        coarse = _evaluated(axis[half][supports], scaled[half][supports], weights, wanted)
    for supports, weights in _rationals(axis, scaled, size):
        if len(supports) <= count:
            found = _evaluated(axis[supports], scaled[supports], weights, wanted)
    there = np.exp(np.interp(wanted, axis, np.log(size)))[:, None]
    apart = np.abs(found - coarse) / there
    error = np.maximum(off.max(), apart.max(axis=1))
    variance = np.maximum((off**2).mean(axis=0), apart**2) * (there * peak) ** 2
    return found * peak, error, variance


def _rationals(
    axis: FloatArray, values: ComplexArray, size: FloatArray
) -> Iterator[tuple[list[int], ComplexArray]]:
    """Yield supports and weights: the line that is worst becomes a support, one after the other."""
    typical = np.median(values / size[:, None], axis=0) * size[:, None]
    chosen = [int(np.argmax(np.abs(values - typical).max(axis=1) / size))]
    weights = np.ones(1, dtype=complex)
    while True:
        yield list(chosen), weights
        if len(chosen) >= min(MOST_SUPPORTS, axis.size // 2):
            return
        rest = np.setdiff1d(np.arange(axis.size), chosen)
        off = _evaluated(axis[chosen], values[chosen], weights, axis[rest]) - values[rest]
        worst = np.abs(off).max(axis=1) / size[rest]
        if worst.max() <= GOOD_ENOUGH:
            return
        chosen.append(int(rest[np.argmax(worst)]))
        weights = _weights(axis, values, size, chosen)


def _weights(
    axis: FloatArray, values: ComplexArray, size: FloatArray, chosen: list[int]
) -> ComplexArray:
    """Return the right singular vector of the stacked Loewner matrices' least singular value."""
    rest = np.setdiff1d(np.arange(axis.size), chosen)
    cauchy = 1 / (axis[rest, None] - axis[chosen]) / size[rest, None]
    loewner = (values[rest, None, :] - values[None, chosen, :]) * cauchy[:, :, None]
    stacked = loewner.transpose(2, 0, 1).reshape(-1, len(chosen))
    gram = np.linalg.qr(stacked, mode="r")  # as small as the weights are many
    weights: ComplexArray = np.linalg.svd(gram)[2][-1].conj()
    return weights


def _evaluated(
    supports: FloatArray, values: ComplexArray, weights: ComplexArray, at: FloatArray
) -> ComplexArray:
    distance = at[:, None] - supports
    exact = distance == 0
    cauchy = weights / np.where(exact, 1.0, distance)
    found = (cauchy @ values) / cauchy.sum(axis=1, keepdims=True)
    for row, column in np.argwhere(exact):
        found[row] = values[column]
    return np.asarray(found)

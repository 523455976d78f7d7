"""FRFs on another frequency axis, by rational interpolation with its error.

FRFs are rational functions of frequency, and near a resonance nothing else follows them: a straight
line between lines that are half a bandwidth apart is 10 % off. Interpolated is in barycentric form

    r(z) = Σ w_j f_j / (z − z_j) / Σ w_j / (z − z_j)

with weights w that make all FRFs agree best with the lines that are no supports z_j: one set of
weights, since all have the same poles. Nakatsukasa, Sète & Trefethen (2018), The AAA algorithm for
rational approximation, SIAM J. Sci. Comput. 40(3); for several functions Lietaert et al. (2022).

The axis is taken in stretches, each with the lines beside it. The error is what the same
interpolation makes of the lines in between when only every other line is given to it.
"""

from __future__ import annotations

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
        |ΔH| / max |H| over the FRFs and the lines nearby, from interpolating with every other
        line; the interpolation with all of them is better.
    """

    frf: Frf
    error: FloatArray


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
    error = np.zeros(wanted.size)
    for first in range(0, given.size, STRETCH):
        last = min(first + STRETCH, given.size)
        upper = given[last] if last < given.size else np.inf
        here = (wanted >= (given[first] if first else -np.inf)) & (wanted < upper)
        if not here.any():
            continue
        near = slice(max(0, first - BESIDE), min(given.size, last + BESIDE + 1))
        values[here] = _interpolated(given[near], flat[near], wanted[here])
        error[here] = _error(given[near], flat[near])
    same = np.isin(wanted, given)
    values[same] = flat[np.isin(given, wanted)]
    error[same] = 0.0
    shape = (wanted.size, *frf.values.shape[1:])
    ordered = np.ascontiguousarray(values.reshape(shape).transpose(1, 2, 0)).transpose(2, 0, 1)
    return Resampled(replace(frf, frequency=wanted, values=ordered), error)


def overlap(first: FloatArray, second: FloatArray) -> str:
    """Name the band two axes have in common."""
    low, high = max(first[0], second[0]), min(first[-1], second[-1])
    if low > high:
        return "they have no frequency in common"
    return f"they have {low:.6g} to {high:.6g} Hz in common"


def _error(axis: FloatArray, values: ComplexArray) -> float:
    """Return how far interpolation with every other line is from those in between."""
    rest = slice(1, axis.size - 1 if axis.size % 2 == 0 else axis.size, 2)
    if axis[rest].size == 0:
        return 1.0
    off = _interpolated(axis[::2], values[::2], axis[rest]) - values[rest]
    size = np.abs(values).max(axis=0)
    return float((np.abs(off) / np.where(size > 0, size, 1.0)).max())


def _interpolated(axis: FloatArray, values: ComplexArray, wanted: FloatArray) -> ComplexArray:
    """Return rational functions through some of the lines, closest to the others, at `wanted`."""
    size = np.abs(values).max(axis=0)
    scaled = values / np.where(size > 0, size, 1.0)
    supports, weights = _supports(axis, scaled)
    found: ComplexArray = _evaluated(axis[supports], scaled[supports], weights, wanted) * size
    return found


def _supports(axis: FloatArray, values: ComplexArray) -> tuple[list[int], ComplexArray]:
    """Add the line that is worst as a support until the others are met."""
    chosen = [int(np.argmax(np.abs(values - values.mean(axis=0)).max(axis=1)))]
    weights = np.ones(1, dtype=complex)
    while len(chosen) < min(MOST_SUPPORTS, axis.size // 2):
        rest = np.setdiff1d(np.arange(axis.size), chosen)
        off = np.abs(
            _evaluated(axis[chosen], values[chosen], weights, axis[rest]) - values[rest]
        ).max(axis=1)
        if off.max() <= GOOD_ENOUGH:
            break
        chosen.append(int(rest[np.argmax(off)]))
        weights = _weights(axis, values, chosen)
    return chosen, weights


def _weights(axis: FloatArray, values: ComplexArray, chosen: list[int]) -> ComplexArray:
    """Return the right singular vector of the stacked Loewner matrices' least singular value."""
    rest = np.setdiff1d(np.arange(axis.size), chosen)
    cauchy = 1 / (axis[rest, None] - axis[chosen])
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

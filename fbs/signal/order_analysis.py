"""Spectra over orders: multiples of a shaft's speed, steady or varying."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.checks import FloatArray
from ..errors import FbsError
from .spectra import Window, amplitude_spectrum, finite_samples


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """Peak amplitudes over orders.

    Parameters
    ----------
    order : array, shape (n_order,)
        Cycles per turn of the shaft.
    values : array, shape (n_order, ...)
    n_averages : int
        Segments averaged.
    """

    order: FloatArray
    values: FloatArray
    n_averages: int


def order_spectrum(
    samples: ArrayLike,
    sampling_frequency: float,
    reference_frequency: float,
    *,
    turns: int | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
) -> OrderSpectrum:
    """Amplitudes at a steady speed, order = f / f_ref.

    Segments are whole turns to the nearest sample, so that whole orders fall on lines: the order
    o is off its line by at most o / (2 size) lines of `turns` turns, of `size` samples each.

    Parameters
    ----------
    samples : array, shape (n,) or (n, ...)
    sampling_frequency : float, Hz
    reference_frequency : float, Hz
        Turns per second of the shaft.
    turns : int or None
        Turns per segment; lines are 1 / turns apart. None takes all whole turns of the record.
    window, overlap
        As for `amplitude_spectrum`.

    Raises
    ------
    FbsError, NonFiniteError
        As for `amplitude_spectrum`, or the record is shorter than the turns.
    """
    record = finite_samples(samples)
    if not (np.isfinite(reference_frequency) and 0 < reference_frequency < sampling_frequency / 4):
        raise FbsError(
            "the reference frequency must be above 0 and below a quarter of the sampling "
            f"frequency, {sampling_frequency / 4:.10g} Hz; got {reference_frequency} Hz"
        )
    per_turn = sampling_frequency / reference_frequency
    return _whole_turns(record, per_turn, turns, window, overlap)


def tracked_orders(
    samples: ArrayLike,
    angle: ArrayLike,
    *,
    turns: int | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
) -> OrderSpectrum:
    """Amplitudes at a varying speed: the record is resampled over the shaft's angle.

    A turn is cut into so many steps that none is longer than the shortest one between two samples:
    nothing the record holds lies above their Nyquist order, and no filter against aliasing is
    needed. Orders are given up to where the fastest turn was sampled twice per cycle.

    Between the samples a spline of degree 5 is drawn. Of a sine with 20 samples per cycle it is
    wrong by 7e-8 at worst, with 10 by 5e-6, with 5 by 6e-4, with 3 by 3e-2.

    Parameters
    ----------
    samples : array, shape (n,) or (n, ...)
        At uniform instants.
    angle : array, shape (n,), rad
        Of the shaft at the same instants, strictly ascending and smooth.
    turns, window, overlap
        As for `order_spectrum`.

    Raises
    ------
    FbsError, NonFiniteError
    """
    from scipy.interpolate import make_interp_spline

    record, position = finite_samples(samples), finite_samples(angle) / (2.0 * np.pi)
    if position.shape != (len(record),) or len(record) < 8:
        raise FbsError(
            f"one angle per sample and 8 samples or more are needed, got angles of shape "
            f"{position.shape} for {len(record)} samples"
        )
    step = np.diff(position)
    if not (step > 0).all():
        sample = int(np.argmax(step <= 0)) + 1
        raise FbsError(f"the angle must ascend strictly, but does not at sample {sample}")
    per_turn = int(np.ceil(1.0 / step.min()))
    count = int(np.floor((position[-1] - position[0]) * per_turn))
    at = position[0] + np.arange(count + 1) / per_turn
    number = np.arange(len(record), dtype=float)
    instants = np.clip(make_interp_spline(position, number, k=3)(at), 0.0, number[-1])
    resampled = make_interp_spline(number, record, k=5)(instants)
    spectrum = _whole_turns(resampled, float(per_turn), turns, window, overlap)
    known = spectrum.order <= 0.5 / step.max()
    return OrderSpectrum(spectrum.order[known], spectrum.values[known], spectrum.n_averages)


def _whole_turns(
    record: FloatArray, per_turn: float, turns: int | None, window: Window, overlap: float
) -> OrderSpectrum:
    lasting = int(np.floor(len(record) / per_turn + 1e-9))  # a turn short by rounding is whole
    wanted = lasting if turns is None else turns
    if wanted < 1 or wanted > lasting:
        raise FbsError(f"the record lasts {len(record) / per_turn:.4g} turns, {wanted} are needed")
    size = min(round(wanted * per_turn), len(record))
    part = record[:size] if turns is None else record
    spectrum = amplitude_spectrum(
        part, per_turn, resolution=per_turn / size, window=window, overlap=overlap
    )
    return OrderSpectrum(spectrum.frequency, spectrum.values, spectrum.n_averages)

"""Peak-hold of a swept sine, and what the sweep's rate does to it.

A sweep dwells on no frequency: the envelope of the response lags behind |H|. For one lightly
damped mode, sigma = zeta w_r, and a force of instantaneous frequency w(t), dw/dt = const, the
envelope over the steady peak is exactly (rotating-wave approximation, error of the order of zeta)

    E(x) = | int_0^inf exp(-(1 + j x) t + j eps t^2 / 2) dt |,   x = (w - w_r) / sigma,
    eps = (dw/dt) / sigma^2,

a Faddeeva function. eps is the criterion of Lewis (1932, Trans. ASME 54, 253-261). Expanding the
integrand: for eps << 1 the peak is 2 eps sigma late and lower by eps^2 / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.checks import FloatArray
from ..errors import FbsError
from .spectra import finite_samples


@dataclass(frozen=True, eq=False)
class PeakHold:
    """The largest |y| / |F| in each band of frequency, an estimate of |H|.

    Parameters
    ----------
    frequency : array, shape (nf,) or (nf, ...), Hz
        Where in its band the value was held.
    magnitude : array, shape (nf,) or (nf, ...)
        Responses' unit per N.
    """

    frequency: FloatArray
    magnitude: FloatArray


@dataclass(frozen=True)
class SweepError:
    """What a sweep does to the peak of one mode.

    Parameters
    ----------
    criterion : float
        eps = (dw/dt) / (zeta w)^2, with the sign of the rate.
    attenuation : float
        1 - held peak / steady peak.
    shift : float, Hz
        Held peak's frequency less the natural one; a sweep upwards shifts upwards.
    """

    criterion: float
    attenuation: float
    shift: float


def peak_hold(
    response: ArrayLike, force_amplitude: ArrayLike, frequency: ArrayLike, edges: ArrayLike
) -> PeakHold:
    """Hold the largest |y + j Hilbert(y)| / F in each band of the instantaneous frequency.

    The mean is removed first (a preload has no envelope). The Hilbert transform is that of a
    record that repeats: a few periods at both ends are spoilt and belong outside the edges.

    Parameters
    ----------
    response : array, shape (n,) or (n, ...)
    force_amplitude : float or array, shape (n,), N
        Of the swept sine.
    frequency : array, shape (n,), Hz
        Instantaneous, of the force.
    edges : array, shape (nf + 1,), Hz
        Ascending; band i holds edges[i] <= f < edges[i + 1].

    Raises
    ------
    FbsError, NonFiniteError
        Shapes that do not fit, an amplitude that is not positive, edges that do not ascend, or a
        band that the sweep does not pass.
    """
    from scipy.signal import hilbert

    record, instantaneous = finite_samples(response), finite_samples(frequency)
    amplitude = np.broadcast_to(np.asarray(force_amplitude, dtype=float), instantaneous.shape)
    bounds = np.asarray(edges, dtype=float)
    if instantaneous.shape != (len(record),):
        raise FbsError(
            f"one frequency per sample is needed, got {instantaneous.shape} for {len(record)}"
        )
    if not (np.isfinite(amplitude) & (amplitude > 0)).all():
        raise FbsError(f"the force's amplitude must be positive, got {amplitude.min()} N")
    if bounds.ndim != 1 or bounds.size < 2 or not (np.diff(bounds) > 0).all():
        raise FbsError("the edges of the bands must ascend, two or more of them")
    centred = record - record.mean(axis=0)
    further = (1,) * (record.ndim - 1)
    envelope = np.abs(hilbert(centred, axis=0)) / amplitude.reshape(-1, *further)
    band = np.searchsorted(bounds, instantaneous, side="right") - 1
    held_at = np.empty((bounds.size - 1, *record.shape[1:]))
    held = np.empty_like(held_at)
    order = np.argsort(band, kind="stable")
    starts = np.searchsorted(band[order], np.arange(bounds.size))
    for number in range(bounds.size - 1):
        inside = order[starts[number] : starts[number + 1]]
        if not inside.size:
            raise FbsError(
                f"the sweep never is between {bounds[number]:.10g} and "
                f"{bounds[number + 1]:.10g} Hz; it runs from {instantaneous.min():.10g} to "
                f"{instantaneous.max():.10g} Hz"
            )
        largest = envelope[inside].argmax(axis=0)
        held[number] = envelope[inside].max(axis=0)
        held_at[number] = instantaneous[inside][largest]
    return PeakHold(held_at, held)


def sweep_error(natural_frequency: float, damping_ratio: float, rate: float) -> SweepError:
    """Attenuation and shift of a mode's peak in a sweep: the maximum of E(x), see above.

    Parameters
    ----------
    natural_frequency : float, Hz
    damping_ratio : float
        Above 0, well below 1.
    rate : float, Hz/s
        df/dt as the sweep passes the mode: f ln(f2 / f1) / T of a logarithmic one.

    Raises
    ------
    FbsError
    """
    from scipy.optimize import minimize_scalar

    sigma = _decay(natural_frequency, damping_ratio)
    if not np.isfinite(rate):
        raise FbsError(f"the sweep's rate must be finite, got {rate} Hz/s")
    criterion = 2.0 * np.pi * rate / sigma**2
    eps = abs(criterion)
    if eps < 1e-7:  # the series' next terms are of the order eps^3 and eps^4
        return SweepError(criterion, eps**2 / 2, criterion * sigma / np.pi)
    # The peak lies at 2 eps for slow and below 2 + 2.5 sqrt(eps) for fast sweeps.
    x = np.linspace(0.0, min(2.0 * eps, 2.0 + 2.5 * np.sqrt(eps)) + 0.1, 400)
    first = int(np.argmax(swept_peak(x, eps)))
    bracket = (x[max(first - 1, 0)], x[min(first + 1, x.size - 1)])
    found = minimize_scalar(
        lambda at: -float(swept_peak(np.array([at]), eps)[0]),
        bounds=bracket,
        method="bounded",
        options={"xatol": 1e-9},
    )
    shift = float(np.sign(rate) * found.x * sigma / (2.0 * np.pi))
    return SweepError(criterion, 1.0 + float(found.fun), shift)


def swept_peak(x: FloatArray, eps: float) -> FloatArray:
    """E(x) of a mode at eps > 0; 1 is the steady peak."""
    from scipy.special import wofz

    root = np.sqrt(eps / 2.0) * np.exp(-0.25j * np.pi)  # of a, for the integrand exp(-a t^2 - s t)
    z = (1.0 + 1j * np.asarray(x)) / (2.0 * root)
    return np.asarray(np.abs(np.sqrt(np.pi) / (2.0 * root) * wofz(1j * z)))


def _decay(natural_frequency: float, damping_ratio: float) -> float:
    if not (np.isfinite(natural_frequency) and natural_frequency > 0 and 0 < damping_ratio < 1):
        raise FbsError(
            "a natural frequency above 0 Hz and a damping ratio between 0 and 1 are needed, got "
            f"{natural_frequency} Hz and {damping_ratio}"
        )
    return float(damping_ratio * 2.0 * np.pi * natural_frequency)

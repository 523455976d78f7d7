"""FRFs estimated from records: periodic, averaged (H1, H2, Hv) and from impacts.

What a record can tell. The samples are taken for a band-limited force: the continuous one must
pass through them and have nothing at or above Nyquist. A multisine is just that, and its steady
response then gives H itself at the excited lines. A force held constant between its samples (a
converter's zero-order hold) is another one, and the estimate H sinc(f / fs) exp(-j pi f / fs) plus
images; one drawn straight between them gives H sinc^2(f / fs) plus images: -0.004 % and -0.9 deg,
and -0.008 %, at f = fs / 200. What lies above Nyquist folds back and cannot be told apart
afterwards, so no line at or above it is estimated.

A free body drifts away, and a displacement that drifts has no steady state and no spectrum. Its
acceleration has both: record that, estimate the accelerance and convert it with `Frf.to`.

0 Hz carries preloads and the offsets of sensors: it is left out unless fmin = 0 asks for it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.checks import ComplexArray, FloatArray, read_only
from .._kernels.door import door
from ..errors import FbsError, SingularLineError
from ..frf import Frf
from ._averages import (
    Regression,
    Segments,
    Spectra,
    h2,
    hv,
    length,
    multiple_coherence,
)
from ._periods import Periods, inverted_inputs, scatter
from .records import Lines, Record, alike, whole_number

THRESHOLD = 1e-4
"""Share of its peak an input must reach on a line: -80 dB, the noise floor of a good sensor."""

MAX_CONDITION = 1e4
"""Inputs so alike that four digits are lost in telling them apart are refused."""

Estimator = Literal["H1", "H2", "Hv"]


@dataclass(frozen=True, eq=False)
class Estimate:
    """An FRF out of records, and how far to trust it.

    Parameters
    ----------
    frf : Frf
        At the excited lines.
    coherence : array, shape (nf, n_response), or None
        Share of each output's power that the inputs explain (averaged) or that repeats from
        period to period (periodic). 0 where an output is silent. None where there is too little
        data for it to be anything but 1.
    input_condition : array, shape (nf,)
        How many times larger a relative error of the outputs may be in H because the inputs
        resemble each other; 1 for a single input, whatever the inputs' units.
    n_averages : int
        Periods (of the experiment with the fewest), segments or impacts.
    kind : str
        "periodic", "H1", "H2", "Hv" or "impulse".
    variance : array, shape (nf, n_response, n_excitation), or None
        E |H - E H|^2 of a periodic estimate, from the scatter of its periods.
    unexcited : array, Hz
        Lines of the band that were left out because an input hardly excites them.
    added_damping : float
        a, 1/s, of an exponential window: `frf` is H(jw + a), see `impulse_frf`.
    """

    frf: Frf
    coherence: FloatArray | None
    input_condition: FloatArray
    n_averages: int
    kind: str
    variance: FloatArray | None = None
    unexcited: FloatArray = field(default_factory=lambda: np.empty(0))
    added_damping: float = 0.0

    def __post_init__(self) -> None:
        for name in ("coherence", "input_condition", "variance", "unexcited"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, read_only(np.asarray(value)))


@door
def periodic_frf(
    records: Record | Iterable[Record],
    period_samples: int,
    *,
    transient_periods: int = 0,
    fmin: float | None = None,
    fmax: float | None = None,
    frequency: ArrayLike | None = None,
    threshold: float = THRESHOLD,
    max_condition: float = MAX_CONDITION,
) -> Estimate:
    """Estimate H = Y U^-1 from whole periods of steady state, free of leakage.

    Y (n_output, n_experiment) and U (n_input, n_experiment) are the spectra of the mean period of
    every experiment; with more experiments than inputs U^-1 is the pseudo-inverse. The scatter
    r_p = Y_p - H U_p of an experiment's P periods gives the variance of the estimate,

        var H_ij = sum_e |(U^-1)_ej|^2 sum_p |r_iep - mean r_ie|^2 / (P (P - 1)),

    noise of outputs and inputs and a transient not yet over included: Pintelon & Schoukens
    (2012), System Identification, 2nd ed., ch. 2. Noise of the inputs biases H by the inverse
    square of their signal-to-noise ratio after averaging.

    Parameters
    ----------
    records : Record or several
        One experiment each, at least as many as inputs: one input at a time, or all at once with
        the signs of a Hadamard matrix (condition 1), or with other random phases (a condition
        above 1, by chance far above on a line or two). Of each, the last whole periods are used.
    period_samples : int
    transient_periods : int
        Periods at each record's start that are not steady yet and are left out.
    fmin, fmax : float, Hz
        Default: all lines above 0 Hz and below Nyquist.
    frequency : array, Hz
        Exactly these lines instead, all of which must be excited.
    threshold : float
        A line counts as excited where each input, over all experiments, reaches this share of
        its peak; the others go into `Estimate.unexcited`.
    max_condition : float
        Largest condition of U, its rows scaled to unit length.

    Raises
    ------
    SingularLineError
        The experiments do not tell the inputs apart at some lines, or a line of `frequency` is
        not excited.
    FbsError
        A record shorter than one period, inputs that do not repeat, too few experiments, an
        input that is zero, fmax not below Nyquist.
    """
    first, source = alike(records)
    size = whole_number(period_samples, "period_samples", 2)
    skipped = whole_number(transient_periods, "transient_periods", 0)
    lines = Lines.of(first.sampling_frequency, size, fmin, fmax, frequency)
    experiments = [Periods.of(r, size, skipped, k) for k, r in enumerate(source)]
    _require_enough(len(experiments), first, "experiments")
    u = np.stack([np.fft.rfft(e.inputs.mean(axis=0), axis=0) for e in experiments], axis=-1)
    lines, _ = lines.excited(length(u), first.excitations, threshold)
    y = np.stack([e.mean_output(lines.index) for e in experiments], axis=-1)
    inverse, condition = inverted_inputs(u[lines.index])
    _require_independent(lines, condition, max_condition)
    values = y @ inverse
    coherence, variance = scatter(experiments, lines, values, y, inverse)
    return Estimate(
        _frf(first, lines, values),
        coherence,
        condition,
        min(len(e.inputs) for e in experiments),
        "periodic",
        variance,
        lines.unexcited,
    )


@door
def averaged_frf(
    records: Record | Iterable[Record],
    segment: int,
    *,
    overlap: float = 0.5,
    window: str | tuple[Any, ...] | FloatArray = "hann",
    estimator: Estimator = "H1",
    noise_ratio: float | None = None,
    remove_mean: bool = True,
    fmin: float | None = None,
    fmax: float | None = None,
    frequency: ArrayLike | None = None,
    threshold: float = THRESHOLD,
    max_condition: float = MAX_CONDITION,
) -> Estimate:
    """Estimate H from spectra averaged over windowed segments, G_yf = E[Y F^H] and so on.

        H1 = G_yf G_ff^-1                    no noise on the inputs; |H| low by 1 / (1 + n_f / s_f)
        H2 = G_yy G_fy^-1                    no noise on the outputs; |H| high by 1 + n_y / s_y
        Hv = G_yf (G_ff - lambda N)^-1       noise on both: total least squares, output by output

    with lambda the least for which [[G_ff, G_fy], [G_yf, G_yy]] - lambda diag(N, N_y) is
    singular, diag(N, N_y) being the noise up to a factor; and the multiple coherence
    gamma_i^2 = (G_yf G_ff^-1 G_fy)_ii / G_yy_ii, for one input the ordinary
    |G_yf|^2 / (G_ff G_yy). Bendat & Piersol (2010), Random Data, 4th ed., ch. 6, 7; Rocklin,
    Crowley & Vold (1985), A comparison of H1, H2 and Hv frequency response functions, IMAC III.

    H2 of one input is taken output by output. Of several inputs it needs as many outputs as
    inputs: a pseudo-inverse of a wide G_fy would weigh outputs of different units against each
    other and let the noise of one into the FRF of the next.

    Windows cancel in the ratio, so amplitudes need no correction. What does not cancel is
    leakage: segments should last several times 1 / (damping ratio x natural frequency).

    Parameters
    ----------
    records : Record or iterable of Record
        Taken one by one, so that a long run may come in pieces; segments do not cross them.
    segment : int
        Samples per segment.
    overlap : float
        Share of a segment it has in common with the next, 0 <= overlap < 1.
    window : str, tuple or array
        As for `scipy.signal.get_window`, or its `segment` values.
    estimator : "H1", "H2" or "Hv"
    noise_ratio : float, optional
        For Hv: power of an output's noise / power of an input's, (m/N)^2 for displacements.
        Default: noise in proportion to each channel's own power on each line, which makes the
        estimate independent of units, and for one input |Hv|^2 = |H1| |H2|.
    remove_mean : bool
        Take the mean off every segment of every channel, so that preload and offsets do not leak.
    fmin, fmax, frequency, threshold, max_condition
        As for `periodic_frf`; the condition is that of the inputs, sqrt(cond G_ff), with G_ff
        scaled to a unit diagonal.

    Raises
    ------
    SingularLineError
        The inputs are correlated at some lines, or the spectra H2 or Hv divide by vanish.
    FbsError
        A record shorter than one segment, fewer segments than inputs, an input that is zero, an
        unknown estimator or window, fmax not below Nyquist.
    """
    first, source = alike(records)
    size = whole_number(segment, "segment", 2)
    lines = Lines.of(first.sampling_frequency, size, fmin, fmax, frequency)
    square = estimator == "H2" and len(first.excitations) > 1
    if square and len(first.excitations) != len(first.responses):
        raise FbsError(
            f"H2 of {len(first.excitations)} inputs needs as many outputs, got "
            f"{len(first.responses)}; take H1 or Hv, or leave outputs out"
        )
    cut = Segments(size, _hop(size, overlap), _window(window, size)[:, None], remove_mean)
    spectra = Spectra.of(first, source, cut, lines, square)
    lines, spectra = spectra.excited(lines, first, threshold)
    regression = Regression.of(spectra)
    _require_enough(spectra.count, first, "segments")
    _require_independent(lines, regression.condition, max_condition)
    if estimator == "H2":
        values = h2(spectra, lines)
    elif estimator == "Hv":
        values = hv(spectra, regression, lines, noise_ratio)
    else:
        values = regression.h1()
    return Estimate(
        _frf(first, lines, values),
        multiple_coherence(spectra, regression),
        regression.condition,
        spectra.count,
        estimator,
        unexcited=lines.unexcited,
    )


@door
def impulse_frf(
    records: Record | Iterable[Record],
    *,
    decay: float = 0.0,
    max_remainder: float = 0.1,
    fmin: float | None = None,
    fmax: float | None = None,
    frequency: ArrayLike | None = None,
    threshold: float = THRESHOLD,
    max_condition: float = MAX_CONDITION,
) -> Estimate:
    """Estimate H(jw + a) = G_yf G_ff^-1 over impacts, spectra of exp(-a t) u and exp(-a t) y.

    Since exp(-a t) (h * u) = (exp(-a t) h) * (exp(-a t) u), the exponential window on input and
    output alike is exact, and it adds damping: every pole s becomes s - a, so a mode's
    zeta w_n grows by a, and M, C, K become M, C + 2a M, K + a C + a^2 M (an accelerance is then
    (jw + a)^2 times the receptance). It is stated as `Estimate.added_damping` and not taken back,
    which is only possible for poles: Ewins (2000), Modal Testing, 2nd ed., ch. 3.

    Parameters
    ----------
    records : Record or several
        One impact each, all of one length, from rest on, with the sensors' offsets taken off.
        Several inputs need as many impacts, at different ones; more are averaged as by H1.
    decay : float
        a, 1/s; 0 is no window.
    max_remainder : float
        An output whose last twentieth, windowed, exceeds this share of its peak is refused: it
        rings on, or drifts, and what is cut off would leak.
    fmin, fmax, frequency, threshold, max_condition
        As for `averaged_frf`.

    Raises
    ------
    FbsError
        An output not over at the record's end, impacts of different length, too few impacts, an
        input that is zero, fmax not below Nyquist.
    SingularLineError
        The impacts do not tell the inputs apart at some lines.
    """
    if not (np.isfinite(decay) and decay >= 0):
        raise FbsError(f"decay must be finite and not negative, got {decay} 1/s")
    first, source = alike(records)
    whole_number(first.n_sample, "the number of samples", 2)
    lines = Lines.of(first.sampling_frequency, first.n_sample, fmin, fmax, frequency)
    window = np.exp(-decay * first.time)[:, None]
    checked = (
        _require_over(record, number, window, max_remainder) for number, record in enumerate(source)
    )
    cut = Segments(first.n_sample, first.n_sample, window, False)
    spectra = Spectra.of(first, checked, cut, lines)
    lines, spectra = spectra.excited(lines, first, threshold)
    regression = Regression.of(spectra)
    _require_enough(spectra.count, first, "impacts")
    _require_independent(lines, regression.condition, max_condition)
    return Estimate(
        _frf(first, lines, regression.h1()),
        multiple_coherence(spectra, regression),
        regression.condition,
        spectra.count,
        "impulse",
        unexcited=lines.unexcited,
        added_damping=float(decay),
    )


def _require_over(record: Record, number: int, window: FloatArray, limit: float) -> Record:
    """Refuse an impact whose response is not over at the record's end."""
    if record.n_sample != len(window):
        raise FbsError(
            f"record {number} has {record.n_sample} samples and record 0 {len(window)}; "
            "impacts must be of one length"
        )
    size = np.abs(record.outputs * window)
    peak, end = size.max(axis=0), size[-max(1, len(size) // 20) :].max(axis=0)
    for name, largest, rest in zip(record.responses, peak, end, strict=True):
        if rest > limit * largest:
            raise FbsError(
                f"record {number}: output {name!r} is still at {100 * rest / largest:.3g} % of its "
                f"peak in the last twentieth of {record.n_sample / record.sampling_frequency:.4g} "
                "s; record longer or raise decay, or, if a free body drifts, record accelerations"
            )
    return record


def _require_enough(count: int, record: Record, what: str) -> None:
    needed = len(record.excitations)
    if count < needed:
        raise FbsError(f"{needed} inputs need at least {needed} {what}, got {count}")


def _require_independent(lines: Lines, condition: FloatArray, limit: float) -> None:
    wrong = ~(condition <= limit)
    if wrong.any():
        raise SingularLineError(
            lines.frequency[wrong],
            f"the inputs cannot be told apart: their condition reaches "
            f"{condition[wrong].max():.3g}, above {limit:.3g},",
            "excite with other phases, with uncorrelated signals or one input at a time",
        )


def _hop(size: int, overlap: float) -> int:
    if not 0 <= overlap < 1:
        raise FbsError(f"overlap must be at least 0 and below 1, got {overlap}")
    return max(1, size - round(overlap * size))


def _window(window: str | tuple[Any, ...] | FloatArray, size: int) -> FloatArray:
    from scipy.signal import get_window  # half a second that other uses of the package save

    if not isinstance(window, str | tuple):
        values = np.asarray(window, dtype=float)
        if values.shape != (size,) or not np.isfinite(values).all() or not values.any():
            raise FbsError(
                f"a window's values must be {size} finite numbers, not all 0; got shape "
                f"{values.shape}"
            )
        return values
    try:
        return np.asarray(get_window(window, size), dtype=float)
    except ValueError as error:
        raise FbsError(f"window {window!r}: {error}") from None


def _frf(record: Record, lines: Lines, values: ComplexArray) -> Frf:
    """Return the FRF, frequency-contiguous."""
    contiguous = np.ascontiguousarray(values.transpose(1, 2, 0)).transpose(2, 0, 1)
    return Frf(lines.frequency, contiguous, record.responses, record.excitations, record.quantity)

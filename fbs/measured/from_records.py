"""FRFs out of the records of a test: hammer or shaker, one reference after the other or at once.

Records of the same excitations are experiments of one test and are averaged; records of others
(a hammer that goes from point to point) give the columns of one matrix. A record of several blows
is cut into one for each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from .._kernels.checks import FloatArray
from ..errors import FbsError
from ..frf import Frf
from ..signal.estimation import Estimate, Estimator, averaged_frf, impulse_frf
from ..signal.records import Record

Signal = Literal["hammer", "noise"]

BLOW = 0.2
"""Of the largest force: what a blow reaches at least, and a rebound or the sensor's ringing not."""

QUIET = 0.01
"""Of the peak: a hammer's force is below it for most of the time, a shaker's hardly ever."""

BEFORE = 0.02
"""Of the time between blows: what is kept before each."""


@dataclass(frozen=True, eq=False)
class Estimated:
    """An FRF matrix out of records.

    Attributes
    ----------
    frf : Frf
        On the lines that all excitations excite.
    coherence : array, shape of the FRF's values, or None
        Multiple coherence of each response; None if each FRF rests on a single record.
    variance : array, shape of the FRF's values, or None
        E |H − E H|² by the coherence.
    averages : mapping of str to int
        Excitation → records, segments or blows averaged.
    signal : "hammer" or "noise"
    estimator : "H1", "H2" or "Hv"
    unexcited : array, Hz
        Lines left out because an excitation hardly reaches them.
    added_damping : float
        1/s, of an exponential window.
    remainder : float
        Of a peak: what the loudest response to a blow is at in the last twentieth of its record.
        What is cut off there leaks, and coherence does not show it.
    """

    frf: Frf
    coherence: FloatArray | None
    variance: FloatArray | None
    averages: dict[str, int]
    signal: Signal
    estimator: Estimator
    unexcited: FloatArray
    added_damping: float = 0.0
    remainder: float = 0.0


def frf_from_records(
    records: Sequence[Record],
    estimator: Estimator = "H1",
    signal: Signal | None = None,
    segment: int | None = None,
    decay: float = 0.0,
    fmin: float | None = None,
    fmax: float | None = None,
) -> Estimated:
    """Estimate an FRF matrix, H1, H2 or Hv; see `averaged_frf` and `impulse_frf`.

    The variance of an estimate of n averages is |H|² (1 − γ²) / (γ² (n − q)), q excitations at
    once (Bendat & Piersol (2010), Random Data, 4th ed., sec. 9.2): |H − E H|² over it has the
    distribution F(2, 2 (n − q)).

    Parameters
    ----------
    records : Records
        Of one sampling frequency and the same responses.
    estimator : "H1", "H2" or "Hv"
    signal : "hammer" or "noise", optional
        Default: what the first record's force looks like.
    segment : int, optional
        Samples of a segment of noise (default: an eighth of the shortest record).
    decay : float
        1/s, of the exponential window of blows.
    fmin, fmax : float, Hz, optional

    Raises
    ------
    FbsError, SingularLineError
        No record; records that do not fit together; as for the estimators.
    """
    if not records:
        raise FbsError("no records given")
    kind = signal or _signal(records[0])
    groups: dict[tuple[str, ...], list[Record]] = {}
    for record in records:
        groups.setdefault(record.excitations, []).append(record)
    _require_apart(groups)
    if kind == "noise":
        estimates = [_noise(g, estimator, segment, fmin, fmax) for g in groups.values()]
        return _joined(estimates, kind, estimator)
    cut = [_alike_long([b for record in group for b in blows(record)]) for group in groups.values()]
    estimates = [_hammer(group, estimator, decay, fmin, fmax) for group in cut]
    remainder = max(_remainder(blow, decay) for group in cut for blow in group)
    return replace(_joined(estimates, kind, estimator), remainder=remainder)


def blows(record: Record) -> list[Record]:
    """Cut a record of several blows into one for each, all of one length.

    Raises
    ------
    FbsError
        Blows of which the next comes before a tenth of the usual time between them.
    """
    force = np.abs(record.inputs).max(axis=1)
    above = np.flatnonzero(force >= BLOW * force.max())
    gaps = np.diff(above)
    if not gaps.size or gaps.max() < 0.05 * record.n_sample:
        return [record]
    starts = above[np.concatenate([[True], gaps > 0.05 * record.n_sample])]
    ends = np.append(starts[1:], record.n_sample)
    length = int((ends - starts).min())
    before = min(int(BEFORE * length), int(starts[0]))
    spans = [slice(start - before, start - before + length) for start in starts]
    return [
        replace(record, inputs=record.inputs[span], outputs=record.outputs[span])
        for span in spans
        if span.stop <= record.n_sample
    ]


# --- parts -------------------------------------------------------------------------------------


def _signal(record: Record) -> Signal:
    force = np.abs(record.inputs).max(axis=1)
    return "hammer" if np.median(force) < QUIET * force.max() else "noise"


def _require_apart(groups: dict[tuple[str, ...], list[Record]]) -> None:
    labels = [label for group in groups for label in group]
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise FbsError(f"{twice[0]} excites in records together with different others")


def _alike_long(blows: list[Record]) -> list[Record]:
    length = min(blow.n_sample for blow in blows)
    return [replace(b, inputs=b.inputs[:length], outputs=b.outputs[:length]) for b in blows]


def _remainder(blow: Record, decay: float) -> float:
    size = np.abs(blow.outputs * np.exp(-decay * blow.time)[:, None])
    end = size[-max(1, len(size) // 20) :]
    return float((end.max(axis=0) / np.maximum(size.max(axis=0), np.finfo(float).tiny)).max())


def _hammer(
    cut: list[Record],
    estimator: Estimator,
    decay: float,
    fmin: float | None,
    fmax: float | None,
) -> Estimate:
    h1 = impulse_frf(cut, decay=decay, fmin=fmin, fmax=fmax)  # refuses what rings on
    if estimator == "H1":
        return h1
    window = np.exp(-decay * cut[0].time)
    other = averaged_frf(
        cut,
        cut[0].n_sample,
        overlap=0.0,
        window=window,
        estimator=estimator,
        remove_mean=False,
        fmin=fmin,
        fmax=fmax,
    )
    return replace(other, added_damping=decay)


def _noise(
    group: list[Record],
    estimator: Estimator,
    segment: int | None,
    fmin: float | None,
    fmax: float | None,
) -> Estimate:
    size = segment or max(2, min(record.n_sample for record in group) // 8)
    return averaged_frf(group, size, estimator=estimator, fmin=fmin, fmax=fmax)


def _joined(estimates: list[Estimate], signal: Signal, estimator: Estimator) -> Estimated:
    common = estimates[0].frf.frequency
    for other in estimates[1:]:
        common = np.intersect1d(common, other.frf.frequency)
    if not common.size:
        raise FbsError("the excitations have no line in common that all of them excite")
    picks = [np.isin(e.frf.frequency, common) for e in estimates]
    responses = estimates[0].frf.responses
    values = np.concatenate(
        [e.frf.select(responses).values[pick] for e, pick in zip(estimates, picks, strict=True)],
        axis=2,
    )
    excitations = tuple(label for e in estimates for label in e.frf.excitations)
    frf = Frf(common, values, responses, excitations, estimates[0].frf.quantity)
    averages = {label: e.n_averages for e in estimates for label in e.frf.excitations}
    coherence = _coherence(estimates, picks, frf)
    variance = None
    if coherence is not None:
        # an average of n has n − q degrees of freedom left to scatter, q excitations at once
        inputs = [len(e.frf.excitations) for e in estimates for _ in e.frf.excitations]
        n = np.array([averages[label] for label in excitations]) - np.array(inputs)
        lack = (1 - coherence) / np.maximum(coherence, np.finfo(float).tiny)
        variance = np.abs(frf.values) ** 2 * lack / n
    unexcited = np.unique(np.concatenate([e.unexcited for e in estimates]))
    damping = estimates[0].added_damping
    return Estimated(frf, coherence, variance, averages, signal, estimator, unexcited, damping)


def _coherence(estimates: list[Estimate], picks: list[np.ndarray], frf: Frf) -> FloatArray | None:
    """Return each response's coherence under each excitation; of one average it is 1 and says
    nothing."""
    parts = []
    for estimate, pick in zip(estimates, picks, strict=True):
        n_input = len(estimate.frf.excitations)
        if estimate.coherence is None or estimate.n_averages <= n_input:
            return None
        order = [estimate.frf.responses.index(label) for label in frf.responses]
        parts.append(np.repeat(estimate.coherence[pick][:, order, None], n_input, axis=2))
    return np.concatenate(parts, axis=2)

"""Sweeps: one FRF and the natural frequencies of a drivetrain over the values of its parameters.

Samples are computed in pieces, on any executor; see `sample` for how one is.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np

from ..arrays import FloatArray
from ..runtime.executors import Workers
from ..runtime.pieces import Work, computed
from ..runtime.progress import Progress, silent
from .parameters import Values
from .plan import SampleResults, SweepPlan, base_values, blank, failed, joined
from .sample import evaluate

CHUNK = 10  # samples handed to a worker, and kept on disk, at a time
HERE = Workers()
WORTH_A_PROCESS = 200  # samples that each take an eigensolution or a base FRF


class Store(Protocol):
    """Where finished pieces of a sweep are kept, so that an interrupted one can go on."""

    @property
    def unfit(self) -> Sequence[str]:
        """Pieces that were there and could not be used."""

    def load(self, key: str, at: Sequence[int]) -> SampleResults | None:
        """The piece of that key, if it is there; without |H| if that is in its place already."""

    def save(self, key: str, results: SampleResults) -> None:
        """Keep a piece, once its |H| is in its place."""


def processes_worth(plan: SweepPlan, samples: Sequence[Values]) -> int:
    """How many processes a sweep is worth: up to one per core, by what takes its time.

    That is a sample's eigensolution, or the base FRF; joining a spring to it takes far less than
    a process does to start.
    """
    expensive = len(samples)
    if not plan.modes_needed:
        expensive = len({base_values(plan, values) for values in samples})
    return max(1, min(os.cpu_count() or 1, expensive // WORTH_A_PROCESS))


def sweep(
    plan: SweepPlan,
    samples: Sequence[Values],
    workers: Workers = HERE,
    store: Store | None = None,
    progress: Progress = silent,
    warn: Callable[[str], None] = lambda _: None,
    magnitude: FloatArray | None = None,
) -> SampleResults:
    """Compute all samples.

    The result depends neither on the executor nor on the order of the samples. Samples of a worker
    that dies are computed again, in a process of their own; one that kills that, too, has failed.

    Parameters
    ----------
    plan, samples
        What is computed, of which values.
    workers
        Around any `concurrent.futures` executor; none: one sample after the other, here.
    store
        Where finished pieces are kept and looked for first.
    progress
        Told the samples done.
    warn
        Told of lost workers.
    magnitude
        (n, n_frequency) where |H| goes, such as a file in memory; none: fresh memory.

    Raises
    ------
    CommandError
        Worker processes die before they compute anything.
    """
    order = sorted(range(len(samples)), key=lambda i: base_values(plan, samples[i]))
    places = {str(k): order[k : k + CHUNK] for k in range(0, len(order), CHUNK)}
    pieces = {key: tuple(samples[i] for i in at) for key, at in places.items()}
    results = blank(plan, len(samples), magnitude)
    status, done = np.full(len(samples), "", dtype=object), 0
    progress("sweeping", done, len(samples))

    for key, piece, is_new in _stored_or_computed(plan, pieces, places, workers, store, warn):
        at = places[key]
        status[at] = piece.status
        if len(piece.magnitude):
            results.magnitude[at] = piece.magnitude
        results.frequency_hz[at], results.kind[at] = piece.frequency_hz, piece.kind
        results.metrics[at] = piece.metrics
        if store is not None and is_new:
            store.save(key, piece)
        done += len(at)
        progress("sweeping", done, len(samples))
    return replace(results, status=np.array(status.tolist()))


def _stored_or_computed(
    plan: SweepPlan,
    pieces: Mapping[str, tuple[Values, ...]],
    places: Mapping[str, Sequence[int]],
    workers: Workers,
    store: Store | None,
    warn: Callable[[str], None],
) -> Iterator[tuple[str, SampleResults, bool]]:
    """Every piece, and whether it is new."""
    missing = dict(pieces)
    for key in pieces:
        piece = None if store is None else store.load(key, places[key])
        if piece is not None:
            del missing[key]
            yield key, piece, False
    if store is not None and store.unfit:
        warn(
            f"{len(store.unfit)} of the pieces kept of an interrupted sweep are damaged, or "
            "another version's: they are computed again"
        )
    for key, piece in computed(_work(plan), missing, workers, warn):
        yield key, piece, True


def _work(plan: SweepPlan) -> Work[Values, SampleResults]:
    return Work(
        partial(evaluate, plan),
        joined,
        lambda _, why: failed(plan, 1, why),
        "samples",
    )

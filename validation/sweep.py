"""Sweeps: one FRF and the natural frequencies of a drivetrain over the values of its parameters.

Samples are computed in pieces, on any executor; see `sweep_sample` for how one is.
"""

from __future__ import annotations

import json
import math
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    as_completed,
)
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import get_context
from typing import Protocol

import numpy as np

from mbs_models.parameters import Drivetrain

from .errors import CommandError
from .results import Band
from .sweep_parameters import Design, Values, model_data
from .sweep_sample import evaluate
from .sweep_task import Outcome, Task, base_values, blank

Progress = Callable[[str, int, int], None]

CHUNK = 10  # samples handed to a worker, and kept on disk, at a time
MOST_BYTES = 2e9
# matrices this small are solved faster by one thread, and processes would fight for the cores
THREAD_LIMITS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


class Store(Protocol):
    """Where finished pieces of a sweep are kept, so that an interrupted one can go on."""

    def load(self, key: str) -> Outcome | None:
        """The piece of that key, if it is there."""

    def save(self, key: str, outcome: Outcome) -> None:
        """Keep a piece."""


def task(
    drivetrain: Drivetrain,
    design: Design,
    band: Band,
    pair: tuple[str, str] | None = None,
    n_modes: int = 10,
    route: str = "exudyn",
) -> Task:
    """What is computed of a design's samples.

    Raises
    ------
    CommandError
        There is no such route, or the result would be too large.
    """
    if route not in ("exudyn", "equations"):
        raise CommandError(f"--route = {route!r}: must be exudyn or equations")
    if n_modes < 0:
        raise CommandError(f"--modes = {n_modes}: must be at least 0")
    n_lines = len(band.frequency()) if pair else 0
    size = 8.0 * len(design.samples) * n_lines
    if size > MOST_BYTES:
        raise CommandError(
            f"{len(design.samples)} samples of {n_lines} lines take {size / 1e9:.1f} GB, more than "
            f"{MOST_BYTES / 1e9:g} GB; give a larger --df, a narrower band or fewer samples"
        )
    springs = {
        f"{c.name}.{key}"
        for c in drivetrain.couplings
        for key in ("first_stiffness", "second_stiffness")
    }
    anchors = tuple(
        _anchor([sample[i] for sample in design.samples]) if path in springs else None
        for i, path in enumerate(design.paths)
    )
    response, excitation = pair or (None, None)
    model = json.dumps(model_data(drivetrain))
    return Task(model, design.paths, anchors, band, response, excitation, n_modes, route)


def dof_pair(response: str | None, excitation: str | None) -> tuple[str, str] | None:
    """The FRF asked for, if any.

    Raises
    ------
    CommandError
        Only one of the two is given.
    """
    if response is None and excitation is None:
        return None
    if response is None or excitation is None:
        raise CommandError("--response and --excitation: give both, or neither")
    return response, excitation


def default_workers(n_samples: int) -> int:
    """A process for every 100 samples, up to one per core."""
    return max(1, min(os.cpu_count() or 1, n_samples // 100))


@contextmanager
def process_pool(workers: int) -> Iterator[Executor | None]:
    """An executor of that many processes, each with one thread; none for one."""
    if workers == 1:
        yield None
        return
    # a forked child would share the numerical libraries' threads with its parent
    # (and Ctrl-C is for the parent, which tells the children)
    pool = ProcessPoolExecutor(
        workers,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    limits = {name: "1" for name in THREAD_LIMITS if name not in os.environ}
    os.environ.update(limits)  # for the children: this process has read them already
    try:
        yield pool
    finally:
        for name in limits:
            del os.environ[name]
        pool.shutdown(cancel_futures=True)


def _anchor(values: Sequence[float]) -> float:
    positive = [value for value in values if value > 0.0]
    return math.sqrt(min(positive) * max(positive)) if positive else 0.0


def sweep(
    task: Task,
    samples: Sequence[Values],
    executor: Executor | None = None,
    store: Store | None = None,
    progress: Progress = lambda _, done, total: None,
) -> Outcome:
    """Compute all samples.

    The result depends neither on the executor nor on the order of the samples. Samples of a worker
    that dies are computed here.

    Parameters
    ----------
    task, samples
        What is computed, of which values.
    executor
        Any `concurrent.futures` executor; none: one after the other, here.
    store
        Where finished pieces are kept and looked for first.
    progress
        Told the samples done.
    """
    order = sorted(range(len(samples)), key=lambda i: base_values(task, samples[i]))
    places = {str(k): order[k : k + CHUNK] for k in range(0, len(order), CHUNK)}
    pieces = {key: tuple(samples[i] for i in at) for key, at in places.items()}
    outcome = blank(task, len(samples))
    status, done = np.full(len(samples), "", dtype=object), 0
    progress("sweeping", done, len(samples))
    for key, piece in _stored_or_computed(task, pieces, executor, store):
        at = places[key]
        status[at] = piece.status
        outcome.magnitude[at] = piece.magnitude
        outcome.frequency_hz[at], outcome.kind[at] = piece.frequency_hz, piece.kind
        done += len(at)
        progress("sweeping", done, len(samples))
    return replace(outcome, status=np.array(status.tolist()))


def _stored_or_computed(
    task: Task,
    pieces: Mapping[str, tuple[Values, ...]],
    executor: Executor | None,
    store: Store | None,
) -> Iterator[tuple[str, Outcome]]:
    waiting = dict(pieces)
    for key in pieces:
        piece = None if store is None else store.load(key)
        if piece is not None:
            del waiting[key]
            yield key, piece
    for key, piece in _computed(task, waiting, executor):
        if store is not None:
            store.save(key, piece)
        yield key, piece


def _computed(
    task: Task, waiting: dict[str, tuple[Values, ...]], executor: Executor | None
) -> Iterator[tuple[str, Outcome]]:
    if executor is None:
        for key, samples in waiting.items():
            yield key, evaluate(task, samples)
        return
    futures: dict[Future[Outcome], str] = {}
    lost: list[str] = []
    for key, samples in waiting.items():
        try:
            futures[executor.submit(evaluate, task, samples)] = key
        except BrokenExecutor:
            lost.append(key)
    for future in as_completed(tuple(futures)):
        key = futures.pop(future)
        try:
            yield key, future.result()
        except BrokenExecutor:
            lost.append(key)
    for key in lost:
        yield key, evaluate(task, waiting[key])

"""Sweeps: one FRF and the natural frequencies of a drivetrain over the values of its parameters.

Samples are computed in pieces, on any executor; see `sample` for how one is.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    wait,
)
from dataclasses import replace
from itertools import islice
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mbs_models.parameters import Drivetrain

from ..errors import CommandError
from ..memory import MOST_BYTES
from ..results import Band
from .executors import Workers, process_pool
from .metrics import metrics
from .parameters import Design, Values, model_data
from .sample import evaluate
from .task import Outcome, Task, base_values, blank, failed, joined

Progress = Callable[[str, int, int], None]
FloatArray = NDArray[np.float64]

CHUNK = 10  # samples handed to a worker, and kept on disk, at a time
IN_FLIGHT = 64  # pieces handed out at a time, at least, so that results never pile up
POLL = 10.0  # seconds without a result until an executor is asked whether it is still there
HERE = Workers()
WORTH_A_PROCESS = 200  # samples that each take an eigensolution or a base FRF


class Store(Protocol):
    """Where finished pieces of a sweep are kept, so that an interrupted one can go on."""

    def load(self, key: str) -> Outcome | None:
        """The piece of that key, if it is there; without |H| if that is in its place already."""

    def save(self, key: str, outcome: Outcome) -> None:
        """Keep a piece, once its |H| is in its place."""


def task(
    drivetrain: Drivetrain,
    design: Design,
    band: Band,
    pair: tuple[str, str] | None = None,
    n_modes: int = 10,
    route: str = "exudyn",
    asked: Sequence[str] = (),
    *,
    streamed: bool = False,
) -> Task:
    """What is computed of a design's samples.

    Parameters
    ----------
    drivetrain, design
        What is varied, and how.
    band, pair
        Lines, response and excitation of the FRF; no pair, no FRF.
    n_modes
        How many natural frequencies.
    route
        exudyn or equations.
    asked
        Metrics as `metrics.metrics` reads them.
    streamed
        Whether |H| goes to a file piece by piece, and may exceed `MOST_BYTES`.

    Raises
    ------
    CommandError
        There is no such route or metric, nothing to stream, or the result would be too large.
    """
    if route not in ("exudyn", "equations"):
        raise CommandError(f"--route = {route!r}: must be exudyn or equations")
    if n_modes < 0:
        raise CommandError(f"--modes = {n_modes}: must be at least 0")
    if streamed and pair is None:
        raise CommandError("--stream: there is no FRF; give --response and --excitation")
    frequency = band.frequency() if pair else None
    if frequency is not None and not streamed:
        size = 8.0 * len(design.samples) * len(frequency)
        if size > MOST_BYTES:
            raise CommandError(
                f"{len(design.samples)} samples of {len(frequency)} lines take {size / 1e9:.1f} "
                f"GB, more than {MOST_BYTES / 1e9:g} GB; give a larger --df, a narrower band or "
                "fewer samples, or --stream to write them to disk piece by piece"
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
    found = metrics(asked, frequency)
    return Task(model, design.paths, anchors, band, response, excitation, n_modes, route, found)


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


def processes_worth(task: Task, samples: Sequence[Values]) -> int:
    """How many processes a sweep is worth: up to one per core, by what takes its time.

    That is a sample's eigensolution, or the base FRF; joining a spring to it takes far less than
    a process does to start.
    """
    expensive = len(samples)
    if not task.modes_needed:
        expensive = len({base_values(task, values) for values in samples})
    return max(1, min(os.cpu_count() or 1, expensive // WORTH_A_PROCESS))


def _anchor(values: Sequence[float]) -> float:
    positive = [value for value in values if value > 0.0]
    return math.sqrt(min(positive) * max(positive)) if positive else 0.0


def sweep(
    task: Task,
    samples: Sequence[Values],
    workers: Workers = HERE,
    store: Store | None = None,
    progress: Progress = lambda _, done, total: None,
    warn: Callable[[str], None] = lambda _: None,
    magnitude: FloatArray | None = None,
) -> Outcome:
    """Compute all samples.

    The result depends neither on the executor nor on the order of the samples. Samples of a worker
    that dies are computed again, in a process of their own; one that kills that, too, has failed.

    Parameters
    ----------
    task, samples
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
    order = sorted(range(len(samples)), key=lambda i: base_values(task, samples[i]))
    places = {str(k): order[k : k + CHUNK] for k in range(0, len(order), CHUNK)}
    pieces = {key: tuple(samples[i] for i in at) for key, at in places.items()}
    outcome = blank(task, len(samples), magnitude)
    status, done = np.full(len(samples), "", dtype=object), 0
    progress("sweeping", done, len(samples))

    for key, piece, is_new in _stored_or_computed(task, pieces, workers, store, warn):
        at = places[key]
        status[at] = piece.status
        if len(piece.magnitude):
            outcome.magnitude[at] = piece.magnitude
        outcome.frequency_hz[at], outcome.kind[at] = piece.frequency_hz, piece.kind
        outcome.metrics[at] = piece.metrics
        if store is not None and is_new:
            store.save(key, piece)
        done += len(at)
        progress("sweeping", done, len(samples))
    return replace(outcome, status=np.array(status.tolist()))


def _stored_or_computed(
    task: Task,
    pieces: Mapping[str, tuple[Values, ...]],
    workers: Workers,
    store: Store | None,
    warn: Callable[[str], None],
) -> Iterator[tuple[str, Outcome, bool]]:
    """Every piece, and whether it is new."""
    missing = dict(pieces)
    for key in pieces:
        piece = None if store is None else store.load(key)
        if piece is not None:
            del missing[key]
            yield key, piece, False
    for key, piece in _computed(task, missing, workers, warn):
        yield key, piece, True


def _computed(
    task: Task,
    pieces: Mapping[str, tuple[Values, ...]],
    workers: Workers,
    warn: Callable[[str], None],
) -> Iterator[tuple[str, Outcome]]:
    executor = workers.executor
    if executor is None:
        for key, samples in pieces.items():
            yield key, evaluate(task, samples)
        return
    in_flight = max(IN_FLIGHT, 4 * workers.count)
    waiting = iter(pieces.items())
    running: dict[Future[Outcome], str] = {}
    lost: dict[str, str] = {}  # and why
    while True:
        for key, samples in islice(waiting, in_flight - len(running)):
            try:
                running[executor.submit(evaluate, task, samples)] = key
            except BrokenExecutor as error:
                lost[key] = _reason(error)
        if not running:
            break
        done = wait(running, timeout=POLL, return_when=FIRST_COMPLETED).done
        if not done and (why := workers.gone()):
            lost |= dict.fromkeys(running.values(), why)
            break
        for future in done:
            key = running.pop(future)
            try:
                yield key, future.result()
            except Exception as error:  # each executor has its own for a worker that is gone
                # what is wrong with the samples themselves shows again below
                lost[key] = _reason(error)
    if lost:
        reason = next(iter(lost.values()))
        again = {key: pieces[key] for key in (*lost, *(key for key, _ in waiting))}
        n = sum(map(len, again.values()))
        warn(f"{n} samples were lost with their workers and are computed again: {reason}")
        yield from _again(task, again)


def _reason(error: Exception) -> str:
    first, *_ = str(error).splitlines() or [""]
    return f"{type(error).__name__} {first}".strip()


def _again(task: Task, pieces: Mapping[str, tuple[Values, ...]]) -> Iterator[tuple[str, Outcome]]:
    """Pieces in a process beside this one, sample by sample if it dies of them."""
    waiting = list(pieces.items())
    while waiting:
        with process_pool(1, apart=True) as workers:
            assert workers.executor is not None
            _require_start(workers.executor)
            while waiting:
                key, samples = waiting.pop(0)
                try:
                    piece = workers.executor.submit(evaluate, task, samples).result()
                except BrokenExecutor:
                    yield key, joined([_alone(task, values) for values in samples])
                    break
                yield key, piece


def _require_start(executor: Executor) -> None:
    """Tell processes that die of their samples from those that never begin."""
    try:
        executor.submit(int).result()
    except BrokenExecutor as error:
        raise CommandError(
            "worker processes die as they start; a script that sweeps with processes needs its "
            "work under `if __name__ == '__main__':`"
        ) from error


def _alone(task: Task, values: Values) -> Outcome:
    """One sample in a process of its own."""
    with process_pool(1, apart=True) as workers:
        assert workers.executor is not None
        try:
            return workers.executor.submit(evaluate, task, (values,)).result()
        except BrokenExecutor:
            return failed(task, 1, "the process that computed it died")

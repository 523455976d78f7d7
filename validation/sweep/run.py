"""Sweeps: one FRF and the natural frequencies of a drivetrain over the values of its parameters.

Samples are computed in pieces, on any executor; see `sample` for how one is.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..routes.bands import Band
from ..routes.memory import MOST_BYTES
from ..runtime.executors import Workers
from ..runtime.pieces import Work, computed
from .metrics import metrics
from .parameters import Design, Values, model_data
from .sample import evaluate
from .task import Outcome, Task, base_values, blank, failed, joined

Progress = Callable[[str, int, int], None]
FloatArray = NDArray[np.float64]

CHUNK = 10  # samples handed to a worker, and kept on disk, at a time
HERE = Workers()
WORTH_A_PROCESS = 200  # samples that each take an eigensolution or a base FRF


class Store(Protocol):
    """Where finished pieces of a sweep are kept, so that an interrupted one can go on."""

    @property
    def unfit(self) -> Sequence[str]:
        """Pieces that were there and could not be used."""

    def load(self, key: str, at: Sequence[int]) -> Outcome | None:
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

    for key, piece, is_new in _stored_or_computed(task, pieces, places, workers, store, warn):
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
    places: Mapping[str, Sequence[int]],
    workers: Workers,
    store: Store | None,
    warn: Callable[[str], None],
) -> Iterator[tuple[str, Outcome, bool]]:
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
    for key, piece in computed(_work(task), missing, workers, warn):
        yield key, piece, True


def _work(task: Task) -> Work[Values, Outcome]:
    return Work(
        partial(evaluate, task),
        joined,
        lambda _, why: failed(task, 1, why),
        "samples",
    )

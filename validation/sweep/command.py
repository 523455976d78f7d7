"""The sweep command: compute, say what was found, write."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import screen
from ..errors import CommandError
from .executors import opened
from .figures import pictures
from .output import Pieces, Sweep, make_directory, write_sweep
from .parameters import Design
from .run import processes_worth, sweep
from .task import Task, base_values

MOST_FAILURES = 5  # told one by one


def conclusions(sweep: Sweep) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What to say of a sweep, and of the samples that failed, each with its parameters."""
    ok = sweep.outcome.ok
    failed = np.flatnonzero(~ok)
    failures = [
        f"sample {i} ({_parameters(sweep, i)}): {sweep.outcome.status[i]}"
        for i in failed[:MOST_FAILURES]
    ]
    if len(failed) > MOST_FAILURES:
        failures.append(f"{len(failed) - MOST_FAILURES} more samples failed: see sweep.csv")
    said = [f"{sweep.title}: {ok.sum()} of {len(ok)} samples computed{_method(sweep)}"]
    if ok.any() and sweep.metrics:
        what = f"{sweep.frf_name}: " if sweep.has_frf else ""
        said.append(f"{what}{'percentiles 5, 50, 95' if sweep.design.sampled else 'range'}")
        said += [_of_metric(sweep, name, column) for name, column in sweep.metrics.items()]
    return tuple(said), tuple(failures)


def _method(sweep: Sweep) -> str:
    """How the FRFs were computed."""
    if not sweep.has_frf:
        return ""
    bases = len({base_values(sweep.task, values) for values in sweep.design.samples})
    joined = any(anchor is not None for anchor in sweep.task.anchors)
    springs = ", the varied springs joined by interface solves" if joined else ""
    return f"; FRFs solved line by line and coupled {bases} times{springs}"


def _of_metric(sweep: Sweep, name: str, column: NDArray[np.float64]) -> str:
    """A metric's percentiles, or its extremes and where they are."""
    rows = np.flatnonzero(sweep.outcome.ok & np.isfinite(column))
    if not len(rows):
        return f"  {name}: no sample has one"
    missing = int(sweep.outcome.ok.sum()) - len(rows)
    note = f" ({missing} samples have none)" if missing else ""
    if sweep.design.sampled:
        percentiles = (f"{value:.6g}" for value in np.percentile(column[rows], (5, 50, 95)))
        return f"  {name}: {', '.join(percentiles)}{note}"
    low, high = rows[np.argmin(column[rows])], rows[np.argmax(column[rows])]
    if f"{column[low]:.6g}" == f"{column[high]:.6g}":
        return f"  {name}: {column[low]:.6g} throughout{note}"
    ends = (f"{column[i]:.6g} at {_parameters(sweep, i)}" for i in (low, high))
    return f"  {name}: {' … '.join(ends)}{note}"


def _parameters(sweep: Sweep, sample: int | np.integer) -> str:
    pairs = zip(sweep.design.paths, sweep.design.samples[sample], strict=True)
    return ", ".join(f"{path} = {value:.6g}" for path, value in pairs)


def carry_out(
    title: str,
    task: Task,
    design: Design,
    out: Path,
    workers: int | None = None,
    executor: str | None = None,
    *,
    streamed: bool = False,
) -> bool:
    """Compute a sweep and write its results; False if it was interrupted.

    Parameters
    ----------
    title
        The drivetrain's name.
    task, design
        What is computed, of which samples.
    out
        Where results go, and the finished pieces that an interrupted sweep goes on from.
    workers, executor
        How many and what, as `executors.opened` understands them.
    streamed
        Whether |H| goes to a file there piece by piece.

    Raises
    ------
    CommandError
        All samples failed, the results cannot be written, or the executor cannot be reached.
    """
    make_directory(out)
    pieces = Pieces.of(task, design.samples, out, streamed=streamed)
    shape = len(design.samples), task.n_lines
    worth = processes_worth(task, design.samples)
    try:
        with opened(executor, workers, worth) as crew, screen.progress() as progress:
            screen.warn(crew.warnings)
            outcome = sweep(
                task,
                design.samples,
                crew,
                pieces,
                progress,
                lambda text: screen.warn([text]),
                pieces.magnitude(shape) if streamed else None,
            )
    except KeyboardInterrupt:
        print(f"crosscheck: interrupted; the same command goes on from {out}", file=sys.stderr)
        return False
    result = Sweep(title, task, design, outcome)
    said, failures = conclusions(result)
    if not outcome.ok.any():
        pieces.clear()
        raise CommandError(f"all {len(outcome.status)} samples failed; {failures[0]}")
    screen.warn(failures)
    written = write_sweep(
        result, out, pictures(result), pieces.magnitude_file if streamed else None
    )
    pieces.clear()
    print("\n".join(said))
    print(f"Results: {', '.join(map(str, written))}")
    return True

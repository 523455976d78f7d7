"""The sweep command: compute, say what was found, write."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from . import screen
from .errors import CommandError
from .sweep import default_workers, process_pool, sweep
from .sweep_figures import pictures
from .sweep_output import Pieces, Sweep, make_directory, write_sweep
from .sweep_parameters import Design
from .sweep_task import Task

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
    said = [f"{sweep.title}: {ok.sum()} of {len(ok)} samples computed"]
    if sweep.has_frf and ok.any():
        peak = sweep.metrics["peak_db"]
        low, high = np.nanargmin(peak), np.nanargmax(peak)
        said.append(f"{sweep.frf_name}: highest |H| in the band, dB re 1 m/N")
        said += [
            f"  {word} {peak[i]:.2f} dB at {sweep.metrics['peak_hz'][i]:g} Hz: "
            f"{_parameters(sweep, i)}"
            for word, i in (("lowest ", low), ("highest", high))
        ]
    return tuple(said), tuple(failures)


def _parameters(sweep: Sweep, sample: int | np.integer) -> str:
    pairs = zip(sweep.design.paths, sweep.design.samples[sample], strict=True)
    return ", ".join(f"{path} = {value:.6g}" for path, value in pairs)


def carry_out(
    title: str, task: Task, design: Design, out: Path, workers: int | None = None
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
    workers
        Processes (None: as many as the number of samples is worth).

    Raises
    ------
    CommandError
        All samples failed, or the results cannot be written.
    """
    make_directory(out)
    workers = default_workers(len(design.samples)) if workers is None else workers
    pieces = Pieces.of(task, design.samples, out)
    try:
        with screen.progress() as progress, process_pool(workers) as executor:
            outcome = sweep(task, design.samples, executor, pieces, progress)
    except KeyboardInterrupt:
        print(f"crosscheck: interrupted; the same command goes on from {out}", file=sys.stderr)
        return False
    result = Sweep(title, task, design, outcome)
    said, failures = conclusions(result)
    if not outcome.ok.any():
        pieces.clear()
        raise CommandError(f"all {len(outcome.status)} samples failed; {failures[0]}")
    screen.warn(failures)
    written = write_sweep(result, out, pictures(result))
    pieces.clear()
    print("\n".join(said))
    print(f"Results: {', '.join(map(str, written))}")
    return True

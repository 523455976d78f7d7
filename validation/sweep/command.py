"""The sweep command: compute, say what was found, write."""

from __future__ import annotations

from pathlib import Path

from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..report.provenance import provenance
from ..runtime.executors import opened
from ..runtime.interruption import on_interrupt
from ..runtime.output_folder import held
from ..runtime.streams import progress_bars, warn
from .figures import pictures
from .output import MAGNITUDE, RESULTS, Sweep, write_sweep
from .parameters import Design
from .pieces import Pieces
from .report import sweep_html
from .run import processes_worth, sweep
from .task import Outcome, Task
from .words import conclusions, failures, hints

MOST_FAILURES = 5  # told one by one


def carry_out(
    drivetrain: Drivetrain,
    task: Task,
    design: Design,
    out: Path,
    workers: int | None = None,
    executor: str | None = None,
    *,
    streamed: bool = False,
) -> None:
    """Compute a sweep and write its results.

    Parameters
    ----------
    drivetrain
        As it is, before anything is varied.
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
    Interrupted
        By Ctrl-C; the same command goes on from the pieces computed.
    """
    names = (*RESULTS, *((MAGNITUDE,) if streamed else ()))
    with held(out, names) as work, on_interrupt(f"the same command goes on from {out}"):
        pieces = Pieces(task, design.samples, work, streamed=streamed)
        outcome = _outcome(task, design, pieces, workers, executor, streamed=streamed)
        result = Sweep(drivetrain.name, task, design, outcome)
        failed = failures(result, MOST_FAILURES)
        if not outcome.ok.any():
            pieces.clear()
            raise CommandError(f"all {len(outcome.status)} samples failed; {failed[0]}")
        warn((*failed, *hints(result, drivetrain)))
        drawn = pictures(result)
        texts = {
            "sweep.html": sweep_html(result, drivetrain, drawn, provenance()),
            **{picture.file: picture.text for picture in drawn},
        }
        written = write_sweep(result, out, texts, pieces.magnitude_file if streamed else None)
        pieces.clear()
    print("\n".join(conclusions(result)))
    print(f"Results: {', '.join(map(str, written))}")


def _outcome(
    task: Task,
    design: Design,
    pieces: Pieces,
    workers: int | None,
    executor: str | None,
    *,
    streamed: bool,
) -> Outcome:
    worth = processes_worth(task, design.samples)
    magnitude = pieces.magnitude((len(design.samples), task.n_lines)) if streamed else None
    with opened(executor, workers, worth) as crew, progress_bars() as progress:
        warn(crew.warnings)
        return sweep(
            task,
            design.samples,
            crew,
            pieces,
            progress,
            lambda text: warn([text]),
            magnitude,
        )

"""`crosscheck sweep`: from what is typed to a table, pictures and a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..report.command import run_study
from ..routes.bands import band, elastic_frequencies, left_out
from ..routes.memory import BYTES_PER_SWEPT_LINE, require_memory
from ..routes.source import equations_source
from ..runtime.clock import Clock
from ..runtime.executors import check as check_executor
from ..runtime.executors import opened
from ..runtime.progress import Progress
from ..runtime.streams import warn
from .console import print_result
from .describe import failures
from .files import RESULTS, write_sweep
from .parameters import Samples, samples_of
from .pieces import MAGNITUDE, Pieces
from .plan import SampleResults, SweepPlan, dof_pair, sweep_plan
from .result import SweepResult
from .run import processes_worth, sweep


def run_command(
    model: str,
    out: Path,
    *,
    vary: Sequence[str],
    response: str | None,
    excitation: str | None,
    metrics: Sequence[str],
    limits: tuple[float | None, float | None, float | None],
    n_modes: int,
    route: str,
    samples: int | None,
    sampling: str | None,
    seed: int,
    workers: int | None,
    executor: str | None,
    stream: bool,
) -> SweepResult:
    """Compute a sweep, write its results, and print what was found; the options as typed.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; all samples failed, or the results cannot be written.
    Interrupted
        By Ctrl-C; the same command goes on from the pieces computed.
    """
    check_executor(executor, workers)
    drivetrain = load(model)
    taken = samples_of(drivetrain, vary, samples, seed, sampling)
    lines, pair = band(*limits), dof_pair(response, excitation)
    if pair is not None:
        require_memory(lines, BYTES_PER_SWEPT_LINE, "the sweep's FRF")
        warn(left_out(lines, elastic_frequencies(equations_source(drivetrain).whole)))
    plan = sweep_plan(drivetrain, taken, lines, pair, n_modes, route, metrics, streamed=stream)
    finished: list[Pieces] = []

    def study(work: Path, progress: Progress) -> SweepResult:
        pieces = Pieces(plan, taken.rows, work, streamed=stream)
        finished.append(pieces)
        return _swept(drivetrain, plan, taken, pieces, workers, executor, progress)

    def write(result: SweepResult, directory: Path) -> tuple[Path, ...]:
        written = write_sweep(result, directory)
        for pieces in finished:
            pieces.clear()
        return written

    names = (*RESULTS, *((MAGNITUDE,) if stream else ()))
    kept = f"the same command goes on from {out}"
    return run_study(study, out, names, print_result, write=write, kept=kept)


def _swept(
    drivetrain: Drivetrain,
    plan: SweepPlan,
    samples: Samples,
    pieces: Pieces,
    workers: int | None,
    executor: str | None,
    progress: Progress,
) -> SweepResult:
    clock = Clock()
    results = clock.timed(
        "samples", lambda: _computed(plan, samples, pieces, workers, executor, progress)
    )
    streamed = pieces.magnitude_file if pieces.streamed else None
    result = SweepResult(drivetrain, plan, samples, results, streamed, clock.seconds)
    if not results.ok.any():
        pieces.clear()
        raise CommandError(f"all {len(results.status)} samples failed; {failures(result, 1)[0]}")
    return result


def _computed(
    plan: SweepPlan,
    samples: Samples,
    pieces: Pieces,
    workers: int | None,
    executor: str | None,
    progress: Progress,
) -> SampleResults:
    rows = samples.rows
    magnitude = pieces.magnitude((len(rows), plan.n_lines)) if pieces.streamed else None
    with opened(executor, workers, processes_worth(plan, rows)) as crew:
        warn(crew.warnings)
        return sweep(plan, rows, crew, pieces, progress, lambda text: warn([text]), magnitude)

"""`crosscheck speed`: from what is typed to files and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mbs_models.model.model_file import load

from ..report.command import run_study
from ..routes.time_domain import with_damping
from ..runtime.executors import check as check_executor
from ..runtime.executors import opened
from ..runtime.progress import Progress
from ..runtime.streams import warn
from .console import print_result
from .plan import SpeedPlan, plan
from .result import ARRAYS, SpeedResult
from .run import processes_worth, run

BORROWED = (
    "the model has no damping: Rayleigh damping of 0.5 % at 40 Hz and 1 kHz is lent to it; heights "
    "of resonances are those of that damping"
)


def run_command(
    model: str,
    out: Path,
    *,
    speed: str | None,
    torque: float | None,
    responses: Sequence[str] | None,
    harmonics: int,
    check: str | None,
    workers: int | None,
    executor: str | None,
) -> SpeedResult:
    """Compute, write the report, and print what was found; the options as typed.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    """
    check_executor(executor, workers)
    given = load(model)
    drivetrain = with_damping(given)
    asked = plan(
        drivetrain,
        speed=speed,
        torque=torque,
        responses=responses,
        harmonics=harmonics,
        check=check,
    )
    if drivetrain is not given:
        asked = asked.with_note(BORROWED)

    def study(_: Path, progress: Progress) -> SpeedResult:
        return _run(asked, workers, executor, progress)

    return run_study(study, out, (*SpeedResult.files, ARRAYS), print_result)


def _run(
    asked: SpeedPlan, workers: int | None, executor: str | None, progress: Progress
) -> SpeedResult:
    with opened(executor, workers, processes_worth(asked)) as crew:
        warn(crew.warnings)
        return run(asked, crew, progress, lambda text: warn([text]))

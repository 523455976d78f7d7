"""`crosscheck speed`: from what is typed to files and a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mbs_models.model.model_file import load

from ..routes.time_domain import with_damping
from ..runtime.executors import check as check_executor
from ..runtime.executors import opened
from ..runtime.interruption import on_interrupt
from ..runtime.output_folder import held
from ..runtime.streams import progress_bars, warn
from .console import findings
from .output import FILES, publish
from .plan import SpeedPlan, plan
from .study import SpeedResult, processes_worth, run

BORROWED = (
    "the model has no damping: Rayleigh damping of 0.5 % at 40 Hz and 1 kHz is lent to it; heights "
    "of resonances are those of that damping"
)


@dataclass(frozen=True)
class Options:
    """The command line's options, as typed."""

    model: str
    speed: str | None
    torque: float | None
    response: tuple[str, ...] | None
    harmonics: int
    check: str | None
    workers: int | None
    executor: str | None
    out: Path


def run_command(options: Options) -> SpeedResult:
    """Compute, write the report, and print what was found.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    """
    check_executor(options.executor, options.workers)
    asked = _plan(options)
    with held(options.out, FILES), on_interrupt("nothing was written"):
        worth = processes_worth(asked)
        with (
            opened(options.executor, options.workers, worth) as crew,
            progress_bars() as progress,
        ):
            warn(crew.warnings)
            result = run(asked, crew, progress, lambda text: warn([text]))
            progress("writing the report", 0, 1)
            written = publish(result, options.out)
            progress("writing the report", 1, 1)
    warn(result.warnings)
    findings(result)
    for path in written:
        print(f"Written: {path}")
    return result


def _plan(options: Options) -> SpeedPlan:
    given = load(options.model)
    drivetrain = with_damping(given)
    asked = plan(
        drivetrain,
        speed=options.speed,
        torque=options.torque,
        responses=options.response,
        harmonics=options.harmonics,
        check=options.check,
    )
    if drivetrain is given:
        return asked
    return asked.with_note(BORROWED)

"""The paper's study: every table, figure, equation and sentence, or some of them."""

from __future__ import annotations

from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..runtime.clock import Clock
from ..runtime.progress import Progress, silent
from .bench import Bench
from .items import ITEMS, picked
from .result import PaperStudy


def paper_study(
    only: str | None = None,
    preset: Drivetrain | None = None,
    tolerance_db: float = 0.1,
    progress: Progress = silent,
) -> PaperStudy:
    """Check the paper.

    Parameters
    ----------
    only
        One item, or the name of several: ``fig8``, ``fig8a``, ``table3``, ``truncation``,
        ``claims``, …. Default: all.
    preset
        A drivetrain of the paper's form in the place of the preset ``paper``.
    tolerance_db
        Largest error allowed where modes are left out (dB).
    progress
        Called with an item's name, how many are done, and of how many.

    Raises
    ------
    CommandError
        There is no such item, the tolerance is not positive, or the drivetrain is of another form.
    """
    if not tolerance_db > 0.0:
        raise CommandError(f"--tolerance = {tolerance_db:g}: must be more than 0 dB")
    chosen = ITEMS if only is None else picked(only)
    bench, clock = Bench(preset, tolerance_db), Clock()
    items = []
    for done, each in enumerate(chosen):
        progress(each.id, done, len(chosen))
        items.append(clock.timed(each.id, lambda each=each: each.on(bench)))  # type: ignore[misc]
    progress("done", len(chosen), len(chosen))
    drivetrains = {name: case.drivetrain for name, case in bench.cases.items()}
    return PaperStudy(tuple(items), drivetrains, clock.seconds)

"""The paper's study: every table, figure and claim, or one of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from .claims import claims
from .condensation import locked_checks
from .curves import FrfBench
from .figure_list import figure_items
from .model import PAPER, PaperCase, Systems, parameter_sets
from .results import (
    Claim,
    Figure,
    LockedCheck,
    PaperStudy,
    PaperTable,
    StiffnessRow,
    TimingStudy,
)
from .stiffness import stiffness_rows
from .tables import table_3, table_4
from .timing import timing_study
from .truncation import truncation_study
from .truncation_results import TruncationStudy

Progress = Callable[[str, int, int], None]


@dataclass
class _Parts:
    """The study as it grows."""

    tables: dict[str, PaperTable] = field(default_factory=dict)
    figures: dict[str, Figure] = field(default_factory=dict)
    stiffness: tuple[StiffnessRow, ...] = ()
    condensation: tuple[LockedCheck, ...] = ()
    truncation: TruncationStudy | None = None
    timing: TimingStudy | None = None
    claims: tuple[Claim, ...] = ()


@dataclass(frozen=True)
class _Step:
    """An item that can be asked for by name, and how it is made."""

    id: str
    make: Callable[[], None]


def paper_study(
    only: str | None = None,
    preset: Drivetrain | None = None,
    tolerance_db: float = 0.1,
    progress: Progress | None = None,
) -> PaperStudy:
    """Check the seed paper.

    Parameters
    ----------
    only
        One item, or the beginning of several: ``fig8``, ``fig8a``, ``table3``, ``truncation``, ….
        Default: all (see `item_names`).
    preset
        A drivetrain of the paper's form in the place of the preset ``paper``.
    tolerance_db
        Largest error allowed when modes are left out (dB).
    progress
        Called with an item's name, how many are done, and of how many.

    Raises
    ------
    CommandError
        There is no such item, the tolerance is not positive, or the drivetrain is of another form.
    """
    if not tolerance_db > 0.0:
        raise CommandError(f"--tolerance = {tolerance_db:g}: must be more than 0 dB")
    cases = parameter_sets(preset)
    bench = FrfBench(Systems(cases[PAPER]))
    parts = _Parts()
    chosen = _chosen(_steps(cases, bench, parts, tolerance_db), only)
    report = progress or (lambda step, done, total: None)
    seconds: dict[str, float] = {}
    for done, step in enumerate(chosen):
        report(step.id, done, len(chosen))
        start = time.perf_counter()
        step.make()
        seconds[step.id] = time.perf_counter() - start
    report("done", len(chosen), len(chosen))
    return PaperStudy(
        drivetrain=cases[PAPER].drivetrain.name,
        parameter_sets=tuple(cases),
        tables=tuple(parts.tables.values()),
        figures=tuple(parts.figures.values()),
        stiffness=parts.stiffness,
        condensation=parts.condensation,
        truncation=parts.truncation,
        timing=parts.timing,
        claims=parts.claims,
        seconds=seconds,
    )


def item_names() -> tuple[str, ...]:
    """What ``only`` may ask for."""
    cases = parameter_sets(None)
    bench = FrfBench(Systems(cases[PAPER]))
    return tuple(step.id for step in _steps(cases, bench, _Parts(), 0.1))


def _chosen(steps: list[_Step], only: str | None) -> list[_Step]:
    if only is None:
        return steps
    exact = [step for step in steps if step.id == only]
    beginning = [
        s for s in steps if s.id.startswith(only) and not s.id.removeprefix(only)[:1].isdigit()
    ]
    found = exact or beginning
    if not found:
        raise CommandError(
            f"--only = {only!r}: there is no such item; allowed: {', '.join(s.id for s in steps)}"
        )
    return found


def _steps(
    cases: dict[str, PaperCase], bench: FrfBench, parts: _Parts, tolerance_db: float
) -> list[_Step]:
    def table(make: Callable[[dict[str, PaperCase]], PaperTable]) -> None:
        made = make(cases)
        parts.tables[made.id] = made

    def figure(make: Callable[[FrfBench], Figure]) -> None:
        made = make(bench)
        parts.figures[made.id] = made

    def stiffness() -> None:
        parts.stiffness = stiffness_rows(bench)

    def condensation() -> None:
        parts.condensation = locked_checks(bench)

    def truncation() -> None:
        parts.truncation = truncation_study(bench, tolerance_db)

    def timing() -> None:
        parts.timing = timing_study(bench)

    def all_claims() -> None:
        parts.claims = claims(cases, bench, parts.truncation, parts.timing, tolerance_db)

    figures = [
        _Step(item.id, partial(figure, item.make))
        for item in figure_items(bench.case, tolerance_db)
    ]
    return [
        _Step("table3", lambda: table(table_3)),
        _Step("table4", lambda: table(table_4)),
        *figures,
        _Step("stiffness", stiffness),
        _Step("condensation", condensation),
        _Step("truncation", truncation),
        _Step("timing", timing),
        _Step("claims", all_claims),
    ]

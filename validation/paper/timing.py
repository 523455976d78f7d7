"""What coupling costs against the full system, reading by reading of what the paper may mean.

Like is compared with like: both sides solve line by line, or both sum over modes. Times are the
process's own processor time, of all its threads, with one BLAS thread, the least of several runs in
turns, so that neither what else runs on the machine nor how many cores there are counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from fbs import Frf, couple, direct_frf, modal_frf

from ..report.page import Block, Note, Table
from .bench import Bench, PaperBand, axis
from .item import Finding, Verdict, statement
from .printed_values import TIME_SAVED
from .shaft import split_at_shaft

BAND = PaperBand(4000.0, 4.0)
RUNS = 5
SWEEP = tuple(np.geomspace(1e5, 1e7, 9).tolist())
"""k_sw (N/m) of the sweep, over the range of Sec. 4.2."""

Way = Callable[[], object]
Synthesis = Callable[..., Frf]


@dataclass(frozen=True)
class Reading:
    """One thing the paper's sentence may mean: the full system's way and coupling's.

    Attributes
    ----------
    name, counted
        Which reading; what is counted of coupling.
    full_seconds, coupled_seconds
        Processor time of each.
    """

    name: str
    counted: str
    full_seconds: float
    coupled_seconds: float

    @property
    def saved(self) -> float:
        """Share of the full system's time that coupling saves."""
        return 1.0 - self.coupled_seconds / self.full_seconds


@dataclass(frozen=True)
class TimingStudy:
    """Full system against coupling, by reading."""

    conditions: str
    readings: tuple[Reading, ...]


def timing_study(bench: Bench) -> TimingStudy:
    """Time every reading in one run."""
    model = bench.exudyn()
    lines = axis(BAND, bench.modes().natural_frequencies).frequency
    split = bench.once(split_at_shaft)
    n = len(model.whole.dofs)
    sun = bench.case.label("B.sun.w")
    wholes = [bench.exudyn(k).whole for k in SWEEP]

    def full_once(synthesis: Synthesis) -> Way:
        return lambda: synthesis(model.whole, lines)

    def coupled_once(synthesis: Synthesis) -> Way:
        def once() -> Frf:
            stages = {name: synthesis(system, lines) for name, system in model.stages.items()}
            return couple(stages, model.joints).frf

        return once

    given = {name: direct_frf(system, lines) for name, system in model.stages.items()}

    def full_sweep(synthesis: Synthesis) -> Way:
        return lambda: [synthesis(whole, lines, [sun], [sun]) for whole in wholes]

    def coupled_sweep(synthesis: Synthesis) -> Way:
        def sweep() -> list[Frf]:
            once = split.frfs(lines, [sun], synthesis)
            return [split.coupled(once, k) for k in SWEEP]

        return sweep

    every = f"all {n} × {n} FRFs: both stages' FRFs and their coupling"
    one = f"the sun's w for {len(SWEEP)} k_sw: the stages' FRFs once, their coupling for each"
    alone = f"all {n} × {n} FRFs: the coupling alone"
    whole_by_line, stages_by_line = full_once(direct_frf), coupled_once(direct_frf)
    pairs: list[tuple[str, str, Way, Way]] = [
        ("once, line by line", every, whole_by_line, stages_by_line),
        ("once, modal", every, full_once(modal_frf), coupled_once(modal_frf)),
        ("once, stages given", alone, whole_by_line, lambda: couple(given, model.joints)),
        ("sweep, line by line", one, full_sweep(direct_frf), coupled_sweep(direct_frf)),
        ("sweep, modal", one, full_sweep(modal_frf), coupled_sweep(modal_frf)),
    ]
    seconds = _seconds([way for *_, full, coupled in pairs for way in (full, coupled)])
    readings = tuple(
        Reading(name, counted, seconds[2 * i], seconds[2 * i + 1])
        for i, (name, counted, _, _) in enumerate(pairs)
    )
    conditions = (
        f"{len(lines)} lines to {BAND.end:g} Hz, systems built beforehand; processor time of all "
        f"threads, the least of {RUNS} runs taken in turns after a warm-up"
    )
    return TimingStudy(conditions, readings)


def _seconds(ways: Sequence[Way]) -> list[float]:
    """Each way's least processor time."""
    with threadpool_limits(1, "blas"):
        for way in ways:
            way()
        times = [[_once(way) for way in ways] for _ in range(RUNS)]
    return [min(own) for own in zip(*times, strict=True)]


def _once(way: Way) -> float:
    start = time.process_time()
    way()
    return time.process_time() - start


@statement(
    "time", "Computing time", "Sec. 4.1",
    f"The coupling method reduces the computational time by {TIME_SAVED:.0%}.",
    "both ways timed side by side, like with like, for each reading of the sentence",
)  # fmt: skip
def computing_time(bench: Bench) -> Finding:
    """Does coupling save 70 % of the time?"""
    return judged(bench.once(timing_study))


def judged(study: TimingStudy) -> Finding:
    """It holds if coupling saves that much once and counted whole; corrected, in some reading."""
    once, others = study.readings[:2], study.readings[2:]
    reached = [r for r in others if r.saved >= TIME_SAVED]
    words = "; ".join(f"{r.name} ({r.counted}): {r.saved:.0%}" for r in study.readings)
    which = ", ".join(r.name for r in reached) or "no reading"
    return Finding(
        Verdict.of(all(r.saved >= TIME_SAVED for r in once), bool(reached)),
        f"processor time saved: {words}. {TIME_SAVED:.0%} and more is saved by: {which}",
        {f"saved_{r.name.replace(', ', '_').replace(' ', '_')}": r.saved for r in study.readings},
        blocks=_blocks(study),
        details={"timing": study},
    )


def _blocks(study: TimingStudy) -> tuple[Block, ...]:
    headings = ("Reading", "Counted", "Full system (ms)", "Coupling (ms)", "Saved")
    rows = tuple(
        (r.name, r.counted, f"{1e3 * r.full_seconds:.3g}", f"{1e3 * r.coupled_seconds:.3g}",
         f"{r.saved:.0%}")
        for r in study.readings
    )  # fmt: skip
    return Table(headings, rows, frozenset({2, 3, 4})), Note(f"Conditions: {study.conditions}.")

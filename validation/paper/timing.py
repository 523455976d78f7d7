"""What coupling costs against the full system, reading by reading of what the paper may mean.

Like is compared with like: both sides solve line by line, or both sum over modes. Times are the
thread's own processor time with one BLAS thread, the least of several runs in turns, so that what
else runs on the machine does not count.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf, SecondOrderSystem, couple, direct_frf, modal_frf
from fbs._kernels.blas_threads import one_blas_thread

from ..arrays import FloatArray
from ..report.page import Block, Note, Table
from ..routes.routes import Model
from .bench import Bench, PaperBand, axis
from .item import Finding, Verdict, statement
from .printed_values import TIME_SAVED
from .shaft import SplitAtShaft

BAND = PaperBand(4000.0, 4.0)
RUNS = 5
SWEEP = tuple(np.geomspace(1e5, 1e7, 9).tolist())
"""k_sw (N/m) of the sweep, over the range of Sec. 4.2."""

Way = Callable[[], object]
Synthesis = Callable[[SecondOrderSystem, FloatArray], Frf]


@dataclass(frozen=True)
class Reading:
    """One thing the paper's sentence may mean: the full system's way and coupling's.

    Attributes
    ----------
    name, counted
        Which reading; what is counted on both sides.
    whole
        Whether all that coupling needs is counted.
    full_seconds, coupled_seconds
        Processor time of each.
    """

    name: str
    counted: str
    whole: bool
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
    split = SplitAtShaft(bench.case)
    n = len(model.whole.dofs)
    sun = bench.case.label("B.sun.w")
    wholes = [bench.exudyn(k).whole for k in SWEEP]
    frfs = split.frfs(lines)
    given = {name: direct_frf(system, lines) for name, system in model.stages.items()}

    def sweep(synthesis: Callable[..., Frf]) -> Way:
        return lambda: [synthesis(whole, lines, [sun], [sun]) for whole in wholes]

    every = f"all {n} × {n} FRFs, both stages' FRFs and their coupling"
    pairs: list[tuple[str, str, bool, Way, Way]] = [
        ("once, line by line", every, True,
         lambda: direct_frf(model.whole, lines), lambda: _coupled(model, lines, direct_frf)),
        ("once, modal", every, True,
         lambda: modal_frf(model.whole, lines), lambda: _coupled(model, lines, modal_frf)),
        ("once, the stages' FRFs given", f"all {n} × {n} FRFs, the coupling alone", False,
         lambda: direct_frf(model.whole, lines), lambda: couple(given, model.joints)),
        ("sweep of k_sw, line by line",
         f"the sun's w for {len(SWEEP)} k_sw, the stages solved once and coupled for each", True,
         sweep(direct_frf), lambda: split.sweep(lines, SWEEP, [sun])),
        ("sweep of k_sw, the stages' FRFs given", f"all FRFs for {len(SWEEP)} k_sw, the coupling "
         "alone", False,
         lambda: [direct_frf(whole, lines) for whole in wholes],
         lambda: [split.coupled(frfs, k) for k in SWEEP]),
    ]  # fmt: skip
    seconds = _seconds([way for *_, full, coupled in pairs for way in (full, coupled)])
    readings = tuple(
        Reading(name, counted, whole, seconds[2 * i], seconds[2 * i + 1])
        for i, (name, counted, whole, _, _) in enumerate(pairs)
    )
    conditions = (
        f"{len(lines)} lines to {BAND.end:g} Hz, systems built beforehand; processor time of one "
        f"thread, the least of {RUNS} runs taken in turns after a warm-up"
    )
    return TimingStudy(conditions, readings)


def _coupled(model: Model, lines: FloatArray, synthesis: Synthesis) -> Frf:
    stages = {name: synthesis(system, lines) for name, system in model.stages.items()}
    return couple(stages, model.joints).frf


def _seconds(ways: Sequence[Way]) -> list[float]:
    """Each way's least processor time."""
    with one_blas_thread():
        for way in ways:
            way()
        times = [[_once(way) for way in ways] for _ in range(RUNS)]
    return [min(own) for own in zip(*times, strict=True)]


def _once(way: Way) -> float:
    start = time.thread_time()
    way()
    return time.thread_time() - start


@statement(
    "time", "Computing time", "Sec. 4.1",
    f"The coupling method reduces the computational time by {TIME_SAVED:.0%}.",
    "both ways timed side by side, like with like, for each reading of the sentence",
)  # fmt: skip
def computing_time(bench: Bench) -> Finding:
    """Does coupling save 70 % of the time?"""
    study = bench.once(timing_study)
    return _judged(study)


def _judged(study: TimingStudy) -> Finding:
    """It holds if coupling saves that much once and counted whole; corrected, in some reading."""
    once, others = study.readings[:2], study.readings[2:]
    reached = [r for r in others if r.saved >= TIME_SAVED]
    words = "; ".join(f"{r.name} ({r.counted}): {r.saved:.0%}" for r in study.readings)
    which = ", ".join(r.name for r in reached) or "no reading"
    return Finding(
        Verdict.of(all(r.saved >= TIME_SAVED for r in once), bool(reached)),
        f"processor time saved: {words}. {TIME_SAVED:.0%} and more is saved by: {which}",
        {f"saved_{i}": r.saved for i, r in enumerate(study.readings, start=1)},
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

"""A stage reduced by every method to every size: error and bound."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from fbs import FbsError, Frf, Tolerance, direct_frf
from fbs.coupled_bound import decibels
from fbs.reduction import Reduction

from ..arrays import FloatArray
from ..checks.check import Check
from ..errors import CommandError
from ..routes.source import exudyn_source
from ..runtime.progress import Progress
from ..truncation.run import NEVER_BEYOND, true_error
from .methods import Reductions
from .plan import ReductionPlan
from .result import ReducedFrf, ReductionResult, Trial

MOST_SIZES = 12
ROUTES = ("stage, solved line by line", "bound")


def run(plan: ReductionPlan, progress: Progress) -> tuple[ReductionResult, Reduction | None]:
    """Try all methods; returns what is found, and the reduction chosen.

    Raises
    ------
    ModelError, FbsError, CommandError
    """
    start = time.perf_counter()
    system = exudyn_source(plan.drivetrain).stage(plan.stage)
    if plan.loss_factor:
        system = replace(system, loss_factor=plan.loss_factor)
    reductions = Reductions(system, plan.ports, plan.band.frequency())
    exact = direct_frf(system, reductions.frequency, plan.ports, plan.ports)
    bench = _Bench(plan.tolerance, reductions, exact)
    names = reductions.names
    for number, name in enumerate(names):
        progress(name, number, len(names))
        bench.try_sizes(name, _sizes(plan, len(reductions.interface), len(system.dofs)))
        if not plan.sizes:
            bench.refine(name)
    progress(names[-1], len(names), len(names))
    trials = tuple(sorted(bench.trials, key=lambda t: (names.index(t.method), t.size)))
    choice = _choice(trials, plan.tolerance)
    frfs = () if choice is None else tuple(bench.frfs(choice))
    result = ReductionResult(
        plan, reductions.frequency, len(system.dofs), trials, choice, frfs, (bench.check(),),
        plan.notes, {"reductions": time.perf_counter() - start},
    )  # fmt: skip
    kept = None if choice is None else reductions.reduction(choice.method, choice.size)
    return result, kept


def _sizes(plan: ReductionPlan, least: int, most: int) -> tuple[int, ...]:
    """Those asked for, or some from the interface's DoFs to all."""
    if not plan.sizes:
        return tuple(np.unique(np.linspace(least, most, MOST_SIZES).round().astype(int)).tolist())
    if plan.sizes[-1] > most:
        raise CommandError(f"--sizes: {plan.sizes[-1]} coordinates; '{plan.stage}' has {most} DoFs")
    return plan.sizes


class _Bench:
    """Trials as they are made, and the worst of error over bound."""

    def __init__(self, tolerance: Tolerance, reductions: Reductions, exact: Frf) -> None:
        self.tolerance, self.reductions, self.exact = tolerance, reductions, exact
        self.size, self.round_off = _size(tolerance, exact), exact.round_off
        self.trials: list[Trial] = []
        self.worst, self.where = 0.0, ""

    def try_sizes(self, name: str, sizes: Iterable[int]) -> None:
        """Add trials of a method."""
        self.trials += [self._trial(name, size) for size in sizes]

    def refine(self, name: str) -> None:
        """Try the sizes between the last that fails and the least that meets the tolerance."""
        for guaranteed in (True, False):
            own = sorted((t for t in self.trials if t.method == name), key=lambda t: t.size)
            errors = {t.size: t.bound if guaranteed else t.error for t in own}
            meets = [size for size, error in errors.items() if error <= self.tolerance.value]
            below = [size for size in errors if meets and size < meets[0]]
            if below:
                self.try_sizes(name, range(below[-1] + 1, meets[0]))

    def _trial(self, name: str, size: int) -> Trial:
        try:
            frf, bound = self.reductions.bounded(name, size)
        except FbsError as error:  # a size that the method does not have
            return Trial(name, size, np.inf, np.inf, self.exact.frequency.size, str(error))
        self._compare(name, size, frf, bound)
        errors = [true_error(self.tolerance, frf, self.exact, pair) for pair in self._pairs()]
        guaranteed = self._guaranteed(bound)
        lost = ~np.isfinite(guaranteed).all(axis=(1, 2))
        return Trial(
            name, size, float(np.nanmax(errors)), float(guaranteed.max()), int(lost.sum())
        )  # fmt: skip

    def _pairs(self) -> list[tuple[str, str]]:
        return [(i, j) for i in self.exact.responses for j in self.exact.excitations]

    def _guaranteed(self, bound: FloatArray) -> FloatArray:
        return bound / self.size if self.tolerance.scaled else decibels(bound, self.size)

    def _compare(self, name: str, size: int, frf: Frf, bound: FloatArray) -> None:
        error = np.abs(frf.values - self.exact.values)
        allowed = bound + self.round_off
        ratio = np.divide(error, allowed, out=np.zeros_like(error), where=error > 0.0)
        if ratio.max() > self.worst:
            line = int(np.unravel_index(np.argmax(ratio), ratio.shape)[0])
            self.worst = float(ratio.max())
            self.where = f"{name}, {size} coordinates, {frf.frequency[line]:g} Hz"

    def check(self) -> Check:
        """No true error may exceed its bound."""
        findings = () if self.worst <= 1.0 else (f"{self.worst:.3g} by {self.where}",)
        return Check(
            "True error against bound", "all methods, sizes, FRFs, lines", ROUTES,
            "error / bound", self.worst, 1.0, NEVER_BEYOND, findings,
        )  # fmt: skip

    def frfs(self, choice: Trial) -> Iterable[ReducedFrf]:
        """FRFs of the choice."""
        frf, bound = self.reductions.bounded(choice.method, choice.size)
        guaranteed = self._guaranteed(bound)
        for k, response in enumerate(frf.responses):
            for n, excitation in enumerate(frf.excitations[: k + 1]):
                pair = (response, excitation)
                yield ReducedFrf(
                    pair, frf.between(*pair), self.exact.between(*pair), guaranteed[:, k, n],
                    true_error(self.tolerance, frf, self.exact, pair),
                )  # fmt: skip


def _size(tolerance: Tolerance, exact: Frf) -> FloatArray:
    """What errors are taken relative to: |H|, or √(h_i h_j)."""
    if not tolerance.scaled:
        return np.abs(exact.values)
    rows = np.linalg.norm(exact.values, axis=2)
    return np.asarray(np.sqrt(rows[:, :, None] * rows[:, None, :]))


def _choice(trials: tuple[Trial, ...], tolerance: Tolerance) -> Trial | None:
    for meets in (
        [t for t in trials if t.bound <= tolerance.value],
        [t for t in trials if t.error <= tolerance.value],
    ):
        if meets:
            return min(meets, key=lambda t: (t.size, t.bound, t.error))
    return None

"""The study of truncation: the smallest basis, its bound and its true error, rules of thumb."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from fbs import (
    BoundedFrf,
    Frf,
    RealModes,
    Reason,
    SecondOrderSystem,
    SingularLineError,
    SmallestBasis,
    Tolerance,
    TruncatedPart,
    bounded_frf,
    couple,
    direct_frf,
    real_modes,
    smallest_basis,
)

from ..arrays import ComplexArray, FloatArray
from ..checks.check import Check
from ..routes.source import Source, exudyn_source
from ..runtime.progress import Progress
from .plan import Pair, TruncationPlan
from .result import BasisErrors, StageBasis, TruncatedFrf, TruncationResult

RULES = (2.0, 20.0)  # times the band's end
ROUTES = ("all modes, solved line by line", "bound")
NEVER_BEYOND = (
    "a guarantee: the true error is never more than the bound, and the exact FRFs' own round-off"
)


@dataclass(frozen=True, eq=False)
class Trunk:
    """The coupled stages: which may be cut, their modes, and the exact FRFs.

    Attributes
    ----------
    systems
        Of every stage, with the loss factor lent.
    joints
        Between them.
    given
        Complete stages' FRFs.
    modes
        Of the stages that may be cut.
    """

    plan: TruncationPlan
    frequency: FloatArray
    systems: Mapping[str, SecondOrderSystem]
    source: Source
    given: Mapping[str, Frf]
    modes: Mapping[str, RealModes]

    @classmethod
    def of(cls, plan: TruncationPlan, source: Source) -> Trunk:
        """Take a model apart."""
        frequency = plan.band.frequency()
        loss = plan.loss_factor
        systems = {
            name: replace(system, loss_factor=loss) if loss else system
            for name, system in source.stages.items()
        }
        given = {
            name: _at_ports(system, name, source, plan.pairs, frequency)
            for name, system in systems.items()
            if name not in plan.stages
        }
        modes = {name: real_modes(systems[name]) for name in plan.stages}
        return cls(plan, frequency, systems, source, given, modes)

    @property
    def labels(self) -> tuple[str, ...]:
        """DoFs asked for."""
        return tuple(dict.fromkeys(label for pair in self.plan.pairs for label in pair))

    def exact(self) -> Frf:
        """FRFs of the complete stages, solved line by line."""
        frfs = {
            name: _at_ports(system, name, self.source, self.plan.pairs, self.frequency)
            for name, system in self.systems.items()
        }
        joined = {name: frf for name, frf in frfs.items() if frf.responses}
        return couple(joined, self.source.joints, self.labels, self.labels).frf

    def smallest(self, highest_order: int) -> SmallestBasis:
        """The smallest basis with residuals up to an order."""
        cut = {name: self.systems[name] for name in self.plan.stages}
        return smallest_basis(
            {**self.given, **cut}, self.source.joints, self.plan.pairs, self.frequency,
            self.plan.tolerance, highest_order,
        )  # fmt: skip

    def below(self, limit: float, order: int | None) -> BoundedFrf:
        """FRFs with all modes up to a frequency (Hz)."""
        parts = {
            name: TruncatedPart.of(
                self.systems[name],
                slice(0, max(modes.n_rigid, int(np.sum(modes.natural_frequencies <= limit)))),
                order,
                modes,
            )
            for name, modes in self.modes.items()
        }
        return bounded_frf(
            {**self.given, **parts}, self.source.joints, self.frequency, self.labels, self.labels
        )

    def kept_below(self, limit: float) -> int:
        """How many modes lie up to a frequency (Hz), of all stages that may be cut."""
        return sum(int(np.sum(m.natural_frequencies <= limit)) for m in self.modes.values())


def _at_ports(
    system: SecondOrderSystem,
    name: str,
    source: Source,
    pairs: Sequence[Pair],
    frequency: FloatArray,
) -> Frf:
    ends = [label for j in source.joints for owner, label in (j.first, j.second) if owner == name]
    asked = [label for pair in pairs for label in pair if label in system.labels]
    ports = tuple(dict.fromkeys([*ends, *asked]))
    return direct_frf(system, frequency, ports, ports)


def run(plan: TruncationPlan, progress: Progress) -> TruncationResult:
    """Find the smallest basis, and hold it against the exact FRFs.

    Raises
    ------
    ModelError, FbsError
    """
    seconds: dict[str, float] = {}
    steps = iter(range(4))

    @contextmanager
    def step(name: str) -> Iterator[None]:
        progress(name, next(steps), 4)
        start = time.perf_counter()
        yield
        seconds[name] = time.perf_counter() - start

    with step("stages"):
        trunk = Trunk.of(plan, exudyn_source(plan.drivetrain))
    with step("smallest basis"):
        basis = trunk.smallest(plan.highest_order)
    with step("exact FRFs"):
        exact = trunk.exact()
    with step("rules of thumb"):
        alternatives = tuple(_alternatives(trunk, exact, basis))
    progress("rules of thumb", 4, 4)
    return TruncationResult(
        plan,
        trunk.frequency,
        tuple(_stage(trunk, basis, name) for name in plan.stages),
        tuple(_frf(plan.tolerance, basis.bounded, exact, pair) for pair in plan.pairs),
        basis.error,
        basis.unreachable,
        basis.bounded.reason,
        alternatives,
        (_check(plan, basis.bounded, exact),),
        plan.notes,
        seconds,
    )


def _stage(trunk: Trunk, basis: SmallestBasis, name: str) -> StageBasis:
    modes, kept = trunk.modes[name], basis.kept[name]
    part = basis.parts[name]
    assert isinstance(part, TruncatedPart)
    left = [k for k in basis.ladders[name] if k not in kept]
    frequencies = modes.natural_frequencies
    return StageBasis(
        name,
        frequencies.size,
        modes.n_rigid,
        tuple(k + 1 for k in kept),
        basis.orders[name],
        frequencies[list(kept)],
        float(frequencies[left[0]]) if left else math.inf,
        frequencies.size - len(basis.ladders[name]),
    )


def _frf(tolerance: Tolerance, found: BoundedFrf, exact: Frf, pair: Pair) -> TruncatedFrf:
    return TruncatedFrf(
        pair,
        found.frf.between(*pair),
        exact.between(*pair),
        _bound(tolerance, found, pair),
        true_error(tolerance, found.frf, exact, pair),
    )


def _bound(tolerance: Tolerance, found: BoundedFrf, pair: Pair) -> FloatArray:
    """Guaranteed errors (dB, or scaled); infinite where there are none."""
    if tolerance.scaled:
        return np.asarray(tolerance.value * tolerance.used(found, [pair])[0])
    return found.decibels(*pair)


def true_error(tolerance: Tolerance, frf: Frf, exact: Frf, pair: Pair) -> FloatArray:
    """|20 log₁₀ |H̃/H||, or |ΔH_ij|/√(h_i h_j) with the row norms over the DoFs asked for."""
    h, found = exact.between(*pair), frf.between(*pair)
    if tolerance.scaled:
        rows = [np.linalg.norm(exact.select([label]).values[:, 0], axis=1) for label in pair]
        return np.asarray(np.abs(found - h) / np.sqrt(rows[0] * rows[1]))
    return np.asarray(np.abs(_decibels(found) - _decibels(h)))


def _decibels(values: ComplexArray) -> FloatArray:
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(values)))


def _check(plan: TruncationPlan, found: BoundedFrf, exact: Frf) -> Check:
    """The largest error over its bound: 1 at most."""
    worst, where = 0.0, ""
    for pair in plan.pairs:
        error = np.abs(found.frf.between(*pair) - exact.between(*pair))
        bound = found.between(*pair) + found.round_off(*pair)  # once more: the exact FRFs' own
        ratio = np.divide(error, bound, out=np.zeros_like(error), where=error > 0.0)
        if ratio.max() > worst:
            line = int(np.argmax(ratio))
            worst = float(ratio[line])
            where = f"{pair[0]} ← {pair[1]} at {found.frf.frequency[line]:g} Hz"
    findings = () if worst <= 1.0 else (f"error over bound {worst:.3g} at {where}",)
    return Check(
        "True error against bound", "all FRFs, all lines", ROUTES, "error / bound", worst, 1.0,
        NEVER_BEYOND, findings,
    )  # fmt: skip


def _alternatives(trunk: Trunk, exact: Frf, basis: SmallestBasis) -> Iterator[BasisErrors]:
    """Smallest bases with fewer residuals, and the rules of thumb with none and with statics."""
    plan = trunk.plan
    for highest in range(plan.highest_order, -2, -1):
        found = basis if highest == plan.highest_order else trunk.smallest(highest)
        modes = sum(map(len, found.kept.values()))
        name = f"smallest basis, residuals {residual_words(highest)}"
        yield _errors(trunk, exact, found.bounded, name, modes)
    for factor in RULES:
        limit = factor * plan.band.fmax
        for order in (None, 0):
            try:
                bounded = trunk.below(limit, order)
            except SingularLineError:  # undamped poles of the cut stages: no FRF, no error
                continue
            name = f"modes to {factor:g} × the band, residuals {residual_words(order)}"
            yield _errors(trunk, exact, bounded, name, trunk.kept_below(limit))


def residual_words(order: int | None) -> str:
    """Which residuals are kept."""
    if order is None or order < 0:
        return "none"
    return "R₀" if order == 0 else f"R₀ to R{'₀₁₂₃₄₅₆₇₈₉'[order]}" if order < 10 else f"to {order}"


def _errors(trunk: Trunk, exact: Frf, found: BoundedFrf, name: str, modes: int) -> BasisErrors:
    tolerance, pairs = trunk.plan.tolerance, trunk.plan.pairs
    bounds = [_bound(tolerance, found, pair) for pair in pairs]
    errors = [true_error(tolerance, found.frf, exact, pair) for pair in pairs]
    return BasisErrors(
        name,
        modes,
        float(np.max(bounds)),
        float(np.nanmax(errors)),
        int(np.sum(found.reason != Reason.BOUNDED)),
    )

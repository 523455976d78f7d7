"""The data of Figures 13 to 16: subsystem B with modes left out, in AB and alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf, direct_frf

from .curves import FrfBench, RouteName, curve, difference, scale
from .figures import Drawing, Judgement, Text, assemble
from .printed_values import SHAFT_STIFFNESSES
from .resonances import resonances
from .results import Curve, Difference, Figure, FloatArray, Verdict
from .truncation import BAND, LOSS_FACTOR, Basis, TruncationBench

TRUNCATED = "FBS, subsystem B by modal synthesis"
DAMPING_NOTE = (
    f"; loss factor {LOSS_FACTOR:g} in every spring, so that errors at peaks are finite (the "
    "paper draws undamped curves)"
)


@dataclass(frozen=True)
class Errors:
    """Differences of the figure's curves to the first one, by name, and the tolerance (dB)."""

    by_name: dict[str, Difference]
    tolerance_db: float

    def worst(self, name: str) -> float:
        """Largest error of a curve (dB)."""
        return self.by_name[name].worst_db

    def words(self, *names: str) -> str:
        """Largest and median error of curves, in words."""
        parts = []
        for name in names:
            found = self.by_name[name]
            median = float(np.nanmedian(np.abs(found.decibel)))
            parts.append(
                f"{name}: {found.worst_db:.3g} dB at {found.worst_db_hz:.0f} Hz (median "
                f"{median:.1g} dB)"
            )
        return "; ".join(parts)


TruncationJudge = Callable[[Errors], Judgement]

HUB_OUT = "hub's mode left out"
ALL_OUT = "all beyond the band left out"
HUB_KEPT = "all beyond the band left out but the hub's"
STATIC = "all left out, static residual"
SECOND = "all left out, residual to 2nd order"


def in_ab(
    bench: FrfBench, text: Text, label: str, tolerance_db: float, judge: TruncationJudge,
    *, one_by_one: bool,
) -> Figure:  # fmt: skip
    """A drive-point FRF of AB with B truncated (Figs. 13 and 16)."""
    trunk = TruncationBench(bench)
    n = trunk.beyond
    wanted = [
        ("no mode left out", Basis(0, True, None)),
        (HUB_OUT, Basis(1, False, None)),
        *((f"{k} left out", Basis(k, False, None)) for k in range(2, n) if one_by_one),
        (ALL_OUT, Basis(n, False, None)),
        (HUB_KEPT, Basis(n - 1, True, None)),
        (STATIC, Basis(n, False, 0)),
        (SECOND, Basis(n, False, 2)),
    ]
    drawing = Drawing((label, label), BAND, trunk.shaft)
    exact = trunk.full()
    curves = [curve("full system", RouteName.EXUDYN, exact, label, label)]
    curves += [curve(name, TRUNCATED, trunk.coupled(basis), label, label) for name, basis in wanted]
    return _figure(bench, text, drawing, curves, exact, tolerance_db, judge)


def alone(
    bench: FrfBench, text: Text, label: str, tolerance_db: float, judge: TruncationJudge
) -> Figure:
    """A drive-point FRF of B alone, truncated (Fig. 15)."""
    trunk = TruncationBench(bench)
    n = trunk.beyond
    exact = direct_frf(trunk.system, trunk.frequency, excitations=[label])
    curves = [curve("subsystem B", "exudyn", exact, label, label)]
    for name, basis in (
        (HUB_OUT, Basis(1, False, None)),
        (ALL_OUT, Basis(n, False, None)),
        (HUB_KEPT, Basis(n - 1, True, None)),
        (STATIC, Basis(n, False, 0)),
        (SECOND, Basis(n, False, 2)),
    ):
        curves.append(curve(name, "modal synthesis", trunk.stage(basis), label, label))
    drawing = Drawing((label, label), BAND, trunk.shaft, trunk.b)
    return _figure(bench, text, drawing, curves, exact, tolerance_db, judge)


def other_shaft(bench: FrfBench, text: Text, label: str, tolerance_db: float) -> Figure:
    """AB without the hub's mode, for two k_sw, and exact (Fig. 14)."""
    own, other = bench.case.shaft_stiffness, max(SHAFT_STIFFNESSES)
    curves: list[Curve] = []
    for shaft in (own, other):
        trunk = TruncationBench(bench, shaft)
        stiffness = f"k_sw = {shaft:.0e} N/m".replace("e+0", "e")
        without = trunk.coupled(Basis(1, False, None))
        curves.append(curve(f"{HUB_OUT}, {stiffness}", TRUNCATED, without, label, label))
        exact = trunk.full()
        curves.append(curve(f"full system, {stiffness}", RouteName.EXUDYN, exact, label, label))
    curves = [curves[0], curves[2], curves[1], curves[3]]
    changed, own_name = curves[1].name, curves[0].name

    def judge(errors: Errors) -> Judgement:
        verdict = Verdict.HOLDS if errors.worst(changed) > errors.tolerance_db else Verdict.FAILS
        change = f"without the hub's mode k_sw changes it by {errors.worst(changed):.2g} dB at most"
        evidence = errors.words(*(c.name for c in curves[1:]))
        return verdict, f"{change}. Against the first curve ({own_name}): {evidence}"

    reference = TruncationBench(bench).full()
    drawing = Drawing((label, label), BAND, own)
    return _figure(bench, text, drawing, curves, reference, tolerance_db, judge)


def _figure(
    bench: FrfBench,
    text: Text,
    drawing: Drawing,
    curves: Sequence[Curve],
    reference: Frf,
    tolerance_db: float,
    judge: TruncationJudge,
) -> Figure:
    lines: FloatArray = bench.axis(drawing.band, drawing.shaft).frequency
    row_scale = scale(reference, *drawing.pair)
    first, *others = curves
    found = {c.name: difference(lines, first, c, row_scale) for c in others}
    marks = resonances(
        bench.systems, drawing.part, drawing.shaft, drawing.pair, drawing.band.end,
        "subsystem B" if drawing.part else "full system",
    )  # fmt: skip
    judgement = judge(Errors(found, tolerance_db))
    return assemble(bench, text, drawing, curves, row_scale, marks, judgement, DAMPING_NOTE)


def judge_only_the_hub_matters(errors: Errors) -> Judgement:
    """Whether leaving out all but the hub's mode is felt; and if so, what mends it."""
    evidence = errors.words(HUB_OUT, ALL_OUT, HUB_KEPT, STATIC, SECOND)
    if errors.worst(HUB_KEPT) <= errors.tolerance_db:
        return Verdict.HOLDS, evidence
    mended = min(errors.worst(STATIC), errors.worst(SECOND)) <= errors.tolerance_db
    note = f"{evidence}; with the left-out modes' residual, hub's included, they can be neglected"
    return (Verdict.CORRECTED, note) if mended else (Verdict.FAILS, evidence)


def judge_no_effect(errors: Errors) -> Judgement:
    """Whether leaving out everything beyond the band is not felt."""
    evidence = errors.words(ALL_OUT, STATIC, SECOND)
    holds = errors.worst(ALL_OUT) <= errors.tolerance_db
    return (Verdict.HOLDS if holds else Verdict.FAILS), evidence


def judge_effect(errors: Errors) -> Judgement:
    """Whether leaving out the hub's mode is felt, and as much as leaving out all."""
    evidence = errors.words(HUB_OUT, ALL_OUT, HUB_KEPT, STATIC)
    return (
        Verdict.HOLDS if errors.worst(HUB_OUT) > errors.tolerance_db else Verdict.FAILS
    ), evidence

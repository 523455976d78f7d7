"""Figures 13 to 16: subsystem B with modes left out, in AB and alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fbs import Frf, direct_frf

from ..arrays import FloatArray
from .bench import Bench, RouteName, at_shaft, curve, difference, scale
from .figures import Drawing, Judgement, picture, route_checks
from .item import Curve, Difference, Finding, Picture, Statement, Verdict
from .modal_bases import BAND, LOSS_FACTOR, Basis, TruncationBench
from .printed_values import SHAFT_STIFFNESSES

TRUNCATED = "FBS, subsystem B by modal synthesis"
DAMPING_NOTE = (
    f"; loss factor {LOSS_FACTOR:g} in every spring, so that errors at peaks are finite (the "
    "paper draws undamped curves)"
)
COMPUTED = (
    "the same FRF with modes beyond 4 kHz left out, with and without what replaces them, against "
    "the exact one; the error is scaled, |ΔH_ij|/√(h_i h_j), so that an antiresonance decides "
    "nothing"
)

NONE_OUT = "no mode left out"
HUB_OUT = "hub's mode left out"
ALL_OUT = "all beyond the band left out"
HUB_KEPT = "all beyond the band left out but the hub's"
STATIC = "all left out, static residual"
SECOND = "all left out, residual to 2nd order"


@dataclass(frozen=True)
class Errors:
    """Differences of the figure's curves to the first one, by name.

    Attributes
    ----------
    by_name, curves
        Name → difference, and curve.
    row_scale
        (n_frequency,) √(h_i h_j).
    tolerance
        What is allowed, as a share of it.
    """

    by_name: dict[str, Difference]
    curves: dict[str, Curve]
    row_scale: FloatArray
    tolerance: float

    def worst(self, name: str) -> float:
        """Largest scaled error of a curve."""
        return self.by_name[name].worst_scaled

    def within(self, name: str) -> bool:
        """Whether a curve is within the tolerance at every line."""
        return self.worst(name) <= self.tolerance

    def words(self, *names: str) -> str:
        """Errors of curves, scaled and in dB, in words."""
        parts = []
        for name in names:
            found = self.by_name[name]
            median = float(np.nanmedian(np.abs(found.decibel)))
            parts.append(
                f"{name}: {found.worst_scaled:.2g} at {found.worst_scaled_hz:.0f} Hz (in dB "
                f"{found.worst_db:.3g} at {found.worst_db_hz:.0f} Hz, median {median:.1g})"
            )
        return f"largest scaled error ({self.tolerance:.1%} allowed): " + "; ".join(parts)


TruncationJudge = Callable[[Errors], Judgement]


def in_ab(bench: Bench, label: str, one_by_one: bool) -> tuple[list[Curve], Frf]:
    """A drive-point FRF of AB with B truncated (Figs. 13 and 16), and the exact FRFs."""
    trunk = bench.once(TruncationBench)
    n = trunk.beyond
    bases = [
        (NONE_OUT, Basis(0, True, None)),
        (HUB_OUT, Basis(1, False, None)),
        *((f"{k} left out", Basis(k, False, None)) for k in range(2, n) if one_by_one),
        (ALL_OUT, Basis(n, False, None)),
        (HUB_KEPT, Basis(n - 1, True, None)),
        (STATIC, Basis(n, False, 0)),
        (SECOND, Basis(n, False, 2)),
    ]
    exact = trunk.full()
    curves = [curve("full system", RouteName.EXUDYN, exact, label, label)]
    curves += [curve(name, TRUNCATED, trunk.coupled(basis), label, label) for name, basis in bases]
    return curves, exact


def alone(bench: Bench, label: str) -> tuple[list[Curve], Frf]:
    """A drive-point FRF of B alone, truncated (Fig. 15), and the exact FRFs."""
    trunk = bench.once(TruncationBench)
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
    return curves, exact


def errors_of(bench: Bench, shown: Picture, row_scale: FloatArray) -> Errors:
    """The errors of a picture's curves."""
    differences = {each.curve: each for each in shown.differences}
    return Errors(differences, {c.name: c for c in shown.curves}, row_scale, bench.tolerance)


def _shown(
    bench: Bench, caption: str, drawing: Drawing, curves: Sequence[Curve], exact: Frf
) -> tuple[Picture, Errors]:
    row_scale = scale(exact, *drawing.pair(bench))
    marks = drawing.marks(bench, "subsystem B" if drawing.part else "full system")
    shown = picture(bench, caption, drawing, curves, row_scale, marks, DAMPING_NOTE)
    return shown, errors_of(bench, shown, row_scale)


def _figure(
    id: str, title: str, caption: str, says: str, dof: str, judge: TruncationJudge,
    part: str = "", one_by_one: bool = False,
) -> Statement:  # fmt: skip
    drawing = Drawing(dof, BAND, part)

    def examine(bench: Bench) -> Finding:
        label = bench.case.label(dof)
        curves, exact = alone(bench, label) if part else in_ab(bench, label, one_by_one)
        shown, errors = _shown(bench, caption, drawing, curves, exact)
        verdict, evidence = judge(errors)
        untouched = tuple(d for d in shown.differences if d.curve == NONE_OUT)
        kept = tuple(c for c in curves[1:] if c.name == NONE_OUT)
        checked = replace(shown, curves=(curves[0], *kept), differences=untouched)
        return Finding(verdict, evidence, picture=shown, checks=route_checks(id, checked))

    return Statement(id, title, "figures", f"Fig. {id[3:5]}, Sec. 4.4", says, COMPUTED, examine)


def _other_shaft(bench: Bench) -> Finding:
    """AB without the hub's mode, for two k_sw, and exact (Fig. 14)."""
    label = bench.case.label("B.sun.w")
    own, other = bench.case.shaft_stiffness, max(SHAFT_STIFFNESSES)
    curves: list[Curve] = []
    reference = bench.once(TruncationBench, own).coupled(Basis(1, False, None))
    for shaft in (own, other):
        trunk = bench.once(TruncationBench, shaft)
        without = trunk.coupled(Basis(1, False, None))
        curves.append(curve(f"{HUB_OUT}, {at_shaft(shaft)}", TRUNCATED, without, label, label))
        name = f"full system, {at_shaft(shaft)}"
        curves.append(curve(name, RouteName.EXUDYN, trunk.full(), label, label))
    first, exact, changed, stiff = curves
    shown, errors = _shown(
        bench, "The FRF of truncated subsystem B", Drawing("B.sun.w", BAND),
        (first, changed, exact, stiff), reference,
    )  # fmt: skip
    exact_scale = scale(bench.once(TruncationBench, own).full(), label, label)
    moved = difference(shown.frequency, exact, stiff, exact_scale).worst_scaled
    return Finding(
        Verdict.of(not errors.within(changed.name)),
        f"without the hub's mode k_sw changes it by a scaled {errors.worst(changed.name):.2g} "
        f"({errors.by_name[changed.name].worst_db:.2g} dB) at most, the full system's by "
        f"{moved:.2g}: with that mode left out, the shaft no longer reaches the hub. Against the "
        f"first curve ({first.name}), {errors.words(*(c.name for c in (changed, exact, stiff)))}",
        {"change_without_the_mode": errors.worst(changed.name), "change_of_the_full": moved},
        picture=shown,
    )


def judge_only_the_hub_matters(errors: Errors) -> Judgement:
    """Whether leaving out all but the hub's mode is felt; and if so, what mends it."""
    evidence = errors.words(HUB_OUT, ALL_OUT, HUB_KEPT, STATIC, SECOND)
    mended = errors.within(STATIC) or errors.within(SECOND)
    verdict = Verdict.of(errors.within(HUB_KEPT), mended)
    if verdict == Verdict.CORRECTED:
        evidence += "; with the left-out modes' residual, hub's included, they can be neglected"
    return verdict, evidence


def judge_no_effect(errors: Errors) -> Judgement:
    """Whether leaving out everything beyond the band is not felt."""
    return Verdict.of(errors.within(ALL_OUT)), errors.words(ALL_OUT, STATIC, SECOND)


def judge_effect(errors: Errors) -> Judgement:
    """Whether leaving out the hub's mode is felt."""
    return Verdict.of(not errors.within(HUB_OUT)), errors.words(HUB_OUT, ALL_OUT, HUB_KEPT, STATIC)


def judge_the_same_effect(errors: Errors) -> Judgement:
    """Whether leaving out the hub's mode is felt, and as much as leaving out all."""
    verdict, evidence = judge_effect(errors)
    hub, every = (errors.curves[name].values for name in (HUB_OUT, ALL_OUT))
    apart = float(np.max(np.abs(hub - every) / errors.row_scale))
    felt = verdict == Verdict.HOLDS
    return Verdict.of(felt and apart <= errors.tolerance, felt), (
        f"{evidence}; the two truncations differ from each other by {apart:.2g} at most"
    )


EXCEPT_HUB = "Except for the coupling mode, leaving out modes beyond the band has no effect."

FIG_13 = tuple(
    _figure(
        f"fig13{end}", f"Subsystem B truncated, in AB: sun, {words}",
        f"FRF of the truncated and non-truncated subsystem B: ({end}) in the {words} direction of "
        "the sun", EXCEPT_HUB, f"B.sun.{dof}", judge_only_the_hub_matters, one_by_one=True,
    )
    for end, dof, words in (("a", "u", "translational"), ("b", "w", "rotational"))
)  # fmt: skip

FIG_14 = Statement(
    "fig14", "Subsystem B without the hub's mode, for two k_sw: sun, rotational", "figures",
    "Fig. 14, Sec. 4.4", "The FRF of truncated B is sensitive to the shaft stiffness.",
    "the FRF without the hub's mode for two k_sw, and the full system's", _other_shaft,
)  # fmt: skip

FIG_15 = tuple(
    _figure(
        f"fig15{end}", f"Subsystem B alone, truncated: {words}",
        f"The FRF of truncated modal of subsystem B without condensation: ({end}) in the {words}",
        says, dof, judge, part="B",
    )
    for end, dof, words, says, judge in (
        ("a", "B.sun.w", "rotational direction of the sun",
         "No effect appears in the rotational direction.", judge_no_effect),
        ("b", "hub", "direction of the coupling DoF",
         "The effect is observed at the coupling DoF.", judge_effect),
    )
)  # fmt: skip

FIG_16 = tuple(
    _figure(
        f"fig16{end}", f"Subsystem A in AB with B truncated: pinion, {words}",
        f"Truncated subsystem A: ({end}) in the {words} direction", says, f"A.pinion.{dof}", judge,
    )
    for end, dof, words, says, judge in (
        ("a", "w", "rotational", "Some difference in frequencies with the coupling DoF truncated, "
         "and the same with all modes beyond the band.", judge_the_same_effect),
        ("b", "y", "radial", "The FRF in the radial direction is not sensitive to truncation.",
         judge_no_effect),
    )
)  # fmt: skip

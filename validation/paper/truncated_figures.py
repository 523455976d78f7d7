"""Figures 13 to 16: subsystem B with modes left out, in AB and alone."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

import numpy as np

from fbs import direct_frf

from .bench import Bench, RouteName, at_shaft, curve, difference, scale
from .figures import Drawing, Drawn, Judgement, Sketch, figure
from .item import Verdict
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


def within(drawn: Drawn, name: str) -> bool:
    """Whether a curve is within the tolerance at every line."""
    return drawn.difference(name).worst_scaled <= drawn.bench.tolerance


def words(drawn: Drawn, *names: str) -> str:
    """Errors of curves, scaled and in dB, in words."""
    parts = []
    for found in map(drawn.difference, names):
        median = float(np.nanmedian(np.abs(found.decibel)))
        parts.append(
            f"{found.curve}: {found.worst_scaled:.2g} at {found.worst_scaled_hz:.0f} Hz (in dB "
            f"{found.worst_db:.3g} at {found.worst_db_hz:.0f} Hz, median {median:.1g})"
        )
    return f"largest scaled error ({drawn.bench.tolerance:.1%} allowed): " + "; ".join(parts)


def guarantees(drawn: Drawn, *names: str) -> str:
    """What the left-out modes' bounds allow of curves, B in AB or alone, in words."""
    trunk, pair = drawn.bench.once(TruncationBench), drawn.drawing.pair(drawn.bench)
    bases = dict(_bases(trunk.beyond, ()))
    found = []
    for name in names:
        share = trunk.bound(bases[name], pair, alone=bool(drawn.drawing.part)) / drawn.row_scale
        told = np.isfinite(share)
        most = f"{share[told].max():.2g}" if told.any() else "nothing"
        lost = "" if told.all() else f" (no bound at {np.sum(~told)} of {told.size} lines)"
        found.append(f"{name} {most}{lost}")
    return "; guaranteed by bounds that know no exact FRF: " + ", ".join(found)


# --- what is drawn ---


def in_ab(bench: Bench, drawing: Drawing, one_by_one: bool = False) -> Sketch:
    """A drive-point FRF of AB with B truncated (Figs. 13 and 16)."""
    trunk, pair = bench.once(TruncationBench), drawing.pair(bench)
    bases = _bases(trunk.beyond, range(2, trunk.beyond) if one_by_one else ())
    exact = trunk.full()
    curves = [curve("full system", RouteName.EXUDYN, exact, *pair)]
    curves += [curve(name, TRUNCATED, trunk.coupled(basis), *pair) for name, basis in bases]
    return Sketch(curves, exact, [("", "full system")], same=1, note=DAMPING_NOTE)


def alone(bench: Bench, drawing: Drawing) -> Sketch:
    """A drive-point FRF of B alone, truncated (Fig. 15)."""
    trunk, pair = bench.once(TruncationBench), drawing.pair(bench)
    exact = direct_frf(trunk.system, trunk.frequency, excitations=pair[:1])
    curves = [curve("subsystem B", "exudyn", exact, *pair)]
    for name, basis in _bases(trunk.beyond, ())[1:]:
        curves.append(curve(name, "modal synthesis", trunk.stage(basis), *pair))
    return Sketch(curves, exact, [(trunk.b, "subsystem B")], note=DAMPING_NOTE)


def _bases(beyond: int, between: Iterable[int]) -> list[tuple[str, Basis]]:
    return [
        (NONE_OUT, Basis(0, True, None)),
        (HUB_OUT, Basis(1, False, None)),
        *((f"{k} left out", Basis(k, False, None)) for k in between),
        (ALL_OUT, Basis(beyond, False, None)),
        (HUB_KEPT, Basis(beyond - 1, True, None)),
        (STATIC, Basis(beyond, False, 0)),
        (SECOND, Basis(beyond, False, 2)),
    ]


def for_two_shafts(bench: Bench, drawing: Drawing) -> Sketch:
    """AB without the hub's mode, for two k_sw, and exact (Fig. 14)."""
    pair, shafts = drawing.pair(bench), (bench.case.shaft_stiffness, max(SHAFT_STIFFNESSES))
    trunks = [bench.once(TruncationBench, shaft) for shaft in shafts]
    without = [trunk.coupled(Basis(1, False, None)) for trunk in trunks]
    curves = [
        *(curve(f"{HUB_OUT}, {at_shaft(k)}", TRUNCATED, h, *pair)
          for k, h in zip(shafts, without, strict=True)),
        *(curve(f"full system, {at_shaft(k)}", RouteName.EXUDYN, t.full(), *pair)
          for k, t in zip(shafts, trunks, strict=True)),
    ]  # fmt: skip
    return Sketch(curves, without[0], [("", "full system")], note=DAMPING_NOTE)


# --- what is said of it ---


def judge_shaft_felt(drawn: Drawn) -> Judgement:
    """Whether k_sw changes the FRF without the hub's mode, as it does the full system's."""
    first, changed, exact, stiff = drawn.picture.curves
    trunk = drawn.bench.once(TruncationBench, drawn.bench.case.shaft_stiffness)
    exact_scale = scale(trunk.full(), *drawn.drawing.pair(drawn.bench))
    moved = difference(drawn.picture.frequency, exact, stiff, exact_scale).worst_scaled
    own = drawn.difference(changed.name)
    return Verdict.of(not within(drawn, changed.name)), (
        f"without the hub's mode k_sw changes it by a scaled {own.worst_scaled:.2g} "
        f"({own.worst_db:.2g} dB) at most, the full system's by {moved:.2g}. Against the first "
        f"curve ({first.name}), {words(drawn, changed.name, exact.name, stiff.name)}"
        + guarantees(drawn, HUB_OUT)
    )


def judge_only_the_hub_matters(drawn: Drawn) -> Judgement:
    """Whether leaving out all but the hub's mode is felt; and if so, what mends it."""
    evidence = words(drawn, HUB_OUT, ALL_OUT, HUB_KEPT, STATIC, SECOND)
    evidence += guarantees(drawn, HUB_KEPT, STATIC, SECOND)
    verdict = Verdict.of(within(drawn, HUB_KEPT), within(drawn, STATIC) or within(drawn, SECOND))
    if verdict == Verdict.CORRECTED:
        evidence += "; with the left-out modes' residual, hub's included, they can be neglected"
    return verdict, evidence


def judge_no_effect(drawn: Drawn) -> Judgement:
    """Whether leaving out everything beyond the band is not felt."""
    evidence = words(drawn, ALL_OUT, STATIC, SECOND)
    evidence += guarantees(drawn, ALL_OUT, STATIC, SECOND)
    return Verdict.of(within(drawn, ALL_OUT)), evidence


def judge_effect(drawn: Drawn) -> Judgement:
    """Whether leaving out the hub's mode is felt."""
    evidence = words(drawn, HUB_OUT, ALL_OUT, HUB_KEPT, STATIC)
    evidence += guarantees(drawn, HUB_OUT, HUB_KEPT, STATIC)
    return Verdict.of(not within(drawn, HUB_OUT)), evidence


def judge_the_same_effect(drawn: Drawn) -> Judgement:
    """Whether leaving out the hub's mode is felt, and as much as leaving out all."""
    felt, (_, evidence) = not within(drawn, HUB_OUT), judge_effect(drawn)
    hub, every = (drawn.curve(name).values for name in (HUB_OUT, ALL_OUT))
    apart = float(np.max(np.abs(hub - every) / drawn.row_scale))
    median = float(np.median(np.abs(20.0 * np.log10(np.abs(every / hub)))))
    return Verdict.of(felt and apart <= drawn.bench.tolerance, felt), (
        f"{evidence}; the two truncations differ from each other by {apart:.2g} at most (median "
        f"{median:.1g} dB)"
    )


# --- the figures ---

EXCEPT_HUB = "Except for the coupling mode, leaving out modes beyond the band has no effect."

FIG_13 = tuple(
    figure(
        f"fig13{end}", f"Subsystem B truncated, in AB: sun, {words_of}", "Sec. 4.4",
        f"FRF of the truncated and non-truncated subsystem B: ({end}) in the {words_of} direction "
        "of the sun", EXCEPT_HUB, Drawing(f"B.sun.{dof}", BAND), judge_only_the_hub_matters,
        partial(in_ab, one_by_one=True), COMPUTED,
    )
    for end, dof, words_of in (("a", "u", "translational"), ("b", "w", "rotational"))
)  # fmt: skip

FIG_14 = figure(
    "fig14", "Subsystem B without the hub's mode, for two k_sw: sun, rotational", "Sec. 4.4",
    "The FRF of truncated subsystem B", "The FRF of truncated B is sensitive to the shaft "
    "stiffness.", Drawing("B.sun.w", BAND), judge_shaft_felt, for_two_shafts,
    "the FRF without the hub's mode for two k_sw, and the full system's",
)  # fmt: skip

FIG_15 = tuple(
    figure(
        f"fig15{end}", f"Subsystem B alone, truncated: {words_of}", "Sec. 4.4",
        f"The FRF of truncated modal of subsystem B without condensation: ({end}) in the "
        f"{words_of}", says, Drawing(dof, BAND, "B"), judge, alone, COMPUTED,
    )
    for end, dof, words_of, says, judge in (
        ("a", "B.sun.w", "rotational direction of the sun",
         "No effect appears in the rotational direction.", judge_no_effect),
        ("b", "hub", "direction of the coupling DoF",
         "The effect is observed at the coupling DoF.", judge_effect),
    )
)  # fmt: skip

FIG_16 = tuple(
    figure(
        f"fig16{end}", f"Subsystem A in AB with B truncated: pinion, {words_of}", "Sec. 4.4",
        f"Truncated subsystem A: ({end}) in the {words_of} direction", says,
        Drawing(f"A.pinion.{dof}", BAND), judge, in_ab, COMPUTED,
    )
    for end, dof, words_of, says, judge in (
        ("a", "w", "rotational", "Some difference in frequencies with the coupling DoF truncated, "
         "and the same with all modes beyond the band.", judge_the_same_effect),
        ("b", "y", "radial", "The FRF in the radial direction is not sensitive to truncation.",
         judge_no_effect),
    )
)  # fmt: skip

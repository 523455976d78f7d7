"""Figures 10 to 12: a subsystem alone, as part of AB, and condensed by Eqs. (21), (22), (31).

"Condensed subsystem A" of the text is A as part of AB with no force on what is left out, H_aa; the
printed Schur complement blocks it instead (see `condensation`). Both are drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fbs import Frf, direct_frf
from fbs.condensation import block_dofs

from ..arrays import FloatArray
from .bench import Bench, RouteName, at_shaft, curve, difference, peaks, scale
from .figures import NARROW, Drawing, Judgement, picture
from .item import Curve, Finding, Statement, Verdict
from .printed_values import SHAFT_STIFFNESSES

SUPERPOSED_DB = 0.1
"""Curves whose median difference is below this look like one."""

COMPUTED = (
    "the subsystem alone, in AB with no force on the rest (by FBS and by exudyn), and with the "
    "rest blocked, as Eq. (31) has it"
)


@dataclass(frozen=True)
class Seen:
    """What a reader sees: peaks (Hz), and how far the subsystem in AB is from itself alone.

    Attributes
    ----------
    drawing
        The FRF.
    alone, within, blocked
        Peaks of the subsystem alone, in AB, and with the rest of AB blocked.
    median_db
        Median modulus of the difference of the first two.
    new, moved
        Peaks of AB that the subsystem alone does not have; (alone, in AB) of those that moved by
        more than a line.
    """

    drawing: Drawing
    alone: tuple[float, ...]
    within: tuple[float, ...]
    blocked: tuple[float, ...]
    median_db: float
    new: tuple[float, ...]
    moved: tuple[tuple[float, float], ...]

    def words(self) -> str:
        """The same in words."""
        moved = ", ".join(f"{old:.0f} → {new:.0f} Hz" for old, new in self.moved)
        return (
            f"alone against in AB: median difference {self.median_db:.2g} dB; peaks alone "
            f"{hz(self.alone)}; new in AB {hz(self.new)}; moved {moved or 'none'}; with the rest "
            f"blocked, as Eq. (31) has it, the peaks are {hz(self.blocked)}"
        )


CondensedJudge = Callable[[Bench, Seen], Judgement]


def hz(frequencies: Sequence[float]) -> str:
    """``42, 71 Hz``, or none."""
    return ", ".join(f"{f:.0f}" for f in frequencies) + " Hz" if frequencies else "none"


def blocked_frf(bench: Bench, drawing: Drawing) -> Frf:
    """A subsystem with all the rest of AB locked: what Eqs. (21), (22) and (31) give.

    From the blocked matrices: `condensation` shows that the formula gives the same, but for
    round-off where H is much larger than what is left of it.
    """
    case, model = bench.case, bench.exudyn(drawing.shaft)
    inside = case.internal_a if drawing.part == "A" else case.internal_b
    rest = [dof.label for dof in case.dofs if dof.label not in inside]
    response, excitation = drawing.pair(bench)
    blocked = block_dofs(model.whole, rest)
    return direct_frf(blocked, drawing.lines(bench), [response], [excitation])


def condensed_curves(bench: Bench, drawing: Drawing) -> tuple[list[Curve], FloatArray]:
    """The subsystem alone, in AB by both routes, and with the rest of AB blocked; row norms."""
    letter = drawing.part
    curves = [
        drawing.curve(bench, RouteName.EXUDYN, f"{letter} alone"),
        drawing.curve(bench, RouteName.FBS, f"{letter} in AB, no force on the rest", ""),
        drawing.curve(bench, RouteName.EXUDYN, f"{letter} in AB, exudyn", ""),
        curve(
            f"{letter} by Eq. (31), the rest blocked", "exudyn, locked",
            blocked_frf(bench, drawing), *drawing.pair(bench),
        ),
    ]  # fmt: skip
    alone = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft, drawing.part_name(bench))
    return curves, scale(alone, *drawing.pair(bench))


def look(bench: Bench, drawing: Drawing) -> Seen:
    """What a reader of the curves sees."""
    curves, row_scale = bench.once(condensed_curves, drawing)
    lines = drawing.lines(bench)
    alone, within, blocked = (tuple(peaks(lines, curves[k].values).tolist()) for k in (0, 1, 3))
    found = difference(lines, curves[0], curves[1], row_scale)
    partner = {min(within, key=lambda g: abs(g - f)): f for f in alone}
    return Seen(
        drawing=drawing,
        alone=alone,
        within=within,
        blocked=blocked,
        median_db=float(np.nanmedian(np.abs(found.decibel))),
        new=tuple(f for f in within if f not in partner),
        moved=tuple(
            (old, f) for f, old in partner.items() if abs(f - old) > 1.5 * drawing.band.step
        ),
    )


def judge_superposed(bench: Bench, seen: Seen) -> Judgement:
    """Whether the curves alone and in AB look like one."""
    alike = seen.median_db <= SUPERPOSED_DB and not seen.moved
    return Verdict.of(alike and not seen.new, alike), seen.words()


def judge_new_peak(bench: Bench, seen: Seen) -> Judgement:
    """Whether AB adds the global mode's peak to the subsystem's FRF."""
    return Verdict.of(global_peak(bench, seen) is not None), seen.words()


def judge_stiffer_is_higher(bench: Bench, seen: Seen) -> Judgement:
    """Whether the global mode falls with k_sw; and whether A has the DoF of the caption."""
    global_hz = [
        min(f for f in bench.modes("", k).natural_frequencies if f > 0.0)
        for k in sorted(SHAFT_STIFFNESSES)
    ]
    falls = all(low < high for low, high in pairwise(global_hz))
    listed = ", ".join(
        f"{f:.1f} Hz with {at_shaft(k)}"
        for f, k in zip(global_hz, sorted(SHAFT_STIFFNESSES), strict=True)
    )
    evidence = f"the lowest mode of AB is at {listed}; {seen.words()}"
    if bench.case.label("B.sun.w") in bench.exudyn().stages[bench.case.a].labels:
        return Verdict.of(falls), evidence
    return Verdict.of(False, falls), (
        f"{evidence}; the sun of the caption is no part of subsystem A: drawn is the wheel, which "
        "the hub joins to the sun"
    )


def global_peak(bench: Bench, seen: Seen) -> float | None:
    """The new peak that is the lowest elastic mode of AB."""
    natural = bench.modes("", seen.drawing.shaft).natural_frequencies
    lowest = min(f for f in natural if f > 0.0)
    return next((f for f in seen.new if abs(f - lowest) <= seen.drawing.band.step), None)


def _figure(
    id: str, direction: str, dof: str, judge: CondensedJudge, says: str,
    stiffness: float = SHAFT_STIFFNESSES[0], shaft: float | None = None,
) -> Statement:  # fmt: skip
    letter = dof[0]
    drawing = Drawing(dof, NARROW, letter, shaft)
    caption = f"Condensed and non-condensed subsystem {letter} FRF, in the {direction} direction"
    body = dof.split(".")[1]

    def examine(bench: Bench) -> Finding:
        curves, row_scale = bench.once(condensed_curves, drawing)
        marks = (
            *drawing.marks(bench, f"{letter} alone"),
            *drawing.marks(bench, "AB", ""),
        )
        verdict, evidence = judge(bench, bench.once(look, drawing))
        shown = picture(bench, caption, drawing, curves, row_scale, marks)
        return Finding(verdict, evidence, picture=shown)

    return Statement(
        id, f"Subsystem {letter} alone and condensed, {body}, {direction}, {at_shaft(stiffness)}",
        "figures", f"Fig. {id[3:5]}, Sec. 4.3", says, COMPUTED, examine
    )  # fmt: skip


FALLS = "The frequencies that appear in condensed A move down when k_sw is decreased."

FIG_10 = (
    _figure(
        "fig10a", "radial", "A.pinion.y", judge_superposed,
        "The condensed and the non-condensed FRF of A are superposed in the radial direction.",
    ),
    _figure(
        "fig10b", "rotational", "A.pinion.w", judge_new_peak,
        "Small differences in frequency and magnitude, and a peak due to the coupling DoF.",
    ),
)  # fmt: skip

FIG_11 = (
    _figure(
        "fig11a", "radial", "B.sun.u", judge_superposed,
        "The condensed and the non-condensed FRF of B are superposed in the radial direction.",
    ),
    _figure(
        "fig11b", "rotational", "B.sun.w", judge_new_peak,
        "A new frequency appears, which is the coupling frequency.",
    ),
)  # fmt: skip

FIG_12 = tuple(
    _figure(id, "rotational", "A.wheel.w", judge_stiffer_is_higher, FALLS, shaft, shaft)
    for id, shaft in (("fig12a", max(SHAFT_STIFFNESSES)), ("fig12b", min(SHAFT_STIFFNESSES)))
)

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

from ..checks.metrics import scaled_error
from .bench import Bench, RouteName, at_shaft, curve, peaks
from .figures import NARROW, Drawing, Judgement, Sketch, figure
from .item import Finding, Statement, Verdict, statement
from .printed_values import GLOBAL_PEAK_HZ, SHAFT_STIFFNESSES
from .resonances import repeated

SUPERPOSED_DB = 0.1
"""Curves whose median difference is below this look like one."""

NEAR_HZ = 5.0
""""Around 70 Hz" is within this."""

AROUND_HZ = 150.0
""""Around 2000 Hz" is within this: half a division of the paper's axis."""

ROTATION_OF_A = Drawing("A.pinion.w", NARROW, "A")

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


def alone_and_condensed(bench: Bench, drawing: Drawing) -> Sketch:
    """The subsystem alone, in AB by both routes, and with the rest of AB blocked."""
    letter, part = drawing.part, drawing.part_name(bench)
    curves = [
        drawing.curve(bench, RouteName.EXUDYN, f"{letter} alone"),
        drawing.curve(bench, RouteName.FBS, f"{letter} in AB, no force on the rest", ""),
        drawing.curve(bench, RouteName.EXUDYN, f"{letter} in AB, exudyn", ""),
        curve(
            f"{letter} by Eq. (31), the rest blocked", "exudyn, locked",
            blocked_frf(bench, drawing), *drawing.pair(bench),
        ),
    ]  # fmt: skip
    alone = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft, part)
    return Sketch(curves, alone, [(part, f"{letter} alone"), ("", "AB")])


def look(bench: Bench, drawing: Drawing) -> Seen:
    """What a reader of the curves sees."""
    curves = bench.once(alone_and_condensed, drawing).curves
    lines = drawing.lines(bench)
    alone, within, blocked = (tuple(peaks(lines, curves[k].values).tolist()) for k in (0, 1, 3))
    change = 20.0 * np.log10(np.abs(curves[1].values / curves[0].values))
    partner = {min(within, key=lambda g: abs(g - f)): f for f in alone}
    return Seen(
        drawing=drawing,
        alone=alone,
        within=within,
        blocked=blocked,
        median_db=float(np.median(np.abs(change))),
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
    id: str, direction: str, dof: str, judge: CondensedJudge, says: str, shaft: float | None = None
) -> Statement:
    letter, body, _ = dof.split(".")
    stiffness = at_shaft(SHAFT_STIFFNESSES[0] if shaft is None else shaft)
    return figure(
        id, f"Subsystem {letter} alone and condensed, {body}, {direction}, {stiffness}", "Sec. 4.3",
        f"Condensed and non-condensed subsystem {letter} FRF, in the {direction} direction", says,
        Drawing(dof, NARROW, letter, shaft),
        lambda drawn: judge(drawn.bench, drawn.bench.once(look, drawn.drawing)),
        lambda bench, drawing: bench.once(alone_and_condensed, drawing), COMPUTED,
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
    _figure(id, "rotational", "A.wheel.w", judge_stiffer_is_higher, FALLS, shaft)
    for id, shaft in (("fig12a", max(SHAFT_STIFFNESSES)), ("fig12b", min(SHAFT_STIFFNESSES)))
)


# --- what Sec. 4.3 says beside them ---


@statement(
    "peak-at-70", "The peak at around 70 Hz", "Sec. 4.3, Fig. 10b",
    f"The peak appearing at around {GLOBAL_PEAK_HZ:.0f} Hz is due to the coupling DoF.",
    "the peaks of A in AB that A alone does not have, and the lowest elastic mode of AB",
    subject="condensation",
)  # fmt: skip
def peak_at_70(bench: Bench) -> Finding:
    """Is the hub's peak where the paper has it?"""
    seen = bench.once(look, ROTATION_OF_A)
    found = global_peak(bench, seen)
    near = found is not None and abs(found - GLOBAL_PEAK_HZ) <= NEAR_HZ
    where = "no such peak" if found is None else f"its peak is at {found:.0f} Hz"
    return Finding(
        Verdict.of(near),
        f"the hub on its shaft does add a peak (fig10b), but {where}, not at around "
        f"{GLOBAL_PEAK_HZ:.0f}; Table 3's row of 71 Hz says which input would give that",
        {} if found is None else {"peak_hz": found},
    )


@statement(
    "peak-at-2000", "The peak at around 2000 Hz", "Sec. 4.3, Fig. 10b",
    "The peak located around 2000 Hz shifts rearward in the condensed subsystem A under the effect "
    "of B.",
    f"peaks of A within {AROUND_HZ:.0f} Hz of 2000 Hz: alone, in AB, and with the rest blocked",
    subject="condensation",
)  # fmt: skip
def peak_at_2000(bench: Bench) -> Finding:
    """Does A have a peak at 2000 Hz, and does it move down?"""
    seen = bench.once(look, ROTATION_OF_A)
    near = {
        name: [f for f in own if abs(f - 2000.0) <= AROUND_HZ]
        for name, own in (("alone", seen.alone), ("in AB", seen.within), ("blocked", seen.blocked))
    }
    falls = bool(near["alone"] and near["in AB"]) and near["in AB"][0] < near["alone"][0]
    listed = "; ".join(f"{name}: {hz(own)}" for name, own in near.items())
    modes = bench.modes()
    there = [modes.natural_frequencies[group[0]] for group in repeated(modes)]
    silent = [float(f) for f in there if abs(f - 2000.0) <= AROUND_HZ]
    return Finding(
        Verdict.of(falls),
        f"{listed}. The rotational peaks of A are at {hz(seen.alone)} alone, {hz(seen.within)} in "
        f"AB and {hz(seen.blocked)} with hub and B blocked. The modes of AB there are at "
        f"{hz(silent)}",
        {f"peaks_{name.replace(' ', '_')}": float(len(own)) for name, own in near.items()},
    )


@statement(
    "a-more-condensed", "Sensitivity to condensation", "Sec. 4.3",
    "The FRF of subsystem A is more sensitive to condensation than that of B.",
    "scaled change of all FRFs of A and of B, alone against in AB (H_MM), and against the rest "
    "blocked (Eq. 31), median over lines", subject="condensation",
)  # fmt: skip
def a_more_condensed(bench: Bench) -> Finding:
    """Which subsystem changes more when it becomes part of AB?"""
    changes = {name: _changes(bench, name) for name in (bench.case.a, bench.case.b)}
    (free_a, blocked_a), (free_b, blocked_b) = changes.values()
    return Finding(
        Verdict.of(free_a > free_b and blocked_a > blocked_b, free_a > free_b),
        f"in AB: A changes by {free_a:.2g}, B by {free_b:.2g} (of the row norms); with the rest "
        f"blocked: A by {blocked_a:.2g}, B by {blocked_b:.2g}. The hub is held to the wheel by "
        f"{float(bench.case.coupling.first_stiffness):.1e} N/m, to the sun by "
        f"{bench.case.shaft_stiffness:.1e} N/m",
        {"a_in_ab": free_a, "b_in_ab": free_b, "a_blocked": blocked_a, "b_blocked": blocked_b},
    )


def _changes(bench: Bench, name: str) -> tuple[float, float]:
    """Median over lines of the largest scaled change of a stage's FRFs: in AB, and blocked."""
    case, model, lines = bench.case, bench.exudyn(), bench.axis(NARROW).frequency[::4]
    own = case.internal_a if name == case.a else case.internal_b
    rest = [dof.label for dof in case.dofs if dof.label not in own]
    alone = direct_frf(model.stages[name], lines, own, own).values
    free, blocked = (
        direct_frf(system, lines, own, own).values
        for system in (model.whole, block_dofs(model.whole, rest))
    )
    medians = [float(np.median(scaled_error(alone, h).max(axis=(1, 2)))) for h in (free, blocked)]
    return medians[0], medians[1]

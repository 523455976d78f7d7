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

from .curves import FrfBench, RouteName, curve, difference, peaks, scale
from .figures import Drawing, Judgement, Text, assemble
from .printed_values import GLOBAL_PEAK_HZ, SHAFT_STIFFNESSES
from .resonances import resonances
from .results import Curve, Figure, FloatArray, Verdict

SUPERPOSED_DB = 0.1
"""Curves whose median difference is below this look like one."""

NEAR_HZ = 5.0
""""Around 70 Hz" is within this."""


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
            f"{_hz(self.alone)}; new in AB {_hz(self.new)}; moved {moved or 'none'}; with the rest "
            f"blocked, as Eq. (31) has it, the peaks are {_hz(self.blocked)}"
        )


CondensedJudge = Callable[[FrfBench, Seen], Judgement]


def _hz(frequencies: Sequence[float]) -> str:
    return ", ".join(f"{f:.0f}" for f in frequencies) + " Hz" if frequencies else "none"


def blocked_frf(bench: FrfBench, drawing: Drawing) -> Frf:
    """A subsystem with all the rest of AB locked: what Eqs. (21), (22) and (31) give.

    From the blocked matrices: `condensation` shows that the formula gives the same, but for
    round-off where H is much larger than what is left of it.
    """
    case, model = bench.case, bench.systems.exudyn(drawing.shaft)
    inside = case.internal_a if drawing.part == case.parallel.name else case.internal_b
    rest = [dof.label for dof in case.dofs if dof.label not in inside]
    lines = bench.axis(drawing.band, drawing.shaft).frequency
    response, excitation = drawing.pair
    return direct_frf(block_dofs(model.whole, rest), lines, [response], [excitation])


def condensed_figure(
    bench: FrfBench, text: Text, drawing: Drawing, judge: CondensedJudge
) -> Figure:
    """A subsystem alone, in AB by both routes, and with the rest of AB blocked."""
    letter = "A" if drawing.part == bench.case.parallel.name else "B"
    pair, band, shaft = drawing.pair, drawing.band, drawing.shaft
    alone = bench.frf(RouteName.EXUDYN, band, shaft, drawing.part)
    within = bench.frf(RouteName.FBS, band, shaft)
    full = bench.frf(RouteName.EXUDYN, band, shaft)
    blocked = blocked_frf(bench, drawing)
    curves = [
        curve(f"{letter} alone", RouteName.EXUDYN, alone, *pair),
        curve(f"{letter} in AB, no force on the rest", RouteName.FBS, within, *pair),
        curve(f"{letter} in AB, exudyn", RouteName.EXUDYN, full, *pair),
        curve(f"{letter} by Eq. (31), the rest blocked", "exudyn, locked", blocked, *pair),
    ]
    marks = [
        *resonances(bench.systems, drawing.part, shaft, pair, band.end, f"{letter} alone"),
        *resonances(bench.systems, "", shaft, pair, band.end, "AB"),
    ]
    row_scale = scale(alone, *pair)
    judgement = judge(bench, _look(bench, drawing, curves, row_scale))
    return assemble(bench, text, drawing, curves, row_scale, marks, judgement)


def _look(
    bench: FrfBench, drawing: Drawing, curves: Sequence[Curve], row_scale: FloatArray
) -> Seen:
    lines = bench.axis(drawing.band, drawing.shaft).frequency
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


def judge_superposed(bench: FrfBench, seen: Seen) -> Judgement:
    """Whether the curves alone and in AB look like one."""
    evidence = seen.words()
    if seen.median_db > SUPERPOSED_DB or seen.moved:
        return Verdict.FAILS, evidence
    return (Verdict.CORRECTED if seen.new else Verdict.HOLDS), evidence


def judge_new_peak(bench: FrfBench, seen: Seen) -> Judgement:
    """Whether AB adds the global mode's peak to the subsystem's FRF."""
    return (Verdict.HOLDS if _global_peak(bench, seen) else Verdict.FAILS), seen.words()


def judge_peak_at_70(bench: FrfBench, seen: Seen) -> Judgement:
    """Whether the global mode's peak is there, and where the paper has it."""
    found = _global_peak(bench, seen)
    if found is None:
        return Verdict.FAILS, seen.words()
    evidence = f"the hub's peak is at {found:.0f} Hz, not {GLOBAL_PEAK_HZ:.0f}; {seen.words()}"
    near = abs(found - GLOBAL_PEAK_HZ) <= NEAR_HZ
    return (Verdict.HOLDS, seen.words()) if near else (Verdict.CORRECTED, evidence)


def judge_stiffer_is_higher(bench: FrfBench, seen: Seen) -> Judgement:
    """Whether the global mode falls with k_sw; and whether A has the DoF of the caption."""
    global_hz = [
        min(f for f in bench.systems.modes("", k).natural_frequencies if f > 0.0)
        for k in sorted(SHAFT_STIFFNESSES)
    ]
    falls = all(low < high for low, high in pairwise(global_hz))
    evidence = (
        "the lowest mode of AB is at "
        + ", ".join(
            f"{f:.1f} Hz with k_sw = {k:.0e} N/m"
            for f, k in zip(global_hz, sorted(SHAFT_STIFFNESSES), strict=True)
        ).replace("e+0", "e")
        + f"; {seen.words()}"
    )
    sun = f"{bench.case.planetary.name}.sun.w"
    if sun not in bench.systems.exudyn().stages[bench.case.parallel.name].labels:
        evidence += (
            "; the sun of the caption is no part of subsystem A: drawn is the wheel, which the hub "
            "joins to the sun"
        )
        return (Verdict.CORRECTED if falls else Verdict.FAILS), evidence
    return (Verdict.HOLDS if falls else Verdict.FAILS), evidence


def _global_peak(bench: FrfBench, seen: Seen) -> float | None:
    """The new peak that is the lowest elastic mode of AB."""
    natural = bench.systems.modes("", seen.drawing.shaft).natural_frequencies
    lowest = min(f for f in natural if f > 0.0)
    return next((f for f in seen.new if abs(f - lowest) <= seen.drawing.band.step), None)

"""What changes in the whole drivetrain when a part's FRFs come from a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, direct_frf

from ..checks import peaks
from ..checks.frfs import LINES_PER_BLOCK, FrfComparison, Progress
from ..checks.metrics import decibel_difference, frac
from ..checks.peaks import Resonance
from ..routes.routes import Model, Route, swapped_route
from ..routes.substitution import Replacement
from .results import CurveChange, Swap

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[Any]
Pairs = Sequence[tuple[str, str]]

# A file's twelve digits, amplified by the coupling, stay below; a measurement is never that good.
NOTHING = 1e-6
STILL = 1e-4  # of the frequency: less between two lines is no shift
ROUND_OFF = 1e-10  # scaled: an FRF below it vanishes (by symmetry, or for want of a path)


def compare_swap(
    model: Model,
    reference: Route,
    replacements: Sequence[Replacement],
    pairs: Pairs,
    frequency: FloatArray,
    floor: FloatArray,
    report: Progress,
) -> Swap:
    """Couple the files' parts with the model's others, and compare with the whole.

    Parameters
    ----------
    model
        Whose stages are coupled with the files'.
    reference
        The whole drivetrain's FRFs before.
    replacements
        The parts from files, on these frequency lines.
    pairs
        (response, excitation) of the report's FRFs.
    frequency
        (n_frequency,) Hz.
    floor
        (n_frequency,) scaled error that round-off alone can cause.
    report
        Progress, in lines.
    """
    route = swapped_route(model, {r.part: r.frf for r in replacements})
    first = route.frf(frequency[:1])
    whole = model.whole.labels
    responses, excitations = (
        tuple(label for label in whole if label in labels)
        for labels in (first.responses, first.excitations)
    )
    possible = [(i, j) for i, j in pairs if i in responses and j in excitations]
    tally, before, after, norms = _Tally(frequency, responses, excitations), [], [], []
    for start in range(0, len(frequency), LINES_PER_BLOCK):
        report("swapping", start, len(frequency))
        lines = frequency[start : start + LINES_PER_BLOCK]
        ours = reference.frf(lines).select(whole, whole)
        theirs = route.frf(lines).select(responses, excitations)
        norms.append(row_norms(ours))
        tally.add(scaled(ours, theirs, norms[-1]))
        before.append([ours.between(*pair).copy() for pair in possible])
        after.append([theirs.between(*pair).copy() for pair in possible])
    report("swapping", len(frequency), len(frequency))
    norm = dict(zip(whole, np.concatenate(norms).T, strict=True))
    curves = tuple(
        curve_change(frequency, pair, b, a, np.sqrt(norm[pair[0]] * norm[pair[1]]))
        for pair, b, a in zip(
            possible, _joined(before, len(possible)), _joined(after, len(possible)), strict=True
        )
    )
    comparison = tally.comparison(route.name, curves)
    return Swap(
        replacements=tuple(replacements),
        responses=responses,
        excitations=excitations,
        comparison=comparison,
        changes=bool(np.any(~(comparison.line_max <= np.maximum(NOTHING, floor)))),
        curves=curves,
        not_compared=tuple(pair for pair in pairs if pair not in possible),
        alone={r.part: changes_alone(model, r, possible, frequency) for r in replacements},
        resonances=peaks.merge(frequency, (r for c in curves for r in c.resonances)),
    )


def changes_alone(
    model: Model, replacement: Replacement, pairs: Pairs, frequency: FloatArray
) -> tuple[CurveChange, ...]:
    """A part before any coupling, the model's and the file's: its interface, then ``pairs``."""
    own = direct_frf(model.stages[replacement.part], frequency)
    norm = dict(zip(own.responses, row_norms(own).T, strict=True))
    theirs = replacement.frf
    inner = [(i, j) for i, j in pairs if i in theirs.responses and j in theirs.excitations]
    places = dict.fromkeys([*((dof, dof) for dof in replacement.interface), *inner])
    return tuple(
        curve_change(
            frequency,
            (i, j),
            own.between(i, j),
            theirs.between(i, j),
            np.sqrt(norm[i] * norm[j]),
        )
        for i, j in places
    )


def curve_change(
    frequency: FloatArray,
    pair: tuple[str, str],
    before: ComplexArray,
    after: ComplexArray,
    scale: FloatArray,
) -> CurveChange:
    """One FRF before and after.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz.
    pair
        (response, excitation).
    before, after
        (n_frequency,) m/N.
    scale
        (n_frequency,) √(h_i h_j), what its scaled error refers to.
    """
    present = np.maximum(np.abs(before), np.abs(after)) > ROUND_OFF * scale
    with np.errstate(divide="ignore", invalid="ignore"):
        decibel = np.where(present, decibel_difference(before, after), np.nan)
    at, largest, rms = np.nan, np.nan, np.nan
    if (finite := np.flatnonzero(np.isfinite(decibel))).size:
        line = finite[np.argmax(np.abs(decibel[finite]))]
        at, largest = float(frequency[line]), float(decibel[line])
        rms = float(np.sqrt(np.mean(decibel[finite] ** 2)))
    resonances: tuple[Resonance, ...] = ()
    if pair[0] == pair[1]:
        both = (peaks.find(frequency, values) for values in (before, after))
        resonances = peaks.match(pair[0], *both)
    return CurveChange(
        *pair,
        before=before,
        after=after,
        decibel=decibel,
        largest_db=largest,
        at_hz=at,
        rms_db=rms,
        scaled_error=float(np.max(np.abs(after - before) / scale)),
        frac=frac(before, after),
        resonances=resonances,
    )


def row_norms(frf: Frf) -> FloatArray:
    """h_i = √Σ_j |H_ij|², (n_frequency, n_response)."""
    norms: FloatArray = np.linalg.norm(frf.values, axis=2)
    return norms


def scaled(ours: Frf, theirs: Frf, norms: FloatArray) -> FloatArray:
    """|ΔH_ij| / √(h_i h_j) of the labels of ``theirs``, h_i the row norms of ``ours``."""
    norm = dict(zip(ours.responses, norms.T, strict=True))
    rows, columns = (
        np.stack([norm[label] for label in labels], axis=1)
        for labels in (theirs.responses, theirs.excitations)
    )
    same = ours.select(theirs.responses, theirs.excitations)
    difference = np.abs(theirs.values - same.values)
    error: FloatArray = difference / np.sqrt(rows[:, :, None] * columns[:, None, :])
    return error


def _joined(blocks: list[list[ComplexArray]], count: int) -> list[ComplexArray]:
    return [np.concatenate([block[n] for block in blocks]) for n in range(count)]


@dataclass
class _Tally:
    """Running statistics of the scaled error over blocks of lines."""

    frequency: FloatArray
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    largest: list[FloatArray] = field(default_factory=list)
    place: list[NDArray[np.intp]] = field(default_factory=list)
    median: list[FloatArray] = field(default_factory=list)
    by_pair: list[FloatArray] = field(default_factory=list)

    def add(self, error: FloatArray) -> None:
        flat = error.reshape(len(error), -1)
        self.largest.append(flat.max(axis=1))
        self.place.append(flat.argmax(axis=1))
        self.median.append(np.median(flat, axis=1))
        self.by_pair.append(error.max(axis=0))

    def comparison(self, name: str, curves: Sequence[CurveChange]) -> FrfComparison:
        line_max = np.concatenate(self.largest)
        line = int(np.argmax(line_max))
        i, j = divmod(int(np.concatenate(self.place)[line]), len(self.excitations))
        return FrfComparison(
            route=name,
            line_max=line_max,
            line_median=np.concatenate(self.median),
            pair_max=np.max(self.by_pair, axis=0),
            worst=(float(self.frequency[line]), self.responses[i], self.excitations[j]),
            frac=min(((curve.frac, curve.name) for curve in curves), default=(np.nan, "")),
        )


# --- in words -------------------------------------------------------------------------------


def headline(swap: Swap) -> str:
    """What the swap changes, in half a sentence.

    By the scaled error: the largest difference in dB is that of some antiresonance.
    """
    swapped = " and ".join(f"{r.part} from {r.path.name}" for r in swap.replacements)
    odd = ", warned of" if any(r.warnings for r in swap.replacements) else ""
    subject = f"the swap ({swapped}{odd})"
    largest = float(swap.comparison.line_max.max())
    if not swap.changes:
        return f"{subject} changes nothing: largest scaled error {largest:.1e}"
    at, response, excitation = swap.comparison.worst
    told = (
        f"{subject} changes FRFs by up to {largest:.2g} (scaled error) at {at:.6g} Hz, "
        f"{response} ← {excitation}"
    )
    shifts = [r for r in swap.resonances if r.shift is not None]
    if not shifts:
        return told
    furthest = max(shifts, key=lambda r: abs(r.shift or 0.0))
    if abs(furthest.shift or 0.0) <= STILL:
        both = "" if len(shifts) == len(swap.resonances) else " that both have"
        return f"{told}; resonances{both} stay"
    return f"{told}; resonances move by up to {in_hertz(furthest)}"


def in_words(swap: Swap) -> list[str]:
    """What the swap changes, line by line."""
    told = headline(swap)
    lines = [told[0].upper() + told[1:] + "."]
    if swap.changes:
        lines += [f"  {curve.name}: {_in_numbers(curve)}" for curve in swap.curves]
        lines += [
            f"  {part} alone at {curve.name}: {_in_numbers(curve)}"
            for part, curves in swap.alone.items()
            for curve in curves
        ]
    lines += [
        f"  not compared, for want of DoFs in the file: {response} ← {excitation}"
        for response, excitation in swap.not_compared
    ]
    return lines


def _in_numbers(curve: CurveChange) -> str:
    numbers = f"largest scaled error {curve.scaled_error:.2g}, FRAC {curve.frac:.4f}"
    if not np.isfinite(curve.largest_db):
        return numbers
    return (
        f"{decibels(curve.largest_db)} at {curve.at_hz:.6g} Hz, {curve.rms_db:.2g} dB rms, "
        f"{numbers}"
    )


def decibels(value: float) -> str:
    """+3.2 dB; 0.0 where it is less than a twentieth."""
    return f"{round(value, 1) + 0.0:+.1f} dB".replace("-", "−")


def in_hertz(resonance: Resonance) -> str:
    """−2.4 % (1536 → 1499 Hz)."""
    assert resonance.before is not None
    assert resonance.after is not None
    before, after = resonance.before.frequency_hz, resonance.after.frequency_hz
    shift = f"{100.0 * (after / before - 1.0):+.2g}".replace("-", "−")
    return f"{shift} % ({before:.5g} → {after:.5g} Hz)"

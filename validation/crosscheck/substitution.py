"""What changes in the whole drivetrain when a part's FRFs come from a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fbs import direct_frf

from ..arrays import ComplexArray, FloatArray
from ..checks import peaks
from ..checks.frfs import Candidate, FrfComparisons, Pair, with_round_off
from ..checks.metrics import decibel_difference, frac, row_norms
from ..checks.part_uncertainty import DIGITS, Known, Noise, how_well_known
from ..checks.peaks import Resonance
from ..routes.routes import Route
from ..routes.source import Source
from ..routes.substitution import Substitution
from .result import Changes, CurveChange

# A file's twelve digits, amplified by the coupling, stay below; a measurement is never that good.
NOTHING = 1e-6
STILL = 1e-4  # of the frequency: less between two lines is no shift
ROUND_OFF = 1e-10  # scaled: an FRF below it vanishes (by symmetry, or for want of a path)


def what_changes(
    source: Source,
    reference: Route,
    candidate: Candidate,
    substitutions: Sequence[Substitution],
    compared: FrfComparisons,
    frequency: FloatArray,
    floor: FloatArray,
    noise: Noise | None = None,
    repetitions: int = 0,
) -> Changes:
    """What the files' parts change, from the comparison with the whole.

    Parameters
    ----------
    source
        Whose parts are coupled with the files'.
    reference
        The route of the whole before.
    candidate
        That coupling, one of the routes compared.
    substitutions
        The parts from files, on these frequency lines.
    compared
        All routes with the reference, which is the whole before.
    frequency
        (n_frequency,) Hz.
    floor
        (n_frequency,) scaled error that round-off alone can cause.
    noise
        Stated noise of the files' FRFs (None: the scatter of their runs, if there are several).
    repetitions
        By which bands are found (0: to first order).
    """
    name = candidate.route.name
    norm = dict(zip(source.whole.labels, compared.norms.T, strict=True))
    both = {pair: curves for pair, curves in compared.curves.items() if name in curves}
    curves = []
    for (i, j), by_route in both.items():
        before = next(iter(by_route.values()))
        scale = np.sqrt(norm[i] * norm[j])
        curves.append(curve_change(frequency, (i, j), before, by_route[name], scale))
    comparison = compared.by_route[name]
    allowed = with_round_off(
        np.maximum(NOTHING, floor), comparison.line_max, reference, candidate.route, frequency
    )
    return Changes(
        substitutions=tuple(substitutions),
        responses=candidate.responses,
        excitations=candidate.excitations,
        comparison=comparison,
        changes=bool(np.any(~(comparison.line_max <= allowed))),
        curves=tuple(curves),
        not_compared=tuple(pair for pair in compared.curves if pair not in both),
        alone={
            each.part: changes_alone(source, each, list(both), frequency) for each in substitutions
        },
        resonances=peaks.merge(frequency, (r for c in curves for r in c.resonances)),
        known=how_well_known(source, substitutions, list(both), noise, repetitions),
    )


def changes_alone(
    source: Source, substitution: Substitution, pairs: Sequence[Pair], frequency: FloatArray
) -> tuple[CurveChange, ...]:
    """A part before any coupling, the model's and the file's: its interface, then ``pairs``."""
    own = direct_frf(source.stage(substitution.part), frequency)
    norm = dict(zip(own.responses, row_norms(own).T, strict=True))
    theirs = substitution.frf
    inner = [(i, j) for i, j in pairs if i in theirs.responses and j in theirs.excitations]
    places = dict.fromkeys([*((dof, dof) for dof in substitution.interface), *inner])
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


def headline(found: Changes) -> str:
    """What the swap changes, in half a sentence.

    By the scaled error: the largest difference in dB is that of some antiresonance.
    """
    files = " and ".join(f"{r.part} from {r.path.name}" for r in found.substitutions)
    warned = ", warned of" if any(r.warnings for r in found.substitutions) else ""
    subject = f"the swap ({files}{warned})"
    largest = float(found.comparison.line_max.max())
    if not found.changes:
        return f"{subject} changes nothing: largest scaled error {largest:.1e}"
    at, response, excitation = found.comparison.worst
    change = (
        f"{subject} changes FRFs by up to {largest:.2g} (scaled error) at {at:.6g} Hz, "
        f"{response} ← {excitation}"
    )
    shifts = [r for r in found.resonances if r.shift is not None]
    if not shifts:
        return change
    furthest = max(shifts, key=lambda r: abs(r.shift or 0.0))
    if abs(furthest.shift or 0.0) <= STILL:
        both = "" if len(shifts) == len(found.resonances) else " that both have"
        return f"{change}; resonances{both} stay"
    return f"{change}; resonances move by up to {in_hertz(furthest)}"


def describe(found: Changes) -> list[str]:
    """What the swap changes, line by line."""
    text = headline(found)
    lines = [text[0].upper() + text[1:] + "."]
    if found.changes:
        lines += [f"  {curve.name}: {_in_numbers(curve)}" for curve in found.curves]
        lines += [
            f"  {part} alone at {curve.name}: {_in_numbers(curve)}"
            for part, curves in found.alone.items()
            for curve in curves
        ]
    lines += [
        f"  {curve.name}: {_how_well(curve, known, found.substitutions[0].frf.frequency)}"
        for curve in found.curves
        if (known := found.known.get((curve.response, curve.excitation))) is not None
    ]
    lines += [
        f"  not compared, for want of DoFs in the file: {response} ← {excitation}"
        for response, excitation in found.not_compared
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


def _how_well(curve: CurveChange, known: Known, frequency: FloatArray) -> str:
    """The band at the largest change, whether that is beyond it, and where the error comes from."""
    origin = str(known.shares[0])
    comparable = np.isfinite(curve.decibel) & np.isfinite(known.level)
    if not comparable.any() or not np.isfinite(curve.largest_db):
        typical = min(float(np.median(known.level)), known.told)
        return f"known to ±{typical:.2g} dB (95 %) typically, {origin}"
    at = int(np.argmin(np.abs(frequency - curve.at_hz)))
    exceeded = known.exceeded(curve.decibel)
    beyond = int(exceeded[comparable].sum())
    level = known.level[at]
    if level < DIGITS:
        return f"none of the files' errors reach it ({level:.1g} dB)"
    if level > known.told:
        return (
            f"hardly known at {curve.at_hz:.6g} Hz: errors reach more than ±{known.told:g} dB "
            f"(95 %) there, beyond what first order tells (--samples does), {origin}; its change "
            "is beyond them at "
            f"{beyond} of {int(comparable.sum())} lines"
        )
    verdict = (
        "the change there is beyond that"
        if exceeded[at]
        else "the change there is within that: it cannot be told from none"
    )
    width = f"±{level:.2g} dB"
    if known.repetitions:
        width = f"{known.low[at]:+.2g} to {known.high[at]:+.2g} dB".replace("-", "−")
    return (
        f"known to {width} (95 %) at {curve.at_hz:.6g} Hz, {origin}; {verdict}; "
        f"beyond it at {beyond} of {int(comparable.sum())} lines"
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

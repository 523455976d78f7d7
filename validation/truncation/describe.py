"""A study of truncation in sentences, as page and terminal say them."""

from __future__ import annotations

import math

import numpy as np

from fbs import Reason

from ..report.digits import grouped
from ..report.page import Table
from .result import BasisErrors, TruncatedFrf, TruncationResult

REASONS = {
    Reason.PART: "a left-out mode may lie at the line or below it, or the damping leaves none",
    Reason.JOINTS: "left-out modes may shift a resonance of the assembly to the line",
    Reason.ROUND_OFF: "round-off of the stages leaves no digit",
}


def verdict(result: TruncationResult) -> str:
    """The outcome in a sentence."""
    kept = f"{result.kept} of {result.modes} modes"
    end = f"to {result.plan.band.fmax:g} Hz"
    if not result.agrees:
        return f"A true error exceeds its bound: the guarantee is broken, {kept} {end}"
    if np.all(result.unreachable):
        asked = error_words(result, result.plan.tolerance.value)
        return f"No basis is guaranteed to meet {asked} {end}: round-off of all modes is more"
    if not np.isfinite(result.guaranteed):
        return f"No guarantee {end}, not even with {kept}"
    found = error_words(result, result.guaranteed)
    if np.any(result.unreachable):
        return f"Guaranteed below {found} {end} with {kept}, but for lines lost in round-off"
    return f"Guaranteed below {found} {end} with {kept}"


def conclusions(result: TruncationResult) -> tuple[str, ...]:
    """What else matters."""
    plan = result.plan
    sentences = []
    for stage in result.stages:
        silent = f"; {stage.silent} move no DoF asked for or joined" if stage.silent else ""
        beyond = (
            f"; the first left out that counts lies at {stage.first_left_out_hz:,.0f} Hz"
            if math.isfinite(stage.first_left_out_hz)
            else ""
        ).replace(",", "\u202f")
        sentences.append(
            f"{stage.stage}: {len(stage.kept)} of {stage.modes} modes{silent}{beyond}."
        )
    if not result.meets:
        lost = int(np.sum(result.unreachable.any(axis=0)))
        if lost:
            sentences.append(
                f"At {grouped(lost)} of {grouped(len(result.frequency))} lines the tolerance of "
                f"{error_words(result, plan.tolerance.value)} is below what round-off leaves of an "
                "FRF, or the FRF is deeper in an antiresonance than that: no basis meets it there."
            )
    true = max(float(np.nanmax(frf.error)) for frf in result.frfs)
    sentences.append(f"The true error is {error_words(result, true)} at most.")
    return tuple(sentences)


def error_words(result: TruncationResult, error: float) -> str:
    """An error with its unit: 0.074 dB, or 0.0009 scaled."""
    if not math.isfinite(error):
        return "none"
    unit = " scaled" if result.plan.tolerance.scaled else " dB"
    return f"{error:.2g}{unit}"


def stage_table(result: TruncationResult) -> Table:
    """What every stage keeps."""
    rows = tuple(
        (
            stage.stage,
            f"{len(stage.kept)} of {stage.modes}",
            str(stage.rigid),
            _numbers(stage.kept),
            f"{stage.kept_hz[-1]:,.0f}".replace(",", "\u202f") if len(stage.kept) else "–",
            f"{stage.first_left_out_hz:,.0f}".replace(",", "\u202f")
            if math.isfinite(stage.first_left_out_hz)
            else "–",
            "none" if stage.residual_order is None else str(stage.residual_order + 1),
        )
        for stage in result.stages
    )
    headings = (
        "stage", "modes kept", "rigid-body", "which", "highest kept, Hz",
        "first left out that counts, Hz", "residuals",
    )  # fmt: skip
    return Table(headings, rows, frozenset({1, 2, 4, 5, 6}))


def _numbers(numbers: tuple[int, ...]) -> str:
    """1–4, 6, 9–12."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(f"{a}" if a == b else f"{a}–{b}" for a, b in runs) or "–"


def alternative_table(result: TruncationResult) -> Table:
    """Other ways of choosing modes beside the smallest basis."""
    rows = tuple(
        (
            found.name,
            str(found.modes),
            _cell(result, found.bound, found),
            error_words(result, found.error),
            grouped(found.unbounded),
        )
        for found in result.alternatives
    )
    headings = ("modes", "kept", "guaranteed", "true error", "lines without a bound")
    return Table(headings, rows, frozenset({1, 2, 3, 4}))


def _cell(result: TruncationResult, error: float, found: BasisErrors) -> str:
    if math.isfinite(error):
        return error_words(result, error)
    return "not at every line" if found.unbounded < len(result.frequency) else "no"


def line_table(result: TruncationResult) -> Table:
    """Lines without a guarantee, FRF by FRF, and why."""
    rows = []
    for frf, lost in zip(result.frfs, result.unreachable, strict=True):
        for reason, words in REASONS.items():
            at = np.flatnonzero(result.reason == reason)
            if at.size:
                rows.append(_lines_row(result, frf, at, words))
        deep = (result.reason == Reason.BOUNDED) & np.isinf(frf.bound)
        if deep.any():
            words = "an antiresonance deeper than the bound: no error in dB"
            rows.append(_lines_row(result, frf, np.flatnonzero(deep), words))
        beyond = lost & np.isfinite(frf.bound)
        if beyond.any():
            words = "a bound, but beyond the tolerance: round-off of all modes is"
            rows.append(_lines_row(result, frf, np.flatnonzero(beyond), words))
    return Table(
        ("FRF", "lines", "where, Hz", "why"), tuple(rows), frozenset({1}),
        empty="Every line of every FRF has its bound.",
    )  # fmt: skip


def _lines_row(
    result: TruncationResult, frf: TruncatedFrf, at: np.ndarray, words: str
) -> tuple[str, ...]:
    breaks = np.flatnonzero(np.diff(at) > 1) + 1
    runs = [result.frequency[part] for part in np.split(at, breaks)]
    shown = [f"{r[0]:g}" if len(r) == 1 else f"{r[0]:g}–{r[-1]:g}" for r in runs[:6]]
    more = f", … ({len(runs)} stretches)" if len(runs) > 6 else ""
    return pair_words(frf), grouped(int(at.size)), ", ".join(shown) + more, words


def pair_words(frf: TruncatedFrf) -> str:
    """Response ← excitation."""
    return f"{frf.pair[0]} ← {frf.pair[1]}"

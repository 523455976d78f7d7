"""Tables 3 and 4: printed natural frequencies beside the computed ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from mbs_models.modal.mode_kinds import Kind

from ..report.page import Block, Bullets, Note, Table
from .bench import Bench
from .case import PaperCase
from .hypotheses import Hypothesis, explain, what_it_would_take
from .item import Finding, Verdict, statement
from .printed_values import PRINTED_TO_HZ, TABLE_3, TABLE_4, TABLE_BAND_HZ, PrintedMode
from .spectrum import Line, matches, spectrum

TOLERANCE_HZ = PRINTED_TO_HZ
"""Half of it where the last digit was rounded, all of it where the digits behind were cut off."""


class RowVerdict(StrEnum):
    """Whether a printed number is found."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a stated correction"
    MISSED = "not reproduced"


ROW_LOOKS = {RowVerdict.CORRECTED: "corrected", RowVerdict.MISSED: "fails"}
"""CSS classes of rows that are not as printed."""


@dataclass(frozen=True)
class Found:
    """The computed mode nearest to a printed one.

    Attributes
    ----------
    frequency_hz, kind, multiplicity
        Of the mode (a repeated one counts as one with its multiplicity).
    deviation_hz
        Computed minus printed.
    """

    frequency_hz: float
    kind: Kind
    multiplicity: int
    deviation_hz: float


@dataclass(frozen=True)
class TableRow:
    """One printed natural frequency.

    Attributes
    ----------
    number
        The row's number in the paper.
    printed
        As printed, e.g. ``727(2)``.
    column
        The column it stands in.
    frequency_hz, multiplicity, kind
        What the print says: Hz, how many modes, of which kind.
    found
        Parameter set → the nearest computed mode of that kind.
    verdict, reason
        The verdict, and what was found out, in words with numbers.
    """

    number: int
    printed: str
    column: str
    frequency_hz: float
    multiplicity: int
    kind: Kind
    found: Mapping[str, Found]
    verdict: RowVerdict
    reason: str


@dataclass(frozen=True)
class MissingMode:
    """A computed mode below the table's highest band that the table does not print."""

    frequency_hz: float
    multiplicity: int
    kind: Kind
    reason: str

    def __str__(self) -> str:
        return f"{Line(self.frequency_hz, self.multiplicity, self.kind)}, {self.kind}"


@dataclass(frozen=True)
class Spectra:
    """A printed table of natural frequencies, row by row.

    Attributes
    ----------
    rows, missing
        What is printed, and what is not.
    best_set
        The parameter set that gives most of it.
    hits
        Parameter set → how many rows it gives directly.
    """

    rows: tuple[TableRow, ...]
    missing: tuple[MissingMode, ...]
    best_set: str
    hits: Mapping[str, int]


@statement(
    "table3", "Full system natural frequencies", "Table 3, Sec. 4.1",
    "The natural frequencies of the full system, by kind.",
    "exudyn's modes of the full system with both parameter sets: the paper's Table 2, and the gear "
    "set of Lin & Parker (1999)",
)  # fmt: skip
def full_system_frequencies(bench: Bench) -> Finding:
    """Which rows of Table 3 does the model give?"""
    return _finding(bench.once(table_3))


@statement(
    "table4", "Comparison of the rotational modes", "Table 4, Sec. 4.2",
    "The rotational natural frequencies of the full system, and those by the coupling method.",
    "exudyn's modes of the full system with both parameter sets (coupling gives the same ones)",
)  # fmt: skip
def rotational_modes(bench: Bench) -> Finding:
    """Which rows of Table 4 does the model give?"""
    return _finding(bench.once(table_4))


def table_3(bench: Bench) -> Spectra:
    """Table 3, the full system's natural frequencies."""
    return _spectra(TABLE_3, bench.cases, TABLE_BAND_HZ)


def table_4(bench: Bench) -> Spectra:
    """Table 4, rotational modes of the full system and of the coupling method."""
    printed = tuple(
        PrintedMode(number, value, 1, column, Kind.ROTATIONAL if value else Kind.RIGID_BODY)
        for number, pair in enumerate(TABLE_4, start=1)
        for column, value in zip(("Full system", "Coupling method"), pair, strict=True)
    )
    return _spectra(printed, bench.cases, 0.0)


def _spectra(
    printed: Sequence[PrintedMode], cases: Mapping[str, PaperCase], listed_to_hz: float
) -> Spectra:
    """Every row beside the modes of each parameter set; missing modes up to a frequency."""
    spectra = {name: spectrum(case.exudyn.modes.modes) for name, case in cases.items()}
    hits = {name: sum(_direct(p, lines) for p in printed) for name, lines in spectra.items()}
    best = max(hits, key=lambda name: hits[name])
    case, lines = cases[best], spectra[best]
    unexplained = [p for p in printed if not any(_near(p, line) for line in lines)]
    readings = explain(case, unexplained, TOLERANCE_HZ)
    kept = [p.frequency_hz for p in printed if p.kind == Kind.PARALLEL_STAGE and _direct(p, lines)]
    rows = tuple(_row(p, spectra, best, readings, case, kept) for p in printed)
    return Spectra(rows, _missing(printed, lines, listed_to_hz), best, hits)


def _finding(table: Spectra) -> Finding:
    reason = _tolerance_reason(table.rows, table.best_set)
    counts = {v: sum(row.verdict == v for row in table.rows) for v in RowVerdict}
    words = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    n = len(table.rows)
    sets = "; ".join(f"{count} of {n} rows with {name}" for name, count in table.hits.items())
    gaps = "; ".join(map(str, table.missing))
    complete = counts[RowVerdict.REPRODUCED] == n and not table.missing
    return Finding(
        Verdict.of(complete, counts[RowVerdict.MISSED] == 0),
        f"{words}; directly: {sets}" + (f"; not printed: {gaps}" if gaps else ""),
        {f"rows_{v.name.lower()}": float(count) for v, count in counts.items()},
        blocks=_blocks(table, reason),
        details={
            "rows": table.rows,
            "missing": table.missing,
            "tolerance_hz": TOLERANCE_HZ,
            "tolerance_reason": reason,
            "best_set": table.best_set,
        },
    )


def _blocks(table: Spectra, tolerance_reason: str) -> tuple[Block, ...]:
    headings = ("No.", "Printed (Hz)", "Column in the paper", *table.hits, "Verdict", "Reason")
    rows = tuple(
        (str(r.number), r.printed, r.column,
         *(_beside(r.found.get(name)) for name in table.hits), r.verdict, r.reason)
        for r in table.rows
    )  # fmt: skip
    styles = {i: ROW_LOOKS[r.verdict] for i, r in enumerate(table.rows) if r.verdict in ROW_LOOKS}
    unprinted = tuple(f"Computed, but not printed: {mode}: {mode.reason}" for mode in table.missing)
    numbers = frozenset((0, 1, *range(3, 3 + len(table.hits))))
    return (
        Table(headings, rows, numbers, style="rows", row_styles=styles),
        *((Bullets(unprinted),) if unprinted else ()),
        Note(
            "Each printed frequency beside the nearest computed one of the kind it is printed as, "
            "with the deviation in Hz; (2) marks a mode that occurs twice. A row counts as "
            f"reproduced within {TOLERANCE_HZ:g} Hz, because it is {tolerance_reason}."
        ),
    )


def _beside(found: Found | None) -> str:
    if found is None:
        return "none"
    repeated = f"({found.multiplicity})" if found.multiplicity > 1 else ""
    return f"{found.frequency_hz:.1f}{repeated} ({found.deviation_hz:+.1f})"


def _tolerance_reason(rows: Sequence[TableRow], best: str) -> str:
    cut = [
        f"{row.found[best].frequency_hz:.1f} is printed {row.printed}"
        for row in rows
        if row.verdict == RowVerdict.REPRODUCED
        and abs(row.found[best].deviation_hz) > PRINTED_TO_HZ / 2.0
    ]
    words = "printed to 1 Hz: ±0.5 Hz if rounded, up to 1 Hz if the digits behind were cut off"
    return words + (f", as they are here ({', '.join(cut)})" if cut else "")


def _nearest(printed: PrintedMode, lines: Sequence[Line]) -> Found | None:
    """The line of the printed kind that is nearest to the printed frequency."""
    of_kind = [line for line in lines if line.kind == printed.kind]
    if not of_kind:
        return None
    line = min(of_kind, key=lambda each: abs(each.frequency_hz - printed.frequency_hz))
    deviation = line.frequency_hz - printed.frequency_hz
    return Found(line.frequency_hz, line.kind, line.multiplicity, deviation)


def _direct(printed: PrintedMode, lines: Sequence[Line]) -> bool:
    """Whether the mode is there, of the printed kind (a table of single modes may count pairs)."""
    return any(line.kind == printed.kind and matches(printed, line, TOLERANCE_HZ) for line in lines)


def _row(
    printed: PrintedMode,
    spectra: Mapping[str, Sequence[Line]],
    best: str,
    readings: Mapping[PrintedMode, tuple[Hypothesis, float]],
    case: PaperCase,
    kept: Sequence[float],
) -> TableRow:
    found = {
        name: match
        for name, lines in spectra.items()
        if (match := _nearest(printed, lines)) is not None
    }
    lines = spectra[best]
    if _direct(printed, lines):
        verdict, reason = RowVerdict.REPRODUCED, f"{found[best].frequency_hz:.1f} Hz with {best}"
    elif (other := next((ln for ln in lines if _near(printed, ln)), None)) is not None:
        verdict, reason = RowVerdict.CORRECTED, _other_kind(printed, other)
    elif printed in readings:
        reading, deviation = readings[printed]
        verdict = RowVerdict.MISSED
        reason = (
            f"{_nearest_words(printed, found, best)}; {printed.frequency_hz + deviation:.2f} Hz "
            f"is what {reading.words} has"
        )
    else:
        verdict = RowVerdict.MISSED
        reason = f"{_nearest_words(printed, found, best)}; {_needs(case, printed, kept)}"
    return TableRow(
        printed.number, str(printed), printed.column, printed.frequency_hz, printed.multiplicity,
        printed.kind, found, verdict, reason,
    )  # fmt: skip


def _near(printed: PrintedMode, line: Line) -> bool:
    return abs(line.frequency_hz - printed.frequency_hz) <= TOLERANCE_HZ


def _other_kind(printed: PrintedMode, line: Line) -> str:
    noun = "a pair" if line.multiplicity == 2 else f"of multiplicity {line.multiplicity}"
    what = f"a {line.kind} mode" if line.multiplicity == 1 else f"a {line.kind} mode, {noun}"
    if line.kind == printed.kind:
        return f"{line}: {what}, printed with multiplicity {printed.multiplicity}"
    return f"{line} is {what}, printed among the {printed.kind} modes"


def _nearest_words(printed: PrintedMode, found: Mapping[str, Found], best: str) -> str:
    if best not in found:
        return f"the model has no {printed.kind} mode"
    own = found[best]
    return (
        f"the nearest {printed.kind} mode of the model is at {own.frequency_hz:.1f} Hz "
        f"({own.deviation_hz:+.1f} Hz)"
    )


def _needs(case: PaperCase, printed: PrintedMode, kept: Sequence[float]) -> str:
    if printed.kind != Kind.PARALLEL_STAGE:
        return "none of the readings tried (printed inertias as hub, printed k_sw) gives it"
    needed = what_it_would_take(case, printed, kept, TOLERANCE_HZ)
    if not needed:
        return "no single number of Table 1 changed by up to a factor of two gives it"
    return (
        "it would need " + " or ".join(map(str, needed)) + ", which the paper prints nowhere "
        "(every other single change of Table 1 moves a frequency that is printed rightly)"
    )


def _missing(
    printed: Sequence[PrintedMode], lines: Sequence[Line], listed_to_hz: float
) -> tuple[MissingMode, ...]:
    """Computed modes that no row stands for."""
    strays = [p for p in printed if not any(_near(p, line) for line in lines)]
    found = []
    for line in lines:
        if line.frequency_hz > listed_to_hz or any(_near(p, line) for p in printed):
            continue
        reason = f"below {TABLE_BAND_HZ:.0f} Hz, where Fig. 4 ends"
        stray = next((p for p in strays if p.kind == line.kind), None)
        if stray is not None:
            deviation = stray.frequency_hz - line.frequency_hz
            reason += f"; {stray} Hz stands in its place ({deviation:+.1f} Hz)"
        found.append(MissingMode(line.frequency_hz, line.multiplicity, line.kind, reason))
    return tuple(found)

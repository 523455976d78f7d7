"""Tables 3 and 4: printed natural frequencies beside the computed ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mbs_models.modal.mode_kinds import Kind

from .hypotheses import Hypothesis, explain, what_it_would_take
from .model import PaperCase
from .printed_values import PRINTED_TO_HZ, TABLE_3, TABLE_4, TABLE_BAND_HZ, PrintedMode
from .results import Found, MissingMode, PaperTable, RowVerdict, TableRow, Verdict
from .spectrum import Line, matches, nearest, spectrum

TOLERANCE_HZ = PRINTED_TO_HZ
"""Half of it where the last digit was rounded, all of it where the digits behind were cut off."""


def table_3(cases: Mapping[str, PaperCase]) -> PaperTable:
    """Table 3, the full system's natural frequencies."""
    return _table("table3", "Full system natural frequencies", "Table 3, Sec. 4.1", TABLE_3, cases)


def table_4(cases: Mapping[str, PaperCase]) -> PaperTable:
    """Table 4, rotational modes of the full system and of the coupling method."""
    printed = tuple(
        PrintedMode(number, value, 1, column, Kind.ROTATIONAL if value else Kind.RIGID_BODY)
        for number, pair in enumerate(TABLE_4, start=1)
        for column, value in zip(("Full system", "Coupling method"), pair, strict=True)
    )
    return _table(
        "table4", "Comparison of the rotational modes", "Table 4, Sec. 4.2", printed, cases
    )


def _table(
    id: str,
    caption: str,
    place: str,
    printed: Sequence[PrintedMode],
    cases: Mapping[str, PaperCase],
) -> PaperTable:
    from mbs_models.modal.modes import drivetrain_modes  # exudyn takes its time to load

    spectra = {
        name: spectrum(drivetrain_modes(case.drivetrain).modes) for name, case in cases.items()
    }
    hits = {name: sum(_direct(p, lines) for p in printed) for name, lines in spectra.items()}
    best = max(hits, key=lambda name: hits[name])
    case, lines = cases[best], spectra[best]
    unexplained = [p for p in printed if not _at_its_place(p, lines)]
    readings = explain(case, unexplained, TOLERANCE_HZ)
    kept = [p.frequency_hz for p in printed if p.kind == Kind.PARALLEL_STAGE and _direct(p, lines)]
    rows = tuple(_row(p, spectra, best, readings, case, kept) for p in printed)
    missing = _missing(printed, rows, lines) if id == "table3" else ()
    return PaperTable(
        id, caption, place, rows, missing, TOLERANCE_HZ, _tolerance_reason(rows, best), best,
        _verdict(rows, missing), _evidence(rows, missing, hits),
    )  # fmt: skip


def _tolerance_reason(rows: Sequence[TableRow], best: str) -> str:
    cut = [
        f"{row.found[best].frequency_hz:.1f} is printed {row.printed}"
        for row in rows
        if row.verdict == RowVerdict.REPRODUCED
        and abs(row.found[best].deviation_hz) > PRINTED_TO_HZ / 2.0
    ]
    words = "printed to 1 Hz: ±0.5 Hz if rounded, up to 1 Hz if the digits behind were cut off"
    return words + (f", as they are here ({', '.join(cut)})" if cut else "")


def _direct(printed: PrintedMode, lines: Sequence[Line]) -> bool:
    """Whether the mode is there, of the printed kind (a table of single modes may count pairs)."""
    return any(line.kind == printed.kind and matches(printed, line, TOLERANCE_HZ) for line in lines)


def _at_its_place(printed: PrintedMode, lines: Sequence[Line]) -> bool:
    """Whether there is a mode at that frequency, of whatever kind."""
    return any(abs(line.frequency_hz - printed.frequency_hz) <= TOLERANCE_HZ for line in lines)


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
        if (match := nearest(printed, lines)) is not None
    }
    lines = spectra[best]
    if _direct(printed, lines):
        verdict, reason = RowVerdict.REPRODUCED, _others(printed, found, best)
    elif (other := next((ln for ln in lines if _near(printed, ln)), None)) is not None:
        verdict, reason = RowVerdict.CORRECTED, _other_kind(printed, other)
    elif printed in readings:
        reading, deviation = readings[printed]
        verdict = RowVerdict.CORRECTED
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


def _others(printed: PrintedMode, found: Mapping[str, Found], best: str) -> str:
    own = found[best]
    if len(found) > 1 and all(abs(f.deviation_hz) <= TOLERANCE_HZ for f in found.values()):
        return f"{own.frequency_hz:.1f} Hz with either set"
    words = f"{own.frequency_hz:.1f} Hz with {best}"
    for name, other in found.items():
        if name != best and abs(other.deviation_hz) > TOLERANCE_HZ:
            words += f"; the nearest of its kind with {name} is {other.frequency_hz:.1f} Hz"
    return words


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
    printed: Sequence[PrintedMode], rows: Sequence[TableRow], lines: Sequence[Line]
) -> tuple[MissingMode, ...]:
    """Computed modes that no row stands for."""
    strays = [row for row in rows if not any(_near(p, ln) for p in [_of(row)] for ln in lines)]
    found = []
    for line in lines:
        if line.frequency_hz > TABLE_BAND_HZ or any(_near(p, line) for p in printed):
            continue
        reason = f"a {line.kind} mode below {TABLE_BAND_HZ:.0f} Hz, where Fig. 4 ends"
        stray = next((row for row in strays if row.kind == line.kind), None)
        if stray is not None:
            deviation = stray.frequency_hz - line.frequency_hz
            reason += f"; {stray.printed} Hz stands in its place ({deviation:+.1f} Hz)"
        found.append(MissingMode(line.frequency_hz, line.multiplicity, line.kind, reason))
    return tuple(found)


def _of(row: TableRow) -> PrintedMode:
    return PrintedMode(row.number, row.frequency_hz, row.multiplicity, row.column, row.kind)


def _verdict(rows: Sequence[TableRow], missing: Sequence[MissingMode]) -> Verdict:
    reproduced = sum(row.verdict == RowVerdict.REPRODUCED for row in rows)
    if reproduced == len(rows) and not missing:
        return Verdict.HOLDS
    return Verdict.CORRECTED if 2 * reproduced >= len(rows) else Verdict.FAILS


def _evidence(
    rows: Sequence[TableRow], missing: Sequence[MissingMode], hits: Mapping[str, int]
) -> str:
    counts = {v: sum(row.verdict == v for row in rows) for v in RowVerdict}
    words = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    sets = "; ".join(f"{count} of {len(rows)} rows with {name}" for name, count in hits.items())
    gaps = ", ".join(
        str(Line(m.frequency_hz, m.multiplicity, m.kind)) + f" ({m.kind})" for m in missing
    )
    return f"{words}; directly: {sets}" + (f"; not printed: {gaps}" if gaps else "")

"""The report's section on parts from files: what they change, and its figures."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..checks.part_uncertainty import Known
from ..checks.peaks import Peak, Resonance
from ..report.digits import scientific
from ..report.frf_panel import (
    Band,
    Curve,
    Difference,
    FrfPanel,
    Marked,
    frf_figure,
    reference_curve,
)
from ..report.frf_panel import (
    decibels as decibel_level,
)
from ..report.page import Block, Fragment, Note, Picture, Section, Table
from ..report.style import BLUE, MUTED, VERMILLION
from ..routes.substitution import Substitution
from .describe import describe_pair
from .quality_section import IN_DOUBT, doubtful_lines
from .result import Changes, CurveChange
from .substitution import headline

MOST_RESONANCES = 30
BAND_COLOR = "#f3cdb0"
WIDE = 1000.0  # dB: beyond any frame
DASH = "–"
LABEL = Markup('<span class="label">{}</span>')
CODE = Markup("<code>{}</code>")


def substitution_section(
    drivetrain: Drivetrain, found: Changes, frequency: FloatArray, reference: str
) -> Section:
    """What changes in a drivetrain with parts from files, against the reference's whole."""
    curves = [("", c) for c in sorted(found.curves, key=lambda c: c.scaled_error, reverse=True)]
    curves += [(part, curve) for part, changes in found.alone.items() for curve in changes]
    blocks: list[Block] = [
        _headline(found, reference),
        _parts(found),
        *(
            Note(
                Markup(
                    "Left out of {}, not both response and excitation in the file: <code>{}</code>."
                ).format(each.part, ", ".join(each.left_out))
            )
            for each in found.substitutions
            if each.left_out
        ),
        Section("", "FRFs before and after", _frfs(found, curves)),
    ]
    if found.resonances:
        blocks.append(Section("", "Resonances before and after", _resonances(found)))
    parts = {each.part: each for each in found.substitutions}
    for number, (part, curve) in enumerate(curves, start=1):
        alone = f", {part} alone" if part else ""
        known = None if part else found.known.get((curve.response, curve.excitation))
        doubt = doubtful_lines(parts[part], curve, frequency) if part else None
        whose = "; before any coupling, the file against the model" if part else ""
        blocks.append(
            Picture(
                _figure(number, part, curve, frequency, known, doubt),
                Markup("{}{}").format(
                    LABEL.format(f"{curve.response} ← {curve.excitation}"), alone
                ),
                describe_pair(drivetrain, curve.response, curve.excitation) + whose,
            )
        )
    return Section("swap", "Swap", tuple(blocks))


def _headline(found: Changes, reference: str) -> Fragment:
    text = headline(found)
    warnings = Markup("").join(
        Markup("<p>⚠ {}</p>").format(warning)
        for each in found.substitutions
        for warning in each.warnings
    )
    return Fragment(
        Markup(
            '<section class="verdict finding" aria-label="What the swap changes">'
            "<strong>{}</strong><p>The swapped parts’ FRFs come from files and are coupled with "
            "the model’s other parts (FBS of {reference} stages); “before” is {reference}’s whole "
            "drivetrain, all from the model. What is listed here are findings, not disagreements: "
            "the verdicts below compare the routes of the model.</p>{}</section>"
        ).format(text[0].upper() + text[1:], warnings, reference=reference)
    )


def _parts(found: Changes) -> Table:
    rows = []
    for each in found.substitutions:
        compared = len(_labels(each))
        rows.append(
            (
                each.part,
                CODE.format(each.path),
                f"{compared} of {len(_labels(each) | set(each.left_out))}",
                CODE.format(", ".join(each.interface) or "nothing"),
            )
        )
    headings = ("Part", "File", "DoFs compared", "Coupled at")
    return Table(headings, tuple(rows), frozenset({2}), "compared")


def _labels(each: Substitution) -> set[str]:
    return {*each.frf.responses, *each.frf.excitations}


def _frfs(found: Changes, curves: list[tuple[str, CurveChange]]) -> tuple[Block, ...]:
    rows = []
    for part, curve in curves:
        decibels = (
            scientific(curve.largest_db, signed=True), f"{curve.at_hz:.6g}",
            scientific(curve.rms_db),
        )  # fmt: skip
        rows.append(
            (
                LABEL.format(f"{curve.response} ← {curve.excitation}"),
                f"{part} alone" if part else "the whole",
                *(decibels if np.isfinite(curve.rms_db) else (DASH, DASH, DASH)),
                scientific(curve.scaled_error),
                f"{curve.frac:.6f}",
            )
        )
    headings = (
        "Response ← excitation", "Of", "Largest difference (dB)", "at (Hz)", "rms (dB)",
        "Largest scaled error", "FRAC",
    )  # fmt: skip
    at, response, excitation = found.comparison.worst
    blocks: list[Block] = [
        Table(headings, tuple(rows), frozenset({2, 3, 4, 5, 6}), "routes compared"),
        Note(
            f"All {len(found.responses)} × {len(found.excitations)} FRFs that the swapped "
            f"drivetrain has: largest scaled error {scientific(found.comparison.largest)} at "
            f"{at:.6g} Hz, {response} ← {excitation}. At an antiresonance a small change is many "
            "dB; the scaled error is not misled by it. A part alone, before any coupling, is the "
            "file against the model: what differs there comes from the file, what differs only in "
            "the whole comes with the coupling."
        ),
    ]
    if found.not_compared:
        pairs = Markup(", ").join(CODE.format(f"{i} ← {j}") for i, j in found.not_compared)
        words = Markup("Not compared, for want of DoFs in the file: {}.")
        blocks.append(Note(words.format(pairs)))
    return tuple(blocks)


def _resonances(found: Changes) -> tuple[Block, ...]:
    telling = sorted(found.resonances, key=lambda r: r.prominence_db, reverse=True)
    shown = sorted(telling[:MOST_RESONANCES], key=lambda r: r.frequency_hz)
    further = len(telling) - len(shown)
    more = f" ({further} that stand out less are in results.json)" if further else ""
    headings = (
        "Before (Hz)", "After (Hz)", "Shift (Hz)", "Shift (%)", "Level (dB)", "Drive point",
    )  # fmt: skip
    return (
        Table(headings, tuple(map(_resonance, shown)), frozenset(range(5)), "compared"),
        Note(
            "Peaks of the drive points, each at the drive point where it stands out most"
            f"{more}; between the lines by the parabola of 1/|H|². Strongly damped modes make no "
            "peak, and how high an undamped mode’s peak is depends on where the lines happen to "
            "lie."
        ),
    )


def _resonance(resonance: Resonance) -> tuple[str, ...]:
    before, after = resonance.before, resonance.after
    shift = (DASH, "only before" if after is None else "only after", DASH)
    if before is not None and after is not None:
        moved = after.frequency_hz - before.frequency_hz
        percent = 100.0 * moved / before.frequency_hz
        shift = (signed(moved), signed(percent), signed(after.level_db - before.level_db, 1))
    return (_place(before), _place(after), *shift, LABEL.format(resonance.dof))


def _place(peak: Peak | None) -> str:
    return DASH if peak is None else f"{peak.frequency_hz:.2f}"


def signed(value: float, digits: int = 2) -> str:
    """−4.86; 0.00 has no sign."""
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0.0 else text.replace("-", "−")


def _figure(
    number: int,
    part: str,
    curve: CurveChange,
    frequency: FloatArray,
    known: Known | None,
    doubt: NDArray[np.bool_] | None,
) -> str:
    """|H| before and after, peaks, band and lines in doubt marked, and the difference in dB."""
    names = ("model", "file") if part else ("before (model)", "after (with the file)")
    panel = FrfPanel(
        frequency=frequency,
        curves=(
            reference_curve(names[0], curve.before, 3.5),
            Curve(names[1], curve.after, VERMILLION),
            *_peaks("resonances found", [r.before for r in curve.resonances], MUTED, 4.5),
            *_peaks("", [r.after for r in curve.resonances], VERMILLION, 3.0),
        ),
        differences=(
            Difference(
                "Difference (dB)", (Curve("difference", curve.decibel, BLUE),), logarithmic=False
            ),
        ),
        bands=() if known is None else (_band(curve, known),),
        marked=None if doubt is None else Marked(IN_DOUBT, doubt),
    )
    whose = f"{part} alone" if part else "the whole"
    alternative = f"FRF {curve.name} of {whose} before and after the swap"
    return frf_figure(panel, f"swap{number}", alternative)


def _band(curve: CurveChange, known: Known) -> Band:
    """What holds the FRF after with 95 %; as wide as the frame where errors have no bound."""
    level = decibel_level(curve.after)
    low, high = (
        np.nan_to_num(side, nan=wide, posinf=WIDE, neginf=-WIDE)
        for side, wide in ((known.low, -WIDE), (known.high, WIDE))
    )
    return Band("95 % of it", level + low, level + high, BAND_COLOR, fitted=False)


def _peaks(name: str, peaks: list[Peak | None], color: str, size: float) -> tuple[Curve, ...]:
    found = [(peak.frequency_hz, 10.0 ** (peak.level_db / 20.0)) for peak in peaks if peak]
    if not found:
        return ()
    frequency, level = np.transpose(found)
    return (Curve(name, level, color, 0.0, marker="o", size=size, frequency=frequency),)

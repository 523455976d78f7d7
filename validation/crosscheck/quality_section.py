"""The report's section on measured parts: how good their FRFs are, and what errors leave open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from fbs.measured.quality import FAIR_COHERENCE, NOISE, Quality, passivity_defect

from ..arrays import FloatArray
from ..checks.part_uncertainty import Known
from ..report.frf_panel import Curve, Difference, FrfPanel, Marked, coincident_curves, frf_figure
from ..report.page import Block, Note, Picture, Section, Table
from ..report.style import INK, MUTED, PURPLE
from ..routes.substitution import Substitution
from ..routes.substitution_checks import describe, where
from .result import Changes, CurveChange
from .substitution import decibels

MOST_DEFECTS, MOST_CURVES, MOST_SHARES = 20, 4, 3
LEAST_SHARE = 0.01
IN_DOUBT = "in doubt"
DASH = "–"
LABEL = Markup('<span class="label">{}</span>')


def quality_section(found: Changes) -> Section:
    """Quality of the files' FRFs, each part under a heading, and how well the whole is known."""
    blocks: list[Block] = [
        "What a passive, reciprocal structure has, looked for in the files’ FRFs: each pair alike "
        "both ways, no power out of any drive point nor out of the matrix as a whole, and, where "
        "the model’s part moves as a rigid body, its mass. Findings, not verdicts."
    ]
    for number, each in enumerate(found.substitutions, start=1):
        blocks.append(Section("", f"{each.part} from {each.path.name}", _part(number, each)))
    if found.known:
        blocks.append(Section("", "How well the FRFs are known", _known(found)))
    return Section("quality", "Quality of the measured parts", tuple(blocks))


def _part(number: int, each: Substitution) -> tuple[Block, ...]:
    found = each.quality
    headings = ("Property", "Of", "Largest", "at (Hz)", "Beyond what noise explains")
    blocks: list[Block] = [Table(headings, _rows(each), frozenset({2, 3}), "compared")]
    if found.defects:
        listed = [describe(defect, found.frequency) for defect in found.defects]
        more = len(listed) - MOST_DEFECTS
        shown = "; ".join(listed[:MOST_DEFECTS]) + (f"; and {more} more" if more > 0 else "")
        blocks.append(Note(f"In detail: {shown}."))
    blocks.append(
        Picture(
            _figure(number, each),
            "Drive points where the part is coupled",
            "From the file, lines in doubt shaded. A passive drive point’s receptance has a phase "
            "from −180° to 0°. Below, by line, the largest of all pairs or of the matrix; dashed: "
            f"noise of {NOISE:.0%} of an FRF, a coherence of {FAIR_COHERENCE:g}.",
        )
    )
    return tuple(blocks)


def _rows(each: Substitution) -> tuple[tuple[str, ...], ...]:
    found, axis = each.quality, each.quality.frequency
    n = len(found.square)
    rows = [
        _row("reciprocity", f"pairs: {n * (n - 1) // 2}", found, found.reciprocity),
        _row("passivity", f"the matrix of {n} DoFs", found, found.passivity),
    ]
    interface = [label for label in each.interface if label in found.square]
    if 1 < len(interface) < n:
        defect = passivity_defect(each.frf, interface)
        words = f"the matrix of the {len(interface)} DoFs it is coupled at"
        rows.append(_line("passivity", words, each.frf.frequency, defect, defect > NOISE))
    phases = [d for d in found.defects if d.what == "phase"]
    told = "; ".join(f"{d.labels[0]} {where(axis, d.lines)}" for d in phases) or "nowhere"
    rows.append(("drive-point phase", f"drive points: {n}", DASH, DASH, told))
    lack = None if found.coherence is None else 1.0 - found.coherence
    rows.append(_row("1 − coherence", "all FRFs, the least", found, lack, 1.0 - FAIR_COHERENCE))
    rows += [_mass(label, axis, ratio) for label, ratio in found.rigid.items()]
    if not found.rigid:
        rows.append(("mass", "no DoF: the model’s part moves as no rigid body here", *(DASH,) * 3))
    return tuple(rows)


def _row(
    what: str, of: str, found: Quality, values: FloatArray | None, allowed: float = NOISE
) -> tuple[str, ...]:
    if values is None:
        return what, "none there", DASH, DASH, DASH
    return _line(what, of, found.frequency, values, values > allowed)


def _line(
    what: str, of: str, axis: FloatArray, values: FloatArray, beyond: NDArray[np.bool_]
) -> tuple[str, ...]:
    worst = int(np.argmax(values))
    told = where(axis, beyond) if beyond.any() else "nowhere"
    return what, of, f"{values[worst]:.2%}", f"{axis[worst]:.6g}", told


def _mass(label: str, axis: FloatArray, ratio: FloatArray) -> tuple[str, ...]:
    """The accelerance where the model's part moves as a rigid body, over its own."""
    known = np.isfinite(ratio)
    typical = float(np.median(ratio[known]))
    low, high = axis[known][[0, -1]]
    off = abs(typical - 1.0) > 2.0 * NOISE
    told = f"{typical:.3g} times the model’s rigid body" if off else "nowhere"
    return "mass", label, f"{typical - 1.0:+.1%}".replace("-", "−"), f"{low:.6g}–{high:.6g}", told


def _figure(number: int, each: Substitution) -> str:
    """Drive points, and what does not hold line by line."""
    found = each.quality
    points = [label for label in each.interface if label in found.square] or list(found.square)
    values = {p: each.frf.between(p, p) for p in points[:MOST_CURVES]}
    curves = coincident_curves(values, width=1.4)
    panel = FrfPanel(
        frequency=found.frequency,
        curves=tuple(replace(curve, frequency=each.frf.frequency) for curve in curves),
        differences=tuple(_defects(found)),
        phase=np.array_equal(found.frequency, each.frf.frequency),
        marked=Marked(IN_DOUBT, found.doubtful),
    )
    words = f"Drive points of {each.part} from the file, with the lines in doubt"
    return frf_figure(panel, f"quality{number}", words)


def _defects(found: Quality) -> list[Difference]:
    shown: list[Difference] = []
    lack = None if found.coherence is None else 1.0 - found.coherence
    for label, name, values, color, allowed in (
        ("Defect", "reciprocity", found.reciprocity, INK, NOISE),
        ("Defect", "passivity", found.passivity, PURPLE, NOISE),
        ("1 − γ²", "1 − coherence", lack, MUTED, 1.0 - FAIR_COHERENCE),
    ):
        if values is None:
            continue
        curve = Curve(name, values, color)
        if shown and shown[-1].label == label:
            both = (*shown.pop().curves, curve)
            shown.append(Difference(label, both, decades=4, allowed=allowed))
        else:
            shown.append(Difference(label, (curve,), decades=4, allowed=allowed))
    return shown


# --- uncertainty ---------------------------------------------------------------------------


def _known(found: Changes) -> tuple[Block, ...]:
    curves = {(c.response, c.excitation): c for c in found.curves}
    axis = found.substitutions[0].frf.frequency
    rows = tuple(_certainty(curves[pair], known, axis) for pair, known in found.known.items())
    one = next(iter(found.known.values()))
    method = one.method
    limit = (
        ""
        if one.repetitions
        else f"Where they are wider than ±{one.told:g} dB first order tells no more than that "
        "(run --samples does). "
    )
    headings = (
        "Response ← excitation", "Typical (±dB)", "Largest change", "at (Hz)",
        "Known there to (±dB)", "Beyond its band", "Its error comes from",
    )  # fmt: skip
    return (
        Table(headings, rows, frozenset({1, 2, 3, 4, 5}), "compared"),
        Note(
            "Bands hold an FRF with 95 %: errors of the files’ FRFs, independent of each other, "
            f"carried through the coupling ({method}). They are drawn with the FRFs. "
            f"{limit}The split of every FRF’s error is to first order; all of it is in results.npz."
        ),
    )


def _certainty(curve: CurveChange, known: Known, axis: FloatArray) -> tuple[str, ...]:
    name = LABEL.format(f"{curve.response} ← {curve.excitation}")
    shares = Markup("<br>").join(
        str(share) for share in known.shares[:MOST_SHARES] if share.share >= LEAST_SHARE
    )
    typical = _width(float(np.median(known.level)), known)
    if not np.isfinite(curve.largest_db):
        return name, typical, DASH, DASH, DASH, DASH, shares
    at = int(np.argmin(np.abs(axis - curve.at_hz)))
    level = known.level[at]
    beyond = int(known.exceeded(curve.decibel).sum())
    return (
        name, typical, decibels(curve.largest_db), f"{curve.at_hz:.6g}",
        _width(level, known),
        f"{beyond} of {axis.size} lines", shares,
    )  # fmt: skip


def _width(level: float, known: Known) -> str:
    return f"{level:.2g}" if level <= known.told else f"more than {known.told:g}"


def doubtful_lines(
    each: Substitution, curve: CurveChange, frequency: FloatArray
) -> NDArray[np.bool_]:
    """Lines of an FRF of a part alone at which it, or one of its drive points, is in doubt."""
    found = each.quality
    lines = np.zeros(found.frequency.size, dtype=bool)
    for defect in found.defects:
        if defect.what != "passivity" and set(defect.labels) <= {curve.response, curve.excitation}:
            lines |= defect.lines
    if np.array_equal(found.frequency, frequency):
        return lines
    return np.asarray(np.interp(frequency, found.frequency, lines.astype(float)) > 0.0)

"""The data of Figures 3 to 9: FRFs by every route, and what the paper says of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks.frfs import FRF_TOLERANCE
from .curves import ZERO, FrfBench, PaperBand, RouteName, curve, difference, peaks, scale
from .printed_values import NUMBERED_AS_SECOND_PLANET
from .resonances import resonances
from .results import Curve, Figure, FloatArray, Resonance, Verdict

RECEPTANCE = "receptance |H| (m/N), in dB re 1 m/N"
WIDE = PaperBand(15000.0, 10.0)
WIDE_NOT_STATED = PaperBand(15000.0, 10.0, stated=False)
NARROW = PaperBand(4000.0, 1.0)
Judgement = tuple[Verdict, str]
Judge = Callable[[FrfBench, "Drawing"], Judgement]


@dataclass(frozen=True)
class Text:
    """Words of a figure: id, title, place, caption, what the paper says of it."""

    id: str
    title: str
    place: str
    caption: str
    says: str


@dataclass(frozen=True)
class Drawing:
    """What of which system a figure draws."""

    pair: tuple[str, str]
    band: PaperBand
    shaft: float
    part: str = ""


def assemble(
    bench: FrfBench,
    text: Text,
    drawing: Drawing,
    curves: Sequence[Curve],
    row_scale: FloatArray | None,
    marks: Sequence[Resonance],
    judgement: Judgement,
    note: str = "",
) -> Figure:
    """A figure from its curves; the first one is the reference of the differences."""
    lines = bench.axis(drawing.band, drawing.shaft)
    first, *others = curves
    return Figure(
        id=text.id,
        title=text.title,
        place=text.place,
        caption=text.caption,
        quantity=RECEPTANCE,
        response=bench.case.dof(drawing.pair[0]),
        excitation=bench.case.dof(drawing.pair[1]),
        frequency=lines.frequency,
        band_note=lines.note + note,
        curves=tuple(curves),
        differences=tuple(difference(lines.frequency, first, c, row_scale) for c in others),
        resonances=tuple(marks),
        says=text.says,
        verdict=judgement[0],
        evidence=judgement[1],
    )


def route_figure(bench: FrfBench, text: Text, drawing: Drawing, judge: Judge) -> Figure:
    """One FRF of a stage, or of the whole, by every route there is to it."""
    routes = [RouteName.EXUDYN, RouteName.EQUATIONS]
    if not drawing.part:
        routes.append(RouteName.FBS)
    names = {
        RouteName.EXUDYN: "full system, exudyn" if not drawing.part else "exudyn",
        RouteName.EQUATIONS: "full system, equations" if not drawing.part else "equations",
        RouteName.FBS: "coupled by FBS",
    }
    frfs = {r: bench.frf(r, drawing.band, drawing.shaft, drawing.part) for r in routes}
    curves = [curve(names[r], r, frfs[r], *drawing.pair) for r in routes]
    system = f"subsystem {'A' if drawing.part == bench.case.parallel.name else 'B'}"
    marks = resonances(
        bench.systems, drawing.part, drawing.shaft, drawing.pair, drawing.band.end,
        system if drawing.part else "full system",
    )  # fmt: skip
    row_scale = scale(frfs[RouteName.EXUDYN], *drawing.pair)
    return assemble(bench, text, drawing, curves, row_scale, marks, judge(bench, drawing))


def routes_error(bench: FrfBench, drawing: Drawing) -> tuple[float, float]:
    """Coupled against full system: largest scaled error, and largest |difference| in dB."""
    full = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft)
    coupled = bench.frf(RouteName.FBS, drawing.band, drawing.shaft)
    lines = bench.axis(drawing.band, drawing.shaft).frequency
    found = difference(
        lines,
        curve("full", "", full, *drawing.pair),
        curve("coupled", "", coupled, *drawing.pair),
        scale(full, *drawing.pair),
    )
    return found.worst_scaled, found.worst_db


def relative_size(bench: FrfBench, drawing: Drawing) -> float:
    """Largest |H_ij|/√(h_i h_j) of the full system over the band."""
    full = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft)
    values = np.abs(full.between(*drawing.pair))
    return float(np.max(values / scale(full, *drawing.pair)))


def judge_peaks(bench: FrfBench, drawing: Drawing) -> Judgement:
    """Whether every peak of the curve is a natural frequency, to one line."""
    frf = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft, drawing.part)
    lines = bench.axis(drawing.band, drawing.shaft).frequency
    found = peaks(lines, frf.between(*drawing.pair))
    natural = bench.systems.modes(drawing.part, drawing.shaft).natural_frequencies
    marks = resonances(
        bench.systems, drawing.part, drawing.shaft, drawing.pair, drawing.band.end, ""
    )
    seen = [m for m in marks if m.visible]
    strays = [f for f in found if np.min(np.abs(natural - f)) > drawing.band.step]
    words = ", ".join(f"{m.frequency_hz:.1f} Hz ({m.kind})" for m in seen)
    hidden = ", ".join(f"{m.frequency_hz:.1f} Hz ({m.kind})" for m in marks if not m.visible)
    evidence = f"{len(found)} peak{'s' * (len(found) != 1)}; this FRF sees {words}"
    evidence += f"; it does not see {hidden}" if hidden else ""
    if strays:
        return Verdict.FAILS, evidence + f"; no natural frequency: {strays}"
    return Verdict.HOLDS, evidence


def judge_identical(bench: FrfBench, drawing: Drawing) -> Judgement:
    """Whether coupled and full system agree to round-off."""
    scaled, decibel = routes_error(bench, drawing)
    evidence = (
        f"coupled by FBS against the full system: scaled error at most {scaled:.1e}, "
        f"{decibel:.1e} dB"
    )
    return (Verdict.HOLDS if scaled <= FRF_TOLERANCE else Verdict.FAILS), evidence


def judge_dof_number(bench: FrfBench, drawing: Drawing) -> Judgement:
    """Whether the FRFs agree, and the caption's number is the DoF it names."""
    verdict, evidence = judge_identical(bench, drawing)
    numbered = bench.case.dofs[NUMBERED_AS_SECOND_PLANET - 1]
    named = bench.case.dof(f"{bench.case.planetary.name}.planet2.u")
    if numbered == named or verdict == Verdict.FAILS:
        return verdict, evidence
    return Verdict.CORRECTED, (
        f"{evidence}; in the order of Eq. (11) DoF {NUMBERED_AS_SECOND_PLANET} is "
        f"{numbered.paper.split(', ')[1]} ({numbered.words}), while the second planet's u is DoF "
        f"{named.paper.split(',')[0]}"
    )


def judge_zero(bench: FrfBench, drawing: Drawing) -> Judgement:
    """Whether the FRF drawn is there at all."""
    size = relative_size(bench, drawing)
    evidence = (
        f"the largest |H|/√(h_i h_j) in the band is {size:.1e}: "
        + ("zero to round-off; " if size <= ZERO else "not zero; ")
        + "turning the hub moves the sun only by rotational modes, in which a sun between equally "
        "spaced planets does not translate"
    )
    if size > ZERO:
        verdict, identical = judge_identical(bench, drawing)
        return verdict, f"{size:.1e} is the largest |H|/√(h_i h_j) in the band; {identical}"
    return Verdict.FAILS, evidence


def judge_no_difference(bench: FrfBench, drawing: Drawing) -> Judgement:
    """Whether there is the difference (or the new frequency) that the paper sees."""
    scaled, decibel = routes_error(bench, drawing)
    own = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft).between(*drawing.pair)
    coupled = bench.frf(RouteName.FBS, drawing.band, drawing.shaft).between(*drawing.pair)
    lines = bench.axis(drawing.band, drawing.shaft).frequency
    extra = sorted(set(peaks(lines, coupled)) - set(peaks(lines, own)))
    evidence = (
        f"coupled against full system: scaled error at most {scaled:.1e}, {decibel:.1e} dB; peaks "
        f"that only the coupled FRF has: {', '.join(f'{f:g} Hz' for f in extra) or 'none'}"
    )
    if scaled <= FRF_TOLERANCE and not extra:
        return Verdict.FAILS, f"{evidence}; there is no such difference"
    return Verdict.HOLDS, evidence


def judge_nearly_the_same(bench: FrfBench, drawing: Drawing) -> Judgement:
    """Whether both methods have the same peaks, and differ a little in magnitude."""
    difference_seen, evidence = judge_no_difference(bench, drawing)
    if difference_seen == Verdict.HOLDS:
        return Verdict.HOLDS, evidence
    return Verdict.CORRECTED, f"{evidence}: the same frequencies, and the same magnitude"

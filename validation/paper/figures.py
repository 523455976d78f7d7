"""Figures 3 to 9: FRFs by every route, and what the paper says of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf

from ..arrays import FloatArray
from ..checks.check import Check
from ..checks.frfs import FRF_REASON, FRF_TOLERANCE
from .bench import (
    ZERO,
    Bench,
    PaperBand,
    RouteName,
    at_shaft,
    curve,
    difference,
    peaks,
    scale,
)
from .item import Curve, Difference, Finding, Picture, Resonance, Statement, Verdict
from .printed_values import NUMBERED_AS_SECOND_PLANET, SHAFT_STIFFNESSES
from .resonances import resonances

RECEPTANCE = "receptance |H| (m/N), in dB re 1 m/N"
WIDE = PaperBand(15000.0, 10.0)
WIDE_NOT_STATED = PaperBand(15000.0, 10.0, stated=False)
NARROW = PaperBand(4000.0, 1.0)
COMPUTED = "the same receptance by exudyn, by the equations and, of the whole, by FBS"

Judgement = tuple[Verdict, str]


@dataclass(frozen=True)
class Drawing:
    """What of which system a figure draws.

    ``response``, ``excitation`` and ``part`` are named as in `PaperCase.label` (``part``: A, B or,
    for the whole, nothing); without an excitation it is a drive point, and k_sw is the case's own
    where ``shaft`` is None.
    """

    response: str
    band: PaperBand
    part: str = ""
    shaft: float | None = None
    excitation: str = ""

    def pair(self, bench: Bench) -> tuple[str, str]:
        """Labels of response and excitation."""
        label = bench.case.label
        return label(self.response), label(self.excitation or self.response)

    def part_name(self, bench: Bench) -> str:
        """The stage's name, empty for the whole."""
        return {"": "", "A": bench.case.a, "B": bench.case.b}[self.part]

    def lines(self, bench: Bench) -> FloatArray:
        """(n_frequency,) Hz."""
        return bench.axis(self.band, self.shaft).frequency

    def curve(self, bench: Bench, route: RouteName, name: str, part: str | None = None) -> Curve:
        """The FRF by a route."""
        of = self.part_name(bench) if part is None else part
        return curve(name, route, bench.frf(route, self.band, self.shaft, of), *self.pair(bench))

    def marks(self, bench: Bench) -> tuple[Resonance, ...]:
        """Natural frequencies of the system drawn, in the band."""
        part = self.part_name(bench)
        return resonances(bench, part, self.shaft, self.pair(bench), self.band.end, "")


@dataclass(frozen=True, eq=False)
class Sketch:
    """What a figure is drawn from.

    Attributes
    ----------
    curves
        The first is the reference of the others.
    rows
        The FRFs whose row norms scale their errors.
    systems
        Systems whose modes are marked: (stage, or "" for the whole; what the figure calls it).
    same
        How many of the others are the reference's own FRF by another route.
    note
        What else is to be said of the lines.
    """

    curves: Sequence[Curve]
    rows: Frf
    systems: Sequence[tuple[str, str]]
    same: int = 0
    note: str = ""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A figure as its judge sees it; ``row_scale``: (n_frequency,) √(h_i h_j)."""

    bench: Bench
    drawing: Drawing
    picture: Picture
    row_scale: FloatArray

    def curve(self, name: str) -> Curve:
        """A curve by its name."""
        return next(each for each in self.picture.curves if each.name == name)

    def difference(self, name: str) -> Difference:
        """A curve's difference from the first one."""
        return next(each for each in self.picture.differences if each.curve == name)


Draw = Callable[[Bench, Drawing], Sketch]
Judge = Callable[[Drawn], Judgement]


def draw(bench: Bench, drawing: Drawing, caption: str, sketch: Sketch) -> Drawn:
    """A figure from its curves."""
    lines = bench.axis(drawing.band, drawing.shaft)
    pair = drawing.pair(bench)
    row_scale = scale(sketch.rows, *pair)
    first, *others = sketch.curves
    marks = [
        mark
        for part, name in sketch.systems
        for mark in resonances(bench, part, drawing.shaft, pair, drawing.band.end, name)
    ]
    response, excitation = map(bench.case.dof, pair)
    shown = Picture(
        caption, RECEPTANCE, response, excitation, lines.frequency, lines.note + sketch.note,
        tuple(sketch.curves),
        tuple(difference(lines.frequency, first, c, row_scale) for c in others),
        tuple(marks),
    )  # fmt: skip
    return Drawn(bench, drawing, shown, row_scale)


def route_checks(id: str, shown: Picture, same: int) -> tuple[Check, ...]:
    """The first routes to one FRF against the reference."""
    reference, *others = shown.curves
    return tuple(
        Check(
            "FRFs of the figures", "the paper's pictures", (reference.route, other.route),
            "scaled error", each.worst_scaled, FRF_TOLERANCE, FRF_REASON,
            note=f"{id}, {each.worst_scaled_hz:g} Hz",
        )
        for other, each in list(zip(others, shown.differences, strict=True))[:same]
    )  # fmt: skip


def by_every_route(bench: Bench, drawing: Drawing) -> Sketch:
    """One FRF of a stage, or of the whole, by every route there is to it."""
    routes = [RouteName.EXUDYN, RouteName.EQUATIONS, RouteName.FBS][: 2 if drawing.part else 3]
    prefix = "" if drawing.part else "full system, "
    names = (f"{prefix}exudyn", f"{prefix}equations", "coupled by FBS")
    curves = [drawing.curve(bench, r, n) for r, n in zip(routes, names, strict=False)]
    system = f"subsystem {drawing.part}" if drawing.part else "full system"
    part = drawing.part_name(bench)
    exact = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft, part)
    return Sketch(curves, exact, [(part, system)], same=len(curves) - 1)


def figure(
    id: str,
    title: str,
    section: str,
    caption: str,
    says: str,
    drawing: Drawing,
    judge: Judge,
    sketch: Draw = by_every_route,
    computed: str = COMPUTED,
) -> Statement:
    """A figure, or a part of one: its words, what it draws, and what is said of it."""

    def examine(bench: Bench) -> Finding:
        drawn_from = sketch(bench, drawing)
        drawn = draw(bench, drawing, caption, drawn_from)
        verdict, evidence = judge(drawn)
        checks = route_checks(id, drawn.picture, drawn_from.same)
        return Finding(verdict, evidence, picture=drawn.picture, checks=checks)

    place = f"Fig. {re.sub('[^0-9].*', '', id[3:])}, {section}"
    return Statement(id, title, "figures", place, says, computed, examine)


# --- what is said of them ---


def routes_error(bench: Bench, drawing: Drawing) -> tuple[float, float]:
    """Coupled against full system: largest scaled error, and largest |difference| in dB."""
    found = difference(
        drawing.lines(bench),
        drawing.curve(bench, RouteName.EXUDYN, "full"),
        drawing.curve(bench, RouteName.FBS, "coupled"),
        scale(bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft), *drawing.pair(bench)),
    )
    return found.worst_scaled, found.worst_db


def relative_size(bench: Bench, drawing: Drawing) -> float:
    """Largest |H_ij|/√(h_i h_j) of the full system over the band."""
    full = bench.frf(RouteName.EXUDYN, drawing.band, drawing.shaft)
    pair = drawing.pair(bench)
    return float(np.max(np.abs(full.between(*pair)) / scale(full, *pair)))


def judge_peaks(drawn: Drawn) -> Judgement:
    """Whether every peak of the curve is a natural frequency, to one line."""
    found = peaks(drawn.picture.frequency, drawn.picture.curves[0].values)
    marks = drawn.picture.resonances
    natural = np.array([mark.frequency_hz for mark in marks])
    strays = [f for f in found if np.min(np.abs(natural - f)) > drawn.drawing.band.step]
    seen, hidden = (
        ", ".join(f"{m.frequency_hz:.1f} Hz ({m.kind})" for m in marks if m.visible == visible)
        for visible in (True, False)
    )
    evidence = f"{len(found)} peak{'s' * (len(found) != 1)}; this FRF sees {seen}"
    evidence += f"; it does not see {hidden}" if hidden else ""
    evidence += f"; no natural frequency: {strays}" if strays else ""
    return Verdict.of(not strays), evidence


def judge_identical(drawn: Drawn) -> Judgement:
    """Whether coupled and full system agree to round-off."""
    scaled, decibel = routes_error(drawn.bench, drawn.drawing)
    return Verdict.of(scaled <= FRF_TOLERANCE), (
        f"coupled by FBS against the full system: scaled error at most {scaled:.1e}, "
        f"{decibel:.1e} dB"
    )


def judge_dof_number(drawn: Drawn) -> Judgement:
    """Whether the FRFs agree, and the caption's number is the DoF it names."""
    verdict, evidence = judge_identical(drawn)
    case = drawn.bench.case
    numbered, named = case.dofs[NUMBERED_AS_SECOND_PLANET - 1], case.dof(case.label("B.planet2.u"))
    if numbered == named or verdict == Verdict.FAILS:
        return verdict, evidence
    return Verdict.CORRECTED, (
        f"{evidence}; in the order of Eq. (11) DoF {NUMBERED_AS_SECOND_PLANET} is "
        f"{numbered.paper.split(', ')[1]} ({numbered.words}), while the second planet's u is DoF "
        f"{named.paper.split(',')[0]}"
    )


def judge_zero(drawn: Drawn) -> Judgement:
    """Whether the FRF drawn is there at all."""
    size = relative_size(drawn.bench, drawn.drawing)
    if size > ZERO:
        verdict, identical = judge_identical(drawn)
        return verdict, f"{size:.1e} is the largest |H|/√(h_i h_j) in the band; {identical}"
    return Verdict.FAILS, (
        f"the largest |H|/√(h_i h_j) in the band is {size:.1e}, zero to round-off: turning the hub "
        "moves the sun only by rotational modes, in which a sun between equally spaced planets "
        "does not translate"
    )


def judge_no_difference(drawn: Drawn) -> Judgement:
    """Whether there is the difference (or the new frequency) that the paper sees."""
    scaled, decibel = routes_error(drawn.bench, drawn.drawing)
    lines = drawn.picture.frequency
    own, _, coupled = (set(peaks(lines, each.values)) for each in drawn.picture.curves)
    extra = ", ".join(f"{f:g} Hz" for f in sorted(coupled - own))
    there = scaled > FRF_TOLERANCE or bool(extra)
    return Verdict.of(there), (
        f"coupled against full system: scaled error at most {scaled:.1e}, {decibel:.1e} dB; peaks "
        f"that only the coupled FRF has: {extra or 'none'}"
        + ("" if there else "; there is no such difference")
    )


def judge_nearly_the_same(drawn: Drawn) -> Judgement:
    """Whether both methods have the same peaks, and differ a little in magnitude."""
    verdict, evidence = judge_no_difference(drawn)
    if verdict == Verdict.HOLDS:
        return verdict, evidence
    return Verdict.CORRECTED, f"{evidence}: the same frequencies, and the same magnitude"


# --- the figures ---

TWO_SUN_DOFS = (("a", "u", "radial direction u"), ("b", "w", "rotational direction w"))
SMALL = "The same frequencies by both methods, with a small difference in magnitude."
NEW = (
    "The difference becomes considerable, and a new frequency appears in the coupled method's FRF."
)
GROWS = "The difference in frequencies between the two methods grows with k_sw."
DOF_13 = "H_13-13 at the degree of the second planet u_p2 in the radial direction"
SAYS_13 = "H_13,13 belongs to the second planet's u; both methods agree."

FIG_3 = tuple(
    figure(
        f"fig3{end}", f"Subsystem A, pinion, direction {dof}", "Sec. 4.1",
        f"Subsystem A FRF in axial and radial directions: ({end}) in direction {dof}",
        "The peaks correspond to the natural frequencies of subsystem A.",
        Drawing(f"A.pinion.{dof}", NARROW, "A"), judge_peaks,
    )
    for end, dof in (("a", "y"), ("b", "z"))
)  # fmt: skip

FIG_4 = tuple(
    figure(
        f"fig4{end}", f"Subsystem B, sun, {words}", "Sec. 4.1",
        f"Subsystem B FRF: ({end}) in the {words} of the sun",
        "The peaks correspond to the natural frequencies of subsystem B.",
        Drawing(f"B.sun.{dof}", WIDE, "B"), judge_peaks,
    )
    for end, dof, words in TWO_SUN_DOFS
)  # fmt: skip

FIG_5 = tuple(
    figure(
        f"fig5{end}", f"Coupled and full system, sun, {words}", "Sec. 4.1",
        f"Coupled system FRF computed by two methods: ({end}) in the {words} of the sun",
        "The curves of the coupled and of the full system are identical.",
        Drawing(f"B.sun.{dof}", WIDE_NOT_STATED), judge_identical,
    )
    for end, dof, words in TWO_SUN_DOFS
)  # fmt: skip

FIG_6 = (
    figure(
        "fig6a", "Coupled and full system, hub", "Sec. 4.1",
        "H_99 at the coupling DoF θ(2,2)",
        "The natural frequencies by both methods are in good agreement.",
        Drawing("hub", WIDE_NOT_STATED), judge_identical,
    ),
    figure(
        "fig6b", "Coupled and full system, DoF 13 of Eq. (11)", "Sec. 4.1", DOF_13, SAYS_13,
        Drawing("B.carrier.u", WIDE_NOT_STATED), judge_dof_number,
    ),
    figure(
        "fig6b-planet2", "Coupled and full system, second planet, radial", "Sec. 4.1",
        DOF_13, SAYS_13, Drawing("B.planet2.u", WIDE_NOT_STATED), judge_dof_number,
    ),
)  # fmt: skip

FIG_7 = figure(
    "fig7", "From the sun's u to the hub", "Sec. 4.1",
    "The FRF H_910 between the coupling DoF θ(2,2) and the sun's u_s",
    "H_9,10 has resonances; both methods agree, except a small difference in magnitude.",
    Drawing("hub", WIDE_NOT_STATED, excitation="B.sun.u"), judge_zero,
)  # fmt: skip

FIGS_8_AND_9 = tuple(
    figure(
        f"fig{number}{end}", f"Sun, {words} direction, {at_shaft(shaft)}",
        "Sec. 4.2",
        f"The sun's {words} FRF direction: ({end}) {at_shaft(shaft)}", says,
        Drawing(f"B.sun.{dof}", WIDE, shaft=shaft),
        judge_nearly_the_same if says == SMALL else judge_no_difference,
    )
    for number, dof, words, said in (
        (8, "u", "radial", (SMALL, SMALL, NEW)),
        (9, "w", "rotational", (GROWS, GROWS, GROWS)),
    )
    for end, shaft, says in zip("abc", SHAFT_STIFFNESSES, said, strict=True)
)  # fmt: skip

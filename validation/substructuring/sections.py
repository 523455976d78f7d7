"""The page of coupling, decoupling and identification."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..report.digits import grouped
from ..report.frf_panel import Curve as Line
from ..report.frf_panel import Difference, FrfPanel, frf_figure, reference_curve
from ..report.page import Bullets, Fact, Note, Page, Picture, Section, Verdict
from ..report.style import BLUE, MUTED, VERMILLION
from .describe import condition_words, lost_table, parts_table, spring_table
from .result import Curve, SubstructuringResult

METHODS = {
    "couple": (
        "Y_c = Y − Y Bᵀ (B Y Bᵀ + Z⁻¹)⁻¹ B Y (de Klerk, Rixen & Voormeeren 2008), fbs.coupling; "
        "its condition says how much larger a relative error of the interface FRFs is in the joint "
        "forces.",
    ),
    "decouple": (
        "Y_A = Y − Y_·e D⁺ Y_c·, D = Y_ce − Y^B_ce: a substructure of negative sign (D’Ambrogio & "
        "Fregolent 2014; Voormeeren & Rixen 2012), fbs.decoupling. D is nearly singular at poles "
        "of the part that is left, and at those of the known part with the interface held: even "
        "trivial examples have such spikes.",
        "Nothing is regularised unless --rank or --tikhonov ask for it.",
    ),
    "identify": (
        "Direct: Z = R_AB⁻¹ − R⁻¹, R the relative receptance at the joint, of AB and of A + B. In "
        "situ: Z = −[(Y_AB)⁻¹]_ab, of AB alone (Meggitt, Moorhouse & Elliott 2015). "
        "fbs.joint_identification.",
        "k + jωc is fitted to the diagonal of Z by the lines’ spread; the misfit over it is about "
        "1 where a spring and a damper are all there is, and lines are independent.",
    ),
}
BEFORE = {"couple": "the part alone", "decouple": "assembly", "identify": "k + jωc"}
TITLES = {"couple": "Coupled FRFs", "decouple": "FRFs of the part", "identify": "Joint"}


def substructuring_page(result: SubstructuringResult) -> Page:
    """What the page says."""
    blocks = [spring_table(result)] if result.identified else []
    return Page(
        eyebrow="Drivetrain cross-check · substructuring of files",
        heading=f"{result.command} {' '.join(part.path.name for part in result.parts)}",
        title=result.command,
        source=f"at {', '.join('='.join(dict.fromkeys(pair)) for pair in result.at)}; {result.how}",
        verdict=Verdict(result.verdict),
        conclusions=result.conclusions,
        warnings=result.warnings,
        facts=tuple(_facts(result)),
        sections=(
            Section(
                "result", TITLES[result.command],
                (*blocks, *_pictures(result), Note(f"Error: {result.error_is}.")),
            ),
            Section("digits", "Where the result has no digit", (lost_table(result),)),
            *_condition(result),
            Section("files", "Files", (parts_table(result),)),
            Section("method", "Method", (Bullets(METHODS[result.command]),)),
        ),
        timings=result.seconds,
        footer=f"what is drawn is in {result.command}.json beside it",
    )  # fmt: skip


def _facts(result: SubstructuringResult) -> Iterator[Fact]:
    frequency = result.frequency
    yield Fact(
        "Band",
        f"{frequency[0]:g}–{frequency[-1]:g} Hz",
        f"{grouped(frequency.size)} lines",
    )
    if result.condition is not None:
        yield Fact("Largest condition", *condition_words(result))
    lost = np.any([curve.lost for curve in result.curves], axis=0)
    yield Fact("Lines without a digit", grouped(int(lost.sum())), "of what is drawn")


def _pictures(result: SubstructuringResult) -> Iterator[Picture]:
    unit = "N/m" if result.identified else "m/N"
    for number, curve in enumerate(result.curves):
        yield Picture(_figure(result, curve, number, unit), curve.name)


def _figure(result: SubstructuringResult, curve: Curve, number: int, unit: str) -> str:
    before = []
    if curve.before is not None:
        before = [reference_curve(BEFORE[result.command], curve.before, 2.5)]
    with np.errstate(divide="ignore"):
        relative = curve.error / np.abs(curve.values)
    errors = [Line("error", np.where(np.isfinite(relative), relative, np.nan), BLUE)]
    if curve.lost.any():
        lost = np.where(curve.lost, np.where(np.isfinite(relative), relative, 1.0), np.nan)
        errors.append(Line("no digit", lost, VERMILLION, 0.0, marker="o"))
    panel = FrfPanel(
        result.frequency,
        (*before, Line("result", curve.values, BLUE)),
        (
            Difference("Error / |value|", tuple(errors)),
        ),
        unit=unit,
        symbol="Z" if result.identified else "H",
        phase=True,
    )  # fmt: skip
    return frf_figure(panel, f"curve{number}", f"{curve.name}, and its error relative to it")


def _condition(result: SubstructuringResult) -> tuple[Section, ...]:
    if result.condition is None:
        return ()
    panel = FrfPanel(
        result.frequency,
        (Line("condition", result.condition, MUTED),),
        unit="1",
        symbol="condition",
    )
    picture = Picture(frf_figure(panel, "condition", "condition over frequency, dB"))
    return (Section("condition", "Conditioning, line by line", (picture,)),)

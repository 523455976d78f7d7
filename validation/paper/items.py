"""Which figures there are: their words, their FRFs, and what judges them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from .condensed_figures import (
    CondensedJudge,
    condensed_figure,
    judge_new_peak,
    judge_peak_at_70,
    judge_stiffer_is_higher,
    judge_superposed,
)
from .curves import FrfBench
from .figures import (
    NARROW,
    WIDE,
    WIDE_NOT_STATED,
    Drawing,
    Judge,
    Text,
    judge_dof_number,
    judge_identical,
    judge_nearly_the_same,
    judge_no_difference,
    judge_peaks,
    judge_zero,
    route_figure,
)
from .model import PaperCase
from .printed_values import SHAFT_STIFFNESSES
from .results import Figure
from .truncated_figures import (
    TruncationJudge,
    alone,
    in_ab,
    judge_effect,
    judge_no_effect,
    judge_only_the_hub_matters,
    other_shaft,
)


@dataclass(frozen=True)
class FigureItem:
    """A figure that can be made."""

    id: str
    make: Callable[[FrfBench], Figure]


def figure_items(case: PaperCase, tolerance_db: float) -> tuple[FigureItem, ...]:
    """Figures 3 to 16, in the paper's order; ``tolerance_db`` judges the truncated ones."""
    return (
        *_stage_figures(case),
        *_coupled_figures(case),
        *_stiffness_figures(case),
        *_condensed_figures(case),
        *_truncated_figures(case, tolerance_db),
    )


def _routes(text: Text, drawing: Drawing, judge: Judge) -> FigureItem:
    return FigureItem(text.id, lambda bench: route_figure(bench, text, drawing, judge))


def _stage_figures(case: PaperCase) -> Iterator[FigureItem]:
    a, b, shaft = case.parallel.name, case.planetary.name, case.shaft_stiffness
    for end, dof, words in (("a", "y", "direction y"), ("b", "z", "direction z")):
        text = Text(
            f"fig3{end}", f"Subsystem A, pinion, {words}", "Fig. 3, Sec. 4.1",
            f"Subsystem A FRF in axial and radial directions: ({end}) in {words}",
            "The peaks correspond to the natural frequencies of subsystem A.",
        )  # fmt: skip
        label = f"{a}.pinion.{dof}"
        yield _routes(text, Drawing((label, label), NARROW, shaft, a), judge_peaks)
    for end, dof, words in (("a", "u", "radial direction u"), ("b", "w", "rotational direction w")):
        text = Text(
            f"fig4{end}", f"Subsystem B, sun, {words}", "Fig. 4, Sec. 4.1",
            f"Subsystem B FRF: ({end}) in the {words} of the sun",
            "The peaks correspond to the natural frequencies of subsystem B.",
        )  # fmt: skip
        label = f"{b}.sun.{dof}"
        yield _routes(text, Drawing((label, label), WIDE, shaft, b), judge_peaks)


def _coupled_figures(case: PaperCase) -> Iterator[FigureItem]:
    b, hub = case.planetary.name, case.hub
    sun_u = f"{b}.sun.u"

    def item(
        id: str, title: str, caption: str, pair: tuple[str, str], says: str, judge: Judge
    ) -> FigureItem:
        text = Text(id, title, f"Fig. {id[3]}, Sec. 4.1", caption, says)
        return _routes(text, Drawing(pair, WIDE_NOT_STATED, case.shaft_stiffness), judge)

    for end, dof, words in (("a", "u", "radial direction u"), ("b", "w", "rotational direction w")):
        yield item(
            f"fig5{end}", f"Coupled and full system, sun, {words}",
            f"Coupled system FRF computed by two methods: ({end}) in the {words} of the sun",
            (f"{b}.sun.{dof}", f"{b}.sun.{dof}"),
            "The curves of the coupled and of the full system are identical.", judge_identical,
        )  # fmt: skip
    yield item(
        "fig6a", "Coupled and full system, hub", "H_99 at the coupling DoF θ(2,2)", (hub, hub),
        "The natural frequencies by both methods are in good agreement.", judge_identical,
    )  # fmt: skip
    caption = "H_13-13 at the degree of the second planet u_p2 in the radial direction"
    says = "H_13,13 belongs to the second planet's u; both methods agree."
    yield item(
        "fig6b", "Coupled and full system, DoF 13 of Eq. (11)", caption,
        (case.dofs[12].label, case.dofs[12].label), says, judge_dof_number,
    )  # fmt: skip
    planet = f"{b}.planet2.u"
    yield item(
        "fig6b-planet2", "Coupled and full system, second planet, radial", caption,
        (planet, planet), says, judge_dof_number,
    )  # fmt: skip
    yield item(
        "fig7", "From the sun's u to the hub",
        "The FRF H_910 between the coupling DoF θ(2,2) and the sun's u_s", (hub, sun_u),
        "H_9,10 has resonances; both methods agree, except a small difference in magnitude.",
        judge_zero,
    )  # fmt: skip


def _stiffness_figures(case: PaperCase) -> Iterator[FigureItem]:
    small = "The same frequencies by both methods, with a small difference in magnitude."
    new = (
        "The difference becomes considerable, and a new frequency appears in the coupled method's "
        "FRF."
    )
    grows = "The difference in frequencies between the two methods grows with k_sw."
    for number, dof, words in ((8, "u", "radial"), (9, "w", "rotational")):
        for end, shaft in zip("abc", SHAFT_STIFFNESSES, strict=True):
            stiffness = f"k_sw = {shaft:.0e} N/m".replace("e+0", "e")
            last = end == "c"
            says = (new if last else small) if dof == "u" else grows
            text = Text(
                f"fig{number}{end}", f"Sun, {words} direction, {stiffness}",
                f"Fig. {number}, Sec. 4.2",
                f"The sun's {words} FRF direction: ({end}) {stiffness}", says,
            )  # fmt: skip
            label = f"{case.planetary.name}.sun.{dof}"
            judge = judge_nearly_the_same if says == small else judge_no_difference
            yield _routes(text, Drawing((label, label), WIDE, shaft), judge)


def _condensed_figures(case: PaperCase) -> Iterator[FigureItem]:
    a, b = case.parallel.name, case.planetary.name
    own, high, low = case.shaft_stiffness, max(SHAFT_STIFFNESSES), min(SHAFT_STIFFNESSES)
    falls = "The frequencies that appear in condensed A move down when k_sw is decreased."
    specs = (
        ("fig10a", "A", "radial", a, f"{a}.pinion.y", own, judge_superposed,
         "The condensed and the non-condensed FRF of A are superposed in the radial direction."),
        ("fig10b", "A", "rotational", a, f"{a}.pinion.w", own, judge_peak_at_70,
         "Small differences in frequency and magnitude, and a peak at around 70 Hz due to the "
         "coupling DoF."),
        ("fig11a", "B", "radial", b, f"{b}.sun.u", own, judge_superposed,
         "The condensed and the non-condensed FRF of B are superposed in the radial direction."),
        ("fig11b", "B", "rotational", b, f"{b}.sun.w", own, judge_new_peak,
         "A new frequency appears, which is the coupling frequency."),
        ("fig12a", "A", "rotational", a, f"{a}.wheel.w", high, judge_stiffer_is_higher, falls),
        ("fig12b", "A", "rotational", a, f"{a}.wheel.w", low, judge_stiffer_is_higher, falls),
    )  # fmt: skip
    for id, letter, direction, part, label, shaft, judge, says in specs:
        stiffness = f"k_sw = {shaft:.0e} N/m".replace("e+0", "e")
        text = Text(
            id, f"Subsystem {letter} alone and condensed, {case.dof(label).words}, {stiffness}",
            f"Fig. {id[3:5]}, Sec. 4.3",
            f"Condensed and non-condensed subsystem {letter} FRF, in the {direction} direction",
            says,
        )  # fmt: skip
        drawing = Drawing((label, label), NARROW, shaft, part)

        def make(
            bench: FrfBench,
            text: Text = text,
            drawing: Drawing = drawing,
            judge: CondensedJudge = judge,
        ) -> Figure:
            return condensed_figure(bench, text, drawing, judge)

        yield FigureItem(id, make)


def _truncated_figures(case: PaperCase, tolerance_db: float) -> Iterator[FigureItem]:
    a, b = case.parallel.name, case.planetary.name
    except_hub = "Except for the coupling mode, leaving out modes beyond the band has no effect."
    for end, dof, words in (("a", "u", "translational"), ("b", "w", "rotational")):
        text = Text(
            f"fig13{end}", f"Subsystem B truncated, in AB: sun, {words}", "Fig. 13, Sec. 4.4",
            f"FRF of the truncated and non-truncated subsystem B: ({end}) in the {words} direction "
            "of the sun", except_hub,
        )  # fmt: skip
        yield _in_ab(text, f"{b}.sun.{dof}", tolerance_db, judge_only_the_hub_matters, True)
    text14 = Text(
        "fig14", "Subsystem B without the hub's mode, for two k_sw: sun, rotational",
        "Fig. 14, Sec. 4.4", "The FRF of truncated subsystem B",
        "The FRF of truncated B is sensitive to the shaft stiffness.",
    )  # fmt: skip
    yield FigureItem("fig14", lambda bench: other_shaft(bench, text14, f"{b}.sun.w", tolerance_db))
    for end, label, words, says, judge in (
        ("a", f"{b}.sun.w", "rotational direction of the sun",
         "No effect appears in the rotational direction.", judge_no_effect),
        ("b", case.hub, "direction of the coupling DoF",
         "The effect is observed at the coupling DoF.", judge_effect),
    ):  # fmt: skip
        text = Text(
            f"fig15{end}", f"Subsystem B alone, truncated: {words}", "Fig. 15, Sec. 4.4",
            f"The FRF of truncated modal of subsystem B without condensation: ({end}) in the "
            f"{words}", says,
        )  # fmt: skip
        yield _alone(text, label, tolerance_db, judge)
    for end, dof, words, says, judge in (
        ("a", "w", "rotational", "Some difference in frequencies with the coupling DoF truncated, "
         "and the same with all modes beyond the band.", judge_effect),
        ("b", "y", "radial", "The FRF in the radial direction is not sensitive to truncation.",
         judge_no_effect),
    ):  # fmt: skip
        text = Text(
            f"fig16{end}", f"Subsystem A in AB with B truncated: pinion, {words}",
            "Fig. 16, Sec. 4.4", f"Truncated subsystem A: ({end}) in the {words} direction", says,
        )  # fmt: skip
        yield _in_ab(text, f"{a}.pinion.{dof}", tolerance_db, judge, False)


def _in_ab(
    text: Text, label: str, tolerance_db: float, judge: TruncationJudge, one_by_one: bool
) -> FigureItem:
    return FigureItem(
        text.id,
        lambda bench: in_ab(bench, text, label, tolerance_db, judge, one_by_one=one_by_one),
    )


def _alone(text: Text, label: str, tolerance_db: float, judge: TruncationJudge) -> FigureItem:
    return FigureItem(text.id, lambda bench: alone(bench, text, label, tolerance_db, judge))

"""The whole study: what it holds, that it is strict JSON, and that no verdict is hard-coded."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fbs import CoupledFrf, Frf
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from validation.errors import CommandError
from validation.paper import PaperStudy, Verdict, bench, paper_study, printed
from validation.paper.case import PaperCase
from validation.paper.items import ITEMS
from validation.report.documents import document_text
from validation.report.provenance import provenance


def unequal_planets() -> Drivetrain:
    case = PaperCase(load("paper"))
    stage = case.planetary.model_copy(
        update={"planets": None, "planet_angles": (0.0, 80.0, 170.0, 260.0)}
    )
    return case.drivetrain.model_copy(update={"stages": (case.parallel, stage)})


def verdict(study: PaperStudy, id: str) -> str:
    return dict(study.verdicts)[id]


@pytest.fixture(scope="module")
def study() -> PaperStudy:
    return paper_study()


EXPECTED = {
    "table3": Verdict.FAILS, "table4": Verdict.FAILS,
    "fig3a": Verdict.HOLDS, "fig3b": Verdict.HOLDS, "fig4a": Verdict.HOLDS,
    "fig4b": Verdict.HOLDS, "fig5a": Verdict.HOLDS, "fig5b": Verdict.HOLDS,
    "fig6a": Verdict.HOLDS, "fig6b": Verdict.CORRECTED, "fig7": Verdict.FAILS,
    "fig8a": Verdict.CORRECTED, "fig8b": Verdict.CORRECTED, "fig8c": Verdict.FAILS,
    "fig9a": Verdict.FAILS, "fig9b": Verdict.FAILS, "fig9c": Verdict.FAILS,
    "fig10a": Verdict.CORRECTED, "fig10b": Verdict.HOLDS, "fig11a": Verdict.HOLDS,
    "fig11b": Verdict.HOLDS, "fig13a": Verdict.CORRECTED, "fig13b": Verdict.CORRECTED,
    "fig14": Verdict.FAILS, "fig15a": Verdict.FAILS, "fig15b": Verdict.HOLDS,
    "fig16a": Verdict.CORRECTED, "fig16b": Verdict.FAILS,
    "coupled-equals-full": Verdict.HOLDS, "difference-grows": Verdict.FAILS,
    "frequencies-differ": Verdict.FAILS, "new-frequency": Verdict.FAILS,
    "sun-radial": Verdict.FAILS, "h-9-10": Verdict.FAILS, "dof-13": Verdict.CORRECTED,
    "eq1": Verdict.CORRECTED, "eq7": Verdict.CORRECTED, "eq9": Verdict.CORRECTED,
    "eq15": Verdict.CORRECTED, "kernel": Verdict.CORRECTED, "eq31": Verdict.FAILS,
    "appendix-symmetry": Verdict.CORRECTED, "appendix-definite": Verdict.FAILS,
    "modes-beyond": Verdict.CORRECTED, "table3-parameters": Verdict.FAILS,
    "lin-parker": Verdict.HOLDS, "hub-unit": Verdict.HOLDS, "table2-radii": Verdict.HOLDS,
    "table1": Verdict.FAILS, "table2": Verdict.CORRECTED, "kahraman": Verdict.OPEN,
    "eq3": Verdict.CORRECTED, "eq5": Verdict.HOLDS, "eq6": Verdict.CORRECTED,
    "eq14": Verdict.CORRECTED, "eq17": Verdict.HOLDS, "eq19": Verdict.FAILS,
    "eq19-lower-left": Verdict.CORRECTED, "eq20": Verdict.HOLDS, "eq21": Verdict.CORRECTED,
    "eq22": Verdict.CORRECTED, "fig3-modes": Verdict.FAILS, "h-11": Verdict.CORRECTED,
    "unchanged-modes": Verdict.HOLDS, "second-radial": Verdict.FAILS,
    "shaft-frequencies": Verdict.HOLDS, "b-shifts-down": Verdict.FAILS,
    "peak-at-2000": Verdict.FAILS, "peak-at-70": Verdict.FAILS,
    "a-more-condensed": Verdict.HOLDS, "fig12a": Verdict.CORRECTED, "fig12b": Verdict.CORRECTED,
    "fig13-peaks": Verdict.FAILS, "a-in-b": Verdict.FAILS, "b-in-a": Verdict.FAILS,
    "b-affects-a": Verdict.CORRECTED, "outside-band": Verdict.FAILS,
    "coupling-mode": Verdict.HOLDS, "time": Verdict.CORRECTED,
    "fig6b-planet2": Verdict.CORRECTED,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("id", EXPECTED)
def test_verdicts_of_the_preset(study: PaperStudy, id: str) -> None:
    assert verdict(study, id) == EXPECTED[id]


@pytest.mark.slow
def test_everything_has_words(study: PaperStudy) -> None:
    for figure in study.of("figures"):
        shown = figure.finding.picture
        assert shown is not None, figure.id
        assert shown.frequency[0] > 0.0
        assert all(drawn.values.shape == shown.frequency.shape for drawn in shown.curves)
    for item in study.items:
        assert item.evidence, item.id
        assert item.place, item.id
        assert np.isfinite(list(item.finding.numbers.values())).all(), item.id
    assert all(item.finding.numbers for item in study.of())


@pytest.mark.slow
def test_json_is_strict_and_whole(study: PaperStudy) -> None:
    data = json.loads(document_text(study.document(provenance())))
    kinds = [data[kind] for kind in ("tables", "figures", "claims")]
    assert sum(map(len, kinds)) == len(study.items) == len(ITEMS)
    assert len(data["verdicts"]) == len(study.verdicts)


def test_only_one_item() -> None:
    study = paper_study("fig8")
    assert [item.id for item in study.items] == ["fig8a", "fig8b", "fig8c"]
    for nothing in ("fig1", "fig99"):  # no beginning of fig10
        with pytest.raises(CommandError, match="no such item"):
            paper_study(nothing)
    with pytest.raises(CommandError, match="more than 0 dB"):
        paper_study("fig3a", tolerance_db=0.0)


def test_progress_tells_every_item() -> None:
    seen: list[tuple[str, int, int]] = []
    paper_study("fig3", progress=lambda name, done, total: seen.append((name, done, total)))
    assert seen == [("fig3a", 0, 2), ("fig3b", 1, 2), ("done", 2, 2)]


def test_every_item_is_expected_to_be_something() -> None:
    assert set(EXPECTED) == {each.id for each in ITEMS}


def test_names_are_unique() -> None:
    assert len({each.id for each in ITEMS}) == len(ITEMS)


def test_unequal_planets_let_the_hub_move_the_sun_sideways() -> None:
    study = paper_study("fig7", preset=unequal_planets())
    assert verdict(study, "fig7") == Verdict.HOLDS
    assert verdict(paper_study("fig7"), "fig7") == Verdict.FAILS


def test_a_stiffer_shaft_parts_a_from_itself() -> None:
    stiff = PaperCase(load("paper")).with_shaft(1e7).drivetrain
    assert verdict(paper_study("fig10a", preset=stiff), "fig10a") == Verdict.FAILS
    assert verdict(paper_study("fig10a"), "fig10a") == Verdict.CORRECTED


def test_a_loose_tolerance_lets_modes_go() -> None:
    assert verdict(paper_study("fig13b", tolerance_db=20.0), "fig13b") == Verdict.HOLDS
    assert verdict(paper_study("fig13b"), "fig13b") == Verdict.CORRECTED


def test_a_heavy_hub_moves_the_global_mode() -> None:
    heavy = PaperCase(load("paper")).with_hub(0.58).drivetrain
    first, second = (paper_study("fig10b", preset=preset) for preset in (None, heavy))
    assert first.items[0].evidence != second.items[0].evidence


def test_a_wrong_coupling_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """With Eq. (15)'s printed sign, H between the stages turns, drive points do not."""

    def as_printed(stages: dict[str, Frf], joints: object) -> CoupledFrf:
        a, b = stages.values()
        values, labels = printed.coupled_receptance(a, b, "coupling.w")
        frf = Frf(a.frequency, 1.01 * values, labels, labels)
        return CoupledFrf(frf, np.ones(len(a.frequency)), ())

    monkeypatch.setattr(bench, "couple", as_printed)
    study = paper_study("fig5b")
    assert verdict(study, "fig5b") == Verdict.FAILS
    shown = study.items[0].finding.picture
    assert shown is not None
    assert shown.differences[-1].worst_db == pytest.approx(0.0864, abs=1e-3)
    assert not study.agrees


def test_lines_on_poles_are_moved_and_named() -> None:
    found = bench.axis(bench.PaperBand(40.0, 10.0), np.array([0.0, 20.0]))
    assert found.frequency.tolist() == [10.0, 20.01, 30.0, 40.0]
    assert "20.01 Hz" in found.note

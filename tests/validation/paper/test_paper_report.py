"""`crosscheck paper`: one page that needs nothing else, one JSON file, exit codes, bad input."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.validation.command_line import call
from tests.validation.crosscheck.test_report import XML_NAMESPACES, Tags, text_of
from validation.errors import CommandError
from validation.paper import PaperStudy, RowVerdict, Verdict, paper_study
from validation.paper import options as paper_input
from validation.paper.agreement import compares_routes, route_checks
from validation.paper.page import write_paper_report
from validation.paper.page_tables import decibel, heat_table, locked_frequencies
from validation.paper.page_text import sentence, typeset
from validation.paper.results import Claim, LockedCheck, StiffnessRow
from validation.paper.truncation_results import SmallestBasis, TruncationRow, TruncationStudy

UNSAFE = '<script>alert("1")</script> & more'


@pytest.fixture(scope="module")
def study() -> PaperStudy:
    """A figure of three parts, a table, condensation and stiffness, with made-up claims."""
    parts = {only: paper_study(only) for only in ("fig8", "fig7", "table3")}
    return replace(
        parts["fig8"],
        figures=(*parts["fig7"].figures, *parts["fig8"].figures),
        tables=parts["table3"].tables,
        condensation=paper_study("condensation").condensation,
        stiffness=paper_study("stiffness").stiffness,
        truncation=truncation(),
        claims=tuple(claim(f"claim-{verdict.name}", verdict) for verdict in Verdict),
    )


def claim(name: str, verdict: Verdict) -> Claim:
    return Claim(name, UNSAFE, UNSAFE, "Sec. 1", UNSAFE, verdict, UNSAFE, {"number": math.nan})


def truncation() -> TruncationStudy:
    def row(left_out: int, order: int | None, error: float) -> TruncationRow:
        values = {"hub": error, "zero": math.nan}
        return TruncationRow(
            left_out,
            False,
            9 - left_out,
            order,
            values,
            values,
            values,
            {"hub": 0.0},
            {"hub": 0.99},
        )

    return TruncationStudy(
        4000.0, 0.01,
        (row(0, None, 0.0), row(0, 0, 0.0), row(1, None, 4.0), row(1, 0, 0.04)),
        0.1, (SmallestBasis(None, None, math.nan, math.nan), SmallestBasis(0, 8, 4e3, 0.04)),
        5000.0, ((0, 0.1, None), (1, 0.06, 0.6)), 0.64, "A note.",
    )  # fmt: skip


def read(study: PaperStudy, directory: Path) -> tuple[str, Any]:
    """The written page, and the results as strict JSON."""
    html, data = write_paper_report(study, directory)
    return html.read_text(encoding="utf-8"), strict(data)


def strict(path: Path) -> Any:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


@pytest.fixture(scope="module")
def written(study: PaperStudy, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Any]:
    return read(study, tmp_path_factory.mktemp("paper"))


# --- the page -------------------------------------------------------------------------------


def test_page_needs_nothing_but_itself(written: tuple[str, Any]) -> None:
    html, _ = written
    assert set(re.findall(r"https?://[^\s\"'<>)]*", html)) <= XML_NAMESPACES
    assert "@import" not in html
    tags = Tags(html)
    assert tags.open == []
    assert not {name for name, _ in tags.tags} & {"script", "link", "img", "iframe", "object"}
    ids = [attributes["id"] for _, attributes in tags.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = [attributes.get(k) for _, attributes in tags.tags for k in ("href", "xlink:href")]
    assert all(target[1:] in ids for target in targets if target is not None)


def test_page_escapes_what_it_is_given(written: tuple[str, Any]) -> None:
    assert "alert(" in written[0]
    assert "<script" not in written[0]
    assert "&amp;amp;" not in written[0]


def test_every_verdict_has_its_chip(written: tuple[str, Any], study: PaperStudy) -> None:
    html, _ = written
    articles = re.findall(r'<article class="claim (\w+)" id="([^"]*)">(.*?)</article>', html, re.S)
    assert [name for _, name, _ in articles] == [f"claim-{c.id}" for c in study.claims]
    for (look, _, article), made in zip(articles, study.claims, strict=True):
        assert re.search(rf'<span class="pill {look}">. {made.verdict}</span>', article)
    figures = re.findall(r"<figure class=.*?</figure>", html, re.S)
    for figure, part in zip(study.figures, figures, strict=True):
        assert f" {figure.verdict}</span>" in part
        assert unescape(str(typeset(figure.title))) in unescape(part)
    rows = re.findall(r'<tr class="(holds|corrected|fails)">', html)
    assert len(rows) == len(study.tables[0].rows)
    missed = sum(row.verdict == RowVerdict.MISSED for row in study.tables[0].rows)
    assert rows.count("fails") == missed > 0


def test_page_says_what_was_found(written: tuple[str, Any], study: PaperStudy) -> None:
    text = text_of(written[0])
    for check in study.condensation:
        assert text_of(str(typeset(locked_frequencies(check)))) in text
    for row in study.tables[0].rows:
        assert f"{row.number} {row.printed} {row.column} {row.kind}" in text
        for found in row.found.values():
            assert f"{found.frequency_hz:.1f}" in text
    for mode in study.tables[0].missing:
        assert f"{mode.frequency_hz:.1f}" in text
    for section in ("Claims", "Figures", "Dynamic condensation", "Modal truncation", "Routes"):
        assert section in text


def test_pictures_are_vector_with_their_curves_named(
    written: tuple[str, Any], study: PaperStudy
) -> None:
    pictures = re.findall(r"<svg.*?</svg>", written[0], re.S)
    assert len(pictures) == len(study.figures)
    for figure, picture in zip(study.figures, pictures, strict=True):
        assert f'aria-label="{figure.place}: ' in picture
        assert "<image" not in picture
        for curve in figure.curves:
            assert curve.name in picture
        for kind in {mark.kind for mark in figure.resonances}:
            assert kind in picture


# --- paper.json -----------------------------------------------------------------------------


def test_json_holds_every_line_and_verdict(written: tuple[str, Any], study: PaperStudy) -> None:
    _, data = written
    assert [v["verdict"] for v in data["verdicts"]] == [str(v) for _, v in study.verdicts]
    for figure, stored in zip(study.figures, data["figures"], strict=True):
        assert len(stored["frequency"]) == len(figure.frequency)
        values = stored["curves"][0]["values"]
        np.testing.assert_allclose(
            np.array(values["real"]) + 1j * np.array(values["imag"]),
            figure.curves[0].values,
            rtol=1e-8,
        )
    assert data["claims"][0]["numbers"]["number"] is None
    assert all(check["agrees"] for check in data["route_checks"])
    assert data["versions"]["exudyn"]


# --- routes against each other --------------------------------------------------------------


def test_routes_of_the_study_agree(study: PaperStudy) -> None:
    checks = route_checks(study)
    assert {check.routes for check in checks} >= {
        ("exudyn", "equations"),
        ("exudyn", "FBS of exudyn stages"),
        ("exudyn, locked", "blocked matrices"),
    }
    assert all(check.agrees for check in checks)
    assert all(compares_routes(figure) for figure in study.figures)


def wrong_parts(study: PaperStudy) -> Iterator[PaperStudy]:
    figure = study.figures[0]
    first, *others = figure.differences
    wrong = (replace(first, worst_scaled=1e-3), *others)
    yield replace(study, figures=(replace(figure, differences=wrong),))
    locked: LockedCheck = replace(study.condensation[0], matrix_error=math.nan)
    yield replace(study, condensation=(*study.condensation[1:], locked))
    row: StiffnessRow = replace(study.stiffness[-1], routes_scaled=1e-6)
    yield replace(study, stiffness=(*study.stiffness, row))


def test_a_wrong_route_is_seen_and_said(study: PaperStudy, tmp_path: Path) -> None:
    for wrong in wrong_parts(study):
        assert sum(not check.agrees for check in route_checks(wrong)) == 1
    html, _ = read(replace(wrong, figures=(), tables=(), claims=()), tmp_path)
    assert "✗ The routes of this study disagree" in html


# --- tables and words -----------------------------------------------------------------------


def test_heat_table_is_darker_the_further_beyond_the_tolerance() -> None:
    table = heat_table(truncation())
    assert [row.kept for row in table.rows] == [9, 8]
    assert [cell.text for cell in table.rows[1].cells] == ["4", "H = 0", "0.040", "H = 0"]
    assert [cell.shade for cell in table.rows[1].cells] == [4, 0, 0, 0]
    assert [cell.shade for cell in table.rows[0].cells] == [0, 0, 0, 0]


@pytest.mark.parametrize(
    ("value", "words"), [(0.0, "0"), (1e-9, "<.001"), (0.05, "0.050"), (0.5, "0.5"), (43.2, "43")]
)
def test_decibels_in_few_characters(value: float, words: str) -> None:
    assert decibel(value) == words


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("k_sw = 1e+05 N/m", "k<sub>sw</sub> = 1e5 N/m"),
        ("A_H_cc + A_H + K_s⁻¹", "<sup>A</sup>H<sub>cc</sub> + <sup>A</sup>H + K<sub>s</sub>⁻¹"),
        ("[H]_ab is 2.5e-13, H_9,10 0.0e+00", "[H]<sub>ab</sub> is 2.5e−13, H<sub>9,10</sub> 0.0"),
        ("the sun's u_s < -28.9 Hz", "the sun’s u<sub>s</sub> &lt; −28.9 Hz"),
        ("Figs. 5-7, sub_system", "Figs. 5-7, sub_system"),
    ],
)
def test_text_is_typeset_and_escaped(text: str, html: str) -> None:
    assert typeset(text) == html


def test_sentences_leave_symbols_and_names_small() -> None:
    assert sentence("the sun") == "The sun."
    assert sentence("exudyn agrees.") == "exudyn agrees."
    assert sentence("k_sw rises") == "k<sub>sw</sub> rises."


# --- the command ----------------------------------------------------------------------------


def test_only_one_figure_with_its_parts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("paper", "--only", "fig8", "--out", str(tmp_path)) == 0
    data = strict(tmp_path / "paper.json")
    assert [figure["id"] for figure in data["figures"]] == ["fig8a", "fig8b", "fig8c"]
    assert data["claims"] == []
    assert data["tables"] == []
    printed = capsys.readouterr().out
    assert "fig8c" in printed
    assert "does not hold" in printed
    assert max(map(len, printed.splitlines())) <= 160
    assert str(tmp_path / "paper.html") in printed
    assert sorted(p.name for p in tmp_path.iterdir()) == ["paper.html", "paper.json"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--only", "fig17"], ["--only", "'fig17'", "nearest", "fig7", "table3"]),
        (["--only", "truncated"], ["nearest: truncation"]),
        (["--only", ""], ["--only", "fig3", "claims"]),
        (["--tolerance", "abc"], ["--tolerance", "'abc'", "0.1dB"]),
        (["--tolerance", "-1dB"], ["'-1dB'", "above 0"]),
        (["--tolerance", "0"], ["'0'", "above 0"]),
        (["--tolerance", "nan"], ["above 0"]),
        (["--tolerance", "inf dB"], ["above 0"]),
    ],
)
def test_bad_input_is_one_message(
    arguments: list[str], words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("paper", *arguments, "--out", str(tmp_path / "out")) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("crosscheck: ")
    assert printed.err.count("\n") == 1
    assert all(word in printed.err for word in words)
    assert printed.out == ""
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["0.1dB", "0.1 dB", "0.1", " 1e-1 DB "])
def test_tolerance_with_or_without_its_unit(text: str) -> None:
    assert paper_input.decibels("--tolerance", text) == 0.1


@pytest.mark.parametrize(("text", "name"), [("Fig. 8", "fig8"), ("Table 3", "table3")])
def test_items_as_a_reader_writes_them(text: str, name: str) -> None:
    assert paper_input.item("--only", text) == name
    with pytest.raises(CommandError):
        paper_input.item("--only", "fig")


def test_disagreeing_routes_end_in_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.paper.agreement.FRF_TOLERANCE", -1.0)
    monkeypatch.setattr("validation.paper.agreement._worst.__defaults__", (-1.0, "scaled error"))
    assert call("paper", "--only", "fig5a", "--out", str(tmp_path)) == 1
    assert "The routes DISAGREE" in capsys.readouterr().out


def test_earlier_files_stay_where_new_ones_cannot_be_written(
    study: PaperStudy, tmp_path: Path
) -> None:
    (tmp_path / "paper.html").write_text("earlier", encoding="utf-8")
    (tmp_path / "paper.json").mkdir()
    with pytest.raises(CommandError, match=r"paper\.json: cannot be written: it is a directory"):
        write_paper_report(replace(study, figures=()), tmp_path)
    assert (tmp_path / "paper.html").read_text(encoding="utf-8") == "earlier"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["paper.html", "paper.json"]


@pytest.mark.slow
def test_all_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("paper", "--out", str(tmp_path)) == 0
    html = (tmp_path / "paper.html").read_text(encoding="utf-8")
    data = strict(tmp_path / "paper.json")
    assert len(html) < 8e6
    assert html.count('<article class="claim ') == len(data["claims"]) > 20
    assert html.count("<svg") == len(data["figures"]) > 25
    for number in range(3, 17):
        assert f'id="figure-{number}"' in html
    printed = capsys.readouterr().out
    for verdict in data["verdicts"]:
        assert " row " in verdict["id"] or verdict["id"] in printed

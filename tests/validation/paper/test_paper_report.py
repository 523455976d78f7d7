"""`crosscheck paper`: one page that needs nothing else, one JSON file, exit codes, bad input."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from tests.validation.command_line import call
from tests.validation.crosscheck.test_report import XML_NAMESPACES, Tags, text_of
from validation.checks.check import Check
from validation.errors import CommandError
from validation.paper import PaperStudy, RowVerdict, Verdict, paper_study
from validation.paper.command import decibels
from validation.paper.console import print_result
from validation.paper.figures import route_checks
from validation.paper.item import Finding, Item
from validation.paper.items import picked
from validation.paper.result import worst_checks
from validation.paper.truncation import decibel
from validation.paper.typeset import sentence, typeset
from validation.report.publish import publish

UNSAFE = '<script>alert("1")</script> & more'


@pytest.fixture(scope="module")
def study() -> PaperStudy:
    """A figure of three parts, one of one, a table, equations, with made-up claims."""
    parts = [paper_study(only) for only in ("fig7", "fig8", "table3", "eq31")]
    items = [item for part in parts for item in part.items]
    return replace(parts[0], items=(*items, *(made_up(verdict) for verdict in Verdict)))


def made_up(verdict: Verdict) -> Item:
    found = Finding(verdict, UNSAFE, {"number": math.nan})
    return Item(f"made-{verdict.name}", UNSAFE, "claims", "Sec. 1", UNSAFE, UNSAFE, found)


def read(study: PaperStudy, directory: Path) -> tuple[str, Any]:
    """The written page, and the results as strict JSON."""
    html, data = publish(study, directory)
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


def test_every_item_has_its_verdict(written: tuple[str, Any], study: PaperStudy) -> None:
    html, _ = written
    for item in study.items:
        start = html.index(
            f'id="{"" if item.subject in ("tables", "figures") else "claim-"}{item.id}"'
        )
        pill = re.search(r'<span class="pill (\w+)">. ([^<]*)</span>', html[start:])
        assert pill is not None, item.id
        assert pill[2] == item.verdict, item.id
    rows = re.findall(r'<tr class="(corrected|fails)">', html)
    missed = sum(row.verdict == RowVerdict.MISSED for row in rows_of(study))
    assert rows.count("fails") == missed > 0


def rows_of(study: PaperStudy) -> Any:
    return study.item("table3").finding.details["rows"]


def test_page_says_what_was_found(written: tuple[str, Any], study: PaperStudy) -> None:
    text = text_of(written[0])
    for item in study.items:
        assert text_of(str(sentence(item.evidence))) in text
    for check in study.item("eq31").finding.details["condensation"]:
        assert check.listed in text
    for row in rows_of(study):
        assert f"{row.number} {row.printed} {row.column}" in text
        for found in row.found.values():
            assert f"{found.frequency_hz:.1f}" in text
    for mode in study.item("table3").finding.details["missing"]:
        assert f"{mode.frequency_hz:.1f}" in text


def test_pictures_are_vector_with_their_curves_named(
    written: tuple[str, Any], study: PaperStudy
) -> None:
    pictures = re.findall(r"<svg.*?</svg>", written[0], re.S)
    figures = study.of("figures")
    assert len(pictures) == len(figures)
    for figure, picture in zip(figures, pictures, strict=True):
        shown = figure.finding.picture
        assert shown is not None
        assert f'aria-label="{figure.place}: ' in picture
        assert "<image" not in picture
        for curve in shown.curves:
            assert curve.name in picture
        for kind in {mark.kind for mark in shown.resonances}:
            assert kind in picture


# --- paper.json -----------------------------------------------------------------------------


def test_json_holds_every_line_and_verdict(written: tuple[str, Any], study: PaperStudy) -> None:
    _, data = written
    assert [v["verdict"] for v in data["verdicts"]] == [str(v) for _, v in study.verdicts]
    for figure, stored in zip(study.of("figures"), data["figures"], strict=True):
        shown = figure.finding.picture
        assert shown is not None
        assert len(stored["frequency"]) == len(shown.frequency)
        values = stored["curves"][0]["values"]
        np.testing.assert_allclose(
            np.array(values["real"]) + 1j * np.array(values["imag"]),
            shown.curves[0].values,
            rtol=1e-8,
        )
    assert data["claims"][-1]["numbers"]["number"] is None
    assert all(check["agrees"] for check in data["route_checks"])
    assert data["versions"]["exudyn"]


# --- routes against each other --------------------------------------------------------------


def test_routes_of_the_study_agree(study: PaperStudy) -> None:
    assert {check.routes for check in study.checks} >= {
        ("exudyn", "equations"),
        ("exudyn", "FBS of exudyn stages"),
        ("exudyn, locked", "blocked matrices"),
    }
    assert study.agrees


def test_a_wrong_route_is_seen_and_said(study: PaperStudy, tmp_path: Path) -> None:
    figure = study.items[0]
    shown = figure.finding.picture
    assert shown is not None
    first, *others = shown.differences
    wrong = replace(shown, differences=(replace(first, worst_scaled=1e-3), *others))
    finding = replace(figure.finding, checks=route_checks(figure.id, wrong, same=2), picture=None)
    spoilt = replace(study, items=(replace(figure, finding=finding),))
    assert [check.agrees for check in spoilt.checks] == [False, True]
    html, _ = read(spoilt, tmp_path)
    assert "✗ The routes of this study disagree" in html
    assert figure.id in text_of(html)


@pytest.mark.parametrize("values", [(1e-3, math.nan), (math.nan, 1e-3), (1e-3, 1e-12)])
def test_the_worst_of_a_pair_of_routes_is_kept(values: tuple[float, float]) -> None:
    checks = [Check("a", "b", ("x", "y"), "c", v, 1e-9, "r", note=f"{v}") for v in values]
    (kept,) = worst_checks(checks)
    assert not kept.agrees
    assert kept.findings == (kept.note,)
    assert math.isnan(kept.value) == any(map(math.isnan, values))


# --- tables and words -----------------------------------------------------------------------


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
    assert decibels("--tolerance", text) == 0.1


@pytest.mark.parametrize(("text", "name"), [("Fig. 8", "fig8"), ("Table 3", "table3")])
def test_items_as_a_reader_writes_them(text: str, name: str) -> None:
    assert {each.id.rstrip("abc") for each in picked(text)} == {name}
    with pytest.raises(CommandError):
        picked("fig")


@pytest.mark.parametrize("columns", ["60", "80", "200"])
def test_evidence_is_wrapped_and_whole(
    columns: str, study: PaperStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    stream = StringIO()
    print_result(study, Console(file=stream, width=int(columns)))
    printed = stream.getvalue()
    assert "…" not in printed
    words = " ".join(printed.split())
    for item in study.items:
        assert " ".join(item.evidence.split()) in words
    indented = [line for line in printed.splitlines() if line.startswith("    ")]
    assert max(map(len, indented)) <= int(columns)


def test_disagreeing_routes_end_in_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.paper.figures.FRF_TOLERANCE", -1.0)
    assert call("paper", "--only", "fig5a", "--out", str(tmp_path)) == 1
    assert "The routes of this study DISAGREE" in capsys.readouterr().out


def test_earlier_files_stay_where_new_ones_cannot_be_written(
    study: PaperStudy, tmp_path: Path
) -> None:
    (tmp_path / "paper.html").write_text("earlier", encoding="utf-8")
    (tmp_path / "paper.json").mkdir()
    with pytest.raises(CommandError, match=r"paper\.json: cannot be written: it is a directory"):
        publish(replace(study, items=()), tmp_path)
    assert (tmp_path / "paper.html").read_text(encoding="utf-8") == "earlier"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["paper.html", "paper.json"]


@pytest.mark.slow
def test_all_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("paper", "--out", str(tmp_path)) == 0
    html = (tmp_path / "paper.html").read_text(encoding="utf-8")
    data = strict(tmp_path / "paper.json")
    assert len(html) < 8e6
    assert html.count('id="claim-') == len(data["claims"]) > 20
    assert html.count("<svg") == len(data["figures"]) > 25
    for number in range(3, 17):
        assert f'id="figure-{number}"' in html
    printed = capsys.readouterr().out
    for verdict in data["verdicts"]:
        assert " row " in verdict["id"] or verdict["id"] in printed

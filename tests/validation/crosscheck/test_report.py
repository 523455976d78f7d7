"""The report: self-contained, complete, whole or not written, and clear about disagreement."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pytest

from fbs.files.whole_files import written_whole
from mbs_models.model.model_file import dumps, load, loads
from mbs_models.model.parameters import Drivetrain, ParallelStage
from validation.crosscheck.describe import describe_dof
from validation.crosscheck.result import CrossCheck
from validation.crosscheck.study import cross_check
from validation.report.curves import extremes, largest
from validation.report.digits import scientific
from validation.report.publish import publish
from validation.routes.bands import Band
from validation.routes.source import equations_source
from validation.runtime.output_folder import ReportError

BAND = Band(30.0, 15000.0, 30.0)
XML_NAMESPACES = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


@pytest.fixture(scope="module")
def agreeing() -> CrossCheck:
    return cross_check(load("paper"), BAND)


@pytest.fixture(scope="module")
def disagreeing() -> CrossCheck:
    return cross_check(
        load("paper"), BAND, equations=lambda train: equations_source(stiffer_bearing(train))
    )


def stiffer_bearing(drivetrain: Drivetrain) -> Drivetrain:
    """The pinion's bearing 1 % stiffer."""
    first, *others = drivetrain.stages
    assert isinstance(first, ParallelStage)
    assert first.pinion.bearing_y is not None
    pinion = first.pinion.model_copy(update={"bearing_y": 1.01 * first.pinion.bearing_y})
    return drivetrain.model_copy(
        update={"stages": (first.model_copy(update={"pinion": pinion}), *others)}
    )


@pytest.fixture(scope="module")
def written(agreeing: CrossCheck, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Any]:
    return read(agreeing, tmp_path_factory.mktemp("report"))


def read(result: CrossCheck, directory: Path) -> tuple[str, Any]:
    """The written report, and the results as strict JSON."""
    html, results, _ = publish(result, directory)

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return (
        html.read_text(encoding="utf-8"),
        json.loads(results.read_text(encoding="utf-8"), parse_constant=refuse),
    )


def text_of(html: str) -> str:
    """What a reader sees."""
    body = re.sub(r"<(style|svg)\b.*?</\1>", " ", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]*>", " ", body)))


class Tags(HTMLParser):
    """Start tags with their attributes, and whether all that need an end have one."""

    VOID = frozenset({"meta", "br", "link", "img", "input", "hr"})

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


# --- report.html ----------------------------------------------------------------------------


def test_report_needs_nothing_but_itself(written: tuple[str, Any]) -> None:
    html, _ = written
    assert set(re.findall(r"https?://[^\s\"'<>)]*", html)) <= XML_NAMESPACES
    assert "@import" not in html
    parsed = Tags(html)
    assert parsed.open == []
    names = {tag for tag, _ in parsed.tags}
    assert not names & {"script", "link", "img", "iframe", "object"}
    ids = [attributes["id"] for _, attributes in parsed.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    for tag, attributes in parsed.tags:
        for key in ("href", "xlink:href"):
            target = attributes.get(key)
            own = "data:image/png;base64," if tag == "image" else "#"
            assert target is None or target.startswith(own)
            assert tag == "image" or target is None or target[1:] in ids


def test_report_says_what_was_checked_and_that_it_agrees(
    written: tuple[str, Any], agreeing: CrossCheck
) -> None:
    text = text_of(written[0])
    drivetrain = agreeing.drivetrain
    assert drivetrain.name in text
    assert drivetrain.source in text
    assert "✓ All routes agree" in text
    assert "disagree" not in text.split("1 Verdicts")[1].split("2 Modes")[0]
    assert "900 × 500" in text.replace("\u202f", " ")
    for check in agreeing.checks:
        assert check.name in text
        assert check.reason in text
    for route in ("exudyn", "equations", "FBS of exudyn stages", "FBS of equations stages"):
        assert route in text
    for kind in ("rigid-body", "rotational", "translational", "planet", "parallel stage"):
        assert kind in text
    assert "never trusted alone" in text
    assert dumps(drivetrain) in unescape(written[0])


def test_report_has_every_figure(written: tuple[str, Any], agreeing: CrossCheck) -> None:
    labels = re.findall(r'<svg role="img" aria-label="([^"]*)"', written[0])
    for response, excitation in agreeing.curves:
        assert f"FRF {response} over {excitation} by every route" in labels
    for words in ("Energy shares", "Scaled error over", "Largest scaled error", "Conditioning"):
        assert any(label.startswith(words) for label in labels)


def test_disagreement_names_routes_and_dofs(disagreeing: CrossCheck, tmp_path: Path) -> None:
    html, results = read(disagreeing, tmp_path)
    text = text_of(html)
    headline = (
        r"Routes disagree: exudyn and equations, stiffness at reducer\.pinion\.y: 5\.5e8 "
        r"against 5\.535e8 N/m"
    )
    assert re.search(headline, text)
    assert re.search(headline, results["verdict"])
    assert results["agrees"] is False
    assert "exudyn ↔ FBS of equations stages" in text.split("1 Verdicts")[0]
    assert "✗ disagrees" in text
    for check in disagreeing.checks:
        assert all(finding in text for finding in check.findings)


def test_a_stage_alone_has_no_coupling_to_report(tmp_path: Path) -> None:
    result = cross_check(load("lin-parker-4"), BAND, published="lin-parker-4")
    html, results = read(result, tmp_path)
    assert "Conditioning of the interface kernel" not in html
    assert results["kernel_condition"] is None
    assert "Lin & Parker 1999" in text_of(html)


def test_stages_left_apart_warn_and_their_zero_frfs_are_no_number_to_hide(tmp_path: Path) -> None:
    paper = load("paper")
    apart = paper.couplings[0].model_copy(update={"second_stiffness": 0.0})
    drivetrain = paper.model_copy(update={"couplings": (apart,)})
    html, results = read(cross_check(drivetrain, BAND), tmp_path)
    assert "⚠ Warning" in text_of(html)
    assert results["warnings"] == list(drivetrain.warnings())
    assert results["warnings"]
    through = results["curves"][-1]["routes"]["equations"]
    assert through["largest_relative_difference"] is None
    assert any("relative_difference" in note and "NaN" in note for note in results["notes"])


def test_names_are_escaped(agreeing: CrossCheck, tmp_path: Path) -> None:
    paper = agreeing.drivetrain
    drivetrain = paper.model_copy(
        update={"name": "<script>alert(1)</script>", "source": 'A & B, "C" <i>'}
    )
    check = replace(agreeing.checks[0], value=1.0, findings=("<b>here</b>",))
    result = replace(
        agreeing, drivetrain=drivetrain, checks=(check,), warnings=("<img src=x onerror=y>",)
    )
    html, results = read(result, tmp_path)
    assert not {tag for tag, _ in Tags(html).tags} & {"script", "img"}
    assert "&lt;script&gt;" in html
    assert "<b>here" not in html
    assert "A &amp; B" in html
    assert results["model"] == "<script>alert(1)</script>"


# --- results.json ---------------------------------------------------------------------------


def test_results_hold_every_number(written: tuple[str, Any], agreeing: CrossCheck) -> None:
    _, results = written
    assert results["schema_version"] == 1
    assert results["agrees"] is True
    assert results["verdict"] == "All routes agree"
    assert results["notes"] == []
    assert {"python", "exudyn", "numpy", "scipy", "matplotlib", "drivetrain-crosscheck"} <= set(
        results["versions"]
    )
    assert results["timings_s"] == dict(agreeing.timings)
    assert Drivetrain.model_validate_json(json.dumps(results["parameters"])) == agreeing.drivetrain
    for ours, check in zip(results["checks"], agreeing.checks, strict=True):
        for key in ("name", "subject", "measure", "value", "tolerance", "reason", "agrees", "note"):
            assert ours[key] == getattr(check, key)
        assert tuple(ours["routes"]) == check.routes
        assert tuple(ours["findings"]) == check.findings
    for row, mode, pole in zip(results["modes"], agreeing.modes.modes, agreeing.poles, strict=True):
        assert row["kind"] == mode.kind
        assert row["frequency_hz"] == pole.frequency_hz
        assert row["kinetic_shares"] == mode.shares.kinetic
        assert row["strain_shares"] == mode.shares.strain


def test_arrays_hold_every_line_in_full(agreeing: CrossCheck, tmp_path: Path) -> None:
    _, _, path = publish(agreeing, tmp_path)
    with np.load(path, allow_pickle=False) as file:
        arrays = dict(file)
    np.testing.assert_array_equal(arrays["frequency_hz"], agreeing.frequency)
    np.testing.assert_array_equal(arrays["round_off"], agreeing.round_off)
    np.testing.assert_array_equal(arrays["kernel_condition"], agreeing.kernel_condition)
    assert tuple(arrays["dofs"]) == agreeing.dofs
    routes = list(arrays["routes"])
    assert routes[0] == agreeing.reference
    for number, comparison in enumerate(agreeing.comparisons):
        assert routes[number + 1] == comparison.route
        np.testing.assert_array_equal(arrays["line_max"][number], comparison.line_max)
        np.testing.assert_array_equal(arrays["line_median"][number], comparison.line_median)
        np.testing.assert_array_equal(arrays["pair_max"][number], comparison.pair_max)
    names = zip(arrays["curve_response"], arrays["curve_excitation"], strict=True)
    assert list(names) == list(agreeing.curves)
    for curves, by_route in zip(
        arrays["receptance_m_per_n"], agreeing.curves.values(), strict=True
    ):
        for route, values in zip(routes, curves, strict=True):
            np.testing.assert_array_equal(values, by_route[route])


def test_results_sum_up_every_curve(written: tuple[str, Any], agreeing: CrossCheck) -> None:
    _, results = written
    for ours, comparison in zip(results["comparisons"], agreeing.comparisons, strict=True):
        assert ours["route"] == comparison.route
        assert ours["worst"]["scaled_error"] == comparison.line_max.max()
        assert ours["median_line"] == np.median(comparison.line_max)
    for ours, (pair, by_route) in zip(results["curves"], agreeing.curves.items(), strict=True):
        assert (ours["response"], ours["excitation"]) == pair
        reference = by_route[agreeing.reference]
        size = np.abs(reference)
        assert ours["largest_m_per_n"] == size.max()
        assert ours["largest_at_hz"] == agreeing.frequency[size.argmax()]
        assert ours["smallest_m_per_n"] == size.min()
        assert set(ours["routes"]) == set(by_route) - {agreeing.reference}
        for route, found in ours["routes"].items():
            difference = np.abs(by_route[route] - reference) / size
            assert found["largest_relative_difference"] == difference.max()
            assert found["frac"] == pytest.approx(1.0, abs=1e-12)


def test_what_is_no_number_is_null_and_named(agreeing: CrossCheck, tmp_path: Path) -> None:
    checks = (
        replace(agreeing.checks[0], value=np.nan),
        replace(agreeing.checks[1], value=np.inf),
        *agreeing.checks[2:],
    )
    kernel = agreeing.kernel_condition.copy()
    kernel[3] = np.inf
    html, results = read(replace(agreeing, checks=checks, kernel_condition=kernel), tmp_path)
    assert results["checks"][0]["value"] is None
    assert results["kernel_condition"] == {"largest": None, "frequency_hz": 120.0}
    assert results["notes"] == [
        "checks[0].value is NaN; written as null",
        "checks[1].value is Infinity; written as null",
        "kernel_condition.largest is Infinity; written as null",
    ]
    assert "not a number" in text_of(html)


# --- files ----------------------------------------------------------------------------------


def test_directories_are_made_and_nothing_else_is_left(
    agreeing: CrossCheck, tmp_path: Path
) -> None:
    written = publish(agreeing, tmp_path / "some" / "where")
    names = ["report.html", "results.json", "results.npz"]
    assert [path.name for path in written] == names
    assert sorted((tmp_path / "some" / "where").iterdir()) == list(written)


def test_an_error_while_rendering_leaves_the_old_report(
    agreeing: CrossCheck, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("report.html", "results.json"):
        (tmp_path / name).write_text("old")

    def fail(*_: object) -> str:
        raise RuntimeError("rendering failed")

    monkeypatch.setattr("validation.crosscheck.document.results_document", fail)
    with pytest.raises(RuntimeError, match="rendering failed"):
        publish(agreeing, tmp_path)
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {
        "report.html": "old",
        "results.json": "old",
    }


def test_a_full_disk_leaves_the_old_report(
    agreeing: CrossCheck, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "report.html").write_text("old")

    @contextmanager
    def filling(path: Path) -> Iterator[BinaryIO]:
        with written_whole(path) as file:
            yield file
            if path.name == "results.npz":
                raise OSError(28, "No space left on device")

    monkeypatch.setattr("validation.runtime.output_folder.written_whole", filling)
    monkeypatch.setattr("validation.report.publish.page_html", lambda *_: "new")
    with pytest.raises(ReportError, match="cannot be written: No space left on device"):
        publish(agreeing, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "old"


@pytest.mark.parametrize("below", ["", "deeper"])
def test_a_file_is_no_directory(
    agreeing: CrossCheck, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, below: str
) -> None:
    monkeypatch.setattr("validation.report.publish.page_html", lambda *_: "new")
    (tmp_path / "taken").write_text("")
    with pytest.raises(ReportError, match=r"taken.*file; give a directory"):
        publish(agreeing, tmp_path / "taken" / below)


def test_a_directory_is_no_file(
    agreeing: CrossCheck, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.report.publish.page_html", lambda *_: "new")
    (tmp_path / "results.json").mkdir()
    with pytest.raises(ReportError, match=r"results\.json: cannot be written: it is a directory"):
        publish(agreeing, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["results.json"]


# --- words and numbers ----------------------------------------------------------------------


def test_columns_keep_peaks_and_antiresonances() -> None:
    position = np.linspace(0.0, 4.0, 15000)
    values = np.sin(50.0 * position)
    values[7001], values[9002], values[3] = 40.0, -40.0, np.nan
    at = extremes(position, values, 100)
    assert {7001, 9002} <= set(at)
    assert 3 not in at
    assert len(at) <= 202
    assert np.all(np.diff(at) > 0)
    highest = largest(position, values, 100)
    assert 7001 in highest
    assert len(highest) <= 101


def test_columns_of_nothing_and_of_one_line() -> None:
    assert len(extremes(np.array([1.0]), np.array([np.nan]), 10)) == 0
    assert list(extremes(np.array([1.0]), np.array([2.0]), 10)) == [0]


@pytest.mark.parametrize(
    ("label", "words"),
    [
        ("reducer.pinion.w", "rotation r·θ of the pinion (reducer)"),
        ("reducer.wheel.rho", "rocking r·ρ of the wheel (reducer)"),
        ("planetary.planet2.u", "radial translation of the planet 2 (planetary)"),
        ("coupling.w", "rotation r·θ of the hub (coupling)"),
    ],
)
def test_dofs_in_words(label: str, words: str) -> None:
    assert describe_dof(load("paper"), label) == words


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1.82e-16, "1.8e−16"),
        (0.267, "0.267"),
        (2507.4, "2.5e3"),
        (999.9, "1000"),
        (np.inf, "∞"),
    ],
)
def test_numbers_in_tables(value: float, text: str) -> None:
    assert scientific(value) == text


def test_model_text_in_the_report_loads_again(written: tuple[str, Any]) -> None:
    match = re.search(r"<pre>(.*?)</pre>", written[0], flags=re.DOTALL)
    assert match
    assert loads(unescape(match[1])) == load("paper")


def test_time_integration_has_its_section(tmp_path: Path) -> None:
    result = cross_check(load("lin-parker-3"), Band(500.0, 4000.0, 500.0), in_time=True)
    html, results = read(result, tmp_path)
    text = text_of(html)
    assert "The same FRFs from time integration" in text
    assert "Rayleigh damping of 0.5 %" in text  # the preset has none of its own
    assert "mathdefault" not in html  # tick labels in words, not in TeX
    record = results["time_domain"]
    assert record["excitation"] == "planetary.sun.w"
    with np.load(tmp_path / "results.npz") as arrays:
        assert list(arrays["time_response"]) == record["responses"]
        assert arrays["time_transient_m_per_n"].shape == (
            len(record["responses"]),
            len(arrays["time_frequency_hz"]),
        )
    assert max(record["worst_db"]) <= 0.1
    assert [c["agrees"] for c in results["checks"] if "time integration" in c["name"]] == [True] * 2

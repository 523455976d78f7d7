"""The room of reports: what a page, a file of numbers, a panel and a terminal make of results."""

from __future__ import annotations

import json
import math
import re
import warnings
from dataclasses import dataclass
from enum import StrEnum
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from rich.console import Console

from mbs_models.model.model_file import load
from validation.checks.check import Check
from validation.report.console import print_table, print_verdicts, say
from validation.report.documents import document_text, not_finite, plain
from validation.report.frf_panel import (
    MAGNITUDE,
    Curve,
    Difference,
    FrfPanel,
    Mode,
    coincident_curves,
    difference_decades,
    differences_of,
    frf_figure,
    reference_curve,
)
from validation.report.page import Page, Section, Table, Verdict, Verdicts
from validation.report.pages import page_html
from validation.report.provenance import provenance
from validation.report.verdicts import along_strip, verdict_table

RIGHT = Check("poles", "all", ("a", "b"), "largest difference", 1e-9, 1e-8, "round-off")
WRONG = Check(
    "FRFs", "4 FRFs", ("a", "b"), "scaled error", math.nan, 1e-8, "round-off",
    tuple(f"finding {k}: <b>" for k in range(9)), "[/b] is no markup",
)  # fmt: skip


class Kind(StrEnum):
    GLOBAL = "global"


@dataclass(frozen=True)
class Found:
    kind: Kind
    value: float
    curve: Any
    where: Path


# JSON


def test_results_become_strict_json() -> None:
    curve = np.array([1.0 / 3.0, math.nan, 1e300]) * (1.0 + 0.5j)
    found = Found(Kind.GLOBAL, math.inf, curve, Path("a/b"))
    document = json.loads(document_text({"found": found, "check": WRONG, "of": load("paper")}))
    assert document["found"]["kind"] == "global"
    assert document["found"]["value"] is None
    assert document["found"]["where"] == str(Path("a/b"))
    assert document["found"]["curve"]["real"] == [0.333333333, None, 1e300]
    assert document["check"]["value"] is None
    assert document["check"]["agrees"] is False
    assert document["of"]["name"] == "Two-stage reducer"


def test_single_numbers_are_written_in_full_and_arrays_rounded() -> None:
    third = np.float64(1.0) / 3.0
    assert plain({"one": third, "many": np.full((2, 1), third)}, digits=3) == {
        "one": 1.0 / 3.0,
        "many": [[0.333], [0.333]],
    }
    assert plain(np.arange(3)) == [0, 1, 2]
    with pytest.raises(TypeError, match="object has no place in a JSON file"):
        plain(object())


def test_what_is_not_finite_is_named() -> None:
    document = {"a": [1.0, {"b": -math.inf}], "c": np.array([0.0, math.nan])}
    assert list(not_finite(document)) == [("a[1].b", "-Infinity"), ("c[1]", "NaN")]


# Verdicts


def test_the_strip_spans_18_decades() -> None:
    assert [along_strip(r) for r in (0.0, 1e-20, 1e-12, 1.0, 1e6, math.inf, math.nan)] == [
        0.0, 0.0, 0.0, 66.7, 100.0, 100.0, 100.0,
    ]  # fmt: skip
    table = verdict_table((RIGHT, WRONG))
    assert [row.reason for row in table.rows] == [1, 1]
    assert table.reasons == ("round-off",)


def test_a_page_shows_every_finding_and_escapes_it() -> None:
    verdict = Verdict("Routes disagree", agrees=False)
    page = Page(
        "eyebrow", "Heading", "title", "source", verdict,
        (Section("s", "A < B", ("text & more", Verdicts((RIGHT, WRONG)))),),
    )  # fmt: skip
    html = page_html(page, provenance())
    assert '<h2 id="s">A &lt; B</h2>' in html
    assert html.count("<li>finding ") == 9
    assert "<b>:" not in html
    assert "finding 8: &lt;b&gt;" in html
    assert "and 3 more" in html


# The terminal


def printed(width: int, *, terminal: bool) -> tuple[Console, StringIO]:
    file = StringIO()
    return Console(file=file, width=width, force_terminal=terminal, no_color=True), file


@pytest.mark.parametrize("terminal", [True, False])
def test_nothing_is_cut_at_80_columns(terminal: bool) -> None:
    evidence = "the evidence is as long as it takes to say where and by how much the two differ"
    console, file = printed(80, terminal=terminal)
    table = Table(("item", "value (dB re 1 m/N)", "evidence"), (("fig8", "−123.4", evidence),) * 2)
    print_table(console, "Evidence", table)
    print_verdicts(console, "[/b]", (RIGHT, WRONG))
    text = re.sub(r"\x1b\[[\d;]*m", "", file.getvalue())
    assert "…" not in text
    assert "[/b]" in text
    words = " ".join(text.replace("│", " ").split())
    assert all(word in words for word in evidence.split())
    assert all(f"finding {k}: <b>" in text for k in range(9))
    assert max(map(len, text.splitlines())) <= 80


def test_sentences_keep_to_one_line_in_a_pipe() -> None:
    console, file = printed(80, terminal=False)
    say(console, "a sentence " * 20)
    assert file.getvalue().count("\n") == 1


# The FRF panel


def test_coincident_curves_take_turns_and_every_peak_is_drawn() -> None:
    frequency = np.arange(1.0, 20_001.0)
    frf = np.full(len(frequency), 1e-9 + 0j)
    frf[12_345], frf[15_000] = 1e-3, 1e-15
    curves = coincident_curves({"one": frf, "other": frf * (1.0 + 1e-9)})
    assert [curve.dash for curve in curves] == [(0.0, (5.0, 5.0)), (5.0, (5.0, 5.0))]
    off = {"one": np.zeros(len(frf)), "other": np.full(len(frf), 1e-9)}
    panel = FrfPanel(
        frequency,
        (reference_curve("reference", frf), *curves),
        (Difference("|ΔH| / |H|", differences_of(curves, off)),),
        modes=(Mode("global", 12_346.0, "k"),),
        phase=True,
    )
    drawing = ElementTree.fromstring(frf_figure(panel, "panel", "an FRF"))
    svg = "{http://www.w3.org/2000/svg}"
    frames = [child for child in drawing if child.get("id")]
    assert len(frames) == 4  # modes, magnitude, phase, difference
    drawn = frames[1].findall(f"{svg}g/{svg}path")
    assert len(drawn) == 3
    for path in drawn:
        points = re.findall(r"[ML](\S+) ([\d.]+)", path.get("d", ""))
        heights = [float(y) for _, y in points]
        # From −60 to −300 dB, which the axis exceeds by a twentieth at either end.
        assert max(heights) - min(heights) == pytest.approx(72.0 * MAGNITUDE / 1.1, abs=0.02)
        assert len(points) < 3000
    words = [text.text for text in drawing.findall(f"{svg}text")]
    assert [word for word in words if word != "global"] == ["reference", "one", "other"]


def test_decades_hold_values_and_tolerance() -> None:
    values = np.array([0.0, math.nan, 3e-7, 2e-3])
    assert difference_decades(Difference("", (Curve("", values),))) == (-7, -2)
    assert difference_decades(Difference("", (Curve("", values),), allowed=0.1)) == (-7, 0)
    assert difference_decades(Difference("", (Curve("", values),), decades=3)) == (-5, -2)
    assert difference_decades(Difference("", (Curve("", 0.0 * values),))) == (-16, -12)


def test_curves_beyond_floats_are_drawn_and_the_last_frequency_is_inside() -> None:
    """A ratio of 1e300 to 1e-300 is none; and 1 000 Hz at the end stays on the page."""
    lines = np.linspace(100.0, 1000.0, 10)
    sizes = (1e-300, 1e300)
    curves = tuple(Curve(f"{size:g}", np.full(10, size + 0j), "#000000") for size in sizes)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawing = ElementTree.fromstring(
            frf_figure(FrfPanel(lines, curves, phase=True), "panel", "FRFs")
        )
    wide = float(drawing.get("viewBox", "").split()[2])
    (last,) = (t for t in drawing.iter("{http://www.w3.org/2000/svg}text") if t.text == "1 000")
    assert float(last.get("x", "")) + 0.31 * 8.5 * len("1 000") < wide

"""The Campbell diagram and the margins at the operating speed, as reports and the screen say."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from mbs_models.model.model_file import dumps, load
from mbs_models.model.parameters import Drivetrain
from tests.geared import lin_parker, speed_for
from tests.strategies import changed, paper
from tests.validation.command_line import call
from validation.crosscheck.campbell_figure import campbell_figure
from validation.crosscheck.model_sections import resonance_sections
from validation.crosscheck.resonances import (
    Resonances,
    crossings_document,
    margins_document,
    phasing_rules,
)
from validation.crosscheck.result import CrossCheck
from validation.crosscheck.study import cross_check
from validation.routes.bands import Band

BAND = Band(100.0, 15000.0, 100.0)


def operating(drivetrain: Drivetrain, **operation: object) -> CrossCheck:
    assert drivetrain.operation is not None
    tables = drivetrain.operation.model_dump(exclude_unset=True) | operation
    return cross_check(changed(drivetrain, operation=tables), BAND)


def drawn(result: CrossCheck) -> tuple[Resonances, str]:
    """What is found, and its diagram."""
    found = result.resonances
    assert found is not None
    return found, campbell_figure(found, result.modes.modes)


def texts(svg: str) -> list[str]:
    return [item.text or "" for item in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]


def heights(svg: str, words: str) -> list[float]:
    """Where the names that match stand (points from the top)."""
    found = []
    for item in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text"):
        if re.fullmatch(words, item.text or ""):
            moved = re.search(r"translate\(\S+ (\S+)\)", item.get("transform", ""))
            at = moved[1] if moved else item.get("y")
            assert at is not None
            found.append(float(at))
    return found


def test_a_report_without_operation_has_no_campbell_diagram() -> None:
    result = cross_check(paper(), BAND)
    assert result.resonances is None
    assert list(resonance_sections(result)) == []
    assert crossings_document(None) == []
    assert margins_document(None) is None


def test_suppressed_crossings_are_counted_not_listed() -> None:
    """27 teeth, 4 planets: the mesh frequency excites translational modes alone."""
    result = operating(lin_parker(4), speed_range=[0.0, 9000.0])
    found, diagram = drawn(result)
    assert all(crossing.telling for crossing in found.listed)
    first = [c for c in found.listed if c.order.rows and c.harmonic == 1]
    assert {result.modes.modes[c.mode].kind for c in first} == {"translational"}
    telling = sum(crossing.telling for crossing in found.crossings)
    assert found.suppressed > 0
    assert telling + found.suppressed <= len(found.crossings)
    assert tuple(phasing_rules(found.orders)) == (
        ("mesh planetary", "×1 translational, ×2 planet, ×3 translational"),
    )
    assert "suppressed by planet phasing" in texts(diagram)
    # Without a speed nothing is said of one.
    assert found.margins == ()
    assert not any("rpm ±" in words for words in texts(diagram))
    assert margins_document(found) is None


def test_what_lies_on_the_operating_speed_is_drawn_and_said() -> None:
    """The mesh frequency on the second translational pair, at the very end of the range."""
    drivetrain = lin_parker(4)
    modes = cross_check(drivetrain, BAND).modes
    target = [mode.frequency_hz for mode in modes.modes if mode.kind == "translational"][2]
    speed = speed_for(drivetrain, target)
    result = operating(drivetrain, speed_range=[0.5 * speed, speed], speed=-speed)
    found, diagram = drawn(result)
    assert found.speed_range == pytest.approx((0.5 * speed, 1.1 * speed))
    closest = found.margins[0]
    assert closest.mode_hz == pytest.approx(target)
    change = f"{100.0 * closest.change:+.1f} %".replace("-", "−")
    assert abs(closest.change) < 0.02  # teeth fit the radii within 2 %
    assert f"{speed:g} rpm ± 10 %" in texts(diagram)
    assert f"mesh planetary: {change}" in texts(diagram)
    document = margins_document(found)
    assert document is not None
    assert document["speed_rpm"] == pytest.approx(speed)
    assert document["margins"][0] == {
        "order": "mesh planetary",
        "harmonic": 1,
        "order_hz": closest.order_hz,
        "mode": closest.mode + 1,
        "repeated": 2,
        "mode_hz": closest.mode_hz,
        "kind": "translational",
        "excited_share": closest.share,
        "speed_change": closest.change,
    }
    assert len(document["margins"]) == len(found.margins)


def test_every_order_is_named_once_with_room_between_names() -> None:
    """Shafts at 0.2 Hz and a mesh at 1400 Hz: in panels, all names legible."""
    result = operating(load("wind-turbine"), speed=12.1)
    found, diagram = drawn(result)
    names = texts(diagram)
    labels = [o.label(h) for o in found.orders for h in o.harmonics]
    assert [names.count(label) for label in labels] == [1] * len(labels)
    assert names.count("Frequency (Hz)") == 3  # to 1.9 kHz, to 100 Hz, to 7 Hz
    at = heights(diagram, "|".join(map(re.escape, labels)))
    assert all(below - above > 9.0 for above, below in pairwise(sorted(at)))  # 7.5 pt letters


def test_many_harmonics_have_room() -> None:
    """All the harmonics of a trapezoid, squeezed into a narrow range of frequencies."""
    variation = {"shape": "trapezoid", "contact_ratio": 1.55}
    result = operating(lin_parker(4, sun_mesh_variation=variation), speed_range=[0.0, 1000.0])
    found, _ = drawn(result)
    order = found.orders[-1]
    many = replace(order, harmonics=tuple(range(1, 51)))
    more = replace(found, orders=(*found.orders[:-1], many))
    svg = campbell_figure(more, result.modes.modes)
    at = heights(svg, r"(mesh|shaft) \S+( ×\d+)?")
    assert len(at) == 52
    assert all(below - above > 9.0 for above, below in pairwise(sorted(at)))


def test_a_report_has_the_margins(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drivetrain = changed(
        lin_parker(4),
        operation={"input": "planetary.sun", "speed_range": [0.0, 9000.0], "speed": 3000.0},
    )
    model, out = tmp_path / "model.toml", tmp_path / "out"
    model.write_text(dumps(drivetrain))
    band = ("--fmin", "100", "--fmax", "9000", "--df", "100")
    assert call("run", str(model), "--out", str(out), "--no-time", *band) == 0
    said = capsys.readouterr().out
    assert "planetary.sun at 3000 rpm: nearest resonances" in said
    row = next(line for line in said.splitlines() if "+3.3 %" in line)
    assert "mesh planetary" in row
    assert "4–5" in row
    page = (out / "report.html").read_text(encoding="utf-8")
    assert '<h3 id="margins">At 3000 rpm</h3>' in page
    assert page.count('<tr class="close">') == 1

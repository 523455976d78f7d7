"""Warnings of a report are on the screen, and verdicts on FRFs in time say what they rest on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mbs_models.errors import OrbitError
from mbs_models.model.model_file import dumps, load
from tests.strategies import changed
from tests.validation.command_line import call
from validation.crosscheck.study import cross_check
from validation.routes.bands import Band
from validation.routes.comparable_lines import describe, known, percent, within_range
from validation.routes.source import exudyn_source
from validation.routes.time_domain import time_domain, with_damping

W = "planetary.sun.w"


# --- in words -------------------------------------------------------------------------------


def test_what_is_judged_of_less_than_half_of_the_band_is_named() -> None:
    frequency = np.arange(10.0, 110.0, 10.0)
    compared = np.ones((10, 3), bool)
    compared[2:, 1] = False
    compared[:, 2] = False
    assert describe("abc", frequency, compared) == (
        "compared on 12 of 30 lines (40 %); on less than half of the band at "
        "c (nowhere); b (20 %, none above 20 Hz)"
    )
    compared[:5, 1:] = True
    assert describe("abc", frequency, compared) == "compared on 20 of 30 lines (67 %)"
    assert describe("abc", frequency, np.ones((10, 3), bool)) == "compared on all lines"


def test_all_but_one_line_is_not_all() -> None:
    compared = np.ones((1000, 1), bool)
    assert percent(compared) == "100 %"
    compared[0] = False
    assert percent(compared) == "99 %"


# --- crosscheck run -------------------------------------------------------------------------


def test_the_verdict_in_time_says_its_share(capsys: pytest.CaptureFixture[str]) -> None:
    """The generator behind two more stages is 170 dB below the sun that is pushed."""
    from validation.crosscheck.console import print_result
    from validation.report.console import console

    result = cross_check(load("wind-turbine"), Band(500.0, 4000.0, 500.0), in_time=True)
    assert result.time_domain is not None
    share = result.time_domain.comparable
    assert "on less than half of the band at " in share
    assert "generator.w ← low_speed.sun.w" in share
    assert result.time_domain.worst_db.max() <= 0.02  # 1e-3, what a line is known to, is 0.009 dB
    notes = [c.note for c in result.checks if "time integration" in c.name]
    assert notes == [share, share]
    print_result(result, console())
    printed = " ".join(capsys.readouterr().out.split())
    assert f"FRFs from time integration: {share}." in printed


def test_every_line_of_the_paper_is_judged_in_time() -> None:
    """Down to 180 dB below the rise towards 0 Hz; measured 4e-4 dB."""
    found = time_domain(exudyn_source(with_damping(load("paper"))), "reducer.pinion.w")
    size = np.abs(found.substructured)
    assert (size / size.max(axis=0)).min() < 1e-8
    assert found.compared.all()
    assert found.comparable == "compared on all lines"
    assert found.worst_db.max() < 5e-3


def test_what_is_known_of_a_line_is_the_worst_of_its_neighbours() -> None:
    """Round-off is as much in accelerations there; ten lines to each side."""
    frequency, size = np.linspace(100.0, 200.0, 101), np.ones(101)
    assert known(frequency, size, np.full(101, 0.99e-3)).any()
    assert not known(frequency, size, np.full(101, 1.01e-3)).any()
    once = np.zeros(101)
    once[50] = 0.9e-3  # at 150 Hz; 0.9e-3 (150/140)² > 1e-3 at 140 Hz
    lost = np.flatnonzero(~known(frequency, size, once))
    assert lost.tolist() == list(range(40, 43))


def test_lines_within_80_db_are_judged_however_they_scatter() -> None:
    """What is not linear scatters as well."""
    assert within_range(np.array([[1.0], [1.001e-4], [0.999e-4]])).tolist() == [
        [True], [True], [False]
    ]  # fmt: skip


def test_an_orbit_that_does_not_close_is_told_on_the_console(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def open_orbit(*arguments: object, **options: object) -> None:
        raise OrbitError("the periodic orbit does not close")

    monkeypatch.setattr("validation.crosscheck.study.time_domain", open_orbit)
    stage = load("lin-parker-3").stage("planetary").model_dump(by_alias=True, exclude_unset=True)
    apart = changed(load("lin-parker-3"), stage=[stage, stage | {"name": "second"}], coupling=[])
    path = tmp_path / "apart.toml"
    path.write_text(dumps(apart), encoding="utf-8")
    lines = ["--fmin", "500", "--fmax", "4000", "--df", "500", "--time"]
    assert call("run", str(path), *lines, "--out", str(tmp_path)) == 0
    errors = capsys.readouterr().err.splitlines()
    warned = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["warnings"]
    assert any("not connected" in warning for warning in warned)
    assert "no FRFs from time integration: the periodic orbit does not close" in warned
    # Each once, though what is known of the model is told before the check begins.
    assert sorted(errors) == sorted(f"warning: {warning}" for warning in warned)


# --- crosscheck simulate --------------------------------------------------------------------


def test_simulate_says_on_how_much_of_the_band_it_rests(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sun's v, which u hardly moves, is lost in round-off above 1.4 kHz."""
    assert call("simulate", "wind-turbine", "--out", str(tmp_path)) == 0
    printed = " ".join(capsys.readouterr().out.split())
    found = json.loads((tmp_path / "simulation.json").read_text(encoding="utf-8"))
    html = (tmp_path / "simulation.html").read_text(encoding="utf-8")
    (frfs,) = found["frfs"]
    shares = np.array(frfs["judged_share"])[:, 0]
    assert 0.0 < shares.min() < 0.5 < shares.mean() < 1.0
    place = f"{frfs['responses'][int(shares.argmin())]} ← {frfs['excitations'][0]} ("
    assert f"on less than half of the band at {place}" in frfs["judged"]
    assert place in printed
    assert place in html
    assert f"on the lines compared, {100 * shares.mean():.0f} % of all" in found["verdict"]
    assert found["verdict"] in html
    assert "where the periods of the steady state scatter by less than 0.1 %" in html
    assert [check["note"] for check in found["checks"]] == [frfs["judged"]] * 2


def test_a_steady_state_of_a_free_drivetrain_is_judged_on_every_line(tmp_path: Path) -> None:
    """Down to 200 dB below the rise towards 0 Hz; measured 1e-3 dB there."""
    assert call("simulate", "paper", "--out", str(tmp_path)) == 0
    (frfs,) = json.loads((tmp_path / "simulation.json").read_text(encoding="utf-8"))["frfs"]
    assert np.min(frfs["judged_share"]) > 0.99
    assert np.max(frfs["worst_db"]) < 1e-2


def test_simulate_judges_all_lines_of_a_held_stage_and_says_so(tmp_path: Path) -> None:
    asked = ("--excitation", f"multisine@{W}:fmin=50,fmax=1000,df=50", "--response", W)
    assert call("simulate", "lin-parker-4", *asked, "--out", str(tmp_path)) == 0
    found = json.loads((tmp_path / "simulation.json").read_text(encoding="utf-8"))
    assert found["frfs"][0]["judged"] == "compared on all lines"
    assert found["verdict"].endswith("dB on all lines")
    html = (tmp_path / "simulation.html").read_text(encoding="utf-8")
    assert "every number of this report" not in html  # FRFs and histories are not in it
    assert "receptance" not in found["frfs"][0]
    assert "verdicts, settings and summaries are in simulation.json" in html


def test_warnings_of_a_run_in_time_are_on_the_screen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage = load("lin-parker-3").stage("planetary").model_dump(by_alias=True, exclude_unset=True)
    apart = changed(load("lin-parker-3"), stage=[stage, stage | {"name": "second"}], coupling=[])
    path = tmp_path / "apart.toml"
    path.write_text(dumps(apart), encoding="utf-8")
    asked = ("--excitation", f"multisine@{W}:fmin=50,fmax=2000,df=50", "--response", W)
    assert call("simulate", str(path), *asked, "--out", str(tmp_path)) == 0
    errors = capsys.readouterr().err.splitlines()
    warned = json.loads((tmp_path / "simulation.json").read_text(encoding="utf-8"))["warnings"]
    assert warned
    assert errors == [f"warning: {warning}" for warning in warned]

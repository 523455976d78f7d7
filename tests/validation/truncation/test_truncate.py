"""The study of truncation on the paper's drivetrain: guaranteed, and true."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import Reason, Tolerance
from mbs_models.model.model_file import load
from tests.strategies import damped
from tests.validation.command_line import call
from validation.errors import CommandError
from validation.report.publish import publish
from validation.routes.bands import Band
from validation.runtime.progress import silent
from validation.truncation.describe import line_table, verdict
from validation.truncation.plan import plan
from validation.truncation.run import run

COARSE = "10:4000:10"


@pytest.fixture(scope="module")
def paper() -> Any:
    return run(plan(load("paper"), band_text=COARSE), silent)


def test_the_guarantee_holds_and_is_met(paper: Any) -> None:
    assert paper.agrees
    assert paper.meets
    assert paper.guaranteed <= 0.1
    for frf in paper.frfs:
        assert (frf.error <= frf.bound).all()
        assert frf.bound.max() <= paper.guaranteed * (1 + 1e-12)
    assert not paper.reason.any()
    assert verdict(paper) == "Guaranteed below 0.041 dB to 4000 Hz with 7 of 31 modes"


def test_modes_below_the_band_and_residuals_do(paper: Any) -> None:
    # every mode that moves the shafts up to 4 kHz, and none beyond: residuals stand for the rest
    reducer, planetary = paper.stages
    assert (reducer.stage, len(reducer.kept), reducer.silent) == ("reducer", 3, 5)
    assert (planetary.stage, len(planetary.kept), planetary.silent) == ("planetary", 4, 15)
    for stage in paper.stages:
        assert stage.rigid == 1
        assert stage.kept[0] == 1
        assert stage.kept_hz[-1] < 4000.0 < stage.first_left_out_hz


def test_rules_of_thumb_are_no_rules(paper: Any) -> None:
    found = {other.name: other for other in paper.alternatives}
    for factor in ("2", "20"):
        # the hub's mode, near 11 MHz, is left out: the joint is as stiff as what is left of it
        bare = found[f"modes to {factor} × the band, residuals none"]
        assert bare.error > 60.0
        assert bare.bound == np.inf
    static = found["modes to 2 × the band, residuals R₀"]
    assert 0.1 < static.error <= static.bound < 1.0
    assert static.modes == 26
    for other in paper.alternatives:
        assert other.error <= other.bound + 1e-6  # round-off of the exact FRFs


def test_one_stage_may_be_cut_alone_and_by_scaled_error() -> None:
    asked = plan(
        load("paper"), stages=["planetary"], band_text="20:4000:20", tolerance="0.001scaled"
    )
    assert asked.tolerance == Tolerance(0.001, scaled=True)
    found = run(asked, silent)
    assert [stage.stage for stage in found.stages] == ["planetary"]
    assert found.agrees
    assert found.guaranteed <= 0.001
    for frf in found.frfs:
        assert (frf.error <= 0.001).all()


def test_own_damping_is_not_added_to() -> None:
    drivetrain = damped(load("paper"))
    asked = plan(drivetrain, band_text="20:2000:20", responses=["planetary.sun.w"])
    assert asked.loss_factor == 0.0
    assert asked.notes == ()
    assert asked.pairs == (("planetary.sun.w", "planetary.sun.w"),)
    assert run(asked, silent).agrees


def test_lines_that_no_basis_meets_are_told() -> None:
    found = run(plan(load("paper"), band_text="100:4000:100", tolerance="1e-12dB"), silent)
    assert found.agrees
    assert found.unreachable.all()
    assert not found.meets
    assert verdict(found) == (
        "No basis is guaranteed to meet 1e-12 dB to 4000 Hz: round-off of all modes is more"
    )
    assert len(line_table(found).rows) == len(found.frfs)
    conclusions = [words for words in found.page().conclusions if isinstance(words, str)]
    assert any("below what round-off leaves" in words for words in conclusions)


def test_some_lines_may_be_lost() -> None:
    found = run(plan(load("paper"), band_text="1:4000:1", tolerance="1e-5dB"), silent)
    lost = found.unreachable.any(axis=0)
    assert 0 < lost.sum() < 10
    assert found.guaranteed <= 1e-5
    assert verdict(found).endswith("but for lines lost in round-off")
    for frf, own in zip(found.frfs, found.unreachable, strict=True):
        assert (frf.bound[~own] <= 1e-5).all()
        assert (frf.error <= frf.bound).all()


def test_files(paper: Any, tmp_path: Path) -> None:
    page, numbers = publish(paper, tmp_path)
    assert (page.name, numbers.name) == ("truncation.html", "truncation.json")
    text = page.read_text(encoding="utf-8")
    assert "Guaranteed below 0.041 dB to 4000 Hz with 7 of 31 modes" in text
    assert text.count("<svg") >= len(paper.frfs)
    for title in (
        "Modes that each stage needs", "Bound and true error", "Lines without a guarantee",
        "Other choices and rules of thumb",
    ):  # fmt: skip
        assert title in text
    document = json.loads(numbers.read_text(encoding="utf-8"))
    assert document["agrees"] is True
    assert document["meets"] is True
    assert [stage["kept"] for stage in document["stages"]] == [
        list(stage.kept) for stage in paper.stages
    ]
    assert np.allclose(document["frfs"][0]["bound"], paper.frfs[0].bound, rtol=1e-5)
    assert document["no_bound"] == [None] * len(paper.frequency)


def test_lines_without_a_bound_are_listed() -> None:
    asked = plan(load("paper"), band_text="5:4000:5", highest_order=-1)
    found = run(asked, silent)
    bare = next(o for o in found.alternatives if o.name.startswith("modes to 2 ×"))
    assert bare.bound == np.inf
    assert set(np.unique(found.reason)) <= set(Reason)


def test_what_is_asked_is_checked() -> None:
    drivetrain = load("paper")
    assert plan(drivetrain, band_text="1:2000").band == Band(1.0, 2000.0, 1.0)
    for band in ("4000", "1:x", "10:1", "1:2:3:4", "1:inf"):
        with pytest.raises(CommandError, match=r"--band = .*: must be FROM:TO or FROM:TO:STEP"):
            plan(drivetrain, band_text=band)
    for tolerance in ("0", "-1dB", "much", "2scaled"):
        with pytest.raises(CommandError, match=r"--tolerance = .*: must be a number of dB above 0"):
            plan(drivetrain, tolerance=tolerance)
    with pytest.raises(CommandError, match=r"--stage = 'planetry'.*did you mean planetary"):
        plan(drivetrain, stages=["planetry"])
    with pytest.raises(CommandError, match="--response = 'sun': no such DoF"):
        plan(drivetrain, responses=["sun"])


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--band", "100:4000:100", "--out", str(tmp_path), "--stage", "planetary"]
    assert call("truncate", "paper", *options) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("Guaranteed below ")
    assert "modes to 20 × the band" in printed
    assert (tmp_path / "truncation.html").exists()
    assert call("truncate", "paper", "--band", "x", "--out", str(tmp_path)) == 2

"""`crosscheck speed`: files, exit codes, what is said of bad input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.model.model_file import dumps
from mbs_models.model.parameters import Drivetrain
from tests.gearboxes import ERROR, HARMONIC, pair, planetary
from tests.validation.command_line import call
from validation.runtime.progress import silent
from validation.speed.plan import parse_speeds, plan
from validation.speed.run import run
from validation.speed.time_reference import reference_checks, time_reference
from validation.speed.turning import turning


def written(drivetrain: Drivetrain, folder: Path) -> str:
    """The path of its model file."""
    path = folder / "model.toml"
    path.write_text(dumps(drivetrain), encoding="utf-8")
    return str(path)


def document(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "speed.json").read_text(encoding="utf-8"))
    return found


def test_page_numbers_and_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = written(planetary(3), tmp_path)
    out = tmp_path / "out"
    code = call("speed", model, "--speed", "0:6000:500", "--torque", "50", "--out", str(out))
    said = capsys.readouterr()
    assert code == 0
    assert "0 rpm is the standstill: no mesh is passed, and it is left out" in said.err
    assert "Resonances" in said.out
    assert "Floquet theory: stable at every speed." in said.out
    found = document(out)
    assert found["rpm"][0] == 500.0
    assert found["rpm"][-1] == 6000.0
    assert found["torque_nm"] == 50.0
    assert found["agrees"] is True
    assert found["excited"] is True
    assert len(found["curves"]["growth_rate_1_s"]) == len(found["rpm"])
    assert set(found["curves"]["height"]) == set(found["families"])
    for peak in found["peaks"]:
        assert peak["height"] > 1.0
        assert peak["order"] * peak["speed_rpm"] / 60.0 == pytest.approx(peak["frequency_hz"])
    page = (out / "speed.html").read_text(encoding="utf-8")
    for section in ("Mesh forces over speed", "Stability", "Bearing forces", "Accelerations"):
        assert f">{section}</h2>" in page
    assert ">nan" not in page
    with np.load(out / "speed.npz", allow_pickle=False) as arrays:
        shape = len(found["rpm"]), len(arrays["orders"])
        assert arrays["mesh_force_n"].shape == (*shape, len(arrays["meshes"]))
        assert arrays["acceleration_m_s2"].shape == (*shape, len(arrays["dofs"]))
        assert arrays["bearing_force_n"].shape == (*shape, len(arrays["bearings"]))
        static = arrays["static_force_n"]
        worst = (arrays["mesh_force_max_n"] / static).max()
    assert worst == pytest.approx(max(max(h) for h in found["curves"]["height"].values()), rel=1e-5)


def test_where_nothing_varies_nothing_excites(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, out = written(pair(), tmp_path), tmp_path / "out"
    assert call("speed", model, "--out", str(out)) == 0
    assert "Nothing excites" in capsys.readouterr().out
    assert document(out)["excited"] is False
    assert document(out)["static_forces_n"] == {"mesh pair.pinion – wheel": pytest.approx(2000.0)}
    assert "Nothing excites" in (out / "speed.html").read_text(encoding="utf-8")
    assert not (out / "speed.npz").exists()


def test_responses_chosen(tmp_path: Path) -> None:
    model, out = written(pair(mesh_transmission_error=ERROR), tmp_path), tmp_path / "out"
    options = ["--speed", "600,900", "--response", "pair.pinion.w,pair.wheel.w", "--out", str(out)]
    assert call("speed", model, *options) == 0
    page = (out / "speed.html").read_text(encoding="utf-8")
    assert "pair.pinion.w: orders" in page
    assert document(out)["rpm"] == [600.0, 900.0]


def test_a_model_without_damping_is_lent_some(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = written(pair(beta=0.0, mesh_transmission_error=ERROR), tmp_path)
    assert call("speed", model, "--speed", "600", "--out", str(tmp_path / "out")) == 0
    assert "Rayleigh damping of 0.5 %" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--speed", "fast"], "--speed = 'fast': must be FROM:TO:STEP, as 0:3000:10, or a list"),
        (["--speed", "0:100"], "--speed = '0:100': must be FROM:TO:STEP"),
        (["--speed", "0:nan:10"], "--speed = '0:nan:10': must be FROM:TO:STEP"),
        (["--speed", "0:100:0"], "--speed = '0:100:0': the step must be above 0 rpm, got 0"),
        (["--speed", "100:0:10"], "the range must not end below its beginning"),
        (["--speed", "0:1e9:1"], "1000000001 speeds; at most 100000: give a larger step"),
        (["--speed=-5,10"], "--speed = '-5,10': a speed must not be below 0 rpm"),
        (["--speed", "0"], "--speed = 0 rpm: no mesh is passed at a standstill"),
        (["--torque", "inf"], "--torque = inf: must be a finite number (N m)"),
        (["--check", "0,600"], "--check: 0 rpm is a standstill; give speeds above 0"),
        (["--check", "x"], "--check = 'x': must be FROM:TO:STEP"),
        (["--response", "pair.sun.w"], "--response = 'pair.sun.w': no such DoF; known: pair.pin"),
        (["--executor", "threads"], "--executor = 'threads': must be processes, serial, mpi, or"),
    ],
)
def test_bad_input_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    out = tmp_path / "out"
    model = written(pair(mesh_transmission_error=ERROR), tmp_path)
    assert call("speed", model, *options, "--out", str(out)) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_a_model_without_operation_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("speed", "lin-parker-4", "--out", str(tmp_path / "out")) == 2
    error = capsys.readouterr().err
    assert "no [operation] table; a speed study needs its input and speed_range" in error
    assert error.count("\n") == 1


def test_ranges_hold_their_end() -> None:
    assert parse_speeds("--speed", "0:0.3:0.1").tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert parse_speeds("--speed", "900,600,900").tolist() == [600.0, 900.0]


def test_exudyn_in_time_agrees(tmp_path: Path) -> None:
    """β = 4e-6, 80 % of the resonance: a line of each of the first harmonics."""
    asked = plan(
        pair(mesh_variation=HARMONIC, mesh_transmission_error=ERROR), speed="7600", harmonics=3
    )
    found = time_reference(turning(asked), 7600.0, silent)
    assert found.comparable[:, 0].sum() >= 2
    checks = reference_checks([found])
    assert [check.agrees for check in checks] == [True, True, True]
    assert checks[0].value < 2e-3


def test_a_wrong_balance_does_not_agree() -> None:
    """exudyn's mesh is a tenth stiffer than the balance has it."""
    asked = plan(pair(mesh_transmission_error=ERROR), speed="7600", harmonics=3)
    right = turning(asked)
    stiffer = pair(mesh_transmission_error=ERROR, mesh_stiffness=2.2e8)
    wrong = type(right)(**{**vars(right), "plan": plan(stiffer, speed="7600", harmonics=3)})
    checks = reference_checks([time_reference(wrong, 7600.0, silent)])
    assert [check.agrees for check in checks] == [True, False, False]
    assert "in time" in checks[1].findings[0]


@pytest.mark.slow
def test_the_command_checks_a_planetary_stage_in_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ring = {"shape": "trapezoid", "contact_ratio": 1.8, "amplitude": 0.2}
    model, out = written(planetary(4, ring_mesh_variation=ring), tmp_path), tmp_path / "out"
    options = ["--speed", "1000:4000:500", "--check", "1500,3000", "--harmonics", "6"]
    assert call("speed", model, *options, "--out", str(out)) == 0
    compared = [check for check in document(out)["checks"] if "by order" in check["name"]]
    assert [check["subject"] for check in compared] == ["at 1500 rpm"] * 2 + ["at 3000 rpm"] * 2
    assert all(check["agrees"] for check in compared)
    assert "exudyn in time at 1500 rpm" in (out / "speed.html").read_text(encoding="utf-8")


def test_a_disagreement_ends_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("validation.speed.checks.MEAN_TOLERANCE", -1.0)
    model, out = written(pair(mesh_transmission_error=ERROR), tmp_path), tmp_path / "out"
    assert call("speed", model, "--speed", "600,900", "--out", str(out)) == 1
    assert "1 of 1 checks disagree" in capsys.readouterr().out
    assert document(out)["agrees"] is False


def test_the_study_runs_as_a_library() -> None:
    result = run(plan(pair(mesh_transmission_error=ERROR), speed="600:1200:100"))
    assert result.agrees


@pytest.mark.slow
def test_a_cluster_writes_the_same_numbers(tmp_path: Path) -> None:
    from distributed import LocalCluster

    model = written(pair(mesh_variation=HARMONIC), tmp_path)
    options = ["speed", model, "--speed", "500:6000:250"]
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        assert call(*options, "--executor", address, "--out", str(tmp_path / "far")) == 0
    assert call(*options, "--executor", "serial", "--out", str(tmp_path / "here")) == 0
    far, here = (document(tmp_path / name)["curves"] for name in ("far", "here"))
    assert far == here

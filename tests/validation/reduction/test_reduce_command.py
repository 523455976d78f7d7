"""`crosscheck reduce`: every method by every size, the error and its guarantee."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import Frf, SecondOrderSystem, direct_frf, projected
from mbs_models.model.model_file import load
from tests.fbs.fbs_systems import scaled_error
from tests.validation.command_line import call
from validation.reduction.describe import conclusions, verdict
from validation.reduction.methods import Reductions
from validation.reduction.plan import plan
from validation.reduction.run import run
from validation.routes.multibody import stage_system
from validation.runtime.progress import silent

BAND = "20:3000:20"


@pytest.fixture(scope="module")
def result() -> Any:
    return run(plan(load("paper"), "planetary", band=BAND), silent)[0]


def test_no_true_error_exceeds_its_guarantee(result: Any) -> None:
    (check,) = result.checks
    assert check.agrees
    for trial in result.trials:
        # both in dB; what round-off leaves of the exact FRFs is below 1e-6 dB here
        assert trial.error <= trial.bound + 1e-6


def test_all_coordinates_are_exact(result: Any) -> None:
    """As many as DoFs: nothing is reduced. MacNeal leaves the residual's inertia out."""
    full = {t.method: t for t in result.trials if t.size == result.dofs}
    for method in ("Guyan", "dynamic", "IRS", "SEREP", "Craig–Bampton", "Rubin"):
        assert full[method].error < 1e-6
        assert full[method].bound < 1e-5


def test_the_choice_is_the_least_that_is_guaranteed(result: Any) -> None:
    choice = result.choice
    assert choice.bound <= 0.1
    smaller = [t for t in result.trials if t.size < choice.size]
    assert smaller
    assert all(t.bound > 0.1 for t in smaller)
    # turning alone is asked for: the sun, ring, carrier, hub, and the planets' common motions
    assert (choice.method, choice.size) == ("Krylov", 8)
    assert verdict(result) == (
        "Krylov with 8 of 22 coordinates is guaranteed to meet 0.1 dB to 3000 Hz"
    )
    assert conclusions(result)[0].startswith("Its true error is ")


def test_what_no_method_meets_is_said() -> None:
    found, chosen = run(plan(load("paper"), "planetary", band=BAND, sizes="2,3"), silent)
    assert chosen is None
    assert found.choice is None
    assert verdict(found) == "No reduction tried meets 0.1 dB to 3000 Hz"
    assert found.agrees


def test_masters_and_modes_beyond_what_there_is_are_said_with_the_reason(result: Any) -> None:
    reasons = {t.reason for t in result.trials if not np.isfinite(t.error)}
    assert any("rigid-body modes" in reason for reason in reasons)
    assert all(t.reason or np.isfinite(t.error) for t in result.trials)


def test_the_files_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    line = f"reduce paper --stage planetary --band {BAND} --sizes 8,16 --output small.npz --out out"
    assert call(*line.split()) == 0
    numbers = json.loads((tmp_path / "out" / "reduction.json").read_text(encoding="utf-8"))
    assert numbers["choice"] == {"method": "Krylov", "size": 8}
    with np.load(tmp_path / "small.npz", allow_pickle=False) as file:
        dofs = [str(label) for label in file["coordinates"]]
        mass, damping, stiffness = (file[name] for name in ("mass", "damping", "stiffness"))
        small = SecondOrderSystem(mass, damping, stiffness, dofs, {}, float(file["loss_factor"]))
        basis = file["basis"]
        whole = [str(label) for label in file["dofs"]]
    lines = np.array([100.0, 1000.0, 2500.0])
    expected = direct_frf(stage(), lines, ("planetary.sun.w",), ("planetary.sun.w",))
    row = basis[whole.index("planetary.sun.w")]
    found = row @ direct_frf(small, lines).values @ row
    error = scaled_error(Frf(lines, found[:, None, None], ("a",), ("a",)), expected.values)
    assert error.max() < 1e-9


def stage() -> SecondOrderSystem:
    """The paper's planetary stage with the loss factor that `reduce` lends."""
    system = stage_system(load("paper"), "planetary")
    return SecondOrderSystem(
        system.mass, system.damping, system.stiffness, system.dofs, system.derived, 0.01
    )


def test_vectors_of_any_length_are_projected_alike() -> None:
    """A near-massless hub, vectors of lengths 1 and 1e-5: what once broke the bound."""
    ports = ("coupling.w", "planetary.sun.w")
    reductions = Reductions(stage(), ports, np.arange(20.0, 3001.0, 20.0))
    frf, bound = reductions.bounded("Krylov", 8)
    exact = direct_frf(reductions.system, reductions.frequency, ports, ports)
    assert (np.abs(frf.values - exact.values) <= bound + exact.round_off).all()
    again = projected(reductions.system, reductions.krylov_vectors[:, :8] * 7.0)
    assert scaled_error(again.frf(reductions.frequency, ports, ports), frf.values).max() < 1e-9


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("reduce paper", "--stage is missing: give a stage or inertia, reducer, planetary"),
        ("reduce paper --stage planetry", "did you mean planetary?"),
        ("reduce paper --stage planetary --dof x", "--dof = 'x': no such DoF"),
        ("reduce paper --stage planetary --sizes 0,1", "--sizes = '0,1'"),
        ("reduce paper --stage planetary --sizes 4:99", "'planetary' has 22 DoFs"),
        ("reduce paper --stage planetary --tolerance 0", "--tolerance = '0'"),
        ("reduce paper --stage planetary --band 5", "--band = '5'"),
        ("reduce paper --stage planetary --band 10:99:20", "--band = '10:99:20': fmin = 10 Hz"),
        ("reduce paper --stage planetary --output a.csv", "a reduced system is written as .npz"),
    ],
)
def test_bad_options_are_one_message(
    line: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(*line.split()) == 2
    assert words in capfd.readouterr().err
    assert not list(tmp_path.glob("*/reduction.*"))

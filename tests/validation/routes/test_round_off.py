"""What a nearly massless hub's round-off hides is said, and neither agrees nor disagrees."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fbs import RealModes
from mbs_models.modal.mode_kinds import EnergyShares, Kind, Mode, mode_groups
from mbs_models.modal.modes import drivetrain_modes, eigenvalue_error
from mbs_models.model.model_file import load, template
from mbs_models.model.parameters import Drivetrain
from tests.strategies import with_coupling
from tests.validation.command_line import call
from validation.checks.metrics import subspace_mac
from validation.checks.pole_checks import KNOWN, MAC_TOLERANCE, allowed_mac_defects
from validation.crosscheck.study import cross_check
from validation.routes.bands import Band
from validation.routes.modes import known_to, round_off_warnings
from validation.routes.source import equations_source

COARSE = Band(50.0, 4000.0, 50.0)
HUBS = [4.48e-8, 1e-10, 1e-12, 1e-14]  # kg; K/m of the last is λ = 1e22 (rad/s)²


def hub(mass: float) -> Drivetrain:
    return with_coupling(load("paper-table2"), inertia_over_r2=mass)


def file_with_hub(directory: Path, mass: str) -> str:
    path = directory / "hub.toml"
    text = template("paper-table2")
    assert text.count("inertia_over_r2 = 4.48e-8") == 1
    path.write_text(text.replace("= 4.48e-8", f"= {mass}"), encoding="utf-8")
    return str(path)


# --- what is known --------------------------------------------------------------------------


@pytest.mark.parametrize("mass", HUBS)
def test_frequencies_lie_within_their_round_off(mass: float) -> None:
    """n·eps·λ_max bounds a symmetric eigensolution's error of λ; a sixth of it is used here."""
    found = drivetrain_modes(hub(mass))
    for mode, exact in zip(found.modes, equations_source(hub(mass)).modes.modes, strict=True):
        assert abs(mode.frequency_hz - exact.frequency_hz) <= mode.round_off_hz
    largest = (2.0 * np.pi * found.modes[-1].frequency_hz) ** 2
    expected = len(found.modes) * np.finfo(float).eps * largest
    assert eigenvalue_error(found) == pytest.approx(expected, rel=1e-9)
    for mode in found.modes[1:-1]:  # any mode gives it back; the hub's own has lost its digits
        alone = replace(found, modes=(mode,))
        assert eigenvalue_error(alone) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("frequency", "error", "told"),
    [
        (1536.684, 1e-4, ("1536.68", "")),
        (1099.4537, 0.077, ("1099.45", "0.077")),
        (1099.4537, 0.77, ("1099.5", "0.77")),
        (1565.6, 5.4, ("1566", "5.4")),
        (1585.6, 684.0, ("1600", "680")),
        (55.46, 130.0, ("< 190", "")),  # 185.46, rounded up
        (110.2, 1300.0, ("< 1500", "")),
    ],
)
def test_no_digit_is_printed_that_is_not_known(
    frequency: float, error: float, told: tuple[str, str]
) -> None:
    mode = Mode(frequency, 0.0, Kind.GLOBAL, EnergyShares({}, {}, {}), error)
    assert known_to(mode) == told


def test_a_rigid_body_mode_is_zero_by_the_rank_of_k() -> None:
    mode = Mode(0.0, 0.0, Kind.RIGID_BODY, EnergyShares({}, {}, {}), 130.0)
    assert known_to(mode) == ("0.00", "")


# --- on the screen --------------------------------------------------------------------------


def test_modes_tell_what_round_off_hides(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """55.46 Hz stood there for 59.99 Hz, known to 130 Hz."""
    assert call("modes", file_with_hub(tmp_path, "1e-12")) == 0
    printed = capsys.readouterr()
    assert "warning: exudyn's eigensolution" in printed.err
    assert "mode 2: < 190 Hz, mode 3: 1099 ± 7.7 Hz" in printed.err
    assert "--route equations" in printed.err
    assert "55.46" not in printed.out
    assert "< 190" in printed.out
    assert "±" in printed.out


@pytest.mark.parametrize("arguments", [["paper"], ["paper-table2", "--route", "equations"]])
def test_modes_known_to_every_digit_have_no_warning(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("modes", *arguments) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert "±" not in printed.out


# --- mode shapes ----------------------------------------------------------------------------


def test_a_perturbed_subspace_turns_no_more_than_allowed() -> None:
    """numpy's eigh of Λ + E, ‖E‖₂ = δ, against Λ's own axes; λ repeated, close, apart."""
    random = np.random.default_rng(4)
    eigenvalues = np.array([0.0, 1.0, 1.0, 1.5, 4.0, 4.3, 30.0, 200.0])
    n = len(eigenvalues)
    exact = RealModes(np.sqrt(eigenvalues), np.eye(n), 1, tuple("abcdefgh"))
    groups = [[0], *mode_groups(exact.natural_frequencies, 1)]
    assert [1, 2] in groups
    tightest = 0.0
    for delta in (1e-3, 0.03, 0.1):
        allowed = allowed_mac_defects(exact, delta)
        for _ in range(300):
            error = random.normal(size=(n, n))
            error += error.T
            error *= delta / np.linalg.norm(error, 2)
            turned = np.linalg.eigh(np.diag(eigenvalues) + error)[1]
            for group in groups:
                mac = subspace_mac(turned[:, group], np.eye(n)[:, group], np.eye(n))
                assert 1.0 - mac <= allowed[group[0]] + 1e-15
                tightest = max(tightest, (1.0 - mac) / allowed[group[0]])
    assert tightest > 0.2  # it is a bound, not a licence
    assert allowed_mac_defects(exact, 0.2)[4] == 1.0  # 0.3 from the next, known to 0.2: any shape
    assert allowed_mac_defects(exact, 1e-9) == [MAC_TOLERANCE] * n


def test_a_hub_next_to_massless_is_no_disagreement() -> None:
    """FRFs and matrices agree to 1e-9; 14 of 30 shapes are not known, and not called equal."""
    result = cross_check(hub(1e-14), COARSE)
    assert result.agrees, [c.findings for c in result.checks if not c.agrees]
    (eigensolution, unjudged) = result.warnings
    assert eigensolution == round_off_warnings(result.modes)[0]
    assert "natural frequencies of mode" in unjudged
    assert "are not compared" in unjudged
    shapes, by_fbs = [c for c in result.checks if c.name == "Mode shapes"]
    assert shapes.routes == ("exudyn", "equations")
    allowed = allowed_mac_defects(equation_real_modes(), eigenvalue_error(result.modes))
    count = sum(value <= KNOWN for value in allowed)
    assert 0 < count < 30
    assert shapes.note == f"{count} of 30 modes compared"
    assert by_fbs.note == ""  # a filter's shapes have none of that round-off
    ordinary = cross_check(load("paper-table2"), COARSE)
    assert ordinary.warnings == ()
    assert all(c.note == "" for c in ordinary.checks if c.name == "Mode shapes")


def equation_real_modes() -> RealModes:
    from fbs import real_modes
    from validation.routes import equations

    return real_modes(equations.drivetrain_system(hub(1e-14)))


def test_run_warns_of_what_it_does_not_compare(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = ["--fmin", "50", "--fmax", "4000", "--df", "50", "--no-time"]
    out = tmp_path / "report"
    assert call("run", file_with_hub(tmp_path, "1e-14"), *lines, "--out", str(out)) == 0
    errors = capsys.readouterr().err
    warned = json.loads((out / "results.json").read_text(encoding="utf-8"))["warnings"]
    assert len(warned) == 2
    assert errors.splitlines() == [f"warning: {warning}" for warning in warned]

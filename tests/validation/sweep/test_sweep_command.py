"""The sweep command: its table, its pictures, what it says; sensitivities."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import find_peaks

from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from validation.cli import main
from validation.errors import CommandError
from validation.routes.bands import Band
from validation.sweep.figures import percentiles
from validation.sweep.parameters import samples_of
from validation.sweep.pieces import Pieces
from validation.sweep.plan import sweep_plan
from validation.sweep.result import SweepResult
from validation.sweep.run import sweep
from validation.sweep.sensitivity import log_slope, sensitivities, spearman

PAIR = ("planetary.sun.w", "reducer.pinion.w")
SPRING = "coupling.second_stiffness"
BAND = Band(5.0, 3000.0, 5.0)


@pytest.fixture(scope="module")
def paper() -> Drivetrain:
    return load("paper")


# Sensitivities


def test_slope_of_a_power_law() -> None:
    p = np.geomspace(1.0, 100.0, 9)
    assert log_slope(p, 3.0 * p**0.5) == pytest.approx(0.5)
    assert log_slope(np.ones(3), p[:3]) == 0.0


def test_rank_correlation() -> None:
    p = np.linspace(1.0, 2.0, 9)
    assert spearman(p, np.exp(p)) == pytest.approx(1.0)
    assert spearman(p, -(p**3)) == pytest.approx(-1.0)
    assert spearman(p, np.full(9, 3.0) + 1e-14 * p) == 0.0


def test_the_ranking_finds_what_matters(paper: Any) -> None:
    found = samples_of(
        paper, ["planetary.carrier.mass=±5%", "reducer.mesh_stiffness=±5%"], samples=20
    )
    todo = sweep_plan(paper, found, BAND, None, 30, "equations")
    result = SweepResult(paper, todo, found, sweep(todo, found.rows))
    by = {(s.metric, s.parameter): s.value for s in sensitivities(result)}
    mesh = [value for (_, parameter), value in by.items() if parameter == "reducer.mesh_stiffness"]
    assert max(mesh) == pytest.approx(1.0)


def test_percentiles_are_those_of_all_lines_at_once() -> None:
    magnitude = 10.0 ** np.random.default_rng(0).normal(size=(40, 1300))
    rows = np.arange(1, 40, 2)
    expected = np.percentile(20 * np.log10(magnitude[rows]), (5, 25, 50, 75, 95), axis=0)
    np.testing.assert_allclose(percentiles(magnitude, rows), expected, rtol=1e-13)


# The command


def run(*arguments: str) -> int:
    try:
        main(["sweep", *arguments])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def fast(out: Path) -> list[str]:
    frf = ["--response", PAIR[0], "--excitation", PAIR[1]]
    return [*frf, "--df", "10", "--fmax", "1000", "--route", "equations", "--out", str(out)]


def test_the_command_writes_table_and_pictures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("paper", "--vary", f"{SPRING}=1e5:1e7:7log", "--modes", "5", *fast(tmp_path)) == 0
    assert "7 of 7 samples computed" in capsys.readouterr().out
    names = {path.name for path in tmp_path.iterdir()}
    figures = {"frf_map.svg", "frequencies.svg", "metrics.svg", "sensitivity.svg"}
    assert names == {"sweep.csv", "sweep.npz", "sweep.html", "sweep.json", *figures}
    with (tmp_path / "sweep.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7
    with np.load(tmp_path / "sweep.npz", allow_pickle=False) as data:
        assert data["magnitude"].shape == (7, 100)
        at = [max(find_peaks(m)[0], key=m.__getitem__) for m in data["magnitude"]]
        peak = 20 * np.log10([m[k] for m, k in zip(data["magnitude"], at, strict=True)])
        np.testing.assert_allclose(data["peak_db"], peak)
        np.testing.assert_allclose([float(row["peak_db"]) for row in rows], peak)
        expected = data["frequency"][at]
        np.testing.assert_array_equal([float(row["peak_hz"]) for row in rows], expected)
        rms = np.sqrt((data["magnitude"] ** 2).mean(axis=1))
        np.testing.assert_allclose(data["rms_m_per_n"], rms)
        np.testing.assert_array_equal(
            [float(row["f2_hz"]) for row in rows], data["natural_frequency_hz"][:, 1]
        )
    assert rows[0]["kind1"] == "rigid-body"


def test_samples_have_bands_and_old_pictures_go(tmp_path: Path) -> None:
    assert run("paper", "--vary", f"{SPRING}=1e5,1e6", *fast(tmp_path)) == 0
    assert (tmp_path / "frf_map.svg").exists()
    options = ["--vary", f"{SPRING}=1e5±10%", "--samples", "6"]
    assert run("paper", *options, *fast(tmp_path)) == 0
    assert (tmp_path / "bands.svg").exists()
    assert not (tmp_path / "frf_map.svg").exists()


def test_a_streamed_command_leaves_the_frfs_in_a_file(tmp_path: Path) -> None:
    options = ["paper", "--vary", f"{SPRING}=1e5±10%", "--samples", "6", *fast(tmp_path)]
    assert run(*options) == 0
    with np.load(tmp_path / "sweep.npz") as data:
        expected = data["magnitude"]
    table, bands = ((tmp_path / name).read_bytes() for name in ("sweep.csv", "bands.svg"))
    assert run(*options, "--stream") == 0
    np.testing.assert_array_equal(np.load(tmp_path / "magnitude.npy"), expected)
    with np.load(tmp_path / "sweep.npz") as data:
        assert "magnitude" not in data
    assert (tmp_path / "sweep.csv").read_bytes() == table
    assert (tmp_path / "bands.svg").read_bytes() == bands
    assert run(*options) == 0
    assert not (tmp_path / "magnitude.npy").exists()


def test_a_stream_that_does_not_fit_the_disk_is_refused(
    paper: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", full, raising=False)
    found = samples_of(paper, [f"{SPRING}=1e5,1e6"])
    todo = sweep_plan(paper, found, BAND, PAIR)
    pieces = Pieces(todo, found.rows, tmp_path, streamed=True)
    with pytest.raises(
        CommandError, match=r"--stream: 0\.1 GB in .*: No space left on device; give"
    ):
        pieces.magnitude((100, 100_000))
    assert list(pieces.directory.iterdir()) == []


def test_a_failing_sample_is_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("paper", "--vary", "planetary.planets=3,40", *fast(tmp_path)) == 0
    assert "sample 1 (planetary.planets = 40): " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--vary", "planetary.planets=40,50"], "all 2 samples failed; sample 0 (planetary.plan"),
        (["--vary", "reducer.pinion.mass=-1"], "pinion.mass = -1"),
        (["--vary", "planetary.planet=3"], "did you mean planetary.planet"),
        (["--vary", "planetary.planets=3", "--response", "planetary.sn.w"], "planetary.sun.w"),
        (["--vary", "planetary.planets=3", "--route", "fbs"], "--route = 'fbs': must be exudyn"),
        (["--vary", "planetary.planets=3", "--modes", "-1"], "--modes = -1"),
        ([], "--vary is missing"),
    ],
)
def test_bad_input_is_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[Any] | list[str], said: str
) -> None:
    assert run("paper", *fast(tmp_path), *options) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--stream"], "--stream: there is no FRF; give --response and --excitation"),
        (["--metric", "peak"], "--metric peak: needs an FRF; give --response and --excitation"),
    ],
)
def test_what_needs_an_frf_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    assert run("paper", "--vary", "planetary.planets=3", "--out", str(tmp_path), *options) == 2
    assert capsys.readouterr().err == f"crosscheck: {said}\n"


def test_one_dof_alone_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--vary", "planetary.planets=3", "--response", PAIR[0], "--out", str(tmp_path)]
    assert run("paper", *options) == 2
    assert "give both, or neither" in capsys.readouterr().err


def test_the_help_shows_the_forms_as_they_are_typed(capsys: pytest.CaptureFixture[str]) -> None:
    """Colons around a word would be drawn as an emoji: a:b:N was."""
    assert run("--help") == 0
    said = capsys.readouterr().out
    assert not any(ord(sign) > 0xFFFF for sign in said)
    assert "from:to:N," in said

"""Metrics of a sweep's samples: what they measure, how they are asked for, where they show."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs import direct_frf
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from validation.cli import main
from validation.errors import CommandError
from validation.routes.bands import Band
from validation.routes.model_parameters import changed, model_data, steps_to
from validation.routes.source import equations_source
from validation.sweep.figures import pictures
from validation.sweep.metrics import Findings, columns, metrics
from validation.sweep.parameters import samples_of
from validation.sweep.plan import sweep_plan
from validation.sweep.result import SweepResult
from validation.sweep.run import sweep
from validation.sweep.sensitivity import sensitivities

PAIR = ("planetary.sun.w", "reducer.pinion.w")
SPRING = "coupling.second_stiffness"
LINES = np.array([10.0, 20.0, 30.0, 40.0, 50.0])
MAGNITUDE = np.array([[1.0, 10.0, 0.1, 100.0, 1.0], [1.0, 1.0, 1.0, 0.5, 0.25]])
FREQUENCIES = np.array([0.0, 70.0, 90.0, 90.0])
KINDS = ("rigid-body", "global", "translational", "translational")


@pytest.fixture(scope="module")
def paper() -> Drivetrain:
    return load("paper")


def found() -> Findings:
    return Findings(LINES, MAGNITUDE, [(FREQUENCIES, KINDS)] * 2, nominal=lambda line: line / 10.0)


@pytest.mark.parametrize(
    ("text", "names", "expected"),
    [
        ("peak", ("peak_db", "peak_hz"), [[40.0, 40.0], [0.0, 10.0]]),
        ("peak:10:30", ("peak_10_30_db", "peak_10_30_hz"), [[20.0, 20.0], [0.0, 10.0]]),
        ("rms:10:20", ("rms_10_20_m_per_n",), [[math.sqrt(50.5)], [1.0]]),
        ("mean:10:40", ("mean_10_40_db",), [[(0 + 20 - 20 + 40) / 4], [5 * math.log10(0.5)]]),
        ("mean:15:25", ("mean_15_25_db",), [[20.0], [0.0]]),
        ("level:30", ("level_30_db",), [[-20.0], [0.0]]),
        # the model as it is has |H| = 4 at 40 Hz here
        ("drop:40", ("drop_40_db",), [[20 * math.log10(0.04)], [20 * math.log10(8.0)]]),
        ("frequency:2", ("frequency_2_hz",), [[70.0], [70.0]]),
        ("frequency:translational:2", ("frequency_translational_2_hz",), [[90.0], [90.0]]),
        ("frequency:rigid-body:1", ("frequency_rigid_body_1_hz",), [[0.0], [0.0]]),
        ("frequency:parallel-stage:1", ("frequency_parallel_stage_1_hz",), [[np.nan], [np.nan]]),
        ("frequency:5", ("frequency_5_hz",), [[np.nan], [np.nan]]),
    ],
)
def test_what_they_measure(text: str, names: tuple[str, str] | tuple[str], expected: Any) -> None:
    (metric,) = metrics([text], LINES)
    assert metric.columns == names
    np.testing.assert_allclose(metric.values(found()), expected, rtol=1e-13)


def test_the_rise_of_a_free_drivetrain_to_0_hz_is_no_peak() -> None:
    lines = np.arange(1.0, 101.0)
    magnitude = 1.0 / lines**2 + 1e-3 / (1.0 + (lines - 60.0) ** 2)
    given = Findings(lines, magnitude[None], [], nominal=abs)
    (metric,) = metrics(["peak"], lines)
    expected = [[20 * math.log10(magnitude[59]), 60.0]]
    np.testing.assert_allclose(metric.values(given), expected, rtol=1e-13)
    (metric,) = metrics(["peak:1:2"], lines)  # too few lines for a peak: the highest
    np.testing.assert_allclose(metric.values(given), [[20 * math.log10(magnitude[0]), 1.0]])


def test_nothing_asked_for_is_peak_and_rms() -> None:
    assert columns(metrics([], LINES)) == ("peak_db", "peak_hz", "rms_m_per_n")
    assert metrics([], None) == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("loudness", "no such metric; must be peak"),
        ("", "no such metric"),
        ("peak:10", "must be peak or peak:F1:F2"),
        ("peak:10:20:30", "must be peak or peak:F1:F2"),
        ("rms:a:20", "'a' is no frequency"),
        ("rms:10:inf", "'inf' is no frequency"),
        ("rms:30:10", "must hold a line"),
        ("mean:11:19", "must hold a line"),
        ("peak:10:60", "lie within the FRF's 10 to 50 Hz"),
        ("level", "must be level:F"),
        ("level:33", "33 Hz is no line of the FRF; the nearest is 30 Hz"),
        ("drop:0", "0 Hz is no line"),
        ("drop:10:20", "must be drop:F"),
        ("frequency", "must be frequency:N"),
        ("frequency:0", "must be frequency:N"),
        ("frequency:-1", "must be frequency:N"),
        ("frequency:torsional:1", "KIND must be one of rigid-body, rotational"),
        ("frequency:global", "must be frequency:N"),
        ("frequency:global:1:2", "must be frequency:N"),
    ],
)
def test_wrong_ones_say_what_is_right(text: str, said: str) -> None:
    with pytest.raises(CommandError, match=f"^--metric {text}: .*{said}"):
        metrics([text], LINES)


def test_metrics_that_do_not_fit() -> None:
    with pytest.raises(CommandError, match="--metric level:10: is given 2 times"):
        metrics(["level:10", "peak", "level:10.0"], LINES)
    with pytest.raises(CommandError, match="peak: needs an FRF; give --response and --excitation"):
        metrics(["peak"], None)
    assert columns(metrics(["frequency:1"], None)) == ("frequency_1_hz",)


def test_against_rebuilt_systems(paper: Any) -> None:
    """Columns of a sweep against direct solves and exudyn's modes of each sample."""
    variation = samples_of(paper, [f"{SPRING}=1e5,2e6", "planetary.planets=3,4"])
    asked = ["level:70", "drop:70", "frequency:translational:1", "frequency:12"]
    todo = sweep_plan(paper, variation, Band(10.0, 100.0, 10.0), PAIR, 0, "exudyn", asked)
    outcome = sweep(todo, variation.rows)
    assert outcome.frequency_hz.shape == (4, 0)
    data = model_data(paper)
    places = [steps_to(data, path) for path in variation.paths]

    def level(drivetrain: Drivetrain) -> float:
        frf = direct_frf(equations_source(drivetrain).whole, [70.0], [PAIR[0]], [PAIR[1]])
        return 20.0 * math.log10(abs(frf.values[0, 0, 0]))

    for values, row in zip(variation.rows, outcome.metrics, strict=True):
        sample = changed(data, dict(zip(places, values, strict=True)))
        modes = drivetrain_modes(sample).modes
        kinds = [str(mode.kind) for mode in modes]
        # a scaled error of 1e-8 is 1e-7 dB; exudyn's own modes are good to 0.004 Hz
        assert row[0] == pytest.approx(level(sample), abs=1e-7)
        assert row[1] == pytest.approx(level(paper) - level(sample), abs=1e-7)
        assert row[2] == pytest.approx(modes[kinds.index("translational")].frequency_hz, rel=1e-6)
        assert row[3] == pytest.approx(modes[11].frequency_hz, rel=1e-6)


def test_they_are_ranked_and_drawn(paper: Any) -> None:
    variation = samples_of(
        paper, ["reducer.mesh_stiffness=~5%", "planetary.sun.mass=±5%"], samples=12
    )
    asked = ["frequency:30", "level:50", "frequency:planet:7"]
    todo = sweep_plan(paper, variation, Band(10.0, 100.0, 10.0), PAIR, 2, "equations", asked)
    result = SweepResult(paper, todo, variation, sweep(todo, variation.rows))
    ranked = {s.metric for s in sensitivities(result)}
    assert {"frequency_30_hz", "level_50_db"} <= ranked
    assert "frequency_planet_7_hz" not in ranked  # no sample has one
    assert "metrics.svg" in {picture.file for picture in pictures(result)}


def test_a_level_is_ranked_by_the_amplitude_it_stands_for(paper: Any) -> None:
    """Far above resonance of the spring H is proportional to its stiffness: slope 1."""
    variation = samples_of(paper, [f"{SPRING}=1e3,1e4"])
    todo = sweep_plan(
        paper, variation, Band(1000.0, 1100.0, 10.0), PAIR, 0, "equations", ["level:1000"]
    )
    result = SweepResult(paper, todo, variation, sweep(todo, variation.rows))
    (slope,) = sensitivities(result)
    # what is left out is the spring against the sun's inertia, 1e4 / (0.39 (2π 1000)²) = 6e-4
    assert slope.value == pytest.approx(1.0, abs=1e-3)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["sweep", "paper", "--vary", f"{SPRING}=1e5:1e7:5log", "--out", str(tmp_path)]
    options += ["--response", PAIR[0], "--excitation", PAIR[1], "--df", "10", "--fmax", "200"]
    asked = ["peak:20:100", "level:70", "frequency:2", "frequency:planet:5"]
    for text in asked:
        options += ["--metric", text]
    with pytest.raises(SystemExit) as end:
        main([*options, "--route", "equations"])
    assert end.value.code == 0
    said = capsys.readouterr().out
    assert "frequency_planet_5_hz: no sample has one" in said
    with (tmp_path / "sweep.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with np.load(tmp_path / "sweep.npz") as data:
        for name in ("peak_20_100_db", "peak_20_100_hz", "level_70_db"):
            np.testing.assert_array_equal([float(row[name]) for row in rows], data[name])
        level = 20 * np.log10(data["magnitude"][:, 6])
        np.testing.assert_allclose(data["level_70_db"], level, rtol=1e-14)
    (row,) = (line for line in said.splitlines() if "level_70_db" in line)
    assert f"{level.min():.6g} │ {SPRING} =" in row
    assert [row["frequency_2_hz"] for row in rows] == [row["f2_hz"] for row in rows]
    assert {row["frequency_planet_5_hz"] for row in rows} == {""}

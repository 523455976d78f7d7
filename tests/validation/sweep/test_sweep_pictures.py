"""What a sweep's pictures and its report show."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from mbs_models.model.model_file import load
from mbs_models.model.parameters import Damping, Drivetrain
from validation.cli import main
from validation.routes.bands import Band
from validation.sweep.axes import families, main_parameter
from validation.sweep.figures import pictures
from validation.sweep.grid_figures import CURVES, LABELLED, PANELS, draw_frfs, draw_metrics
from validation.sweep.metrics import decibels
from validation.sweep.parameters import samples_of
from validation.sweep.plan import sweep_plan
from validation.sweep.result import SweepResult
from validation.sweep.run import sweep

PAIR = ("planetary.sun.w", "reducer.pinion.w")
SPRING = "coupling.second_stiffness"
BAND = Band(10.0, 500.0, 10.0)


@pytest.fixture(scope="module")
def damped() -> Drivetrain:
    return load("paper").model_copy(update={"damping": Damping(stiffness_proportional=1e-6)})


def swept(drivetrain: Drivetrain, *vary: str) -> SweepResult:
    variation = samples_of(drivetrain, vary)
    todo = sweep_plan(
        drivetrain, variation, BAND, PAIR, 2, "equations", ["level:100", "frequency:2"]
    )
    return SweepResult(drivetrain, todo, variation, sweep(todo, variation.rows))


def meshes(figure: Figure) -> list[QuadMesh]:
    return [c for axes in figure.axes for c in axes.collections if isinstance(c, QuadMesh)][:PANELS]


def test_families_differ_in_the_parameter_with_most_values(damped: Any) -> None:
    found = swept(damped, "planetary.planets=5,3", f"{SPRING}=1e6,1e5,1e7")
    assert found.samples.paths[main_parameter(found)] == SPRING
    three, five = families(found, np.arange(6))
    assert (three.label, five.label) == ("planetary.planets = 3", "planetary.planets = 5")
    assert found.values[three.rows].tolist() == [[3, 1e5], [3, 1e6], [3, 1e7]]
    (few,) = families(found, np.array([3]))  # the others failed
    assert few.rows.tolist() == [3]


def test_frfs_of_many_values_are_maps_one_for_each_value_of_the_others(damped: Any) -> None:
    found = swept(damped, f"{SPRING}=1e5:1e7:{CURVES + 1}log", "planetary.planets=3,4")
    figure = Figure()
    draw_frfs(found, figure)
    drawn = [axes.collections[0] for axes in figure.axes[:2]]
    for mesh, family in zip(drawn, families(found, np.arange(14)), strict=True):
        level = decibels(found.results.magnitude[family.rows])
        # fewer lines than the map has columns on a logarithmic axis at its upper end: each column
        # holds the highest of its lines, the lowest lines one each
        np.testing.assert_allclose(np.asarray(mesh.get_array())[:, :5], level[:, :5])
        assert np.asarray(mesh.get_array()).max() == pytest.approx(level.max())
    assert [axes.get_title() for axes in figure.axes[:2]] == [
        "planetary.planets = 3",
        "planetary.planets = 4",
    ]


def test_frfs_of_few_values_are_curves(damped: Any) -> None:
    found = swept(damped, "planetary.planets=3,4,5")
    figure = Figure()
    draw_frfs(found, figure)
    (axes,) = figure.axes
    curves = [line for line in axes.lines if not str(line.get_label()).startswith("_")]  # no ticks
    for line, magnitude in zip(curves, found.results.magnitude, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), decibels(magnitude))
    labels = [f"planetary.planets = {n}" for n in (3, 4, 5)]
    assert [line.get_label() for line in curves] == labels


def test_what_is_not_drawn_is_said(damped: Any) -> None:
    found = swept(damped, f"{SPRING}=1e5:1e7:9log", "reducer.pinion.mass=1:3:8")
    figure = Figure()
    draw_frfs(found, figure)
    assert figure.get_suptitle().endswith(f"{PANELS} of 8 families")


def test_metrics_of_two_parameters_are_curves_or_a_map(damped: Any) -> None:
    few = swept(damped, f"{SPRING}=1e5:1e7:5log", "planetary.planets=3,4")
    figure = Figure()
    draw_metrics(few, figure, {"level_100_db": np.arange(10)})
    for line, family in zip(figure.axes[0].lines, families(few, np.arange(10)), strict=True):
        np.testing.assert_array_equal(line.get_ydata(), few.metrics["level_100_db"][family.rows])
    count = LABELLED + 1
    many = swept(damped, f"{SPRING}=1e5:1e7:{count + 1}log", f"reducer.pinion.mass=1:3:{count}")
    figure = Figure()
    rows = np.arange(1, count * (count + 1))  # the first sample has none
    draw_metrics(many, figure, {"frequency_2_hz": rows})
    drawn = meshes(figure)[0].get_array()
    assert drawn is not None
    shown = np.ma.filled(drawn, np.nan).ravel()
    expected = many.metrics["frequency_2_hz"].reshape(count + 1, count).T.ravel()
    assert np.isnan(shown[0])
    np.testing.assert_array_equal(shown[1:], expected[1:])


def test_many_points_are_an_image_and_many_families_one_curve(
    damped: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mark each of 100 000 samples was 30 MB of SVG."""
    few = swept(damped, f"{SPRING}=1e5:1e7:3log", "reducer.pinion.mass=1:3:4")
    assert "<image" not in {p.file: p.text for p in pictures(few)}["metrics.svg"]
    for module in ("figures", "grid_figures"):
        monkeypatch.setattr(f"validation.sweep.{module}.MANY", 11)
    drawn = {picture.file: picture.text for picture in pictures(few)}
    assert "<image" in drawn["metrics.svg"]
    assert "<image" in drawn["frequencies.svg"]
    many = swept(
        damped, f"{SPRING}=1e5,1e6,1e7", "reducer.pinion.mass=1,2,3", "reducer.wheel.mass=1,2,3,4"
    )
    figure = Figure()
    draw_metrics(many, figure, {"level_100_db": np.arange(36)})
    (curve,) = (line for line in figure.axes[0].lines if len(np.asarray(line.get_xdata())) > 2)
    column = many.metrics["level_100_db"]
    gaps = [[*column[family.rows], np.nan] for family in families(many, np.arange(36))]
    np.testing.assert_array_equal(np.asarray(curve.get_ydata()), np.concatenate(gaps)[:-1])


def test_three_parameters_are_drawn_as_well(damped: Any) -> None:
    found = swept(
        damped, f"{SPRING}=1e5,1e6,1e7", "reducer.pinion.mass=1,2,3", "reducer.wheel.mass=1,2,3"
    )
    files = {picture.file for picture in pictures(found)}
    assert files == {"frf_map.svg", "metrics.svg", "sensitivity.svg", "frequencies.svg"}


def test_the_report_has_every_number_said_and_every_picture(tmp_path: Path) -> None:
    options = ["--response", PAIR[0], "--excitation", PAIR[1], "--df", "10", "--fmax", "500"]
    vary = ["--vary", f"{SPRING}=1e5,1e6", "--vary", "planetary.planets=3,4,0"]
    with pytest.raises(SystemExit, match="0"):
        main(["sweep", "paper", *vary, *options, "--route", "equations", "--out", str(tmp_path)])
    page = (tmp_path / "sweep.html").read_text(encoding="utf-8")
    text = " ".join(
        re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]*>", " ", page, flags=re.S).split()
    )
    assert "4 of 6 samples computed" in text
    assert "2 samples failed" in text
    assert "planetary.planets = 0" in text
    assert (
        f"{SPRING} N/m 100000 100000 1e+06 2" in text
    )  # unit, in the model, lowest, highest, values
    assert "planetary.planets – 4 0 4 3" in text
    assert "no damping: how high a peak is depends on how near a line it lies" in text
    with (tmp_path / "sweep.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))  # a reason may have commas in it, and is quoted then
    assert len(table) == 6
    lowest = min(float(row["rms_m_per_n"]) for row in table if row["status"] == "ok")
    assert f"rms_m_per_n RMS (m/N) {lowest:.6g} {SPRING} = " in text
    assert page.count("<svg") == 4
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert "http://" not in re.sub(r'xmlns(:\w+)?="[^"]*"', "", page)  # needs nothing else

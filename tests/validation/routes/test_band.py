"""Bands from the command line: defaults, and what is refused before anything is made."""

from __future__ import annotations

import itertools
import math
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from fbs import FbsError
from fbs.axes import axis_ends, frequency_axis
from mbs_models.model.model_file import load, preset_names
from tests.validation.command_line import call
from validation.crosscheck.study import report_pairs
from validation.errors import CommandError
from validation.routes import memory
from validation.routes.bands import Band, band, elastic_frequencies, left_out
from validation.routes.routes import comparison_routes
from validation.routes.source import equations_source

PAIR = ["--response", "planetary.sun.w", "--excitation", "reducer.pinion.w"]
SWEEP = ["sweep", "--vary", "reducer.pinion.mass=1:2:3", *PAIR]
COMMANDS = {"run": ["run"], "frf": ["frf", *PAIR], "sweep": SWEEP}


@pytest.mark.parametrize("command", [*COMMANDS, "replace"])
@pytest.mark.parametrize(
    ("option", "value"),
    [*itertools.product(("fmin", "fmax", "df"), ("nan", "inf", "-inf")), ("fmax", "1e300")],
)
def test_no_finite_frequency(
    command: str,
    option: str,
    value: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = COMMANDS.get(command, ["run", "--replace", "planetary=measured.npz"])
    assert call(*arguments, f"--{option}={value}") == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"--{option} = " in error
    assert "must be finite, at most 1e+15 (Hz)" in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "--df", "1e-9"],
        ["run", "--df", "1e-4"],
        ["frf", *PAIR, "--df", "1e-7"],
        ["frf", *PAIR, "--fmax", "1e9", "--df", "1"],
        ["frf", *PAIR, "--fmax", "1e12", "--df", "1"],
        ["frf", "--response", "all", "--excitation", "all", "--df", "1e-3"],
        [*SWEEP, "--df", "1e-9"],
        [*SWEEP, "--df", "1e-9", "--stream"],
    ],
)
def test_what_does_not_fit_is_refused_first(
    arguments: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(*arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "GB of memory, more than 2 GB; give a larger --df" in error
    assert "narrower band" in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("df", ["1e-17", "1e-320"])
def test_a_step_too_small_for_numbers(df: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "--df", df) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "too small" in error


def test_the_default_band_is_1_hz_to_15_khz_for_the_paper() -> None:
    assert band(None, None, None, 30**2) == Band(1.0, 15000.0, 1.0)


@pytest.mark.parametrize("n_frfs", [1, 57**2, 58**2, 200**2, 10**6])
@pytest.mark.parametrize("fmax", [None, 100.0, 1e6, 1.0001e6, 1e9, 1e12, 1e15])
def test_default_steps_are_the_first_round_ones_that_fit(n_frfs: int, fmax: float | None) -> None:
    df = band(None, fmax, None, n_frfs).df
    span = 15000.0 if fmax is None else fmax
    most = min(1e6, 5e7 / n_frfs)
    mantissa, decade = df / 10.0 ** round(math.log10(df)), round(math.log10(df))
    assert decade >= 0
    assert any(mantissa == pytest.approx(round_) for round_ in (0.5, 1.0, 2.0))
    assert span / df <= most * (1 + 1e-12)  # of rounding the quotient
    assert df == 1.0 or span / (df / 2.5) > most * (1 - 1e-12)  # 5 follows 2 by 2.5


@pytest.mark.parametrize(
    ("fmin", "fmax", "df"),
    [(0.0, 0.0, 1.0), (1.0, 15000.0, 1.0), (0.3, 12.9, 0.1), (7.0, 7.0, 7.0)],
)
def test_lines_are_counted_without_being_made(fmin: float, fmax: float, df: float) -> None:
    axis = frequency_axis(fmin, fmax, df)
    first, last = axis_ends(fmin, fmax, df)
    assert Band(fmin, fmax, df).count == last - first + 1 == axis.size
    np.testing.assert_allclose([first * df, last * df], axis[[0, -1]], rtol=1e-15)
    assert Band.of(axis).count == axis.size


@pytest.mark.parametrize(
    "limits",
    [(0.0, math.nan, 1.0), (0.0, 1.0, 0.0), (2.0, 1.0, 1.0), (0.0, 1.5, 1.0), (0, 1, 1e-17)],
)
def test_what_is_no_axis_has_no_count(limits: tuple[float, float, float]) -> None:
    with pytest.raises(FbsError):
        _ = Band(*limits).count


def test_the_limit_itself_is_allowed() -> None:
    memory.require_memory(Band(1.0, 1000.0, 1.0), 2e6, "it")
    with pytest.raises(CommandError, match=r"^1000 lines of it take 2 GB of memory, more than 2"):
        memory.require_memory(Band(1.0, 1000.0, 1.0), 2.001e6, "it")


@pytest.mark.parametrize("name", preset_names())
def test_no_report_has_more_curves_than_counted(name: str) -> None:
    drivetrain = load(name)
    model = equations_source(drivetrain)
    routes = 1 + len(comparison_routes(model, model))
    curves = memory.run_bytes(drivetrain) / memory.BYTES_PER_CURVE_VALUE
    assert len(report_pairs(drivetrain)) * routes <= curves


def test_frfs_are_counted_as_they_are_computed() -> None:
    drivetrain = load("paper")  # 30 labels
    one, two = ["coupling.w"], ["coupling.w", "planetary.sun.w"]
    assert memory.frf_count(drivetrain, "exudyn", one, two) == 2
    assert memory.frf_count(drivetrain, "fbs", one, two) == 2
    assert memory.frf_count(drivetrain, "equations", None, two) == 60
    assert memory.frf_count(drivetrain, "fbs", None, two) == 900  # coupled whole, then selected
    assert memory.frf_count(drivetrain, "exudyn", None, None, "reducer") == 9**2  # and the hub
    with pytest.raises(CommandError, match="--stage = 'planetry'"):
        memory.frf_count(drivetrain, "exudyn", None, None, "planetry")


def peak(*arguments: str) -> int:
    tracemalloc.start()
    try:
        assert call(*arguments) == 0
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


MEASURED = {
    "one": ([*PAIR, "--output", "x.npz"], 1),
    "one converted": ([*PAIR, "--quantity", "accelerance", "--output", "x.csv"], 1),
    "one to UFF": ([*PAIR, "--output", "x.uff"], 1),
    "one by FBS": ([*PAIR, "--route", "fbs", "--output", "x.npz"], 1),
    "all": (["--response", "all", "--excitation", "all", "--output", "x.npz"], 900),
    "all converted": (
        ["--response", "all", "--excitation", "all", "--quantity", "mobility", "--output", "x.npz"],
        900,
    ),
    "all by FBS": (
        ["--response", "all", "--excitation", "all", "--route", "fbs", "--output", "x.npz"],
        900,
    ),
    "drawn": (["--response", "all", *PAIR[2:], "--output", "x.png"], 30),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", MEASURED)
def test_frf_holds_no_more_than_is_counted(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the growth from one band to another, which leaves out what does not grow with it."""
    monkeypatch.chdir(tmp_path)
    arguments, n_frfs = MEASURED[case]
    step = 0.5 if n_frfs < 900 else 5.0
    few, many = (peak("frf", *arguments, "--df", str(df)) for df in (step, step / 2))
    held = memory.frf_bytes(n_frfs, drawn=case == "drawn") * 15000 / step
    assert many - few <= held


@pytest.mark.slow
def test_run_holds_no_more_than_is_counted(tmp_path: Path) -> None:
    arguments = ["run", "--no-time", "--out", str(tmp_path), "--fmax", "6000", "--df"]
    peak(*arguments, "10")  # what is imported stays
    # all it holds, not its growth: when garbage is collected moves a peak by some 15 MB
    assert peak(*arguments, "0.25") <= memory.run_bytes(load("paper")) * 24000


# --- what default lines leave out ------------------------------------------------------------

TWO = """
name = "two discs"
[[inertia]]
name = "a"
radius = 1.0
polar_inertia = 1000.0
[[inertia]]
name = "b"
radius = 1.0
polar_inertia = 1000.0
[[coupling]]
name = "s"
first = "a"
second = "b"
radius = 1.0
inertia = 1.0
first_stiffness = {0}
second_stiffness = {0}
"""


@pytest.mark.parametrize(
    ("stiffness", "words", "lines"),
    [
        # both springs in a row carry the discs: f = sqrt(2 (k/2) / m) / 2 pi, up to the hub's 1 kg
        ("1e4", "1 of its 2 elastic modes is", "0.05:2:0.05"),  # 0.503 and 22.5 Hz
        ("1e2", "2 of its 2 elastic modes are", "0.005:5:0.005"),  # 0.0503 and 2.25 Hz
        ("4e6", "", ""),  # 10.1 Hz
    ],
)
def test_modes_that_default_lines_do_not_show(
    stiffness: str,
    words: str,
    lines: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "two.toml"
    path.write_text(TWO.format(stiffness))
    pair = ["--response", "a.w", "--excitation", "a.w"]
    first, last, step = lines.split(":") if lines else ("", "", "")
    hint = f"--fmin {first} --fmax {last} --df {step}"
    commands = {
        "frf": [*pair, "--output", str(tmp_path / "x.npz")],
        "run": ["--no-time", "--out", str(tmp_path / "run")],
        "truncate": ["--out", str(tmp_path / "truncate")],
        "sweep": ["--vary", "a.polar_inertia=1:2:3", *pair, "--out", str(tmp_path / "sweep")],
    }
    for command, options in commands.items():
        call(command, str(path), *options)
        told = capsys.readouterr().err
        if not words:
            assert "not resolved" not in told
            continue
        shown = f"--band {lines}" if command == "truncate" else hint
        assert f"{words} not resolved by the default lines, 1 Hz apart from 1 Hz on: " in told
        assert f"{shown} shows what they leave out" in told
    if words:
        call("frf", str(path), *commands["frf"], *hint.split())
        assert "not resolved" not in capsys.readouterr().err
        found = elastic_frequencies(equations_source(load(str(path))).whole)
        low = found[found < 10.0]
        assert ((low > 10.0 * float(first)) & (low < float(last))).all()


def test_lines_that_were_chosen_are_meant() -> None:
    low = np.array([0.0, 0.5, 50.0])
    assert left_out(band(None, None, None), low) != ()
    assert left_out(band(1.0, None, 1.0), low) == ()
    assert left_out(Band.of(np.array([1.0, 2.0])), low) == ()
    (sentence,) = left_out(band(1.0, None, None), low)
    assert sentence.startswith("1 of its 3 elastic modes is not resolved")

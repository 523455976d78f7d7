"""The command line's contract: what it prints, what it writes, and its exit codes."""

from __future__ import annotations

import csv
import errno
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.core import TyperGroup

from fbs import direct_frf, frequency_axis
from mbs_models.model.model_file import load, preset_names, template
from mbs_models.model.parameters import Drivetrain, ParallelStage
from tests.strategies import changed, paper, with_stage
from tests.validation.command_line import call
from validation import cli
from validation.routes import equations, multibody

BAND = ["--fmin", "10", "--fmax", "4000", "--df", "10"]


@pytest.fixture
def model_file(tmp_path: Path) -> Path:
    path = tmp_path / "gear.toml"
    path.write_text(template("paper"), encoding="utf-8")
    return path


def test_run_agrees_and_writes_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("run", "paper", "--out", str(tmp_path), *BAND) == 0
    printed = capsys.readouterr().out
    assert "All routes agree: 900 FRFs" in printed
    assert "<html" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))


def perturbed_bearing(drivetrain: Drivetrain) -> Drivetrain:
    (reducer,) = drivetrain.stages_of(ParallelStage)
    pinion = changed(reducer.pinion, bearing_y=3.535e8)
    return with_stage(drivetrain, "reducer", pinion=pinion.model_dump())


def test_run_catches_a_wrong_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    build = equations.drivetrain_system, equations.stage_system
    monkeypatch.setattr(equations, "drivetrain_system", lambda d: build[0](perturbed_bearing(d)))
    monkeypatch.setattr(equations, "stage_system", lambda d, n: build[1](perturbed_bearing(d), n))
    assert call("run", "--out", str(tmp_path), *BAND) == 1
    printed = capsys.readouterr().out
    assert "DISAGREE" in printed
    assert "stiffness at reducer.pinion.y: 5.5e8 against 5.535e8 N/m" in printed
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "reducer.pinion.y" in html
    assert "disagree" in html.lower()


@pytest.mark.parametrize("route", ["exudyn", "equations"])
def test_modes_json(route: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("modes", "paper", "--route", route, "--json") == 0
    data = json.loads(capsys.readouterr().out)
    assert data["model"] == "paper"
    assert data["route"] == route
    frequencies = [mode["frequency_hz"] for mode in data["modes"]]
    assert len(frequencies) == 30
    assert frequencies == sorted(frequencies)
    assert data["modes"][0]["kind"] == "rigid-body"
    assert frequencies[0] == 0.0
    assert data["modes"][1]["kind"] == "global"
    assert frequencies[1] == pytest.approx(42.11, abs=0.01)
    assert all(mode["damping_ratio"] == 0.0 for mode in data["modes"])


def test_modes_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("modes", "lin-parker-5") == 0
    printed = capsys.readouterr().out
    assert "14253.09" in printed  # printed 14253.1 by Lin & Parker
    assert "translational" in printed


def test_frf_of_every_route_in_a_npz(tmp_path: Path) -> None:
    found = {}
    for route in ("exudyn", "fbs", "equations"):
        path = tmp_path / f"{route}.npz"
        arguments = ["--response", "planetary.sun.u,coupling.w", "--response", "reducer.pinion.w"]
        arguments += ["--excitation", "reducer.pinion.w", "--route", route, "--output", str(path)]
        assert call("frf", "paper", *arguments, *BAND) == 0
        found[route] = np.load(path)
        assert list(found[route]["responses"]) == [
            "planetary.sun.u", "coupling.w", "reducer.pinion.w",
        ]  # fmt: skip
        assert list(found[route]["excitations"]) == ["reducer.pinion.w"]
    frequency = frequency_axis(10.0, 4000.0, 10.0)
    reference = direct_frf(multibody.drivetrain_system(paper()), frequency)
    for data in found.values():
        np.testing.assert_array_equal(data["frequency"], frequency)
        for i, response in enumerate(data["responses"]):
            expected = reference.between(response, "reducer.pinion.w")
            # sun u is zero by symmetry: what is left there is round-off of the largest values
            error = np.abs(data["values"][:, i, 0] - expected)
            assert np.all(error <= 1e-8 * np.abs(reference.values).max(axis=(1, 2)))


@pytest.mark.parametrize(
    ("quantity", "unit"),
    [("receptance", "m/N"), ("mobility", "m/s/N"), ("accelerance", "m/s^2/N")],
)
def test_frf_quantity_in_a_csv(
    quantity: str, unit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fbs.files.tables.ROWS", 150)  # 400 lines: a part is left over
    path = tmp_path / "frf.csv"
    dof = "reducer.pinion.y"
    arguments = ["--response", dof, "--excitation", dof, "--quantity", quantity]
    assert call("frf", "paper", *arguments, "--output", str(path), *BAND) == 0
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    name = f"{quantity} {dof} <- {dof} ({unit})"
    assert header == ["frequency_hz", f"re {name}", f"im {name}"]
    assert len(rows) == 400
    frequency, real, imaginary = np.array(rows, dtype=float).T
    system = multibody.drivetrain_system(paper())
    expected = direct_frf(system, frequency, [dof], [dof]).to(quantity).between(dof, dof)
    np.testing.assert_allclose(real + 1j * imaginary, expected, rtol=1e-9)


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf"])
def test_frf_pictures(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"frf{ending}"
    dof = "planetary.sun.w"
    arguments = ["--response", dof, "--excitation", dof, "--output", str(path)]
    assert call("frf", "paper", *arguments, *BAND) == 0
    assert path.stat().st_size > 1000


@pytest.mark.parametrize("ending", [".NPZ", ".Csv", ".UFF", ".PNG"])
def test_endings_in_capitals(ending: str, tmp_path: Path) -> None:
    assert call("frf", "paper", *DOFS, "--output", str(tmp_path / f"frf{ending}"), *BAND) == 0
    assert [path.name for path in tmp_path.iterdir()] == [f"frf{ending}"]


UNWRITABLE = {
    "long name": (f"{'x' * 300}.npz", "File name too long"),
    "below a file": ("file/frf.npz", "the directory does not exist"),
    "directory": ("taken.npz", "is a directory"),
}


# Directories that take no file; made up, since nothing is read-only for root.
REFUSED = {
    "read-only": (errno.EACCES, "Permission denied"),
    "proc": (errno.ENOENT, "No such file or directory"),
}


@pytest.mark.parametrize("kind", [*UNWRITABLE, *REFUSED])
def test_an_output_that_cannot_be_written_is_told_first(
    kind: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("taken.npz").mkdir()
    output, words = UNWRITABLE.get(kind, ("frf.npz", ""))
    if kind in REFUSED:
        number, words = REFUSED[kind]

        def refused(*_: object, **__: object) -> None:
            raise OSError(number, os.strerror(number))

        monkeypatch.setattr("fbs.files.whole_files._beside", refused)

    def computed(*_: object) -> None:
        raise AssertionError("computed before the file was looked at")

    monkeypatch.setattr("validation.routes.routes.frf_by_name", computed)
    assert call("frf", *DOFS, "--output", output) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"--output = {output}: " in error
    assert words in error


def test_a_failure_while_writing_leaves_the_earlier_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "frf.npz"
    path.write_text("earlier", encoding="utf-8")

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    assert call("frf", *DOFS, "--output", str(path), *BAND) == 2
    assert f"{path}: cannot be written: No space left" in capsys.readouterr().err
    assert path.read_text(encoding="utf-8") == "earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_frf_on_the_screen(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--response", "planetary.sun.w", "--excitation", "reducer.pinion.w"]
    assert call("frf", *arguments, *BAND) == 0
    printed = capsys.readouterr().out
    assert "planetary.sun.w ← reducer.pinion.w: receptance, dB re 1 m/N" in printed
    assert "4000 Hz" in printed


def test_presets_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("presets") == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in preset_names())


def test_new_writes_a_file_that_checks_and_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.toml"
    assert call("new", str(path), "--from", "lin-parker-3") == 0
    assert load(path) == load("lin-parker-3")
    assert call("check", str(path)) == 0
    assert "planetary, 3 planets" in capsys.readouterr().out
    assert call("new", str(path)) == 2
    assert "exists already" in capsys.readouterr().err


def test_from_nothing_to_margins_in_three_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, out = str(tmp_path / "gearbox.toml"), tmp_path / "report"
    assert call("new", model, "--for", "motor, parallel,planetary,load") == 0
    assert call("modes", model) == 0
    assert "31" in capsys.readouterr().out  # 1 + 8 + 18 + 1 DoFs and three shafts
    assert call("run", model, "--out", str(out), "--no-time", "--df", "50") == 0
    printed = capsys.readouterr().out
    assert "motor at 1450 rpm: nearest resonances" in printed
    assert "All routes agree: 961 FRFs" in printed
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Campbell diagram" in page
    assert call("new", model + "2", "--for", "load", "--from", "paper") == 2
    assert "--for and --from" in capsys.readouterr().err


def examples() -> list[tuple[str, list[str]]]:
    """Command → the words of its help's example."""
    group = typer.main.get_command(cli.app)
    assert isinstance(group, TyperGroup)
    return [
        (name, shlex.split((command.epilog or "").removeprefix("Example: crosscheck ")))
        for name, command in group.commands.items()
    ]


@pytest.mark.parametrize(("name", "words"), examples())
def test_the_example_in_a_commands_help_is_understood(
    name: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each names its command and only options that it has; what is quick is run."""
    assert words[:1] == [name]
    if ">" in words:
        words = words[: words.index(">")]
    monkeypatch.chdir(tmp_path)
    group = typer.main.get_command(cli.app)
    assert isinstance(group, TyperGroup)
    group.commands[name].make_context(name, words[1:])
    if name in ("modes", "frf", "presets", "check", "schema", "inspect"):
        assert call("new", "gearbox.toml") == 0
        frf = ["frf", "gearbox.toml", "--response", "load.w", "--excitation", "motor.w"]
        assert call(*frf, "--df", "100", "--output", "measured.uff") == 0
        assert call(*words) == 0


def test_an_unconnected_stage_is_a_warning(
    model_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = model_file.read_text(encoding="utf-8")
    model_file.write_text(text[: text.index("[[coupling]]")], encoding="utf-8")
    assert call("check", str(model_file)) == 0
    warning = capsys.readouterr().err
    assert "warning: " in warning
    assert "not connected" in warning
    assert "rigid-body" in warning


BAD_MODELS = {
    "missing key": ('mesh_stiffness = 2.0e8', "", ["mesh_stiffness", "missing"]),
    "unknown key": ("mesh_stiffness =", "mesh_stifness =", ["mesh_stifness", "mesh_stiffness"]),
    "both of a pair": (
        "polar_inertia_over_r2 = 1.16,",
        "polar_inertia_over_r2 = 1.16, polar_inertia = 0.1,",
        ["polar_inertia", "polar_inertia_over_r2", "1.16"],
    ),
    "neither of a pair": (
        "polar_inertia_over_r2 = 1.16,", "", ["polar_inertia", "polar_inertia_over_r2"],
    ),
    "zero mass": ("mass = 2.0", "mass = 0.0", ["mass", "0.0", "greater than 0"]),
    "negative mass": ("mass = 2.0", "mass = -2.0", ["mass", "-2.0", "greater than 0"]),
    "negative stiffness": ("bearing_y = 3.5e8", "bearing_y = -1.0", ["bearing_y", "at least 0"]),
    "NaN": ("bearing_y = 3.5e8", "bearing_y = nan", ["bearing_y", "nan"]),
    "one planet": ("planets = 4", "planets = 1", ["planets", "1", "at least 2"]),
    "overlapping planets": ("planets = 4", "planets = 7", ["planets", "7", "overlap"]),
    "planets at one place": (
        "planets = 4", "planet_angles = [0, 90, 450, 270]", ["planet_angles", "same place"],
    ),
    "contradicting radius": (
        "ring    = {", "ring    = { base_radius = 0.2,", ["ring.base_radius", "0.2", "0.1391"],
    ),
    "coupling to nothing": (
        '"planetary.sun"', '"planetary.sum"', ["planetary.sum", "planetary.sun"],
    ),
    "broken TOML": ("[[stage]]", "[[stage]", ["TOML", "line"]),
}  # fmt: skip


@pytest.mark.parametrize("fault", BAD_MODELS)
@pytest.mark.parametrize("command", ["run", "check", "modes"])
def test_bad_models_end_with_one_message(
    command: str, fault: str, model_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new, words = BAD_MODELS[fault]
    text = model_file.read_text(encoding="utf-8")
    assert old in text
    model_file.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert call(command, str(model_file)) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert "gear.toml" in captured.err
    for word in words:
        assert word in captured.err
    assert captured.out == ""


@pytest.mark.parametrize("kind", ["missing", "empty", "directory", "binary"])
def test_unreadable_models(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gear.toml"
    if kind == "empty":
        path.touch()
    elif kind == "directory":
        path.mkdir()
    elif kind == "binary":
        path.write_bytes(bytes(range(256)))
    assert call("run", str(path)) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "gear.toml" in error


DOFS = ["--response", "planetary.sun.w", "--excitation", "planetary.sun.w"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["frf", "--response", "planetary.sun.q", *DOFS[2:]], ["planetary.sun.q", "planetary.sun"]),
        (["frf", "--response", "planetary.sun.w"], ["--excitation"]),
        (["frf", *DOFS, "--route", "guess"], ["--route", "guess", "exudyn, fbs or equations"]),
        (["frf", *DOFS, "--quantity", "force"], ["force", "receptance"]),
        (["frf", *DOFS, "--output", "curve.xyz"], ["curve.xyz", ".npz"]),
        (["frf", *DOFS, "--output", "/nowhere/curve.npz"], ["/nowhere", "does not exist"]),
        (["frf", *DOFS, "--df", "0"], ["df"]),
        (["frf", *DOFS, "--fmin", "100", "--fmax", "10"], ["fmin", "fmax"]),
        (["frf", *DOFS, "--fmin", "0", "--fmax", "10"], ["0 Hz"]),
        (["modes", "--route", "fbs"], ["--route", "fbs", "exudyn or equations"]),
        (["modes", "papper"], ["papper", "paper"]),
        (["run", "--df", "nan"], ["df"]),
        (["new", "x.toml", "--from", "papper"], ["papper", "paper"]),
    ],
)  # fmt: skip
def test_bad_commands_end_with_one_message(
    arguments: list[str], words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(*arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    for word in words:
        assert word in error


def test_bad_input_leaves_an_earlier_report_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("report.html", "results.json"):
        (tmp_path / name).write_text("earlier", encoding="utf-8")
    assert call("run", "papper", "--out", str(tmp_path)) == 2
    assert call("run", "paper", "--out", str(tmp_path), "--df", "-1") == 2
    for name in ("report.html", "results.json"):
        assert (tmp_path / name).read_text(encoding="utf-8") == "earlier"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html", "results.json"]


@pytest.mark.parametrize("command", ["run", "paper"])
def test_a_report_that_cannot_be_written_is_told_first(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "taken").write_text("a file", encoding="utf-8")
    assert call(command, "--out", str(tmp_path / "taken")) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "taken: is, or lies below, a file" in error
    assert (tmp_path / "taken").read_text(encoding="utf-8") == "a file"


def test_importing_loads_nothing_heavy() -> None:
    """exudyn, matplotlib and the like are loaded where they are used, not by the packages."""
    script = (
        "import sys, mbs_models, fbs, validation, validation.cli; "
        "print([m for m in ('exudyn', 'matplotlib', 'pydantic', 'jinja2') if m in sys.modules])"
    )
    printed = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout
    assert printed.strip() == "[]"

"""Exit codes, one message, and that a refused command writes nothing and spoils nothing.

0, agreed or done, is asserted of every command line that `pins` runs.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .pins import MODELS, call

PAIR = str(MODELS / "pair.toml")
DOF = "planetary.sun.w"
FRF = ("frf", "lin-parker-3", "--response", DOF, "--excitation", DOF)
SWEEP = ("sweep", PAIR, "--vary", "pair.mesh_stiffness=1e8:3e8:3", "--out", "out")
SPEED = ("speed", PAIR, "--speed", "600,900", "--out", "out")
RESULTS = (
    *(f"{name}.html" for name in ("report", "paper", "simulation", "speed", "sweep")),
    *("results.json", "paper.json", "simulation.json", "speed.json", "speed.npz"),
    *("sweep.csv", "sweep.npz", "record.npz", "record.csv", "frf.npz", "new.toml"),
)

REFUSED = {
    "no such command": (("rnu",), "rnu"),
    "run: no such option": (("run", "--fmn", "3"), "--fmn"),
    "run: no number": (("run", "--df", "fine", "--out", "out"), "--df"),
    "run: out of range": (("run", "--df", "-1", "--out", "out"), "df"),
    "run: no such model": (("run", "papper", "--out", "out"), "papper"),
    "run: broken model": (("run", "broken.toml", "--out", "out"), "broken.toml"),
    "run: no such part": (("run", "--replace", "gear=x.npz", "--out", "out"), "gear"),
    "run: no such file": (("run", "--replace", "planetary=x.npz", "--out", "out"), "x.npz"),
    "run: below a file": (("run", "--out", "out/report.html"), "report.html"),
    "modes: route": (("modes", "--route", "fbs"), "--route"),
    "modes: a word too many": (("modes", "paper", "two"), "two"),
    "frf: no excitation": (FRF[:4], "--excitation"),
    "frf: no such DoF": ((*FRF[:5], "planetary.sun.q"), "planetary.sun.q"),
    "frf: ending": ((*FRF, "--output", "out/frf.xyz"), "frf.xyz"),
    "frf: band": ((*FRF, "--fmin", "9", "--fmax", "1", "--output", "out/frf.npz"), "fmin"),
    "paper: no such item": (("paper", "--only", "fig99", "--out", "out"), "fig99"),
    "paper: tolerance": (("paper", "--tolerance", "much", "--out", "out"), "--tolerance"),
    "sweep: nothing varied": (("sweep", PAIR, "--out", "out"), "--vary"),
    "sweep: no such path": (("sweep", "--vary", "gear.mass=1,2", "--out", "out"), "gear.mass"),
    "sweep: metric": ((*SWEEP, "--metric", "peak"), "--metric"),
    "sweep: workers": ((*SWEEP, "--workers", "0"), "--workers"),
    "simulate: format": (("simulate", "--save", "xls", "--out", "out"), "--save"),
    "simulate: type": (("simulate", "--excitation", f"bang@{DOF}", "--out", "out"), "bang"),
    "simulate: duration": (("simulate", "--duration", "-1", "--out", "out"), "duration"),
    "speed: no model": (("speed",), "MODEL"),
    "speed: no operation": (("speed", "lin-parker-3", "--out", "out"), "[operation]"),
    "speed: speeds": ((*SPEED[:2], "--speed", "fast", "--out", "out"), "--speed"),
    "speed: check": ((*SPEED, "--check", "0"), "--check"),
    "new: there already": (("new", "out/new.toml"), "new.toml"),
    "new: no such preset": (("new", "out/other.toml", "--from", "papper"), "papper"),
    "check: broken model": (("check", "broken.toml"), "broken.toml"),
    "schema: a word too many": (("schema", "two"), "two"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_2_and_one_message(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text('name = "Broken"\n[[stage]]\ntype = "worm"\n', encoding="utf-8")
    Path("out").mkdir()
    for name in RESULTS:
        Path("out", name).write_text("earlier", encoding="utf-8")
    arguments, word = REFUSED[case]
    called = call(*arguments)
    assert called.code == 2
    assert called.out == ""
    assert called.err.count("\n") == 1
    assert called.err.startswith("crosscheck")
    assert word in called.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["broken.toml", "out"]
    assert sorted(path.name for path in Path("out").iterdir()) == sorted(RESULTS)
    assert {path.read_text(encoding="utf-8") for path in Path("out").iterdir()} == {"earlier"}


def test_no_command_is_2_and_the_help() -> None:
    called = call()
    assert called.code == 2
    assert "Usage: crosscheck" in called.out
    assert called.err == ""


def test_a_disagreement_is_1_and_reported(tmp_path: Path) -> None:
    """2 kN at each line turn gears by milliradians: FBS, which is linear, does not apply."""
    force = f"multisine@{DOF}:fmin=200,fmax=2000,df=200,amplitude=2000"
    asked = ("--excitation", force, "--response", f"{DOF},planetary.planet1.u", "--once")
    called = call("simulate", "lin-parker-3", *asked, "--out", str(tmp_path))
    assert called.code == 1
    assert "DISAGREE" in called.out
    found = json.loads((tmp_path / "simulation.json").read_text(encoding="utf-8"))
    assert found["agrees"] is False
    assert [check for check in found["checks"] if not check["agrees"] and check["findings"]]
    assert "do not agree" in (tmp_path / "simulation.html").read_text(encoding="utf-8")


def test_what_is_done_is_0(tmp_path: Path) -> None:
    """Commands that only print or write a model file."""
    model = str(tmp_path / "mine.toml")
    written = ("new", model, "--from", "lin-parker-3")
    for arguments in (("--version",), ("presets",), written, ("check", model)):
        called = call(*arguments)
        assert called.code == 0, called
        assert called.out
    assert call("check", PAIR).code == 0

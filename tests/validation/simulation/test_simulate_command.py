"""The contract of `crosscheck simulate`: exit codes, one message, what is written and resumed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fbs.files.record_files import read_record
from validation import cli
from validation.report import command

W = "planetary.sun.w"
MULTISINE = f"multisine@{W}:fmin=50,fmax=2000,df=50"
# 1.1 s are 40 000 samples at this band's rate: two pieces of 20 000 steps.
NOISE = ("--excitation", f"noise@{W}:fmax=2000", "--duration", "1.1", "--response", W, "--once")


def simulate(*arguments: str) -> int:
    """Run the command in this process; returns the exit code."""
    try:
        cli.main(["simulate", *arguments])
    except SystemExit as exit_:
        return int(exit_.code or 0)
    return 0


def strict(text: str) -> Any:
    """JSON without NaN and Infinity, which the standard does not know."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


# --- what agrees, disagrees and is written ------------------------------------------------------


@pytest.fixture(scope="module")
def agreed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a multisine's report, numbers and records."""
    out = tmp_path_factory.mktemp("agreed")
    saved = [word for name in ("npz", "csv", "uff") for word in ("--save", name)]
    assert simulate("lin-parker-4", "--excitation", MULTISINE, "--out", str(out), *saved) == 0
    return out


def test_only_what_was_asked_for_is_left(agreed: Path) -> None:
    names = {path.name for path in agreed.iterdir()}
    assert names == {
        "simulation.html", "simulation.json", "record.npz", "record.csv", "record.uff",
    }  # fmt: skip


def test_the_numbers_are_strict_json_and_complete(agreed: Path) -> None:
    found = strict((agreed / "simulation.json").read_text(encoding="utf-8"))
    assert found["agrees"] is True
    assert found["model"] == "Planetary stage, 4 planets"
    assert found["samples"] == round(0.04 * found["sampling_frequency_hz"])  # two periods
    assert [check["agrees"] for check in found["checks"]] == [True, True]
    (frfs,) = found["frfs"]
    assert frfs["lines"] == 40
    assert frfs["excitations"] == [W]
    # Symmetry keeps u and v of the central bodies still under a moment: 21 DoFs less 6.
    assert len(frfs["responses"]) == len(frfs["worst_db"]) == 15
    assert set(found["timings_s"]) >= {"time integration", "reversed run"}


@pytest.mark.parametrize("name", ["npz", "csv", "uff"])
def test_records_are_read_back(agreed: Path, name: str) -> None:
    record, _ = read_record(agreed / f"record.{name}")
    exact, metadata = read_record(agreed / "record.npz")
    assert "Planetary stage, 4 planets" in str(metadata)
    assert record.excitations == (W,)
    assert len(record.responses) == 21
    # A text keeps 9 digits or more; so do universal files in double precision.
    scale = np.abs(exact.outputs).max()
    assert np.abs(record.outputs - exact.outputs).max() <= 1e-8 * scale
    assert record.sampling_frequency == pytest.approx(exact.sampling_frequency, rel=1e-9)
    # The multisine itself: lines of 0.1 N each.
    size = round(0.02 * exact.sampling_frequency)
    lines = 2.0 * np.abs(np.fft.rfft(exact.inputs[:size, 0])) / size
    assert lines[1:41] == pytest.approx(0.1, rel=1e-9)


def test_a_disagreement_ends_in_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """2 kN at each line turn gears by milliradians: not linear, and told as that."""
    strong = f"{MULTISINE},amplitude=2000"
    assert simulate("lin-parker-4", "--excitation", strong, "--out", str(tmp_path)) == 1
    printed = capsys.readouterr().out
    assert "DISAGREE" in printed
    assert "At a tenth of the force" in printed
    assert strict((tmp_path / "simulation.json").read_text(encoding="utf-8"))["agrees"] is False


def test_a_response_kept_still_by_symmetry_is_not_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = ("--response", "planetary.sun.u")
    assert simulate(
        "lin-parker-4", "--excitation", MULTISINE, *still, "--out", str(tmp_path)
    ) == 0  # fmt: skip
    assert "no response moves under these forces" in capsys.readouterr().out


# --- bad input ----------------------------------------------------------------------------------

ASKED = ("--excitation", MULTISINE)
BAD = {
    "excited DoF": (
        ("--excitation", "multisine@planetary.sun.q"),
        "'planetary.sun.q': not a DoF of this drivetrain",
    ),
    "response": ((*ASKED, "--response", "planetary.sun.q"), "response 'planetary.sun.q'"),
    "Nyquist": ((*ASKED, "--sampling", "3000"), "half the sampling frequency"),
    "short": ((*ASKED, "--duration", "0.01"), "shorter than one period of 0.02 s"),
    "no duration": (
        ("--excitation", f"impulse@{W}", "--duration", "0"), "duration = 0 s: must be finite",
    ),
    "duration below 0": (
        ("--excitation", f"impulse@{W}", "--duration", "-1"), "duration = -1 s: must be finite",
    ),
    "amplitude": (("--excitation", f"{MULTISINE},amplitude=0"), "amplitude = 0: must be"),
    "amplitude NaN": (("--excitation", f"{MULTISINE},amplitude=nan"), "amplitude"),
    "unstable": ((*ASKED, "--integrator", "RK44", "--step", "1e-4"), "RK44 is stable below"),
    "integrator": ((*ASKED, "--integrator", "euler"), "integrator 'euler': must be"),
    "step": ((*ASKED, "--step", "nan"), "step: must be above 0 s, got nan"),
    "fmax": ((*ASKED, "--fmax", "100"), "fmax = 100 Hz: the excitation reaches 2000 Hz"),
    "fmax NaN": ((*ASKED, "--fmax", "nan"), "--fmax = nan: must be finite"),
    "type": (("--excitation", f"chirp@{W}"), 'type = "chirp": must be'),
    "key": (("--excitation", f"{MULTISINE},color=3"), "color = 3: unknown key"),
    "no file": (("--excitation", f"record@{W}:file=none.csv"), "cannot be read"),
    "levels": ((*ASKED, "--levels", "1,x"), "--levels = '1,x': must be 1,10,100"),
    "level 0": ((*ASKED, "--levels", "0,1"), "every level must be finite and above 0"),
    "levels from below 0": ((*ASKED, "--levels", "-1:10:3log"), "every level must be finite"),
    "no levels": ((*ASKED, "--levels", "1:10:0"), "must be 1,10,100 or 1:1000:7log"),
    "levels of noise": (
        ("--excitation", f"noise@{W}", "--duration", "1", "--levels", "1,2"), "is no multisine",
    ),
    "levels of two": (
        (*ASKED, "--excitation", "multisine@planetary.sun.u", "--levels", "1,2"),
        "2 excitations are given",
    ),
    "format": ((*ASKED, "--save", "xls"), "--save = 'xls': must be npz, csv or uff"),
    "no operation": (("--speed", "1500"), "no [operation] table"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_message_and_no_file(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, message = BAD[case]
    out = tmp_path / "out"
    assert simulate("lin-parker-4", *arguments, "--out", str(out)) == 2
    _told_once(capsys, message)
    assert not out.exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,force\n0,0\n0.001,1\n0.0025,2\n0.003,1\n", "time is not uniform: sample 2"),
        ("time,force\n0,0\n0.001,nan\n0.002,2\n0.003,1\n", "sample 1 is nan"),
    ],
)
def test_a_bad_recorded_force_is_named(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "force.csv").write_text(text, encoding="utf-8")
    spec = f"record@{W}:file={tmp_path / 'force.csv'}"
    out = tmp_path / "out"
    assert simulate("lin-parker-4", "--excitation", spec, "--out", str(out)) == 2
    _told_once(capsys, message)
    assert not out.exists()


def test_a_run_that_diverges_leaves_an_older_report_and_no_pieces(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "simulation.html").write_text("older", encoding="utf-8")
    huge = f"{MULTISINE},amplitude=1e12"
    assert simulate("lin-parker-4", "--excitation", huge, "--out", str(tmp_path)) == 2
    _told_once(capsys, "the motion has grown beyond what the model can bear")
    assert [path.name for path in tmp_path.iterdir()] == ["simulation.html"]
    assert (tmp_path / "simulation.html").read_text(encoding="utf-8") == "older"


def _told_once(capsys: pytest.CaptureFixture[str], message: str) -> None:
    told = capsys.readouterr()
    assert told.err.startswith("crosscheck: ")
    assert message in told.err
    assert len(told.err.splitlines()) == 1
    assert "Traceback" not in told.err
    assert told.out == ""


# --- interrupted and resumed --------------------------------------------------------------------


def interrupted_after(steps: int) -> Callable[[], Any]:
    """A progress bar that is interrupted once so many steps have been told done."""

    @contextmanager
    def bar() -> Iterator[Callable[[str, int, int], None]]:
        def step(name: str, done: int, total: int) -> None:
            if name == "time integration" and done >= steps:
                raise KeyboardInterrupt

        yield step

    return bar


def test_what_does_not_fit_is_computed_again_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    asked = ("lin-parker-4", *NOISE, "--save", "npz", "--out")
    with monkeypatch.context() as patched:
        patched.setattr(command, "progress_bars", interrupted_after(20_000))
        assert simulate(*asked, str(parts)) == 130
    (record,) = (parts / ".crosscheck").rglob("displacement.npy.part")
    content = bytearray(record.read_bytes())
    content[-3] ^= 1  # of the last number's exponent
    record.write_bytes(content)
    capsys.readouterr()
    assert simulate(*asked, str(parts)) == simulate(*asked, str(whole))
    assert "what was kept of the run is computed again: " in capsys.readouterr().err
    one, _ = read_record(parts / "record.npz")
    other, _ = read_record(whole / "record.npz")
    assert np.array_equal(one.outputs, other.outputs)


def test_an_interrupted_run_goes_on_bit_for_bit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    asked = ("lin-parker-4", *NOISE, "--save", "npz", "--out")
    with monkeypatch.context() as patched:
        patched.setattr(command, "progress_bars", interrupted_after(20_000))
        assert simulate(*asked, str(parts)) == 130
    told = capsys.readouterr().err
    assert "interrupted" in told
    assert "the same command goes on from there" in told
    assert [path.name for path in parts.iterdir()] == [".crosscheck"]

    # Another command does not take its pieces, nor lose them, nor is it kept from anything.
    (kept,) = (parts / ".crosscheck").glob("simulate-*")
    assert simulate(*asked[:-1], "--response", "planetary.sun.u", "--out", str(parts)) == 0
    assert [path.name for path in (parts / ".crosscheck").iterdir() if path.is_dir()] == [kept.name]

    resumed, uninterrupted = simulate(*asked, str(parts)), simulate(*asked, str(whole))
    assert resumed == uninterrupted
    one, _ = read_record(parts / "record.npz")
    other, _ = read_record(whole / "record.npz")
    assert one.n_sample > 20_000
    assert np.array_equal(one.inputs, other.inputs)
    assert np.array_equal(one.outputs, other.outputs)
    assert {path.name for path in parts.iterdir()} == {
        "simulation.html", "simulation.json", "record.npz",
    }  # fmt: skip


@pytest.mark.slow
# There a process is interrupted together with all of its console, this one included.
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT to send to one process")
def test_ctrl_c_ends_in_130_and_keeps_the_pieces(tmp_path: Path) -> None:
    command = [
        sys.executable, "-m", "validation.cli", "simulate", "lin-parker-4", "--excitation",
        f"noise@{W}:fmax=2000", "--duration", "60", "--out", str(tmp_path),
    ]  # fmt: skip
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        # tests run in the background of a shell inherit an ignored SIGINT
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    patience = time.time() + 60
    while (
        not list(tmp_path.rglob("checkpoint")) and process.poll() is None and time.time() < patience
    ):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130, told
    assert "the same command goes on from there" in told
    assert "Traceback" not in told
    assert list(tmp_path.rglob("checkpoint"))

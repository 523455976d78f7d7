"""How commands end: one message, and a code that says neither agreed nor disagreed by mistake."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.validation.command_line import call
from validation.runtime import exit_codes


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--fmin", "abc"], "run: --fmin = 'abc': "),
        (["run", "--fmax", "1", "--fmax=1 kHz"], "run: --fmax = '1 kHz': "),
        (["sweep", "--workers", "0"], "sweep: --workers = '0': "),
        (["sweep", "--seed", "1.5"], "sweep: --seed = '1.5': "),
        (["run", "--fmn", "3"], "run: no such option: --fmn"),
        (["run", "--fmin"], "run: option '--fmin' requires an argument (see crosscheck run"),
        (["modes", "--json=3"], "modes: option '--json' does not take a value"),
        (["rnu"], ": no such command 'rnu'"),
        (["new"], "new: missing argument 'FILE'"),
        (["modes", "paper", "two"], "modes: got unexpected extra argument"),
        (["check", ""], "check: FILE: is empty; must be a preset's name, or the path"),
        (["run", " "], "run: MODEL: is empty; must be a preset's name, or the path"),
    ],
)
def test_what_cannot_be_read_is_one_message(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(*arguments) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert told.err.startswith("crosscheck")
    assert words in told.err  # what follows are typer's words, other ones in every version
    assert len(told.err.partition(words)[2]) > 5


@pytest.mark.parametrize(("arguments", "code"), [([], 2), (["--help"], 0), (["run", "--help"], 0)])
def test_help(arguments: list[str], code: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(*arguments) == code
    told = capsys.readouterr()
    assert "Usage: crosscheck" in told.out
    assert told.err == ""


def raising(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Let every model's reading end so."""

    def load(text: str, origin: str) -> None:
        raise error

    monkeypatch.setattr("mbs_models.model.model_file.loads", load)


COMMANDS = {
    "run": ["run"],
    "frf": ["frf", "--response", "all", "--excitation", "all"],
    "modes": ["modes"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_an_interruption_is_told(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    raising(monkeypatch, KeyboardInterrupt())
    assert call(*COMMANDS[command]) == exit_codes.INTERRUPTED
    assert capsys.readouterr().err == "crosscheck: interrupted; no file was left half written\n"


def test_an_interruption_that_became_an_error_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As where the import of an extension module is interrupted."""

    def load(text: str, origin: str) -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    handler = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr("mbs_models.model.model_file.loads", load)
    assert call("modes") == exit_codes.INTERRUPTED
    assert signal.getsignal(signal.SIGINT) is handler
    assert capsys.readouterr().err == "crosscheck: interrupted; no file was left half written\n"


def test_an_interruption_that_python_dropped_comes_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What a destructor raises is told to sys.unraisablehook, and ignored."""

    class Dropped:
        def __del__(self) -> None:
            raise KeyboardInterrupt

    def load(text: str, origin: str) -> None:
        Dropped()
        patience = time.monotonic() + 10.0
        while time.monotonic() < patience:
            time.sleep(0.01)

    hook = sys.unraisablehook
    monkeypatch.setattr("mbs_models.model.model_file.loads", load)
    assert call("modes") == exit_codes.INTERRUPTED
    assert sys.unraisablehook is hook
    assert capsys.readouterr().err == "crosscheck: interrupted; no file was left half written\n"


def test_an_interrupted_paper_is_told(
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def study(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("validation.paper.paper_study", study)
    out = tmp_path_factory.mktemp("paper")
    assert call("paper", "--out", str(out)) == exit_codes.INTERRUPTED
    assert "crosscheck: interrupted; nothing was written\n" in capsys.readouterr().err
    assert list(out.iterdir()) == []


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(5, "Input/output error", "gone.npz"), "gone.npz: Input/output error"),
        (OSError(28, "No space left on device"), "standard output: No space left on device"),
        (OSError(24, "Too many open files"), "Too many open files"),
    ],
)
def test_a_fault_of_the_machine_is_one_message(
    error: OSError,
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    raising(monkeypatch, error)
    assert call("modes") == 2
    assert capsys.readouterr().err == f"crosscheck: {words}\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a stream that is full")
@pytest.mark.parametrize(
    ("arguments", "closed", "code"),
    [
        ("check /no/such.toml", "2>/dev/full", 2),
        ("check /no/such.toml", "2>&-", 2),
        ("presets", ">/dev/full", 2),
        ("presets", ">&-", 0),
        ("presets", ">&- 2>&-", 0),
        ("presets", ">/dev/full 2>/dev/full", 2),
    ],
)
def test_streams_that_take_nothing_change_no_code_to_another(
    arguments: str, closed: str, code: int
) -> None:
    """1 would be a disagreement, 120 is Python's own for a stream it cannot flush."""
    command = f"{shlex.quote(sys.executable)} -m validation {arguments} {closed}"
    assert subprocess.run(command, shell=True, capture_output=True, timeout=60).returncode == code


@pytest.mark.parametrize(
    "error",
    [StopIteration(), KeyError("stage"), SystemExit(1)],
)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_fault_of_our_own_is_no_verdict(
    command: str,
    error: BaseException,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    raising(monkeypatch, error)
    assert call(*COMMANDS[command]) == 70  # EX_SOFTWARE: neither 0, 1 nor 2
    first, *rest = capsys.readouterr().err.splitlines()
    assert first.startswith("crosscheck: a fault of crosscheck itself, not of its input")
    assert type(error).__name__ in first
    assert rest[0] == "Traceback (most recent call last):"
    assert type(error).__name__ in rest[-1]


def test_too_little_memory_is_one_message(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    raising(monkeypatch, MemoryError("Unable to allocate 7 TiB"))
    assert call("modes") == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "not enough memory (Unable to allocate 7 TiB); ask for less" in told


@pytest.mark.parametrize("command", ["modes", "schema", "presets"])  # modes prints through rich
def test_a_reader_gone_is_no_disagreement(command: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "validation.cli", command],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
        )
    finally:
        os.close(writing)
    assert done.returncode == 141  # 128 + SIGPIPE, as a shell says it
    assert done.stderr == ""


def test_what_would_steer_a_terminal_is_written_out(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("check", "no\x1b]0;title\x07\u202e\x9b\nsuch.toml") == 2
    assert capsys.readouterr().err.startswith(
        r"crosscheck: no\x1b]0;title\x07\u202e\x9b\nsuch.toml: neither"
    )


def test_long_values_are_cut(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("check", 10000 * "x") == 2
    assert len(capsys.readouterr().err) < 1100

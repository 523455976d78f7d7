"""Interrupts: held where they would do harm, and never waited for."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from validation.runtime.interruption import AGAIN_SECONDS, every_interrupt, interrupts_later

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_is_held_until_what_must_not_break_is_done(sent: signal.Signals) -> None:
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    done = []

    @interrupts_later()
    def what_must_not_break() -> None:
        signal.raise_signal(sent)
        done.append(sent)

    try:
        with pytest.raises(KeyboardInterrupt):
            what_must_not_break()
        assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGTERM, before)
    assert done == [sent]


class _Dropping:
    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_an_interrupt_that_was_lost_is_not_raised_again_when_all_is_over() -> None:
    """What C code makes of it comes first: the command ends, and the second would end the process.

    An exception in a destructor is dropped; the interrupt comes again 10 ms later, here too late.
    """
    with pytest.raises(KeyboardInterrupt) as caught:
        _drop_and_fail()
    time.sleep(5 * AGAIN_SECONDS)
    assert isinstance(caught.value.__cause__, RuntimeError)


@every_interrupt()
def _drop_and_fail() -> None:
    _Dropping()
    raise RuntimeError


EXECUTED = """
import typer
from validation.runtime.exit_codes import exit_code

app = typer.Typer()

@app.command()
def command():
    exec("raise KeyboardInterrupt")

if __name__ == "__main__":
    raise SystemExit(exit_code(app, []))
"""


def test_an_interrupt_while_a_class_is_made_ends_with_the_same_code(tmp_path: Path) -> None:
    """`python -m` ended by SIGINT, after the message."""
    (tmp_path / "executed.py").write_text(EXECUTED, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "executed"], cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 130, done.stderr
    assert done.stderr == "crosscheck: interrupted; no file was left half written\n"


INTERRUPTED = """
import numpy as np
from validation.runtime.executors import process_pool
from validation.runtime.pieces import Work, computed

def evaluate(items):
    return np.zeros(2_000_000)

if __name__ == "__main__":
    work = Work(evaluate, list, lambda item, why: why, "pieces")
    with process_pool(2) as workers:
        for _ in computed(work, {str(k): (k,) for k in range(1000)}, workers, print):
            raise KeyboardInterrupt
"""


@pytest.mark.slow
def test_workers_that_end_in_the_midst_of_a_result_are_not_waited_for(tmp_path: Path) -> None:
    """Results of 16 MB are nearly always on their way, through a pipe that takes 64 kB."""
    script = tmp_path / "sweep.py"
    script.write_text(INTERRUPTED, encoding="utf-8")
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, str(script)], env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True, text=True, timeout=60,
        )  # fmt: skip
        assert done.stderr.splitlines()[-1] == "KeyboardInterrupt"

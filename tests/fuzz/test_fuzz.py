"""A part of the fuzzing that is quick enough for every change; the whole is `python -m tests.fuzz`.

What it has found once is asserted where it was mended.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from .kinds import KINDS
from .processes import PROCESSES
from .trial import Tally, attempt

QUICK = 130  # inputs of the kinds that need no process of their own: half a minute

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")


@pytest.mark.parametrize("kind", KINDS)
def test_every_input_ends_in_a_result_or_in_one_message(kind: str) -> None:
    trial, share = KINDS[kind]
    tally = Tally()
    for number in range(max(1, round(QUICK * share / sum(s for _, s in KINDS.values())))):
        attempt(kind, number, trial, tally)
    assert not tally.faults, "\n".join(tally.faults)


@pytest.mark.slow
@pytest.mark.parametrize("kind", PROCESSES)
def test_every_process_ends_so(kind: str) -> None:
    trial, _ = PROCESSES[kind]
    tally = Tally()
    for number in range(20):
        attempt(kind, number, trial, tally)
    assert not tally.faults, "\n".join(tally.faults)


def test_a_worker_dies_with_its_parent_whatever_kills_that(tmp_path: Path) -> None:
    """A parent that is killed shuts nothing down: its workers notice that a pipe has closed."""
    from . import interrupts

    interrupts.killed_with_workers(tmp_path)

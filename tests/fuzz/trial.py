"""One input: how it is tried, what it must not do, and the counts of many."""

from __future__ import annotations

import os
import random
import re
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from fbs.errors import FbsError
from mbs_models.errors import ModelError
from tests.contracts.pins import Called, call
from validation.errors import CommandError

LONGEST = 30.0  # s
LARGEST = 1e9  # bytes beyond what there was
REFUSALS = (ModelError, FbsError, CommandError)
ACCEPTED, REFUSED = "accepted", "refused"
STEERING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
LONGEST_LINE = 1200
BESIDE = re.compile(r"warning: |.+: \d+ of \d+, \d+ s$")  # and progress, after ten seconds

SMALL = "lin-parker-3"
DOFS = ("planetary.sun.w", "planetary.sun.u", "planetary.planet1.v", "planetary.carrier.w")

Trial = Callable[[random.Random, Path], str]


class Fault(AssertionError):
    """What an input brought about and must not."""


class Hang(BaseException):
    """An input that takes too long: nothing that catches errors catches it."""


@dataclass
class Tally:
    """What became of the inputs of a kind."""

    ends: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    slowest: float = 0.0
    largest: float = 0.0

    @property
    def inputs(self) -> int:
        """How many."""
        return sum(self.ends.values()) + len(self.faults)


def command(*arguments: str, within: Iterable[int] = (0, 1, 2)) -> Called:
    """Run a command line in this process, and refuse an end that no command may have."""
    called = call(*arguments)
    told = [line for line in called.err.splitlines() if not BESIDE.match(line)]
    steering = STEERING.search(called.out + called.err)
    shown = f"{' '.join(arguments)!r}: {called.code}: {called.err[-3000:]}"
    if called.code not in within:
        raise Fault(f"exit code of {shown}")
    if called.code == 2 and (len(told) != 1 or not told[0].startswith("crosscheck")):
        raise Fault(f"no single message: {shown}")
    if called.code != 2 and told:
        raise Fault(f"said beside warnings: {shown}")
    if steering:
        raise Fault(f"steers the terminal with {steering[0]!r}: {shown}")
    if max(map(len, called.err.splitlines()), default=0) > LONGEST_LINE:
        raise Fault(f"a message of {len(called.err)} characters: {shown[:500]}")
    return called


def left_nothing(code: int, out: Path) -> None:
    """Refuse what a command has left that was refused, or is done."""
    left = [path.name for path in out.rglob("*")] if out.exists() else []
    if code == 2 and left:
        raise Fault(f"refused, and files are left: {left}")
    if code in (0, 1) and ".crosscheck" in left:
        raise Fault(f"done, and unfinished work is left: {left}")


def ended(called: Called) -> str:
    """The end of a command as a trial's."""
    return REFUSED if called.code == 2 else ACCEPTED


def refused_or(action: Callable[[], object]) -> str:
    """Whether something of the library was done, or refused by an error of the packages."""
    try:
        action()
    except REFUSALS as error:
        if not str(error):
            raise Fault(f"no message: {error!r}") from error
        return REFUSED
    return ACCEPTED


def attempt(kind: str, number: int, trial: Trial, tally: Tally) -> None:
    """One input in a folder of its own, and what became of it."""
    rng = random.Random(f"{kind} {number}")
    before, began = _memory(), time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name, _inside(Path(name)):
        try:
            with _in_time(), warnings.catch_warnings():
                warnings.simplefilter("error")  # a numerical warning is told to nobody
                tally.ends[trial(rng, Path(name))] += 1
        except (Exception, Hang) as error:
            why = str(error) if isinstance(error, Fault) else traceback.format_exc(limit=-4)
            tally.faults.append(f"{kind} {number}: {type(error).__name__}: {why}")
    seconds, size = time.perf_counter() - began, _memory() - before
    tally.slowest, tally.largest = max(tally.slowest, seconds), max(tally.largest, size)
    if seconds > LONGEST:
        tally.faults.append(f"{kind} {number}: takes {seconds:.0f} s")
    if size > LARGEST:
        tally.faults.append(f"{kind} {number}: takes {size / 1e9:.1f} GB")


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


@contextmanager
def _in_time() -> Iterator[None]:
    def late(number: int, frame: FrameType | None) -> None:
        raise Hang(f"after {LONGEST:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _memory() -> float:
    """Peak of this process' resident memory since it was last asked, in bytes."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return 1024.0 * float(status.partition("VmHWM:")[2].split()[0])


def table(tallies: dict[str, Tally]) -> str:
    """The counts as a Markdown table."""
    lines = [
        "| inputs of | tried | accepted | refused | faults | slowest, s | most memory, MB |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind, tally in tallies.items():
        ends = f"{tally.ends[ACCEPTED]} | {tally.ends[REFUSED]} | {len(tally.faults)}"
        worst = f"{tally.slowest:.1f} | {tally.largest / 1e6:.0f}"
        lines.append(f"| {kind} | {tally.inputs} | {ends} | {worst} |")
    total = sum(tally.inputs for tally in tallies.values())
    lines.append(f"| all | {total} | | | {sum(len(t.faults) for t in tallies.values())} | | |")
    return "\n".join(lines)

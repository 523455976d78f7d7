"""What commands print while they run: text that steers no terminal, warnings and progress.

What is printed may quote a file or a command line of anybody's. Nothing that becomes of standard
error ends a command; without standard output what would go there is said to go nowhere.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .progress import Progress as Step

BETWEEN_LINES = 10.0  # s, of progress where there is no terminal
LONGEST = 1000  # characters of a message, of which the last are kept, too
LAST = 200
# Control characters but tabs and line ends, what turns the direction of writing, other line ends,
# and halves of characters, as which Python reads names of files that are not UTF-8
STEERING = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)


def terminal_text(text: str) -> str:
    """A text with all that would steer a terminal written out: \\x1b, \\u202e."""
    return STEERING.sub(lambda found: _escaped(ord(found[0])), text)


def _escaped(code: int) -> str:
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


def message(text: str) -> str:
    """A message as one line for the terminal; what is longer than anybody reads is cut."""
    line = terminal_text(text.replace("\n", "\\n"))
    return line if len(line) <= LONGEST else f"{line[: LONGEST - LAST]} … {line[-LAST:]}"


def say(text: str) -> None:
    """Print a text to standard output."""
    print(terminal_text(text))


def tell(text: str) -> None:
    """Print a text to standard error, if anybody takes it."""
    try:
        print(terminal_text(text), file=sys.stderr, flush=True)
    except OSError:
        to_nowhere(sys.stderr)


def warn(warnings: Sequence[str]) -> None:
    """Print warnings to standard error."""
    for warning in warnings:
        tell(message(f"warning: {warning}"))


def to_nowhere(stream: TextIO) -> None:
    """Let what a stream still holds go nowhere: Python would fail with it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def prepare_streams() -> None:
    """Give the process its three streams, and let them take every character.

    A closed stream's number would be the next file's, into which libraries write what they say.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115  # as long as the process
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
        warn(["standard output is closed: what would be printed there goes nowhere"])
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # not what stands in for it in a test
            stream.reconfigure(errors="backslashreplace")


@contextmanager
def progress_bars() -> Iterator[Step]:
    """A progress bar on standard error, gone when done; where nobody watches, a line now and then.

    A line every ten seconds: what is done before is not worth one.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Lines()
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bars:
        tasks = {}

        def step(name: str, done: int, total: int) -> None:
            if name not in tasks:
                tasks[name] = bars.add_task(name, total=total)
            bars.update(tasks[name], completed=done, total=total)

        yield step


class _Lines:
    """Progress line by line."""

    def __init__(self) -> None:
        self.began = self.last = monotonic()

    def __call__(self, name: str, done: int, total: int) -> None:
        now = monotonic()
        if now - self.last >= BETWEEN_LINES:
            self.last = now
            tell(f"{name}: {done} of {total}, {now - self.began:.0f} s")

"""What commands print while they run: warnings and progress."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from .progress import Progress as Step

BETWEEN_LINES = 10.0  # s, of progress where there is no terminal


def warn(warnings: Sequence[str]) -> None:
    """Print warnings to standard error."""
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


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
            print(f"{name}: {done} of {total}, {now - self.began:.0f} s", file=sys.stderr)

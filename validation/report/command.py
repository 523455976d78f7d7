"""What every command that writes a report does around its study."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from pathlib import Path
from typing import TypeVar

from rich.console import Console

from ..runtime.interruption import on_interrupt
from ..runtime.output_folder import held
from ..runtime.progress import Progress
from ..runtime.streams import progress_bars, say, warn
from .console import console
from .publish import Result, publish

R = TypeVar("R", bound=Result)

WRITING = "writing the report"


def run_study(
    study: Callable[[Path, Progress], R],
    out: Path,
    names: Sequence[str],
    show: Callable[[R, Console], None],
    *,
    write: Callable[[R, Path], tuple[Path, ...]] = publish,
    kept: str = "nothing was written",
    known: Container[str] = (),
) -> R:
    """Hold the folder, run a study, write what it finds, and print it.

    Parameters
    ----------
    study
        From the private folder of unfinished work, and a progress to tell, to the result.
    out, names
        Where its files go, and what they are called: refused before the study runs.
    show
        Prints the result.
    write
        Writes its files; returns their paths.
    kept
        What an interruption leaves.
    known
        Warnings that have been given already.

    Raises
    ------
    ReportError
        A file cannot be written there, or another command writes there.
    Interrupted
        By Ctrl-C.
    """
    with held(out, names) as work, on_interrupt(kept), progress_bars() as progress:
        result = study(work, progress)
        progress(WRITING, 0, 1)
        written = write(result, out)
        progress(WRITING, 1, 1)
    warn([warning for warning in result.warnings if warning not in known])
    show(result, console())
    for path in written:
        say(f"Written: {path}")
    return result

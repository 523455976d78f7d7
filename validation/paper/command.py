"""`crosscheck paper`: from what is typed to files and a verdict."""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..errors import CommandError
from ..report.command import run_study
from ..runtime.progress import Progress
from .console import print_result
from .items import picked
from .result import PaperStudy

DECIBELS = re.compile(r"\s*([-+.\w]+?)\s*(?:db)?\s*", re.IGNORECASE)


def run_command(out: Path, only: str | None, tolerance: str) -> PaperStudy:
    """Check the paper, write the report, and print the verdicts; the options as typed.

    Raises
    ------
    CommandError
        Bad input; nothing is written then.
    """
    tolerance_db = decibels("--tolerance", tolerance)
    if only is not None:
        picked(only)

    def study(_: Path, progress: Progress) -> PaperStudy:
        from . import paper_study

        return paper_study(
            only,
            tolerance_db=tolerance_db,
            progress=lambda _, done, total: progress("checking the paper", done, total),
        )

    return run_study(study, out, PaperStudy.files, print_result)


def decibels(option: str, text: str) -> float:
    """A tolerance: ``0.1dB``, ``0.1 dB`` or ``0.1``.

    Raises
    ------
    CommandError
        It is no finite number above 0.
    """
    found = DECIBELS.fullmatch(text)
    try:
        value = float(found[1]) if found else math.nan
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise CommandError(f"{option} = {text!r}: must be a number of dB above 0, like 0.1dB")
    return value

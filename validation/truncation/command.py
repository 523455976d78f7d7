"""`crosscheck truncate`: from what is typed to files and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mbs_models.model.model_file import load

from ..report.command import run_study
from ..runtime.progress import Progress
from .console import print_result
from .plan import plan
from .result import TruncationResult
from .run import run


def run_command(
    model: str,
    out: Path,
    *,
    stages: Sequence[str],
    band: str | None,
    tolerance: str,
    responses: Sequence[str] | None,
    excitations: Sequence[str] | None,
    order: int,
) -> TruncationResult:
    """Compute, write the report, and print what was found; the options as typed.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    """
    asked = plan(
        load(model),
        stages=stages,
        band_text=band,
        tolerance=tolerance,
        responses=responses,
        excitations=excitations,
        highest_order=order,
    )

    def study(_: Path, progress: Progress) -> TruncationResult:
        return run(asked, progress)

    return run_study(study, out, TruncationResult.files, print_result)

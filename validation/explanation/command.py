"""`crosscheck explain`: from what is typed to files and an answer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mbs_models.model.model_file import load

from ..checks.part_uncertainty import Noise
from ..report.command import run_study
from ..routes.frf_input import FileOptions
from ..runtime.progress import Progress
from .console import print_result
from .plan import plan
from .result import ExplanationResult
from .run import run


def run_command(
    model: str,
    theirs: Path,
    out: Path,
    *,
    ours: Path | None,
    stage: str | None,
    only: Sequence[str],
    options: FileOptions,
    noise: Noise | None,
) -> ExplanationResult:
    """Search, write the report, and print what was found; the options as typed.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    """
    asked = plan(
        load(model), theirs, ours=ours, stage=stage, only=only, options=options, noise=noise
    )

    def study(_: Path, progress: Progress) -> ExplanationResult:
        return run(asked, progress)

    return run_study(study, out, ExplanationResult.files, print_result)

"""`crosscheck reduce`: from what is typed to files and a choice."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fbs.files.whole_files import require_writable, written_whole
from fbs.reduction import Reduction
from mbs_models.model.model_file import load

from ..errors import CommandError
from ..report.command import run_study
from ..runtime.output_folder import telling
from ..runtime.progress import Progress
from ..runtime.streams import warn
from .console import print_result
from .plan import plan
from .result import ReductionResult
from .run import run


def run_command(
    model: str,
    stage: str,
    out: Path,
    *,
    band: str | None,
    tolerance: str,
    dofs: Sequence[str],
    sizes: str | None,
    output: Path | None,
) -> ReductionResult:
    """Compare, write the report and the chosen system; the options as typed.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    """
    asked = plan(load(model), stage, band=band, tolerance=tolerance, dofs=dofs, sizes=sizes)
    if output is not None:
        if output.suffix.lower() != ".npz":
            raise CommandError(f"--output = {output}: a reduced system is written as .npz")
        with telling(f"--output = {output}"):
            require_writable(output)

    def study(_: Path, progress: Progress) -> ReductionResult:
        result, chosen = run(asked, progress)
        if output is not None:
            _write(chosen, output)
        return result

    return run_study(study, out, ReductionResult.files, print_result)


def _write(reduction: Reduction | None, path: Path) -> None:
    """M, C, K and labels of the reduced system, and the matrix back to the stage's DoFs."""
    if reduction is None:
        warn([f"{path}: not written, no reduction meets the tolerance"])
        return
    system = reduction.system
    with telling(f"--output = {path}"), written_whole(path) as file:
        np.savez(
            file,
            mass=system.mass,
            damping=system.damping,
            stiffness=system.stiffness,
            loss_factor=system.loss_factor,
            coordinates=np.array(system.dofs),
            basis=reduction.basis,
            dofs=np.array(reduction.source.dofs),
        )

"""`crosscheck run`: from what is typed to files and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mbs_models.modal.mode_kinds import label_inertias
from mbs_models.model.model_file import load, model_text

from ..checks.part_uncertainty import Noise, require_errors
from ..explorer.plots import PAGE as EXPLORER
from ..explorer.plots import require_library
from ..report.command import run_study
from ..routes.bands import Band, band
from ..routes.frf_input import NOTHING_SAID, FileOptions
from ..routes.memory import require_memory, run_bytes
from ..routes.source import equations_source, exudyn_source
from ..routes.substitution import read_substitutions
from ..runtime.progress import Progress
from ..runtime.streams import warn
from .result import ARRAYS, CrossCheck

MOST_DOFS_IN_TIME = 60  # larger systems take minutes to integrate: only when asked for


def run_command(
    model: str,
    out: Path,
    *,
    fmin: float | None = None,
    fmax: float | None = None,
    df: float | None = None,
    replace: Sequence[str] = (),
    options: FileOptions = NOTHING_SAID,
    noise: Noise | None = None,
    repetitions: int = 0,
    in_time: bool | None = None,
    explore: bool = False,
) -> CrossCheck:
    """Compare all routes, write the report, and print what was found; the options as typed.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    """
    if explore:
        require_library()
    drivetrain = load(model)
    n_dofs = len(label_inertias(drivetrain))
    files = read_substitutions(drivetrain, replace, fmin, fmax, df, options)
    require_errors(repetitions, files, noise)
    lines = Band.of(files[0].frf.frequency) if files else band(fmin, fmax, df, n_dofs**2)
    require_memory(lines, run_bytes(drivetrain), "the report's curves")
    if in_time is None:
        in_time = n_dofs <= MOST_DOFS_IN_TIME and not files
    known = [*drivetrain.warnings(), *(warning for file in files for warning in file.warnings)]
    warn(known)

    def study(_: Path, progress: Progress) -> CrossCheck:
        from .study import cross_check  # takes its time to load: bad input is told before

        result = cross_check(
            drivetrain,
            lines,
            text=model_text(model),
            published=model,
            progress=progress,
            substitutions=files,
            noise=noise,
            repetitions=repetitions,
            in_time=in_time,
        )
        return with_explorer(result) if explore else result

    from .console import print_result

    names = (*CrossCheck.files, ARRAYS, *((EXPLORER,) if explore else ()))
    return run_study(study, out, names, print_result, known=known)


def with_explorer(result: CrossCheck) -> CrossCheck:
    """The same with the page of every other FRF, which the report links to."""
    from ..explorer.page import explorer_page

    drivetrain = result.drivetrain
    text = explorer_page(exudyn_source(drivetrain), equations_source(drivetrain))
    return replace(result, explorer=text)

"""`crosscheck simulate`: from what is typed to files and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from mbs_models.integration.fingerprint import fingerprint
from mbs_models.integration.run_store import remove_run
from mbs_models.integration.time_integration import SimulationError
from mbs_models.model.model_file import folder_of, load

from ..errors import CommandError, require_frequencies
from ..report.command import run_study
from ..report.publish import publish
from ..runtime.output_folder import WORK
from ..runtime.progress import Progress
from .console import print_result
from .options import Options, chosen_excitations, parse_levels, turns
from .records import FORMATS
from .result import SimulationResult
from .run import BACKWARD, FORWARD, PlannedRun

PIECES = "simulate"  # in the private folder, of an unfinished run


def run_command(
    model: str,
    out: Path,
    *,
    excitation: Sequence[str],
    levels: str | None,
    save: Sequence[str],
    options: Options,
) -> SimulationResult:
    """Run, write the report and what else was asked for, and print what was found.

    Parameters
    ----------
    model, out
        What is run, and where its files go.
    excitation, levels, save
        As typed.
    options
        All the others.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    Interrupted
        By Ctrl-C; the same command goes on from the pieces run.
    """
    for name in save:
        if name not in FORMATS:
            raise CommandError(f"--save = {name!r}: must be npz, csv or uff")
    require_frequencies(fmax=options.fmax, sampling=options.sampling_frequency)
    drivetrain = load(model)
    options = replace(
        options,
        excitations=chosen_excitations(
            drivetrain,
            excitation,
            folder=folder_of(model) if not excitation else Path(),
            duration=options.duration,
            sampling_frequency=options.sampling_frequency,
            turning=turns(drivetrain, options),
            fmax=options.fmax,
        ),
        levels=parse_levels(levels),
    )
    what = fingerprint(drivetrain.model_dump_json(), options)[:16]  # another's is not touched
    store = out / WORK / f"{PIECES}-{what}"
    planned = PlannedRun(drivetrain, options, store)

    def study(_: Path, progress: Progress) -> SimulationResult:
        try:
            return replace(planned.simulation(progress), saved=tuple(save))
        except SimulationError:  # it would end the same way again
            remove_pieces(store)
            raise

    def write(result: SimulationResult, directory: Path) -> tuple[Path, ...]:
        written = publish(result, directory)
        remove_pieces(store)
        return written

    names = (*SimulationResult.files, *(f"record.{name}" for name in save))
    kept = f"what has been run is kept in {out}, and the same command goes on from there"
    return run_study(study, out, names, print_result, write=write, kept=kept)


def remove_pieces(store: Path) -> None:
    """Remove what is kept of a run that is finished and reported, and nothing else."""
    for direction in (FORWARD, BACKWARD):
        remove_run(store / direction)
    if store.exists() and not any(store.iterdir()):
        store.rmdir()

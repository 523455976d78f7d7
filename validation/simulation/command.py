"""`crosscheck simulate`: from what is typed to files and a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mbs_models.integration.fingerprint import fingerprint
from mbs_models.integration.time_integration import SimulationError
from mbs_models.model.model_file import folder_of, load
from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..runtime.interruption import on_interrupt
from ..runtime.output_folder import WORK, held
from ..runtime.streams import progress_bars, warn
from .console import findings
from .options import excitations_asked, levels_asked
from .output import FORMATS, remove_pieces, write_simulation
from .results import Request, Simulation
from .run import PlannedRun

PIECES = "simulate"  # in the private folder, of an unfinished run


@dataclass(frozen=True)
class Options:
    """The command line's options, as typed."""

    model: str
    excitation: Sequence[str]
    response: tuple[str, ...] | None
    duration: float | None
    fmax: float | None
    sampling: float | None
    integrator: str | None
    step: float | None
    speed: float | None
    torque: float | None
    levels: str | None
    reverse: bool
    out: Path
    save: Sequence[str]


def carry_out(options: Options) -> Simulation:
    """Run, write the report and what else was asked for, and print what was found.

    Raises
    ------
    ModelError, FbsError, CommandError
        Bad input; nothing is written then.
    Interrupted
        By Ctrl-C; the same command goes on from the pieces run.
    """
    for name in options.save:
        if name not in FORMATS:
            raise CommandError(f"--save = {name!r}: must be npz, csv or uff")
    drivetrain = load(options.model)
    request = Request(
        excitations=excitations_asked(
            drivetrain,
            options.excitation,
            folder=folder_of(options.model) if not options.excitation else Path(),
            duration=options.duration,
            sampling_frequency=options.sampling,
            turning=_turns(drivetrain, options),
            fmax=options.fmax,
        ),
        responses=options.response,
        duration=options.duration,
        fmax=options.fmax,
        sampling_frequency=options.sampling,
        integrator=options.integrator,
        step=options.step,
        speed_rpm=options.speed,
        torque=options.torque,
        levels=levels_asked(options.levels),
        reverse=options.reverse,
    )
    what = fingerprint(drivetrain.model_dump_json(), request)[:16]  # another's is not touched
    store = options.out / WORK / f"{PIECES}-{what}"
    names = ("simulation.html", "simulation.json", *(f"record.{name}" for name in options.save))
    with progress_bars() as progress:
        planned = PlannedRun(drivetrain, request, store, progress)
        kept = (
            f"what has been run is kept in {options.out}, and the same command goes on from there"
        )
        with held(options.out, names), on_interrupt(kept):
            try:
                found = planned.simulation()
                progress("writing the report", 0, 1)
                written = write_simulation(found, options.out, options.save)
            except SimulationError:  # it would end the same way again
                remove_pieces(store)
                raise
            remove_pieces(store)
        progress("writing the report", 1, 1)
    warn(found.warnings)
    findings(found)
    for path in written:
        print(f"Written: {path}")
    return found


def _turns(drivetrain: Drivetrain, options: Options) -> bool:
    """Whether a speed is asked for, here or by the model file."""
    given = drivetrain.operation.speed if drivetrain.operation else None
    return bool(given if options.speed is None else options.speed)

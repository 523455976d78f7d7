"""What `crosscheck simulate` prints."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console

from ..report.console import print_table, print_verdicts, say
from .describe import describe_excitation
from .gear_run import NOTHING_EXCITES, GearRun
from .page import mesh_table
from .result import SimulationResult


def print_result(result: SimulationResult, terminal: Console) -> None:
    """Print what was run, the verdicts, and what came out."""
    record = result.record
    lasted = record.n_samples / record.sampling_frequency
    say(terminal, *(f"Excited by: {describe_excitation(each)}" for each in result.excitations))
    say(
        terminal,
        f"Integrated: {lasted:g} s, {record.n_samples} samples at {record.sampling_frequency:g} Hz "
        f"in {result.seconds['time integration']:.1f} s",
        f"  {record.integrator.reason}",
    )
    if result.checks:
        title = f"{result.drivetrain.name}: what must hold"
        print_verdicts(terminal, title, result.checks)
    say(terminal, *_frfs(result))
    if result.gears is not None:
        _print_gears(result.gears, terminal)


def _frfs(result: SimulationResult) -> Iterator[str]:
    for estimated in result.estimated:
        yield (
            f"FRFs from {', '.join(estimated.reference.excitations)}: {estimated.judged}; "
            f"{estimated.median_difference}."
        )
    yield from result.hints
    if result.excitations and not result.estimated:
        yield f"No FRFs to hold against FBS: {result.no_frfs}."
    if result.levels is not None:
        yield result.levels.conclusion


def _print_gears(gears: GearRun, terminal: Console) -> None:
    if gears.says_nothing_excites:
        say(terminal, NOTHING_EXCITES)
    for stage, frequency in gears.point.mesh_frequencies.items():
        say(terminal, f"Mesh frequency of {stage}: {frequency:.4g} Hz")
    print_table(terminal, "Mesh forces", mesh_table(gears))
    say(terminal, *filter(None, (gears.loaded_sentence, *(s.sentence for s in gears.stability))))
    say(terminal, *(sensor.sentence for sensor in gears.sensors))

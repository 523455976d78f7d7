"""What `crosscheck simulate` prints."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from ..report.digits import engineering
from .describe import in_words
from .gear_run import NOTHING_EXCITES
from .results import Simulation


def findings(found: Simulation) -> None:
    """Print what was run, and what came out."""
    record = found.record
    lasted = record.n_samples / record.sampling_frequency
    for excitation in found.excitations:
        print(f"Excited by: {in_words(excitation)}")
    print(
        f"Integrated: {lasted:g} s, {record.n_samples} samples at {record.sampling_frequency:g} Hz "
        f"in {found.seconds['time integration']:.1f} s\n  {record.integrator.reason}"
    )
    console = Console()
    console = console if console.is_terminal else Console(width=160)
    if found.checks:
        _verdicts(found, console)
    if found.excitations and not found.estimated:
        print(f"No FRFs to hold against FBS: {found.no_frfs}.")
    if found.levels is not None:
        print(found.levels.conclusion)
    if found.gears is not None:
        _meshes(found, console)


def _verdicts(found: Simulation, console: Console) -> None:
    table = Table(title=f"{found.drivetrain.name}: what must hold", title_justify="left")
    for header in ("comparison", "of"):
        table.add_column(header)
    for header in ("value", "allowed"):
        table.add_column(header, justify="right")
    table.add_column("verdict")
    for check in found.checks:
        verdict = "[green]agree[/]" if check.agrees else "[bold red]DISAGREE[/]"
        table.add_row(
            check.name, check.subject, f"{check.value:.3g}", f"{check.tolerance:.2g}", verdict
        )
    console.print(table)
    for check in found.checks:
        for finding in check.findings:
            console.print(f"  {finding}", markup=False)
    for estimated in found.estimated:
        sources = ", ".join(estimated.reference.excitations)
        print(
            f"FRFs from {sources}: {estimated.judged}; median difference there "
            f"{np.median(estimated.decibels[estimated.compared]):.2g} dB."
        )
    for hint in found.hints:
        print(hint)


def _meshes(found: Simulation, console: Console) -> None:
    gears = found.gears
    assert gears is not None
    if gears.says_nothing_excites:
        print(NOTHING_EXCITES)
    for stage, frequency in gears.point.mesh_frequencies.items():
        print(f"Mesh frequency of {stage}: {frequency:.4g} Hz")
    table = Table(title="Mesh forces", title_justify="left")
    table.add_column("mesh")
    for header in ("mean", "largest", "smallest", "rms about mean", "dynamic factor", "apart"):
        table.add_column(header, justify="right")
    for load in gears.loads:
        factor = load.dynamic_factor
        table.add_row(
            load.name,
            engineering(load.mean, "N", 4),
            engineering(load.largest, "N", 4),
            engineering(load.smallest, "N", 4),
            engineering(load.rms, "N"),
            "–" if factor is None else f"{factor:.3f}",
            f"{load.open_share:.1%}",
        )
    console.print(table)
    if gears.loaded_in_words:
        print(gears.loaded_in_words)
    for stability in gears.stability:
        print(stability.in_words)
    for sensor in gears.sensors:
        print(
            f"Sidebands at the ring of {sensor.stage}: as theory puts them to "
            f"{sensor.deviation:.1%} of the largest line"
        )

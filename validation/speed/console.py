"""What `crosscheck speed` prints."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from ..report.digits import engineering
from .lines import line_names
from .study import SpeedResult
from .words import conclusions, peak_mode, verdict


def findings(result: SpeedResult) -> None:
    """Print what stands out, and the verdicts."""
    console = Console()
    console = console if console.is_terminal else Console(width=160)
    console.print(f"{verdict(result)}.", markup=False)
    for words in conclusions(result):
        console.print(words, markup=False)
    if result.found is None:
        _static(result, console)
        return
    if result.peaks:
        _peaks(result, console)
    _checks(result, console)


def _static(result: SpeedResult, console: Console) -> None:
    table = Table(title="Mesh forces", title_justify="left")
    table.add_column("mesh")
    table.add_column("static", justify="right")
    for name, force in zip(result.turning.meshes, result.turning.static_forces, strict=True):
        table.add_row(name, engineering(force, "N", 4))
    console.print(table)


def _peaks(result: SpeedResult, console: Console) -> None:
    names = line_names(result.turning)
    loaded = bool(np.any(result.turning.static_forces > 0.0))
    table = Table(title="Resonances", title_justify="left")
    for header in ("#", "speed, rpm"):
        table.add_column(header, justify="right")
    for header in ("felt most by", "harmonic (order)", "mode"):
        table.add_column(header)
    for header in ("dynamic factor", "above mean"):
        table.add_column(header, justify="right")
    for number, peak in enumerate(result.peaks, start=1):
        table.add_row(
            str(number),
            f"{peak.speed_rpm:.5g}",
            peak.family,
            f"{names[peak.line]} ({peak.order:.5g})",
            peak_mode(result, peak),
            f"{peak.height:.3f}" if loaded else "–",
            engineering(peak.swing, "N"),
        )
    console.print(table)


def _checks(result: SpeedResult, console: Console) -> None:
    table = Table(title="Checks", title_justify="left")
    for header in ("comparison", "of", "routes"):
        table.add_column(header)
    for header in ("value", "allowed"):
        table.add_column(header, justify="right")
    table.add_column("verdict")
    for check in result.checks:
        word = "[green]agree[/]" if check.agrees else "[bold red]DISAGREE[/]"
        table.add_row(
            check.name, check.subject, " – ".join(check.routes), f"{check.value:.2g}",
            f"{check.tolerance:g}", word,
        )  # fmt: skip
    if result.checks:
        console.print(table)
    for check in result.checks:
        for finding in check.findings:
            console.print(f"  {finding}", markup=False)

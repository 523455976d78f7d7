"""What `crosscheck run` prints."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from ..report.console import console
from ..runtime.streams import warn
from .resonances import Resonances, resonances
from .results import CrossCheck

CLOSEST = 5  # margins printed; all that are called close are


def verdicts(result: CrossCheck) -> None:
    """Print the verdict table and, where routes disagree, where and by what.

    Whatever the report warns of is a warning here too; what was known of the input before the
    check began has been told then.
    """
    told = {*result.drivetrain.warnings()}
    if result.swap is not None:
        told.update(warning for part in result.swap.replacements for warning in part.warnings)
    warn([warning for warning in result.warnings if warning not in told])
    table = Table(title=f"{result.drivetrain.name}: cross-check", title_justify="left")
    for header in ("comparison", "of", "routes"):
        table.add_column(header)
    for header in ("value", "allowed"):
        table.add_column(header, justify="right")
    table.add_column("verdict")
    for check in result.checks:
        verdict = "[green]agree[/]" if check.agrees else "[bold red]DISAGREE[/]"
        table.add_row(
            check.name,
            check.subject,
            " – ".join(check.routes),
            f"{check.value:.1e}",
            f"{check.tolerance:.0e}",
            verdict,
        )
    terminal = console()
    terminal.print(table)
    for check in result.checks:
        if not check.agrees:
            terminal.print(
                f"[bold red]{check.name}, {check.subject}: {' – '.join(check.routes)}[/]"
            )
            for finding in check.findings:
                terminal.print(f"  {finding}", markup=False)
    if result.time_domain is not None:
        terminal.print(f"FRFs from time integration: {result.time_domain.judged}.", markup=False)
    found = resonances(result)
    if found is not None and found.speed_rpm is not None:
        _margins(terminal, found)
    worst = max(float(c.line_max.max()) for c in result.comparisons)
    n_frf = len(result.dofs) ** 2
    terminal.print(
        f"{'All routes agree' if result.agrees else 'The routes DISAGREE'}: {n_frf} FRFs, "
        f"{len(result.frequency)} line{'s' * (len(result.frequency) != 1)} each, "
        f"largest scaled error {worst:.1e}."
    )


def _margins(terminal: Console, found: Resonances) -> None:
    """The closest resonances at the operating speed."""
    speed = f"{found.operation.input} at {found.speed_rpm:g} rpm"
    if not found.margins:
        terminal.print(f"{speed}: no order excites any mode.", markup=False)
        return
    table = Table(title=f"{speed}: nearest resonances", title_justify="left")
    table.add_column("order")
    for header in ("Hz", "resonance, Hz", "mode"):
        table.add_column(header, justify="right")
    table.add_column("kind")
    for header in ("energy share", "speed change"):
        table.add_column(header, justify="right")
    shown = max(CLOSEST, len(found.close))
    for margin in found.margins[:shown]:
        table.add_row(
            margin.order.label(margin.harmonic),
            f"{margin.order_hz:.2f}",
            f"{margin.mode_hz:.2f}",
            f"{margin.mode + 1}" + (f"–{margin.mode + margin.repeated}" * (margin.repeated > 1)),
            margin.kind,
            f"{margin.share:.1%}",
            f"{margin.change:+.1%}",
            style="bold" if margin.close else None,
        )
    terminal.print(table)
    if len(found.margins) > shown:
        terminal.print(f"{len(found.margins) - shown} more orders are farther from a resonance.")

"""What `crosscheck run` prints."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, print_verdicts, say
from .model_sections import margin_table
from .resonances import Resonances
from .result import CrossCheck
from .substitution import describe

CLOSEST = 5  # margins printed; all that are called close are


def print_result(result: CrossCheck, terminal: Console) -> None:
    """Print verdicts, the closest resonances, and what parts from files change."""
    print_verdicts(terminal, f"{result.drivetrain.name}: cross-check", result.checks)
    if result.time_domain is not None:
        say(terminal, f"FRFs from time integration: {result.time_domain.comparable}.")
    if result.resonances is not None and result.resonances.speed_rpm is not None:
        _margins(terminal, result.resonances)
    lines = len(result.frequency)
    say(
        terminal,
        f"{'All routes agree' if result.agrees else 'The routes DISAGREE'}: "
        f"{len(result.dofs) ** 2} FRFs, {lines} line{'s' * (lines != 1)} each, "
        f"largest scaled error {result.worst.largest:.1e}.",
    )
    if result.substitution is not None:
        say(terminal, *describe(result.substitution))


def _margins(terminal: Console, found: Resonances) -> None:
    """The closest resonances at the operating speed."""
    speed = f"{found.operation.input} at {found.speed_rpm:g} rpm"
    if not found.margins:
        say(terminal, f"{speed}: no order excites any mode.")
        return
    shown = found.margins[: max(CLOSEST, len(found.close))]
    styles = ["bold" if margin.close else "" for margin in shown]
    print_table(terminal, f"{speed}: nearest resonances", margin_table(shown), styles=styles)
    if len(found.margins) > len(shown):
        more = len(found.margins) - len(shown)
        say(terminal, f"{more} more orders are farther from a resonance.")

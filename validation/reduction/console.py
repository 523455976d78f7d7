"""What `crosscheck reduce` prints."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, print_verdicts, say
from .describe import conclusions, least_table, size_table, verdict
from .result import ReductionResult


def print_result(result: ReductionResult, terminal: Console) -> None:
    """Print the choice, and what every method needs."""
    say(terminal, f"{verdict(result)}.", *conclusions(result))
    print_table(terminal, "Fewest coordinates", least_table(result))
    unit = "scaled" if result.plan.tolerance.scaled else "dB"
    print_table(terminal, f"True error, {unit}", size_table(result, guaranteed=False))
    print_table(terminal, f"Guaranteed, {unit}", size_table(result, guaranteed=True))
    print_verdicts(terminal, "Check", result.checks)

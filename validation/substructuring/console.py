"""What couple, decouple and identify print."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, say
from .describe import lost_table, parts_table, spring_table
from .result import SubstructuringResult


def print_result(result: SubstructuringResult, terminal: Console) -> None:
    """Print the outcome, the files and where there is no digit."""
    say(terminal, f"{result.verdict}.", *result.conclusions)
    print_table(terminal, "Springs and dampers", spring_table(result))
    print_table(terminal, "Files", parts_table(result))
    print_table(terminal, "Without a digit", lost_table(result))

"""What `crosscheck truncate` prints."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, print_verdicts, say
from .describe import alternative_table, conclusions, line_table, stage_table, verdict
from .result import TruncationResult


def print_result(result: TruncationResult, terminal: Console) -> None:
    """Print the guarantee, the modes, and what other choices would give."""
    say(terminal, f"{verdict(result)}.", *conclusions(result))
    print_table(terminal, "Modes that each stage needs", stage_table(result))
    print_table(terminal, "Lines without a guarantee", line_table(result))
    print_table(terminal, "Other choices and rules of thumb", alternative_table(result))
    print_verdicts(terminal, "Check", result.checks)

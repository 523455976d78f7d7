"""What `crosscheck explain` prints."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, say
from .describe import conclusions, ranking_table, verdict
from .result import ExplanationResult


def print_result(result: ExplanationResult, terminal: Console) -> None:
    """Print the answer, what it rests on, and what comes next."""
    say(terminal, f"{verdict(result)}.", *conclusions(result))
    print_table(terminal, "Explanations", ranking_table(result))

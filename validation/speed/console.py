"""What `crosscheck speed` prints."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, print_verdicts, say
from .describe import conclusions, verdict
from .result import SpeedResult
from .tables import resonance_table, static_table

SHORT = (0, 1, 2, 3, 5, 7, 8)  # columns of the page's table of resonances


def print_result(result: SpeedResult, terminal: Console) -> None:
    """Print what stands out, and the verdicts."""
    say(terminal, f"{verdict(result)}.", *conclusions(result))
    if result.states is None:
        print_table(terminal, "Mesh forces", static_table(result))
        return
    print_table(terminal, "Resonances", resonance_table(result).with_columns(SHORT))
    print_verdicts(terminal, "Checks", result.checks)

"""What `crosscheck sweep` prints."""

from __future__ import annotations

from rich.console import Console

from ..report.console import print_table, say
from .describe import method, verdict
from .result import SweepResult
from .sections import metric_table, missing_metrics


def print_result(result: SweepResult, terminal: Console) -> None:
    """Print how many samples were computed, and their metrics."""
    how = f"; {method(result)}" if result.has_frf else ""
    say(terminal, f"{result.title}: {verdict(result)}{how}")
    print_table(terminal, "Metrics", metric_table(result))
    say(terminal, *missing_metrics(result))

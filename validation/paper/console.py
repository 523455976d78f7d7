"""What `crosscheck paper` prints: every verdict with its evidence in short."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator

from rich.console import Console
from rich.table import Table
from rich.text import Text

from . import PaperStudy
from .agreement import RouteCheck
from .results import RowVerdict, Verdict

STYLES = {
    Verdict.HOLDS: "green",
    Verdict.CORRECTED: "yellow",
    Verdict.FAILS: "bold red",
    RowVerdict.REPRODUCED: "green",
    RowVerdict.CORRECTED: "yellow",
    RowVerdict.MISSED: "bold red",
}
FRAME = 10  # lines and padding of a table with three columns


def paper_verdicts(study: PaperStudy, checks: tuple[RouteCheck, ...]) -> None:
    """Print a line for every table, odd row, figure and claim, and where routes disagree."""
    console = Console(width=None if sys.stdout.isatty() else 160)
    lines = list(_lines(study))
    table = Table(title="The paper's tables, figures and claims", title_justify="left")
    left = console.width - FRAME
    for header, words in (
        ("item", [name for name, _, _ in lines]),
        ("verdict", [_short(verdict) for _, verdict, _ in lines]),
    ):  # never cut for the evidence's sake
        width = max(map(len, (header, *words)))
        table.add_column(header, no_wrap=True, min_width=width)
        left -= width
    table.add_column("evidence", no_wrap=True, overflow="ellipsis", max_width=max(left, 8))
    for name, verdict, evidence in lines:
        table.add_row(Text(name), Text(_short(verdict), STYLES[verdict]), Text(evidence))
    if table.row_count:
        console.print(table)
    for name, verdicts in (
        ("Figures", [figure.verdict for figure in study.figures]),
        ("Claims", [claim.verdict for claim in study.claims]),
    ):
        if verdicts:
            counted = Counter(verdicts)
            console.print(f"{name}: " + ", ".join(f"{counted[v]} {_plural(v)}" for v in Verdict))
    for check in checks:
        if not check.agrees:
            console.print(
                f"The routes DISAGREE: {check.subject}, {' – '.join(check.routes)}: "
                f"{check.measure} {check.value:.1e}, {check.tolerance:.0e} allowed ({check.where})",
                style="bold red",
                markup=False,
            )


def _lines(study: PaperStudy) -> Iterator[tuple[str, Verdict | RowVerdict, str]]:
    for table in study.tables:
        yield table.id, table.verdict, table.evidence
        for row in table.rows:
            if row.verdict != RowVerdict.REPRODUCED:
                yield f"  {row.printed} Hz", row.verdict, row.reason
    for figure in study.figures:
        yield figure.id, figure.verdict, figure.evidence
    for claim in study.claims:
        yield claim.id, claim.verdict, claim.evidence


def _short(verdict: Verdict | RowVerdict) -> str:
    return verdict.replace(" with a stated correction", ", corrected")


def _plural(verdict: Verdict) -> str:
    return {Verdict.FAILS: "do not hold"}.get(verdict, verdict.replace("holds", "hold"))

"""What `crosscheck paper` prints: every verdict with its evidence, wrapped, never cut."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from ..report.console import print_verdicts, say
from .item import Item, Verdict
from .page import tally
from .result import PaperStudy
from .tables import RowVerdict

STYLES = {
    Verdict.HOLDS: "green",
    Verdict.CORRECTED: "yellow",
    Verdict.FAILS: "bold red",
    Verdict.OPEN: "blue",
    RowVerdict.REPRODUCED: "green",
    RowVerdict.CORRECTED: "yellow",
    RowVerdict.MISSED: "bold red",
}
INDENT = 4


def print_result(study: PaperStudy, terminal: Console) -> None:
    """Print every item, and where the study's own routes disagree."""
    say(terminal, "The paper's tables, figures, equations and claims", "")
    for item in study.items:
        terminal.print(_head(item), soft_wrap=True)
        for text in (Text(item.evidence), *_rows(item)):
            terminal.print(Padding(text, (0, 0, 0, INDENT)))
    say(terminal, "")
    for name, items in (
        ("Tables", study.of("tables")), ("Figures", study.of("figures")), ("Claims", study.of()),
    ):  # fmt: skip
        if items:
            say(terminal, f"{name}: {tally(item.verdict for item in items)}")
    wrong = tuple(check for check in study.checks if not check.agrees)
    if wrong:
        say(terminal, "The routes of this study DISAGREE with one another.", style="bold red")
        print_verdicts(terminal, "Routes that disagree", wrong)


def _head(item: Item) -> Text:
    return Text.assemble(
        (item.id, "bold"), "  ", (str(item.verdict), STYLES[item.verdict]), f"  {item.title}"
    )


def _rows(item: Item) -> Iterator[Text]:
    """Rows of a table that are not reproduced as printed."""
    for row in item.finding.details.get("rows", ()):
        if row.verdict != RowVerdict.REPRODUCED:
            verdict = (str(row.verdict), STYLES[row.verdict])
            yield Text.assemble(f"{row.printed}: ", verdict, f": {row.reason}")

"""What commands print of their results: the verdict table, other tables, sentences.

Text is printed as it is, never read as markup. In a file or a pipe tables are wide and sentences
one line each, for those who search them; on a terminal both wrap, and nothing is cut.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from ..checks.check import Check
from .page import Table

WIDE = 160  # columns of a file or a pipe, unless COLUMNS says otherwise


def console() -> Console:
    """Where results are printed."""
    made = Console()
    return made if made.is_terminal or "COLUMNS" in os.environ else Console(width=WIDE)


def say(terminal: Console, *sentences: str, style: str = "") -> None:
    """Print sentences, each on lines of its own."""
    for sentence in sentences:
        terminal.print(Text(sentence, style), soft_wrap=not terminal.is_terminal)


def print_table(
    terminal: Console,
    title: str,
    table: Table,
    *,
    whole: Iterable[int] = (0,),
    styles: Sequence[str] = (),
    cell_styles: Sequence[Sequence[str]] = (),
) -> None:
    """Print a table; nothing where it has no rows.

    Parameters
    ----------
    terminal, title, table
        Where, under which title, what.
    whole
        Columns that wrap last.
    styles
        Of its rows, in rich's words.
    cell_styles
        Of its cells, row by row.
    """
    if not table.rows:
        return
    grid = Grid(title=Text(title, "italic"), title_justify="left")
    for number, heading in enumerate(table.headings):
        right = number in table.numbers
        grid.add_column(
            Text(heading),
            justify="right" if right else "left",
            no_wrap=right,
            min_width=_longest_word(table, number) if number in whole else None,
            overflow="fold",
        )
    for number, row in enumerate(table.rows):
        own = cell_styles[number] if cell_styles else [""] * len(row)
        grid.add_row(
            *(Text(cell, style) for cell, style in zip(row, own, strict=True)),
            style=styles[number] if styles else None,
        )
    terminal.print(grid)


def print_verdicts(terminal: Console, title: str, checks: Sequence[Check]) -> None:
    """Print the verdict table and, where routes disagree, where and by what."""
    rows, styles = [], []
    for check in checks:
        rows.append(
            (
                check.name,
                check.subject,
                " – ".join(check.routes),
                f"{check.value:.2g}",
                f"{check.tolerance:.2g}",
                "agree" if check.agrees else "DISAGREE",
            )
        )
        styles.append(("", "", "", "", "", "green" if check.agrees else "bold red"))
    headings = ("comparison", "of", "routes", "value", "allowed", "verdict")
    table = Table(headings, tuple(rows), frozenset({3, 4}))
    print_table(terminal, title, table, whole=(5,), cell_styles=styles)
    for check in checks:
        if not check.agrees:
            routes = " – ".join(check.routes)
            say(terminal, f"{check.name}, {check.subject}: {routes}", style="bold red")
            say(terminal, *(f"  {finding}" for finding in check.findings))


def _longest_word(table: Table, column: int) -> int:
    cells = (table.headings[column], *(row[column] for row in table.rows))
    return max((len(word) for cell in cells for word in cell.split()), default=1)

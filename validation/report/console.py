"""What commands print of their results: the verdict table, other tables, sentences.

Text is printed as it is, never read as markup. In a file or a pipe tables are wide and sentences
one line each, for those who search them; on a terminal both wrap, and nothing is cut.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from ..checks.check import Check
from ..runtime.streams import terminal_text
from .page import Table

FRAME = 3  # columns a table's lines and padding take beside each of its own
WIDE = 160  # columns of a file or a pipe, unless COLUMNS says otherwise


def console() -> Console:
    """Where results are printed."""
    made = Console()
    return made if made.is_terminal or "COLUMNS" in os.environ else Console(width=WIDE)


def say(terminal: Console, *sentences: str, style: str = "") -> None:
    """Print sentences, each on lines of its own."""
    for sentence in sentences:
        terminal.print(_text(sentence, style), soft_wrap=not terminal.is_terminal)


def print_table(
    terminal: Console,
    title: str,
    table: Table,
    *,
    styles: Sequence[str] = (),
    cell_styles: Sequence[Sequence[str]] = (),
) -> None:
    """Print a table; nothing where it has no rows.

    Parameters
    ----------
    terminal, title, table
        Where, under which title, what.
    styles
        Of its rows, in rich's words.
    cell_styles
        Of its cells, row by row.
    """
    if not table.rows:
        return
    grid = Grid(title=_text(title, "italic"), title_justify="left")
    widths = _widths(table, terminal.width)
    for number, heading in enumerate(table.headings):
        grid.add_column(
            _text(heading),
            justify="right" if number in table.numbers else "left",
            width=widths[number],
            overflow="fold",
        )
    for number, row in enumerate(table.rows):
        own = cell_styles[number] if cell_styles else [""] * len(row)
        grid.add_row(
            *(_text(cell, style) for cell, style in zip(row, own, strict=True)),
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
    print_table(terminal, title, table, cell_styles=styles)
    for check in checks:
        if not check.agrees:
            routes = " – ".join(check.routes)
            say(terminal, f"{check.name}, {check.subject}: {routes}", style="bold red")
            say(terminal, *(f"  {finding}" for finding in check.findings))


def _text(text: str, style: str = "") -> Text:
    """Text of anybody's: no markup, and nothing that steers the terminal."""
    return Text(terminal_text(text), style)


def _widths(table: Table, room: int) -> list[int | None]:
    """Widths at which no word breaks and no number wraps; None, rich's own, where that is too much.

    What is left of the room goes to columns by how much more they would take.
    """
    columns = range(len(table.headings))
    least, most = zip(*(_width(table, column) for column in columns), strict=True)
    left = room - 1 - sum(least) - FRAME * len(least)
    wanted = sum(most) - sum(least)
    if left < 0 or left >= wanted:
        return [None] * len(least)
    return [a + left * (b - a) // wanted for a, b in zip(least, most, strict=True)]


def _width(table: Table, column: int) -> tuple[int, int]:
    """The width of a column's longest word, and of its longest line."""
    cells = [table.headings[column], *(row[column] for row in table.rows)]
    words = [word for cell in cells for word in cell.split()]
    whole = cells[1:] if column in table.numbers else []
    return max(map(cell_len, [*words, *whole]), default=1), max(map(cell_len, cells))

"""How objects show themselves: one line in a terminal, a small table in a notebook.

`fbs` has the same for its own objects: neither of the two packages knows the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

MOST = 12  # labels named, and rows shown, of what may have hundreds


def counted(count: int, noun: str, plural: str = "") -> str:
    """A count with its noun: 1 DoF, 2 DoFs."""
    return f"{count} {noun if count == 1 else plural or f'{noun}s'}"


def listing(labels: Sequence[str]) -> str:
    """The first labels, and how many there are if that is not all."""
    shown = ", ".join(labels[:MOST])
    return shown if len(labels) <= MOST else f"{shown}, … ({len(labels)} in all)"


def html_table(
    title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = (), more: int = 0
) -> str:
    """An HTML table; what stands in it is text, whatever markup it holds.

    Parameters
    ----------
    title
        Its caption.
    rows
        Their cells; the first is the row's heading.
    header
        Headings of the columns.
    more
        Rows that are left out, which the last one says.
    """
    head = f"<tr>{''.join(f'<th>{escape(cell)}</th>' for cell in header)}</tr>" if header else ""
    body = "".join(
        f"<tr><th>{escape(first)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for first, *cells in rows
    )
    rest = f'<tr><td colspan="{len(header) or 2}">… and {more} more</td></tr>' if more else ""
    return f"<table><caption>{escape(title)}</caption>{head}{body}{rest}</table>"

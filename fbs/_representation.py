"""How objects show themselves: one line in a terminal, a small table in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from ._kernels.checks import FloatArray

MOST = 12
"""Labels named, and rows shown, of what may have hundreds."""


def counted(count: int, noun: str) -> str:
    """Write a count with its noun: 1 line, 2 lines."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def spanned(frequency: FloatArray) -> str:
    """Write how many lines a frequency axis has, and from where to where."""
    return f"{counted(frequency.size, 'line')}, {frequency[0]:g}–{frequency[-1]:g} Hz"


def listing(labels: Sequence[str]) -> str:
    """Write the first labels, and how many there are if that is not all."""
    shown = ", ".join(labels[:MOST])
    return shown if len(labels) <= MOST else f"{shown}, … ({len(labels)} in all)"


def html_table(
    title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = (), more: int = 0
) -> str:
    """Return an HTML table; what stands in it is text, whatever markup it holds.

    Parameters
    ----------
    title : str
    rows : iterable of sequence of str
        Their first cell is the row's heading.
    header : sequence of str
        Headings of the columns.
    more : int
        Rows that are left out, which the last one says.
    """
    head = f"<tr>{''.join(f'<th>{escape(cell)}</th>' for cell in header)}</tr>" if header else ""
    body = "".join(
        f"<tr><th>{escape(first)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for first, *cells in rows
    )
    rest = f'<tr><td colspan="{len(header) or 2}">… and {more} more</td></tr>' if more else ""
    return f"<table><caption>{escape(title)}</caption>{head}{body}{rest}</table>"

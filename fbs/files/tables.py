"""Tables of numbers with a header, as spreadsheets and measuring systems write them (CSV).

Separated by comma, semicolon or tab; with semicolon or tab decimals may have a comma. Lines that
start with # and blank ones before the header are remarks. A unit stands in a column's name,
"force (N)" or "force [N]", or in a line of units below the names.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from .untrusted import read_plain

ROWS = 1000  # as Python has them, at a time: numbers of which take four times those of numpy
LONGEST_LINE = 2**24  # characters of a header: 100 000 columns


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of numbers.

    Parameters
    ----------
    remarks : tuple of str
        The lines before the header.
    names : tuple of str
    units : tuple of str
        Of a line of units; else empty.
    values : array, shape (n_row, n_column)
    """

    remarks: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]


def read_table(path: Path) -> Table:
    """Read a table of numbers.

    Raises
    ------
    FbsError
        No header, rows of other length, or what is no number.
    OSError
        As for `untrusted.open_plain`.
    """
    text = io.StringIO(_decoded(read_plain(path, _require_text)))
    remarks = []
    line = text.readline(LONGEST_LINE)
    while line.startswith("#") or (line and not line.strip()):
        remarks.append(line.strip())
        line = text.readline(LONGEST_LINE)
    separator = max(",;\t", key=lambda sign: (line.count(sign), sign == ","))
    names = _fields(line, separator)
    if not any(names) or all(_is_number(name) for name in names):
        raise FbsError(f"it has no header with the names of its columns: {line.strip()[:40]!r}")
    start = text.tell()
    second = _fields(text.readline(LONGEST_LINE), separator)
    has_units = len(second) == len(names) and not any(_is_number(field) for field in second)
    if not has_units:
        text.seek(start)
    units = second if has_units else [""] * len(names)
    body = text.read()
    if separator != "," and "," in body:
        body = body.replace(",", ".")
    values = _numbers(body, separator, len(names))
    return Table(tuple(remarks), tuple(names), tuple(u.strip("()[] ") for u in units), values)


def _require_text(head: bytes) -> None:
    if b"\0" in head:
        raise FbsError("it is no text file")


def _decoded(content: bytes) -> str:
    """Return text in UTF-8, or else in Latin-1 as old programs write it."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _fields(line: str, separator: str) -> list[str]:
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error as error:
        raise FbsError(f"its header is damaged ({error})") from error


def _is_number(text: str) -> bool:
    return (
        re.fullmatch(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?|nan|inf", text, re.I) is not None
    )


def _numbers(body: str, separator: str, n_column: int) -> NDArray[np.float64]:
    if not body.strip():
        raise FbsError("there are no rows below the header")
    try:
        values = np.loadtxt(io.StringIO(body), delimiter=separator, ndmin=2, comments=None)
    except ValueError as error:
        told = str(error).splitlines()[0].partition(";")[0]  # after it NumPy advises its callers
        raise FbsError(f"below the header: {told}") from error
    if values.shape[1] != n_column:
        raise FbsError(f"the header has {n_column} columns, the rows have {values.shape[1]}")
    return values


def write_table(
    file: BinaryIO,
    names: Sequence[str],
    columns: Sequence[NDArray[np.float64]],
    remarks: Sequence[str] = (),
) -> None:
    """Write columns with their names, every digit kept.

    Parameters
    ----------
    file : binary file, open
    names : str
    columns : arrays, shape (n_row,)
    remarks : str
        Lines before the header, without the #.

    Raises
    ------
    FbsError
        A name that is unprintable.
    """
    for name in names:
        if not name.isprintable():
            raise FbsError(f"label {name!r} is unprintable and would not survive in a CSV")
    text = io.TextIOWrapper(file, encoding="utf-8", newline="")
    text.writelines(f"# {remark}\n" for remark in remarks)
    writer = csv.writer(text)
    writer.writerow(names)
    for start in range(0, len(columns[0]), ROWS):
        rows = [column[start : start + ROWS] for column in columns]
        writer.writerows(np.column_stack(rows).tolist())
    text.detach()

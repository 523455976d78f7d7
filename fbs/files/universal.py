"""Universal files: datasets told apart, functions (58) and units (164) read and written.

Format: https://www.ceas3.uc.edu/sdrluff/, datasets 58, 58b and 164. Records are columns, so a name
that is too long is refused, not read on as the number behind it. A dataset ends at a line of -1
after which the file ends or the next one begins: a record that ends in -1 does not end it. What a
header announces is held against the bytes that follow before any of them become numbers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._kernels.checks import FloatArray
from ..errors import FbsError
from .untrusted import read_plain, require_values

FRF, TRANSMISSIBILITY, COHERENCE, MULTIPLE_COHERENCE, TIME_RESPONSE = 4, 5, 6, 26, 1
EVEN, UNEVEN = 1, 0
SINGLE, DOUBLE = (2, 5), (4, 6)
COMPLEX = (5, 6)
LINE = 80
"""Characters of an ID line."""
NAME = 10
"""Characters of an entity name."""

FUNCTION_TYPES = {
    0: "general functions",
    1: "time responses",
    2: "auto spectra",
    3: "cross spectra",
    4: "FRFs",
    5: "transmissibilities",
    6: "coherences",
    9: "power spectral densities",
    12: "spectra",
    26: "multiple coherences",
    27: "order functions",
}


class UffError(FbsError):
    """A universal file that is damaged or holds something else, or what does not fit into one."""


@dataclass(frozen=True)
class End:
    """One end of a function: entity name, node, and direction code -6 to 6 (0: a scalar)."""

    node: int
    direction: int = 0
    entity: str = "NONE"


@dataclass(frozen=True)
class Axis:
    """Data type (8 displacement, 13 force, 18 frequency, …), label and unit label."""

    kind: int
    label: str = "NONE"
    unit: str = "NONE"
    exponents: tuple[int, int, int] = (0, 0, 0)


@dataclass(frozen=True, eq=False)
class Function:
    """A dataset 58.

    Parameters
    ----------
    ids : five str
    kind : int
        Function type: 4 is an FRF, 1 a time response.
    response, reference : End
    abscissa, ordinate, denominator : Axis
    x : array, shape (n,)
    values : array, shape (n,), real or complex
    spacing : int
        EVEN or UNEVEN.
    step : float
        Of an even abscissa.
    number : int
        Which dataset of the file it is, from 1 on.
    version : int
    """

    ids: tuple[str, str, str, str, str]
    kind: int
    response: End
    reference: End
    abscissa: Axis
    ordinate: Axis
    denominator: Axis
    x: FloatArray
    values: Any
    spacing: int = EVEN
    step: float = 0.0
    number: int = 0
    version: int = 1


@dataclass(frozen=True)
class UnitSystem:
    """Dataset 164: a value in the file's units is its value in SI times the factor."""

    length: float = 1.0
    force: float = 1.0
    description: str = "SI"
    code: int = 1


@dataclass(frozen=True, eq=False)
class Universal:
    """What a universal file holds: its functions, its unit systems, and the types of all."""

    functions: tuple[Function, ...]
    units: tuple[UnitSystem, ...]
    types: tuple[int, ...]

    def __str__(self) -> str:
        numbers = ", ".join(str(kind) for kind in sorted(set(self.types)))
        found = f"there are datasets {numbers}" if numbers else "there are no datasets at all"
        kinds = sorted({f.kind for f in self.functions})
        return found + (f", functions of type {kinds}" if kinds else "")


# --- reading -----------------------------------------------------------------------------------

DELIMITER = re.compile(rb"^ {0,4}-1[ \t]*\r?(?:\n|\Z)", re.MULTILINE)
BLANK = re.compile(rb"(?:[ \t]*\r?\n)*[ \t]*")
EOL = re.compile(rb"\r\n|\n|\r")


def read_universal(path: str | Path) -> Universal:
    """Read the datasets 58 and 164 of a universal file; others are passed over.

    Raises
    ------
    UffError
        The file is truncated, or a dataset damaged (named by number and type).
    FbsError, OSError
        As for `untrusted.open_plain`.
    """
    content = read_plain(path, _require_text)
    functions: list[Function] = []
    units: list[UnitSystem] = []
    types: list[int] = []
    at = 0
    while (start := _begin(content, at)) is not None:
        number = len(types) + 1
        head, at = _line(content, start)
        kind = _whole(head[:6], f"the type of dataset number {number}")
        types.append(kind)
        if kind == 58:
            function, at = _function(content, head, at, number)
            functions.append(function)
        else:
            end = _end(content, at)
            if kind == 164:
                units.append(_unit_system(content[at : end.start()], number))
            at = end.end()
    return Universal(tuple(functions), tuple(units), tuple(types))


def _require_text(head: bytes) -> None:
    """Refuse what begins with no dataset, however long it is."""
    if head.strip(b" \t\r\n") and _begin(head, 0) is None:
        raise UffError(
            "it is no universal file: there are no datasets at all (no line of -1 begins one)"
        )


def _begin(content: bytes, at: int) -> int | None:
    """Return where the next dataset's type stands; None where no other follows."""
    blank = BLANK.match(content, at)
    line_start = content.rfind(b"\n", 0, blank.end()) + 1 if blank else at
    opening = DELIMITER.match(content, max(line_start, at))
    if opening is None:
        if at and content[at:].strip():
            raise UffError("what follows its last whole dataset is none: no line of -1 begins it")
        return None
    return opening.end()


def _end(content: bytes, at: int) -> re.Match[bytes]:
    """Return the delimiter that closes a dataset: one after which the next begins, or nothing."""
    for found in DELIMITER.finditer(content, at):
        rest = BLANK.match(content, found.end())
        after = rest.end() if rest else found.end()
        if after >= len(content) or DELIMITER.match(content, content.rfind(b"\n", 0, after) + 1):
            return found
    raise UffError("the file is truncated: its last dataset has no end")


def _line(content: bytes, at: int) -> tuple[bytes, int]:
    found = EOL.search(content, at, at + 4096)
    if found is None:
        raise UffError("the file is truncated: its last dataset has no end")
    return content[at : found.start()], found.end()


def _text(line: bytes) -> str:
    """Return a line as characters: UTF-8, or else Latin-1 as old programs write it."""
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _whole(text: bytes | str, what: str) -> int:
    try:
        return int(text)
    except ValueError:
        shown = text.decode("latin-1") if isinstance(text, bytes) else text
        raise UffError(f"{what} is {shown.strip()!r}, no whole number") from None


def _real(text: str, what: str) -> float:
    try:
        return float(text.strip().upper().replace("D", "E"))
    except ValueError:
        raise UffError(f"{what} is {text.strip()!r}, no number") from None


def _columns(line: str, widths: Sequence[int]) -> list[str]:
    fields, at = [], 0
    for width in widths:
        fields.append(line[at : at + width])
        at += width
    return fields


def _unit_system(content: bytes, number: int) -> UnitSystem:
    what = f"of dataset number {number} (164)"
    lines = [_text(line) for line in EOL.split(content)]
    code, description, _ = _columns(lines[0], (10, 20, 10))
    rest = " ".join(lines[1:]).split()
    if len(rest) < 2:
        raise UffError(f"the factors {what} are missing")
    length, force = (_real(text, f"a factor {what}") for text in rest[:2])
    if not (0 < length < np.inf and 0 < force < np.inf):
        raise UffError(f"dataset 164 has the unit factors length {length:g} and force {force:g}")
    return UnitSystem(length, force, description.strip(), _whole(code, f"the unit code {what}"))


def _function(content: bytes, head: bytes, at: int, number: int) -> tuple[Function, int]:
    name = f"dataset number {number} (58)"
    lines = []
    for _ in range(11):
        line, at = _line(content, at)
        lines.append(_text(line).ljust(LINE))
    kind, version, response, reference = _ends(lines[5], name)
    form = _columns(lines[6], (10, 10, 10, 13, 13))
    ordinate, count, spacing = (_whole(text, f"the data form of {name}") for text in form[:3])
    if ordinate not in SINGLE + DOUBLE or spacing not in (EVEN, UNEVEN):
        raise UffError(
            f"{name} has the ordinate type {ordinate} and the spacing {spacing}; known are 2, 4, "
            "5, 6 and 0, 1"
        )
    if count < 1:
        raise UffError(f"{name} announces {count} values")
    first, step = (_real(text, f"the abscissa of {name}") for text in form[3:])
    table, at = _values(content, head, at, (ordinate, count, spacing), name)
    abscissa, above, below = (_axis(line, name) for line in lines[7:10])
    x = table[:, 0] if spacing == UNEVEN else first + step * np.arange(count)
    y = table[:, spacing == UNEVEN :]
    with np.errstate(invalid="ignore"):  # who takes what is not finite refuses it, in words
        values = y[:, 0] + 1j * y[:, 1] if ordinate in COMPLEX else y[:, 0]
    ids = tuple(line.rstrip() for line in lines[:5])
    function = Function(
        ids,  # type: ignore[arg-type]  # five lines
        kind,
        response,
        reference,
        abscissa,
        above,
        below,
        np.asarray(x, dtype=float),
        values,
        spacing,
        step,
        number,
        version,
    )
    return function, at


def _ends(line: str, name: str) -> tuple[int, int, End, End]:
    """Return function type, version and both ends of record 6, whose columns must be its own."""
    kind, _, version, _ = (
        _whole(text, f"record 6 of {name}") for text in _columns(line, (5, 10, 5, 10))
    )
    response = _one_end(line[30:55], f"record 6 of {name}", "response")
    reference = _one_end(line[55:].rstrip().ljust(25), f"record 6 of {name}", "reference")
    return kind, version, response, reference


def _one_end(text: str, record: str, what: str) -> End:
    if not text.strip():
        return End(0)
    columns = re.fullmatch(r" (.{10})( *[-+]?\d+)( *[-+]?\d+)", text)
    if columns is None or columns.end(2) != 21:
        raise UffError(
            f"{record} does not keep to its columns: its {what} reads {text.strip()!r} (an entity "
            f"name has at most {NAME} characters)"
        )
    entity, node, direction = columns[1].strip(), int(columns[2]), int(columns[3])
    if abs(direction) > 6:
        raise UffError(
            f"{record}: node {node} has the direction code {direction}; known are -6 to 6"
        )
    return End(node, direction, entity or "NONE")


def _axis(line: str, name: str) -> Axis:
    kind, *exponents, _, label, _, unit = _columns(line, (10, 5, 5, 5, 1, 20, 1, 20))
    powers = [_whole(text, f"an axis of {name}") if text.strip() else 0 for text in exponents]
    return Axis(
        _whole(kind, f"an axis of {name}"),
        label.strip(),
        unit.strip(),
        (powers[0], powers[1], powers[2]),
    )


# --- values ------------------------------------------------------------------------------------

Form = tuple[int, int, int]
NUMBER = re.compile(
    rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?|[-+]?(?:nan|inf(?:inity)?)", re.I
)


def _columns_of_values(ordinate: int, spacing: int) -> tuple[tuple[int, ...], int]:
    """Return the widths of the numbers of one value, and how many values a line has."""
    width = 20 if ordinate in DOUBLE else 13
    widths = (13,) * (spacing == UNEVEN) + (width,) * (1 + (ordinate in COMPLEX))
    return widths, {13: 6, 20: 4}[width] // len(widths)


def _values(content: bytes, head: bytes, at: int, form: Form, name: str) -> tuple[FloatArray, int]:
    """Return the numbers, shape (count, per value), and where the next dataset begins."""
    ordinate, count, spacing = form
    if head[6:7].lower() == b"b":
        return _binary(content, _text(head), at, form, name)
    numbers = len(_columns_of_values(ordinate, spacing)[0])
    end = _end_of_numbers(content, at, name)
    require_values(count, end.start() - at, 2 * numbers, name)
    text = content[at : end.start()]
    values = _fixed(text, form)
    if values is None:
        found = NUMBER.findall(text)
        if NUMBER.sub(b"", text).strip():
            raise UffError(f"{name} is damaged: its values are no numbers")
        values = np.array([float(t.upper().replace(b"D", b"E")) for t in found])
    if values.size != count * numbers:
        raise UffError(f"{name} has {values.size / numbers:g} values where {count} are announced")
    return values.reshape(count, numbers), end.end()


def _end_of_numbers(content: bytes, at: int, name: str) -> re.Match[bytes]:
    """The first line of -1: no line of a function's values is one."""
    found = DELIMITER.search(content, at)
    if found is None:
        raise UffError("the file is truncated: its last dataset has no end")
    return found


def _fixed(text: bytes, form: Form) -> FloatArray | None:
    """Return numbers that keep to their columns, fast; None if they do not."""
    ordinate, _, spacing = form
    widths, per_line = _columns_of_values(ordinate, spacing)
    lines = [line.rstrip() for line in text.rstrip().split(b"\n")]
    if any(len(line) != sum(widths) * per_line for line in lines[:-1]):
        return None
    if len(lines[-1]) % sum(widths):
        return None
    record = np.dtype([(f"n{k}", f"S{width}") for k, width in enumerate(widths)])
    rows = np.frombuffer(b"".join(lines).upper().replace(b"D", b"E"), dtype=record)
    try:
        return np.column_stack([rows[name].astype(float) for name in record.names or ()]).ravel()
    except ValueError:
        return None


def _binary(content: bytes, head: str, at: int, form: Form, name: str) -> tuple[FloatArray, int]:
    """Return the numbers of a dataset 58b.

    Its abscissa is single precision by the book and as wide as the ordinate in many programs; the
    one that ends at the delimiter is meant, since the number of bytes announced is often wrong.
    """
    ordinate, count, spacing = form
    order, kind = (_whole(text, f"the binary form of {name}") for text in (head[7:13], head[13:19]))
    if order not in (1, 2) or kind != 2:
        raise UffError(
            f"{name} has byte order {order} and binary format {kind}; known are 1, 2 and 2 (IEEE)"
        )
    numbers = len(_columns_of_values(ordinate, spacing)[0])
    byte = "<" if order == 1 else ">"
    wide = f"{byte}f{8 if ordinate in DOUBLE else 4}"
    require_values(count, len(content) - at, (numbers - 1 or 1) * 4, name)
    for first in dict.fromkeys((wide, f"{byte}f4") if spacing == UNEVEN else (wide,)):
        fields = [first] * (spacing == UNEVEN) + [wide] * (numbers - (spacing == UNEVEN))
        dtype = np.dtype([(f"c{k}", kind_of) for k, kind_of in enumerate(fields)])
        end = DELIMITER_AFTER_BYTES.match(content, at + count * dtype.itemsize)
        if end is not None:
            rows = np.frombuffer(content, dtype=dtype, count=count, offset=at)
            columns = [rows[field].astype(float) for field in dtype.names or ()]
            return np.column_stack(columns), end.end()
    raise UffError(
        f"{name} has not the {count} binary values it announces: no line of -1 follows them"
    )


DELIMITER_AFTER_BYTES = re.compile(rb"[\r\n]*[ ]{0,4}-1[ \t]*\r?(?:\n|\Z)")

"""Datasets 58 and 164 of universal files as bytes, ASCII or binary; see `universal`."""

from __future__ import annotations

import sys

import numpy as np

from .universal import (
    COMPLEX,
    EVEN,
    LINE,
    NAME,
    UNEVEN,
    Axis,
    End,
    Function,
    UffError,
    UnitSystem,
)

ASCII, BINARY = "ascii", "binary"
HEADER_LINES = 11


SI = UnitSystem()


def unit_system_text(units: UnitSystem = SI) -> bytes:
    """Return a dataset 164."""
    factors = "".join(f"{value:25.17E}".replace("E", "D") for value in (units.length, units.force))
    text = (
        f"{-1:6d}\n{164:6d}{'':74s}\n{units.code:10d}{units.description:20.20s}{2:10d}\n"
        f"{factors}{1.0:25.17E}\n{273.15:25.17E}\n{-1:6d}\n"
    )
    return text.encode("ascii")


def function_text(function: Function, form: str = ASCII) -> bytes:
    """Return a dataset 58, its values in double precision.

    Parameters
    ----------
    function : Function
    form : "ascii" or "binary"
        ASCII keeps twelve digits of a value, binary all; of an abscissa both keep six.

    Raises
    ------
    UffError
        An ID line, an entity name, a label or a number that its columns do not hold.
    """
    ordinate = 6 if np.iscomplexobj(function.values) else 4
    header = _header(function, ordinate)
    table = _table(function, ordinate)
    if form == ASCII:
        first, body = f"{58:6d}{'':74s}", _numbers(table, function.spacing, ordinate)
    else:
        order = 1 if sys.byteorder == "little" else 2
        # by the book the abscissa is single precision; double is what the programs in use read
        body = np.ascontiguousarray(table, dtype=float).tobytes()
        first = f"{58:6d}b{order:6d}{2:6d}{HEADER_LINES:12d}{len(body):12d}"
        first += f"{0:6d}{0:6d}{0:12d}{0:12d}"
    return f"{-1:6d}\n{first}\n{header}".encode() + body + f"{-1:6d}\n".encode("ascii")


def six_digits(values: np.ndarray | list[float]) -> np.ndarray:
    """Return the values as E13.5 keeps them."""
    return np.array([float(f"{value:.5e}") for value in values])


def _header(function: Function, ordinate: int) -> str:
    lines = [_fitting(line or "NONE", LINE, "the ID line").ljust(LINE) for line in function.ids]
    lines.append(
        f"{function.kind:5d}{0:10d}{function.version:5d}{0:10d}"
        f"{_end(function.response)}{_end(function.reference)}"
    )
    even = function.spacing == EVEN
    start, step = (float(function.x[0]), function.step) if even else (0.0, 0.0)
    lines.append(
        f"{ordinate:10d}{function.x.size:10d}{function.spacing:10d}"
        f"{start:13.5E}{step:13.5E}{0.0:13.5E}"
    )
    axes = (function.abscissa, function.ordinate, function.denominator, Axis(0))
    return "\n".join([*lines, *(_axis(axis) for axis in axes), ""])


def _end(end: End) -> str:
    entity = _fitting(end.entity, NAME, "the entity name")
    if not 0 <= end.node < 10**9:
        raise UffError(f"the node {end.node} does not fit into ten columns")
    return f" {entity:<{NAME}s}{end.node:10d}{end.direction:4d}"


def _axis(axis: Axis) -> str:
    length, force, temperature = axis.exponents
    return (
        f"{axis.kind:10d}{length:5d}{force:5d}{temperature:5d} "
        f"{_fitting(axis.label, 20, 'the axis label'):<20s} "
        f"{_fitting(axis.unit, 20, 'the unit'):<20s}"
    )


def _fitting(text: str, width: int, what: str) -> str:
    if len(text) > width or not text.isprintable():
        raise UffError(f"{what} {text!r} does not fit into {width} printable characters")
    return text


def _table(function: Function, ordinate: int) -> np.ndarray:
    """Return the numbers in the order they stand in, shape (n, per value)."""
    values = function.values
    columns = [values.real, values.imag] if ordinate in COMPLEX else [values]
    if function.spacing == UNEVEN:
        columns.insert(0, function.x)
    return np.column_stack(columns)


def _numbers(table: np.ndarray, spacing: int, ordinate: int) -> bytes:
    value = ["%13.5E"] * (spacing == UNEVEN) + ["%20.11E"] * (1 + (ordinate in COMPLEX))
    per_line = 4 // len(value)
    whole = len(table) - len(table) % per_line
    line = "".join(value) * per_line + "\n"
    text = line * (whole // per_line) % tuple(table[:whole].ravel().tolist())
    if whole < len(table):
        rest = table[whole:]
        text += "".join(value) * len(rest) % tuple(rest.ravel().tolist()) + "\n"
    return text.encode("ascii")

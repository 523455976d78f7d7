"""Records in CSV: what we write, and headers as people write them.

A column is a force if its unit is one (N, lbf, kN; N m), a motion if its is (m, mm/s, g, rad/s²);
its label is its name without the unit and without a word such as "input", "force" or "acc". Time
may be in ms or µs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from ..frf import Quantity
from ..signal.records import Record
from .stated_units import motion_dimension
from .tables import Table, read_table, write_table
from .units import FORCE, MOMENT, TIME, is_nothing, read_unit

UNITS = {Quantity.RECEPTANCE: "m", Quantity.MOBILITY: "m/s", Quantity.ACCELERANCE: "m/s^2"}
RATE, METADATA = "sampling_frequency_hz: ", "metadata: "
NEEDED = 'such as "time (s)", "force hammer.z (N)" and "acc 12.z (m/s^2)"'
TIMES = re.compile(r"(time|t|zeit|temps|tiempo|seconds?|sec|s)\b", re.IGNORECASE)
ROLE = re.compile(
    r"(?P<role>input|force|excitation|hammer|shaker|load|moment|torque|output|response|motion|"
    r"acceleration|accel|acc|velocity|vel|displacement|disp)(?=[ :_-]|$)[ :_-]*",
    re.IGNORECASE,
)
INPUTS = {"input", "force", "excitation", "hammer", "shaker", "load", "moment", "torque"}
ROTATION = re.compile(r"\.r[xyz]$", re.IGNORECASE)

Metadata = Mapping[str, Any]
Channels = Mapping[str, tuple[str, str]]


@dataclass(frozen=True, eq=False)
class Column:
    """A channel in SI: quantity None is a force."""

    label: str
    quantity: Quantity | None
    samples: NDArray[np.float64]


def write_record_csv(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    """Write a record; every digit is kept.

    Raises
    ------
    FbsError
        A label that is unprintable.
    """
    for label in (*record.excitations, *record.responses):
        if not label.isprintable():
            raise FbsError(f"label {label!r} is unprintable and would not survive in a CSV")
    names = ["time (s)", *(f"input {label} (N)" for label in record.excitations)]
    names += [f"output {label} ({UNITS[record.quantity]})" for label in record.responses]
    columns = [record.time, *record.inputs.T, *record.outputs.T]
    remarks = (f"{RATE}{record.sampling_frequency!r}", METADATA + json.dumps(metadata))
    write_table(file, names, columns, remarks)


def read_record_csv(path: Path, channels: Channels) -> tuple[Record, dict[str, Any]]:
    """Read a record and its metadata.

    Parameters
    ----------
    path : path
    channels : mapping of str to (str, str)
        Column → its label and unit, where its name does not say them.

    Raises
    ------
    FbsError
        No time, a column that is neither force nor motion, time that is not uniform.
    """
    table = read_table(path)
    match = TIMES.match(table.names[0])
    if match is None:
        raise FbsError(f"its first column is {table.names[0]!r}, no time; needed are {NEEDED}")
    time = table.values[:, 0] * _seconds(table)
    columns = [
        column_of(name, unit, samples, channels)
        for name, unit, samples in zip(
            table.names[1:], table.units[1:], table.values.T[1:], strict=True
        )
    ]
    rate, notes = _remarks(table)
    return record_of(columns, time, rate), notes


def column_of(name: str, unit: str, samples: NDArray[np.float64], channels: Channels) -> Column:
    """Return a channel in SI by its name and unit, or as the user says.

    Raises
    ------
    FbsError
        A unit that is missing, unknown, of no force or motion, or not what the name says.
    """
    label, role = name, ""
    if name in channels:
        label, unit = channels[name]
    else:
        bracket = re.fullmatch(r"(.*?)\s*[(\[]([^()\[\]]*(?:\([^()]*\)[^()]*)?)[)\]]\s*", name)
        if bracket and not unit:
            label, unit = bracket[1].strip(), bracket[2].strip()
        match = ROLE.match(label)
        if match:
            role, label = match["role"].lower(), label[match.end() :] or label
    if is_nothing(unit):
        raise FbsError(
            f"a column is called {name!r}, without a unit; needed are names {NEEDED}, or say what "
            f"it is (--channel '{name}=LABEL UNIT')"
        )
    factor, quantity = _si(label, unit, name)
    if role and (role in INPUTS) != (quantity is None):
        raise FbsError(f"a column is called {name!r}, but its unit is {unit!r}")
    return Column(label, quantity, samples * factor)


def _si(label: str, unit: str, name: str) -> tuple[float, Quantity | None]:
    turning = ROTATION.search(label) is not None
    kinds = {None: (FORCE, MOMENT)} | {
        q: (motion_dimension(False, q), motion_dimension(True, q)) for q in Quantity
    }
    for quantity, dimensions in kinds.items():
        found = read_unit(unit, dimensions)
        if found is None:
            continue
        if (found.dimension == dimensions[1]) != turning:
            raise FbsError(
                f"the column {name!r} is in {unit!r}, and its label {label!r} "
                f"{'ends' if turning else 'does not end'} in .rx, .ry or .rz as a rotation's does"
            )
        return found.factor, quantity
    raise FbsError(f"the column {name!r} is in {unit!r}, neither a force nor a motion")


def _seconds(table: Table) -> float:
    bracket = re.search(r"[(\[](.*)[)\]]", table.names[0])
    unit = table.units[0] or (bracket[1] if bracket else "")
    if is_nothing(unit):
        return 1.0
    found = read_unit(unit, (TIME,))
    if found is None:
        raise FbsError(f"its first column is {table.names[0]!r}, in no unit of time")
    return found.factor


def record_of(
    columns: list[Column], time: NDArray[np.float64] | None, rate: float | None
) -> Record:
    """Return the record of channels sampled at `time` (s), or at `rate` (Hz).

    Raises
    ------
    FbsError
        No force or no motion, or motions of several quantities.
    """
    inputs = [c for c in columns if c.quantity is None]
    outputs = [c for c in columns if c.quantity is not None]
    if not inputs or not outputs:
        raise FbsError(
            f"a force and a motion are needed; there are the forces "
            f"{', '.join(c.label for c in inputs) or 'none'} and the motions "
            f"{', '.join(c.label for c in outputs) or 'none'} (motions alone give "
            "transmissibilities, no FRFs)"
        )
    quantities = {c.label: c.quantity for c in outputs}
    if len(set(quantities.values())) > 1:
        mixed = ", ".join(f"{label} (as {quantity})" for label, quantity in quantities.items())
        raise FbsError(f"displacements, velocities and accelerations are mixed: {mixed}")
    quantity = next(q for q in quantities.values() if q is not None)
    u, y = (np.column_stack([c.samples for c in group]) for group in (inputs, outputs))
    excitations, responses = (tuple(c.label for c in group) for group in (inputs, outputs))
    if time is None:
        if rate is None:
            raise FbsError("its sampling frequency is not stated")
        return Record(rate, u, y, excitations, responses, quantity)
    record = Record.from_time(time, u, y, excitations, responses, quantity)
    if rate is None:
        return record
    if not abs(rate - record.sampling_frequency) <= 1e-3 * rate / record.n_sample:
        raise FbsError(
            f"its first lines say {rate:.10g} Hz, its times {record.sampling_frequency:.10g} Hz"
        )
    return Record(rate, u, y, excitations, responses, quantity)


def _remarks(table: Table) -> tuple[float | None, dict[str, Any]]:
    rate, notes = None, {}
    for line in table.remarks:
        remark = line.removeprefix("#").strip()
        if remark.startswith(RATE):
            rate = _number(remark.removeprefix(RATE))
        elif remark.startswith(METADATA):
            notes = notes_of(remark.removeprefix(METADATA))
    return rate, notes


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise FbsError(f"the sampling frequency is {text.strip()!r}, no number") from error


def notes_of(text: str) -> dict[str, Any]:
    """Return metadata kept as JSON.

    Raises
    ------
    FbsError
        They are none, or no table.
    """
    try:
        notes = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FbsError(f"the metadata are no JSON ({error})") from error
    if not isinstance(notes, dict):
        raise FbsError("the metadata are no table of keys and values")
    return notes

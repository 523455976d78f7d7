"""Records of time: universal files, dataset 58, functions of time (type 1).

One function per channel, ASCII double precision: samples have twelve digits. The step has six
(E13.5), so a sampling frequency must be a whole number of hertz that six digits of its step give
back (51200 Hz is read from 1.95312E-05 s), or have a step of six digits.

Forces stand as "excitation: label" in ID line 4, responses as "response: label"; lines 2, 3 and 5
hold the metadata as JSON. Files from others have no such lines: labels are then as in `uff`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..signal.records import Record
from .record_csv import ROTATION, Column, record_of
from .stated_units import channel_unit, unit_system
from .uff import dof_label
from .uff_functions import DATA_TYPES, EXCITATION, FORCE, RESPONSE, UNITS, refuse_unfit_label
from .units import TIME as TIME_DIMENSION
from .units import is_nothing, read_unit
from .universal import (
    EVEN,
    LINE,
    TIME_RESPONSE,
    Axis,
    End,
    Function,
    UffError,
    UnitSystem,
    read_universal,
)
from .universal_text import function_text, six_digits, unit_system_text

TIME = 17


def write_uff_record(record: Record, file: BinaryIO, metadata: Mapping[str, Any]) -> None:
    """Write a record to an open file.

    Raises
    ------
    UffError
        A sampling frequency that six digits do not carry, metadata or labels that do not fit.
    """
    if record.n_sample < 2:
        raise UffError("UFF needs two samples at least")
    rate = record.sampling_frequency
    stored = _rate(float(six_digits([1 / rate])[0]))
    if abs(stored - rate) > 1e-12 * rate:
        raise UffError(
            f"UFF keeps six digits of the time step: sampling at {rate:.10g} Hz would become "
            f"{stored:.10g} Hz; sample at a whole number of hertz, or use another format"
        )
    notes = _id_lines(metadata)
    for label in (*record.excitations, *record.responses):
        refuse_unfit_label(label)
    file.write(unit_system_text())
    for function in _functions(record, notes):
        file.write(function_text(function))


def read_uff_record(path: Path) -> tuple[Record, dict[str, Any]]:
    """Read the functions of time of a universal file, forces as inputs and motions as outputs.

    Raises
    ------
    UffError
        As for `read_uff_records`, or a channel that is there more than once.
    """
    records, notes = read_uff_records(path)
    if len(records) > 1:
        raise UffError(
            f"the channel {records[0].excitations[0]!r} is there more than once: it holds "
            f"{len(records)} records"
        )
    return records[0], notes


def read_uff_records(path: Path) -> tuple[list[Record], dict[str, Any]]:
    """Read all records of a universal file: one for every time its channels are there.

    Raises
    ------
    UffError
        No functions of time, no force or no motion among them, channels of different steps,
        lengths or quantities, or of different number.
    """
    file = read_universal(path)
    channels = [f for f in file.functions if f.kind == TIME_RESPONSE]
    if not channels:
        raise UffError(f"no function of time (dataset 58, function type 1) inside; {file}")
    first = channels[0]
    system = unit_system(file.units)
    found: dict[tuple[str, bool], list[Column]] = {}
    for channel in channels:
        for what, one, other in (
            ("time steps", first.step, channel.step),
            ("lengths", first.x.size, channel.x.size),
        ):
            if one != other:
                raise UffError(f"the channels have different {what}: {one}, {other}")
        column = _channel(channel, system)
        found.setdefault((column.label, column.quantity is None), []).append(column)
    counts = {label: len(columns) for (label, _), columns in found.items()}
    if len(set(counts.values())) > 1:
        raise UffError(
            "its channels are there a different number of times: "
            + ", ".join(f"{label} ({n})" for label, n in counts.items())
        )
    rate = _rate(_step(first))
    records = [
        record_of([columns[n] for columns in found.values()], None, rate)
        for n in range(next(iter(counts.values())))
    ]
    return records, _metadata(first)


def _functions(record: Record, notes: tuple[str, str, str]) -> Iterator[Function]:
    labels = dict.fromkeys(record.excitations + record.responses)
    nodes = {label: number for number, label in enumerate(labels, start=1)}
    data_type = {quantity: code for code, quantity in DATA_TYPES.items()}[record.quantity]
    time = record.time
    for samples, names, prefix, axis in (
        (record.inputs, record.excitations, EXCITATION, Axis(FORCE, "Force", "N")),
        (
            record.outputs,
            record.responses,
            RESPONSE,
            Axis(data_type, "Motion", UNITS[record.quantity]),
        ),
    ):
        for column, label in enumerate(names):
            first = f"{prefix}{label}, {axis.unit}"[:LINE]
            yield Function(
                (first, notes[0], notes[1], prefix + label, notes[2]),
                TIME_RESPONSE,
                End(nodes[label]),
                End(0),
                Axis(TIME, "Time", "s"),
                axis,
                Axis(0),
                time,
                np.array(samples[:, column]),
                EVEN,
                record.time_step,
            )


def _id_lines(metadata: Mapping[str, Any]) -> tuple[str, str, str]:
    """Return metadata as JSON on the free ID lines; a blank would not survive at a line's end."""
    text = json.dumps(metadata, separators=(",", ":"), allow_nan=False).replace(" ", "\\u0020")
    if len(text) > LINE * 3:
        raise UffError(
            f"the metadata have {len(text)} characters as JSON; UFF takes {LINE * 3}; leave some "
            "out, or use another format"
        )
    first, second, third = (text[n * LINE : (n + 1) * LINE] or "NONE" for n in range(3))
    return first, second, third


def _metadata(function: Function) -> dict[str, Any]:
    ids = (function.ids[1], function.ids[2], function.ids[4])
    text = "".join(part for line in ids if (part := line.strip()) != "NONE")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}  # another program's remarks
    return found if isinstance(found, dict) else {}


def _channel(f: Function, system: UnitSystem | None) -> Column:
    """Return a channel in SI."""
    kind = f.ordinate.kind
    quantity = None if kind == FORCE else DATA_TYPES.get(kind)
    label, sign = _label(f, kind == FORCE)
    name = f"the channel {label!r}"
    if kind != FORCE and quantity is None:
        known = ", ".join(f"{code} ({which})" for code, which in DATA_TYPES.items())
        raise UffError(f"{name} is data type {kind}; known are {known} and {FORCE} (force)")
    if f.abscissa.kind != TIME:
        raise UffError(f"{name} has an abscissa of data type {f.abscissa.kind}, not {TIME} (time)")
    if np.iscomplexobj(f.values):
        raise UffError(f"{name} is complex; samples are real")
    if f.spacing != EVEN:
        raise UffError(
            f"{name} gives every time by itself, in six digits: too few to tell uniform sampling; "
            "write it evenly spaced"
        )
    stated = channel_unit(f.response, f.ordinate, quantity, system, name)
    if stated.angle and not ROTATION.search(label):
        raise UffError(
            f"{name} is a rotation ({f.ordinate.unit}), and its label does not end in .rx, .ry or "
            ".rz as a rotation's does"
        )
    return Column(label, quantity, np.asarray(f.values, dtype=float) * (sign * stated.factor))


def _label(f: Function, force: bool) -> tuple[str, int]:
    """Return the label of a channel; a force's stands in the same line as "excitation: "."""
    prefix = EXCITATION if force else RESPONSE
    if f.ids[3].startswith(prefix):
        return f.ids[3][len(prefix) :], 1
    return dof_label(f, "response")


def _step(f: Function) -> float:
    if not f.step > 0:
        raise UffError(f"the time step is {f.step:g} s; must be greater than 0")
    unit = f.abscissa.unit
    if is_nothing(unit):
        return f.step
    found = read_unit(unit, (TIME_DIMENSION,))
    if found is None:
        raise UffError(f"the time is in {unit!r}, no unit of time")
    return f.step * found.factor


def _rate(step: float) -> float:
    """Return the only whole number of hertz that has this step in six digits, else 1/step."""
    whole = float(round(1 / step))
    if whole > 1:
        same = six_digits([1 / (whole - 1), 1 / whole, 1 / (whole + 1)]) == step
        if same.tolist() == [False, True, False]:
            return whole
    return 1 / step

"""Records of time: universal files, dataset 58, functions of time (type 1), through pyuff.

One function per channel, ASCII double precision: samples have twelve digits. The step has six
(E13.5), so a sampling frequency must be a whole number of hertz that six digits of its step give
back (51200 Hz is read from 1.95312E-05 s), or have a step of six digits.

Forces stand as "excitation: label" in ID line 4, responses as "response: label"; lines 2, 3 and 5
hold the metadata as JSON. Files from others have no such lines: labels are then as in `fbs.uff`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from .._kernels.checks import FloatArray
from ..frf import Quantity
from ..signal.records import Record
from .uff import (
    DATA_TYPES,
    EVEN,
    EXCITATION,
    FORCE,
    FORCE_SPELLINGS,
    LINE,
    RESPONSE,
    SPELLINGS,
    UNITS,
    UffError,
    dof_label,
    read_functions,
    refuse_foreign_unit,
    refuse_unfit_label,
    si_units,
    six_digits,
    what_is_there,
    write_datasets,
)

TIME_RESPONSE, TIME = 1, 17
METADATA_LINES = ("id2", "id3", "id5")


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
    functions = (function | notes for function in _functions(record))
    write_datasets(chain([si_units()], functions), file)


def read_uff_record(path: Path) -> tuple[Record, dict[str, Any]]:
    """Read the functions of time of a universal file, forces as inputs and motions as outputs.

    Raises
    ------
    UffError
        No functions of time, no force or no motion among them, or channels of different steps,
        lengths or quantities.
    """
    functions, types, length, force = read_functions(path)
    channels = [f for f in functions if f["func_type"] == TIME_RESPONSE]
    if not channels:
        raise UffError(
            f"no function of time (dataset 58, function type 1) inside; "
            f"{what_is_there(functions, types)}"
        )
    first = channels[0]
    inputs: dict[str, FloatArray] = {}
    outputs: dict[str, FloatArray] = {}
    quantities: dict[str, Quantity] = {}
    for channel in channels:
        for key, what in (("abscissa_inc", "time steps"), ("num_pts", "lengths")):
            if channel[key] != first[key]:
                raise UffError(f"the channels have different {what}: {first[key]}, {channel[key]}")
        label, samples, quantity = _channel(channel, length, force)
        group = inputs if quantity is None else outputs
        if label in group:
            raise UffError(f"the channel {label!r} is there more than once")
        group[label] = samples
        if quantity is not None:
            quantities[label] = quantity
    if not inputs or not outputs:
        raise UffError(
            f"a force and a motion are needed; there are the forces {', '.join(inputs) or 'none'} "
            f"and the motions {', '.join(outputs) or 'none'}"
        )
    if len(set(quantities.values())) > 1:
        mixed = ", ".join(f"{label} (as {quantity})" for label, quantity in quantities.items())
        raise UffError(f"displacements, velocities and accelerations are mixed: {mixed}")
    record = Record(
        _rate(_step(first)),
        np.column_stack(list(inputs.values())),
        np.column_stack(list(outputs.values())),
        tuple(inputs),
        tuple(outputs),
        next(iter(quantities.values())),
    )
    return record, _metadata(first)


def _functions(record: Record) -> Iterator[dict[str, Any]]:
    labels = dict.fromkeys(record.excitations + record.responses)
    nodes = {label: number for number, label in enumerate(labels, start=1)}
    data_type = {quantity: code for code, quantity in DATA_TYPES.items()}[record.quantity]
    time = record.time
    for samples, names, prefix, kind, unit in (
        (record.inputs, record.excitations, EXCITATION, FORCE, "N"),
        (record.outputs, record.responses, RESPONSE, data_type, UNITS[record.quantity]),
    ):
        for column, label in enumerate(names):
            yield {
                "type": 58,
                "binary": 0,
                "id1": f"{prefix}{label}, {unit}"[:LINE],
                "id4": prefix + label,
                "func_type": TIME_RESPONSE,
                "rsp_node": nodes[label],
                "rsp_dir": 0,
                "ref_node": 0,
                "ref_dir": 0,
                "abscissa_spacing": EVEN,
                "abscissa_spec_data_type": TIME,
                "abscissa_axis_lab": "Time",
                "abscissa_axis_units_lab": "s",
                "ordinate_spec_data_type": kind,
                "ordinate_len_unit_exp": int(kind != FORCE),
                "ordinate_force_unit_exp": int(kind == FORCE),
                "ordinate_axis_lab": "Force" if kind == FORCE else "Motion",
                "ordinate_axis_units_lab": unit,
                "orddenom_spec_data_type": 0,
                "data": np.array(samples[:, column]),
                "x": time,
            }


def _id_lines(metadata: Mapping[str, Any]) -> dict[str, str]:
    """Return metadata as JSON on the free ID lines; a blank would not survive at a line's end."""
    text = json.dumps(metadata, separators=(",", ":"), allow_nan=False).replace(" ", "\\u0020")
    if len(text) > LINE * len(METADATA_LINES):
        raise UffError(
            f"the metadata have {len(text)} characters as JSON; UFF takes "
            f"{LINE * len(METADATA_LINES)}; leave some out, or use another format"
        )
    parts = [text[n * LINE : (n + 1) * LINE] for n in range(len(METADATA_LINES))]
    return {line: part or "NONE" for line, part in zip(METADATA_LINES, parts, strict=True)}


def _metadata(function: dict[str, Any]) -> dict[str, Any]:
    text = "".join(part for line in METADATA_LINES if (part := function[line].strip()) != "NONE")
    try:
        found = json.loads(text)
    except ValueError:
        return {}  # another program's remarks
    return found if isinstance(found, dict) else {}


def _channel(
    dataset: dict[str, Any], length: float, force: float
) -> tuple[str, FloatArray, Quantity | None]:
    """Return label, samples in SI, and quantity (None: a force)."""
    kind = int(dataset["ordinate_spec_data_type"])
    quantity = None if kind == FORCE else DATA_TYPES.get(kind)
    label, sign = dof_label(dataset, "id4", EXCITATION if kind == FORCE else RESPONSE, "rsp")
    name = f"the channel {label!r}"
    if kind != FORCE and quantity is None:
        known = ", ".join(f"{code} ({which})" for code, which in DATA_TYPES.items())
        raise UffError(f"{name} is data type {kind}; known are {known} and {FORCE} (force)")
    if dataset["abscissa_spec_data_type"] != TIME:
        raise UffError(
            f"{name} has an abscissa of data type {dataset['abscissa_spec_data_type']}, not "
            f"{TIME} (time)"
        )
    if (length, force) == (1.0, 1.0):
        known_units = FORCE_SPELLINGS if quantity is None else SPELLINGS[quantity]
        refuse_foreign_unit(dataset["ordinate_axis_units_lab"], known_units, name)
        refuse_foreign_unit(dataset["abscissa_axis_units_lab"], {"s", "sec"}, name)
    if np.iscomplexobj(dataset["data"]):
        raise UffError(f"{name} is complex; samples are real")
    samples = np.asarray(dataset["data"], dtype=float)
    if samples.size != dataset["num_pts"]:
        raise UffError(f"{name} has {samples.size} values where {dataset['num_pts']} are announced")
    if dataset["abscissa_spacing"] != EVEN:
        raise UffError(
            f"{name} gives every time by itself, in six digits: too few to tell uniform sampling; "
            "write it evenly spaced"
        )
    # an angle has no length, a moment has one
    rotation = abs(dataset["rsp_dir"]) > 3
    factor = force * length**rotation if quantity is None else length ** (not rotation)
    return label, sign / factor * samples, quantity


def _step(dataset: dict[str, Any]) -> float:
    step = float(dataset["abscissa_inc"])
    if not step > 0:
        raise UffError(f"the time step is {step:g} s; must be greater than 0")
    return step


def _rate(step: float) -> float:
    """Return the only whole number of hertz that has this step in six digits, else 1/step."""
    whole = float(round(1 / step))
    if whole > 1:
        same = six_digits([1 / (whole - 1), 1 / whole, 1 / (whole + 1)]) == step
        if same.tolist() == [False, True, False]:
            return whole
    return 1 / step

"""Records in files, by the file's ending: .npz and .csv (every digit kept), .uff (twelve)."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import FbsError
from ..frf import Quantity, as_quantity
from ..signal.records import Record
from .whole_files import written_whole

UNITS = {Quantity.RECEPTANCE: "m", Quantity.MOBILITY: "m/s", Quantity.ACCELERANCE: "m/s^2"}
ARRAYS = ("sampling_frequency", "inputs", "outputs", "excitations", "responses", "quantity")
RATE, METADATA = "# sampling_frequency_hz: ", "# metadata: "
COLUMN = re.compile(r"(input|output) (.+) \(([^()]*)\)")
ROWS = 65536  # of a CSV at once

Metadata = Mapping[str, Any]


def write_record(
    record: Record, path: str | os.PathLike[str], metadata: Metadata | None = None
) -> None:
    """Write a record; the file appears complete or not at all, and replaces an existing one.

    - .npz: the arrays `sampling_frequency` (Hz), `inputs` (N), `outputs`, `excitations`,
      `responses`, `quantity`, `output_unit`, `metadata` (JSON);
    - .csv: comment lines with sampling frequency and metadata, then the columns "time (s)",
      "input LABEL (N)" and "output LABEL (m)", (m/s) or (m/s^2);
    - .uff, .unv: see `fbs.uff_records`.

    Parameters
    ----------
    record : Record
    path : path
    metadata : mapping of str, optional
        What JSON can hold.

    Raises
    ------
    FbsError
        The ending is not known, or the record or the metadata do not fit into the format.
    OSError
        As for `files.written_whole`; FileNotFoundError where there is no such folder.
    """
    target = Path(path)
    _format(target)
    with written_whole(target) as file:
        write_record_to(record, file, target, metadata)


def write_record_to(
    record: Record,
    file: BinaryIO,
    name: str | os.PathLike[str],
    metadata: Metadata | None = None,
) -> None:
    """Write a record to an open file in the format of a name's ending; see `write_record`.

    Raises
    ------
    FbsError
        As for `write_record`.
    """
    writer, _ = _format(Path(name))
    notes = dict(metadata or {})
    try:
        json.dumps(notes, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise FbsError(f"the metadata do not fit into JSON ({error})") from error
    writer(record, file, notes)


def read_record(path: str | os.PathLike[str]) -> tuple[Record, dict[str, Any]]:
    """Read a record and its metadata by the file's ending.

    Raises
    ------
    FbsError
        The ending is not known, the file is damaged or holds no record, time is not uniform, or
        as for `Record`. The message starts with the path.
    FileNotFoundError
    """
    source = Path(path)
    _, reader = _format(source)
    try:
        return reader(source)
    except FbsError as error:
        raise type(error)(f"{source}: {error}") from error


# --- npz ---------------------------------------------------------------------------------------


def _write_npz(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    np.savez(
        file,
        sampling_frequency=np.array(record.sampling_frequency),
        inputs=record.inputs,
        outputs=record.outputs,
        excitations=np.array(record.excitations),
        responses=np.array(record.responses),
        quantity=np.array(str(record.quantity)),
        output_unit=np.array(UNITS[record.quantity]),
        metadata=np.array(json.dumps(metadata)),
    )


def _read_npz(path: Path) -> tuple[Record, dict[str, Any]]:
    try:
        with path.open("rb") as file:  # np.load itself leaves a damaged one open
            archive = np.load(file, allow_pickle=False)
            if isinstance(archive, np.ndarray):
                raise FbsError(f"it is one array without names; needed are {', '.join(ARRAYS)}")
            arrays = {name: archive[name] for name in archive.files}
    except FbsError:
        raise
    except (ValueError, EOFError, NotImplementedError, zipfile.BadZipFile, zlib.error) as error:
        raise FbsError("the file is damaged, or no .npz") from error
    missing = [name for name in ARRAYS if name not in arrays]
    if missing:
        raise FbsError(f"there is no array {' and no '.join(missing)}; needed are {ARRAYS}")
    for name, kinds in (("sampling_frequency", "fiu"), ("inputs", "fiu"), ("outputs", "fiu")):
        if arrays[name].dtype.kind not in kinds:
            raise FbsError(f"the array {name} holds {arrays[name].dtype}; it must be real numbers")
    if arrays["sampling_frequency"].size != 1:
        raise FbsError(f"sampling_frequency has {arrays['sampling_frequency'].size} values, not 1")
    record = Record(
        float(arrays["sampling_frequency"]),
        arrays["inputs"],
        arrays["outputs"],
        tuple(np.atleast_1d(arrays["excitations"]).tolist()),
        tuple(np.atleast_1d(arrays["responses"]).tolist()),
        as_quantity(str(arrays["quantity"])),
    )
    return record, _notes(str(arrays.get("metadata", "{}")))


# --- csv ---------------------------------------------------------------------------------------


def _write_csv(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    for label in (*record.excitations, *record.responses):
        if not label.isprintable():
            raise FbsError(f"label {label!r} is unprintable and would not survive in a CSV")
    unit = UNITS[record.quantity]
    header = ["time (s)", *(f"input {label} (N)" for label in record.excitations)]
    header += [f"output {label} ({unit})" for label in record.responses]
    text = io.TextIOWrapper(file, encoding="utf-8", newline="")
    text.write(f"{RATE}{record.sampling_frequency!r}\n{METADATA}{json.dumps(metadata)}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for start in range(0, record.n_sample, ROWS):
        rows = slice(start, start + ROWS)
        inputs, outputs = record.inputs[rows], record.outputs[rows]
        time = np.arange(start, start + len(inputs)) / record.sampling_frequency
        writer.writerows(np.column_stack([time, inputs, outputs]).tolist())
    text.detach()


def _read_csv(path: Path) -> tuple[Record, dict[str, Any]]:
    rate, notes = None, {}
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            line = file.readline()
            while line.startswith("#"):
                if line.startswith(RATE):
                    rate = _number(line.removeprefix(RATE))
                elif line.startswith(METADATA):
                    notes = _notes(line.removeprefix(METADATA))
                line = file.readline()
            header = next(csv.reader([line]), [])
            columns = _columns(header)
            table = np.loadtxt(file, delimiter=",", ndmin=2, comments=None)
    except UnicodeDecodeError as error:
        raise FbsError(f"not a text file in UTF-8 (byte {error.start} is not)") from error
    except FbsError:
        raise
    except ValueError as error:
        raise FbsError(f"below the header: {error}") from error
    if table.shape[1] != len(header):
        raise FbsError(f"the header has {len(header)} columns, the samples {table.shape[1]}")
    return _of_columns(table, columns, rate), notes


def _columns(header: list[str]) -> list[tuple[str, str, str]]:
    """Return (input or output, label, unit) of every column but time."""
    needed = '"time (s)", "input LABEL (N)" and "output LABEL (m)", (m/s) or (m/s^2)'
    if not header or header[0].strip() != "time (s)":
        raise FbsError(f"its first column is {header[:1]}; the header must have {needed}")
    found = []
    for name in header[1:]:
        match = COLUMN.fullmatch(name.strip())
        if match is None:
            raise FbsError(f"a column is called {name!r}; the header must have {needed}")
        found.append((match[1], match[2], match[3]))
    return found


def _of_columns(
    table: np.ndarray, columns: list[tuple[str, str, str]], rate: float | None
) -> Record:
    units = {unit for kind, _, unit in columns if kind == "output"}
    quantities = {unit: quantity for quantity, unit in UNITS.items()}
    if len(units) != 1 or not units <= set(quantities):
        raise FbsError(
            f"the outputs' units are {', '.join(sorted(units)) or 'none'}; must be one of "
            f"{', '.join(quantities)}"
        )
    other = [unit for kind, _, unit in columns if kind == "input" and unit != "N"]
    if other:
        raise FbsError(f"an input's unit is {other[0]!r}; must be N")
    data = table[:, 1:]
    chosen = {
        kind: [i for i, column in enumerate(columns) if column[0] == kind]
        for kind in ("input", "output")
    }
    labels = {kind: tuple(columns[i][1] for i in index) for kind, index in chosen.items()}
    record = Record.from_time(
        table[:, 0],
        data[:, chosen["input"]],
        data[:, chosen["output"]],
        labels["input"],
        labels["output"],
        quantities[units.pop()],
    )
    if rate is None:
        return record
    if not abs(rate - record.sampling_frequency) <= 1e-3 * rate / record.n_sample:
        raise FbsError(
            f"its first lines say {rate:.10g} Hz, its times {record.sampling_frequency:.10g} Hz"
        )
    return Record(
        rate, record.inputs, record.outputs, record.excitations, record.responses, record.quantity
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise FbsError(f"the sampling frequency is {text.strip()!r}, no number") from error


def _notes(text: str) -> dict[str, Any]:
    try:
        notes = json.loads(text)
    except ValueError as error:
        raise FbsError(f"the metadata are no JSON ({error})") from error
    if not isinstance(notes, dict):
        raise FbsError("the metadata are no table of keys and values")
    return notes


# --- uff ---------------------------------------------------------------------------------------


def _write_uff(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    from .uff_records import write_uff_record

    write_uff_record(record, file, metadata)


def _read_uff(path: Path) -> tuple[Record, dict[str, Any]]:
    from .uff_records import read_uff_record

    return read_uff_record(path)


Writer = Callable[[Record, BinaryIO, Metadata], None]
Reader = Callable[[Path], tuple[Record, dict[str, Any]]]
FORMATS: Mapping[str, tuple[Writer, Reader]] = {
    ".npz": (_write_npz, _read_npz),
    ".csv": (_write_csv, _read_csv),
    ".uff": (_write_uff, _read_uff),
    ".unv": (_write_uff, _read_uff),
}


def _format(path: Path) -> tuple[Writer, Reader]:
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise FbsError(
            f"{path}: the ending {path.suffix or '(none)'} is not known; allowed: "
            f"{', '.join(FORMATS)}"
        )
    return found

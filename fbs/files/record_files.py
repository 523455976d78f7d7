"""Records in files, by the file's ending: .npz, .csv, .wav, .mat (every digit kept), .uff."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from ..frf import as_quantity
from ..signal.records import Record
from .record_csv import (
    UNITS,
    Channels,
    Metadata,
    notes_of,
    read_record_csv,
    write_record_csv,
)
from .record_wav import read_record_wav, write_record_wav
from .untrusted import read_arrays
from .whole_files import written_whole

NEEDED = {
    "sampling_frequency": ("fiu", "a real number (Hz)"),
    "inputs": ("fiu", "real numbers (samples, inputs)"),
    "outputs": ("fiu", "real numbers (samples, outputs)"),
    "excitations": ("U", "text"),
    "responses": ("U", "text"),
    "quantity": ("U", "text"),
}


def write_record(
    record: Record, path: str | os.PathLike[str], metadata: Metadata | None = None
) -> None:
    """Write a record; the file appears complete or not at all, and replaces an existing one.

    - .npz: the arrays `sampling_frequency` (Hz), `inputs` (N), `outputs`, `excitations`,
      `responses`, `quantity`, `output_unit`, `metadata` (JSON);
    - .csv: comment lines with sampling frequency and metadata, then the columns "time (s)",
      "input LABEL (N)" and "output LABEL (m)", (m/s) or (m/s^2);
    - .mat: the arrays of .npz, as MATLAB's version 5;
    - .wav: floats in SI, see `record_wav`;
    - .uff, .unv: twelve digits, see `uff_records`.

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


def read_record(
    path: str | os.PathLike[str], channels: Channels | None = None
) -> tuple[Record, dict[str, Any]]:
    """Read a record and its metadata by the file's ending.

    Parameters
    ----------
    path : path
    channels : mapping of str to (str, str), optional
        Column of a .csv, or number of a channel of a .wav from 1 on → its label and unit, where
        the file does not say them.

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
        return reader(source, channels or {})
    except FbsError as error:
        words = str(error).removeprefix(f"{source}: ")
        raise type(error)(f"{source}: {words}") from error


def read_records(
    path: str | os.PathLike[str], channels: Channels | None = None
) -> tuple[Record, ...]:
    """Read all records of a file; a universal file may hold several of the same channels.

    Raises
    ------
    FbsError, OSError
        As for `read_record`.
    """
    source = Path(path)
    if source.suffix.lower() not in (".uff", ".unv"):
        return (read_record(source, channels)[0],)
    from .uff_records import read_uff_records

    try:
        return tuple(read_uff_records(source)[0])
    except FbsError as error:
        words = str(error).removeprefix(f"{source}: ")
        raise type(error)(f"{source}: {words}") from error


def _arrays(record: Record, metadata: Metadata) -> dict[str, NDArray[Any]]:
    return {
        "sampling_frequency": np.array(record.sampling_frequency),
        "inputs": record.inputs,
        "outputs": record.outputs,
        "excitations": np.array(record.excitations),
        "responses": np.array(record.responses),
        "quantity": np.array(str(record.quantity)),
        "output_unit": np.array(UNITS[record.quantity]),
        "metadata": np.array(json.dumps(metadata)),
    }


def _write_npz(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    arrays: dict[str, Any] = _arrays(record, metadata)
    np.savez(file, **arrays)


def _read_npz(path: Path, channels: Channels) -> tuple[Record, dict[str, Any]]:
    return _of_arrays(read_arrays(path, NEEDED, ("metadata",)))


def _of_arrays(arrays: Mapping[str, NDArray[Any]]) -> tuple[Record, dict[str, Any]]:
    if arrays["sampling_frequency"].size != 1:
        raise FbsError(f"sampling_frequency has {arrays['sampling_frequency'].size} values, not 1")
    record = Record(
        float(arrays["sampling_frequency"].ravel()[0]),
        arrays["inputs"],
        arrays["outputs"],
        tuple(np.atleast_1d(arrays["excitations"]).tolist()),
        tuple(np.atleast_1d(arrays["responses"]).tolist()),
        as_quantity(str(arrays["quantity"].ravel()[0])),
    )
    return record, notes_of(str(arrays["metadata"].ravel()[0]) if "metadata" in arrays else "{}")


def _read_mat(path: Path, channels: Channels) -> tuple[Record, dict[str, Any]]:
    from .matlab import read_mat

    return _of_arrays(read_mat(path, NEEDED, ("metadata",)))


def _write_mat(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    from .matlab import write_mat

    write_mat(file, _arrays(record, metadata))


def _write_uff(record: Record, file: BinaryIO, metadata: Metadata) -> None:
    from .uff_records import write_uff_record

    write_uff_record(record, file, metadata)


def _read_uff(path: Path, channels: Channels) -> tuple[Record, dict[str, Any]]:
    from .uff_records import read_uff_record

    return read_uff_record(path)


Writer = Callable[[Record, BinaryIO, Metadata], None]
Reader = Callable[[Path, Channels], tuple[Record, dict[str, Any]]]
FORMATS: Mapping[str, tuple[Writer, Reader]] = {
    ".npz": (_write_npz, _read_npz),
    ".csv": (write_record_csv, read_record_csv),
    ".wav": (write_record_wav, read_record_wav),
    ".mat": (_write_mat, _read_mat),
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

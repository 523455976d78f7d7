"""Records in WAV files: PCM of 16, 24, 32 bits (full scale is 1) and floats of 32, 64 bits.

What we write has floats of 64 bits in SI, and its labels as a comment (LIST INFO ICMT, JSON). Of
other files the user says what each channel is: "1" → ("hammer.z", "50 N"), 50 N at full scale.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from ..signal.records import Record
from .record_csv import UNITS, Channels, column_of, notes_of, record_of
from .untrusted import read_plain

PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
MOST_WAV = 2**32 - 2**16  # bytes: sizes have 32 bits


def write_record_wav(record: Record, file: BinaryIO, metadata: Mapping[str, Any]) -> None:
    """Write a record as floats of 64 bits.

    Raises
    ------
    FbsError
        A sampling frequency that is no whole number of hertz, or more than 4 GiB.
    """
    rate = round(record.sampling_frequency)
    if rate != record.sampling_frequency or rate >= 2**32:
        raise FbsError(
            f"WAV keeps whole numbers of hertz; the record has {record.sampling_frequency:.10g} Hz"
        )
    samples = np.column_stack([record.inputs, record.outputs]).astype("<f8")
    if samples.nbytes > MOST_WAV:
        raise FbsError(f"WAV holds 4 GiB; the record has {samples.nbytes / 2**30:.3g} GiB")
    n_channel = samples.shape[1]
    unit = UNITS[record.quantity]
    units = [(label, "N") for label in record.excitations]
    units += [(label, unit) for label in record.responses]
    comment = json.dumps({"channels": units, "metadata": dict(metadata)}).encode() + b"\0"
    layout = struct.pack(
        "<HHIIHHH", FLOAT, n_channel, rate, rate * n_channel * 8, n_channel * 8, 64, 0
    )
    chunks = _chunk(b"fmt ", layout) + _chunk(b"LIST", b"INFO" + _chunk(b"ICMT", comment))
    size = 4 + len(chunks) + 8 + samples.nbytes
    file.write(b"RIFF" + struct.pack("<I", size) + b"WAVE" + chunks)
    file.write(b"data" + struct.pack("<I", samples.nbytes))
    file.write(samples.tobytes())


def read_record_wav(path: Path, channels: Channels) -> tuple[Record, dict[str, Any]]:
    """Read a record and its metadata.

    Raises
    ------
    FbsError
        No WAV, cut short, a format that is not known, or channels nobody says the unit of.
    """
    content = read_plain(path, _require_wave)
    chunks = _chunks(content)
    if b"fmt " not in chunks or b"data" not in chunks or len(chunks[b"fmt "]) < 16:
        raise FbsError("the file is damaged: it has no format or no samples")
    rate, samples = _samples(chunks[b"fmt "], chunks[b"data"])
    comment = _comment(chunks.get(b"LIST", b""))
    stated = _stated(comment.get("channels")) | dict(channels)
    missing = [str(k) for k in range(1, samples.shape[1] + 1) if str(k) not in stated]
    if missing:
        raise FbsError(
            f"it has {samples.shape[1]} channels, and does not say what {', '.join(missing)} "
            f"is; say it (--channel '{missing[0]}=LABEL UNIT', such as '1=hammer.z 50 N' for 50 N "
            "at full scale)"
        )
    columns = [
        column_of(str(k), "", samples[:, k - 1], stated) for k in range(1, samples.shape[1] + 1)
    ]
    notes = comment.get("metadata", {})
    return record_of(columns, None, rate), notes if isinstance(notes, dict) else {}


def _require_wave(head: bytes) -> None:
    if head[:4] != b"RIFF" or head[8:12] != b"WAVE":
        raise FbsError("the file is damaged, or no WAV")


def _stated(named: Any) -> dict[str, tuple[str, str]]:
    """Return labels and units of a comment of ours."""
    pairs = named if isinstance(named, list) else []
    return {
        str(k): (str(pair[0]), str(pair[1]))
        for k, pair in enumerate(pairs, start=1)
        if isinstance(pair, list) and len(pair) == 2
    }


def _chunk(name: bytes, body: bytes) -> bytes:
    return name + struct.pack("<I", len(body)) + body + b"\0" * (len(body) % 2)


def _chunks(content: bytes) -> dict[bytes, bytes]:
    found: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        name, size = content[at : at + 4], struct.unpack_from("<I", content, at + 4)[0]
        if at + 8 + size > len(content):
            raise FbsError(
                f"the file is cut short: {size} bytes of {name.decode('latin-1').strip()!r} are "
                f"announced, {len(content) - at - 8} are there"
            )
        found.setdefault(name, content[at + 8 : at + 8 + size])
        at += 8 + size + size % 2
    return found


def _samples(layout: bytes, data: bytes) -> tuple[float, NDArray[np.float64]]:
    kind, n_channel, rate, _, _, bits = struct.unpack_from("<HHIIHH", layout)
    if kind == EXTENSIBLE and len(layout) >= 26:
        kind = struct.unpack_from("<H", layout, 24)[0]
    if n_channel < 1 or rate < 1 or (kind, bits) not in {
        (PCM, 16), (PCM, 24), (PCM, 32), (FLOAT, 32), (FLOAT, 64)
    }:  # fmt: skip
        raise FbsError(
            f"it has {n_channel} channels at {rate} Hz in format {kind} of {bits} bits; known are "
            "PCM (1) of 16, 24, 32 bits and floats (3) of 32, 64"
        )
    frames = len(data) // (n_channel * bits // 8)
    data = data[: frames * n_channel * bits // 8]
    if kind == FLOAT:
        flat = np.frombuffer(data, f"<f{bits // 8}").astype(float)
    elif bits == 24:
        bytes_of = np.frombuffer(data, np.uint8).reshape(-1, 3)
        padded = np.zeros((len(bytes_of), 4), np.uint8)
        padded[:, 1:] = bytes_of  # in the upper three bytes, so that the sign is right
        flat = padded.view("<i4").ravel() / 2.0**31
    else:
        flat = np.frombuffer(data, f"<i{bits // 8}") / 2.0 ** (bits - 1)
    return float(rate), flat.reshape(frames, n_channel)


def _comment(listed: bytes) -> dict[str, Any]:
    """Return what we keep in a comment; other programs' comments say nothing to us."""
    if listed[:8] != b"INFOICMT":
        return {}
    try:
        return notes_of(listed[12:].split(b"\0")[0].decode("utf-8"))
    except (FbsError, UnicodeDecodeError):
        return {}

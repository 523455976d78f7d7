"""Arrays in MATLAB files: version 5 to 7, and 7.3 (HDF5) where h5py is installed.

Version 5 is written by scipy and read here, element by element: scipy's reader ends the whole
program at some damaged files. What headers claim is held against the bytes that are there,
compressed ones are unpacked piece by piece and counted. Version 7.3 is read by `hdf5`. Only
numbers, text and cells of text are read; objects, functions and links to other files are refused.

Format: MATLAB, MAT-File Format (MathWorks).
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from .hdf5 import read_hdf5
from .untrusted import open_plain, read_plain, require_packed, require_values

HDF5 = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512  # bytes before the HDF5 of a file that MATLAB writes
MATRIX, COMPRESSED = 14, 15
PIECE = 2**20

Arrays = dict[str, NDArray[Any]]
Kinds = Mapping[str, tuple[str, str]]


def write_mat(file: BinaryIO, arrays: Mapping[str, Any]) -> None:
    """Write named arrays as version 5; several words as a cell array of text.

    Raises
    ------
    FbsError
        An array of more than 4 GiB, which version 5 does not hold.
    """
    from scipy.io import savemat

    prepared = {}
    for name, value in arrays.items():
        array = np.asarray(value)
        if array.nbytes >= 2**32:
            raise FbsError(f"{name} has {array.nbytes / 2**30:.3g} GiB; .mat (version 5) takes 4")
        words = array.dtype.kind == "U" and array.ndim
        prepared[name] = array.astype(object).reshape(-1, 1) if words else array
    savemat(file, prepared)


def read_mat(path: Path, needed: Kinds, more: Iterable[str] = ()) -> Arrays:
    """Return arrays of a MATLAB file by name; cells of text and texts as arrays of str.

    Parameters
    ----------
    path : path
    needed : mapping of str to (str, str)
        Name → the kinds of dtype it may have, and these in words.
    more : names
        Read if they are there.

    Raises
    ------
    FbsError
        It is no MATLAB file, damaged or cut, an array is missing or of another kind, h5py is
        needed and not installed, or it unpacks to more than a measurement does.
    OSError
        As for `untrusted.open_plain`.
    """
    with open_plain(path) as file:
        head = file.read(USER_BLOCK + len(HDF5))
    is_hdf5 = head.startswith(HDF5) or head[USER_BLOCK:] == HDF5
    arrays = (read_hdf5 if is_hdf5 else _read_v5)(path, [*needed, *more])
    missing = [name for name in needed if name not in arrays]
    if missing:
        raise FbsError(
            f"there is no variable {' and no '.join(missing)}; needed are {', '.join(needed)}"
        )
    for name, (kinds, words) in needed.items():
        if arrays[name].dtype.kind not in kinds:
            raise FbsError(f"the variable {name} holds {arrays[name].dtype}; it must be {words}")
    return arrays


# --- version 5 ---------------------------------------------------------------------------------

CELL, CHAR, NUMERIC = 1, 4, range(6, 16)
COMPLEX_FLAG = 0x800
NUMBERS = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
ENCODINGS = {16: "utf-8", 17: "utf-16", 18: "utf-32"}


def _read_v5(path: Path, names: list[str]) -> Arrays:
    content = read_plain(path, _order)
    order = _order(content)
    found: Arrays = {}
    total, at = 0, 128
    while at < len(content):
        kind, body, at = _element(content, at, order)
        if kind == COMPRESSED:
            body = _unpacked(body, total)
            kind, body, _ = _element(body, 0, order)
        total += len(body)
        if kind == MATRIX:
            name, array = _matrix(body, order, names)
            if array is not None:
                found[name] = array
    return found


def _order(head: bytes) -> str:
    """Return the byte order a file of version 5 states."""
    order = {b"IM": "<", b"MI": ">"}.get(head[126:128])
    if len(head) < 128 or order is None or b"MATLAB" not in head[:128]:
        raise FbsError("the file is damaged, or no MATLAB file")
    return order


def _matrix(
    body: Any, order: str, names: Iterable[str] | None, depth: int = 0
) -> tuple[str, NDArray[Any] | None]:
    """Return name and values of an array; None of one that is not asked for."""
    _, flags, at = _element(body, 0, order)
    _, dims, at = _element(body, at, order)
    _, label, at = _element(body, at, order)
    if len(flags) < 4 or not 8 <= len(dims) <= 128:
        raise FbsError("the file is damaged: an array has no dimensions")
    flag = struct.unpack_from(f"{order}I", flags)[0]
    name = bytes(label).decode("latin-1")
    if names is not None and name not in names:
        return name, None
    shape = struct.unpack_from(f"{order}{len(dims) // 4}i", dims)
    count = math.prod(shape) if min(shape) >= 0 else -1
    kind = flag & 0xFF
    if kind == CELL and depth == 0:
        require_values(count, len(body) - at, 8, f"the cell array {name}")
        return name, np.array(list(_cells(body, at, order, name)))
    if kind != CHAR and kind not in NUMERIC:
        raise FbsError(
            f"the variable {name} is a structure, an object or a function; it must be a plain array"
        )
    values, at = _numbers(body, at, order, count, name, text=kind == CHAR)
    if kind == CHAR:
        rows = values.reshape(shape, order="F")
        return name, np.array(["".join(row).rstrip() for row in rows.reshape(shape[0], -1)])
    if flag & COMPLEX_FLAG:
        values = values + 1j * _numbers(body, at, order, count, name, text=False)[0]
    return name, values.reshape(shape, order="F")


def _cells(body: Any, at: int, order: str, name: str) -> Iterator[str]:
    while at < len(body):
        _, inner, at = _element(body, at, order)
        words = _matrix(inner, order, None, depth=1)[1] if len(inner) else np.array([""])
        if words is None or words.dtype.kind != "U" or words.size > 1:
            raise FbsError(f"the variable {name} is a cell array of other things than text")
        yield str(words[0]) if words.size else ""


def _numbers(
    body: Any, at: int, order: str, count: int, name: str, *, text: bool
) -> tuple[NDArray[Any], int]:
    """Return the numbers (or characters) of an element, of which there must be `count`."""
    kind, raw, at = _element(body, at, order)
    if text and kind in ENCODINGS:
        suffix = {"<": "-le", ">": "-be"}[order] if kind > 16 else ""
        values = np.array(list(bytes(raw).decode(ENCODINGS[kind] + suffix, errors="replace")))
    else:
        if kind not in NUMBERS:
            raise FbsError(f"the variable {name} is damaged: it has elements of type {kind}")
        dtype = np.dtype(order + NUMBERS[kind])
        values = np.frombuffer(raw, dtype=dtype, count=len(raw) // dtype.itemsize)
        if text:
            values = np.array([chr(int(code) & 0xFFFF) for code in values])
    if values.size != count:
        raise FbsError(f"the variable {name} announces {count} values; there are {values.size}")
    return values, at


def _unpacked(packed: memoryview | bytes, before: int) -> bytes:
    """Unpack piece by piece: a bomb is refused before it is in memory."""
    stream, pieces, total, rest = zlib.decompressobj(), [], before, bytes(packed)
    try:
        while piece := stream.decompress(rest, PIECE):
            pieces.append(piece)
            total += len(piece)
            require_packed(len(packed), total, "a variable")
            rest = stream.unconsumed_tail
    except zlib.error as error:
        raise FbsError(f"the file is damaged ({error})") from error
    return b"".join(pieces)


def _element(content: Any, at: int, order: str) -> tuple[int, Any, int]:
    """Return type and bytes of a data element, and where the next begins."""
    if len(content) - at < 8:
        raise FbsError("the file is cut short")
    kind, size = struct.unpack_from(f"{order}II", content, at)
    if kind >> 16:  # a small element: size and type in one word
        return kind & 0xFFFF, content[at + 4 : at + 4 + min(kind >> 16, 4)], at + 8
    end = at + 8 + size
    if end > len(content):
        raise FbsError("the file is cut short")
    return kind, content[at + 8 : end], end if kind == COMPRESSED else end + (-size) % 8

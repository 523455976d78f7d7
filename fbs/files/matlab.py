"""Arrays in MATLAB files: version 5 to 7 through scipy, 7.3 (HDF5) through h5py where installed.

A file is walked through before it is read: what its headers claim is held against the bytes that
are there, compressed ones unpacked piece by piece and counted. Only numbers, text and cells of text
are read; objects, functions and links to other files are refused.
"""

from __future__ import annotations

import io
import math
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from .untrusted import open_plain, read_plain, require_packed, require_values

HDF5 = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512  # bytes before the HDF5 of a file that MATLAB writes
MATRIX, COMPRESSED = 14, 15
CELL, NUMERIC, CHAR, SPARSE = 1, range(6, 16), 4, 5
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
    arrays = (_read_hdf5 if is_hdf5 else _read_v5)(path, [*needed, *more])
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


def _read_v5(path: Path, names: list[str]) -> Arrays:
    from scipy.io import loadmat

    content = read_plain(path, _order)
    _require_sound(content, _order(content))
    try:
        found = loadmat(io.BytesIO(content), variable_names=names, chars_as_strings=True)
    except (ValueError, TypeError, NotImplementedError, EOFError, KeyError, IndexError) as error:
        raise FbsError(f"the file is damaged, or no MATLAB file ({error})") from error
    return {name: _text_or_numbers(found[name], name) for name in names if name in found}


def _text_or_numbers(array: NDArray[Any], name: str) -> NDArray[Any]:
    if array.dtype != object:
        return np.char.rstrip(array.ravel()) if array.dtype.kind == "U" else array
    words = [np.ravel(cell) for cell in array.ravel()]
    if any(word.size > 1 or word.dtype.kind != "U" for word in words):
        raise FbsError(f"the variable {name} is a cell array of other things than text")
    return np.array([str(word[0]) if word.size else "" for word in words])


def _order(head: bytes) -> str:
    """Return the byte order a file of version 5 states."""
    order = {b"IM": "<", b"MI": ">"}.get(head[126:128])
    if len(head) < 128 or order is None or b"MATLAB" not in head[:128]:
        raise FbsError("the file is damaged, or no MATLAB file")
    return order


def _require_sound(content: bytes, order: str) -> None:
    """Refuse headers that claim more than there is."""
    total = 0
    at = 128
    while at < len(content):
        kind, body, at = _element(content, at, order)
        if kind == COMPRESSED:
            body = _unpacked(body, total)
            kind, body, _ = _element(body, 0, order)
        total += len(body)
        if kind == MATRIX:
            _require_matrix(body, order)


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


def _require_matrix(body: Any, order: str, depth: int = 0) -> None:
    """Hold the dimensions of an array, and of those in its cells, against its bytes."""
    if not len(body):
        return  # an empty cell
    _, flags, at = _element(body, 0, order)
    _, dims, at = _element(body, at, order)
    _, _, at = _element(body, at, order)  # its name
    kind = struct.unpack_from(f"{order}I", flags)[0] & 0xFF
    shape = struct.unpack_from(f"{order}{len(dims) // 4}i", dims)
    count = math.prod(shape) if min(shape, default=-1) >= 0 else -1
    if kind in (CHAR, *NUMERIC):
        require_values(count, max(len(body) - at, 4 * (count < 5)), 1, "an array")
    elif kind == CELL and depth < 2:
        require_values(count, len(body) - at, 8, "a cell array")
        while at < len(body):
            _, inner, at = _element(body, at, order)
            _require_matrix(inner, order, depth + 1)
    else:
        raise FbsError("it holds structures, objects or functions; needed are plain arrays")


# --- version 7.3 -------------------------------------------------------------------------------


def _read_hdf5(path: Path, names: list[str]) -> Arrays:
    try:
        import h5py
    except ImportError:
        raise FbsError("it is of MATLAB 7.3; to read it install h5py (the extra 'files')") from None
    try:
        with h5py.File(path, "r") as file:
            return {name: _dataset(h5py, file, name) for name in names if name in file}
    except (OSError, RuntimeError, KeyError) as error:
        raise FbsError(f"the file is damaged ({error})") from error


def _dataset(h5py: Any, file: Any, name: str) -> NDArray[Any]:
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise FbsError(f"the variable {name} is a link to somewhere else")
    dataset = file[name]
    _require_stored(h5py, dataset, name)
    if dataset.dtype == h5py.ref_dtype:
        return np.array(list(_referred(h5py, file, dataset, name)))
    values = dataset[()]
    if values.dtype.names == ("real", "imag"):
        values = values["real"] + 1j * values["imag"]
    if "MATLAB_class" in dataset.attrs and bytes(dataset.attrs["MATLAB_class"]) == b"char":
        return np.array([_characters(values)])
    return np.asarray(values.T)  # MATLAB stores columns first


def _referred(h5py: Any, file: Any, dataset: Any, name: str) -> Iterator[str]:
    for reference in dataset[()].ravel():
        cell = file[reference]
        _require_stored(h5py, cell, name)
        if cell.dtype.kind != "u":
            raise FbsError(f"the variable {name} is a cell array of other things than text")
        yield _characters(cell[()])


def _characters(codes: NDArray[Any]) -> str:
    return "".join(map(chr, codes.ravel().tolist()))


def _require_stored(h5py: Any, dataset: Any, name: str) -> None:
    """Refuse what is no array of this file, or larger than the bytes that are stored explain."""
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        raise FbsError(f"the variable {name} is no array of this file")
    size = dataset.size * dataset.dtype.itemsize
    stored = dataset.id.get_storage_size()
    require_packed(stored, size, f"the variable {name}")
    if size > 1100 * stored:  # deflate packs 1032 to 1 at most: the rest would be filled in
        raise FbsError(
            f"the variable {name} announces {dataset.size} values, of which {stored} bytes are "
            "stored"
        )

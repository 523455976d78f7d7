"""Files from elsewhere: what they are and how much they hold is known before they are read."""

from __future__ import annotations

import errno
import os
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ..errors import FbsError

MOST_BYTES = 4 * 2**30
"""Of one file, and of what a compressed one unpacks to: 18 times 900 FRFs on 15 000 lines."""

HEAD = 4096
PACKED_FREELY, MOST_PACKED = 2**24, 100
"""Above 16 MiB, what packs 100 to 1 is no measurement: fair ones pack 2 to 1."""


@contextmanager
def open_plain(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a regular file of at most `MOST_BYTES` for reading; a pipe would wait for ever.

    Raises
    ------
    FbsError
        It is a device or a pipe, or too large.
    OSError
        It is not there, is a folder, or may not be read.
    """
    source = Path(path)
    _require_plain(source, os.stat(source))
    with open(source, "rb", opener=_opened) as file:
        _require_plain(source, os.fstat(file.fileno()))  # what was opened, not what was there
        yield file


def _opened(name: str, flags: int) -> int:
    """Open without waiting for whoever writes to a pipe that came in the file's place."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def read_plain(
    path: str | os.PathLike[str], check: Callable[[bytes], object] | None = None
) -> bytes:
    """Return the bytes of a regular file.

    Parameters
    ----------
    path : path
    check : callable, optional
        Called with the first `HEAD` bytes, to refuse another kind of file before all is read.

    Raises
    ------
    FbsError, OSError
        As for `open_plain`, or of `check`.
    """
    with open_plain(path) as file:
        head = file.read(HEAD)
        if check is not None:
            check(head)
        return head + file.read()


def _require_plain(path: Path, status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory", str(path))
    if not stat.S_ISREG(status.st_mode):
        raise FbsError(f"{path}: it is a device or a pipe, no file")
    if status.st_size > MOST_BYTES:
        raise FbsError(
            f"{path}: it has {status.st_size / 2**30:.3g} GiB; at most {MOST_BYTES // 2**30} GiB "
            "are read"
        )


def require_packed(packed: int, unpacked: int, what: str) -> None:
    """Refuse what unpacks to more than a measurement can: numbers that are noise pack badly.

    Raises
    ------
    FbsError
    """
    if unpacked > MOST_BYTES:
        raise FbsError(
            f"{what} unpacks to {unpacked / 2**30:.3g} GiB; at most {MOST_BYTES // 2**30} GiB are "
            "read"
        )
    if unpacked > PACKED_FREELY and unpacked > MOST_PACKED * packed:
        raise FbsError(
            f"{what} unpacks from {packed / 2**20:.3g} MiB to more than {MOST_PACKED} times that, "
            "which no measurement does"
        )


def require_values(count: int, bytes_there: int, bytes_each: float, what: str) -> None:
    """Refuse an announced number of values that the bytes that are there cannot hold.

    Raises
    ------
    FbsError
    """
    if not 0 <= count * bytes_each <= bytes_there:
        raise FbsError(
            f"{what} announces {count} values; the {bytes_there} bytes that follow hold at most "
            f"{int(bytes_there / bytes_each)}"
        )


# --- npz ---------------------------------------------------------------------------------------


def read_arrays(
    path: str | os.PathLike[str], needed: Mapping[str, tuple[str, str]], more: Iterable[str] = ()
) -> dict[str, NDArray[Any]]:
    """Return arrays of a .npz by name; each one's header is read before its values are.

    Parameters
    ----------
    path : path
    needed : mapping of str to (str, str)
        Name → the kinds of dtype it may have, and these in words.
    more : names
        Read if they are there; numbers or text.

    Raises
    ------
    FbsError
        It is no .npz or damaged, an array is missing, of another kind, holds Python objects, or
        unpacks to more than `MOST_BYTES` in all. Nothing is ever unpickled.
    OSError
        As for `open_plain`.
    """
    with open_plain(path) as file, _damage_named(), _archive(file, needed) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist()]
        missing = [name for name in needed if name not in names]
        if missing:
            raise FbsError(
                f"there is no array {' and no '.join(missing)}; needed are "
                f"{', '.join(needed)}, it has {', '.join(names) or 'none'}"
            )
        chosen = [*needed, *(name for name in more if name in names)]
        _require_unpacked(archive, chosen)
        return {name: _array(archive, name, needed.get(name)) for name in chosen}


@contextmanager
def _damage_named() -> Iterator[None]:
    """Name what zipfile raises of a damaged archive; OSError is a place before its start."""
    try:
        yield
    except FbsError:
        raise
    except (
        NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error, EOFError, KeyError,
        OSError, ValueError,
    ) as error:  # fmt: skip
        words = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FbsError(f"the file is damaged ({words})") from error


def _archive(file: BinaryIO, needed: Iterable[str]) -> zipfile.ZipFile:
    magic = file.read(6)
    file.seek(0)
    if magic == b"\x93NUMPY":
        raise FbsError(f"it is one array without names; needed are {', '.join(needed)}")
    try:
        return zipfile.ZipFile(file)
    except zipfile.BadZipFile as error:
        raise FbsError("the file is damaged, or no .npz") from error


def _require_unpacked(archive: zipfile.ZipFile, names: Iterable[str]) -> None:
    """The directory of a zip may lie about sizes; what is read is bounded by it all the same."""
    entries = [archive.getinfo(f"{name}.npy") for name in names]
    packed, unpacked = (
        sum(getattr(e, size) for e in entries) for size in ("compress_size", "file_size")
    )
    require_packed(packed, unpacked, "it")


def _array(archive: zipfile.ZipFile, name: str, kind: tuple[str, str] | None) -> NDArray[Any]:
    kinds, words = kind or ("fiucUb", "numbers or text")
    entry = archive.getinfo(f"{name}.npy")
    with archive.open(entry) as member:
        shape, fortran, dtype, header = _header(member, name)
        if dtype.hasobject:
            raise FbsError(f"its array {name} holds Python objects; it must be {words}")
        if dtype.kind not in kinds:
            raise FbsError(f"the array {name} holds {dtype}; it must be {words}")
        count = int(np.prod([int(n) for n in shape], dtype=object)) if shape else 1
        body = entry.file_size - header
        require_values(count, max(body, 0), max(dtype.itemsize, 1), f"its array {name}")
        content = member.read(count * dtype.itemsize)
    if len(content) != count * dtype.itemsize:
        raise FbsError(f"its array {name} is cut short")
    values = np.frombuffer(content, dtype=dtype, count=count) if dtype.itemsize else np.empty(0)
    return values.reshape(shape, order="F" if fortran else "C")


def _header(member: Any, name: str) -> tuple[tuple[int, ...], bool, np.dtype[Any], int]:
    """Return shape, order, dtype and the bytes of the header; it is a literal, never evaluated."""
    try:
        if npy.read_magic(member) != (1, 0):  # others may announce a header of 4 GiB
            raise ValueError("no plain array has such a header")
        shape, fortran, dtype = npy.read_array_header_1_0(member)
    except (ValueError, TypeError, SyntaxError, OverflowError) as error:
        raise FbsError(f"its array {name} is damaged, or no plain numbers or text") from error
    return shape, fortran, dtype, member.tell()

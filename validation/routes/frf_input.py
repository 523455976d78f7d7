"""FRFs from a file by its ending: what `frf_output` writes, and universal files from elsewhere."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib.npyio import NpzFile
from numpy.typing import NDArray

from fbs import FbsError, Frf
from fbs.frf import as_quantity

from ..errors import CommandError

# what an array of a .npz must be: its dtype's kinds, and those in words
KINDS: Mapping[str, tuple[str, str]] = {
    "frequency": ("fiu", "real numbers (Hz)"),
    "values": ("c", "complex numbers (lines, responses, excitations)"),
    "responses": ("U", "text"),
    "excitations": ("U", "text"),
}


def read(path: Path) -> Frf:
    """Read an FRF matrix by the file's ending.

    Raises
    ------
    CommandError
        The ending is none, or the file holds no FRF matrix; the message starts with the path.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise CommandError(
            f"{path}: the ending {path.suffix or '(none)'} is not known; allowed: "
            f"{', '.join(READERS)}"
        )
    try:
        return reader(path)
    except OSError as error:
        raise CommandError(f"{path}: cannot be read: {error.strerror or error}") from error
    except FbsError as error:
        told = str(error).removeprefix(f"{path}: ")  # some readers name the file themselves
        raise CommandError(f"{path}: {told}") from error


def _read_npz(path: Path) -> Frf:
    arrays = _arrays(path)
    missing = [name for name in KINDS if name not in arrays]
    if missing:
        raise FbsError(
            f"there is no array {' and no '.join(missing)}; needed are {', '.join(KINDS)}, it has "
            f"{', '.join(arrays) or 'none'}"
        )
    for name, (kinds, words) in KINDS.items():
        if arrays[name].dtype.kind not in kinds:
            raise FbsError(f"the array {name} holds {arrays[name].dtype}; it must be {words}")
    return Frf(
        arrays["frequency"],
        arrays["values"],
        tuple(np.atleast_1d(arrays["responses"]).tolist()),
        tuple(np.atleast_1d(arrays["excitations"]).tolist()),
        as_quantity(str(arrays.get("quantity", "receptance"))),
    )


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    try:
        with path.open("rb") as file:  # np.load itself leaves a damaged one open
            archive = _archive(file)
            return {name: _array(archive, name) for name in archive.files}
    except (NotImplementedError, zipfile.BadZipFile, zlib.error) as error:
        raise FbsError(f"the file is damaged ({error})") from error


def _archive(file: BinaryIO) -> NpzFile:
    """A .npz; what numpy says of other files is no advice to follow."""
    try:
        archive = np.load(file, allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise FbsError("the file is damaged, or no .npz") from error
    if not isinstance(archive, NpzFile):
        raise FbsError(f"it is one array without names; needed are {', '.join(KINDS)}")
    return archive


def _array(archive: NpzFile, name: str) -> NDArray[Any]:
    try:
        array: NDArray[Any] = archive[name]
    except (ValueError, EOFError) as error:
        raise FbsError(f"its array {name} is damaged, or no plain numbers or text") from error
    return array


def _read_uff(path: Path) -> Frf:
    from fbs.files.uff import read_uff

    return read_uff(path)


READERS: Mapping[str, Callable[[Path], Frf]] = {
    ".npz": _read_npz,
    ".uff": _read_uff,
    ".unv": _read_uff,
}

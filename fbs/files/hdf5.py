"""Arrays in HDF5 files (MATLAB 7.3), read by h5py in a process of its own.

HDF5's library ends the process, or never comes back, at some damaged files. The process that reads
writes the arrays to standard output as .npz, or one message to standard error.
"""

from __future__ import annotations

import importlib.util
import io
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FbsError
from .untrusted import require_packed

LONGEST, PER_BYTE = 20.0, 2e-8
"""Seconds a file may take, and in addition for each byte: a slow disk has 50 MB/s."""

REFUSED = 2


def read_hdf5(path: Path, names: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return those of the arrays that are there; cells of text and texts as arrays of str.

    Raises
    ------
    FbsError
        It is damaged, an array is no array of this file, or h5py is not installed.
    """
    if importlib.util.find_spec("h5py") is None:
        raise FbsError("it is of MATLAB 7.3; to read it install h5py (the extra 'files')")
    try:
        done = subprocess.run(
            # -P: nothing in the folder it is started in is a module
            [sys.executable, "-P", "-m", __name__, str(path), *names],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=LONGEST + PER_BYTE * path.stat().st_size,
        )
    except subprocess.TimeoutExpired as error:
        raise FbsError(
            f"the file is damaged (HDF5 is not done with it after {error.timeout:.0f} s)"
        ) from None
    if done.returncode == REFUSED:
        raise FbsError(done.stderr.decode(errors="replace").strip())
    if done.returncode:
        raise FbsError(f"the file is damaged (HDF5 ends with it, {done.returncode})")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}


def main(path: str, *names: str) -> int:
    """Read in this process; standard output gets the arrays."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            arrays = {name: _dataset(h5py, file, name) for name in names if name in file}
    except FbsError as error:
        sys.stderr.write(str(error))
        return REFUSED
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError) as error:
        sys.stderr.write(f"the file is damaged ({error})")
        return REFUSED
    np.savez(sys.stdout.buffer, allow_pickle=False, **arrays)
    return 0


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


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

"""Finished pieces of a sweep, from which an interrupted one goes on."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from fbs.files.whole_files import written_whole

from ..arrays import FloatArray
from ..errors import CommandError
from ..runtime.kept import KeptPieces
from ..runtime.output_folder import make_directory, telling
from .parameters import Values
from .plan import SampleResults, SweepPlan

FIELDS = tuple(field.name for field in fields(SampleResults))
MAGNITUDE = "magnitude.npy"  # of a streamed sweep
ROWS = "rows"  # SHA-256 of a streamed piece's |H|


class Pieces:
    """Finished pieces of one sweep in a directory of its own; those of another are not touched.

    Parameters
    ----------
    plan, samples
        What is swept.
    out
        Where the directory is.
    streamed
        Whether |H| of all pieces is one file beside them.
    """

    def __init__(
        self, plan: SweepPlan, samples: Sequence[Values], out: Path, *, streamed: bool = False
    ) -> None:
        swept = repr((plan, tuple(samples), streamed))
        name = hashlib.sha256(swept.encode()).hexdigest()[:16]
        self._kept = KeptPieces(out / f"sweep-{name}", swept)
        self.directory, self.streamed = self._kept.directory, streamed
        self._rows: FloatArray | None = None

    @property
    def unfit(self) -> Sequence[str]:
        """Pieces that were there and could not be used."""
        return self._kept.unfit

    @property
    def magnitude_file(self) -> Path:
        """Where a streamed sweep's |H| is."""
        return self.directory / MAGNITUDE

    def magnitude(self, shape: tuple[int, int]) -> FloatArray:
        """The streamed |H| of all samples, as a file in memory; with what finished pieces left.

        Raises
        ------
        CommandError
            There is no room for it.
        """
        make_directory(self.directory)
        try:
            if not _is_room(self.magnitude_file, shape):
                with written_whole(self.magnitude_file) as file:
                    _make_room(file, shape)
            self._rows = np.load(self.magnitude_file, mmap_mode="r+")
        except OSError as error:
            raise CommandError(
                f"--stream: {8e-9 * shape[0] * shape[1]:.1f} GB in {self.directory.parent}: "
                f"{error.strerror}; give another --out, a larger --df, a narrower band or fewer "
                "samples"
            ) from error
        return self._rows

    def load(self, key: str, at: Sequence[int]) -> SampleResults | None:
        """The piece of that key, of the samples at those places; None if it is not there, or unfit.

        Of a streamed sweep its |H| is in its place already.
        """
        arrays = self._kept.load(key)
        if arrays is None:
            return None
        if self._rows is not None and arrays.pop(ROWS).tobytes() != _digest(self._rows[at]):
            self._kept.refuse(key)
            return None
        return SampleResults(**arrays)

    def save(self, key: str, results: SampleResults) -> None:
        """Keep a piece, whole or not at all, once its |H| is on the disk."""
        arrays: dict[str, NDArray[Any]] = {name: getattr(results, name) for name in FIELDS}
        if isinstance(self._rows, np.memmap):
            self._rows.flush()
            arrays[ROWS] = np.frombuffer(_digest(results.magnitude), dtype=np.uint8)
            arrays["magnitude"] = np.empty((0, 0))
        self._kept.save(key, arrays)

    def clear(self) -> None:
        """Forget all pieces, and nothing else there: the results are written."""
        with telling(self.directory):
            self.magnitude_file.unlink(missing_ok=True)
        self._kept.clear()


def _digest(magnitude: FloatArray) -> bytes:
    return hashlib.sha256(np.ascontiguousarray(magnitude).tobytes()).digest()


def _header(shape: tuple[int, int]) -> dict[str, Any]:
    return {"descr": "<f8", "fortran_order": False, "shape": shape}


def _is_room(path: Path, shape: tuple[int, int]) -> bool:
    """Whether a file is an .npy of that shape, all of it: pieces say themselves what is in it."""
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        try:
            np.lib.format.read_magic(file)
            found = np.lib.format.read_array_header_1_0(file)
        except ValueError:
            return False
        size = file.tell() + 8 * shape[0] * shape[1]
    return found == (shape, False, np.dtype("<f8")) and path.stat().st_size == size


def _make_room(file: BinaryIO, shape: tuple[int, int]) -> None:
    """An .npy of that shape, all of whose room is taken where the system can."""
    np.lib.format.write_array_header_1_0(file, _header(shape))
    size = file.tell() + 8 * shape[0] * shape[1]
    file.truncate(size)
    if hasattr(os, "posix_fallocate"):  # a disk that fills up later would kill us
        os.posix_fallocate(file.fileno(), 0, size)

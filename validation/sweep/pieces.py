"""Finished pieces of a sweep on disk, from which an interrupted one goes on."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import BinaryIO
from zipfile import BadZipFile

import numpy as np

from fbs.files.whole_files import written_whole

from ..arrays import FloatArray
from ..errors import CommandError
from ..runtime.output_folder import make_directory, telling
from .plan import SampleResults, SweepPlan

FIELDS = tuple(field.name for field in fields(SampleResults))
MAGNITUDE = "magnitude.npy"  # of a streamed sweep
PIECE = re.compile(r"\d+\.npz|\.[0-9a-f]{16}\.partial")  # the second left by a killed process


@dataclass(frozen=True)
class Pieces:
    """Finished pieces of one sweep, as files in a directory of its own.

    Attributes
    ----------
    directory
        Where they are.
    streamed
        Whether |H| of all pieces is one file beside them.
    """

    directory: Path
    streamed: bool = False

    @classmethod
    def of(
        cls,
        plan: SweepPlan,
        samples: Sequence[tuple[float, ...]],
        out: Path,
        *,
        streamed: bool = False,
    ) -> Pieces:
        """The pieces of this very plan and samples; those of another are not touched."""
        digest = hashlib.sha256(repr((plan, tuple(samples), streamed)).encode()).hexdigest()
        return cls(out / f"sweep-{digest[:16]}", streamed)

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
            if not self.magnitude_file.exists():
                with written_whole(self.magnitude_file) as file:
                    _make_room(file, shape)
                    for path in self._files():  # whose |H| is gone
                        if path.suffix == ".npz":
                            path.unlink()
        except OSError as error:
            raise CommandError(
                f"--stream: {8e-9 * shape[0] * shape[1]:.1f} GB in {self.directory.parent}: "
                f"{error.strerror}; give another --out, a larger --df, a narrower band or fewer "
                "samples"
            ) from error
        rows: FloatArray = np.load(self.magnitude_file, mmap_mode="r+")
        return rows

    def load(self, key: str) -> SampleResults | None:
        """The piece of that key; None if it is not there, or not whole."""
        try:
            with np.load(self._path(key), allow_pickle=False) as file:
                return SampleResults(*(file[name] for name in FIELDS))
        except (OSError, ValueError, KeyError, EOFError, BadZipFile):
            return None

    def save(self, key: str, results: SampleResults) -> None:
        """Keep a piece, whole or not at all."""
        make_directory(self.directory)
        if self.streamed:
            results = replace(results, magnitude=np.empty((0, 0)))
        arrays = {name: getattr(results, name) for name in FIELDS}
        with telling(self._path(key)), written_whole(self._path(key)) as file:
            np.savez(file, allow_pickle=False, **arrays)

    def clear(self) -> None:
        """Forget all pieces, and nothing else there: the results are written."""
        if not self.directory.exists():
            return
        with telling(self.directory):
            for path in (*self._files(), self.magnitude_file):
                path.unlink(missing_ok=True)
            if not any(self.directory.iterdir()):
                self.directory.rmdir()

    def _files(self) -> list[Path]:
        return [path for path in self.directory.iterdir() if PIECE.fullmatch(path.name)]

    def _path(self, key: str) -> Path:
        return self.directory / f"{key}.npz"


def _make_room(file: BinaryIO, shape: tuple[int, int]) -> None:
    """An .npy of that shape, all of whose room is taken where the system can."""
    np.lib.format.write_array_header_1_0(
        file, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )
    size = file.tell() + 8 * shape[0] * shape[1]
    file.truncate(size)
    if hasattr(os, "posix_fallocate"):  # a disk that fills up later would kill us
        os.posix_fallocate(file.fileno(), 0, size)

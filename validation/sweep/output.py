"""What a sweep leaves: its metrics, a table (CSV and npz), and finished pieces to go on from."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from fbs.files.whole_files import written_whole

from ..errors import CommandError
from ..runtime.output_folder import Writer, make_directory, telling, write_together
from .metrics import columns
from .parameters import Design
from .task import Outcome, Task

FloatArray = NDArray[np.float64]

PICTURES = ("frf_map.svg", "bands.svg", "frequencies.svg", "metrics.svg", "sensitivity.svg")
FIELDS = tuple(field.name for field in fields(Outcome))
MAGNITUDE = "magnitude.npy"  # of a streamed sweep
RESULTS = ("sweep.csv", "sweep.npz", "sweep.html")
PIECE = re.compile(r"\d+\.npz|\.[0-9a-f]{16}\.partial")  # the second left by a killed process


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep and what it found.

    Attributes
    ----------
    title
        The drivetrain's name.
    task, design, outcome
        What was computed, of which samples, and the results.
    """

    title: str
    task: Task
    design: Design
    outcome: Outcome

    @property
    def has_frf(self) -> bool:
        """Whether an FRF was asked for."""
        return self.task.response is not None

    @property
    def frf_name(self) -> str:
        """The FRF asked for, response first."""
        return f"{self.task.response} ← {self.task.excitation}"

    @cached_property
    def frequency(self) -> FloatArray:
        """(n_frequency,) Hz."""
        return self.task.band.frequency()

    @cached_property
    def values(self) -> FloatArray:
        """(n_sample, n_parameter)."""
        return np.array(self.design.samples, dtype=float)

    @property
    def metrics(self) -> dict[str, FloatArray]:
        """Column → (n_sample,) values."""
        return dict(zip(columns(self.task.metrics), self.outcome.metrics.T, strict=True))


# Writing


def write_sweep(
    sweep: Sweep, directory: Path, texts: Mapping[str, str], streamed: Path | None = None
) -> tuple[Path, ...]:
    """Write the table and texts; a file of an earlier sweep is replaced whole or not at all.

    What an earlier sweep alone had, a picture or |H|, is removed if it is still what that one
    wrote: ``sweep.npz`` has their names and SHA-256.

    Parameters
    ----------
    sweep, directory
        What is written, and where.
    texts
        File name → text, of the report and its pictures.
    streamed
        The file |H| went to, which becomes ``magnitude.npy``; None: |H| is part of the npz.

    Raises
    ------
    CommandError
        The directory or a file in it cannot be written.
    """
    earlier = _optional_files(directory)
    marks = {
        name: hashlib.sha256(texts[name].encode()).hexdigest() for name in PICTURES if name in texts
    }
    if streamed is not None:
        marks[MAGNITUDE] = _sha256(streamed)
    contents: dict[str, str | Writer] = {
        "sweep.csv": lambda file: _write_csv(sweep, file),
        "sweep.npz": lambda file: _write_npz(sweep, file, marks),
        **texts,
    }
    written = write_together(directory, contents)
    if streamed is not None:
        with telling(directory / MAGNITUDE):
            streamed.replace(directory / MAGNITUDE)
        written = (*written, directory / MAGNITUDE)
    for name in earlier.keys() - marks.keys():
        path = directory / name
        with telling(path):
            if path.is_file() and not path.is_symlink() and _sha256(path) == earlier[name]:
                path.unlink()
    return written


def _optional_files(directory: Path) -> dict[str, str]:
    """Names and SHA-256 of the files that an earlier sweep had and not every one has."""
    try:
        with np.load(directory / "sweep.npz", allow_pickle=False) as file:
            found = dict(zip(file["files"].tolist(), file["sha256"].tolist(), strict=True))
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):  # none, or not one of ours
        return {}
    return {name: found[name] for name in (*PICTURES, MAGNITUDE) if name in found}


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write_csv(sweep: Sweep, file: BinaryIO) -> None:
    outcome, n_modes = sweep.outcome, sweep.outcome.frequency_hz.shape[1]
    header = ["sample", *sweep.design.paths, "status", *sweep.metrics]
    for k in range(1, n_modes + 1):
        header += [f"f{k}_hz", f"kind{k}"]
    text = io.TextIOWrapper(file, encoding="utf-8", newline="")
    writer = csv.writer(text)
    writer.writerow(header)
    for i, values in enumerate(sweep.design.samples):
        row: list[object] = [i, *values, outcome.status[i]]
        row += [_number(metric[i]) for metric in sweep.metrics.values()]
        for frequency, kind in zip(outcome.frequency_hz[i], outcome.kind[i], strict=True):
            row += [_number(frequency), kind]
        writer.writerow(row)
    text.detach()


def _number(value: float) -> object:
    """A number; nothing where there is none."""
    return "" if np.isnan(value) else float(value)


def _write_npz(sweep: Sweep, file: BinaryIO, marks: Mapping[str, str]) -> None:
    outcome = sweep.outcome
    arrays: dict[str, NDArray[Any]] = {
        "parameters": np.array(sweep.design.paths),
        "values": sweep.values,
        "status": outcome.status,
        "natural_frequency_hz": outcome.frequency_hz,
        "kind": outcome.kind,
        **sweep.metrics,
        "files": np.array(list(marks), dtype=str),
        "sha256": np.array(list(marks.values()), dtype=str),
    }
    if sweep.has_frf:
        arrays["frequency"] = sweep.frequency
        arrays["response"] = np.array(sweep.task.response)
        arrays["excitation"] = np.array(sweep.task.excitation)
        if MAGNITUDE not in marks:
            arrays["magnitude"] = outcome.magnitude
    np.savez(file, allow_pickle=False, **arrays)


# Going on from what is there


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
        task: Task,
        samples: Sequence[tuple[float, ...]],
        out: Path,
        *,
        streamed: bool = False,
    ) -> Pieces:
        """The pieces of this very task and samples; those of another are not touched."""
        digest = hashlib.sha256(repr((task, tuple(samples), streamed)).encode()).hexdigest()
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

    def load(self, key: str) -> Outcome | None:
        """The piece of that key; None if it is not there, or not whole."""
        try:
            with np.load(self._path(key), allow_pickle=False) as file:
                return Outcome(*(file[name] for name in FIELDS))
        except (OSError, ValueError, KeyError, EOFError, BadZipFile):
            return None

    def save(self, key: str, outcome: Outcome) -> None:
        """Keep a piece, whole or not at all."""
        make_directory(self.directory)
        if self.streamed:
            outcome = replace(outcome, magnitude=np.empty((0, 0)))
        arrays = {name: getattr(outcome, name) for name in FIELDS}
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

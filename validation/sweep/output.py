"""What a sweep leaves: its metrics, a table (CSV and npz), and finished pieces to go on from."""

from __future__ import annotations

import csv
import hashlib
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ..errors import CommandError
from .metrics import columns
from .parameters import Design
from .task import Outcome, Task

FloatArray = NDArray[np.float64]
Writer = Callable[[Path], None]

PICTURES = ("frf_map.svg", "bands.svg", "frequencies.svg", "metrics.svg", "sensitivity.svg")
FIELDS = tuple(field.name for field in fields(Outcome))
MAGNITUDE = "magnitude.npy"  # of a streamed sweep


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
    writers: dict[str, Writer] = {
        "sweep.csv": lambda path: _write_csv(sweep, path),
        "sweep.npz": lambda path: _write_npz(sweep, path, with_magnitude=streamed is None),
        **{name: partial(_write_text, text) for name, text in texts.items()},
    }
    make_directory(directory)
    partials = {name: directory / f".{name}.partial" for name in writers}
    try:
        for name, write in writers.items():
            write(partials[name])
        for name, path in partials.items():
            path.replace(directory / name)
        for name in {*PICTURES, MAGNITUDE} - set(writers):  # of an earlier sweep
            (directory / name).unlink(missing_ok=True)
        if streamed is not None:
            streamed.replace(directory / MAGNITUDE)
    except OSError as error:
        raise CommandError(f"--out = {directory}: cannot be written: {error.strerror}") from error
    finally:
        for path in partials.values():
            path.unlink(missing_ok=True)
    names = (*writers, *((MAGNITUDE,) if streamed is not None else ()))
    return tuple(directory / name for name in names)


def make_directory(directory: Path) -> None:
    """Make the directory of the results.

    Raises
    ------
    CommandError
        It cannot be made.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"--out = {directory}: cannot be made: {error.strerror}") from error


def _write_text(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")


def _write_csv(sweep: Sweep, path: Path) -> None:
    outcome, n_modes = sweep.outcome, sweep.outcome.frequency_hz.shape[1]
    header = ["sample", *sweep.design.paths, "status", *sweep.metrics]
    for k in range(1, n_modes + 1):
        header += [f"f{k}_hz", f"kind{k}"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        for i, values in enumerate(sweep.design.samples):
            row: list[object] = [i, *values, outcome.status[i]]
            row += [_number(metric[i]) for metric in sweep.metrics.values()]
            for frequency, kind in zip(outcome.frequency_hz[i], outcome.kind[i], strict=True):
                row += [_number(frequency), kind]
            writer.writerow(row)


def _number(value: float) -> object:
    """A number; nothing where there is none."""
    return "" if np.isnan(value) else float(value)


def _write_npz(sweep: Sweep, path: Path, *, with_magnitude: bool) -> None:
    outcome = sweep.outcome
    arrays: dict[str, NDArray[np.generic]] = {
        "parameters": np.array(sweep.design.paths),
        "values": sweep.values,
        "status": outcome.status,
        "natural_frequency_hz": outcome.frequency_hz,
        "kind": outcome.kind,
        **sweep.metrics,
    }
    if sweep.has_frf:
        arrays["frequency"] = sweep.frequency
        arrays["response"] = np.array(sweep.task.response)
        arrays["excitation"] = np.array(sweep.task.excitation)
        if with_magnitude:
            arrays["magnitude"] = outcome.magnitude
    with path.open("wb") as file:
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
        return cls(out / f".sweep-{digest[:16]}", streamed)

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
        if self.magnitude_file.exists():
            rows: FloatArray = np.load(self.magnitude_file, mmap_mode="r+")
            return rows
        partial = self.directory / f".{MAGNITUDE}.partial"
        try:
            rows = np.lib.format.open_memmap(partial, "w+", dtype=float, shape=shape)
            if hasattr(os, "posix_fallocate"):  # a disk that fills up later would kill us
                with partial.open("r+b") as file:
                    os.posix_fallocate(file.fileno(), 0, partial.stat().st_size)
            for path in self.directory.glob("*.npz"):  # whose |H| is gone
                path.unlink()
            partial.replace(self.magnitude_file)
        except OSError as error:
            partial.unlink(missing_ok=True)
            raise CommandError(
                f"--stream: {8e-9 * shape[0] * shape[1]:.1f} GB in {self.directory.parent}: "
                f"{error.strerror}; give another --out, a larger --df, a narrower band or fewer "
                "samples"
            ) from error
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
        partial = self.directory / f".{key}.partial"
        try:
            with partial.open("wb") as file:
                np.savez(
                    file, allow_pickle=False, **{name: getattr(outcome, name) for name in FIELDS}
                )
            partial.replace(self._path(key))
        except OSError as error:
            raise CommandError(
                f"--out = {self.directory}: cannot be written: {error.strerror}"
            ) from error

    def clear(self) -> None:
        """Forget all pieces: the results are written."""
        shutil.rmtree(self.directory, ignore_errors=True)

    def _path(self, key: str) -> Path:
        return self.directory / f"{key}.npz"

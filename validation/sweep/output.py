"""What a sweep leaves: its metrics, and a table (CSV and npz)."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ..runtime.output_folder import Writer, telling, write_together
from .metrics import columns
from .parameters import Design
from .task import Outcome, Task

FloatArray = NDArray[np.float64]

PICTURES = ("frf_map.svg", "bands.svg", "frequencies.svg", "metrics.svg", "sensitivity.svg")
FIELDS = tuple(field.name for field in fields(Outcome))
MAGNITUDE = "magnitude.npy"  # of a streamed sweep
RESULTS = ("sweep.csv", "sweep.npz", "sweep.html")


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

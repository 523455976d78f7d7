"""The files of a sweep: its table as CSV and npz, pictures, and a streamed |H|."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ..report.publish import publish
from ..runtime.output_folder import Writer, telling
from .pieces import MAGNITUDE
from .result import SweepResult

PICTURES = ("frf_map.svg", "bands.svg", "frequencies.svg", "metrics.svg", "sensitivity.svg")
RESULTS = ("sweep.csv", "sweep.npz", *SweepResult.files)


def write_sweep(result: SweepResult, directory: Path) -> tuple[Path, ...]:
    """Publish a sweep, and put a streamed |H| beside it as ``magnitude.npy``.

    A file of an earlier sweep is replaced whole or not at all. What that one alone had, a picture
    or |H|, is removed if it is still what it wrote: ``sweep.npz`` has their names and SHA-256.

    Raises
    ------
    ReportError
        The directory or a file in it cannot be written.
    """
    earlier, kept = _optional_files(directory), optional_files(result)
    written = publish(result, directory)
    if result.streamed is not None:
        with telling(directory / MAGNITUDE):
            result.streamed.replace(directory / MAGNITUDE)
        written = (*written, directory / MAGNITUDE)
    for name in earlier.keys() - kept.keys():
        path = directory / name
        with telling(path):
            if path.is_file() and not path.is_symlink() and _sha256(path) == earlier[name]:
                path.unlink()
    return written


def optional_files(result: SweepResult) -> dict[str, str]:
    """Names and SHA-256 of what not every sweep has."""
    marks = {p.file: hashlib.sha256(p.text.encode()).hexdigest() for p in result.pictures}
    return marks if result.streamed is None else marks | {MAGNITUDE: _sha256(result.streamed)}


def tables(result: SweepResult) -> dict[str, str | Writer]:
    """The samples as CSV, and with |H| as npz."""
    marks = optional_files(result)  # now: a streamed |H| is moved when all is written
    return {
        "sweep.csv": lambda file: _write_csv(result, file),
        "sweep.npz": lambda file: _write_npz(result, file, marks),
    }


def _optional_files(directory: Path) -> dict[str, str]:
    """Names and SHA-256 of the files that an earlier sweep had and not every one has."""
    try:
        with np.load(directory / "sweep.npz", allow_pickle=False) as file:
            known = dict(zip(file["files"].tolist(), file["sha256"].tolist(), strict=True))
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):  # none, or not one of ours
        return {}
    return {name: known[name] for name in (*PICTURES, MAGNITUDE) if name in known}


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write_csv(sweep: SweepResult, file: BinaryIO) -> None:
    results, n_modes = sweep.results, sweep.results.frequency_hz.shape[1]
    header = ["sample", *sweep.samples.paths, "status", *sweep.metrics]
    for k in range(1, n_modes + 1):
        header += [f"f{k}_hz", f"kind{k}"]
    text = io.TextIOWrapper(file, encoding="utf-8", newline="")
    writer = csv.writer(text)
    writer.writerow(header)
    for i, values in enumerate(sweep.samples.rows):
        row: list[object] = [i, *values, results.status[i]]
        row += [_number(metric[i]) for metric in sweep.metrics.values()]
        for frequency, kind in zip(results.frequency_hz[i], results.kind[i], strict=True):
            row += [_number(frequency), kind]
        writer.writerow(row)
    text.detach()


def _number(value: float) -> object:
    """A number; nothing where there is none."""
    return "" if np.isnan(value) else float(value)


def _write_npz(sweep: SweepResult, file: BinaryIO, marks: Mapping[str, str]) -> None:
    results = sweep.results
    arrays: dict[str, NDArray[Any]] = {
        "parameters": np.array(sweep.samples.paths),
        "values": sweep.values,
        "status": results.status,
        "natural_frequency_hz": results.frequency_hz,
        "kind": results.kind,
        **sweep.metrics,
        "files": np.array(list(marks), dtype=str),
        "sha256": np.array(list(marks.values()), dtype=str),
    }
    if sweep.has_frf:
        arrays["frequency"] = sweep.frequency
        arrays["response"] = np.array(sweep.plan.response)
        arrays["excitation"] = np.array(sweep.plan.excitation)
        if sweep.streamed is None:
            arrays["magnitude"] = results.magnitude
    np.savez(file, allow_pickle=False, **arrays)

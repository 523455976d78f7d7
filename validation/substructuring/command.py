"""`crosscheck couple`, `decouple`, `identify`: from what is typed to files."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from fbs import Frf
from fbs.files.whole_files import require_writable, written_whole
from fbs.joint_identification import JointStiffness

from ..checks.part_uncertainty import Noise, parse_noise
from ..errors import CommandError
from ..inspection import frf_output
from ..report.command import run_study
from ..routes.frf_input import FileOptions, file_options
from ..runtime.output_folder import telling
from ..runtime.progress import Progress
from .console import print_result
from .inputs import Part, read_parts
from .result import SubstructuringResult, file_names
from .run import Found


@dataclass(frozen=True)
class Files:
    """What every one of the commands takes.

    Attributes
    ----------
    paths
        By the names the command gives them.
    options
        What the user says of them.
    limits
        fmin and fmax, Hz.
    noise
        Of the files' FRFs.
    output
        Where the result goes, beside the page.
    out
        Where the page goes.
    """

    paths: Mapping[str, Path]
    options: FileOptions
    limits: tuple[float | None, float | None]
    noise: Noise | None
    output: Path | None
    out: Path


def files(
    paths: Mapping[str, Path],
    said: tuple[str | None, str | None, int | None, str | None],
    limits: tuple[float | None, float | None],
    noise: str | None,
    output: Path | None,
    out: Path,
) -> Files:
    """What is typed; ``said`` is --quantity, --unit, --run and --map.

    Raises
    ------
    CommandError
    """
    return Files(paths, file_options(*said), limits, parse_noise(noise), output, out)


def run_command(
    command: str, files: Files, study: Callable[[Mapping[str, Part], Noise | None], Found]
) -> SubstructuringResult:
    """Read the files, do it, write the report and the result.

    Raises
    ------
    FbsError, CommandError
        Bad input; nothing is written then.
    """
    if files.output is not None:
        _check_target(files.output, command, files.paths.values())
    parts = read_parts(dict(files.paths), files.options, *files.limits)

    def run(_: Path, progress: Progress) -> SubstructuringResult:
        progress(command, 0, 1)
        result, found = study(parts, files.noise)
        if files.output is not None:
            _write(found, files.output, command)
        return result

    return run_study(run, files.out, file_names(command), print_result)


def _check_target(path: Path, command: str, read: Iterable[Path]) -> None:
    if command != "identify":
        frf_output.check_target(path, read)
        return
    if path.suffix.lower() != ".csv":
        raise CommandError(f"--output = {path}: a joint is written as .csv")
    frf_output.require_not_read(path, read)
    with telling(f"--output = {path}"):
        require_writable(path)


def _write(found: Frf | JointStiffness, path: Path, command: str) -> None:
    if isinstance(found, Frf):
        frf_output.write(found, path, command)
        return
    with telling(f"--output = {path}"), written_whole(path) as file:
        file.write(_joint_table(found).encode())


def _joint_table(joint: JointStiffness) -> str:
    """Hz, then Re and Im of every pair's stiffness: of one pair, what ``--joint`` reads."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = [f"{a} - {b}" for a, b in joint.at]
    writer.writerow(["frequency_hz", *(f"{part} {n}, N/m" for n in names for part in ("Re", "Im"))])
    for line, hertz in enumerate(joint.frequency):
        parts = [p for z in joint.values[line].diagonal() for p in (z.real, z.imag)]
        writer.writerow([repr(float(number)) for number in (hertz, *parts)])
    return text.getvalue()

"""Records of hammer or shaker tests become FRFs with coherence, in a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import get_args

import numpy as np

from fbs import FbsError, Record
from fbs.files.frf_files import FORMATS, write_frf
from fbs.files.record_files import read_records
from fbs.files.whole_files import require_writable
from fbs.measured.from_records import Estimated, Signal, frf_from_records
from fbs.signal.estimation import Estimator

from ..errors import CommandError
from ..routes import frf_input
from ..runtime.output_folder import telling
from . import frf_output

RINGING = 0.01  # of the peak: a tenth of a decibel of a mode that rings so long


def require_target(path: Path, read: Sequence[Path]) -> None:
    """Refuse a file that cannot be written, or is one of the records, before anything is read.

    Raises
    ------
    CommandError
        Its ending is none of FRFs', it is protected, or a record.
    """
    if path.suffix.lower() not in FORMATS:
        raise CommandError(
            f"--output = {path}: the ending {path.suffix or '(none)'} is not known; allowed: "
            f"{', '.join(FORMATS)}"
        )
    frf_output.require_not_read(path, read)
    with telling(f"--output = {path}"):
        require_writable(path)


def read_all(paths: Sequence[Path], channels: Mapping[str, tuple[str, str]]) -> list[Record]:
    """Read the records of several files.

    Raises
    ------
    CommandError
        A file that holds none; the message starts with its path.
    """
    records: list[Record] = []
    for path in paths:
        with frf_input.naming(path):
            records += read_records(path, channels)
    return records


def estimated(
    records: Sequence[Record],
    method: str,
    signal: str | None,
    resolution: float | None,
    decay: float,
    fmin: float | None,
    fmax: float | None,
) -> Estimated:
    """Estimate the FRFs of records.

    Parameters
    ----------
    records
        All of one test.
    method
        H1, H2 or Hv.
    signal
        hammer or noise (None: as the force looks).
    resolution
        Distance of the lines of a noise test, Hz.
    decay
        Of the exponential window of blows, 1/s.
    fmin, fmax
        Band, Hz.

    Raises
    ------
    CommandError
        An option that is none.
    FbsError
        Records from which nothing can be estimated.
    """
    _require("--method", method, get_args(Estimator))
    if signal is not None:
        _require("--signal", signal, get_args(Signal))
    segment = None
    if resolution is not None:
        if not (np.isfinite(resolution) and resolution > 0):
            raise CommandError(f"--df = {resolution}: must be greater than 0 (Hz)")
        segment = round(records[0].sampling_frequency / resolution)
    found = frf_from_records(records, method, signal, segment, decay, fmin, fmax)  # type: ignore[arg-type]  # just checked
    if resolution is not None and found.signal == "hammer":
        raise CommandError(
            f"--df = {resolution:g}: is for noise; blows have the lines of their records, "
            "1/duration apart (--signal noise, if the force is one)"
        )
    return found


def _require(option: str, value: str, allowed: Sequence[str]) -> None:
    if value not in allowed:
        raise CommandError(f"{option} = {value!r}: must be one of {', '.join(allowed)}")


def write(found: Estimated, path: Path) -> None:
    """Write FRFs and coherence by the file's ending."""
    with telling(f"--output = {path}"):
        try:
            write_frf(found.frf, path, coherence=found.coherence, averages=found.averages)
        except FbsError as error:
            raise CommandError(f"--output = {path}: {error}") from error


def summary(found: Estimated) -> list[str]:
    """Say what was estimated, and how good it is."""
    frf = found.frf
    counts = ", ".join(f"{label}: {n}" for label, n in found.averages.items())
    lines = [
        f"{frf.quantity} by {found.estimator} ({found.signal}), {len(frf.responses)} × "
        f"{len(frf.excitations)}, {frf.frequency.size} lines from {frf.frequency[0]:g} to "
        f"{frf.frequency[-1]:g} Hz",
        f"averages: {counts}",
    ]
    if found.coherence is None:
        lines.append("coherence: unknown, each FRF rests on one record")
    else:
        median, least = np.median(found.coherence), found.coherence.min()
        lines.append(f"coherence: median {median:.4f}, least {least:.3f}")
    if found.remainder > RINGING:
        lines.append(
            f"a response is still at {found.remainder:.1%} of its peak as its record ends: what is "
            "cut off leaks, and coherence does not show it; record longer, or give --decay"
        )
    if found.unexcited.size:
        lines.append(f"{found.unexcited.size} lines are hardly excited and left out")
    if found.added_damping:
        lines.append(
            f"the window adds {found.added_damping:g} 1/s to every mode's decay: it is in the FRFs"
        )
    return lines

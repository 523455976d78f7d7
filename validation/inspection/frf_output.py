"""FRFs for a user: drawn in the terminal, or written to a file by its ending."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from fbs import Frf
from fbs.files.frf_files import FORMATS, write_frf
from fbs.files.uff_functions import Channel
from fbs.files.whole_files import require_writable, written_whole

from ..errors import CommandError
from ..runtime.output_folder import telling

PICTURES = (".png", ".svg", ".pdf")


def labels(option: str, given: Sequence[str] | None) -> tuple[str, ...] | None:
    """DoF labels of a repeated or comma-separated option; None for ``all``."""
    found = tuple(label for item in given or () for label in item.split(",") if label)
    if not found:
        raise CommandError(f"{option} is missing: give a DoF such as planetary.sun.w, or all")
    return None if found == ("all",) else found


def check_target(path: Path, read: Iterable[Path] = ()) -> None:
    """Refuse a file that cannot be written, or is read, before anything is computed."""
    require_not_read(path, read)
    if path.suffix.lower() not in (*FORMATS, *PICTURES):
        raise CommandError(
            f"--output = {path}: the ending {path.suffix or '(none)'} is not known; allowed: "
            f"{', '.join((*FORMATS, *PICTURES))}"
        )
    with telling(f"--output = {path}"):
        require_writable(path)


def require_not_read(path: Path, read: Iterable[Path]) -> None:
    """Refuse to write over what was measured.

    Raises
    ------
    CommandError
        The path is one of the files that are read, whatever its spelling.
    """
    for source in read:
        if path.exists() and source.exists() and path.samefile(source):
            raise CommandError(
                f"--output = {path}: is {source} itself, which is read and would be lost; give "
                "another name"
            )


def is_picture(path: Path) -> bool:
    """Whether FRFs are drawn by matplotlib, rather than written as numbers or shown."""
    return path.suffix.lower() in PICTURES


def write(frf: Frf, path: Path, title: str, channels: Mapping[str, Channel] | None = None) -> None:
    """Write an FRF by the file's ending; an existing file is replaced whole or not at all.

    Parameters
    ----------
    frf
        What is written.
    path
        Its ending says how.
    title
        Of a picture.
    channels
        Nodes and directions of the DoFs, for .uff.
    """
    with telling(f"--output = {path}"):
        if is_picture(path):
            with written_whole(path) as file:
                _write_picture(frf, file, path.suffix.lower(), title)
        else:
            write_frf(frf, path, channels)


def _write_picture(frf: Frf, file: BinaryIO, ending: str, title: str) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    magnitude, _ = frf.plot(figure.subplots(2, sharex=True, height_ratios=(3, 1)))
    magnitude.set_title(title)
    figure.savefig(file, format=ending.removeprefix("."))


def show(frf: Frf) -> None:
    """Draw |H| in dB over frequency in the terminal, one chart per FRF."""
    width = max(40, min(shutil.get_terminal_size((100, 24)).columns, 160)) - 12
    for response, excitation, values in frf.curves():
        with np.errstate(divide="ignore"):
            level = 20.0 * np.log10(np.abs(values))
        print(f"{response} ← {excitation}: {frf.quantity}, dB re 1 {frf.quantity.unit}")
        print(chart(frf.frequency, level, width, height=16))


def chart(x: NDArray[np.float64], y: NDArray[np.float64], width: int, height: int) -> str:
    """A curve in braille dots: each of 2·width columns spans the extremes of its lines."""
    finite = np.isfinite(y)
    if not finite.any():
        return "  (zero at every line)"
    low, high = float(y[finite].min()), float(y[finite].max())
    span = high - low or 1.0
    column = np.minimum(
        ((x - x[0]) / ((x[-1] - x[0]) or 1.0) * 2 * width).astype(int), 2 * width - 1
    )
    row = ((high - np.where(finite, y, low)) / span * (4 * height - 1)).round().astype(int)
    dots = np.zeros((4 * height, 2 * width), dtype=bool)
    previous = row[0]
    for c, r in zip(column, row, strict=True):
        dots[min(previous, r) : max(previous, r) + 1, c] = True
        previous = r
    bits = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
    cells = np.einsum("racb,ab->rc", dots.reshape(height, 4, width, 2), bits)
    lines = ["".join(chr(0x2800 + int(cell)) for cell in line) for line in cells]
    marks = {0: f"{high:8.1f}", height // 2: f"{(high + low) / 2:8.1f}", height - 1: f"{low:8.1f}"}
    body = [f"{marks.get(i, ''):>8} ┤{line}" for i, line in enumerate(lines)]
    foot = f"{x[0]:g} Hz"
    return "\n".join([*body, f"{'':9}└{foot}{f'{x[-1]:g} Hz':>{width - len(foot)}}"])

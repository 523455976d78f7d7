"""A measured force: a record from a CSV file, played back as a function of time."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..errors import ModelError
from ..text_files import read_text
from .line_sum import LineSum, fast_length
from .lines import FloatArray, require

LARGEST_FILE = 200_000_000  # bytes: some million samples
LARGEST = 1e30  # of a time (s) or a force, as any excitation's
# How far a sample may be from the uniform grid, in steps: room for times of few digits.
UNIFORMITY = 1e-3
# The band holds all of the signal's mean square but this: what is left out is 60 dB below it.
OUTSIDE_BAND = 1e-6
SEPARATOR = re.compile(r"\s*[,;\t]\s*|\s+")


@dataclass(frozen=True, eq=False)
class Sampled:
    """A record's trigonometric interpolation: band-limited, and the samples themselves at n/fs.

    f(t) = (1/N) Σ_{|k| ≤ N/2} F_k e^{j2πkt fs/N} for 0 ≤ t ≤ (n − 1)/fs, F the DFT of the n samples
    followed by zeros (N ≥ 2n): no attenuation and no images, as straight lines between the samples
    would have. Zero elsewhere. A record that begins or ends with a jump rings beside it, as
    anything band-limited does.

    Attributes
    ----------
    sampling_frequency
        fs (Hz).
    samples
        (n,) N.

    Raises
    ------
    ModelError
        Fewer than two samples, one that is not finite, or none but zeros.
    """

    sampling_frequency: float
    samples: FloatArray

    def __post_init__(self) -> None:
        require("record", "Hz", sampling_frequency=self.sampling_frequency)
        if self.samples.ndim != 1 or len(self.samples) < 2:
            raise ModelError(
                f"record: it has {self.samples.size} samples; must be at least 2 in a row"
            )
        wrong = np.flatnonzero(~np.isfinite(self.samples))
        if wrong.size:
            raise ModelError(
                f"record: sample {wrong[0]} is {self.samples[wrong[0]]}; must be finite"
            )
        if not self.samples.any():
            raise ModelError("record: every sample is 0 N; must excite something")

    @property
    def period(self) -> None:
        """It does not repeat."""
        return None

    @property
    def duration(self) -> float:
        """(n − 1)/fs, when the last sample is (s)."""
        return (len(self.samples) - 1) / self.sampling_frequency

    @cached_property
    def band(self) -> tuple[float, float]:
        """What holds all of the mean square but 1e-6, half of that below and half above (Hz)."""
        share = np.cumsum(np.abs(self._lines.coefficients) ** 2)
        share /= share[-1]
        first = np.searchsorted(share, OUTSIDE_BAND / 2.0, side="right")
        last = np.searchsorted(share, 1.0 - OUTSIDE_BAND / 2.0)
        return float(first / self._lines.period), float(last / self._lines.period)

    @cached_property
    def _lines(self) -> LineSum:
        count = 2 * fast_length(len(self.samples))
        coefficients = np.fft.rfft(self.samples, count) * 2.0 / count
        coefficients[[0, -1]] /= 2.0
        harmonics = np.arange(len(coefficients))
        return LineSum(count / self.sampling_frequency, harmonics, coefficients)

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        instants = np.asarray(time, dtype=float)
        # An instant that is the last sample's but for rounding is that sample's.
        end = self.duration * (1.0 + 1e-12)
        inside = (instants >= 0.0) & (instants <= end)
        return np.asarray(np.where(inside, self._lines.values(instants), 0.0))


def read_sampled(path: str | Path, scale: float = 1.0) -> Sampled:
    """The record in a text file: time (s) and force (N) in its first two columns.

    Columns are separated by comma, semicolon, tab or blanks. Lines that start with # and one
    header line are passed over. The first sample is played at t = 0 whatever its time.

    Parameters
    ----------
    path
        The file.
    scale
        What the second column is multiplied by to give N.

    Raises
    ------
    ModelError
        It cannot be read, a line is not two numbers, time is not uniform (the worst sample is
        named), or as for `Sampled`.
    """
    try:
        text = read_text(Path(path), LARGEST_FILE, "record of a force")
    except FileNotFoundError as error:
        raise ModelError(f"record {path}: cannot be read: {error.strerror}") from error
    except ModelError as error:
        raise ModelError(f"record {error}") from error
    try:
        time, force = _columns(text)
        return Sampled(_uniform_rate(time), scale * force)
    except ModelError as error:
        raise ModelError(f"{error}".replace("record:", f"record {path}:", 1)) from error


def _columns(text: str) -> tuple[FloatArray, FloatArray]:
    rows: list[tuple[float, float]] = []
    header = True
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = SEPARATOR.split(line.strip())
        try:
            rows.append((float(cells[0]), float(cells[1])))
        except (ValueError, IndexError) as error:
            if not header:
                # the file may be anybody's: nothing of it is quoted
                raise ModelError(
                    f"record: line {number} must be two numbers, time (s) and force (N)"
                ) from error
        header = False
    if len(rows) < 2:
        raise ModelError(
            f"record: it has {len(rows)} samples; must be at least 2 lines: time (s), force (N)"
        )
    table = np.array(rows)
    wrong = np.flatnonzero((np.abs(table) > LARGEST).any(axis=1))
    if wrong.size:
        raise ModelError(
            f"record: sample {wrong[0]} is {table[wrong[0], 1]:g} at {table[wrong[0], 0]:g} s; "
            f"must be within ±{LARGEST:g}"
        )
    return table[:, 0], table[:, 1]


def _uniform_rate(time: FloatArray) -> float:
    """The sampling frequency (Hz): a whole number if one agrees with every time, else the mean."""
    wrong = np.flatnonzero(~np.isfinite(time))
    if wrong.size:
        raise ModelError(f"record: the time of sample {wrong[0]} is {time[wrong[0]]}")
    if time[-1] <= time[0]:
        raise ModelError(f"record: time runs from {time[0]:.10g} to {time[-1]:.10g} s; must ascend")
    mean = (len(time) - 1) / (time[-1] - time[0])
    grid = np.arange(len(time))
    for rate in (float(round(mean)), float(mean)):
        if np.abs((time - time[0]) * rate - grid).max() <= UNIFORMITY:
            return rate
    step = np.diff(time)
    usual = float(np.median(step))
    worst = int(np.argmax(np.abs(step - usual)))
    raise ModelError(
        f"record: time is not uniform: sample {worst + 1} is at {time[worst + 1]:.10g} s, "
        f"{step[worst]:.10g} s after the one before, where {usual:.10g} s is usual; resample it"
    )

"""The frequency lines of a comparison."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from fbs import frequency_axis
from fbs.axes import axis_ends

from ..arrays import FloatArray
from ..errors import require_frequencies


@dataclass(frozen=True)
class Band:
    """The frequency lines fmin, fmin + df, … fmax (Hz), or those of a file."""

    fmin: float = 1.0
    fmax: float = 15000.0
    df: float = 1.0
    lines: FloatArray | None = field(default=None, compare=False, repr=False)

    def frequency(self) -> FloatArray:
        """The lines (Hz); refuses limits that are no axis."""
        if self.lines is not None:
            return self.lines
        return frequency_axis(self.fmin, self.fmax, self.df)

    @property
    def count(self) -> float:
        """How many lines there are, without making them; refuses limits that are no axis."""
        if self.lines is not None:
            return float(len(self.lines))
        first, last = axis_ends(self.fmin, self.fmax, self.df)
        return float(last - first) + 1.0

    @classmethod
    def of(cls, lines: FloatArray) -> Band:
        """The band of given lines; df is their mean step (0 for a single line)."""
        first, last = float(lines[0]), float(lines[-1])
        return cls(first, last, (last - first) / max(len(lines) - 1, 1), lines)


# Values a route computes by default: 1 Hz steps to 15 kHz for 57 DoFs, coarser for larger systems.
DEFAULT_VALUES = 5e7

DEFAULT_LINES = 1e6  # 1 Hz steps to 1 MHz, coarser for wider bands


def band(fmin: float | None, fmax: float | None, df: float | None, n_frfs: int = 1) -> Band:
    """A band from what is given of it.

    The step defaults to 1 Hz, or to the first of 2, 5, 10 … Hz at which there are no more than 1e6
    lines, and ``n_frfs`` FRFs are no more than 5e7 values; open ends are the multiples of the step
    within 1 Hz … 15 kHz.

    Raises
    ------
    CommandError, FbsError
        The step or a limit is no number an axis can be made of.
    """
    require_frequencies(fmin=fmin, fmax=fmax, df=df)
    if df is None:
        span = (15000.0 if fmax is None else fmax) - (fmin or 0.0)
        df = _round_step(span / min(DEFAULT_LINES, DEFAULT_VALUES / n_frfs))
    step = float(frequency_axis(0.0, df, df)[1])  # refuses a step that is none
    first = max(math.ceil(1.0 / step), 1)
    if fmin is None:
        fmin = first * step
    if fmax is None:
        fmax = max(math.floor(15000.0 / step), first) * step
    return Band(fmin, fmax, df)


def _round_step(least: float) -> float:
    """The first of 1, 2, 5, 10, 20 … Hz that is at least so much."""
    if least <= 1.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(least))
    return next(step for n in (1.0, 2.0, 5.0, 10.0) if (step := n * decade) >= least)

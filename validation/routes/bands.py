"""The frequency lines of a comparison."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from fbs import SecondOrderSystem, frequency_axis, real_modes
from fbs.axes import axis_ends

from ..arrays import FloatArray
from ..errors import require_frequencies

RESOLVED = 10  # lines from 0 Hz up to a mode: a tenth of its frequency apart
WIDER = 2.0  # times the highest mode that is not resolved
SHOWN = 5


@dataclass(frozen=True)
class Band:
    """The frequency lines fmin, fmin + df, … fmax (Hz), or those of a file.

    ``default`` says which of "fmin" and "df" nobody chose.
    """

    fmin: float = 1.0
    fmax: float = 15000.0
    df: float = 1.0
    lines: FloatArray | None = field(default=None, compare=False, repr=False)
    default: frozenset[str] = field(default=frozenset(), compare=False, repr=False)

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
    default = frozenset(name for name, given in (("fmin", fmin), ("df", df)) if given is None)
    if df is None:
        span = (15000.0 if fmax is None else fmax) - (fmin or 0.0)
        df = _round_step(span / min(DEFAULT_LINES, DEFAULT_VALUES / n_frfs))
    step = float(frequency_axis(0.0, df, df)[1])  # refuses a step that is none
    first = max(math.ceil(1.0 / step), 1)
    if fmin is None:
        fmin = first * step
    if fmax is None:
        fmax = max(math.floor(15000.0 / step), first) * step
    return Band(fmin, fmax, df, default=default)


def elastic_frequencies(system: SecondOrderSystem) -> FloatArray:
    """Natural frequencies (Hz) of the undamped system but its rigid-body modes'."""
    modes = real_modes(system)
    return modes.natural_frequencies[modes.n_rigid :]


def left_out(
    band: Band, frequencies: FloatArray, options: str = "--fmin {0:g} --fmax {1:g} --df {2:g}"
) -> tuple[str, ...]:
    """What a default axis does not show of a model's lowest modes, in a sentence.

    A mode below the first line, or less than `RESOLVED` steps above 0 Hz, has no shape on it.

    Parameters
    ----------
    band
        The lines; what the user chose of them is meant as it is.
    frequencies
        Elastic natural frequencies, Hz.
    options
        How first line, last line and step are asked for.
    """
    least = max(
        band.fmin if "fmin" in band.default else 0.0,
        RESOLVED * band.df if "df" in band.default else 0.0,
    )
    low = np.sort(frequencies[(frequencies > 0.0) & (frequencies < least)])
    if not low.size:
        return ()
    step = _step_below(low[0] / RESOLVED)
    shown = ", ".join(f"{f:.3g}" for f in low[:SHOWN]) + (", …" if low.size > SHOWN else "")
    count, of = low.size, frequencies.size
    modes = f"{count} of its {of} elastic modes {'is' if count == 1 else 'are'}"
    hint = options.format(step, _step_above(WIDER * low[-1]), step)
    return (
        f"{modes} not resolved by the default lines, {band.df:g} Hz apart from {band.fmin:g} Hz "
        f"on: {shown} Hz; {hint} shows what they leave out",
    )


def _step_below(most: float) -> float:
    """The last of 1, 2, 5 times a power of ten that is at most so much."""
    decade = 10.0 ** math.floor(math.log10(most))
    return float(f"{max(n for n in (1.0, 2.0, 5.0) if n * decade <= most) * decade:.6g}")


def _step_above(least: float) -> float:
    return float(f"{1.0 / _step_below(1.0 / least):.6g}")


def _round_step(least: float) -> float:
    """The first of 1, 2, 5, 10, 20 … Hz that is at least so much."""
    if least <= 1.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(least))
    return next(step for n in (1.0, 2.0, 5.0, 10.0) if (step := n * decade) >= least)

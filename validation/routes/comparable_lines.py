"""Which lines of FRFs from a run in time can be compared: not what round-off may have made."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..arrays import BoolArray, FloatArray

# Lines this far below a response's own peak are antiresonances and decayed tails, where the same
# absolute error is any number of dB.
DYNAMIC_RANGE_DB = 80.0
# What differs by round-off alone does so in accelerations as much at one line as at the next: the
# largest of so many lines is what any of them may have. A tenth of 0.1 dB.
NEIGHBOURS, KNOWN_TO = 21, 1e-3
HALF = 0.5  # of an FRF's lines: where fewer are comparable, the verdict is not on the band
NAMED = 3


def within_range(size: FloatArray) -> BoolArray:
    """Where |H| (n_line, …) is within `DYNAMIC_RANGE_DB` of its largest."""
    return np.asarray(size >= size.max(axis=0) * 10.0 ** (-DYNAMIC_RANGE_DB / 20.0))


def known(frequency: FloatArray, size: FloatArray, unknown: FloatArray) -> BoolArray:
    """Where a receptance is known to `KNOWN_TO`.

    Parameters
    ----------
    frequency
        (n_line,) Hz.
    size, unknown
        (n_line, …) |H|, and how much of it may be round-off.
    """
    square = ((2.0 * np.pi * frequency) ** 2).reshape(-1, *(1,) * (size.ndim - 1))
    floor = _largest_nearby(unknown * square) / square
    return np.asarray(floor <= KNOWN_TO * size)


def _largest_nearby(values: FloatArray) -> FloatArray:
    """The largest of the `NEIGHBOURS` lines around each, the line itself among them."""
    half = NEIGHBOURS // 2
    padded = np.pad(values, ((half, NEIGHBOURS - 1 - half), *[(0, 0)] * (values.ndim - 1)), "edge")
    return np.asarray(sliding_window_view(padded, NEIGHBOURS, axis=0).max(axis=-1))


def describe(names: Sequence[str], frequency: FloatArray, compared: BoolArray) -> str:
    """On how many lines a verdict rests, and of which FRFs it leaves out more than half.

    Parameters
    ----------
    names
        Of the FRFs.
    frequency
        (n_line,) Hz.
    compared
        (n_line, n_frf) which lines are comparable.
    """
    summary = f"compared on {int(compared.sum())} of {compared.size} lines ({percent(compared)})"
    if compared.all():
        return "compared on all lines"
    # What moves most rises most towards 0 Hz, so that 80 dB below its peak is soon reached.
    by_share = np.argsort(compared.mean(axis=0), kind="stable")
    few = [int(n) for n in by_share if compared[:, n].mean() < HALF]
    if not few:
        return summary
    places = [_place(names[n], frequency, compared[:, n]) for n in few[:NAMED]]
    more = f" and {len(few) - NAMED} more" if len(few) > NAMED else ""
    return f"{summary}; on less than half of the band at {'; '.join(places)}{more}"


def percent(compared: BoolArray) -> str:
    """The share of lines that are comparable; 100 % only where all are."""
    if compared.all():
        return "100 %"
    share = 100.0 * float(compared.mean())
    return f"{share:.2g} %" if share < 10.0 else f"{min(share, 99.0):.0f} %"


def _place(name: str, frequency: FloatArray, compared: BoolArray) -> str:
    if not compared.any():
        return f"{name} (nowhere)"
    last = frequency[np.flatnonzero(compared)[-1]]
    return f"{name} ({percent(compared)}, none above {last:.4g} Hz)"

"""How much of FRFs from a run in time is judged: lines far below a peak are not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .results import TimeDomain
from .time_domain import DYNAMIC_RANGE_DB

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

HALF = 0.5  # of an FRF's lines: where fewer are judged, the verdict is not on the band
NAMED = 3


def judged(names: Sequence[str], frequency: FloatArray, compared: BoolArray) -> str:
    """On how many lines a verdict rests, and of which FRFs it leaves out more than half.

    Parameters
    ----------
    names
        Of the FRFs.
    frequency
        (n_line,) Hz.
    compared
        (n_line, n_frf) which lines are judged.
    """
    told = f"judged on {int(compared.sum())} of {compared.size} lines ({percent(compared)})"
    if compared.all():
        return "judged on all lines"
    # What moves most rises most towards 0 Hz, so that 80 dB below its peak is soon reached.
    by_share = np.argsort(compared.mean(axis=0), kind="stable")
    few = [int(n) for n in by_share if compared[:, n].mean() < HALF]
    if not few:
        return told
    places = [_place(names[n], frequency, compared[:, n]) for n in few[:NAMED]]
    more = f" and {len(few) - NAMED} more" if len(few) > NAMED else ""
    return f"{told}; on less than half of the band at {'; '.join(places)}{more}"


def judged_in_time(found: TimeDomain) -> str:
    """The same of a cross-check's FRFs from time integration."""
    size = np.abs(found.substructured)
    compared = size >= size.max(axis=0) * 10.0 ** (-DYNAMIC_RANGE_DB / 20.0)
    names = [f"{label} ← {found.excitation}" for label in found.labels]
    return judged(names, found.frequency, compared)


def percent(compared: BoolArray) -> str:
    """The share of lines that is judged; 100 % only where all are."""
    if compared.all():
        return "100 %"
    share = 100.0 * float(compared.mean())
    return f"{share:.2g} %" if share < 10.0 else f"{min(share, 99.0):.0f} %"


def _place(name: str, frequency: FloatArray, compared: BoolArray) -> str:
    if not compared.any():
        return f"{name} (nowhere)"
    last = frequency[np.flatnonzero(compared)[-1]]
    return f"{name} ({percent(compared)}, none above {last:.4g} Hz)"

"""Frequency axes: made, and held against each other."""

from __future__ import annotations

import numpy as np

from ._kernels.checks import FloatArray, scalar
from ._kernels.door import door
from .errors import AxisMismatchError, FbsError


@door
def frequency_axis(fmin: float, fmax: float, df: float) -> FloatArray:
    """Return f_k = k df from fmin to fmax, both included (Hz).

    Every line is an exact multiple of df, rounded once. fmin and fmax must be multiples of df, to
    a relative 1e-9: a smaller difference is the round-off of decimal input, not intent.

    Raises
    ------
    FbsError
        Not finite, df <= 0, fmin < 0, fmax < fmin, or limits that are no multiples of df.
    """
    first, last = axis_ends(fmin, fmax, df)
    steps = np.arange(first, last + 1)
    # dividing by the whole number of lines per Hz rounds once; 0.1 * 3 would round twice
    per_hertz = round(1 / df)
    if per_hertz and abs(per_hertz * df - 1) < 1e-12:
        return np.asarray(steps / per_hertz)
    return np.asarray(steps * df)


def axis_ends(fmin: float, fmax: float, df: float) -> tuple[int, int]:
    """Return the k of the first and the last line of `frequency_axis`, and make no axis.

    Raises
    ------
    FbsError
        As there.
    """
    fmin, fmax, df = scalar(fmin, "fmin"), scalar(fmax, "fmax"), scalar(df, "df")
    if df <= 0:
        raise FbsError(f"df must be positive, got {df:.10g} Hz")
    if fmin < 0 or fmax < fmin:
        raise FbsError(f"need 0 <= fmin <= fmax, got fmin {fmin:.10g} and fmax {fmax:.10g} Hz")
    highest = max(fmax, 1.0)
    if highest / df > 2.0**53:  # k is no longer exact
        raise FbsError(f"df = {df:.10g} Hz is too small for lines up to {highest:.10g} Hz")
    for name, limit in (("fmin", fmin), ("fmax", fmax)):
        if abs(limit / df - round(limit / df)) > 1e-9 * max(1.0, limit / df):
            raise FbsError(f"{name} = {limit:.10g} Hz is no multiple of df = {df:.10g} Hz")
    return round(fmin / df), round(fmax / df)


def require_same_frequency(first: FloatArray, second: FloatArray, what: str) -> None:
    """Refuse two frequency axes that differ, naming the first line that does.

    Raises
    ------
    AxisMismatchError
    """
    if first.size != second.size:
        raise AxisMismatchError(f"{what}: {first.size} lines against {second.size}")
    differing = np.flatnonzero(first != second)
    if differing.size:
        line = int(differing[0])
        raise AxisMismatchError(
            f"{what}: line {line} is {first[line]:.12g} Hz in one and {second[line]:.12g} Hz "
            "in the other"
        )

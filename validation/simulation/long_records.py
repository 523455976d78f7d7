"""Channels of two runs, piece by piece: a record may be longer than memory."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mbs_models.errors import ModelError
from mbs_models.integration.reversal import odd_part

from ..arrays import FloatArray

IndexArray = NDArray[np.int_]

PIECE = 1 << 16  # samples at a time
IN_MEMORY = 1 << 26  # bytes that need no file


def channels(samples: FloatArray, columns: Sequence[int], scratch: Path | None) -> FloatArray:
    """Some columns of a record: itself where they are all, else copied.

    Parameters
    ----------
    samples
        (n, n_channel), may be a memory map.
    columns
        Which.
    scratch
        Where there is room for a large copy, in a file without a name; None: memory.

    Raises
    ------
    ModelError
        There is no room for the file.
    """
    if list(columns) == list(range(samples.shape[1])):
        return samples
    copy = _room((len(samples), len(columns)), scratch)
    for piece in pieces(len(samples)):
        copy[piece] = samples[piece][:, columns]
    return copy


def odd_channels(
    forward: FloatArray, backward: FloatArray, columns: Sequence[int], scratch: Path | None
) -> tuple[FloatArray, float]:
    """(x₊ − x₋)/2 of some columns of two runs, and max|x₊ + x₋| / max|x₊ − x₋|.

    The first is what changes sign with the force, the second how far from linear the motion is.
    Parameters and errors as for `channels`.
    """
    odd = _room((len(forward), len(columns)), scratch)
    even = largest = 0.0
    for piece in pieces(len(forward)):
        one, other = forward[piece][:, columns], backward[piece][:, columns]
        odd[piece] = odd_part(one, other)
        even = max(even, float(np.abs(one + other).max(initial=0.0)))
        largest = max(largest, float(np.abs(one - other).max(initial=0.0)))
    return odd, even / largest if largest else 0.0


def pieces(count: int) -> list[slice]:
    """Slices of ``PIECE`` samples that make up ``count``."""
    return [slice(first, first + PIECE) for first in range(0, count, PIECE)]


def thinned(samples: FloatArray, stretches: int) -> FloatArray:
    """Smallest and largest sample of each of so many stretches, in turn; all, where they are few.

    A drawing of it looks like one of all samples, (n,), and a memory map is read but once.
    """
    if len(samples) <= 2 * stretches:
        return np.asarray(samples)
    starts = _starts(len(samples), stretches)
    low, high = np.minimum.reduceat(samples, starts), np.maximum.reduceat(samples, starts)
    return np.stack([low, high], axis=1).ravel()


def thinned_places(count: int, stretches: int) -> IndexArray:
    """The samples at which `thinned` puts what it keeps."""
    return np.arange(count) if count <= 2 * stretches else np.repeat(_starts(count, stretches), 2)


def _starts(count: int, stretches: int) -> IndexArray:
    return np.linspace(0, count, stretches, endpoint=False, dtype=int)


def _room(shape: tuple[int, int], scratch: Path | None) -> FloatArray:
    """An array to write to; a large one is a file, which the system keeps out of memory."""
    size = 8 * shape[0] * shape[1]
    if scratch is None or size <= IN_MEMORY:
        return np.empty(shape)
    free = shutil.disk_usage(scratch).free
    if size > free:
        raise ModelError(
            f"{scratch}: the channels compared take {size / 2**30:.3g} GiB, {free / 2**30:.3g} "
            "GiB are free"
        )
    with tempfile.TemporaryFile(dir=scratch) as file:
        return np.memmap(file, float, "w+", shape=shape)

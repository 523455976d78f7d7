"""H = sum_t W_t g_t(w) with real weights W_t: real matrix products, tile by tile in the cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import isqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .blocks import SPAN, each, stretches
from .checks import ComplexArray, FloatArray
from .finite import surely_finite

LINES = 128
"""Lines per matrix product: 256 real columns keep BLAS's kernels busy."""

TERMS = 128
"""Terms per matrix product, at most; the others are added in the cache."""

ROWS = 64
"""FRFs per matrix product, a square number: fewer cost more each, more fill the cache."""

TILE = 2**21
"""Bytes of FRFs between the products and the result: they stay in the cache in between."""

GAINS = 2**24
"""Bytes of gains at a time, at most; 1/16 of the result, but 1 MB, where that is less."""


Gains = Callable[[FloatArray, ComplexArray], NDArray[np.bool_]]
"""Writes g_t for omega (n_block, 1, LINES) to (n_block, n_term, LINES); returns which lines lie on
a pole, (n_block, LINES)."""


@dataclass(frozen=True, eq=False)
class WeightedSum:
    """H_ij = sum over t of row(i)[j, t] g_t(w).

    Parameters
    ----------
    shape : (n_response, n_excitation, n_term)
    row : function of i
        Real weights of response i, shape (n_excitation, n_term).
    gains : Gains
    symmetric : bool
        Whether H_ij = H_ji: only j >= i is computed then.
    """

    shape: tuple[int, int, int]
    row: Callable[[int], FloatArray]
    gains: Gains
    symmetric: bool = False

    def __call__(self, omega: FloatArray) -> Summed:
        """Return H, and what was seen of it on the way."""
        n_response, n_excitation, n_terms = self.shape
        values = np.empty((n_response, n_excitation, omega.size), dtype=complex)
        singular = np.zeros(omega.size, dtype=bool)
        tiles = list(self._tiles())
        doubtful: list[list[_Run]] = []
        for lines in stretches(omega.size, _span(n_terms, values.nbytes)):
            gains, singular[lines] = self._gains(omega[lines])
            part = values[:, :, lines]
            fill = partial(self._fill, part, gains, doubtful)
            each(fill, tiles, part.nbytes)
        return Summed(values, singular, not doubtful)

    def _gains(self, omega: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Gains of some lines as pairs of real columns, shape (n_block, n_term, 2 LINES)."""
        n_blocks = -(-omega.size // LINES)
        padded = np.pad(omega, (0, n_blocks * LINES - omega.size), mode="edge")
        blocks = padded.reshape(n_blocks, 1, LINES)
        values = np.empty((n_blocks, self.shape[2], LINES), dtype=complex)
        singular = np.empty((n_blocks, LINES), dtype=bool)

        # on one thread: so short are these loops that two would mostly wait for the interpreter
        for some in stretches(n_blocks, max(1, 256 // max(1, self.shape[2]))):
            singular[some] = self.gains(blocks[some], values[some])
        return values.view(float), singular.ravel()[: omega.size]

    def _tiles(self) -> Iterator[list[_Run]]:
        """Cut the FRFs to compute into lists of runs, each list one matrix product.

        Squares, where there are mirror images: both stand in a few long runs of memory then, whose
        pages are still in the cache, from when the system cleared them, when all is written.
        """
        n_response, n_excitation, _ = self.shape
        width = isqrt(ROWS) if self.symmetric else min(ROWS, max(1, n_excitation))
        for rows in stretches(n_response, ROWS // width):
            for columns in stretches(n_excitation, width):
                runs = [
                    _Run(i, max(columns.start, i if self.symmetric else 0), columns.stop)
                    for i in range(rows.start, rows.stop)
                ]
                tile = [run for run in runs if run.size > 0]
                if tile:
                    yield tile

    def _fill(
        self,
        values: ComplexArray,
        gains: FloatArray,
        doubtful: list[list[_Run]],
        tile: list[_Run],
    ) -> None:
        """Write the FRFs of a tile, and their mirror images; note whether they may be infinite."""
        weights = np.concatenate([self.row(run.i)[run.first : run.last] for run in tile])
        n_lines = values.shape[2]
        step = max(1, TILE // (16 * LINES * len(weights)))
        scratch = np.empty((len(weights), step, 2 * LINES))
        frfs = scratch.reshape(len(weights), -1).view(complex)
        for some in stretches(len(gains), step):
            _multiply(weights, gains[some], scratch.transpose(1, 0, 2)[: some.stop - some.start])
            lines = slice(some.start * LINES, min(n_lines, some.stop * LINES))
            if not surely_finite(frfs[:, : lines.stop - lines.start]):
                doubtful.append(tile)
            at = 0
            for i, first, last in tile:
                part = frfs[at : at + last - first, : lines.stop - lines.start]
                values[i, first:last, lines] = part
                if self.symmetric:
                    values[first:last, i, lines] = part
                at += last - first


class Summed(NamedTuple):
    """H, shape (n_response, n_excitation, nf); which lines lie on a pole; whether H is finite."""

    values: ComplexArray
    singular: NDArray[np.bool_]
    finite: bool


class _Run(NamedTuple):
    """Excitations first to last (not included) of response i."""

    i: int
    first: int
    last: int

    @property
    def size(self) -> int:
        return self.last - self.first


def _multiply(weights: FloatArray, gains: FloatArray, out: FloatArray) -> None:
    np.matmul(weights[:, :TERMS], gains[:, :TERMS], out=out)
    for start in range(TERMS, weights.shape[1], TERMS):
        more = slice(start, start + TERMS)
        out += weights[:, more] @ gains[:, more]


def _span(n_terms: int, nbytes: int) -> int:
    """Lines whose gains are held at once: a multiple of LINES."""
    budget = min(GAINS, max(2**20, nbytes // 16))
    blocks = budget // (16 * LINES * max(1, n_terms))
    return min(SPAN, LINES * max(1, blocks))

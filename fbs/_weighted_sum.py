"""H = sum_t W_t g_t(w) with real weights W_t: real matrix products, tile by tile in the cache."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._blocks import SPAN, each, stretches
from ._checks import ComplexArray, FloatArray

LINES = 64
"""Lines per matrix product: 128 real columns keep BLAS's kernels busy."""

TERMS = 64
"""Terms per matrix product, at most; the others are added in the cache."""

PRODUCT = 2**18
"""m n k of the largest real product that OpenBLAS leaves on the thread that asks for it.

That is 65536 times its GEMM_MULTITHREAD_THRESHOLD of 4. Above it, two threads wait for each other.
"""

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

    def __call__(self, omega: FloatArray) -> tuple[ComplexArray, NDArray[np.bool_]]:
        """Return H, shape (n_response, n_excitation, nf), and which lines lie on a pole."""
        n_response, n_excitation, n_terms = self.shape
        values = np.empty((n_response, n_excitation, omega.size), dtype=complex)
        singular = np.zeros(omega.size, dtype=bool)
        tiles = list(self._tiles())
        for lines in stretches(omega.size, _span(n_terms, values.nbytes)):
            gains, singular[lines] = self._gains(omega[lines])
            part = values[:, :, lines]
            fill = partial(self._fill, part, gains)
            each(fill, tiles, part.nbytes)
        return values, singular

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
        """Cut the FRFs to compute into lists of runs, each list one matrix product."""
        n_response, n_excitation, n_terms = self.shape
        limit = PRODUCT // (2 * LINES * max(1, min(n_terms, TERMS)))
        tile: list[_Run] = []
        free = limit
        for i in range(n_response):
            first = i if self.symmetric else 0
            for columns in stretches(n_excitation - first, limit):
                run = _Run(i, first + columns.start, first + columns.stop)
                if run.size > free:
                    yield tile
                    tile, free = [], limit
                tile.append(run)
                free -= run.size
        if tile:
            yield tile

    def _fill(self, values: ComplexArray, gains: FloatArray, tile: list[_Run]) -> None:
        """Write the FRFs of a tile, and their mirror images."""
        weights = np.concatenate([self.row(run.i)[run.first : run.last] for run in tile])
        n_lines = values.shape[2]
        step = max(1, TILE // (16 * LINES * len(weights)))
        scratch = np.empty((len(weights), step, 2 * LINES))
        frfs = scratch.reshape(len(weights), -1).view(complex)
        for some in stretches(len(gains), step):
            _multiply(weights, gains[some], scratch.transpose(1, 0, 2)[: some.stop - some.start])
            lines = slice(some.start * LINES, min(n_lines, some.stop * LINES))
            at = 0
            for i, first, last in tile:
                part = frfs[at : at + last - first, : lines.stop - lines.start]
                values[i, first:last, lines] = part
                if self.symmetric:
                    values[first:last, i, lines] = part
                at += last - first


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

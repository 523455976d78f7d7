"""The linear equations of a harmonic balance: p + k T Y p = r on a lattice of lines.

T_m is the convolution with κ_m. With two-sided coefficients κ̂ and lines x = Re Σ_h x_h e^{jh·φ}

    (κ x)_h = Σ_g [κ̂_{h−g} x_g + κ̂_{h+g} x̄_g],    half of it at h = 0,

a real matrix between the (Re, Im) of the lines. A spring of period b couples only lines that differ
by multiples of b, or whose sum is one: classes of lines. Springs of one period and one class are a
block; the blocks are inverted, and GMRES with them as preconditioner adds what couples the periods.
With one period the block is the whole balance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._kernels import batched as _batched
from .._kernels.batched_gmres import gmres
from .._kernels.checks import ComplexArray, FloatArray
from .periodic_springs import IntArray, Lattice, PeriodicSpring, series_at

EPS = float(np.finfo(float).eps)
CONVERGED = 1e-12
ALLOWED_RESIDUAL = 1e-10
MAX_STEPS = 60
SUSPECT = 1e8
"""Of |p|/|r|, which is no larger than the condition number: round-off above is looked at."""


@dataclass(frozen=True, eq=False)
class Convolution:
    """x → κ x from some lines to others: P x + Q x̄.

    Parameters
    ----------
    direct, conjugate : complex array, shape (n_spring, n_out, n_in)
        P and Q.
    """

    direct: ComplexArray
    conjugate: ComplexArray

    @classmethod
    def between(
        cls, springs: Sequence[PeriodicSpring], steps: IntArray, out: IntArray, into: IntArray
    ) -> Convolution:
        """From lines ``into`` (n_in, n_phase) to lines ``out``."""
        half = np.where(np.any(out, axis=1), 1.0, 0.5)[:, None]
        sides = []
        for sign in (-1, 1):
            apart = out[:, None] + sign * into
            values = [
                series_at(spring.variation, multiples(apart, step)) * half
                for spring, step in zip(springs, steps, strict=True)
            ]
            sides.append(np.array(values))
        return cls(*sides)

    def __call__(self, lines: ComplexArray) -> ComplexArray:
        """(n_speed, n_spring, n_in) → (n_speed, n_spring, n_out)."""
        by_spring = lines.transpose(1, 2, 0)
        value: ComplexArray = self.direct @ by_spring + self.conjugate @ by_spring.conj()
        return value.transpose(2, 0, 1)

    @property
    def real(self) -> FloatArray:
        """The same on interleaved (Re, Im): (n_spring, 2 n_out, 2 n_in)."""
        plus, minus = self.direct + self.conjugate, self.direct - self.conjugate
        parts = np.array([[plus.real, -minus.imag], [plus.imag, minus.real]])
        n, out, into = plus.shape
        return parts.transpose(2, 3, 0, 4, 1).reshape(n, 2 * out, 2 * into)


def multiples(apart: IntArray, step: IntArray) -> IntArray:
    """l with apart = l step (0 where there is none, or where it is 0)."""
    length = int(step @ step)
    if not length:
        return np.zeros(apart.shape[:-1], dtype=np.int64)
    count = apart @ step // length
    return np.where(np.all(count[..., None] * step == apart, axis=-1), count, 0)


@dataclass(frozen=True, eq=False)
class Block:
    """Springs of one period, and lines they couple.

    Parameters
    ----------
    springs, lines : int arrays
    row : complex array, shape (n_spring, 2 n_line, n_line)
        k (T₀ − j T₁) of the columns (Re, Im).
    """

    springs: IntArray
    lines: IntArray
    row: ComplexArray

    @classmethod
    def of(cls, springs: IntArray, lines: IntArray, real: FloatArray) -> Block:
        """From k T (n_spring, 2 n_line, 2 n_line)."""
        row: ComplexArray = real[..., 0::2] - 1j * real[..., 1::2]
        return cls(springs, lines, row)

    def matrices(self, receptances: ComplexArray) -> FloatArray:
        """I + k T Y (n_speed, n, n), n = n_spring · 2 n_line: [T₀ T₁] [[Re −Im], [Im Re]] Y."""
        y = receptances[:, self.lines][:, :, self.springs][..., self.springs]
        coupled = self.row[None, :, :, None] * y.transpose(0, 2, 3, 1)[:, :, None]
        size = self.row.shape[0] * self.row.shape[1]
        matrices = np.ascontiguousarray(coupled.conj()).view(float).reshape(-1, size, size)
        matrices[:, range(size), range(size)] += 1.0
        return matrices


@dataclass(frozen=True, eq=False)
class Balance:
    """p + k T Y p = r of springs on a lattice, for any receptances Y.

    Parameters
    ----------
    stiffness : array, shape (n_spring,)
    convolution : array, shape (n_spring, 2 n_line, 2 n_line)
        T.
    blocks
        Where it is not zero.
    """

    stiffness: FloatArray
    convolution: FloatArray
    blocks: tuple[Block, ...]

    @classmethod
    def of(cls, springs: Sequence[PeriodicSpring], lattice: Lattice) -> Balance:
        """Of springs on a lattice."""
        stiffness = np.array([spring.stiffness for spring in springs])
        points = lattice.points
        real = Convolution.between(springs, lattice.steps, points, points).real
        varying = [bool(spring.variation.any()) for spring in springs]
        periods = np.unique(lattice.steps[varying], axis=0)
        blocks = []
        for step in periods:
            own = np.flatnonzero(np.all(lattice.steps == step, axis=1) & varying)
            for lines in _classes(points, step):
                both = np.stack([2 * lines, 2 * lines + 1], axis=1).ravel()
                part = stiffness[own, None, None] * real[np.ix_(own, both, both)]
                if part.any():
                    blocks.append(Block.of(own, lines, part))
        return cls(stiffness, real, tuple(blocks))

    def vary(self, lines: ComplexArray) -> ComplexArray:
        """K T x (n_speed, n_spring, n_line)."""
        flat = np.ascontiguousarray(lines).view(float).transpose(1, 0, 2)
        varied = flat @ (self.stiffness[:, None, None] * self.convolution).transpose(0, 2, 1)
        return np.ascontiguousarray(varied.transpose(1, 0, 2)).view(complex)

    def solve(
        self, receptances: ComplexArray, right: ComplexArray
    ) -> tuple[ComplexArray, FloatArray, NDArray[np.bool_]]:
        """Solve for p at every speed.

        Parameters
        ----------
        receptances : complex array, shape (n_speed, n_line, n_spring, n_spring)
        right : complex array, shape (n_speed, n_spring, n_line)
            r, real at the mean.

        Returns
        -------
        excess : complex array, shape (n_speed, n_spring, n_line)
        residual : array, shape (n_speed,)
            |p + k T Y p − r|, of the largest |p|.
        singular : bool array, shape (n_speed,)
        """
        inverses, suspect = self._inverses(receptances)
        scaled = self.stiffness[:, None, None] * self.convolution

        def operator(flat: FloatArray) -> FloatArray:
            p = flat.reshape(right.shape[0], right.shape[1], -1).view(complex)
            along = moved(receptances, p).view(float).transpose(1, 0, 2)
            varied = (along @ scaled.transpose(0, 2, 1)).transpose(1, 0, 2)
            return flat + varied.reshape(flat.shape)

        def preconditioner(flat: FloatArray) -> FloatArray:
            p = flat.reshape(right.shape[0], right.shape[1], -1, 2).copy()
            for block, inverse in zip(self.blocks, inverses, strict=True):
                where = slice(None), block.springs[:, None], block.lines
                part = p[where]
                p[where] = (inverse @ part.reshape(len(p), -1, 1)).reshape(part.shape)
            return p.reshape(flat.shape)

        flat = np.ascontiguousarray(right).view(float).reshape(len(right), -1)
        found = gmres(operator, preconditioner, flat, CONVERGED, MAX_STEPS)
        left = _relative(operator(found) - flat, found)
        suspect |= ~(left <= ALLOWED_RESIDUAL) | (_size(found) > SUSPECT * _size(flat))
        singular = np.zeros_like(suspect)
        for speed in np.flatnonzero(suspect):
            found[speed], left[speed], singular[speed] = self._dense(
                receptances[speed], flat[speed]
            )
        return found.reshape(*right.shape, 2).view(complex)[..., 0], left, singular

    def _inverses(self, receptances: ComplexArray) -> tuple[list[FloatArray], NDArray[np.bool_]]:
        """Of every block, and where one is singular."""
        inverses = []
        lost = np.zeros(len(receptances), dtype=bool)
        for block in self.blocks:
            matrices = block.matrices(receptances)
            inverse, _ = _batched.inverse(matrices)
            lost |= is_singular(matrices, inverse)
            inverses.append(np.nan_to_num(inverse, nan=0.0))
        return inverses, lost

    def _dense(
        self, receptances: ComplexArray, right: FloatArray
    ) -> tuple[FloatArray, float, bool]:
        """One speed, by the whole matrix."""
        n, lines = len(self.stiffness), len(receptances)
        real = self.stiffness[:, None, None] * self.convolution
        every = Block.of(np.arange(n), np.arange(lines), real)
        matrix = every.matrices(receptances[None])
        inverse, _ = _batched.inverse(matrix)
        found = inverse[0] @ right
        left = _relative((matrix[0] @ found - right)[None], found[None])[0]
        return found, float(left), bool(is_singular(matrix, inverse)[0])


def moved(receptances: ComplexArray, forces: ComplexArray) -> ComplexArray:
    """Y p: (n_speed, n_spring, n_line) → the same shape."""
    by_line = receptances @ forces.transpose(0, 2, 1)[..., None]
    return np.ascontiguousarray(by_line[..., 0].transpose(0, 2, 1))


def is_singular(matrices: FloatArray, inverses: FloatArray) -> NDArray[np.bool_]:
    """Whether the condition number (1-norm) leaves no digit of ten."""
    condition = np.abs(matrices).sum(axis=1).max(axis=1) * np.abs(inverses).sum(axis=1).max(axis=1)
    return np.asarray(~(condition <= 1.0 / (10.0 * matrices.shape[-1] * EPS)))


def _relative(left: FloatArray, found: FloatArray) -> FloatArray:
    size = _size(found)
    return np.asarray(_size(left) / np.where(size > 0.0, size, 1.0))


def _size(rows: FloatArray) -> FloatArray:
    return np.asarray(np.abs(rows).max(axis=1))


def _classes(points: IntArray, step: IntArray) -> list[IntArray]:
    """Lines that differ, up to their sign, by multiples of a step."""
    apart = points[:, None] - points, points[:, None] + points
    together = np.any([(multiples(a, step) != 0) | ~np.any(a, axis=-1) for a in apart], axis=0)
    first = np.argmax(together, axis=1)
    return [np.flatnonzero(first == line) for line in np.unique(first)]

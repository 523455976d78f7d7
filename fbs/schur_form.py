"""FRFs from a Schur form: O(n^2) per line and excitation, without eigenvectors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import schur

from ._kernels.blocks import each, stretches
from ._kernels.checks import ComplexArray, FloatArray, ascending_frequency
from ._kernels.door import door
from ._kernels.elimination import EPS
from .damped_modes import state_space
from .errors import undamped_pole
from .frf import Frf, Quantity, as_quantity, computed_frf
from .second_order_system import SecondOrderSystem, SystemOrigin
from .undamped_modes import RealModes

STATES = 8
"""States solved one after the other; what they do to all others is a matrix product."""

LINES = 64
"""Lines per matrix product."""

ROWS = 64
"""Rows per matrix product. OpenBLAS leaves a complex one of up to 2^15 = m n k on the thread that
asks for it (8192 times its GEMM_MULTITHREAD_THRESHOLD of 4); above, threads wait for each other.
"""

CACHE = 2**20
"""Bytes of states solved at once."""


@door
def schur_frf(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
    modes: RealModes | None = None,
) -> Frf:
    """Solve H(s) = (E + R / s) Q (s - T)^-1 Q^H F, with S = Q T Q^H the state matrix.

    T is upper triangular, so that every line costs a back-substitution, and Q unitary: unlike
    eigenvectors it is never ill-conditioned, and critical damping is no special case. (Laub 1981,
    Efficient multivariable frequency response computations, IEEE Trans. Automatic Control 26,
    does it with a Hessenberg form. That is cheaper to find, but each line then has its own factors
    and no matrix product serves many lines.) The states are those of `complex_modes`.

    Parameters
    ----------
    system : SecondOrderSystem
        M symmetric positive definite, K symmetric positive semi-definite, C any.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels, optional
        Default: all of `system.labels`.
    quantity : Quantity
    modes : RealModes, optional
        All of those of the system, if known already.

    Returns
    -------
    Frf
        Frequency-contiguous.

    Raises
    ------
    SingularLineError
        A line on an undamped pole, or 0 Hz of a system free to move there.
    IndefiniteStiffnessError, IndefiniteMassError, UnknownDofError, FbsError
    """
    axis, kind = ascending_frequency(frequency), as_quantity(quantity)
    rows = system.labels if responses is None else tuple(responses)
    columns = system.labels if excitations is None else tuple(excitations)
    # H^T is the FRF of the system with C^T: the fewer right-hand sides the better
    turned = len(rows) < len(columns)
    form = (
        _Form.of(replace(system, damping=system.damping.T), modes, columns, rows)
        if turned
        else _Form.of(system, modes, rows, columns)
    )
    values = np.empty((len(rows), len(columns), axis.size), dtype=complex)
    singular = np.zeros(axis.size, dtype=bool)

    def solve(lines: slice) -> None:
        w = 2 * np.pi * axis[lines]
        found, singular[lines] = form.solve(w)
        order = (0, 1, 2) if turned else (1, 0, 2)
        np.multiply(found.transpose(order), (1j * w) ** kind.derivative, out=values[:, :, lines])

    each(solve, stretches(axis.size, form.lines), 16 * form.force.size * axis.size)
    if singular.any():
        raise undamped_pole(axis[singular])
    origin = SystemOrigin.of(system)
    return computed_frf(axis, values.transpose(2, 0, 1), rows, columns, kind, origin=origin)


@dataclass(frozen=True, eq=False)
class _Form:
    """H(s) = (elastic + rigid / s) (s - triangle)^-1 force + steady / s^2.

    `round_off` is that of the state matrix, which the poles on the diagonal are known to.
    """

    triangle: ComplexArray
    elastic: ComplexArray
    rigid: ComplexArray
    force: ComplexArray
    steady: FloatArray
    round_off: float

    @classmethod
    def of(
        cls,
        system: SecondOrderSystem,
        modes: RealModes | None,
        responses: tuple[str, ...],
        excitations: tuple[str, ...],
    ) -> _Form:
        (i, left), (j, right) = system.locate(responses), system.locate(excitations)
        space = state_space(system, modes)
        triangle, turn = _schur(space.matrix)
        return cls(
            triangle,
            left[:, None] * (space.elastic[i] @ turn),
            left[:, None] * (space.rigid[i] @ turn),
            (turn.conj().T @ space.force[:, j]) * right,
            left[:, None] * (space.steady[i] @ space.steady[j].T) * right,
            16 * len(triangle) * EPS * float(np.linalg.norm(space.matrix)),
        )

    @property
    def lines(self) -> int:
        """Lines solved at once, several products of them."""
        return LINES * max(1, CACHE // (16 * LINES * max(1, self.force.size)))

    def solve(self, w: FloatArray) -> tuple[ComplexArray, NDArray[np.bool_]]:
        """Return H, shape (n_excitation, n_response, nf), and which lines are singular."""
        still = (w == 0) & bool(self.rigid.any() or self.steady.any())
        n_blocks = -(-w.size // LINES)
        padded = np.pad(np.where(still, 1.0, w), (0, n_blocks * LINES - w.size), mode="edge")
        s = 1j * padded.reshape(n_blocks, 1, LINES)
        inverse = s - np.diag(self.triangle)[:, None]
        singular = np.abs(inverse) <= self.round_off
        inverse[singular] = 1.0
        np.reciprocal(inverse, out=inverse)
        states = np.empty((self.force.shape[1], *inverse.shape), dtype=complex)
        states[:] = self.force.T[:, None, :, None]
        _substitute_back(self.triangle, inverse, states)
        values = _product(self.elastic, states)
        if self.rigid.any():
            values += _product(self.rigid, states) / s
        if self.steady.any():
            values += self.steady.T[:, None, :, None] / s**2
        frfs = values.transpose(0, 2, 1, 3).reshape(*values.shape[0:3:2], n_blocks * LINES)
        return frfs[:, :, : w.size], still | singular.any(axis=1).ravel()[: w.size]


def _schur(matrix: NDArray[np.inexact]) -> tuple[ComplexArray, ComplexArray]:
    if not matrix.size:
        return matrix.astype(complex), matrix.astype(complex)
    triangle, turn = schur(matrix, output="complex")
    return triangle, turn


def _substitute_back(triangle: ComplexArray, inverse: ComplexArray, x: ComplexArray) -> None:
    """Solve (s - T) x = b in place; inverse[:, k] = 1 / (s - T_kk); x : (n_right, ..., n, ns)."""
    for start in reversed(range(0, len(triangle), STATES)):
        block = slice(start, min(start + STATES, len(triangle)))
        for k in reversed(range(block.start, block.stop)):
            x[:, :, k] *= inverse[:, k]
            x[:, :, start:k] += triangle[start:k, k, None] * x[:, :, k, None]
        _add_product(triangle[:start, block], x[:, :, block], x[:, :, :start])


def _product(matrix: ComplexArray, x: ComplexArray) -> ComplexArray:
    result = np.zeros((*x.shape[:2], len(matrix), x.shape[3]), dtype=complex)
    for some in stretches(matrix.shape[1], STATES):
        _add_product(matrix[:, some], x[:, :, some], result)
    return result


def _add_product(matrix: ComplexArray, x: ComplexArray, out: ComplexArray) -> None:
    for rows in stretches(len(matrix), ROWS):
        out[:, :, rows] += matrix[rows] @ x

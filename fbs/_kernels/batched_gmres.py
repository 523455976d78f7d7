"""GMRES for many systems of one size at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .checks import FloatArray

Operator = Callable[[FloatArray], FloatArray]
"""(n_system, n) → (n_system, n), every row by its own matrix."""


def gmres(
    operator: Operator, preconditioner: Operator, right: FloatArray, tolerance: float, steps: int
) -> FloatArray:
    """Solve A x = b for every system by GMRES, preconditioned from the right.

    Saad & Schultz 1986, SIAM J. Sci. Stat. Comput. 7, 856–869, with plane rotations that keep R of
    the Hessenberg matrix. All systems go on until the last has converged.

    Parameters
    ----------
    operator, preconditioner
        x → A x and y → P⁻¹ y.
    right : array, shape (n_system, n)
    tolerance
        Of |b − A x|/|b|.
    steps
        At most.

    Returns
    -------
    array, shape (n_system, n)
        Where a system has not converged, what is nearest.
    """
    size = np.linalg.norm(right, axis=1)
    space = _Space([_over(right, size)], [], [], [size])
    for _ in range(steps):
        if np.all(np.abs(space.projected[-1]) <= tolerance * size):
            break
        space.extend(operator(preconditioner(space.basis[-1])))
    return preconditioner(space.nearest()) if space.columns else np.zeros_like(right)


@dataclass
class _Space:
    """Krylov vectors, columns of R, plane rotations (c, s), and Qᵀb; a row for every system."""

    basis: list[FloatArray]
    columns: list[list[FloatArray]]
    rotations: list[tuple[FloatArray, FloatArray]]
    projected: list[FloatArray]

    def extend(self, vector: FloatArray) -> None:
        column = []
        for known in self.basis:
            column.append(np.einsum("kn,kn->k", known, vector))
            vector = vector - column[-1][:, None] * known
        length = np.linalg.norm(vector, axis=1)
        self.basis.append(_over(vector, length))
        for row, (c, s) in enumerate(self.rotations):
            upper, lower = column[row], column[row + 1]
            column[row], column[row + 1] = c * upper + s * lower, c * lower - s * upper
        last = np.hypot(column[-1], length)
        turned = np.where(last > 0.0, last, 1.0)
        c, s = column[-1] / turned, length / turned
        column[-1] = last
        self.columns.append(column)
        self.rotations.append((c, s))
        self.projected[-1:] = [c * self.projected[-1], -s * self.projected[-1]]

    def nearest(self) -> FloatArray:
        """Σ y_i v_i, R y = Qᵀb; a system that broke down has what came before."""
        y: list[FloatArray] = []
        for row in reversed(range(len(self.columns))):
            later = self.columns[row + 1 :]
            left = self.projected[row] - sum(
                (column[row] * own for column, own in zip(later, y, strict=True)),
                start=np.zeros_like(self.projected[row]),
            )
            y.insert(0, _over(left[:, None], self.columns[row][row])[:, 0])
        return np.asarray(sum(own[:, None] * v for own, v in zip(y, self.basis[:-1], strict=True)))


def _over(vector: FloatArray, length: FloatArray) -> FloatArray:
    """Vector / length, zero where the length is."""
    divisor = length[:, None]
    return np.divide(vector, divisor, out=np.zeros_like(vector), where=divisor != 0.0)

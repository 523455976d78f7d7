r"""What a projected model can be wrong by, guaranteed from its residual where damping allows it.

A model on the columns of V, x~ = V y with V^T (f - Z V y) = 0, leaves the residual
rho_j = f_j - Z x~_j, and with symmetric Z, exactly,

    H_ij - H~_ij = rho_i^T Z^-1 rho_j + x~_i^T rho_j,

the last term round-off alone. In the energy A = K + s M, s > 0, a vector with x^H A x = 1 and
theta = x^H K x, in [0, 1], has

    x^H Z x = mu theta - (v/s) (1 - theta)                     C = alpha M + beta K,
    x^H Z x = (1 + j eta) theta - (w^2/s) (1 - theta) + jw c   C otherwise, c >= 0:

a point of the segment from -v/s to mu (from -w^2/s to 1 + j eta, or above it, further from 0). Its
distance d from 0 is what |x^H Z x| is at least, so that || A^(1/2) Z^-1 A^(1/2) || <= 1/d (field of
values; Horn & Johnson 1991, Topics in Matrix Analysis, sec. 1.5), and

    |H_ij - H~_ij| <= ||rho_i|| ||rho_j|| / d + ||x~_i||_A e_j + g |y_i|^T |V|^T |Z| |V| |y_j|,

||rho||^2 = rho^T A^-1 rho*, e_j the rounding of rho_j, and g = (n + 2 r + 8) eps that of V^T Z V
and of the solution, |Z| = |1 + j eta| |K| + w^2 |M| + w |C|: of stiff springs that hardly strain
it is far more than e_j. It holds for any V: Krylov subspaces, Craig and Bampton's, kept modes.
Undamped, the segment runs through 0: which eigenvalues there are decides, a residual cannot say it,
and there is no guarantee (`reduced_frf` estimates; `bounded_frf` knows what modes are left out).

A^-1 rho is not formed: with A = L D L^T and the thin triangle R of D^(-1/2) L^-1 [F, K V, M V, C V]
rho is R times a few coefficients a line, and no digits cancel but its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .._kernels import batched as _batched
from .._kernels.blocks import stretches
from .._kernels.checks import ComplexArray, FloatArray, ascending_frequency, read_only
from .._kernels.elimination import EPS
from ..damped_modes import rayleigh_coefficients
from ..errors import FbsError, IndefiniteStiffnessError, singular_dynamic_stiffness
from ..frf import Frf, require_same_layout
from ..second_order_system import SecondOrderSystem
from .sparse_system import SparseSystem

if TYPE_CHECKING:
    from scipy.sparse import csc_array

NO_ENERGY = "K + s M is not positive definite: no energy to bound by"

BLOCK = 128
"""Lines at once: of 100 vectors 20 MB."""


@dataclass(frozen=True, eq=False)
class GalerkinBound:
    """What `galerkin_bound` returns.

    Parameters
    ----------
    frf : Frf
        Of the projected model.
    bound : array, shape (nf, n_response, n_excitation), m/N
        Of |frf - exact|; infinite where there is none.
    distance : array, shape (nf,)
        d; 0 where there is no bound.
    """

    frf: Frf
    bound: FloatArray
    distance: FloatArray

    def of(self, frf: Frf) -> FloatArray:
        """Bound the error of any other FRF of the same lines and labels."""
        require_same_layout(self.frf, frf)
        return np.asarray(self.bound + np.abs(frf.values - self.frf.values))


def galerkin_bound(
    system: SparseSystem | SecondOrderSystem,
    vectors: ArrayLike,
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
) -> GalerkinBound:
    """Project a system on some vectors, and bound the error of the FRFs.

    Parameters
    ----------
    system : SparseSystem or SecondOrderSystem
        M, C, K symmetric; M positive definite, C and K positive semi-definite.
    vectors : array, shape (n, r)
        Linearly independent columns, as `ReducedFrf.vectors` or `Reduction.basis`.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels

    Raises
    ------
    SingularLineError
        The projected model has a pole on a line.
    IndefiniteStiffnessError
        K + s M is not positive definite.
    UnknownDofError, FbsError
    """
    axis = ascending_frequency(frequency)
    rows, columns = tuple(responses), tuple(excitations)
    sparse = SparseSystem.of(system) if isinstance(system, SecondOrderSystem) else system
    basis = np.array(vectors, dtype=float)
    if basis.ndim != 2 or basis.shape[0] != len(sparse.dofs):
        raise FbsError(
            f"vectors have shape {basis.shape}; {len(sparse.dofs)} DoFs need as many rows"
        )
    projected = _Projected.of(sparse, basis, rows, columns, axis)
    values = np.empty((len(rows), len(columns), axis.size), complex)
    bound, distance = np.empty(values.shape), np.empty(axis.size)
    for lines in stretches(axis.size, BLOCK):
        found = projected.on(axis[lines])
        values[:, :, lines], bound[:, :, lines], distance[lines] = found
    frf = Frf(axis, values.transpose(2, 0, 1), rows, columns)
    return GalerkinBound(frf, read_only(bound.transpose(2, 0, 1)), read_only(distance))


@dataclass(frozen=True, eq=False)
class _Projected:
    """M, C, K and forces on V, and the triangle of the residual.

    Parameters
    ----------
    loss_factor, shift : float
        eta and s.
    coefficients : (alpha, beta) or None
    matrices : array, shape (3, r, r)
        V^T K V, V^T M V, V^T C V.
    moduli : array, shape (3, r, r)
        |V|^T |K| |V|, |V|^T |M| |V|, |V|^T |C| |V|.
    size : int
        n.
    forces : array, shape (r, n_force)
        V^T F, of responses, then excitations.
    triangle : array, shape (m, n_force + 3 r)
        R.
    split : int
        Number of responses.
    """

    loss_factor: float
    shift: float
    coefficients: tuple[float, float] | None
    matrices: FloatArray
    moduli: FloatArray
    size: int
    forces: FloatArray
    triangle: FloatArray
    split: int

    @classmethod
    def of(
        cls,
        system: SparseSystem,
        basis: FloatArray,
        rows: tuple[str, ...],
        columns: tuple[str, ...],
        axis: FloatArray,
    ) -> _Projected:
        (i, row_factor), (j, column_factor) = system.locate(rows), system.locate(columns)
        index, factor = i + j, np.concatenate([row_factor, column_factor])
        force = np.zeros((len(basis), len(index)))
        force[index, range(len(index))] = factor
        shift = float(2 * np.pi * np.sqrt(max(axis[0], axis[-1] / 100) * axis[-1])) ** 2
        full = (system.stiffness, system.mass, system.damping)
        energy = system.stiffness + shift * system.mass
        # unit energy: columns of other lengths would round by the largest in the solution
        squares = np.einsum("ij,ij->j", basis, energy @ basis)
        if not (squares > 0).all():
            raise IndefiniteStiffnessError(NO_ENERGY)
        basis = basis / np.sqrt(squares)
        moved = [np.asarray(matrix @ basis) for matrix in full]
        together = np.hstack([force, *moved])
        scaled = _scaled(energy, together)
        matrices = np.array([basis.T @ each for each in moved])
        return cls(
            system.loss_factor,
            shift,
            _rayleigh(system),
            (matrices + matrices.transpose(0, 2, 1)) / 2,
            np.array([np.abs(basis).T @ (abs(matrix) @ np.abs(basis)) for matrix in full]),
            len(basis),
            basis.T @ force,
            np.linalg.qr(scaled)[1],
            len(rows),
        )

    def on(self, axis: FloatArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return H~ and its bound, shape (n_response, n_excitation, nf), and d."""
        w = 2 * np.pi * axis[:, None, None]
        gains = [np.asarray(gain) for gain in (1 + 1j * self.loss_factor, -(w**2), 1j * w)]
        dynamic = sum(gain * matrix for gain, matrix in zip(gains, self.matrices, strict=True))
        amplitudes, singular = _batched.solve(np.asarray(dynamic), self.forces.astype(complex))
        if singular.any():
            raise singular_dynamic_stiffness(axis[singular])
        n = self.forces.shape[1]
        unit = np.broadcast_to(np.eye(n, dtype=complex), (axis.size, n, n))
        terms = np.concatenate([unit, *(-gain * amplitudes for gain in gains)], axis=1)
        residual = np.linalg.norm(self.triangle @ terms, axis=1)
        rounding = (
            len(terms[0]) * EPS * np.linalg.norm(np.abs(self.triangle) @ np.abs(terms), axis=1)
        )
        energy = self.matrices[0] + self.shift * self.matrices[1]
        size = np.sqrt(np.einsum("fki,kl,fli->fi", amplitudes.conj(), energy, amplitudes).real)
        left, right = slice(0, self.split), slice(self.split, None)
        distance = self._distance(w[:, 0, 0])
        total = residual + rounding
        with np.errstate(divide="ignore", invalid="ignore"):
            share = total[:, left, None] * total[:, None, right] / distance[:, None, None]
        bound = share + size[:, left, None] * 2 * rounding[:, None, right]
        moduli = sum(np.abs(gain) * matrix for gain, matrix in zip(gains, self.moduli, strict=True))
        y = np.abs(amplitudes)
        steps = self.size + 2 * len(self.forces) + 8
        bound += steps * EPS * (y[:, :, left].transpose(0, 2, 1) @ moduli @ y[:, :, right])
        bound[distance <= 0] = np.inf
        values = np.einsum("ki,fkj->ijf", self.forces[:, left], amplitudes[:, :, right])
        return values, bound.transpose(1, 2, 0), distance

    def _distance(self, omega: FloatArray) -> FloatArray:
        """Return the distance of 0 from the segment of the field of values."""
        alpha, beta = self.coefficients or (0.0, 0.0)
        start = -(omega**2 - 1j * omega * alpha) / self.shift
        along = 1 + 1j * (self.loss_factor + omega * beta) - start
        share = (-(start * along.conj()).real / np.abs(along) ** 2).clip(0.0, 1.0)
        # rounding leaves a segment through 0 at eps of its length: none is left then
        found = np.abs(start + share * along)
        return np.where(found > 8 * EPS * np.abs(along), found, 0.0)


def _rayleigh(system: SparseSystem) -> tuple[float, float] | None:
    """Return alpha and beta of a damping that is C = alpha M + beta K; None of another."""
    if not system.damping.nnz:
        return 0.0, 0.0
    mass, damping, stiffness = (
        matrix.toarray() for matrix in (system.mass, system.damping, system.stiffness)
    )
    return rayleigh_coefficients(SecondOrderSystem(mass, damping, stiffness, system.dofs))


def _scaled(energy: csc_array, right: FloatArray) -> FloatArray:
    """Return D^(-1/2) L^-1 P right of P A P^T = L D L^T."""
    from scipy.sparse.linalg import splu, spsolve_triangular

    factors = splu(
        energy.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    diagonal = factors.U.diagonal()
    if not (np.array_equal(factors.perm_r, factors.perm_c) and (diagonal > 0).all()):
        raise IndefiniteStiffnessError(NO_ENERGY)
    permuted = right[np.argsort(factors.perm_r)]
    solved = spsolve_triangular(factors.L.tocsr(), permuted, lower=True, unit_diagonal=True)
    return np.asarray(solved / np.sqrt(diagonal)[:, None])

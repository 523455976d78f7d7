"""Undamped modes with every frequency accurate in its own digits, rigid-body modes exact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ._kernels.blas_threads import blas_for
from ._kernels.checks import FloatArray, read_only, require_type
from ._kernels.door import door
from ._kernels.elimination import EPS
from ._representation import MOST, counted, html_table
from .errors import (
    AxisMismatchError,
    FbsError,
    IndefiniteMassError,
    IndefiniteStiffnessError,
)
from .second_order_system import SecondOrderSystem

SYMMETRY_TOLERANCE = 1e-12
"""Of |A_ij - A_ji| / sqrt(A_ii A_jj): far above assembly round-off, far below any gyroscope."""

Selection = slice | Sequence[int] | Sequence[bool] | NDArray[np.bool_] | NDArray[np.intp]
"""Which modes: a slice, their indices, or a mask with one entry per mode."""


@dataclass(frozen=True, eq=False)
class RealModes:
    """Solutions of K phi = w^2 M phi with phi^T M phi = 1.

    Parameters
    ----------
    angular_frequency : array, shape (n_modes,), rad/s
        Ascending; exactly 0.0 for rigid-body modes.
    shapes : array, shape (n_dof, n_modes), 1/sqrt(kg)
    n_rigid : int
    dofs : tuple of str
    """

    angular_frequency: FloatArray
    shapes: FloatArray
    n_rigid: int
    dofs: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<RealModes: {self._summary}>"

    def _repr_html_(self) -> str:
        found = self.natural_frequencies
        rows = [(f"{k}", f"{f:.6g}") for k, f in enumerate(found[:MOST], start=1)]
        header = ("mode", "natural frequency, Hz")
        return html_table(f"RealModes: {self._summary}", rows, header, max(0, found.size - MOST))

    @property
    def _summary(self) -> str:
        elastic = self.natural_frequencies[self.n_rigid :]
        size = f"{counted(elastic.size + self.n_rigid, 'mode')} of {counted(len(self.dofs), 'DoF')}"
        span = f", elastic {elastic[0]:.6g}–{elastic[-1]:.6g} Hz" if elastic.size else ""
        return f"{size}, {self.n_rigid} rigid-body{span}"

    @property
    def natural_frequencies(self) -> FloatArray:
        """Hz."""
        return self.angular_frequency / (2 * np.pi)

    @door
    def truncated(self, kept: Selection) -> RealModes:
        """Return only the modes `kept` (indices, a slice or a mask), in their order.

        Raises
        ------
        FbsError
            They do not exist, or are named twice.
        """
        count = self.angular_frequency.size
        try:
            positions = np.arange(count)[kept]
        except (IndexError, TypeError, ValueError) as error:
            raise FbsError(f"the selection does not fit {count} modes: {error}") from None
        if positions.ndim != 1 or np.unique(positions).size != positions.size:
            raise FbsError("modes must be named once each: by a slice, indices or a mask")
        return RealModes(
            read_only(self.angular_frequency[positions]),
            read_only(self.shapes[:, positions]),
            int((positions < self.n_rigid).sum()),
            self.dofs,
        )


OWN = 1e-6
"""Of the terms of K phi = w^2 M phi: far above any solver's residual, and of an error that the
`round_off` of the FRFs shows."""


def require_own(system: SecondOrderSystem, modes: RealModes) -> None:
    """Refuse modes that are not those of this system, whatever their labels.

    One combination x = sum_r c_r phi_r of all modes, with fixed random c of equal energy, costs
    n^2 and not n^3: K x = M sum_r w_r^2 c_r phi_r row by row, and x^T M x = sum_r c_r^2. (A row
    that hardly any mode moves is allowed 1e-3 OWN of the largest, scaled by the springs.)

    Raises
    ------
    AxisMismatchError
    """
    require_type(modes, RealModes, "the modes")
    if modes.dofs != system.dofs:
        raise AxisMismatchError("the modes belong to another system: their dofs differ")
    omega = modes.angular_frequency
    if not omega.size:
        return
    typical = float(np.median(omega)) or 1.0
    c = np.random.default_rng(0).uniform(0.5, 1.0, omega.size) / np.maximum(omega, typical)
    x, accelerated = modes.shapes @ c, modes.shapes @ (c * omega**2)
    force, moved = system.stiffness @ x, system.mass @ accelerated
    size = np.abs(system.stiffness) @ (np.abs(modes.shapes) @ c)
    size += np.abs(system.mass) @ (np.abs(modes.shapes) @ (c * omega**2))
    root = np.sqrt(np.where(size > 0, np.abs(np.diag(system.stiffness)) + EPS * size, 1.0))
    allowed = OWN * (size + 1e-3 * root * (size / root).max())
    if (np.abs(force - moved) > allowed).any() or not np.isclose(
        x @ system.mass @ x, c @ c, rtol=OWN
    ):
        raise AxisMismatchError(
            "the modes belong to another system: with this one's matrices they do not solve "
            "K phi = w^2 M phi, phi^T M phi = 1"
        )


@door
def real_modes(system: SecondOrderSystem, rigid_tolerance: float | None = None) -> RealModes:
    """Solve K phi = w^2 M phi as the singular values of G M^(-1/2), K = G^T G.

    `eigh(K, M)` has an error of eps times the largest w^2 in every w^2: a coupling hub of 2e-8 kg
    (7.5 MHz) leaves the lowest modes three digits. Here G is the pivoted Cholesky factor of the
    stiffness scaled to a unit diagonal, whose rank reveals the rigid-body modes, and a one-sided
    Jacobi SVD finds each w to a relative error of eps cond(scaled K) (Demmel & Veselic 1992,
    Jacobi's method is more accurate than QR, SIAM J. Matrix Anal. Appl. 13; LAPACK dgejsv).
    Damping is ignored, the loss factor included.

    Parameters
    ----------
    system : SecondOrderSystem
    rigid_tolerance : float, optional
        Pivots of the scaled stiffness (unit diagonal) up to this are zero: rigid-body motion.
        Default 64 n eps; raise it for a stiffness that is noisy, e.g. differenced numerically.

    Raises
    ------
    IndefiniteMassError, IndefiniteStiffnessError
        Not symmetric, or not positive (semi-)definite.
    """
    with blas_for(len(system.dofs)):
        mass = _mass_factor(system)
        stiffness = stiffness_factor(system, rigid_tolerance)
        omega, elastic = _elastic_modes(stiffness.factor, mass)
        rigid = _mass_orthonormal(stiffness.null_space, system.mass)
        light = _light_coordinates(system, omega, elastic)
    return RealModes(
        read_only(np.concatenate([np.zeros(rigid.shape[1]), omega])),
        read_only(np.hstack([rigid, light])),
        rigid.shape[1],
        system.dofs,
    )


@dataclass(frozen=True, eq=False)
class _MassFactor:
    """M = L L^T with L = diag(root) lower; lower is None for a diagonal mass matrix."""

    root: FloatArray
    lower: FloatArray | None

    def scale_rows(self, matrix: FloatArray) -> FloatArray:
        """Return L^-1 matrix."""
        scaled: FloatArray = matrix / self.root[:, None]
        if self.lower is None:
            return scaled
        return _solve_triangular(self.lower, scaled, lower=True)

    def shapes(self, vectors: FloatArray) -> FloatArray:
        """Return L^-T vectors."""
        if self.lower is not None:
            vectors = _solve_triangular(self.lower, vectors, lower=True, transposed=True)
        return vectors / self.root[:, None]


def _mass_factor(system: SecondOrderSystem) -> _MassFactor:
    diagonal = np.diag(system.mass)
    if (diagonal <= 0).any():
        k = int(np.argmin(diagonal))
        raise IndefiniteMassError(
            f"{system.dofs[k]!r} has mass {diagonal[k]:.6g} kg; modes need every mass positive "
            "(condense or tie a massless DoF, or use direct_frf)"
        )
    root = np.sqrt(diagonal)
    scaled = system.mass / np.outer(root, root)
    where = _asymmetry(scaled)
    if where is not None:
        raise IndefiniteMassError(f"the mass matrix is not symmetric at {_names(system, where)}")
    if not (scaled - np.diag(np.diag(scaled))).any():
        return _MassFactor(root, None)
    try:
        return _MassFactor(root, np.linalg.cholesky((scaled + scaled.T) / 2))
    except np.linalg.LinAlgError:
        lowest = np.linalg.eigvalsh(scaled)[0]
        raise IndefiniteMassError(
            "the mass matrix is not positive definite: scaled to a unit diagonal, its lowest "
            f"eigenvalue is {lowest:.6g}"
        ) from None


@dataclass(frozen=True, eq=False)
class StiffnessFactor:
    """K = G^T G with G = U D: U^T U is K scaled to a unit diagonal, D = diag(root).

    `upper` is U with its columns in the order of the pivots, `order`; its rank is its height.
    """

    upper: FloatArray
    order: NDArray[np.intp]
    root: FloatArray

    @property
    def rank(self) -> int:
        """Number of elastic modes."""
        return len(self.upper)

    @property
    def factor(self) -> FloatArray:
        """G, shape (rank, n)."""
        factor = np.zeros(self.upper.shape)
        factor[:, self.order] = self.upper
        return factor * self.root

    @property
    def null_space(self) -> FloatArray:
        """A basis of K x = 0, shape (n, n - rank)."""
        rank, n = self.upper.shape
        basis = np.zeros((n, n - rank))
        basis[self.order[rank:]] = np.eye(n - rank)
        if 0 < rank < n:
            basis[self.order[:rank]] = -_solve_triangular(
                self.upper[:, :rank], self.upper[:, rank:]
            )
        return basis / self.root[:, None]

    @property
    def flexibility_factor(self) -> FloatArray:
        """T, shape (n, rank): T T^T is the flexibility with the last n - rank pivots held."""
        rank, n = self.upper.shape
        factor = np.zeros((n, rank))
        if rank:
            factor[self.order[:rank]] = _solve_triangular(self.upper[:, :rank], np.eye(rank))
        return factor / self.root[:, None]


def stiffness_factor(
    system: SecondOrderSystem, rigid_tolerance: float | None = None
) -> StiffnessFactor:
    """Factorise K by pivoted Cholesky, see `real_modes`.

    Raises
    ------
    IndefiniteStiffnessError
        Not symmetric, or not positive semi-definite.
    """
    n = len(system.dofs)
    tolerance = 64 * n * EPS if rigid_tolerance is None else rigid_tolerance
    if not 0 < tolerance < 1:
        raise FbsError(f"rigid_tolerance must be between 0 and 1, got {tolerance}")
    diagonal = np.abs(np.diag(system.stiffness))
    root = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = system.stiffness / np.outer(root, root)
    where = _asymmetry(scaled)
    if where is not None:
        raise IndefiniteStiffnessError(
            f"the stiffness matrix is not symmetric at {_names(system, where)}; "
            "real modes need symmetry (use direct_frf)"
        )
    scaled = (scaled + scaled.T) / 2
    upper, pivots, rank, info = lapack.dpstrf(scaled, tol=tolerance)
    if info < 0:
        raise FbsError(f"LAPACK dpstrf failed with info = {info}")
    factor = StiffnessFactor(np.triu(upper)[:rank], np.asarray(pivots) - 1, root)
    # what no pivot took is the last block of K = G^T G + rest: the lowest eigenvalue is not below
    # its own, which is in doubt only if it is not small
    last, held = factor.order[rank:], factor.upper[:, rank:]
    rest = np.abs(scaled[np.ix_(last, last)] - held.T @ held).sum(axis=1)
    if not (rest <= tolerance).all():
        _refuse_indefinite(system, scaled, tolerance)
    return factor


def _refuse_indefinite(system: SecondOrderSystem, scaled: FloatArray, tolerance: float) -> None:
    values, vectors = np.linalg.eigh(scaled)
    if values[0] >= -tolerance:
        return
    k = int(np.argmax(np.abs(vectors[:, 0])))
    raise IndefiniteStiffnessError(
        "the stiffness matrix is not positive semi-definite: scaled to a unit diagonal, it has "
        f"the eigenvalue {values[0]:.6g}, mostly motion of {system.dofs[k]!r}"
    )


def _elastic_modes(factor: FloatArray, mass: _MassFactor) -> tuple[FloatArray, FloatArray]:
    rank, n = factor.shape
    if rank == 0:
        return np.zeros(0), np.zeros((n, 0))
    # joba=2 ('F'): row and column scaling may both be bad, full relative accuracy is kept;
    # jobr=0: no singular value is cut off; jobu=0, jobv=3: left vectors only
    values, vectors, _, work, _, info = lapack.dgejsv(
        mass.scale_rows(factor.T), joba=2, jobu=0, jobv=0, jobr=0
    )
    if info != 0:
        raise FbsError(f"LAPACK dgejsv found no singular values (info = {info})")
    omega = values * (work[0] / work[1])
    ascending = np.argsort(omega)
    return omega[ascending], mass.shapes(vectors)[:, ascending]


def _light_coordinates(
    system: SecondOrderSystem, omega: FloatArray, shapes: FloatArray
) -> FloatArray:
    """Return the shapes, light coordinates as their neighbours move them.

    Vectors are right to eps in M^(1/2) phi, so that a coordinate of mass m is to eps / sqrt(m): a
    hub of 1e-8 kg has four digits less than the shaft it sits on. Its own equation,

        phi_i = -sum_(j != i) (K_ij - w^2 M_ij) phi_j / (K_ii - w^2 M_ii),

    says it by the neighbours' errors, where these make less than a tenth of its own and it stays
    far below its resonance.
    """
    heaviness = np.sqrt(np.diag(system.mass))
    square = omega**2
    own = np.diag(system.stiffness)[:, None] - np.diag(system.mass)[:, None] * square
    far = own > np.diag(system.stiffness)[:, None] / 2
    coupled = system.stiffness - np.diag(np.diag(system.stiffness))
    beside = system.mass - np.diag(np.diag(system.mass))
    error = (np.abs(coupled) @ (1 / heaviness))[:, None] + (np.abs(beside) @ (1 / heaviness))[
        :, None
    ] * square
    better = far & (10 * error * heaviness[:, None] < own)
    moved = -(coupled @ shapes - (beside @ shapes) * square)
    return np.divide(moved, own, out=shapes.copy(), where=better)


def _mass_orthonormal(basis: FloatArray, mass: FloatArray) -> FloatArray:
    """Orthonormalise by combining columns only, so that K phi = 0 stays true row by row."""
    for _ in range(2 if basis.shape[1] else 0):  # the second pass removes the first's round-off
        norms = np.sqrt(np.einsum("ik,ij,jk->k", basis, mass, basis))
        basis = basis / norms
        lower = np.linalg.cholesky(basis.T @ mass @ basis)
        basis = _solve_triangular(lower, basis.T, lower=True).T
    return basis


def _solve_triangular(
    matrix: NDArray[Any], right: FloatArray, lower: bool = False, transposed: bool = False
) -> FloatArray:
    """Solve for at least one column; a sixth of the time of SciPy's function for small matrices."""
    solution, info = lapack.dtrtrs(matrix, right, lower=lower, trans=transposed)
    if info != 0:
        raise FbsError(f"LAPACK dtrtrs failed with info = {info}")
    return np.asarray(solution)


def _asymmetry(scaled: FloatArray) -> tuple[int, int] | None:
    """Return where a matrix of unit diagonal is least symmetric, if it is not symmetric."""
    difference = np.abs(scaled - scaled.T)
    i, j = np.unravel_index(int(np.argmax(difference)), difference.shape)
    # off-diagonal entries beyond 1 are no part of a definite matrix: judge those by themselves
    limit = SYMMETRY_TOLERANCE * max(1.0, abs(scaled[i, j]))
    return (int(i), int(j)) if difference[i, j] > limit else None


def _names(system: SecondOrderSystem, where: tuple[int, int]) -> str:
    return f"({system.dofs[where[0]]!r}, {system.dofs[where[1]]!r})"

"""Large second-order systems, M, C and K sparse; FRFs by sparse factorisation line by line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels.checks import FloatArray, square_matrix
from .._kernels.door import door
from .._kernels.elimination import EPS, Enclosure
from .._systems import LabelledSystem, Target
from ..errors import FbsError, NonFiniteError, singular_dynamic_stiffness
from ..frf import Frf, Quantity
from ..second_order_system import SecondOrderSystem, differentiated

if TYPE_CHECKING:
    from scipy.sparse import csc_array


@dataclass(frozen=True, eq=False, repr=False)
class SparseSystem(LabelledSystem):
    """M x'' + C x' + K (1 + j eta) x = f: a `SecondOrderSystem` whose matrices are sparse.

    Parameters
    ----------
    mass, damping, stiffness : scipy.sparse array or matrix, or dense array, shape (n, n)
        kg, N s/m, N/m; kept as csc_array.
    dofs, derived, loss_factor
        As in `SecondOrderSystem`.

    Raises
    ------
    FbsError, NonFiniteError, AmbiguousDofError, UnknownDofError
    """

    mass: csc_array
    damping: csc_array
    stiffness: csc_array

    @staticmethod
    def _matrix(matrix: Any, size: int, name: str) -> csc_array:
        return _sparse_matrix(matrix, size, name)

    @classmethod
    @door
    def of(cls, system: SecondOrderSystem) -> SparseSystem:
        """Return a dense system as a sparse one; zeros are dropped."""
        return cls(
            system.mass,
            system.damping,
            system.stiffness,
            system.dofs,
            system.derived,
            system.loss_factor,
        )

    @property
    def undamped(self) -> bool:
        """Whether C = 0 and eta = 0."""
        return not (self.damping.nnz or self.loss_factor)


def _sparse_matrix(matrix: Any, size: int, name: str) -> csc_array:
    from scipy.sparse import csc_array, issparse

    if not issparse(matrix):
        matrix = square_matrix(matrix, size, name)
    elif np.iscomplexobj(matrix):
        raise FbsError(f"the {name} matrix must be real; damping has a matrix of its own")
    result = csc_array(matrix, dtype=float, copy=True)
    if result.shape != (size, size):
        raise FbsError(f"the {name} matrix has shape {result.shape}, {size} DoFs need {size, size}")
    result.sum_duplicates()
    result.eliminate_zeros()
    if not np.isfinite(result.data).all():
        entries = result.tocoo()
        k = int(np.flatnonzero(~np.isfinite(entries.data))[0])
        row, column = (int(index[k]) for index in entries.coords)
        raise NonFiniteError(f"the {name} matrix holds {entries.data[k]} at {row, column}")
    for array in (result.data, result.indices, result.indptr):
        array.setflags(write=False)
    return result


@door
def sparse_frf(
    system: SparseSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
) -> Frf:
    """Solve H(w) = (K (1 + j eta) - w^2 M + jwC)^-1 by sparse LU, as `direct_frf` does densely.

    The fill-reducing order is found once and serves every line; only the columns asked for are
    solved (or the rows, where they are fewer), in real arithmetic where the system is undamped.

    Parameters
    ----------
    system : SparseSystem
    frequency : array, shape (nf,), Hz
    responses, excitations : labels, optional
        Default: all of `system.labels`; the result is dense.
    quantity : Quantity

    Raises
    ------
    SingularLineError
        On a line where the dynamic stiffness is singular to working precision.
    UnknownDofError, FbsError
    """
    target = Target.of(system, frequency, responses, excitations, quantity)
    axis, i, j = target.axis, target.rows, target.columns
    transposed = len(set(i)) < len(set(j))
    solved, kept = (i, j) if transposed else (j, i)
    unique = list(dict.fromkeys(solved))
    place = [unique.index(k) for k in solved]
    solver = DynamicStiffness.of(system)
    values = np.empty((len(i), len(j), axis.size), dtype=complex)
    singular = np.zeros(axis.size, dtype=bool)
    for line, omega in enumerate(2 * np.pi * axis):
        solution = solver.solve(omega, unique, transposed)
        if solution is None:
            singular[line] = True
            continue
        part = solution[np.ix_(kept, place)]
        values[:, :, line] = part.T if transposed else part
    if singular.any():
        raise singular_dynamic_stiffness(axis[singular])
    return target.frf(values, _SparseOrigin(system, {label: label for label in system.labels}))


@dataclass(frozen=True, eq=False)
class _SparseOrigin:
    """The origin of a sparse system's FRFs; `labels` : the system's own behind each.

    With the columns X of Z^-1 and its rows W, R = I - Z X and D the error of Z and of the products,
    |dH| <= 2 |W| (|R| + D |X|): the first-order term of `eliminate`, twice. That the rest is no
    larger is not proved here, which would need all of Z^-1; lines where it could be are singular.
    """

    system: SparseSystem
    labels: Mapping[str, str]

    def renamed(self, names: Mapping[str, str]) -> _SparseOrigin:
        gone = {*names, *names.values()}
        kept = {label: own for label, own in self.labels.items() if label not in gone}
        fresh = {new: self.labels[old] for old, new in names.items() if old in self.labels}
        return _SparseOrigin(self.system, kept | fresh)

    def enclose(self, frf: Frf) -> Enclosure:
        (i, left), (j, right) = (
            self.system.locate([self.labels[label] for label in some])
            for some in (frf.responses, frf.excitations)
        )
        system, solver = self.system, DynamicStiffness.of(self.system)
        absolute = [abs(matrix) for matrix in (system.mass, system.damping, system.stiffness)]
        stiffness = system.stiffness * (1 + 1j * system.loss_factor)
        gamma = (10 + np.diff(stiffness.tocsr().indptr).max(initial=0)) * EPS
        values = np.full(frf.values.shape, np.nan, dtype=complex)
        bound = np.full(frf.values.shape, np.inf)
        unit = np.zeros((len(system.dofs), len(j)))
        unit[j, range(len(j))] = 1.0
        for line, w in enumerate(frf.omega):
            x, rows = solver.solve(w, j), solver.solve(w, i, True)
            if x is None or rows is None:
                continue
            z = stiffness - w**2 * system.mass + 1j * w * system.damping
            size = (1 + system.loss_factor) * absolute[2] + w**2 * absolute[0] + w * absolute[1]
            off = np.abs(unit - z @ x) + gamma * (size @ np.abs(x) + unit)
            factor = np.outer(left, right)
            values[line] = factor * x[i]
            bound[line] = np.abs(factor) * (2 * (np.abs(rows).T @ off))
        return differentiated(Enclosure(values, bound), frf.omega, frf.quantity.derivative)


@dataclass(frozen=True, eq=False)
class DynamicStiffness:
    """Z(w) of a sparse system, its columns in one fill-reducing order, ready to be factorised.

    Parameters
    ----------
    mass, damping, stiffness : array, shape (nnz,)
        Values on the common pattern.
    indices, indptr : array of int
        That pattern, permuted symmetrically.
    place : array of int, shape (n,)
        Where each coordinate comes in it.
    diagonals : array, shape (3, n)
        |M_ii|, |C_ii|, |K_ii|.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: NDArray[Any]
    indices: NDArray[np.intc]
    indptr: NDArray[np.intc]
    place: NDArray[np.intp]
    diagonals: FloatArray

    @classmethod
    def of(cls, system: SparseSystem) -> DynamicStiffness:
        """Merge the patterns and order them."""
        matrices = (system.mass, system.damping, system.stiffness)
        order = _fill_reducing_order(matrices)
        permuted = [matrix[order][:, order].tocoo() for matrix in matrices]
        n = len(system.dofs)
        keys = [part.coords[1].astype(np.int64) * n + part.coords[0] for part in permuted]
        pattern = np.unique(np.concatenate(keys))  # column by column
        data = np.zeros((3, pattern.size))
        for row, key, part in zip(data, keys, permuted, strict=True):
            row[np.searchsorted(pattern, key)] = part.data
        indptr = np.searchsorted(pattern, np.arange(n + 1) * n)
        factor = 1 + 1j * system.loss_factor if system.loss_factor else 1.0
        return cls(
            data[0],
            data[1],
            data[2] * factor,
            (pattern % n).astype(np.intc),
            indptr.astype(np.intc),
            order.argsort(),
            np.abs([matrix.diagonal() for matrix in matrices]),
        )

    def solve(
        self, omega: float, columns: list[int], transposed: bool = False
    ) -> NDArray[Any] | None:
        """Return columns of Z^-1 (of Z^-T), shape (n, n_columns); None where Z is singular.

        Singular is what `direct_frf` calls so: the equilibrated inverse exceeds 1 / (10 n eps).
        """
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        data: NDArray[Any] = self.stiffness - omega**2 * self.mass
        if self.damping.any():
            data = data + 1j * (omega * self.damping)
        n = len(self.place)
        matrix = csc_array((data, self.indices, self.indptr), shape=(n, n))
        try:
            factors = splu(matrix, permc_spec="NATURAL")
        except RuntimeError:  # SuperLU: the factor is exactly singular
            return None
        right = np.zeros((n, len(columns)), dtype=data.dtype)
        right[self.place[columns], range(len(columns))] = 1.0
        solution: NDArray[Any] = factors.solve(right, trans="T" if transposed else "N")[self.place]
        mass, damping, stiffness = self.diagonals
        root = np.sqrt(stiffness + omega**2 * mass + omega * damping)
        peak = (np.abs(solution) * root[:, None]).max(axis=0) * root[columns]
        return solution if peak.max(initial=0.0) <= 1 / (10 * n * np.finfo(float).eps) else None


def _fill_reducing_order(matrices: Iterable[csc_array]) -> NDArray[np.intp]:
    """Return the order SuperLU's minimum degree finds for |M| + |C| + |K|, made dominant.

    The values do not matter for it, only the pattern.
    """
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import splu

    pattern = sum(abs(matrix) for matrix in matrices)
    pattern.data[:] = 1.0
    n = pattern.shape[0]
    dominant = (pattern + (n + 1.0) * eye_array(n)).tocsc()
    factors = splu(dominant, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return np.asarray(np.argsort(factors.perm_c), dtype=np.intp)

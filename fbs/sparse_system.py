"""Large second-order systems, M, C and K sparse; FRFs by sparse factorisation line by line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import FloatArray, ascending_frequency, positions, unique_labels
from .errors import FbsError, NonFiniteError, SingularLineError
from .frf import Frf, Quantity, as_quantity
from .second_order_system import SecondOrderSystem, _derived, _loss_factor, _scale

if TYPE_CHECKING:
    from scipy.sparse import csc_array


@dataclass(frozen=True, eq=False)
class SparseSystem:
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
    dofs: tuple[str, ...]
    derived: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        dofs = unique_labels(self.dofs, "the dofs")
        if not dofs:
            raise FbsError("a system needs at least one degree of freedom")
        for name in ("mass", "damping", "stiffness"):
            matrix = _sparse_matrix(getattr(self, name), len(dofs), name)
            object.__setattr__(self, name, matrix)
        object.__setattr__(self, "dofs", dofs)
        object.__setattr__(self, "derived", MappingProxyType(_derived(self.derived, dofs)))
        object.__setattr__(self, "loss_factor", _loss_factor(self.loss_factor))
        unique_labels(self.labels, "dofs and derived labels")

    def __reduce__(self) -> tuple[type[SparseSystem], tuple[Any, ...]]:
        # a mapping proxy cannot be pickled, and systems travel between processes
        return type(self), (
            self.mass,
            self.damping,
            self.stiffness,
            self.dofs,
            dict(self.derived),
            self.loss_factor,
        )

    @classmethod
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
    def labels(self) -> tuple[str, ...]:
        """Everything that can be asked for: the dofs, then the derived labels."""
        return self.dofs + tuple(self.derived)

    @property
    def undamped(self) -> bool:
        """Whether C = 0 and eta = 0."""
        return not (self.damping.nnz or self.loss_factor)

    def locate(self, labels: Iterable[str] | None = None) -> tuple[list[int], FloatArray]:
        """Return, for each label (None: all), its coordinate's index and its factor on it.

        Raises
        ------
        UnknownDofError
        """
        wanted = self.labels if labels is None else tuple(labels)
        positions(wanted, self.labels, "the system")
        pairs = [self.derived.get(label, (label, 1.0)) for label in wanted]
        index = {dof: i for i, dof in enumerate(self.dofs)}
        return [index[dof] for dof, _ in pairs], np.array([factor for _, factor in pairs])


def _sparse_matrix(matrix: Any, size: int, name: str) -> csc_array:
    from scipy.sparse import csc_array

    if np.iscomplexobj(matrix):
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
    axis = ascending_frequency(frequency)
    rows = system.labels if responses is None else tuple(responses)
    columns = system.labels if excitations is None else tuple(excitations)
    i, row_factor = system.locate(rows)
    j, column_factor = system.locate(columns)
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
        raise singular_lines(axis[singular])
    _scale(values, row_factor, column_factor, axis, as_quantity(quantity))
    return Frf(axis, values.transpose(2, 0, 1), rows, columns, as_quantity(quantity))


def singular_lines(frequencies: FloatArray) -> SingularLineError:
    """Return the error that names the lines without a finite FRF."""
    return SingularLineError(
        frequencies,
        "the dynamic stiffness K (1 + j eta) - w^2 M + jwC is singular to working precision",
        "these lines lie on undamped poles, or on 0 Hz of a system free to move: "
        "leave them out, shift the axis or add damping",
    )


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
        return solution if peak.max() <= 1 / (10 * n * np.finfo(float).eps) else None


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

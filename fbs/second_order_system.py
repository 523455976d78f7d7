"""Linear second-order systems M x'' + C x' + K (1 + j eta) x = f; FRFs solved line by line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels import batched as _batched
from ._kernels.blocks import each, stretches
from ._kernels.checks import FloatArray, square_matrix
from ._kernels.door import door
from ._kernels.elimination import EPS, Blocks, Enclosure, eliminate
from ._systems import LabelledSystem, Target
from .errors import FbsError, singular_dynamic_stiffness
from .frf import Frf, Quantity

BLOCK = 64
"""Lines solved at once: 64 matrices of 30 DoFs are 0.9 MB, which stays in a core's cache."""


@dataclass(frozen=True, eq=False, repr=False)
class SecondOrderSystem(LabelledSystem):
    """M x'' + C x' + K (1 + j eta) x = f for e^{+jwt} (Ewins 2000, Modal Testing, ch. 2).

    The matrices need not be symmetric: row = response (equation), column = coordinate.

    Parameters
    ----------
    mass, damping, stiffness : array, shape (n, n)
        kg, N s/m, N/m.
    dofs : tuple of str
        Labels of the n coordinates.
    derived : mapping of str to (str, float)
        Further labels x_label = factor * x_dof, such as a hub fixed rigidly to a shaft of another
        radius. A force there acts on the coordinate times the factor: H_out = L H L^T.
    loss_factor : float
        eta of structural (hysteretic) damping, the same in every spring. It describes steady
        vibration at w >= 0 and has no equation of motion in time.

    Raises
    ------
    FbsError, NonFiniteError, AmbiguousDofError, UnknownDofError
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray

    if TYPE_CHECKING:  # what `__post_init__` converts, said to type checkers

        def __init__(
            self,
            mass: ArrayLike,
            damping: ArrayLike,
            stiffness: ArrayLike,
            dofs: Iterable[str],
            derived: Mapping[str, tuple[str, float]] = ...,
            loss_factor: float = 0.0,
        ) -> None: ...

    @staticmethod
    def _matrix(matrix: ArrayLike, size: int, name: str) -> FloatArray:
        return square_matrix(matrix, size, name)

    @property
    def undamped(self) -> bool:
        """Whether C = 0 and eta = 0."""
        return not (self.damping.any() or self.loss_factor)


@door
def direct_frf(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
    block: int = BLOCK,
) -> Frf:
    """Solve H(w) = (K (1 + j eta) - w^2 M + jwC)^-1 at every line; the paper, Eq. (16).

    Only the columns asked for are solved (or the rows, through the transpose, where they are
    fewer), in real arithmetic where the system is undamped, `block` lines at a time.

    Parameters
    ----------
    system : SecondOrderSystem
    frequency : array, shape (nf,), Hz
    responses, excitations : labels, optional
        Default: all of `system.labels`.
    quantity : Quantity
    block : int
        Lines per batch, on one core; the result does not depend on it.

    Returns
    -------
    Frf
        Frequency-contiguous.

    Raises
    ------
    SingularLineError
        On a line where the dynamic stiffness is singular to working precision: an undamped
        pole, or a system free to move at 0 Hz.
    UnknownDofError, FbsError
    """
    target = Target.of(system, frequency, responses, excitations, quantity)
    axis, i, j = target.axis, target.rows, target.columns
    if block < 1:
        raise FbsError(f"block must be at least 1 line, got {block}")
    transposed = len(set(i)) < len(set(j))
    solver = _LineSolver.of(system, j if not transposed else i, transposed)
    place = {column: k for k, column in enumerate(solver.columns)}
    rows_of, columns_of = (j, [place[k] for k in i]) if transposed else (i, [place[k] for k in j])
    order = (2, 1, 0) if transposed else (1, 2, 0)
    values = np.empty((len(i), len(j), axis.size), dtype=complex)
    singular = np.zeros(axis.size, dtype=bool)

    def solve(lines: slice) -> None:
        solution, singular[lines] = solver.solve(2 * np.pi * axis[lines])
        values[:, :, lines] = solution[:, rows_of][:, :, columns_of].transpose(order)

    each(solve, stretches(axis.size, block), 16 * len(system.dofs) ** 2 * axis.size)
    if singular.any():
        raise singular_dynamic_stiffness(axis[singular])
    return target.frf(values, SystemOrigin.of(system))


@dataclass(frozen=True, eq=False)
class _LineSolver:
    """Columns of (K (1 + j eta) - w^2 M + jwC)^-1 for batches of lines."""

    mass: FloatArray
    damping: FloatArray | None
    stiffness: NDArray[Any]
    columns: tuple[int, ...]

    @classmethod
    def of(cls, system: SecondOrderSystem, columns: list[int], transposed: bool) -> _LineSolver:
        turn = np.transpose if transposed else np.asarray
        damping = turn(system.damping) if system.damping.any() else None
        factor = 1 + 1j * system.loss_factor if system.loss_factor else 1.0
        stiffness = turn(system.stiffness) * factor
        return cls(turn(system.mass), damping, stiffness, tuple(dict.fromkeys(columns)))

    def solve(self, omega: FloatArray) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        w = omega[:, None, None]
        matrices: NDArray[Any] = self.stiffness - w**2 * self.mass
        if self.damping is not None:
            matrices = matrices + 1j * (w * self.damping)
        n = len(self.stiffness)
        right = np.eye(n, dtype=matrices.dtype)[:, self.columns]
        solution, singular = _batched.solve(matrices, right)
        return solution, singular | self._is_round_off(omega, solution)

    def _is_round_off(self, omega: FloatArray, solution: NDArray[Any]) -> NDArray[np.bool_]:
        """Whether the equilibrated inverse exceeds 1 / (10 n eps), so that no digit is left.

        Scaled by d_i = |K_ii| + w^2 |M_ii| + w |C_ii|, the dynamic stiffness has entries of
        order one whatever the units, and |x_ij| sqrt(d_i d_j) is its inverse.
        """
        w = omega[:, None]
        size = np.abs(np.diag(self.stiffness)) + w**2 * np.abs(np.diag(self.mass))
        if self.damping is not None:
            size = size + w * np.abs(np.diag(self.damping))
        root = np.sqrt(size)
        peak = np.zeros(len(omega))
        for k, column in enumerate(self.columns):
            # |re| + |im| is within sqrt(2) of the modulus and much cheaper
            part = solution[:, :, k]
            modulus = np.abs(part.real)
            if np.iscomplexobj(part):
                modulus = modulus + np.abs(part.imag)
            np.maximum(peak, (modulus * root).max(axis=1) * root[:, column], out=peak)
        limit = 1 / (10 * len(self.stiffness) * np.finfo(float).eps)
        return np.asarray(~(peak <= limit))  # NaN counts as singular


@dataclass(frozen=True, eq=False)
class SystemOrigin:
    """The origin of FRFs that are those of a system, however they were computed.

    Parameters
    ----------
    system : SecondOrderSystem
    labels : mapping of str to (int, float)
        Coordinate and factor behind each label.
    """

    system: SecondOrderSystem
    labels: Mapping[str, tuple[int, float]]

    @classmethod
    def of(cls, system: SecondOrderSystem) -> SystemOrigin:
        """Return the origin under the system's own labels."""
        where, factor = system.locate()
        places = zip(where, factor.tolist(), strict=True)
        return cls(system, dict(zip(system.labels, places, strict=True)))

    def renamed(self, names: Mapping[str, str]) -> SystemOrigin:
        """Return the origin with labels replaced."""
        gone = {*names, *names.values()}
        kept = {label: place for label, place in self.labels.items() if label not in gone}
        fresh = {new: self.labels[old] for old, new in names.items() if old in self.labels}
        return SystemOrigin(self.system, kept | fresh)

    def ports(self, labels: Iterable[str]) -> FloatArray:
        """Return L with x_label = L x, shape (n_label, n_dof)."""
        places = [self.labels[label] for label in labels]
        rows = np.zeros((len(places), len(self.system.dofs)))
        for row, (coordinate, factor) in zip(rows, places, strict=True):
            row[coordinate] = factor
        return rows

    def dynamic_stiffness(self, omega: FloatArray) -> tuple[NDArray[Any], FloatArray]:
        """Return Z, shape (nk, n, n), and the error of its entries.

        That is 6 eps (|K| + w^2 |M| + w |C|): half a unit in the last place of each entry, w^2 of
        a rounded w (2 pi f: relative 2 eps), the products' and the sums'.
        """
        system, w = self.system, omega[:, None, None]
        stiffness = system.stiffness * (1 + 1j * system.loss_factor if system.loss_factor else 1.0)
        z: NDArray[Any] = stiffness - w**2 * system.mass
        size = np.abs(stiffness) + w**2 * np.abs(system.mass)
        if system.damping.any():
            z = z + 1j * (w * system.damping)
            size = size + w * np.abs(system.damping)
        return z, np.asarray(6 * EPS * size)

    def enclose(self, frf: Frf) -> Enclosure:
        """Solve directly with a bound."""
        found = self.receptances(frf.omega, frf.responses, frf.excitations)
        return differentiated(found, frf.omega, frf.quantity.derivative)

    def receptances(
        self, omega: FloatArray, responses: tuple[str, ...], excitations: tuple[str, ...]
    ) -> Enclosure:
        """Return L Z^-1 R, (nf, n_response, n_excitation): `eliminate` of [[0, -L], [R, Z]]."""
        left, right = self.ports(responses), self.ports(excitations).T
        values = np.empty((omega.size, len(responses), len(excitations)), dtype=complex)
        bound = np.empty(values.shape)

        def solve(lines: slice) -> None:
            z, error = self.dynamic_stiffness(omega[lines])
            nothing = np.zeros((1, *values.shape[1:]))
            a = Blocks(nothing, -left[None], right[None], z)
            exact = Blocks(nothing, np.zeros_like(a.ms), np.zeros_like(a.sm), error)
            values[lines], bound[lines] = eliminate(a, exact)

        each(solve, stretches(omega.size, BLOCK), values.nbytes)
        return Enclosure(values, bound)


def differentiated(found: Enclosure, omega: FloatArray, order: int) -> Enclosure:
    """Return the enclosure of H (jw)^order."""
    if not order:
        return found
    factor = omega[:, None, None] ** float(order)
    values = found.values * (1j**order * factor)
    return Enclosure(values, found.bound * factor + 8 * EPS * np.abs(values))

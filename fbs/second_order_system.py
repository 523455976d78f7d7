"""Linear second-order systems M x'' + C x' + K (1 + j eta) x = f; FRFs solved line by line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _batched
from ._blocks import each, stretches
from ._checks import (
    FloatArray,
    ascending_frequency,
    positions,
    read_only,
    square_matrix,
    unique_labels,
)
from .errors import FbsError, NonFiniteError, SingularLineError, unknown_dof
from .frf import Frf, Quantity, as_quantity

BLOCK = 64
"""Lines solved at once: 64 matrices of 30 DoFs are 0.9 MB, which stays in a core's cache."""


@dataclass(frozen=True, eq=False)
class SecondOrderSystem:
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
    dofs: tuple[str, ...]
    derived: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        dofs = unique_labels(self.dofs, "the dofs")
        if not dofs:
            raise FbsError("a system needs at least one degree of freedom")
        for name in ("mass", "damping", "stiffness"):
            matrix = square_matrix(getattr(self, name), len(dofs), name)
            object.__setattr__(self, name, read_only(matrix))
        object.__setattr__(self, "dofs", dofs)
        object.__setattr__(self, "derived", MappingProxyType(_derived(self.derived, dofs)))
        object.__setattr__(self, "loss_factor", _loss_factor(self.loss_factor))
        unique_labels(self.labels, "dofs and derived labels")

    def __reduce__(self) -> tuple[type[SecondOrderSystem], tuple[Any, ...]]:
        # a mapping proxy cannot be pickled, and systems travel between processes
        return type(self), (
            self.mass,
            self.damping,
            self.stiffness,
            self.dofs,
            dict(self.derived),
            self.loss_factor,
        )

    @property
    def labels(self) -> tuple[str, ...]:
        """Everything that can be asked for: the dofs, then the derived labels."""
        return self.dofs + tuple(self.derived)

    @property
    def undamped(self) -> bool:
        """Whether C = 0 and eta = 0."""
        return not (self.damping.any() or self.loss_factor)

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


def _loss_factor(value: float) -> float:
    factor = float(value)
    if not np.isfinite(factor):
        raise NonFiniteError(f"the loss factor is {factor}")
    if factor < 0:
        raise FbsError(f"the loss factor must not be negative, got {factor:.10g}")
    return factor


def _derived(
    derived: Mapping[str, tuple[str, float]], dofs: tuple[str, ...]
) -> dict[str, tuple[str, float]]:
    result = {}
    for label, (dof, factor) in derived.items():
        if dof not in dofs:
            raise unknown_dof(dof, dofs, f"derived label {label!r}: the system")
        if not np.isfinite(factor) or factor == 0:
            raise FbsError(f"derived label {label!r} needs a finite factor, not 0; got {factor}")
        result[label] = (dof, float(factor))
    return result


def direct_frf(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
    block: int = BLOCK,
) -> Frf:
    """Solve H(w) = (K (1 + j eta) - w^2 M + jwC)^-1 at every line; seed paper, Eq. (16).

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
    axis = ascending_frequency(frequency)
    rows = system.labels if responses is None else tuple(responses)
    columns = system.labels if excitations is None else tuple(excitations)
    i, row_factor = system.locate(rows)
    j, column_factor = system.locate(columns)
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
        raise SingularLineError(
            axis[singular],
            "the dynamic stiffness K (1 + j eta) - w^2 M + jwC is singular to working precision",
            "these lines lie on undamped poles, or on 0 Hz of a system free to move: "
            "leave them out, shift the axis or add damping",
        )
    _scale(values, row_factor, column_factor, axis, as_quantity(quantity))
    return Frf(axis, values.transpose(2, 0, 1), rows, columns, as_quantity(quantity))


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


def _scale(
    values: NDArray[np.complex128],
    row_factor: FloatArray,
    column_factor: FloatArray,
    axis: FloatArray,
    quantity: Quantity,
) -> None:
    """Multiply (n_response, n_excitation, nf) by the derived factors and by (jw)^n, in place."""
    factor = np.outer(row_factor, column_factor)
    if (factor != 1).any():
        values *= factor[:, :, None]
    if quantity.derivative:
        values *= (2j * np.pi * axis) ** quantity.derivative

"""What joins two substructures: rigid and flexible joints, of one DoF or several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.checks import ComplexArray, FloatArray, ascending_frequency, frozen, numbers, scalar
from .errors import FbsError, JointError, NonFiniteError

Node = tuple[str, str]
Law = Callable[[FloatArray], ArrayLike]
"""Of frequencies (nf,), Hz, to dynamic stiffnesses (nf,) or (nf, n, n), N/m."""


@dataclass(frozen=True, eq=False)
class StiffnessTable:
    """Dynamic stiffness over frequency as measured, between its lines a straight line.

    Parameters
    ----------
    frequency : array, shape (nf,), Hz
    values : complex array, shape (nf,) or (nf, n, n), N/m
        Damping and loss are in the imaginary part.

    Raises
    ------
    FbsError, NonFiniteError
    """

    frequency: FloatArray
    values: ComplexArray

    if TYPE_CHECKING:  # what `__post_init__` converts, said to type checkers

        def __init__(self, frequency: ArrayLike, values: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        axis = ascending_frequency(self.frequency)
        values = frozen(numbers(self.values, "a stiffness table", complex))
        if values.ndim not in (1, 3) or len(values) != axis.size:
            raise FbsError(
                f"a stiffness table of {axis.size} lines has values of shape {values.shape}"
            )
        if not np.isfinite(values).all():
            raise NonFiniteError("a stiffness table holds NaN or infinity")
        object.__setattr__(self, "frequency", axis)
        object.__setattr__(self, "values", values)

    def __call__(self, frequency: FloatArray) -> ComplexArray:
        """Interpolate; never beyond the ends.

        Raises
        ------
        FbsError
        """
        axis = self.frequency
        # 2 pi f / 2 pi rounds: a line on the end of the table is in it
        at = np.where(np.isclose(frequency, axis[-1], rtol=1e-14, atol=0.0), axis[-1], frequency)
        at = np.where(np.isclose(at, axis[0], rtol=1e-14, atol=0.0), axis[0], at)
        outside = (at < axis[0]) | (at > axis[-1])
        if outside.any():
            raise FbsError(
                f"its stiffness table is of {axis[0]:g} to {axis[-1]:g} Hz and says nothing of "
                f"{at[outside][0]:.10g} Hz"
            )
        right = np.clip(np.searchsorted(axis, at), min(1, axis.size - 1), axis.size - 1)
        left = np.maximum(right - 1, 0)
        step = np.where(right > left, axis[right] - axis[left], 1.0)
        share = ((at - axis[left]) / step).reshape(-1, *[1] * (self.values.ndim - 1))
        return np.asarray(self.values[left] * (1 - share) + self.values[right] * share)


@dataclass(frozen=True)
class Joint:
    """f = Z (n u_second - u_first), Z = k + jwc, acting on `first`; k = None: u_first = n u_second.

    Parameters
    ----------
    first, second : (substructure name, DoF label)
    stiffness : float, complex, function or None
        N/m; None is a rigid joint. May be negative (a stiffness taken away), complex (hysteretic:
        k (1 + j eta)), or vary with frequency: a function of it (Hz, (nf,)), or a `StiffnessTable`.
    damping : float
        N s/m, of a flexible joint.
    ratio : float
        n, where the two coordinates are not measured alike: on other radii, or against each other.

    Raises
    ------
    JointError
        Neither stiffness nor damping, not finite, or both ends the same.
    """

    first: Node
    second: Node
    stiffness: float | complex | Law | None = None
    damping: float = 0.0
    ratio: float = 1.0

    def __post_init__(self) -> None:
        _require_ends(self, self.first, self.second)
        for name in ("ratio", "damping"):
            object.__setattr__(self, name, _number(self, getattr(self, name), f"the {name}"))
        if not (self.rigid or callable(self.stiffness)):
            object.__setattr__(self, "stiffness", _complex(self, self.stiffness))
        if self.ratio == 0:
            raise JointError(f"{self}: the ratio must be finite and not 0, got {self.ratio}")
        if self.rigid:
            if self.damping != 0:
                raise JointError(f"{self}: a rigid joint (stiffness None) takes no damping")
        elif self.stiffness == 0 and self.damping == 0:
            raise JointError(f"{self}: no stiffness and no damping joins nothing; leave it out")

    @property
    def rigid(self) -> bool:
        """Whether both ends move as one."""
        return self.stiffness is None

    @property
    def spring(self) -> tuple[float, float]:
        """k and c (N/m, N s/m) of a flexible joint that is a spring and a damper.

        Raises
        ------
        JointError
            It is rigid, complex or varies with frequency.
        """
        if self.stiffness is None or callable(self.stiffness) or np.iscomplexobj(self.stiffness):
            raise JointError(f"{self} is no spring and damper")
        return float(self.stiffness), self.damping  # type: ignore[arg-type]  # complex is out

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return Z, shape (nf,), N/m; a rigid joint has none.

        Raises
        ------
        JointError
        """
        if self.stiffness is None:
            raise JointError(f"{self} is rigid")
        if not callable(self.stiffness):
            return np.asarray(self.stiffness + 1j * omega * self.damping)
        return _at(self, self.stiffness, omega, ()) + 1j * omega * self.damping

    def __str__(self) -> str:
        return f"joint {_end(self.first)} - {_end(self.second)}"


@dataclass(frozen=True, eq=False)
class MatrixJoint:
    """f = Z (n u_second - u_first), Z = K + jwC of several DoFs, acting on `first`.

    A bushing or a bearing whose directions are coupled. Z need be neither symmetric nor regular.

    Parameters
    ----------
    first, second : sequence of (substructure name, DoF label)
        As many on either side.
    stiffness : real or complex array, shape (n, n), or function
        N/m; or a function of frequency (Hz, (nf,)) to (nf, n, n), such as a `StiffnessTable`.
    damping : array, shape (n, n), optional
        N s/m.
    ratio : float
        n, as in `Joint`.

    Raises
    ------
    JointError
        A side, a shape or a number does not fit.
    """

    first: Sequence[Node]
    second: Sequence[Node]
    stiffness: ArrayLike | Law
    damping: ArrayLike | None = None
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            given = getattr(self, name)
            if not isinstance(given, list | tuple):
                raise JointError(
                    f"a matrix joint's sides are lists of (substructure, DoF label), got {given!r}"
                )
            object.__setattr__(self, name, tuple(given))
        if not self.first or len(self.first) != len(self.second):
            raise JointError(
                f"a matrix joint needs as many DoFs on either side, got {len(self.first)} and "
                f"{len(self.second)}"
            )
        for first, second in zip(self.first, self.second, strict=True):
            _require_ends(self, first, second)
        object.__setattr__(self, "ratio", _number(self, self.ratio, "the ratio"))
        if self.ratio == 0:
            raise JointError(f"{self}: the ratio must not be 0")
        if not callable(self.stiffness):
            object.__setattr__(self, "stiffness", self._matrix(self.stiffness, "stiffness"))
        if self.damping is not None:
            object.__setattr__(self, "damping", self._matrix(self.damping, "damping"))

    def _matrix(self, given: ArrayLike, name: str) -> ComplexArray:
        try:
            matrix = frozen(numbers(given, f"the {name} matrix", complex))
        except FbsError as error:
            raise JointError(f"{self}: {error}") from None
        n = len(self.first)
        if matrix.shape != (n, n):
            raise JointError(
                f"{self}: the {name} matrix has shape {matrix.shape}, {n, n} is needed"
            )
        if not np.isfinite(matrix).all():
            raise JointError(f"{self}: the {name} matrix holds NaN or infinity")
        return matrix

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return Z, shape (nf, n, n), N/m.

        Raises
        ------
        JointError
        """
        n, w = len(self.first), omega[:, None, None]
        damping = 0.0 if self.damping is None else 1j * w * np.asarray(self.damping)
        if callable(self.stiffness):
            return np.asarray(_at(self, self.stiffness, omega, (n, n)) + damping)
        constant = np.asarray(self.stiffness, dtype=complex)
        return np.asarray(constant + damping + np.zeros(w.shape))

    def __str__(self) -> str:
        return f"matrix joint {_end(self.first[0])} - {_end(self.second[0])}, …"


@dataclass(frozen=True, eq=False)
class _Row(Joint):
    """A row of B of a `MatrixJoint`: one of its DoFs, with the diagonal entry of Z."""

    matrix: MatrixJoint | None = None
    row: int = 0


AnyJoint = Joint | MatrixJoint


def _end(node: Node) -> str:
    """An end in words; a label that begins with its substructure's name says it once."""
    name, label = node
    return label if label.startswith(f"{name}.") else f"{name}.{label}"


def rows_of(joints: Sequence[AnyJoint]) -> tuple[Joint, ...]:
    """Return one joint for each row of B: matrix joints DoF by DoF, those of one consecutively."""
    return tuple(row for joint in joints for row in _rows(joint))


def _rows(joint: AnyJoint) -> Iterator[Joint]:
    if isinstance(joint, Joint):
        yield joint
        return
    for row, (first, second) in enumerate(zip(joint.first, joint.second, strict=True)):
        yield _Row(first, second, _entry(joint, row), 0.0, joint.ratio, joint, row)


def _entry(joint: MatrixJoint, row: int) -> Law:
    def law(frequency: FloatArray) -> ComplexArray:
        return joint.dynamic_stiffness(2 * np.pi * frequency)[:, row, row]

    return law


def matrix_rows(joints: Sequence[Joint]) -> list[tuple[MatrixJoint, list[int]]]:
    """Return the matrix joints among rows of B, each with where its rows stand."""
    found: dict[int, tuple[MatrixJoint, list[int]]] = {}
    for k, joint in enumerate(joints):
        if isinstance(joint, _Row) and joint.matrix is not None:
            found.setdefault(id(joint.matrix), (joint.matrix, []))[1].append(k)
    return list(found.values())


@dataclass(frozen=True, eq=False)
class Flexible:
    """Z of all flexible joints at some lines, as U diag(z) W^H in groups of rows.

    A joint of one DoF is its own group, with U = W = 1. Of a matrix joint they are its singular
    vectors and values, line by line: along them the joint is a set of springs, and where one has
    no stiffness z = 0.

    Parameters
    ----------
    values : mapping of int to array, shape (nf,)
        z by row of B; a rigid joint has none.
    groups : list of (rows, U, W), arrays of shape (n, n, nf)
    """

    values: Mapping[int, ComplexArray]
    groups: list[tuple[list[int], ComplexArray, ComplexArray]]

    @classmethod
    def of(cls, joints: Sequence[Joint], omega: FloatArray, factor: Any = 1.0) -> Flexible:
        """Z / factor of rows of B."""
        matrices = matrix_rows(joints)
        grouped = {k for _, rows in matrices for k in rows}
        values = {
            k: joint.dynamic_stiffness(omega) / factor
            for k, joint in enumerate(joints)
            if not joint.rigid and k not in grouped
        }
        groups = []
        for matrix, rows in matrices:
            z = (matrix.dynamic_stiffness(omega).transpose(1, 2, 0) / factor).transpose(2, 0, 1)
            u, sigma, w = np.linalg.svd(z)
            values |= {k: sigma[:, n].astype(complex) for n, k in enumerate(rows)}
            groups.append((rows, u.transpose(1, 2, 0), w.conj().transpose(2, 1, 0)))
        return cls(values, groups)

    def of_part(self, joints: Sequence[int]) -> Flexible:
        """Return the same with rows counted among some joints, those of a part."""
        groups = [
            ([joints.index(k) for k in rows], u, w)
            for rows, u, w in self.groups
            if rows[0] in joints
        ]
        return Flexible(self.values, groups)

    def to_springs(self, square: NDArray[Any], moduli: bool = False) -> NDArray[Any]:
        """Return W^H A U of A (n_joint, n_joint, nf), moduli: of the factors' moduli."""
        return self.right(self.left(square, moduli), moduli)

    def from_springs(self, square: ComplexArray) -> ComplexArray:
        """Return U A W^H."""
        for rows, u, w in self.groups:
            square = square.copy()
            square[rows] = np.einsum("ikf,kjf->ijf", u, square[rows])
            square[:, rows] = np.einsum("ikf,jkf->ijf", square[:, rows], w.conj())
        return square

    def left(self, array: NDArray[Any], moduli: bool = False) -> NDArray[Any]:
        """Return W^H A on the rows of matrix joints."""
        for rows, _, w in self.groups:
            array = array.copy()
            factor = np.abs(w) if moduli else w.conj()
            array[rows] = np.einsum("kif,kjf->ijf", factor, array[rows])
        return array

    def right(self, array: NDArray[Any], moduli: bool = False) -> NDArray[Any]:
        """Return A U on the columns of matrix joints."""
        for rows, u, _ in self.groups:
            array = array.copy()
            factor = np.abs(u) if moduli else u
            array[:, rows] = np.einsum("ikf,kjf->ijf", array[:, rows], factor)
        return array


def ends_of(name: str, joints: Sequence[Joint]) -> list[tuple[int, str, float]]:
    """Return (joint, label, entry of B) of a substructure: +1 first, -ratio second."""
    return [
        (k, label, sign)
        for k, joint in enumerate(joints)
        for (owner, label), sign in ((joint.first, 1.0), (joint.second, -joint.ratio))
        if owner == name
    ]


def _require_ends(joint: AnyJoint, first: Node, second: Node) -> None:
    for end in (first, second):
        if not (isinstance(end, tuple) and len(end) == 2 and all(isinstance(e, str) for e in end)):
            raise JointError(f"a joint's end is (substructure, DoF label), got {end!r}")
    if first == second:
        raise JointError(f"{joint}: both ends are the same")


def _number(joint: AnyJoint, value: Any, what: str) -> float:
    try:
        return scalar(value, what)
    except FbsError as error:
        raise JointError(f"{joint}: {error}; a stiffness of None is rigid") from None


def _complex(joint: Joint, value: Any) -> float | complex:
    if not isinstance(value, complex | np.complexfloating):
        return _number(joint, value, "the stiffness")
    if not np.isfinite(value):
        raise JointError(f"{joint}: the stiffness must be finite, got {value}")
    return complex(value)


def _at(joint: AnyJoint, law: Law, omega: FloatArray, shape: tuple[int, ...]) -> ComplexArray:
    """Ask a law for its stiffness on all lines."""
    try:
        values = numbers(law(omega / (2 * np.pi)), "its stiffness", complex)
    except FbsError as error:
        raise JointError(f"{joint}: {error}") from None
    if values.shape not in ((omega.size, *shape), shape):
        raise JointError(
            f"{joint}: its stiffness of {omega.size} lines has shape {values.shape}; "
            f"{(omega.size, *shape)} is needed"
        )
    if not np.isfinite(values).all():
        raise JointError(f"{joint}: its stiffness is not finite at some lines")
    return np.broadcast_to(values, (omega.size, *shape))

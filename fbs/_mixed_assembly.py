"""Coupling with a bound on its error, and with the digits that receptances lose.

A free light part has a receptance of 1 / (w^2 m), known to eps of it. Held by a stiff one it moves
by many powers of ten less, and Y - Y B^T (...) B Y keeps no digit of that. Its dynamic stiffness
keeps all of them: the other side holds it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._assembly import owners
from ._kernels.blocks import each, stretches
from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.elimination import EPS, Blocks, Enclosure, eliminate
from .frf import Frf, Quantity
from .joints import Joint, ends_of, matrix_rows
from .second_order_system import SystemOrigin, differentiated

BLOCK = 64
"""Lines at once, as in `direct_frf`."""

HELD = 1e-5
"""Where joints leave a part less than this of its receptance at one of them, five digits would be
lost: it is coupled by its dynamic stiffness. (More would be rare antiresonances, which lose none
that count, at a cost.)"""

Part = Frf | SystemOrigin


@dataclass(frozen=True, eq=False)
class MixedAssembly:
    """Parts and joints: the origin of their coupled FRFs.

    With the receptances Y of most parts and the dynamic stiffness Z_h of those `held`, the joint
    forces l and the motions x_h of all coordinates of the held parts satisfy

        [B Y B^T + 1/Z  -B_h] [l  ]   [B Y f]
        [B_h^T           Z_h] [x_h] = [f_h  ],    u = Y f - Y B^T l.

    Without held parts this is `couple`. Every FRF is a Schur complement of that matrix bordered by
    Y f and Y B^T, so that `eliminate` bounds its error from those of Y and Z_h. A relative error
    of Z_h then counts by how far the part is strained in the assembly, x_h^T dZ_h x_h, and no
    longer by how far it would fly off alone.

    Parameters
    ----------
    frequency : array, shape (nf,), Hz
    parts : mapping of str to Frf or SystemOrigin
        FRFs on these lines, of any quantity; systems are solved when they are needed.
    joints : tuple of Joint
    held : mapping of str to bool array, shape (nf,)
        On which lines a part is held; for parts that come from a system.
    """

    frequency: FloatArray
    parts: Mapping[str, Part]
    joints: tuple[Joint, ...]
    held: Mapping[str, NDArray[np.bool_]]

    def renamed(self, names: Mapping[str, str]) -> MixedAssembly:
        """Return the assembly with labels replaced, in its parts and at its joints."""

        def at(end: tuple[str, str]) -> tuple[str, str]:
            return end[0], names.get(end[1], end[1])

        parts = {
            name: part.renamed({old: new for old, new in names.items() if old in _labels(part)})
            for name, part in self.parts.items()
        }
        joints = [replace(j, first=at(j.first), second=at(j.second)) for j in self.joints]
        return replace(self, parts=parts, joints=tuple(joints))

    def enclose(self, frf: Frf) -> Enclosure:
        """Couple again with a bound, from the parts' bounds."""
        found = self.receptances(frf.frequency, frf.responses, frf.excitations, True)
        return differentiated(found, frf.omega, frf.quantity.derivative)

    def receptances(
        self,
        frequency: FloatArray,
        responses: Sequence[str],
        excitations: Sequence[str],
        bounded_parts: bool,
    ) -> Enclosure:
        """Return receptances of the assembly, (nf, n_response, n_excitation), on some of its lines.

        `bounded_parts` : whether to ask the parts for their `round_off`, which costs a direct
        solution of each; else they are taken at their word, to their last digit.
        """
        at = np.searchsorted(self.frequency, frequency)
        values = np.empty((at.size, len(responses), len(excitations)), dtype=complex)
        bound = np.empty(values.shape)
        pattern = np.array([self.held[name][at] for name in self.parts])
        for column in np.unique(pattern, axis=1).T:  # lines that hold the same parts
            held = frozenset(name for name, yes in zip(self.parts, column, strict=True) if yes)
            some = np.flatnonzero((pattern == column[:, None]).all(axis=0))
            equations = _Equations.of(
                self, held, self.frequency[at[some]], responses, excitations, bounded_parts
            )

            def solve(
                lines: slice, equations: _Equations = equations, some: NDArray[np.intp] = some
            ) -> None:
                found = eliminate(*equations.blocks(lines))
                values[some[lines]], bound[some[lines]] = found

            each(solve, stretches(some.size, BLOCK), 16 * some.size * values[0].size)
        return Enclosure(values, bound)


def _labels(part: Part) -> tuple[str, ...]:
    if isinstance(part, SystemOrigin):
        return tuple(part.labels)
    return tuple(dict.fromkeys(part.responses + part.excitations))


def _sides(part: Part) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return responses and excitations."""
    if isinstance(part, SystemOrigin):
        return tuple(part.labels), tuple(part.labels)
    return part.responses, part.excitations


@dataclass(frozen=True, eq=False)
class _Given:
    """A part by its receptances: what is asked for and B Y are left Y right, known to `error`.

    Parameters
    ----------
    values, error : arrays, shape (nf, n_row, n_column)
    left : array, shape (n_response + n_joint, n_row)
    right : array, shape (n_column, n_excitation + n_joint)
    """

    values: ComplexArray
    error: FloatArray
    left: FloatArray
    right: FloatArray


@dataclass(frozen=True, eq=False)
class _Held:
    """A part by its dynamic stiffness.

    Parameters
    ----------
    origin : SystemOrigin
    left : array, shape (n_response + n_joint, n)
        The motions asked for, and B_h.
    right : array, shape (n, n_excitation + n_joint)
    """

    origin: SystemOrigin
    left: FloatArray
    right: FloatArray


@dataclass(frozen=True, eq=False)
class _Equations:
    """The matrix of `MixedAssembly`, ready to be written down for any lines."""

    omega: FloatArray
    shape: tuple[int, int]
    joints: tuple[Joint, ...]
    given: list[_Given]
    held: list[_Held]

    @classmethod
    def of(
        cls,
        assembly: MixedAssembly,
        held: frozenset[str],
        frequency: FloatArray,
        responses: Sequence[str],
        excitations: Sequence[str],
        bounded_parts: bool,
    ) -> _Equations:
        sides = {name: _sides(part) for name, part in assembly.parts.items()}
        row_owners = owners({name: side[0] for name, side in sides.items()})
        column_owners = owners({name: side[1] for name, side in sides.items()})
        equations = cls(
            2 * np.pi * frequency, (len(responses), len(excitations)), assembly.joints, [], []
        )
        for name, part in assembly.parts.items():
            ends = ends_of(name, assembly.joints)
            asked = [label for label in responses if row_owners[label][0] == name]
            driven = [label for label in excitations if column_owners[label][0] == name]
            rows = tuple(dict.fromkeys([*asked, *(label for _, label, _ in ends)]))
            columns = tuple(dict.fromkeys([*driven, *(label for _, label, _ in ends)]))
            if not (rows and columns):
                continue
            places = [(responses.index(label), rows.index(label), 1.0) for label in asked]
            places += [(len(responses) + k, rows.index(label), sign) for k, label, sign in ends]
            left = _entries((len(responses) + len(assembly.joints), len(rows)), places)
            places = [(excitations.index(label), columns.index(label), 1.0) for label in driven]
            places += [
                (len(excitations) + k, columns.index(label), sign) for k, label, sign in ends
            ]
            right = _entries((len(excitations) + len(assembly.joints), len(columns)), places).T
            if name in held:
                origin = part if isinstance(part, SystemOrigin) else part._origin
                assert isinstance(origin, SystemOrigin)
                left, right = left @ origin.ports(rows), origin.ports(columns).T @ right
                equations.held.append(_Held(origin, left, right))
                continue
            if isinstance(part, SystemOrigin):
                found = part.receptances(equations.omega, rows, columns)
            else:
                frf = part.select(rows, columns).at_lines(frequency).to(Quantity.RECEPTANCE)
                error = frf.round_off if bounded_parts else EPS * np.abs(frf.values)
                found = Enclosure(frf.values, error)
            equations.given.append(_Given(*found, left, right))
        return equations

    def blocks(self, lines: slice) -> tuple[Blocks, Blocks]:
        """Return the bordered matrix on some lines, and what its entries are known to.

        Rows of flexible joints are multiplied by Z, which may be zero (a damper at 0 Hz).
        """
        r, e = self.shape
        n_joint, omega = len(self.joints), self.omega[lines]
        size = n_joint + sum(part.left.shape[1] for part in self.held)
        whole = np.zeros((omega.size, r + size, e + size), dtype=complex)
        error = np.zeros(whole.shape)
        for given in self.given:
            y = given.values[lines]
            known = given.error[lines] + 4 * EPS * np.abs(y)
            whole[:, : r + n_joint, : e + n_joint] += given.left @ y @ given.right
            with np.errstate(invalid="ignore"):  # no bound of the part: none of the assembly
                known = np.abs(given.left) @ known @ np.abs(given.right)
            error[:, : r + n_joint, : e + n_joint] += known
        at = n_joint
        for part in self.held:
            z, z_error = part.origin.dynamic_stiffness(omega)
            rows, columns = (slice(own + at, own + at + z.shape[1]) for own in (r, e))
            whole[:, rows, columns], error[:, rows, columns] = z, z_error
            whole[:, rows, : e + n_joint] = part.right
            whole[:, : r + n_joint, columns] = -part.left
            at += z.shape[1]
        matrices = matrix_rows(self.joints)
        for matrix, own in matrices:
            _weigh(whole, error, matrix.dynamic_stiffness(omega), [r + k for k in own])
        grouped = {k for _, own in matrices for k in own}
        for k, joint in enumerate(self.joints):
            if not joint.rigid:
                if k not in grouped:
                    stiffness = joint.dynamic_stiffness(omega)[:, None]
                    whole[:, r + k] *= stiffness
                    error[:, r + k] *= np.abs(stiffness)
                whole[:, r + k, e + k] += 1.0
        error += 6 * EPS * np.abs(whole)
        return _bordered(whole, r, e), _bordered(error, r, e)


def _weigh(
    whole: ComplexArray, error: FloatArray, stiffness: ComplexArray, rows: list[int]
) -> None:
    """Multiply rows by a matrix Z; a sum of n products rounds by (n + 5) eps of their moduli."""
    moduli = np.abs(stiffness)
    rounding = (len(rows) + 5) * EPS * np.abs(whole[:, rows])
    error[:, rows] = moduli @ (error[:, rows] + rounding)
    whole[:, rows] = stiffness @ whole[:, rows]


def _bordered(whole: NDArray[Any], r: int, e: int) -> Blocks:
    return Blocks(whole[:, :r, :e], whole[:, :r, e:], whole[:, r:, :e], whole[:, r:, e:])


def _entries(shape: tuple[int, int], places: Sequence[tuple[int, int, float]]) -> FloatArray:
    matrix = np.zeros(shape)
    for row, column, value in places:
        matrix[row, column] += value
    return matrix

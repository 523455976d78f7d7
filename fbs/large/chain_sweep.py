"""The messages of a chain on some lines: what each connection meets in the parts beyond it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._kernels import batched as _batched
from .._kernels.checks import ComplexArray, FloatArray
from .._kernels.joint_scaling import joint_scaling
from .._mixed_assembly import HELD
from ..joints import Flexible
from .chain_layout import Ends, Tree

Asked = Mapping[str, Sequence[tuple[int, int]]]
"""For each part concerned: rows (or columns) of the result, with those of the part's FRFs."""

GROWTH = 1e3
"""Largest entry of T where joints are eliminated together: beyond, three digits would be lost."""


@dataclass(frozen=True, eq=False)
class _Message:
    """From a part to its connection e: D (m, m, nf), T (n_others, m, nf), and sum |lambda|.

    `reach` (m, nf) is the 1-norm of a unit force at e and of all that it causes further on.
    """

    receptance: ComplexArray
    transfer: ComplexArray
    reach: FloatArray


@dataclass(frozen=True, eq=False)
class Sweep:
    """All messages on some lines, in the notation of `couple_chain`.

    Joints are scaled by the s of `joint_scaling`: A and D stand for s A s and s D s, `own` for
    s^2 / Z; where a joint has several DoFs, all are in the coordinates of its springs, `Flexible`.
    """

    tree: Tree
    omega: FloatArray
    parts: Mapping[str, ComplexArray]  # (n_response, n_excitation, nf), interface first
    own: Mapping[int, ComplexArray]  # of flexible joints, (nf,)
    weights: dict[str, FloatArray]  # s, (n_end, nf)
    springs: dict[str, Flexible]
    interface: dict[str, ComplexArray]
    messages: dict[tuple[str, int], _Message]

    @classmethod
    def of(cls, tree: Tree, parts: Mapping[str, ComplexArray], omega: FloatArray) -> Sweep:
        """Sweep from the leaves to the roots and back.

        Parameters
        ----------
        tree : Tree
        parts : mapping of str to array, shape (n_response, n_excitation, nf), m/N
            A part's interface, in the order of `Ends.labels`, comes first.
        omega : array, shape (nf,), rad/s
        """
        flexible = Flexible.of(tree.joints, omega)
        springs = {name: flexible.of_part(ends.joints) for name, ends in tree.ends.items()}
        interface, moduli = {}, np.zeros((len(tree.joints), omega.size))
        for name, ends in tree.ends.items():
            a = _signed(_signed(parts[name], ends, 0), ends, 1)
            interface[name] = springs[name].to_springs(a)
            for k, joint in enumerate(ends.joints):
                moduli[joint] += np.abs(interface[name][k, k])
        scale, own = joint_scaling(moduli, flexible.values)
        weights = {name: scale[ends.joints] for name, ends in tree.ends.items()}
        for name, s in weights.items():
            interface[name] = interface[name] * (s[:, None] * s)
        sweep = cls(tree, omega, parts, own, weights, springs, interface, {})
        for name, connection in tree.order:
            sweep.messages[name, connection] = sweep._message(name, connection)
        return sweep

    def stable(self) -> NDArray[np.bool_]:
        """Return the lines where eliminating joints from the leaves inward loses no digits.

        Near a resonance of all that lies beyond a connection T is large. Where it comes from one
        joint, D and T round alike and nothing is lost; from several it is as in an LU
        factorisation whose pivots do not follow the values. Nor is a connection stable where one
        side is held, see `couple`.
        """
        stable = ~self._held()
        for message in self.messages.values():
            if len(message.transfer) == 1:
                stable &= np.isfinite(message.reach).all(axis=0)
            elif len(message.transfer):
                stable &= np.abs(message.transfer).max(axis=(0, 1)) <= GROWTH  # NaN is not
        return stable

    def _held(self) -> NDArray[np.bool_]:
        """Whether a part is held to less than `HELD` of its receptance: A by all beyond, D by D'.

        Joined to the other side, D becomes D - D G D, G = (D + D' + 1/Z)^-1.
        """
        held = np.zeros(self.omega.size, dtype=bool)
        for (name, connection), message in self.messages.items():
            ends, own = self.tree.ends[name], message.receptance
            here, joints = ends.here[connection], ends.joints[ends.here[connection]]
            if len(ends.here) > 1:
                held |= _less(own, self.interface[name][here, here])
            other = self._incoming(name, connection).receptance.copy()
            self._add_joints(other, joints)
            if len(joints) == 1:  # D_c / D = (D' + 1/Z) / (D + D' + 1/Z)
                held |= _less(other, own + other)
            else:
                held |= _less(own - _product(own, _solve(own + other, own)), own)
        return held

    def condition(self) -> FloatArray:
        """Return || s (|B| |Y| |B|^T + |1/Z|) s || ||kernel^-1||, both in the 1-norm.

        The column of kernel^-1 at connection e is (D + D + 1/Z)^-1 there, from both sides, and
        spreads from it by the transfers.
        """
        tree = self.tree
        if not tree.joints:
            return np.ones(self.omega.size)
        bound = np.zeros((len(tree.joints), self.omega.size))
        for joint, own in self.own.items():
            bound[joint] = np.abs(own)
        for name, ends in tree.ends.items():
            for row in np.abs(self.interface[name]):
                for joint, entry in zip(ends.joints, row, strict=True):
                    bound[joint] += entry
        largest = np.zeros(self.omega.size)
        for connection, (first, second) in enumerate(tree.connections):
            one, two = self.messages[first, connection], self.messages[second, connection]
            kernel = one.receptance + two.receptance
            self._add_joints(kernel, tree.ends[first].joints[tree.ends[first].here[connection]])
            spread = one.reach + two.reach - 1
            for column in _sum(map(np.multiply, spread, _inverse_moduli(kernel))):
                np.maximum(largest, column, out=largest)  # NaN stays
        return np.asarray(bound.max(axis=0) * largest)

    def respond(self, responses: Asked, excitations: Asked, values: ComplexArray) -> None:
        """Write the FRFs asked for into `values`, shape (n_response, n_excitation, nf)."""
        for source, excited in excitations.items():
            columns, inputs = map(list, zip(*excited, strict=True))
            forces = self._forces_at_source(source, inputs)
            for name, entered in self.tree.paths(source, set(responses)):
                if entered is not None:
                    self._forces_onward(name, entered, forces)
                if name not in responses:
                    continue
                rows, outputs = map(list, zip(*responses[name], strict=True))
                ends, y = self.tree.ends[name], self.parts[name][outputs]
                found = np.zeros((len(rows), len(columns), self.omega.size), dtype=complex)
                if name == source:
                    found += y[:, inputs]
                if ends.joints:
                    joined = np.concatenate([forces[connection] for connection in ends.here])
                    reached = self.springs[name].right(_signed(y, ends, 1))
                    found -= _product(np.asarray(reached * self.weights[name]), joined)
                values[np.ix_(rows, columns)] = found

    def _message(self, name: str, connection: int) -> _Message:
        """Return what part `name` hands to `connection`, its others' messages being known."""
        ends, a = self.tree.ends[name], self.interface[name]
        here, others = ends.here[connection], ends.others[connection]
        if len(ends.here) == 1:
            return _Message(a, a[:0], np.ones(a.shape[1:]))
        transfer = _solve(self._kernel(name, connection), a[others][:, here])
        receptance = a[here, here] - _product(a[here][:, others], transfer)
        beyond = [
            row for c in ends.here if c != connection for row in self._incoming(name, c).reach
        ]
        reach = 1 + _sum(row * np.abs(t) for row, t in zip(beyond, transfer, strict=True))
        return _Message(receptance, transfer, reach)

    def _incoming(self, name: str, connection: int) -> _Message:
        """Return the message of the part at the other end."""
        return self.messages[self.tree.other(name, connection), connection]

    def _kernel(self, name: str, left_out: int | None = None) -> ComplexArray:
        """Return A + D_(->q) + Z^-1 at a part's joints, all but one connection's."""
        ends, kernel = self.tree.ends[name], self.interface[name]
        beyond = [connection for connection in ends.here if connection != left_out]
        if left_out is not None:
            kernel = kernel[ends.others[left_out]][:, ends.others[left_out]]
        if len(beyond) == 1:
            kernel = kernel + self._incoming(name, beyond[0]).receptance
        else:
            kernel, at = kernel.copy(), 0
            for connection in beyond:
                receptance = self._incoming(name, connection).receptance
                here = slice(at, at + len(receptance))
                kernel[here, here] += receptance
                at = here.stop
        self._add_joints(kernel, [j for c in beyond for j in ends.joints[ends.here[c]]])
        return kernel

    def _add_joints(self, kernel: ComplexArray, joints: Sequence[int]) -> None:
        """Add s^2 / Z of flexible joints to a kernel's diagonal."""
        for k, joint in enumerate(joints):
            if joint in self.own:
                kernel[k, k] += self.own[joint]

    def _forces_at_source(self, name: str, inputs: list[int]) -> dict[int, ComplexArray]:
        """Return lambda / s at each connection of a part, per unit excitation of it."""
        ends = self.tree.ends[name]
        if not ends.joints:
            return {}
        right = self.springs[name].left(_signed(self.parts[name][:, inputs], ends, 0))
        right = right * self.weights[name][:, None]
        forces = _solve(self._kernel(name), right)
        return {connection: forces[here] for connection, here in ends.here.items()}

    def _forces_onward(self, name: str, entered: int, forces: dict[int, ComplexArray]) -> None:
        """Add those at a part's other connections to those at the one they come by."""
        onward = _product(self.messages[name, entered].transfer, forces[entered])
        np.negative(onward, out=onward)
        at = 0
        for connection, here in self.tree.ends[name].here.items():
            if connection != entered:
                count = here.stop - here.start
                forces[connection] = onward[at : at + count]
                at += count


def _at_joints(array: ComplexArray, ends: Ends, axis: int) -> ComplexArray:
    """Return the rows (axis 0) or columns (1) of a part's FRFs at its joints' labels."""
    n = len(ends.place)
    if ends.place == tuple(range(n)):  # no label joined twice: a view does
        return array[:n] if axis == 0 else array[:, :n]
    return array[list(ends.place)] if axis == 0 else array[:, list(ends.place)]


def _signed(array: ComplexArray, ends: Ends, axis: int) -> ComplexArray:
    """Return the rows (axis 0) or columns (1) at a part's joints times the entries of B."""
    signs = np.array(ends.signs)[:, None]
    return np.asarray(_at_joints(array, ends, axis) * (signs[:, None] if axis == 0 else signs))


def _less(left: ComplexArray, right: ComplexArray) -> NDArray[np.bool_]:
    """Whether |left_kk| < `HELD` |right_kk| for any k, shape (nf,)."""
    k = np.arange(len(left))
    a, b = left[k, k], right[k, k]
    return np.asarray(
        (a.real**2 + a.imag**2 < HELD**2 * (b.real**2 + b.imag**2)).any(axis=0), dtype=bool
    )


def _sum(terms: Iterable[Any]) -> Any:
    """Add arrays; there is one at least."""
    return reduce(np.add, terms)


def _product(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Multiply matrices whose last axis is frequency; the inner dimension is small."""
    if not len(left):
        return np.zeros((0, *right.shape[1:]), dtype=complex)
    return np.asarray(_sum(left[:, k, None] * right[k] for k in range(len(right))))


def _solve(kernel: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Solve at every line; infinite or NaN where singular."""
    if len(kernel) == 1:
        return np.asarray(right / kernel)
    return _product(_inverse(kernel), right)


def _inverse(kernel: ComplexArray) -> ComplexArray:
    """Invert (m, m, nf); NaN where singular."""
    inverse: NDArray[np.complex128] = _batched.inverse(kernel.transpose(2, 0, 1))[0]
    return inverse.transpose(1, 2, 0)


def _inverse_moduli(kernel: ComplexArray) -> FloatArray:
    """Return |kernel^-1|, entry by entry."""
    if len(kernel) == 1:
        return np.asarray(1 / np.abs(kernel))
    return np.abs(_inverse(kernel))

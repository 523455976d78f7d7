"""Coupling part by part along a chain or a tree: the cost grows linearly with the parts.

Connections are the edges of the tree: all joints between the same two parts. Everything beyond a
connection acts on a part like one more spring, its receptance D at the joints. A message q -> e
hands that receptance from part q to its connection e; two sweeps, from the leaves to a root and
back, give all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _batched
from ._checks import ComplexArray, FloatArray, ascending_frequency, read_only, unique_labels
from .chain_layout import Ends, Labels, Places, Tree
from .coupling import CoupledFrf, Joint, couple
from .errors import FbsError, QuantityMismatchError, SingularLineError
from .frf import Frf, Quantity, require_same_frequency
from .interface_synthesis import interface_frf

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

BLOCK = 4096
"""Lines swept at once: a part's 2 x 2 interface receptances are 0.26 MB, which stay in cache."""


class System(Protocol):
    """What has labels and can be synthesised, such as `SecondOrderSystem` or `SparseSystem`."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Everything that can be asked for."""


GROWTH = 1e3
"""Largest entry of T where joints are eliminated together: beyond, three digits would be lost."""

Map = Callable[..., Iterable[Any]]
PartSynthesis = Callable[..., Frf]
"""`modal_frf`, `direct_frf`, `sparse_frf`, ...: (system, frequency, responses, excitations)."""


def couple_chain(
    parts: Mapping[str, System | Frf],
    joints: Sequence[Joint],
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
    synthesis: PartSynthesis = interface_frf,
    executor: ThreadPoolExecutor | None = None,
) -> CoupledFrf:
    """Couple a tree of parts by messages between neighbours, in the notation of `couple`.

    With A = B_q Y_q B_q^T of part q, e one of its connections and o all its others,

        D_(q->e) = A_ee - A_eo T,  T_(q->e) = (A_oo + D_(->q) + Z^-1)^-1 A_oe,

    D_(->q) block-diagonal from the neighbours beyond o: eliminating joints from the leaves of
    B Y B^T + Z^-1 inward, which leaves no fill-in (of one joint each, the addition of receptances
    of Bishop & Johnson 1960, The Mechanics of Vibration). Excited in part p, the joint forces are

        lambda_p = (A + D_(->p) + Z^-1)^-1 B_p Y_p,  lambda_o = -T_(q->e) lambda_e

    from part to part outward, and x_q = Y_q - Y_q B_q^T lambda_q.

    Only the FRFs of the joints and those asked for are synthesised, part by part. Time and memory
    are linear in the number of parts; a part of k connections takes k inverses of k - 1. Lines
    very near a resonance of all that lies beyond a part's several joints (see `GROWTH`) are left
    to `couple`, which pivots.

    Parameters
    ----------
    parts : mapping of str to system or Frf
        Systems are synthesised at their joints and at what is asked for; FRFs are receptances
        on the same lines.
    joints : sequence of Joint
        Between the parts they may form a chain, a tree or several, but no loop.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels
        Of any parts. A label that several parts have must be one motion: tied by rigid joints.
    synthesis : callable
        (system, frequency, responses, excitations) -> Frf.
    executor : ThreadPoolExecutor, optional
        Synthesises parts, then sweeps blocks of lines, side by side.

    Returns
    -------
    CoupledFrf
        `kernel_condition` is that of `couple` in the 1-norm; a bound of it where two parts have
        several joints.

    Raises
    ------
    JointError
        The joints close a loop, or lie within one part (use `couple`); or a rigid joint follows
        from the others.
    SingularLineError
        The kernel has no digit left on a line: an undamped pole of the assembly.
    UnknownDofError, AmbiguousDofError, AxisMismatchError, QuantityMismatchError
    """
    axis = ascending_frequency(frequency)
    rows = unique_labels(responses, "the responses")
    columns = unique_labels(excitations, "the excitations")
    tree = Tree.of({name: _labels(part) for name, part in parts.items()}, joints)
    wanted = _Wanted(tree.owners(rows, 0), tree.owners(columns, 1))
    workers: Map = map if executor is None else executor.map
    each = workers(
        lambda name: _synthesised(name, parts[name], tree, wanted, axis, synthesis), parts
    )
    frfs = dict(zip(parts, each, strict=True))
    result = _Result.of(tree, wanted, frfs, axis)
    for _ in workers(result.sweep, range(0, axis.size, BLOCK)):  # drained: errors come to light
        pass
    result.complete()
    frf = Frf(axis, result.values.transpose(2, 0, 1), rows, columns)
    return CoupledFrf(frf, read_only(result.condition), tree.joints)


@dataclass(frozen=True, eq=False)
class _Result:
    """What the sweeps write: values (n_response, n_excitation, nf), condition and stable (nf,)."""

    tree: Tree
    wanted: _Wanted
    frfs: Mapping[str, Frf]
    axis: FloatArray
    values: ComplexArray
    condition: FloatArray
    stable: NDArray[np.bool_]

    @classmethod
    def of(cls, tree: Tree, wanted: _Wanted, frfs: Mapping[str, Frf], axis: FloatArray) -> _Result:
        shape = (len(wanted.rows), len(wanted.columns), axis.size)
        values = np.zeros(shape, dtype=complex)
        return cls(
            tree, wanted, frfs, axis, values, np.ones(axis.size), np.ones(axis.size, dtype=bool)
        )

    def sweep(self, start: int) -> None:
        """Do `BLOCK` lines from `start` on."""
        lines = slice(start, start + BLOCK)
        with np.errstate(all="ignore"):  # what overflows or divides by zero is found and named
            sweep = _Sweep.of(self.tree, self.frfs, 2 * np.pi * self.axis[lines], lines)
            self.condition[lines] = sweep.condition()
            self.stable[lines] = sweep.stable()
            sweep.respond(self.wanted, self.frfs, self.values[:, :, lines])

    def complete(self) -> None:
        """Refuse singular lines; couple the unstable ones all at once."""
        singular = self.stable & ~(self.condition <= 1 / (10 * np.finfo(float).eps))
        if singular.any():
            raise SingularLineError(
                self.axis[singular],
                "the chain's kernel B Y B^T + 1/Z is singular to working precision",
                "these lines lie on undamped poles of the assembly, or the joints tie the same "
                "motion twice: leave the lines out, add damping or drop a joint",
            )
        if self.stable.all():
            return
        lines = np.flatnonzero(~self.stable)
        parts = {name: _qualified(name, frf, lines) for name, frf in self.frfs.items()}
        joints = [
            replace(j, first=_qualify(*j.first), second=_qualify(*j.second))
            for j in self.tree.joints
        ]
        rest = couple(parts, joints)
        rows, columns = (
            [_qualify(*node)[1] for node in nodes]
            for nodes in (self.wanted.rows, self.wanted.columns)
        )
        self.values[:, :, lines] = rest.frf.select(rows, columns).values.transpose(1, 2, 0)
        self.condition[lines] = rest.kernel_condition


def _qualify(name: str, label: str) -> tuple[str, str]:
    """Return a node whose label no other part has."""
    return name, f"{name}: {label}"


def _qualified(name: str, frf: Frf, lines: NDArray[np.intp]) -> Frf:
    rows, columns = (
        tuple(_qualify(name, label)[1] for label in labels)
        for labels in (frf.responses, frf.excitations)
    )
    return Frf(frf.frequency[lines], frf.values[lines], rows, columns)


def _labels(part: System | Frf) -> Labels:
    if isinstance(part, Frf):
        return part.responses, part.excitations
    return part.labels, part.labels


@dataclass(frozen=True)
class _Wanted:
    """(part, label) of every response and of every excitation asked for."""

    rows: tuple[tuple[str, str], ...]
    columns: tuple[tuple[str, str], ...]

    def of(self, name: str) -> tuple[list[tuple[int, str]], list[tuple[int, str]]]:
        """Return one part's responses and excitations, with their places in the result."""
        rows = [(i, label) for i, (owner, label) in enumerate(self.rows) if owner == name]
        columns = [(j, label) for j, (owner, label) in enumerate(self.columns) if owner == name]
        return rows, columns


def _synthesised(
    name: str,
    part: System | Frf,
    tree: Tree,
    wanted: _Wanted,
    axis: FloatArray,
    synthesis: PartSynthesis,
) -> Frf:
    """Return the FRFs between a part's joints and what is asked for of it."""
    rows, columns = (
        tuple(dict.fromkeys([*tree.ends[name].labels, *(label for _, label in asked)]))
        for asked in wanted.of(name)
    )
    if isinstance(part, Frf):
        if part.quantity is not Quantity.RECEPTANCE:
            raise QuantityMismatchError(
                f"part {name!r} is {part.quantity}; a chain couples receptances, convert with to"
            )
        require_same_frequency(axis, part.frequency, f"the axis of part {name!r} differs")
        return part.select(rows, columns)
    if not (rows and columns):  # nothing joined to it, and not both asked for
        nothing = np.zeros((axis.size, len(rows), len(columns)), dtype=complex)
        return Frf(axis, nothing, rows, columns)
    frf = synthesis(part, axis, rows, columns)
    if (frf.responses, frf.excitations) != (rows, columns):
        raise FbsError(f"the synthesis of part {name!r} returned other FRFs than asked for")
    return frf


@dataclass(frozen=True, eq=False)
class _Message:
    """From a part to its connection e: (m, m, nf), (n_others, m, nf), and sum |lambda| beyond.

    `reach` (m, nf) is the 1-norm of all joint forces further on that a unit force at e causes.
    """

    receptance: ComplexArray
    transfer: ComplexArray
    reach: FloatArray


@dataclass(frozen=True, eq=False)
class _Sweep:
    """All messages on some lines.

    Joints are scaled by s as in `couple`, s^-2 = e + 1/|Z| with e the moduli of both ends'
    receptances: A and D stand for s A s and s D s, `own` for s^2 / Z, of modulus below one.
    """

    tree: Tree
    own: ComplexArray  # (n_joint, nf)
    parts: dict[str, ComplexArray]  # (n_response, n_excitation, nf), interface first
    weights: dict[str, FloatArray]  # entries of s B, (n_end, nf)
    interface: dict[str, ComplexArray]
    messages: dict[tuple[str, int], _Message]

    @classmethod
    def of(cls, tree: Tree, frfs: Mapping[str, Frf], omega: FloatArray, lines: slice) -> _Sweep:
        parts = {name: frf.values[lines].transpose(1, 2, 0) for name, frf in frfs.items()}
        size = np.zeros((len(tree.joints), omega.size))
        for name, ends in tree.ends.items():
            for joint, place, sign in zip(ends.joints, ends.place, ends.signs, strict=True):
                size[joint] += sign**2 * np.abs(parts[name][place, place])
        scale, own = _scaling(tree.joints, size, omega)
        weights, interface = {}, {}
        for name, ends in tree.ends.items():
            s = weights[name] = scale[ends.joints] * np.array(ends.signs)[:, None]
            interface[name] = _at_joints(_at_joints(parts[name], ends, 0), ends, 1)
            interface[name] = interface[name] * (s[:, None] * s)
        sweep = cls(tree, own, parts, weights, interface, {})
        for name, connection in tree.order:
            sweep.messages[name, connection] = sweep.message(name, connection)
        return sweep

    def message(self, name: str, connection: int) -> _Message:
        """Return what part `name` hands to `connection`, its others' messages being known."""
        ends, a = self.tree.ends[name], self.interface[name]
        here, others = ends.here[connection], ends.others[connection]
        if len(ends.here) == 1:
            return _Message(a, a[:0], np.zeros(a.shape[1:]))
        transfer = _product(_inverse(self.kernel(name, connection)), a[others][:, here])
        receptance = a[here, here] - _product(a[here][:, others], transfer)
        beyond = [self.incoming(name, c).reach for c in ends.here if c != connection]
        reach = ((1 + np.concatenate(beyond))[:, None] * np.abs(transfer)).sum(axis=0)
        return _Message(receptance, transfer, reach)

    def incoming(self, name: str, connection: int) -> _Message:
        """Return the message of the part at the other end."""
        return self.messages[self.tree.other(name, connection), connection]

    def kernel(self, name: str, left_out: int | None = None) -> ComplexArray:
        """Return A + D_(->q) + Z^-1 at a part's joints, all but one connection's."""
        ends = self.tree.ends[name]
        places: Places = slice(None) if left_out is None else ends.others[left_out]
        kernel = self.interface[name][places][:, places].copy()
        at = 0
        for connection, here in ends.here.items():
            if connection == left_out:
                continue
            own = slice(at, at + here.stop - here.start)
            kernel[own, own] += self.incoming(name, connection).receptance
            for k, joint in enumerate(ends.joints[here], start=at):
                kernel[k, k] += self.own[joint]
            at = own.stop
        return kernel

    def stable(self) -> NDArray[np.bool_]:
        """Return the lines where eliminating joints from the leaves inward loses no digits.

        Near a resonance of all that lies beyond a connection T is large. Where it comes from one
        joint, D and T round alike and nothing is lost; from several it is as in an LU
        factorisation whose pivots do not follow the values.
        """
        growth = np.zeros(self.own.shape[1])
        for message in self.messages.values():
            size = np.abs(message.transfer)
            if len(size) == 1:
                size = np.where(np.isfinite(size), 0.0, np.inf)
            if len(size):
                np.maximum(growth, size.max(axis=(0, 1)), out=growth)
        return np.asarray(growth <= GROWTH)

    def condition(self) -> FloatArray:
        """Return || s (|B| |Y| |B|^T + |1/Z|) s || ||kernel^-1||, both in the 1-norm.

        The column of kernel^-1 at connection e is (D + D + 1/Z)^-1 there, from both sides, and
        spreads from it by the transfers.
        """
        if not self.tree.joints:
            return np.ones(self.own.shape[1])
        bound = np.abs(self.own)
        for name, ends in self.tree.ends.items():
            if ends.joints:
                bound[ends.joints] += np.abs(self.interface[name]).sum(axis=0)
        largest = np.zeros(self.own.shape[1])
        for connection, (first, second) in enumerate(self.tree.connections):
            one, two = self.messages[first, connection], self.messages[second, connection]
            ends = self.tree.ends[first]
            kernel = one.receptance + two.receptance
            for k, joint in enumerate(ends.joints[ends.here[connection]]):
                kernel[k, k] += self.own[joint]
            spread = 1 + one.reach + two.reach
            columns = (spread[:, None] * np.abs(_inverse(kernel))).sum(axis=0)
            np.maximum(largest, columns.max(axis=0), out=largest)  # NaN stays
        return np.asarray(bound.max(axis=0) * largest)

    def respond(self, wanted: _Wanted, frfs: Mapping[str, Frf], values: ComplexArray) -> None:
        """Write the FRFs asked for into `values`, shape (n_response, n_excitation, nf)."""
        responding = {name for name, _ in wanted.rows}
        for name in dict.fromkeys(owner for owner, _ in wanted.columns):
            _, excited = wanted.of(name)
            columns = [j for j, _ in excited]
            inputs = [frfs[name].excitations.index(label) for _, label in excited]
            forces = {name: self._forces_at_source(name, inputs)}
            for part, entered in self.tree.paths(name, responding):
                if entered is not None:
                    forces[part] = self._forces_onward(part, entered, forces)
                rows = wanted.of(part)[0]
                outputs = [frfs[part].responses.index(label) for _, label in rows]
                if not outputs:
                    continue
                ends, y = self.tree.ends[part], self.parts[part][outputs]
                found = -_product(_at_joints(y, ends, 1) * self.weights[part], forces[part])
                if part == name:
                    found += y[:, inputs]
                values[np.ix_([i for i, _ in rows], columns)] = found

    def _forces_at_source(self, name: str, inputs: list[int]) -> ComplexArray:
        """Return lambda / s at a part's joints, per unit excitation."""
        ends = self.tree.ends[name]
        right = _at_joints(self.parts[name][:, inputs], ends, 0) * self.weights[name][:, None]
        return _product(_inverse(self.kernel(name)), right) if ends.joints else right

    def _forces_onward(
        self, name: str, entered: int, forces: Mapping[str, ComplexArray]
    ) -> ComplexArray:
        """Return a part's joint forces from those at the connection they come by."""
        before = self.tree.other(name, entered)
        ends = self.tree.ends[name]
        known = forces[before][self.tree.ends[before].here[entered]]
        result = np.empty((len(ends.joints), *known.shape[1:]), dtype=complex)
        result[ends.here[entered]] = known
        result[ends.others[entered]] = -_product(self.messages[name, entered].transfer, known)
        return result


def _at_joints(array: ComplexArray, ends: Ends, axis: int) -> ComplexArray:
    """Return the rows (axis 0) or columns (1) of a part's FRFs at its joints' labels."""
    n = len(ends.place)
    if ends.place == tuple(range(n)):  # no label joined twice: a view does
        return array[:n] if axis == 0 else array[:, :n]
    return array[list(ends.place)] if axis == 0 else array[:, list(ends.place)]


def _scaling(
    joints: Sequence[Joint], size: FloatArray, omega: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Return s, s^-2 = size + 1/|Z|, and s^2 / Z; a joint with Z = 0 drops out, s = 0."""
    scale, own = np.empty_like(size), np.zeros(size.shape, dtype=complex)
    for k, joint in enumerate(joints):
        diagonal = np.maximum(size[k], np.finfo(float).tiny)
        if joint.rigid:
            scale[k] = 1 / np.sqrt(diagonal)
            continue
        z = joint.dynamic_stiffness(omega)
        modulus = np.abs(z)
        scale[k] = np.sqrt(modulus / (1 + modulus * diagonal))
        phase = np.divide(modulus, z, out=np.ones_like(z), where=modulus > 0)
        own[k] = phase / (1 + modulus * diagonal)
    return scale, own


def _product(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Multiply matrices whose last axis is frequency; the inner dimension is small."""
    if not len(right):
        return np.zeros((len(left), *right.shape[1:]), dtype=complex)
    result = left[:, :1] * right[0]
    for k in range(1, len(right)):
        result += left[:, k, None] * right[k]
    return np.asarray(result)


def _inverse(kernel: ComplexArray) -> ComplexArray:
    """Invert (m, m, nf); infinite or NaN where singular."""
    if len(kernel) == 1:
        return np.asarray(1 / kernel)
    inverse: NDArray[np.complex128] = _batched.inverse(kernel.transpose(2, 0, 1))[0]
    return inverse.transpose(1, 2, 0)

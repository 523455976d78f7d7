"""Coupling part by part along a chain or a tree: the cost grows linearly with the parts.

Connections are the edges of the tree: all joints between the same two parts. Everything beyond a
connection acts on a part like one more spring, its receptance D at the joints. A message q -> e
hands that receptance from part q to its connection e; two sweeps, from the leaves to a root and
back, give all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels.blas_threads import one_blas_thread
from .._kernels.blocks import keep_freed_memory, stretches
from .._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    require_type,
    sealed,
    unique_labels,
)
from .._kernels.door import door
from .._mixed_assembly import MixedAssembly, Part
from ..axes import require_same_frequency
from ..coupling import CoupledFrf, couple
from ..errors import FbsError, QuantityMismatchError, singular_kernel
from ..frf import Frf, Quantity, computed_frf
from ..interface_synthesis import InterfaceModes
from ..joints import AnyJoint, Node, rows_of
from ..modal_synthesis import modal_frf
from ..second_order_system import SecondOrderSystem, SystemOrigin
from .chain_layout import Labels, Tree
from .chain_sweep import Asked, Sweep

BLOCK = 4096
"""Lines swept at once: a part's 2 x 2 interface receptances are 0.26 MB, which stay in cache; much
shorter runs cost more in calls than in arithmetic."""


class System(Protocol):
    """What has labels and can be synthesised, such as `SecondOrderSystem` or `SparseSystem`."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Everything that can be asked for."""


Lines = slice | NDArray[np.intp]
Write = Callable[[Lines, ComplexArray], None]
"""Fill an array of shape (n_row, n_column, n_lines) with a part's receptances on some lines."""

PartSynthesis = Callable[..., Frf]
"""`modal_frf`, `direct_frf`, `sparse_frf`, ...: (system, frequency, responses, excitations)."""


@door
def couple_chain(
    parts: Mapping[str, System | Frf],
    joints: Sequence[AnyJoint],
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
    synthesis: PartSynthesis | None = None,
) -> CoupledFrf:
    """Couple a tree of parts by messages between neighbours, in the notation of `couple`.

    With A = B_q Y_q B_q^T of part q, e one of its connections and o all its others,

        D_(q->e) = A_ee - A_eo T,  T_(q->e) = (A_oo + D_(->q) + Z^-1)^-1 A_oe,

    D_(->q) block-diagonal from the neighbours beyond o: eliminating joints from the leaves of
    B Y B^T + Z^-1 inward, which leaves no fill-in (of one joint each, the addition of receptances
    of Bishop & Johnson 1960, The Mechanics of Vibration). Excited in part p, the joint forces are

        lambda_p = (A + D_(->p) + Z^-1)^-1 B_p Y_p,  lambda_o = -T_(q->e) lambda_e

    from part to part outward, and x_q = Y_q - Y_q B_q^T lambda_q.

    Only the FRFs of the joints and those asked for are synthesised, part by part, block of lines
    by block. Time is linear in the number of parts, and so is the memory of a block;
    a part of k connections takes k inverses of k - 1. Lines very near a resonance of all that lies
    beyond a part's several joints (see `GROWTH`) are left to `couple`, which pivots, and so are
    those where one side of a connection holds the other to less than `HELD` of its receptance.
    `CoupledFrf.round_off` couples all parts at once, whose time is cubic in their number.

    Parameters
    ----------
    parts : mapping of str to system or Frf
        Systems are synthesised at their joints and at what is asked for; FRFs are receptances
        on the same lines.
    joints : sequence of Joint or MatrixJoint
        Between the parts they may form a chain, a tree or several, but no loop.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels
        Of any parts. A label that several parts have must be one motion: tied by rigid joints.
    synthesis : callable, optional
        (system, frequency, responses, excitations) -> Frf, called once for each part and all
        lines. Default: for a `SecondOrderSystem`, the sum of `interface_frf`, which is done block
        by block (`modal_frf` where damping is not proportional).

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
    joints = tuple(joints)
    labels = {name: _labels(name, part) for name, part in parts.items()}
    tree = Tree.of(labels, rows_of(joints))
    responding, excited = tree.owners(rows, 0), tree.owners(columns, 1)
    frfs = {
        name: _prepared(
            name, part, _ports(name, tree, responding), _ports(name, tree, excited), axis, synthesis
        )
        for name, part in parts.items()
    }
    result = _Result.of(tree, (responding, excited), frfs, axis)
    keep_freed_memory()
    with one_blas_thread():
        for lines in stretches(axis.size, BLOCK):
            result.sweep(lines)
    result.complete()
    sources = {name: frf.source for name, frf in frfs.items()}
    origin = MixedAssembly(axis, sources, tree.joints, result.held)
    frf = computed_frf(axis, result.values.transpose(2, 0, 1), rows, columns, origin=origin)
    return CoupledFrf(frf, sealed(result.condition), joints)


@dataclass(frozen=True, eq=False)
class _PartFrfs:
    """A part's receptances between its joints, which come first, and what is asked for of it."""

    source: Part
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    write: Write

    def at(self, lines: Lines, count: int) -> ComplexArray:
        values = np.empty((len(self.rows), len(self.columns), count), dtype=complex)
        self.write(lines, values)
        return values


def _labels(name: str, part: System | Frf) -> Labels:
    if isinstance(part, Frf):
        return part.responses, part.excitations
    if not hasattr(part, "labels"):
        raise FbsError(f"part {name!r} is a {type(part).__name__}, neither a system nor an Frf")
    return part.labels, part.labels


def _ports(name: str, tree: Tree, asked: Sequence[Node]) -> tuple[str, ...]:
    """Return a part's labels: those of its joints, then others asked for."""
    own = (label for owner, label in asked if owner == name)
    return tuple(dict.fromkeys([*tree.ends[name].labels, *own]))


def _prepared(
    name: str,
    part: System | Frf,
    rows: tuple[str, ...],
    columns: tuple[str, ...],
    axis: FloatArray,
    synthesis: PartSynthesis | None,
) -> _PartFrfs:
    """Do what all lines share: the modes, or the FRFs if they come all at once."""
    if isinstance(part, Frf):
        if part.quantity is not Quantity.RECEPTANCE:
            raise QuantityMismatchError(
                f"part {name!r} is {part.quantity}; a chain couples receptances, convert with to"
            )
        require_same_frequency(axis, part.frequency, f"the axis of part {name!r} differs")
        frf = part.select(rows, columns)
        return _PartFrfs(frf, rows, columns, partial(_copy, frf))
    if not (rows and columns):  # nothing joined to it, and not both asked for
        nothing = Frf(
            axis, np.zeros((axis.size, len(rows), len(columns)), dtype=complex), rows, columns
        )
        return _PartFrfs(nothing, rows, columns, lambda lines, out: None)
    if synthesis is None:
        return _modal(name, part, rows, columns, axis)
    frf = synthesis(part, axis, rows, columns)
    require_type(frf, Frf, f"the synthesis of part {name!r}")
    if (frf.responses, frf.excitations, frf.quantity) != (rows, columns, Quantity.RECEPTANCE):
        raise FbsError(
            f"the synthesis of part {name!r} returned other FRFs than asked for: receptances "
            f"between {len(rows)} responses and {len(columns)} excitations were, {frf!r} came"
        )
    require_same_frequency(axis, frf.frequency, f"the synthesis of part {name!r}: the lines differ")
    return _PartFrfs(frf, rows, columns, partial(_copy, frf))


def _modal(
    name: str, part: System, rows: tuple[str, ...], columns: tuple[str, ...], axis: FloatArray
) -> _PartFrfs:
    if not isinstance(part, SecondOrderSystem):
        raise FbsError(
            f"part {name!r} is a {type(part).__name__}: say how to synthesise it, as in "
            "synthesis=sparse_frf"
        )
    modes = InterfaceModes.of(part, rows, columns)
    if modes is None:
        frf = modal_frf(part, axis, rows, columns)
        return _PartFrfs(frf, rows, columns, partial(_copy, frf))
    modes.refuse_poles(axis)
    omega = 2 * np.pi * axis

    def write(lines: Lines, out: ComplexArray) -> None:
        modes.write(omega[lines], out)

    return _PartFrfs(SystemOrigin.of(part), rows, columns, write)


def _copy(frf: Frf, lines: Lines, out: ComplexArray) -> None:
    out[:] = frf.values[lines].transpose(1, 2, 0)


@dataclass(frozen=True, eq=False)
class _Result:
    """What the sweeps write: values (n_response, n_excitation, nf), condition and stable (nf,)."""

    tree: Tree
    nodes: tuple[tuple[Node, ...], tuple[Node, ...]]
    frfs: Mapping[str, _PartFrfs]
    axis: FloatArray
    responses: Asked
    excitations: Asked
    values: ComplexArray
    condition: FloatArray
    stable: NDArray[np.bool_]
    held: dict[str, NDArray[np.bool_]]

    @classmethod
    def of(
        cls,
        tree: Tree,
        nodes: tuple[tuple[Node, ...], tuple[Node, ...]],
        frfs: Mapping[str, _PartFrfs],
        axis: FloatArray,
    ) -> _Result:
        responses = _places(nodes[0], {name: frf.rows for name, frf in frfs.items()})
        excitations = _places(nodes[1], {name: frf.columns for name, frf in frfs.items()})
        values = np.zeros((len(nodes[0]), len(nodes[1]), axis.size), dtype=complex)
        condition, stable = np.ones(axis.size), np.ones(axis.size, dtype=bool)
        held = {name: np.zeros(axis.size, dtype=bool) for name in frfs}
        return cls(tree, nodes, frfs, axis, responses, excitations, values, condition, stable, held)

    def sweep(self, lines: slice) -> None:
        """Do some lines."""
        omega = 2 * np.pi * self.axis[lines]
        parts = {name: frf.at(lines, omega.size) for name, frf in self.frfs.items()}
        with np.errstate(all="ignore"):  # what overflows or divides by zero is found and named
            sweep = Sweep.of(self.tree, parts, omega)
            self.condition[lines] = sweep.condition()
            self.stable[lines] = sweep.stable()
            sweep.respond(self.responses, self.excitations, self.values[:, :, lines])

    def complete(self) -> None:
        """Refuse singular lines; couple the unstable ones all at once."""
        singular = self.stable & ~(self.condition <= 1 / (10 * np.finfo(float).eps))
        if singular.any():
            raise singular_kernel(self.axis[singular], "chain")
        if self.stable.all():
            return
        lines = np.flatnonzero(~self.stable)
        parts = {name: self._qualified(name, lines) for name in self.frfs}
        joints = [
            replace(j, first=_qualify(*j.first), second=_qualify(*j.second))
            for j in self.tree.joints
        ]
        rows, columns = ([_qualify(*node)[1] for node in nodes] for nodes in self.nodes)
        rest = couple(parts, joints, rows, columns)
        self.values[:, :, lines] = rest.frf.values.transpose(1, 2, 0)
        self.condition[lines] = rest.kernel_condition
        for name, own in self.held.items():
            own[lines] = rest.held[name]

    def _qualified(self, name: str, lines: NDArray[np.intp]) -> Frf:
        """Return a part's FRFs on some lines, under labels that no other part has."""
        frf = self.frfs[name]
        rows, columns = (
            tuple(_qualify(name, label)[1] for label in labels)
            for labels in (frf.rows, frf.columns)
        )
        values = frf.at(lines, lines.size).transpose(2, 0, 1)
        origin = frf.source if isinstance(frf.source, SystemOrigin) else frf.source._origin
        if origin is not None:
            origin = origin.renamed({label: _qualify(name, label)[1] for label in frf.rows})
        return computed_frf(self.axis[lines], values, rows, columns, origin=origin)


def _places(nodes: Sequence[Node], labels: Mapping[str, Sequence[str]]) -> Asked:
    """Return where what is asked for stands: in the result, and in its part."""
    places: dict[str, list[tuple[int, int]]] = {}
    for k, (name, label) in enumerate(nodes):
        places.setdefault(name, []).append((k, labels[name].index(label)))
    return places


def _qualify(name: str, label: str) -> tuple[str, str]:
    """Return a node whose label no other part has."""
    return name, f"{name}: {label}"

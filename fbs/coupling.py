"""Coupling of substructures by their FRFs, through rigid and flexible joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ._assembly import End, Layout, assemble
from ._kernels import batched as _batched
from ._kernels.blocks import each, stretches
from ._kernels.checks import ComplexArray, FloatArray, sealed
from ._kernels.door import door
from ._kernels.joint_scaling import joint_scaling
from ._mixed_assembly import HELD, MixedAssembly
from .axes import require_same_frequency
from .errors import (
    AmbiguousDofError,
    FbsError,
    JointError,
    QuantityMismatchError,
    UnknownDofError,
    lost_digits,
    singular_kernel,
    unknown_dof,
)
from .frf import Frf, Quantity, computed_frf
from .joints import AnyJoint, Flexible, Joint, Node, ends_of, rows_of
from .second_order_system import SystemOrigin

LINES = 4096
"""Lines at once of what stays in the cache."""

Groups = Mapping[Node, tuple[Node, float]]


@dataclass(frozen=True, eq=False)
class Interface:
    """What is joined, and how: for what follows from the coupling besides the FRFs.

    Parameters
    ----------
    layout : Layout
        Of the responses and excitations.
    frfs : mapping of str to complex array, shape (n_response, n_excitation, nf)
        Of the substructures.
    ends : mapping of str to list of End
        Entries of B in each.
    inverse : complex array, shape (n_joint, n_joint, nf)
        (B Y B^T + Z^-1)^-1.
    """

    layout: Layout
    frfs: Mapping[str, ComplexArray]
    ends: Mapping[str, list[End]]
    inverse: ComplexArray


@dataclass(frozen=True, eq=False)
class CoupledFrf:
    """What `couple` returns.

    Parameters
    ----------
    frf : Frf
        Of the assembly; each label once.
    kernel_condition : array, shape (nf,)
        How many times larger a relative error of the substructures' interface FRFs is in the
        joint forces. What the subtraction loses on top is in `round_off`.
    joints : tuple of Joint or MatrixJoint
    """

    frf: Frf
    kernel_condition: FloatArray
    joints: tuple[AnyJoint, ...]

    @property
    def held(self) -> Mapping[str, NDArray[np.bool_]]:
        """On which lines a part was coupled by its dynamic stiffness, (nf,) each."""
        assert isinstance(self.frf._origin, MixedAssembly)
        return self.frf._origin.held

    @property
    def round_off(self) -> FloatArray:
        """Bound of the FRF's error, shape (nf, n_response, n_excitation); see `Frf.round_off`."""
        return self.frf.round_off


@door
def couple(
    substructures: Mapping[str, Frf],
    joints: Sequence[AnyJoint],
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
) -> CoupledFrf:
    """Couple: Y_c = Y - Y B^T (B Y B^T + Z^-1)^-1 B Y, Z the joints' dynamic stiffness.

    The dual form of de Klerk, Rixen & Voormeeren (2008), General framework for dynamic
    substructuring, AIAA J. 46(5), with B one signed row per joint (+1 first, -n second) and
    Z^-1 = 0 for rigid joints. Y stays in its blocks; no block-diagonal matrix is formed, and of
    Y_c only what is asked for: the kernel needs the joints' DoFs and no others.

    The paper's Eq. (15) is the case of two substructures A, B and rigid joints, provided the
    last block of its column is -B_H_jc: with Y B^T = [A_H_ic; A_H_cc; -B_H_jc], compatibility
    u_A = u_B asks for the minus sign, and without it every FRF between A and B changes sign. For
    flexible joints its kernel is (A_H_cc + B_H_cc + K_s^-1)^-1, inverted as a whole; the printed
    formula lacks that inverse.

    Of a joint of several DoFs Z = U S W^H, line by line: along U and W it is a set of springs S of
    one DoF each, and the kernel W^H B Y B^T U + S^-1 has none of a direction without stiffness.

    A part that the joints hold to less than `HELD` of its receptance at one of them, as a free
    light part on a stiff one, is coupled by its dynamic stiffness on these lines, if its FRFs are
    those of a system, see `MixedAssembly`: the difference Y - Y B^T (...) B Y loses |Y| / |Y_c|.

    Parameters
    ----------
    substructures : mapping of str to Frf
        All on one frequency axis and of one quantity. Responses and excitations may differ, but
        the DoFs of a joint must be both.
    joints : sequence of Joint or MatrixJoint
        Between any substructures, or within one (a loop closed). None: they stay side by side,
        and no force passes.
    responses, excitations : labels, optional
        Of the assembly, in this order. Default: all there are.

    Returns
    -------
    CoupledFrf
        Labels: those asked for, or those of the substructures, in their order. A label several of
        them have is kept once, and must be one motion: tied by rigid joints.

    Raises
    ------
    SingularLineError
        The kernel has no digit left on a line: an undamped pole of the assembly, or a motion
        that no substructure resists.
        Or the joints hold a part so much that nothing is left of the difference.
    JointError
        A rigid joint that follows from the others.
    AmbiguousDofError, UnknownDofError, AxisMismatchError, QuantityMismatchError
    """
    return coupled(substructures, joints, responses, excitations)[0]


def coupled(
    substructures: Mapping[str, Frf],
    joints: Sequence[AnyJoint],
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
) -> tuple[CoupledFrf, Interface]:
    """Couple, and return the interface too; see `couple`."""
    axis, quantity = _common_axis(substructures)
    given, joints = tuple(joints), rows_of(joints)
    for joint in joints:
        _require_interface(joint, substructures)
    refuse_ambiguous(
        {name: dict.fromkeys(f.responses + f.excitations) for name, f in substructures.items()},
        rigid_groups(joints),
    )
    layout = Layout.of(substructures, responses, excitations)
    interface = _Kernels(
        {name: frf.values.transpose(1, 2, 0) for name, frf in substructures.items()},
        {name: _ends(name, frf, joints) for name, frf in substructures.items()},
        joints,
    )
    kernel = interface.inverted_kernel(2 * np.pi * axis, quantity)
    singular = ~(kernel.condition <= 1 / (10 * np.finfo(float).eps))
    if singular.any():
        raise singular_kernel(axis[singular], "coupling")
    values, finite = assemble(layout, interface.frfs, interface.ends, kernel.inverse)
    held = {name: kernel.held[k] for k, name in enumerate(substructures)}
    origin = _origin(axis, substructures, joints, held)
    lines = np.flatnonzero(kernel.held.any(axis=0))
    if lines.size:
        _refuse_lost(origin, substructures, held, axis[lines])
        again = origin.receptances(axis[lines], layout.responses, layout.excitations, False).values
        again *= (2j * np.pi * axis[lines, None, None]) ** quantity.derivative
        values[:, :, lines] = again.transpose(1, 2, 0)
        finite = finite and bool(np.isfinite(again).all())
    frf = computed_frf(
        axis,
        values.transpose(2, 0, 1),
        layout.responses,
        layout.excitations,
        quantity,
        finite,
        origin,
    )
    known = Interface(layout, interface.frfs, interface.ends, kernel.inverse)
    return CoupledFrf(frf, sealed(kernel.condition), given), known


def _origin(
    axis: FloatArray,
    substructures: Mapping[str, Frf],
    joints: tuple[Joint, ...],
    held: Mapping[str, NDArray[np.bool_]],
) -> MixedAssembly:
    """Return how the assembly is computed again, held parts by their dynamic stiffness if known."""
    possible = {
        name: lines & isinstance(substructures[name]._origin, SystemOrigin)
        for name, lines in held.items()
    }
    return MixedAssembly(axis, substructures, joints, possible)


def _refuse_lost(
    origin: MixedAssembly,
    substructures: Mapping[str, Frf],
    held: Mapping[str, NDArray[np.bool_]],
    axis: FloatArray,
) -> None:
    """Refuse lines where a joint's motion is no more than round-off, the parts' last digit's.

    Its bound must be below the largest response of that end to any force on the parts.
    """
    parts = [name for name, lines in held.items() if lines.any()]
    ends = [(name, label) for name in parts for _, label, _ in ends_of(name, origin.joints)]
    rows = tuple(dict.fromkeys(label for _, label in ends))
    columns = tuple(dict.fromkeys(c for part in substructures.values() for c in part.excitations))
    found = origin.receptances(axis, rows, columns, False)
    size = np.abs(found.values).max(axis=2)
    own = [columns.index(label) for label in rows]
    lost = ~(found.bound[:, range(len(rows)), own] < size).all(axis=1)
    if lost.any():
        raise lost_digits(axis[lost], parts)


def _common_axis(substructures: Mapping[str, Frf]) -> tuple[FloatArray, Quantity]:
    if not substructures:
        raise FbsError("no substructures given")
    (first_name, first), *others = substructures.items()
    for name, frf in others:
        pair = f"substructures {first_name!r} and {name!r}"
        if frf.quantity != first.quantity:
            raise QuantityMismatchError(
                f"{pair}: {first.quantity} against {frf.quantity}; convert with to"
            )
        require_same_frequency(first.frequency, frf.frequency, f"the axes of {pair} differ")
    if first.quantity.derivative and first.frequency[0] == 0:
        raise QuantityMismatchError(
            f"every {first.quantity} vanishes at 0 Hz and cannot be coupled there; "
            "couple receptances, or leave that line out with band"
        )
    return first.frequency, first.quantity


def _require_interface(joint: Joint, substructures: Mapping[str, Frf]) -> None:
    for name, label in (joint.first, joint.second):
        if name not in substructures:
            known = ", ".join(substructures)
            raise UnknownDofError(f"{joint}: there is no substructure {name!r}, only {known}")
        frf = substructures[name]
        for role, labels in (("responses", frf.responses), ("excitations", frf.excitations)):
            if label in labels:
                continue
            if label in frf.responses + frf.excitations:
                raise UnknownDofError(
                    f"{joint}: {label!r} is not among the {role} of {name!r}; "
                    "a joint needs its DoF as response and as excitation"
                )
            raise unknown_dof(label, labels, f"{joint}: substructure {name!r}")


def rigid_groups(joints: Sequence[Joint]) -> dict[Node, tuple[Node, float]]:
    """Return (representative, multiple of its motion) for every rigidly tied node.

    Raises
    ------
    JointError
        A tie that closes a ring.
    """
    parent: dict[Node, tuple[Node, float]] = {}

    def root(node: Node) -> tuple[Node, float]:
        multiple = 1.0
        while parent.get(node, (node, 1.0))[0] != node:
            node, step = parent[node]
            multiple *= step
        return node, multiple

    for joint in joints:
        if not joint.rigid:
            continue
        (first, of_first), (second, of_second) = root(joint.first), root(joint.second)
        if first == second:
            raise JointError(
                f"{joint} is redundant: other rigid joints tie these two already, "
                "and the kernel would be singular at every line; leave it out"
            )
        parent[second] = (first, of_first / (joint.ratio * of_second))
        parent.setdefault(first, (first, 1.0))
    return {node: root(node) for node in parent}


def refuse_ambiguous(labels: Mapping[str, Iterable[str]], groups: Groups) -> None:
    """Refuse a label that several substructures have and that is not one motion.

    Raises
    ------
    AmbiguousDofError
    """
    owner: dict[str, str] = {}
    for name, own in labels.items():
        for label in own:
            other = owner.setdefault(label, name)
            if other == name:
                continue
            one, two = groups.get((other, label)), groups.get((name, label))
            if one is None or one != two:
                raise AmbiguousDofError(
                    f"{label!r} is in {other!r} and in {name!r}, and no rigid joint makes them "
                    "one motion; give one of them another name with Frf.renamed"
                )


def _ends(name: str, frf: Frf, joints: Sequence[Joint]) -> list[End]:
    """Return the entries of B in a substructure."""
    return [
        End(k, frf.responses.index(label), frf.excitations.index(label), sign)
        for k, label, sign in ends_of(name, joints)
    ]


@dataclass(frozen=True, eq=False)
class _Kernel:
    """What is known of B Y B^T + 1/Z on all lines.

    inverse : (nj, nj, nf); condition : (nf,); held : (n_part, nf), see `HELD`
    """

    inverse: ComplexArray
    condition: FloatArray
    held: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Kernels:
    """Substructures' FRFs (n_response, n_excitation, nf), and the ends of the joints in each."""

    frfs: dict[str, ComplexArray]
    ends: dict[str, list[End]]
    joints: tuple[Joint, ...]

    def inverted_kernel(self, omega: FloatArray, quantity: Quantity) -> _Kernel:
        """Invert the kernel and see which parts it holds, some lines at a time."""
        count = len(self.joints)
        inverse = np.empty((count, count, omega.size), dtype=complex)
        condition = np.ones(omega.size)
        held = np.zeros((len(self.frfs), omega.size), dtype=bool)

        def invert(lines: slice) -> None:
            found = self._inverted(omega[lines], lines, quantity)
            inverse[:, :, lines], condition[lines] = found
            for row, name in zip(held, self.frfs, strict=True):
                row[lines] = self._is_held(name, lines, inverse[:, :, lines])

        if count:
            each(invert, stretches(omega.size, LINES), inverse.nbytes)
        return _Kernel(inverse, condition, held)

    def _is_held(self, name: str, lines: slice, inverse: ComplexArray) -> NDArray[np.bool_]:
        """Whether |Y_c| < `HELD` |Y| at one of a part's joints."""
        held = np.zeros(lines.stop - lines.start, dtype=bool)
        ends, frf = self.ends[name], self.frfs[name][:, :, lines]
        for at in ends:
            own = frf[at.response, at.excitation]
            taken = np.zeros(held.size, dtype=complex)
            for one, other in product(ends, repeat=2):
                gain = one.sign * other.sign * inverse[one.joint, other.joint]
                taken += (
                    frf[at.response, one.excitation] * gain * frf[other.response, at.excitation]
                )
            held |= np.abs(own - taken) < HELD * np.abs(own)
        return held

    def _inverted(
        self, omega: FloatArray, lines: slice, quantity: Quantity
    ) -> tuple[ComplexArray, FloatArray]:
        """Invert the kernel K as G = S K S, S by `joint_scaling` from the moduli on its diagonal.

        The condition is ||S (spread + |1/Z|) S|| ||G^-1||, for one joint
        (|h_a| + |h_b| + |1/Z|) / |h_a + h_b + 1/Z|.
        """
        flexible = Flexible.of(self.joints, omega, (1j * omega) ** quantity.derivative)
        kernel, spread = self._kernel(lines)
        kernel = flexible.to_springs(kernel)
        spread = flexible.to_springs(spread, moduli=True)
        diagonal = np.arange(len(kernel))
        scale, own = joint_scaling(spread[diagonal, diagonal], flexible.values)
        both = scale[:, None] * scale
        scaled, bound = kernel * both, spread * both
        for k, flexibility in own.items():
            scaled[k, k] += flexibility
            bound[k, k] += np.abs(flexibility)
        inverse, singular = _batched.inverse(scaled.transpose(2, 0, 1))
        inverse = inverse.transpose(1, 2, 0)
        condition = _row_sum_norm(bound) * _row_sum_norm(inverse)
        condition[singular] = np.inf
        unscaled = np.asarray(inverse * both, dtype=complex)
        return flexible.from_springs(unscaled), condition

    def _kernel(self, lines: slice) -> tuple[ComplexArray, FloatArray]:
        """Return B Y B^T and the sum of the moduli that make it up, shape (nj, nj, lines)."""
        count, n_lines = len(self.joints), lines.stop - lines.start
        kernel = np.zeros((count, count, n_lines), dtype=complex)
        spread = np.zeros((count, count, n_lines))
        for name, frf in self.frfs.items():
            for one, other in product(self.ends[name], repeat=2):
                entry = one.sign * other.sign * frf[one.response, other.excitation, lines]
                kernel[one.joint, other.joint] += entry
                spread[one.joint, other.joint] += np.abs(entry)
        return kernel, spread


def _row_sum_norm(matrices: NDArray[np.complex128] | FloatArray) -> FloatArray:
    norm: FloatArray = np.abs(matrices).sum(axis=1).max(axis=0)
    return norm

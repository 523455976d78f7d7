"""Coupling of substructures by their FRFs, through rigid and flexible joints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ._assembly import End, Layout, assemble
from ._kernels import batched as _batched
from ._kernels.blocks import each, stretches
from ._kernels.checks import ComplexArray, FloatArray, read_only
from ._kernels.joint_scaling import joint_scaling
from .errors import (
    AmbiguousDofError,
    FbsError,
    JointError,
    QuantityMismatchError,
    UnknownDofError,
    singular_kernel,
    unknown_dof,
)
from .frf import Frf, Quantity, computed_frf, require_same_frequency

LINES = 4096
"""Lines at once of what stays in the cache."""

Node = tuple[str, str]
Groups = Mapping[Node, tuple[Node, float]]


@dataclass(frozen=True)
class Joint:
    """f = (k + jwc) (n u_second - u_first), acting on `first`; k = None: u_first = n u_second.

    Parameters
    ----------
    first, second : (substructure name, DoF label)
    stiffness : float or None
        N/m; None is a rigid joint. May be negative (a stiffness taken away).
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
    stiffness: float | None = None
    damping: float = 0.0
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for end in (self.first, self.second):
            if not (isinstance(end, tuple) and len(end) == 2):
                raise JointError(f"a joint's end is (substructure, DoF label), got {end!r}")
        if self.first == self.second:
            raise JointError(f"{self}: both ends are the same")
        if not np.isfinite(self.ratio) or self.ratio == 0:
            raise JointError(f"{self}: the ratio must be finite and not 0, got {self.ratio}")
        if self.rigid:
            if self.damping != 0:
                raise JointError(f"{self}: a rigid joint (stiffness None) takes no damping")
        elif not all(map(math.isfinite, (self.stiffness or 0.0, self.damping))):
            raise JointError(f"{self}: stiffness and damping must be finite; None is rigid")
        elif self.stiffness == 0 and self.damping == 0:
            raise JointError(f"{self}: no stiffness and no damping joins nothing; leave it out")

    @property
    def rigid(self) -> bool:
        """Whether both ends move as one."""
        return self.stiffness is None

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return Z = k + jwc, shape (nf,), N/m; a rigid joint has none."""
        if self.stiffness is None:
            raise JointError(f"{self} is rigid")
        return np.asarray(self.stiffness + 1j * omega * self.damping)

    def __str__(self) -> str:
        return f"joint {'.'.join(self.first)} - {'.'.join(self.second)}"


@dataclass(frozen=True, eq=False)
class CoupledFrf:
    """What `couple` returns.

    Parameters
    ----------
    frf : Frf
        Of the assembly; each label once.
    kernel_condition : array, shape (nf,)
        How many times larger a relative error of the substructures' interface FRFs is in the
        joint forces. (Where Y_c is much smaller than Y, as for a free stage near 0 Hz that the
        joints hold, the subtraction loses the ratio of the two on top.)
    joints : tuple of Joint
    """

    frf: Frf
    kernel_condition: FloatArray
    joints: tuple[Joint, ...]


def couple(
    substructures: Mapping[str, Frf],
    joints: Sequence[Joint],
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
) -> CoupledFrf:
    """Couple: Y_c = Y - Y B^T (B Y B^T + Z^-1)^-1 B Y, Z = k + jwc per joint.

    The dual form of de Klerk, Rixen & Voormeeren (2008), General framework for dynamic
    substructuring, AIAA J. 46(5), with B one signed row per joint (+1 first, -n second) and
    Z^-1 = 0 for rigid joints. Y stays in its blocks; no block-diagonal matrix is formed, and of
    Y_c only what is asked for: the kernel needs the joints' DoFs and no others.

    The the paper's Eq. (15) is the case of two substructures A, B and rigid joints, provided the
    last block of its column is -B_H_jc: with Y B^T = [A_H_ic; A_H_cc; -B_H_jc], compatibility
    u_A = u_B asks for the minus sign, and without it every FRF between A and B changes sign. For
    flexible joints its kernel is (A_H_cc + B_H_cc + K_s^-1)^-1, inverted as a whole; the printed
    formula lacks that inverse.

    Parameters
    ----------
    substructures : mapping of str to Frf
        All on one frequency axis and of one quantity. Responses and excitations may differ, but
        the DoFs of a joint must be both.
    joints : sequence of Joint
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
    JointError
        A rigid joint that follows from the others.
    AmbiguousDofError, UnknownDofError, AxisMismatchError, QuantityMismatchError
    """
    axis, quantity = _common_axis(substructures)
    for joint in joints:
        _require_interface(joint, substructures)
    groups = _rigid_groups(joints)
    _refuse_ambiguous(substructures, groups)
    layout = Layout.of(substructures, responses, excitations)
    interface = _Interface(
        {name: frf.values.transpose(1, 2, 0) for name, frf in substructures.items()},
        {name: _ends(name, frf, joints) for name, frf in substructures.items()},
        tuple(joints),
    )
    inverse, condition = interface.inverted_kernel(2 * np.pi * axis, quantity)
    singular = ~(condition <= 1 / (10 * np.finfo(float).eps))
    if singular.any():
        raise singular_kernel(axis[singular], "coupling")
    values, finite = assemble(layout, interface.frfs, interface.ends, inverse)
    frf = computed_frf(
        axis, values.transpose(2, 0, 1), layout.responses, layout.excitations, quantity, finite
    )
    return CoupledFrf(frf, read_only(condition), tuple(joints))


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


def _rigid_groups(joints: Sequence[Joint]) -> dict[Node, tuple[Node, float]]:
    """Return (representative, multiple of its motion) for every rigidly tied node.

    A tie that closes a ring is refused.
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


def _refuse_ambiguous(substructures: Mapping[str, Frf], groups: Groups) -> None:
    owner: dict[str, str] = {}
    for name, frf in substructures.items():
        for label in dict.fromkeys(frf.responses + frf.excitations):
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
        for k, joint in enumerate(joints)
        for (owner, label), sign in ((joint.first, 1.0), (joint.second, -joint.ratio))
        if owner == name
    ]


@dataclass(frozen=True, eq=False)
class _Interface:
    """Substructures' FRFs (n_response, n_excitation, nf), and the ends of the joints in each."""

    frfs: dict[str, ComplexArray]
    ends: dict[str, list[End]]
    joints: tuple[Joint, ...]

    def inverted_kernel(
        self, omega: FloatArray, quantity: Quantity
    ) -> tuple[ComplexArray, FloatArray]:
        """Return (B Y B^T + 1/Z)^-1, shape (nj, nj, nf), and its condition, shape (nf,)."""
        count = len(self.joints)
        inverse = np.empty((count, count, omega.size), dtype=complex)
        condition = np.ones(omega.size)

        def invert(lines: slice) -> None:
            found = self._inverted(omega[lines], lines, quantity)
            inverse[:, :, lines], condition[lines] = found

        if count:
            each(invert, stretches(omega.size, LINES), inverse.nbytes)
        return inverse, condition

    def _inverted(
        self, omega: FloatArray, lines: slice, quantity: Quantity
    ) -> tuple[ComplexArray, FloatArray]:
        """Invert the kernel K as G = S K S, S by `joint_scaling` from the moduli on its diagonal.

        The condition is ||S (spread + |1/Z|) S|| ||G^-1||, for one joint
        (|h_a| + |h_b| + |1/Z|) / |h_a + h_b + 1/Z|.
        """
        kernel, spread = self._kernel(lines)
        diagonal = np.arange(len(kernel))
        scale, own = joint_scaling(spread[diagonal, diagonal], self._stiffness(omega, quantity))
        both = scale[:, None] * scale
        scaled, bound = kernel * both, spread * both
        for k, flexibility in own.items():
            scaled[k, k] += flexibility
            bound[k, k] += np.abs(flexibility)
        inverse, singular = _batched.inverse(scaled.transpose(2, 0, 1))
        inverse = inverse.transpose(1, 2, 0)
        condition = _row_sum_norm(bound) * _row_sum_norm(inverse)
        condition[singular] = np.inf
        return np.asarray(inverse * both, dtype=complex), condition

    def _stiffness(self, omega: FloatArray, quantity: Quantity) -> dict[int, ComplexArray]:
        """Return Z of the flexible joints, per displacement, velocity or acceleration."""
        factor = (1j * omega) ** quantity.derivative
        return {
            k: joint.dynamic_stiffness(omega) / factor
            for k, joint in enumerate(self.joints)
            if not joint.rigid
        }

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

r"""The coupled FRFs of truncated parts, and how far they can be from those of the whole parts.

Each truncated part lacks E(f, f') = a(f)^T W a(f') with || W - c || <= rho (`truncation_bound`).
Stacked over the parts, Y = Y~ + a^T W a, W and the numbers c and rho block by block. With B the
signed joints (`couple`), G~ = (B Y~ B^T + 1/Z)^-1 and p_j = e_j - B^T G~ B Y~ e_j the forces on the
parts, joints' included, under a unit force at j, the coupled FRFs differ by

    Y_c - Y~_c = p_i^T a^T W (1 + Q W)^-1 a p_j,   Q = a B^T G~ B a^T,

which is Woodbury's formula for the kernel, exact, whatever is missing.

First, the middle of the disc: Y' = Y~ + c a^T a is as good as one residual more. It is known at
the ports, and is coupled as Y~ is. From it Y is only a^T (W - c) a away; so with p', G' and
Q' = a B^T G' B a^T of Y', and V = rho^(-1/2) (W - c) rho^(-1/2), ||V|| <= 1,

    Y_c - Y'_c = u_i^T V (1 + K V)^-1 u_j,   u_j = rho^(1/2) a p'_j,   K = rho^(1/2) Q' rho^(1/2).

If k = ||K|| < 1, 1 + K V has an inverse of norm 1 / (1 - k) at most (Neumann), and so there is one
of the kernel of the whole parts, det(1 + X Y) being det(1 + Y X): the assembly has no pole there.
Then (Cauchy & Schwarz)

    |Y_c - Y'_c| <= ||u_i|| ||u_j|| / (1 - k),

and any other FRF, such as Y~_c, is at most |Y~_c - Y'_c| further away.

K = A G' A^T with A = rho^(1/2) a B^T, one column a joint: k is taken as Frobenius' norm,
k^2 = tr(G'^H S G' S*), S = A^H A, which is never below the spectral one. Nothing here depends on
the units of a DoF or on how joints are scaled. p'_j is nearly 0 where the part's motion is set by
the others, so that the bound is not the sum of all parts' worst cases.

Round-off is a share of its own. A part's receptances are right to s_i s_j (`truncation_bound`; a
given FRF to eps of its entries); to invert the kernel and to round 1/Z changes it by
m eps sqrt(d_k d_l) at most, d_k the moduli added up on its diagonal (Gauss, in the joints' scale),
m the number of joints. As above, with lambda_j = G' B Y' e_j the joint forces and
g_k = s_k + (m eps d_k)^(1/2), s_k the sum of both ends' times |B|,

    |Y'_c computed - Y'_c| <= r_i r_j / (1 - q),   r_j = s_j + sum_k |lambda_kj| g_k,

q = sum_kl g_k |G'_kl| g_l; where that is 1, nothing is left of the line's digits. It is taken
twice: the numbers of the bound are rounded, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels import batched as _batched
from ._kernels.blas_threads import one_blas_thread
from ._kernels.blocks import stretches
from ._kernels.checks import (
    ComplexArray,
    FloatArray,
    ascending_frequency,
    read_only,
    unique_labels,
)
from ._kernels.joint_scaling import joint_scaling
from .coupling import Joint, Node, refuse_ambiguous, rigid_groups
from .errors import QuantityMismatchError, UnknownDofError, singular_kernel, unknown_dof
from .frf import Frf, Quantity, require_same_frequency, require_same_layout
from .modal_synthesis import modal_frf
from .modal_truncation import TruncatedModes, truncate
from .second_order_system import SecondOrderSystem
from .truncation_bound import GivenPart, Missing, PartLines, RayleighPart, no_guarantee
from .undamped_modes import EPS, RealModes, Selection
from .viscous_bound import ViscousPart

BLOCK = 2048
"""Lines at once: what belongs to a few ports and joints stays in the cache."""


class Reason(IntEnum):
    """Whether there is a bound at a line, and why not."""

    BOUNDED = 0
    PART = 1
    """A left-out mode may lie at the line or below it, or damping leaves no guarantee."""
    JOINTS = 2
    """k is not below 1: left-out modes may shift a resonance of the assembly to the line."""
    ROUND_OFF = 3
    """q is not below 1: the parts' round-off leaves no digit."""


@dataclass(frozen=True, eq=False)
class TruncatedPart:
    """A part of which some modes are left out.

    Parameters
    ----------
    system : SecondOrderSystem
    modes : TruncatedModes
    """

    system: SecondOrderSystem
    modes: TruncatedModes

    @classmethod
    def of(
        cls,
        system: SecondOrderSystem,
        keep: Selection = slice(None),
        residual_order: int | None = None,
        modes: RealModes | None = None,
    ) -> TruncatedPart:
        """Leave modes out as `truncate` does; by default none.

        Raises
        ------
        As `truncate`.
        """
        return cls(system, truncate(system, keep, residual_order, modes))


Part = TruncatedPart | SecondOrderSystem | Frf


@dataclass(frozen=True, eq=False)
class BoundedFrf:
    """What `bounded_frf` returns: the exact FRF lies within `radius` + `round_off` of `centre`.

    Parameters
    ----------
    frf : Frf
        Of the truncated parts.
    centre : Frf
    radius, round_off : array, shape (nf, n_response, n_excitation), m/N
        Infinite where there is no bound.
    reason : array of Reason, shape (nf,)
    kernel : array, shape (nf,)
        k, which must be below 1.
    """

    frf: Frf
    centre: Frf
    radius: FloatArray
    round_off: FloatArray
    reason: NDArray[np.int8]
    kernel: FloatArray

    @property
    def truncation(self) -> FloatArray:
        """How far `frf` is from the whole parts' at most, but for round-off; m/N."""
        return np.asarray(np.abs(self.frf.values - self.centre.values) + self.radius)

    @property
    def bound(self) -> FloatArray:
        """Of |frf - exact|, round-off included; shape (nf, n_response, n_excitation), m/N."""
        return self.truncation + self.round_off

    def of(self, frf: Frf) -> FloatArray:
        """Bound the error of any other FRF of the same lines and labels, as `couple_chain`'s."""
        require_same_layout(self.centre, frf)
        return np.asarray(np.abs(frf.values - self.centre.values) + self.radius + self.round_off)

    def decibels(self) -> FloatArray:
        """Return the largest |20 log10 |exact / frf|| that the bound b allows.

        |exact| is |frf| - b at least and |frf| + b at most, and the lower side is further away in
        decibels: -20 log10(1 - b / |frf|), infinite where b >= |frf|, an antiresonance deeper
        than the bound.
        """
        return decibels(self.bound, np.abs(self.frf.values))


def decibels(bound: FloatArray, modulus: FloatArray) -> FloatArray:
    """Return -20 log10(1 - b / h); infinite where b >= h, 0 where both vanish."""
    share = np.divide(bound, modulus, out=np.full_like(bound, np.inf), where=modulus > 0)
    share[(bound == 0) & (modulus == 0)] = 0.0
    with np.errstate(divide="ignore"):
        return np.asarray(-20 * np.log10(1 - share.clip(max=1.0)))


def bounded_frf(
    parts: Mapping[str, Part],
    joints: Sequence[Joint],
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
) -> BoundedFrf:
    """Couple parts of which modes are left out, and enclose the FRFs of the whole parts.

    Parameters
    ----------
    parts : mapping of str to TruncatedPart, SecondOrderSystem or Frf
        Systems are complete; FRFs are receptances on the same lines, and taken as they are.
    joints : sequence of Joint
        As for `couple`; none: a part's own FRFs.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels
        Of any parts; a label that several of them have is the first one's.

    Returns
    -------
    BoundedFrf

    Raises
    ------
    SingularLineError
        A line on an undamped pole of a truncated part, or of the assembly of them.
    UnknownDofError, AxisMismatchError, FbsError
    """
    axis = ascending_frequency(frequency)
    rows = unique_labels(responses, "the responses")
    columns = unique_labels(excitations, "the excitations")
    assembly = _Assembly.of(parts, joints, axis, rows, columns)
    shape = (len(rows), len(columns), axis.size)
    result = _Result(
        np.zeros(shape, complex), np.zeros(shape, complex), np.zeros(shape), np.zeros(shape),
        np.zeros(axis.size, np.int8), np.zeros(axis.size),
    )  # fmt: skip
    with one_blas_thread():
        for lines in stretches(axis.size, BLOCK):
            assembly.write(lines, result)
    frf, centre = (
        Frf(axis, values.transpose(2, 0, 1), rows, columns)
        for values in (result.frf, result.centre)
    )
    radius, round_off = (
        read_only(values.transpose(2, 0, 1)) for values in (result.radius, result.round_off)
    )
    return BoundedFrf(
        frf, centre, radius, round_off, read_only(result.reason), read_only(result.kernel)
    )


@dataclass(frozen=True, eq=False)
class _Result:
    """What is written line by line; (n_response, n_excitation, nf), and (nf,)."""

    frf: ComplexArray
    centre: ComplexArray
    radius: FloatArray
    round_off: FloatArray
    reason: NDArray[np.int8]
    kernel: FloatArray


@dataclass(frozen=True, eq=False)
class _Ports:
    """Where a part's ports stand.

    Parameters
    ----------
    rows, columns : tuple of str
        Labels of its receptances.
    ends : tuple of (joint, row, column, entry of B)
    responses, excitations : tuple of (place in the result, row or column)
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    ends: tuple[tuple[int, int, int, float], ...]
    responses: tuple[tuple[int, int], ...]
    excitations: tuple[tuple[int, int], ...]

    @classmethod
    def of(
        cls,
        name: str,
        part: Part,
        joints: Sequence[Joint],
        owners: tuple[Sequence[Node], Sequence[Node]],
    ) -> _Ports:
        sides = [
            (k, label, sign)
            for k, joint in enumerate(joints)
            for (owner, label), sign in ((joint.first, 1.0), (joint.second, -joint.ratio))
            if owner == name
        ]
        own = [
            [(place, label) for place, (owner, label) in enumerate(nodes) if owner == name]
            for nodes in owners
        ]
        interface = [label for _, label, _ in sides]
        rows, columns = (
            tuple(dict.fromkeys([*interface, *(label for _, label in asked)])) for asked in own
        )
        if not isinstance(part, Frf):  # what it lacks lies between the same ports
            rows = columns = tuple(dict.fromkeys([*rows, *columns]))
        return cls(
            rows,
            columns,
            tuple((k, rows.index(label), columns.index(label), sign) for k, label, sign in sides),
            tuple((place, rows.index(label)) for place, label in own[0]),
            tuple((place, columns.index(label)) for place, label in own[1]),
        )


@dataclass(frozen=True, eq=False)
class _Assembly:
    """Parts, their ports and the joints, ready to be coupled on any lines."""

    axis: FloatArray
    joints: tuple[Joint, ...]
    parts: Mapping[str, GivenPart | RayleighPart | ViscousPart]
    ports: Mapping[str, _Ports]
    shape: tuple[int, int]
    reciprocal: bool

    @classmethod
    def of(
        cls,
        parts: Mapping[str, Part],
        joints: Sequence[Joint],
        axis: FloatArray,
        rows: Sequence[str],
        columns: Sequence[str],
    ) -> _Assembly:
        labels = {name: _labels(part) for name, part in parts.items()}
        _require_ends(joints, labels)
        every = {name: dict.fromkeys(one + other) for name, (one, other) in labels.items()}
        refuse_ambiguous(every, rigid_groups(joints))
        owners = (
            [_owner(label, {name: own[0] for name, own in labels.items()}) for label in rows],
            [_owner(label, {name: own[1] for name, own in labels.items()}) for label in columns],
        )
        ports = {name: _Ports.of(name, part, joints, owners) for name, part in parts.items()}
        used = {name: own for name, own in ports.items() if own.rows and own.columns}
        prepared = {name: _prepared(name, parts[name], axis, own) for name, own in used.items()}
        given = any(isinstance(parts[name], Frf) for name in used)
        return cls(
            axis, tuple(joints), prepared, used, (len(rows), len(columns)),
            tuple(rows) == tuple(columns) and not given,
        )  # fmt: skip

    def write(self, lines: slice, result: _Result) -> None:
        """Couple on some lines, and enclose."""
        found = {name: part.on(lines) for name, part in self.parts.items()}
        known = {name: part.receptance for name, part in found.items()}
        missing = {n: part.missing for n, part in found.items() if part.missing is not None}
        better = {
            name: values + missing[name].known if name in missing else values
            for name, values in known.items()
        }
        omega = 2 * np.pi * self.axis[lines]
        result.frf[:, :, lines] = _Coupled.of(self, known, omega, lines).values()
        coupled = _Coupled.of(self, better, omega, lines)
        result.centre[:, :, lines] = coupled.values()
        responding, excited = coupled.responding(), coupled.excited()
        kernel, sizes = coupled.kernel_norm(missing), coupled.sizes(missing, excited)
        left = sizes if self.reciprocal else coupled.sizes(missing, responding, responses=True)
        spread, digits = coupled.round_off(found, responding, excited)
        lost = np.zeros(omega.size, dtype=bool)
        for own in missing.values():
            lost |= ~np.isfinite(own.radius)
        reason = np.select(
            [lost, ~(digits < 1), ~(kernel < 1)], [Reason.PART, Reason.ROUND_OFF, Reason.JOINTS], 0
        )
        result.reason[lines] = reason
        result.kernel[lines] = kernel
        with np.errstate(divide="ignore", invalid="ignore"):
            radius = left[:, None] * sizes / (1 - kernel)
            round_off = 2 * spread / (1 - digits)
        result.radius[:, :, lines] = np.where(reason, np.inf, radius)
        result.round_off[:, :, lines] = np.where(digits < 1, round_off, np.inf)


@dataclass(frozen=True, eq=False)
class _Coupled:
    """Parts' receptances (n_row, n_column, nf) coupled on some lines, in the module's notation.

    `inverse` is G, `scale` the joints' scaling; `excited_by` is B Y, `responds` Y B^T.
    """

    assembly: _Assembly
    frfs: Mapping[str, ComplexArray]
    inverse: ComplexArray
    scale: FloatArray
    excited_by: ComplexArray
    responds: ComplexArray

    @classmethod
    def of(
        cls,
        assembly: _Assembly,
        frfs: Mapping[str, ComplexArray],
        omega: FloatArray,
        lines: slice,
    ) -> _Coupled:
        m, (n_rows, n_columns) = len(assembly.joints), assembly.shape
        kernel = np.zeros((m, m, omega.size), complex)
        moduli = np.zeros((m, omega.size))
        excited_by = np.zeros((m, n_columns, omega.size), complex)
        responds = np.zeros((n_rows, m, omega.size), complex)
        for name, values in frfs.items():
            ports = assembly.ports[name]
            for k, row, column, sign in ports.ends:
                moduli[k] += sign**2 * np.abs(values[row, column])
                for other, _, at, sign_there in ports.ends:
                    kernel[k, other] += sign * sign_there * values[row, at]
                for place, at in ports.excitations:
                    excited_by[k, place] += sign * values[row, at]
                for place, at in ports.responses:
                    responds[place, k] += sign * values[at, column]
        stiffness = {
            k: joint.dynamic_stiffness(omega)
            for k, joint in enumerate(assembly.joints)
            if not joint.rigid
        }
        scale, own = joint_scaling(moduli, stiffness)
        both = scale[:, None] * scale
        kernel *= both
        for k, flexibility in own.items():
            kernel[k, k] += flexibility
        inverse, singular = _batched.inverse(kernel.transpose(2, 0, 1))
        if singular.any():
            raise singular_kernel(assembly.axis[lines][singular], "coupling")
        inverse = inverse.transpose(1, 2, 0) * both
        return cls(assembly, frfs, inverse, scale, excited_by, responds)

    def values(self) -> ComplexArray:
        """Return Y_c between what is asked for."""
        forces = self.excited()
        values = -_product(self.responds, forces)
        for name, frf in self.frfs.items():
            ports = self.assembly.ports[name]
            for place, row in ports.responses:
                for other, column in ports.excitations:
                    values[place, other] += frf[row, column]
        return values

    def excited(self) -> ComplexArray:
        """Return the joint forces per unit excitation, shape (n_joint, n_excitation, nf)."""
        return _product(self.inverse, self.excited_by)

    def responding(self) -> ComplexArray:
        """Return what they would be per unit force at the responses, reciprocally."""
        return _product(self.responds, self.inverse).transpose(1, 0, 2)

    def sizes(
        self, missing: Mapping[str, Missing], forces: ComplexArray, responses: bool = False
    ) -> FloatArray:
        """Return ||u_j||, shape (n, nf), of the excitations (or responses)."""
        total = np.zeros(forces.shape[1:])
        for name, own in missing.items():
            ports = self.assembly.ports[name]
            on_part = np.zeros((len(ports.rows), *forces.shape[1:]), complex)
            for place, at in ports.responses if responses else ports.excitations:
                on_part[at, place] += 1
            for k, row, _, sign in ports.ends:
                on_part[row] -= sign * forces[k]
            square = (np.abs(own.acting(on_part)) ** 2).sum(axis=0)
            total += np.where(np.isfinite(own.radius), own.radius, 0.0) * square
        return np.asarray(np.sqrt(total))

    def kernel_norm(self, missing: Mapping[str, Missing]) -> FloatArray:
        """Return k, shape (nf,)."""
        weights = np.zeros_like(self.inverse)
        for name, own in missing.items():
            radius = np.where(np.isfinite(own.radius), own.radius, 0.0)
            gram = own.gram()
            for k, row, _, sign in self.assembly.ports[name].ends:
                for other, at, _, sign_there in self.assembly.ports[name].ends:
                    weights[k, other] += sign * sign_there * radius * gram[row, at]
        inner = _product(_product(weights, self.inverse), weights.conj())
        square = (self.inverse.conj() * inner).real.sum(axis=(0, 1))
        return np.asarray(np.sqrt(square.clip(min=0.0)))

    def round_off(
        self, found: Mapping[str, PartLines], responding: ComplexArray, excited: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return r_i r_j, shape (n_response, n_excitation, nf), and q, shape (nf,)."""
        m = len(self.assembly.joints)
        at_joints = np.divide(
            np.sqrt(m * EPS), self.scale, out=np.zeros_like(self.scale), where=self.scale > 0
        )
        left = np.zeros(responding.shape[1:])
        right = np.zeros(excited.shape[1:])
        for name, part in found.items():
            ports, (of_rows, of_columns) = self.assembly.ports[name], part.sizes
            for k, row, column, sign in ports.ends:
                at_joints[k] += abs(sign) * np.maximum(of_rows[row], of_columns[column])
            for place, at in ports.responses:
                left[place] += of_rows[at]
            for place, at in ports.excitations:
                right[place] += of_columns[at]
        left += (np.abs(responding) * at_joints[:, None]).sum(axis=0)
        right += (np.abs(excited) * at_joints[:, None]).sum(axis=0)
        digits = (np.abs(self.inverse) * at_joints[:, None] * at_joints).sum(axis=(0, 1))
        return left[:, None] * right, digits


def _product(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Multiply matrices whose last axis is frequency."""
    total = np.zeros((left.shape[0], *right.shape[1:]), complex)
    for k in range(len(right)):
        total += left[:, k, None] * right[k]
    return total


def _labels(part: Part) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return responses and excitations."""
    if isinstance(part, Frf):
        return part.responses, part.excitations
    system = part.system if isinstance(part, TruncatedPart) else part
    return system.labels, system.labels


def _require_ends(
    joints: Sequence[Joint], labels: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]]
) -> None:
    for joint in joints:
        for name, label in (joint.first, joint.second):
            if name not in labels:
                known = ", ".join(labels)
                raise UnknownDofError(f"{joint}: there is no part {name!r}, only {known}")
            for own in labels[name]:
                if label not in own:
                    raise unknown_dof(label, own, f"{joint}: part {name!r}")


def _owner(label: str, labels: Mapping[str, Sequence[str]]) -> Node:
    for name, own in labels.items():
        if label in own:
            return name, label
    raise unknown_dof(label, [label for own in labels.values() for label in own], "the assembly")


def _prepared(
    name: str, part: Part, axis: FloatArray, ports: _Ports
) -> GivenPart | RayleighPart | ViscousPart:
    """Do what all lines share: the modes, and what is left of those left out."""
    if isinstance(part, Frf):
        if part.quantity is not Quantity.RECEPTANCE:
            raise QuantityMismatchError(
                f"part {name!r} is {part.quantity}; receptances are coupled, convert with to"
            )
        require_same_frequency(axis, part.frequency, f"the axis of part {name!r} differs")
        return GivenPart(part.select(ports.rows, ports.columns))
    truncated = TruncatedPart.of(part) if isinstance(part, SecondOrderSystem) else part
    system, modes = truncated.system, truncated.modes
    if no_guarantee(system, modes) is not None:
        frf = modal_frf(system, axis, ports.rows, ports.columns, modes=modes)
        return GivenPart(frf, complete=False)
    found = RayleighPart.of(system, modes, axis, ports.rows)
    return ViscousPart.of(system, modes, axis, ports.rows) if found is None else found

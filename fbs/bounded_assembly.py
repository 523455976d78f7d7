"""Parts of which modes are left out, their ports and joints, and their coupling at these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ._assembly import End
from ._kernels import batched as _batched
from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.joint_scaling import joint_scaling
from .axes import require_same_frequency
from .coupling import refuse_ambiguous, rigid_groups
from .damped_modes import rayleigh_coefficients
from .errors import JointError, QuantityMismatchError, UnknownDofError, singular_kernel, unknown_dof
from .frf import Frf, Quantity
from .joints import AnyJoint, Joint, Node
from .modal_synthesis import modal_frf
from .modal_truncation import TruncatedModes, truncate
from .second_order_system import SecondOrderSystem
from .truncation_bound import Ends, PartLines, given_part, no_guarantee, rayleigh_part
from .undamped_modes import RealModes, Selection
from .viscous_bound import viscous_part


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

    @property
    def no_guarantee(self) -> str | None:
        """Why nothing can be guaranteed, at any line; None if it can."""
        if self.modes.left_out is None:
            return "a rigid-body mode is left out: what it adds, -1/w^2, has no bound"
        if rayleigh_coefficients(self.system) is not None:
            return None
        if self.modes.residuals:
            return "residuals of left-out modes need viscous damping C = alpha M + beta K, or none"
        return no_guarantee(self.system)


Part = TruncatedPart | SecondOrderSystem | Frf


@dataclass(frozen=True, eq=False)
class Ports:
    """Where a part's ports stand.

    Parameters
    ----------
    rows, columns : tuple of str
        Labels of its receptances.
    joints : tuple of int
        Each with its end here.
    row_ends, column_ends : Ends
    responses, excitations : tuple of (place in the result, row or column)
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    joints: tuple[int, ...]
    row_ends: Ends
    column_ends: Ends
    responses: tuple[tuple[int, int], ...]
    excitations: tuple[tuple[int, int], ...]

    @property
    def all_ends(self) -> list[End]:
        """Entries of B."""
        (rows, signs), (columns, _) = self.row_ends, self.column_ends
        return [End(*end) for end in zip(self.joints, rows, columns, signs, strict=True)]

    @classmethod
    def of(
        cls,
        name: str,
        part: Part,
        joints: Sequence[Joint],
        owners: tuple[Sequence[Node], Sequence[Node]],
    ) -> Ports:
        """Take of a part what is joined, then what is asked for."""
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
        signs = tuple(sign for _, _, sign in sides)
        rows, columns = (
            tuple(dict.fromkeys([*interface, *(label for _, label in asked)])) for asked in own
        )
        if not isinstance(part, Frf):  # what it lacks lies between the same ports
            rows = columns = tuple(dict.fromkeys([*rows, *columns]))
        return cls(
            rows,
            columns,
            tuple(k for k, _, _ in sides),
            (tuple(rows.index(label) for _, label, _ in sides), signs),
            (tuple(columns.index(label) for _, label, _ in sides), signs),
            tuple((place, rows.index(label)) for place, label in own[0]),
            tuple((place, columns.index(label)) for place, label in own[1]),
        )


@dataclass(frozen=True, eq=False)
class Assembly:
    """Parts between their ports on all lines, and the joints.

    Parameters
    ----------
    axis : array, shape (nf,), Hz
    joints : tuple of Joint
    parts : mapping of str to PartLines
    ports : mapping of str to Ports
    labels : (responses, excitations)
    """

    axis: FloatArray
    joints: tuple[Joint, ...]
    parts: Mapping[str, PartLines]
    ports: Mapping[str, Ports]
    labels: tuple[tuple[str, ...], tuple[str, ...]]

    @classmethod
    def of(
        cls,
        parts: Mapping[str, Part],
        joints: Sequence[AnyJoint],
        axis: FloatArray,
        rows: tuple[str, ...],
        columns: tuple[str, ...],
    ) -> Assembly:
        """Synthesise the parts at their ports.

        Raises
        ------
        As `bounded_frf`.
        """
        labels = {name: _labels(part) for name, part in parts.items()}
        joints = _single(joints)
        _require_ends(joints, labels)
        every = {name: dict.fromkeys(one + other) for name, (one, other) in labels.items()}
        refuse_ambiguous(every, rigid_groups(joints))
        owners = (
            [_owner(label, {name: own[0] for name, own in labels.items()}) for label in rows],
            [_owner(label, {name: own[1] for name, own in labels.items()}) for label in columns],
        )
        ports = {name: Ports.of(name, part, joints, owners) for name, part in parts.items()}
        used = {name: own for name, own in ports.items() if own.rows and own.columns}
        lines = {name: _on_lines(name, parts[name], axis, own) for name, own in used.items()}
        return cls(axis, joints, lines, used, (rows, columns))

    def place(self, response: int, excitation: int) -> tuple[str, int, int] | None:
        """Return the part that has both, and where; None if they are of different parts."""
        for name, ports in self.ports.items():
            rows, columns = dict(ports.responses), dict(ports.excitations)
            if response in rows and excitation in columns:
                return name, rows[response], columns[excitation]
        return None


@dataclass(frozen=True, eq=False)
class Coupled:
    """An assembly's kernel inverted: of what the parts have, or have with what they lack.

    Parameters
    ----------
    assembly : Assembly
    better : bool
        Whether what is known of what the parts lack is added.
    inverse : array, shape (n_joint, n_joint, nf)
        G.
    scale : array, shape (n_joint, nf)
        s of `joint_scaling`.
    """

    assembly: Assembly
    better: bool
    inverse: ComplexArray
    scale: FloatArray

    @classmethod
    def of(cls, assembly: Assembly, better: bool) -> Coupled:
        """Invert the kernel, in the joints' scale.

        Raises
        ------
        SingularLineError
        """
        m, nf = len(assembly.joints), assembly.axis.size
        kernel, moduli = np.zeros((m, m, nf), complex), np.zeros((m, nf))
        for name, part in assembly.parts.items():
            ports = assembly.ports[name]
            (rows, signs), (columns, _) = ports.row_ends, ports.column_ends
            between = part.between(rows, columns, better)
            for k, (joint, sign) in enumerate(zip(ports.joints, signs, strict=True)):
                moduli[joint] += sign**2 * np.abs(between[k, k])
                for at, (other, sign_there) in enumerate(zip(ports.joints, signs, strict=True)):
                    kernel[joint, other] += sign * sign_there * between[k, at]
        omega = 2 * np.pi * assembly.axis
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
            raise singular_kernel(assembly.axis[singular], "coupling")
        unscaled = np.asarray(inverse.transpose(1, 2, 0) * both, dtype=complex)
        return cls(assembly, better, unscaled, scale)

    @cached_property
    def forces(self) -> ComplexArray:
        """Joint forces per unit force at the excitations, G B Y, (n_joint, n_excitation, nf)."""
        excited = np.zeros(
            (len(self.scale), len(self.assembly.labels[1]), self.scale.shape[1]), complex
        )
        for name, part in self.assembly.parts.items():
            ports = self.assembly.ports[name]
            rows, signs = ports.row_ends
            found = part.between(rows, [at for _, at in ports.excitations], self.better)
            for joint, sign, row in zip(ports.joints, signs, found, strict=True):
                for (place, _), entry in zip(ports.excitations, row, strict=True):
                    excited[joint, place] += sign * entry
        return product(self.inverse, excited)

    @cached_property
    def responds(self) -> ComplexArray:
        """Responses per unit joint force, Y B^T, shape (n_response, n_joint, nf)."""
        responds = np.zeros(
            (len(self.assembly.labels[0]), len(self.scale), self.scale.shape[1]), complex
        )
        for name, part in self.assembly.parts.items():
            ports = self.assembly.ports[name]
            columns, signs = ports.column_ends
            found = part.between([at for _, at in ports.responses], columns, self.better)
            for (place, _), row in zip(ports.responses, found, strict=True):
                for joint, sign, entry in zip(ports.joints, signs, row, strict=True):
                    responds[place, joint] += sign * entry
        return responds

    @cached_property
    def reactions(self) -> ComplexArray:
        """Joint forces per unit force at the responses, reciprocally, as `forces`."""
        return (
            self.forces if self.symmetric else product(self.responds, self.inverse).swapaxes(0, 1)
        )

    @property
    def symmetric(self) -> bool:
        """Whether responses are the excitations, and no given FRF may not be reciprocal."""
        same = self.assembly.labels[0] == self.assembly.labels[1]
        return same and all(part.missing is not None for part in self.assembly.parts.values())

    def passed(self, response: int, excitation: int) -> ComplexArray:
        """Return Y B^T G B Y between two labels, shape (nf,)."""
        total = np.zeros(self.scale.shape[1], complex)
        for left, right in zip(self.responds[response], self.forces[:, excitation], strict=True):
            total += left * right
        return total


def product(left: ComplexArray, right: ComplexArray) -> ComplexArray:
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


def _single(joints: Sequence[AnyJoint]) -> tuple[Joint, ...]:
    """Refuse joints whose round-off the bound does not know."""
    for joint in joints:
        if not isinstance(joint, Joint):
            raise JointError(
                f"{joint}: no guarantee for joints of several DoFs; what round-off does to their "
                "kernel is bounded by couple alone (CoupledFrf.round_off)"
            )
    return tuple(joint for joint in joints if isinstance(joint, Joint))


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


def _on_lines(name: str, part: Part, axis: FloatArray, ports: Ports) -> PartLines:
    if isinstance(part, Frf):
        if part.quantity is not Quantity.RECEPTANCE:
            raise QuantityMismatchError(
                f"part {name!r} is {part.quantity}; receptances are coupled, convert with to"
            )
        require_same_frequency(axis, part.frequency, f"the axis of part {name!r} differs")
        return given_part(part.select(ports.rows, ports.columns))
    truncated = TruncatedPart.of(part) if isinstance(part, SecondOrderSystem) else part
    system, modes = truncated.system, truncated.modes
    left_out, coefficients = modes.left_out, rayleigh_coefficients(system)
    if left_out is not None and coefficients is not None:
        return rayleigh_part(system, modes, left_out, coefficients, axis, ports.rows)
    if truncated.no_guarantee is None and left_out is not None:
        return viscous_part(system, modes.kept, left_out, axis, ports.rows)
    frf = modal_frf(system, axis, ports.rows, ports.columns, modes=modes)
    return given_part(frf, complete=False)

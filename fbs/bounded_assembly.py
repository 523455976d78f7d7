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
from .reduced_bound import ReducedPart
from .second_order_system import SecondOrderSystem
from .truncation_bound import Ends, PartLines, given_part, no_guarantee, rayleigh_part
from .undamped_modes import RealModes, Selection, require_own
from .viscous_bound import viscous_part


@dataclass(frozen=True, eq=False)
class TruncatedPart:
    """A part of which some modes are left out.

    Parameters
    ----------
    system : SecondOrderSystem
    modes : TruncatedModes

    Raises
    ------
    AxisMismatchError
        Modes of another system.
    """

    system: SecondOrderSystem
    modes: TruncatedModes

    def __post_init__(self) -> None:
        require_own(self.system, self.modes.kept)

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


Part = TruncatedPart | ReducedPart | SecondOrderSystem | Frf


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

    @cached_property
    def responding(self) -> dict[int, tuple[str, int]]:
        """Of each response its part, and which of this part's responses it is."""
        return {
            place: (name, at)
            for name, ports in self.ports.items()
            for at, (place, _) in enumerate(ports.responses)
        }


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
    def ends(self) -> Mapping[str, tuple[ComplexArray, ComplexArray]]:
        """Of each part B Y at its excitations and Y B^T at its responses, (n_end, n, nf)."""
        found = {}
        for name, part in self.assembly.parts.items():
            ports = self.assembly.ports[name]
            (rows, row_signs), (columns, column_signs) = ports.row_ends, ports.column_ends
            here = part.between(rows, [at for _, at in ports.excitations], self.better)
            here *= np.array(row_signs)[:, None, None]
            there = here
            if not self.symmetric:
                there = part.between([at for _, at in ports.responses], columns, self.better)
                there = there.swapaxes(0, 1) * np.array(column_signs)[:, None, None]
            found[name] = here, there
        return found

    @cached_property
    def forces(self) -> ComplexArray:
        """Joint forces per unit force at the excitations, G B Y, (n_joint, n_excitation, nf)."""
        total = np.zeros((len(self.scale), len(self.assembly.labels[1]), self.axis.size), complex)
        for name, (here, _) in self.ends.items():
            ports = self.assembly.ports[name]
            places = [place for place, _ in ports.excitations]
            for row, gains in zip(total, self.inverse[:, ports.joints], strict=True):
                row[places] = _summed(gains, here)
        return total

    @cached_property
    def reactions(self) -> ComplexArray:
        """Joint forces per unit force at the responses, reciprocally, as `forces`."""
        if self.symmetric:
            return self.forces
        total = np.zeros((len(self.scale), len(self.assembly.labels[0]), self.axis.size), complex)
        for name, (_, there) in self.ends.items():
            ports = self.assembly.ports[name]
            places = [place for place, _ in ports.responses]
            for k, row in enumerate(total):
                row[places] = _summed(self.inverse[list(ports.joints), k], there)
        return total

    @property
    def axis(self) -> FloatArray:
        """Lines, Hz."""
        return self.assembly.axis

    @property
    def symmetric(self) -> bool:
        """Whether responses are the excitations, and no given FRF may not be reciprocal."""
        same = self.assembly.labels[0] == self.assembly.labels[1]
        return same and all(part.missing is not None for part in self.assembly.parts.values())

    def frf(self, response: int, excitations: range) -> ComplexArray:
        """Return the coupled FRFs between a label and some in a row, (n, nf)."""
        found = np.zeros((len(excitations), self.axis.size), complex)
        name, at = self.assembly.responding.get(response, ("", 0))
        if not name:
            return found
        ports = self.assembly.ports[name]
        own = [(place, column) for place, column in ports.excitations if place in excitations]
        row, columns = ports.responses[at][1], [column for _, column in own]
        entries = self.assembly.parts[name].between([row], columns, self.better)[0]
        for (place, _), entry in zip(own, entries, strict=True):
            found[place - excitations.start] = entry
        forces = self.forces[list(ports.joints), excitations.start : excitations.stop]
        found -= _summed(self.ends[name][1][:, at], forces)
        return found


def _summed(gains: ComplexArray, rows: ComplexArray) -> ComplexArray:
    """Return sum_k gains_k rows_k of gains (n, nf) and rows (n, nf) or (n, m, nf)."""
    total = np.zeros(rows.shape[1:], complex)
    for gain, row in zip(gains, rows, strict=True):
        total += gain * row
    return total


def _labels(part: Part) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return responses and excitations."""
    if isinstance(part, Frf):
        return part.responses, part.excitations
    system = part if isinstance(part, SecondOrderSystem) else part.system
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
    whole = part if isinstance(part, SecondOrderSystem) else part.system
    coefficients = rayleigh_coefficients(whole)
    if isinstance(part, ReducedPart):
        if coefficients is None:
            return given_part(part.frf(axis, ports.rows), complete=False)
        return part.lines(coefficients, axis, ports.rows)
    truncated = TruncatedPart.of(part) if isinstance(part, SecondOrderSystem) else part
    system, modes, left_out = truncated.system, truncated.modes, truncated.modes.left_out
    if left_out is not None and coefficients is not None:
        return rayleigh_part(system, modes, left_out, coefficients, axis, ports.rows)
    if truncated.no_guarantee is None and left_out is not None:
        return viscous_part(system, modes.kept, left_out, axis, ports.rows)
    frf = modal_frf(system, axis, ports.rows, ports.columns, modes=modes)
    return given_part(frf, complete=False)

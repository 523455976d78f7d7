"""A part's few FRFs at its interface, from the modes that move it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.blocks import stretches
from ._kernels.checks import ComplexArray, FloatArray, ascending_frequency
from ._kernels.door import door
from ._kernels.elimination import EPS
from .damped_modes import is_proportional, modal_damping
from .errors import undamped_pole
from .frf import Frf, computed_frf
from .modal_synthesis import modal_frf
from .second_order_system import SecondOrderSystem, SystemOrigin
from .undamped_modes import RealModes, real_modes

GAINS = 2**15
"""Gains of modes at once: real and imaginary ones, and what they are made of, stay in cache."""


@dataclass(frozen=True, eq=False)
class InterfaceModes:
    """What the modes that move the interface add to its FRFs, see `interface_frf`.

    Parameters
    ----------
    square, friction, loss : arrays, shape (n_modes, 1)
        w_r^2, g_r and eta w_r^2.
    pairs : tuple of (row, column)
        Of a symmetric receptance the upper half.
    symmetric : bool
    residues : array, shape (n_pairs, n_modes)
        phi_ir phi_jr.
    round_off : float
        Of w_r^2, relative.
    """

    square: FloatArray
    friction: FloatArray
    loss: FloatArray
    pairs: tuple[tuple[int, int], ...]
    symmetric: bool
    residues: FloatArray
    round_off: float

    @classmethod
    def of(
        cls, system: SecondOrderSystem, rows: tuple[str, ...], columns: tuple[str, ...]
    ) -> InterfaceModes | None:
        """Solve for the modes; None where damping ties them to each other."""
        modes = real_modes(system)
        damping = modal_damping(modes, system.damping)
        if not is_proportional(damping):
            return None
        i, row_factor = system.locate(rows)
        j, column_factor = system.locate(columns)
        moving = _moving(modes, [*i, *j])
        left = modes.shapes[i][:, moving] * row_factor[:, None]
        right = modes.shapes[j][:, moving] * column_factor[:, None]
        pairs = [(a, b) for a in range(len(rows)) for b in range(len(columns))]
        symmetric = rows == columns
        if symmetric:
            pairs = [(a, b) for a, b in pairs if a <= b]
        square = modes.angular_frequency[moving, None] ** 2
        return cls(
            square,
            np.diag(damping)[moving, None],
            system.loss_factor * square,
            tuple(pairs),
            symmetric,
            np.array([left[a] * right[b] for a, b in pairs]).reshape(len(pairs), len(moving)),
            16 * len(system.dofs) * EPS,
        )

    def refuse_poles(self, axis: FloatArray) -> None:
        """Name the lines on a pole, as near as `modal_frf` allows; the nearest two will do.

        Raises
        ------
        SingularLineError
        """
        omega = 2 * np.pi * axis
        wr = np.sqrt(self.square)
        near = np.clip(np.searchsorted(omega, wr) + np.array([-1, 0]), 0, axis.size - 1)
        w = omega[near]
        size = np.abs((wr - w) * (wr + w) + 1j * (self.friction * w + self.loss))
        singular = size <= self.round_off * (self.square + w**2)
        if singular.any():
            raise undamped_pole(axis[np.unique(near[singular])])

    def write(self, omega: FloatArray, out: ComplexArray) -> None:
        """Write the receptance at `omega`, shape (nf,), rad/s, into (n_row, n_column, nf)."""
        for lines in stretches(omega.size, max(1024, GAINS // max(1, len(self.square)))):
            w = omega[lines]
            real = self.square - w * w
            imaginary = self.friction * w
            if self.loss.any():
                imaginary += self.loss
            inverse = real * real
            inverse += imaginary * imaginary
            np.divide(1.0, inverse, out=inverse)
            real *= inverse
            imaginary *= inverse
            sums = zip(self.pairs, self.residues @ real, self.residues @ imaginary, strict=True)
            for (a, b), above, below in sums:
                out.real[a, b, lines] = above
                np.negative(below, out=out.imag[a, b, lines])
                if self.symmetric and a != b:
                    out[b, a, lines] = out[a, b, lines]


@door
def interface_frf(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str],
    excitations: Iterable[str],
) -> Frf:
    """Sum as `modal_frf` does, but only over the modes that move a DoF asked for.

    A mode's residue is phi_i phi_j. Where a planetary stage is joined at shafts alone, its
    translational and planet modes leave the shafts at rest, and a third of the modes remains.
    Left out are modes whose shape is below its own round-off, 16 n eps of its largest entry, at
    every DoF asked for. Real arithmetic throughout: with p = w_r^2 - w^2, q = g_r w + eta w_r^2,

        H_ij = sum_r phi_ir phi_jr (p - j q) / (p^2 + q^2).

    Where damping is not proportional it ties modes to each other, and `modal_frf` takes them all.

    Raises
    ------
    As `modal_frf`.
    """
    axis = ascending_frequency(frequency)
    rows, columns = tuple(responses), tuple(excitations)
    modes = InterfaceModes.of(system, rows, columns)
    if modes is None:
        return modal_frf(system, axis, rows, columns)
    modes.refuse_poles(axis)
    values = np.empty((len(rows), len(columns), axis.size), dtype=complex)
    modes.write(2 * np.pi * axis, values)
    origin = SystemOrigin.of(system)
    return computed_frf(axis, values.transpose(2, 0, 1), rows, columns, origin=origin)


def _moving(modes: RealModes, asked: list[int]) -> NDArray[np.intp]:
    limit = 16 * len(modes.shapes) * EPS * np.abs(modes.shapes).max(axis=0)
    return np.flatnonzero(np.abs(modes.shapes[asked]).max(axis=0) > limit)

"""A part's few FRFs at its interface, from the modes that move it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import FloatArray, ascending_frequency
from .damped_modes import is_proportional, modal_damping
from .errors import SingularLineError
from .frf import Frf
from .modal_synthesis import modal_frf
from .second_order_system import SecondOrderSystem
from .undamped_modes import EPS, RealModes, real_modes

BLOCK = 4096
"""Lines at once: real and imaginary gains of ten modes are 0.7 MB, which stay in cache."""


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
    modes = real_modes(system)
    damping = modal_damping(modes, system.damping)
    if not is_proportional(damping):
        return modal_frf(system, axis, rows, columns)
    i, row_factor = system.locate(rows)
    j, column_factor = system.locate(columns)
    part = _moving(modes, [*i, *j])
    left = modes.shapes[i][:, part] * row_factor[:, None]
    right = modes.shapes[j][:, part] * column_factor[:, None]
    wr, friction = modes.angular_frequency[part, None], np.diag(damping)[part, None]
    loss = system.loss_factor * wr**2
    _refuse_poles(axis, wr, friction, loss, 16 * len(system.dofs) * EPS)
    values = np.empty((len(rows), len(columns), axis.size), dtype=complex)
    pairs = [(a, b) for a in range(len(rows)) for b in range(len(columns))]
    if rows == columns:  # H is symmetric then
        pairs = [(a, b) for a, b in pairs if a <= b]
    weights = np.array([left[a] * right[b] for a, b in pairs])
    for start in range(0, axis.size, BLOCK):
        lines = slice(start, start + BLOCK)
        w = 2 * np.pi * axis[lines]
        real, imaginary = (wr - w) * (wr + w), friction * w + loss
        square = 1 / (real * real + imaginary * imaginary)
        real *= square
        imaginary *= square
        for (a, b), weight in zip(pairs, weights, strict=True):
            values.real[a, b, lines] = weight @ real
            np.negative(weight @ imaginary, out=values.imag[a, b, lines])
    if rows == columns:
        for a, b in pairs:
            values[b, a] = values[a, b]
    return Frf(axis, values.transpose(2, 0, 1), rows, columns)


def _moving(modes: RealModes, asked: list[int]) -> NDArray[np.intp]:
    limit = 16 * len(modes.shapes) * EPS * np.abs(modes.shapes).max(axis=0)
    return np.flatnonzero(np.abs(modes.shapes[asked]).max(axis=0) > limit)


def _refuse_poles(
    axis: FloatArray, wr: FloatArray, friction: FloatArray, loss: FloatArray, tolerance: float
) -> None:
    """Name the lines on a pole, as near as `modal_frf` allows; the nearest two will do."""
    omega = 2 * np.pi * axis
    near = np.searchsorted(omega, wr) + np.array([-1, 0])
    near = np.clip(near, 0, axis.size - 1)
    w = omega[near]
    size = np.abs((wr - w) * (wr + w) + 1j * (friction * w + loss))
    singular = size <= tolerance * (wr**2 + w**2)
    if singular.any():
        raise SingularLineError(
            axis[np.unique(near[singular])],
            "an undamped mode, or rigid-body motion at 0 Hz, makes the FRF infinite",
            "leave these lines out, shift the axis or add damping",
        )

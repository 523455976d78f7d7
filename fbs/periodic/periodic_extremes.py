"""What lines add up to in time: values over a period, and the largest and smallest ever reached."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.checks import ComplexArray, FloatArray, numbers
from .._kernels.door import door
from ..errors import FbsError
from .periodic_springs import IntArray, Lattice

PER_PERIOD = 16
"""Points per period of the fastest line: the top of a cosine lies within 0.2 rad of one."""

STARTS = (0.0, 1.0)
"""Golden parts of a turn, by phase: where searches in several phases begin."""

SWEEPS = 3
NEWTON_STEPS = 5
"""From 0.2 rad: the error is squared each time, from 1e-2 to 1e-16 in three."""


@dataclass(frozen=True, eq=False)
class Extremes:
    """Largest and smallest values, each of shape (n_speed, n_signal).

    Parameters
    ----------
    largest, smallest : array, shape (n_speed, n_signal)
    """

    largest: FloatArray
    smallest: FloatArray


@door
def waveform(lines: ComplexArray, lattice: Lattice, turns: ArrayLike) -> FloatArray:
    """Values x = Re Σ_h x_h e^{j2π o_h θ} at angles of the shaft.

    Parameters
    ----------
    lines : complex array, shape (n_speed, n_line, n_signal)
    lattice
        o_h are its orders.
    turns : array, shape (n_time,)
        θ = n t, in turns of the shaft.

    Returns
    -------
    array, shape (n_speed, n_time, n_signal)
    """
    _check(lines, lattice)
    angles = numbers(turns, "the turns")
    if angles.ndim != 1:
        raise FbsError(f"the turns must be a vector, got shape {angles.shape}")
    turned = np.exp(2j * np.pi * np.multiply.outer(angles, lattice.orders))
    return np.asarray((turned @ lines).real)


@door
def extremes(lines: ComplexArray, lattice: Lattice) -> Extremes:
    """Largest and smallest values over all phases.

    In one phase: every point of a grid that can belong to the largest, refined by Newton's method.
    In several: along one phase after the other, from several starts, which finds the extremes of a
    sum of functions of one phase each; where combinations of phases carry much of the signal, a
    local extreme may be taken for the largest. Several independent phases come as near to any
    combination as one likes in the long run: the extremes are those of a long time.

    Parameters
    ----------
    lines : complex array, shape (n_speed, n_line, n_signal)
    lattice
        The lines'.

    Raises
    ------
    FbsError
        The lines are not the lattice's.
    """
    _check(lines, lattice)
    n_speed, n_line, n_signal = lines.shape
    flat = lines.transpose(0, 2, 1).reshape(-1, n_line)
    shape = n_speed, n_signal
    return Extremes(
        _largest(flat, lattice.points).reshape(shape),
        -_largest(-flat, lattice.points).reshape(shape),
    )


def _check(lines: ComplexArray, lattice: Lattice) -> None:
    if np.ndim(lines) != 3 or np.shape(lines)[1] != len(lattice.points):
        raise FbsError(
            f"lines have shape {np.shape(lines)}: must be (n_speed, {len(lattice.points)}, "
            "n_signal)"
        )


def _largest(lines: ComplexArray, points: IntArray) -> FloatArray:
    """Of every signal (n_signal, n_line)."""
    n_phase = points.shape[1]
    if n_phase == 1:
        return _largest_of_one_phase(lines, points)
    golden = np.pi * (np.sqrt(5.0) - 1.0) * np.arange(1, n_phase + 1)
    best = np.full(len(lines), -np.inf)
    for start in STARTS:
        phases = np.tile(start * golden, (len(lines), 1))
        for _ in range(SWEEPS):
            for axis in range(n_phase):
                grid, value = _along(lines, points, phases, axis)
                phases[:, axis] = grid[np.argmax(value, axis=1)]
        best = np.maximum(best, _refined(lines, points, phases))
    return best


def _largest_of_one_phase(lines: ComplexArray, points: IntArray) -> FloatArray:
    """A maximum is above its nearest grid point by ½ (d/2)² Σ h²|x_h| at most, d the grid's step.

    What is no local maximum of the grid, or below the highest by more, cannot be it.
    """
    grid, value = _along(lines, points, np.zeros((len(lines), 1)), 0)
    slack: FloatArray = 0.125 * grid[1] ** 2 * (np.abs(lines) @ points[:, 0] ** 2)
    top: FloatArray = value.max(axis=1)
    beside = np.maximum(np.roll(value, 1, axis=1), np.roll(value, -1, axis=1))
    possible = (value >= beside) & (value >= (top - slack)[:, None])
    signal, place = np.nonzero(possible)
    np.maximum.at(top, signal, _refined(lines[signal], points, grid[place][:, None]))
    return top


def _along(
    lines: ComplexArray, points: IntArray, phases: FloatArray, axis: int
) -> tuple[FloatArray, FloatArray]:
    """A grid of one phase, and every signal on it, the other phases given."""
    others = phases.copy()
    others[:, axis] = 0.0
    orders, which = np.unique(points[:, axis], return_inverse=True)
    gathered = (lines * np.exp(1j * others @ points.T)) @ np.eye(len(orders))[which]
    count = PER_PERIOD * max(1, int(np.abs(orders).max()))
    grid = 2.0 * np.pi * np.arange(count) / count
    wave = np.exp(1j * np.multiply.outer(orders, grid))
    return grid, gathered.real @ wave.real - gathered.imag @ wave.imag


def _refined(lines: ComplexArray, points: IntArray, phases: FloatArray) -> FloatArray:
    """Values after Newton's method on the gradient; a step that leads down is not taken."""
    orders = points.astype(float)
    pairs = (orders[:, :, None] * orders[:, None, :]).reshape(len(orders), -1)
    turned = lines * np.exp(1j * phases @ orders.T)
    value = turned.real.sum(axis=1)
    for _ in range(NEWTON_STEPS):
        slope = -turned.imag @ orders
        curvature = (turned.real @ pairs).reshape(len(lines), orders.shape[1], -1)
        step = (np.linalg.pinv(curvature, hermitian=True) @ slope[..., None])[..., 0]
        moved = lines * np.exp(1j * (phases + step) @ orders.T)
        new = moved.real.sum(axis=1)
        better = new > value
        phases = np.where(better[:, None], phases + step, phases)
        turned = np.where(better[:, None], moved, turned)
        value = np.where(better, new, value)
    return np.asarray(value)

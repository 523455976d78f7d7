"""What lines add up to in time: values over a period, and the largest and smallest ever reached."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from ._checks import ComplexArray, FloatArray
from .periodic_springs import Lattice


@dataclass(frozen=True, eq=False)
class Extremes:
    """Largest and smallest values, each of shape (n_speed, n_signal).

    Parameters
    ----------
    largest, smallest : array, shape (n_speed, n_signal)
    """

    largest: FloatArray
    smallest: FloatArray


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
    raise NotImplementedError


def extremes(lines: ComplexArray, lattice: Lattice) -> Extremes:
    """Largest and smallest values over all phases.

    Found on a grid of the phases and refined by Newton's method. With several independent phases
    every combination of them comes up to any closeness in the long run: the extremes are those of a
    long time, not of one period.

    Parameters
    ----------
    lines : complex array, shape (n_speed, n_line, n_signal)
    lattice
        The lines'.
    """
    raise NotImplementedError

"""Springs whose stiffness and unloaded length vary with the turning of a shaft.

A spring m between DoFs, δ_m = δ_static,m + v_mᵀ q, has the force

    F_m = k_m [1 + κ_m(φ)] (δ_m − e_m(φ)) + c_m (δ̇_m − ė_m),    κ_m = Re Σ_l κ_ml e^{jlφ},

e_m likewise, φ = 2π r_m n t with n the shaft's turns per second and r_m the spring's ratio: what
varies r_m times a turn. Springs of one ratio go through their period together; different ratios are
independent phases unless their quotient is one of small integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import ComplexArray, FloatArray

IntArray = NDArray[np.int64]

SAME_PERIOD = 1e-9
"""Relative: ratios of speeds are products of tooth numbers, known to some ten ε."""

HARMONICS = 10
COMBINATIONS = 3


@dataclass(frozen=True, eq=False)
class PeriodicSpring:
    """A spring of a system whose matrices hold its constant part k v vᵀ and c v vᵀ.

    Parameters
    ----------
    name : str
    vector : array, shape (n_dof,)
        v: the deflection δ per unit of each DoF, positive as the force is.
    stiffness : float, N/m
        k, the mean.
    ratio : float
        r > 0: periods per turn of the shaft, f = r n.
    variation : complex array, shape (n,)
        κ_l, l = 1 … n; its phase is part of it.
    error : complex array, shape (n,), m
        e_l, l = 1 … n.
    damping : float, N s/m
        c.
    static_force : float, N
        k δ_static, under the mean load.

    Raises
    ------
    FbsError, NonFiniteError
        An array is no vector, a number is not finite, or k or r is not positive.
    """

    name: str
    vector: FloatArray
    stiffness: float
    ratio: float
    variation: ComplexArray
    error: ComplexArray
    damping: float = 0.0
    static_force: float = 0.0


@dataclass(frozen=True, eq=False)
class Lattice:
    """The lines h·f of a motion in several phases; half of them, h and −h being conjugate.

    Of each pair the one with h·f > 0 stands here, the mean first. Axes hold their harmonics up to
    H times a spring's own period, and of combinations those with Π max(1, |h_g|) ≤ P over the
    groups of springs (a hyperbolic cross: Fourier coefficients of a product fall as a product).

    Parameters
    ----------
    points : int array, shape (n_line, n_phase)
        h.
    fundamentals : array, shape (n_phase,)
        Periods of each phase per turn of the shaft.
    steps : int array, shape (n_spring, n_phase)
        h of each spring's own first harmonic: (0, 3) where it passes three periods of its phase.
    """

    points: IntArray
    fundamentals: FloatArray
    steps: IntArray

    @property
    def orders(self) -> FloatArray:
        """Periods of each line per turn of the shaft (n_line,), the mean's 0."""
        orders: FloatArray = self.points @ self.fundamentals
        return orders

    @property
    def n_phases(self) -> int:
        """S: of how many independent phases."""
        return len(self.fundamentals)

    def harmonic(self, spring: int, order: int) -> int:
        """Which line is the l-th harmonic of a spring.

        Raises
        ------
        FbsError
            None is.
        """
        raise NotImplementedError


def lattice(
    springs: Sequence[PeriodicSpring],
    harmonics: int = HARMONICS,
    combinations: int = COMBINATIONS,
) -> Lattice:
    """Choose the lines that a motion is made of.

    Parameters
    ----------
    springs
        Their ratios decide which share a period.
    harmonics
        H ≥ 1, of each spring's own period.
    combinations
        P ≥ 0; 0 leaves all combinations out.
    """
    raise NotImplementedError


def common_periods(
    springs: Sequence[PeriodicSpring], largest: int = HARMONICS
) -> tuple[tuple[int, ...], ...]:
    """Which springs share a period: their ratios are p/q with p, q ≤ ``largest``.

    Returns
    -------
    tuple of tuples
        Positions in ``springs``, each in one group; springs that do not vary are in none.
    """
    raise NotImplementedError

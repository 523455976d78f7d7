"""Steady vibration of a system with periodic springs at every speed, by harmonic balance.

About the static state, with the constant springs k_m, c_m in C and K already,

    M q̈ + C q̇ + K q + Σ_m v_m p_m(t) = 0,
    p_m = k_m κ_m (δ_m − e_m) − k_m e_m − c_m ė_m

is what the springs do beyond being constant. On the lattice of lines h·f (`Lattice`)

    δ_h = δ_static [h = 0] − Y(h·f) p_h,    Y = Vᵀ H V:

the constant system's receptances between the springs, coupled by a convolution with κ: the harmonic
transfer matrix (Wereley 1991, Analysis and control of linear periodically time varying systems, MIT).
A motion of rigid bodies strains no spring and is no part of Y, which is therefore finite at 0 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from ._checks import ComplexArray, FloatArray
from .errors import FbsError
from .frf import Quantity
from .periodic_springs import COMBINATIONS, HARMONICS, Lattice, PeriodicSpring
from .second_order_system import SecondOrderSystem


class SingularBalanceError(FbsError):
    """The balance has no solution at a speed: it lies on the boundary of an instability.

    Attributes
    ----------
    shaft_frequencies : array, shape (n,), 1/s
        All the speeds concerned.
    """


@dataclass(frozen=True, eq=False)
class PeriodicResponse:
    """What a system with periodic springs does at every speed, line by line.

    A line is x(t) = Re Σ_h x_h e^{j2π f_h t}: |x_h| is its amplitude; h = 0 is the real mean.

    Parameters
    ----------
    system, springs, lattice
        What was solved.
    shaft_frequency : array, shape (n_speed,), 1/s
    excess : complex array, shape (n_speed, n_line, n_spring), N
        p_h.
    deflection : complex array, shape (n_speed, n_line, n_spring), m
        v_mᵀ q_h, without the static δ.
    residual : array, shape (n_speed,)
        What is left of the balance, of the largest p_h.
    truncation : array, shape (n_speed,)
        Largest p_h at lines next to the lattice that it leaves out, of the largest p_h: how much
        of the vibration the choice of lines misses.
    """

    system: SecondOrderSystem
    springs: tuple[PeriodicSpring, ...]
    lattice: Lattice
    shaft_frequency: FloatArray
    excess: ComplexArray
    deflection: ComplexArray
    residual: FloatArray
    truncation: FloatArray

    @property
    def frequency(self) -> FloatArray:
        """f_h (n_speed, n_line), Hz."""
        raise NotImplementedError

    @property
    def spring_forces(self) -> ComplexArray:
        """F_h (n_speed, n_line, n_spring), N: the static force included at h = 0."""
        raise NotImplementedError


def steady_state(
    system: SecondOrderSystem,
    springs: Sequence[PeriodicSpring],
    shaft_frequency: ArrayLike,
    *,
    harmonics: int = HARMONICS,
    combinations: int = COMBINATIONS,
) -> PeriodicResponse:
    """Solve the steady state at every speed; the equations are this module's.

    Parameters
    ----------
    system
        Constant part: M, C and K with all springs at their mean.
    springs
        What varies (and springs that do not, whose forces are asked for).
    shaft_frequency : array, shape (n_speed,), 1/s
        > 0; in any order.
    harmonics, combinations
        See `Lattice`.

    Raises
    ------
    SingularBalanceError
        At speeds on the boundary of an instability.
    SingularLineError
        A line lies on an undamped pole of the constant system.
    FbsError, NonFiniteError, IndefiniteMassError, IndefiniteStiffnessError, DefectiveModesError
    """
    raise NotImplementedError


def outputs(
    response: PeriodicResponse,
    rows: ArrayLike,
    damping_rows: ArrayLike | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
) -> ComplexArray:
    """Lines of y = A q + B q̇, or of its time derivatives (n_speed, n_line, n_output).

    A bearing's force is A = k v, B = c v; a DoF's displacement a row of the identity. The mean is
    that about the static state, without motions of rigid bodies.

    Parameters
    ----------
    response
        A steady state.
    rows : array, shape (n_output, n_dof)
        A.
    damping_rows : array, shape (n_output, n_dof), optional
        B.
    quantity
        Of y: ``receptance`` y itself, ``mobility`` ẏ, ``accelerance`` ÿ.
    """
    raise NotImplementedError

"""Stability of a system with periodic springs at every speed: Floquet theory in modes.

    η̈ + Γ η̇ + [Ω² + Σ_m κ_m(t) w_m w_mᵀ] η = 0,    w_m = √k_m Φᵀ v_m,

over the springs' common period T. A multiplier μ, an eigenvalue of what a period makes of (Ωη, η̇),
with |μ| > 1 makes a motion grow by ln|μ|/T. Motions of rigid bodies strain no spring and are left
out. Between incommensurate periods there are no multipliers (`NoCommonPeriodError`): each group of
springs with a common period is asked alone (`common_periods`), the others at their mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from ._checks import FloatArray
from .errors import FbsError
from .periodic_springs import PeriodicSpring
from .second_order_system import SecondOrderSystem


class NoCommonPeriodError(FbsError):
    """Springs vary at frequencies that share no period."""


@dataclass(frozen=True, eq=False)
class Stability:
    """Growth of the fastest growing (or slowest decaying) motion at every speed.

    Parameters
    ----------
    shaft_frequency : array, shape (n_speed,), 1/s
    growth_rate : array, shape (n_speed,), 1/s
        max ln|μ|/T: positive where a motion grows.
    period : array, shape (n_speed,), s
    left_out : float
        Largest share of a spring's flexibility in modes above the highest kept.
    n_modes : int
        How many were kept.
    """

    shaft_frequency: FloatArray
    growth_rate: FloatArray
    period: FloatArray
    left_out: float
    n_modes: int


def stability(
    system: SecondOrderSystem,
    springs: Sequence[PeriodicSpring],
    shaft_frequency: ArrayLike,
    *,
    highest_hz: float | None = None,
) -> Stability:
    """Growth rates at every speed.

    Parameters
    ----------
    system, springs
        As for `steady_state`; errors and static forces do not matter.
    shaft_frequency : array, shape (n_speed,), 1/s
    highest_hz
        Modes above are left out; by default as many as leave a hundredth of a spring's flexibility.

    Raises
    ------
    NoCommonPeriodError
        The springs that vary share no period.
    FbsError
        No mode is left.
    """
    raise NotImplementedError

"""Stability of a system with periodic springs at every speed: Floquet theory in modes.

    η̈ + Γ η̇ + [Ω² + Σ_m κ_m(t) w_m w_mᵀ] η = 0,    w_m = √k_m Φᵀ v_m,

over the springs' common period T. A multiplier μ, an eigenvalue of what a period makes of (Ωη, η̇),
with |μ| > 1 makes a motion grow by ln|μ|/T. Motions of rigid bodies strain no spring and are left
out. Between incommensurate periods there are no multipliers (`NoCommonPeriodError`): each group of
springs with a common period is asked alone (`common_periods`), the others at their mean.

A period is cut into N steps of h. Between them modes vibrate freely, which is exact; at each the
springs' variation kicks, η̇ ← η̇ − h Wᵀ D W η (Strang 1968, SIAM J. Numer. Anal. 5, 506–517). With

    D = (1 − h²/12 κ W Wᵀ) κ,    κ = diag κ_m,

the eigenvalues of the product are right to h⁴ (Takahashi & Imada 1984, J. Phys. Soc. Jpn 53,
3765–3769): what is left at h² is a change of variables. To first order in κ they are exact: kicks
are κ with harmonics near N added, which meet no sum of two natural frequencies.

Modes left out follow at once, as springs: κ is then (1 + κ R)⁻¹ κ, R = Σ_r w_r w_rᵀ/ω_r² over them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._blocks import each, stretches
from ._checks import ComplexArray, FloatArray, read_only
from ._spring_receptances import refuse_strained_rigid_motions, spring_vectors
from .damped_modes import modal_damping
from .errors import FbsError, first_few
from .periodic_springs import PeriodicSpring, common_periods, lattice, shaft_frequencies
from .second_order_system import SecondOrderSystem
from .undamped_modes import real_modes

STEPS_PER_CYCLE = 12
"""Of the highest mode kept: ωh = 0.52, (ωh)⁴/720 of κ² is 1e-4 of that mode's frequency shift."""

LEAST_STEPS = 64
"""Per period: harmonics of κ below half of it are taken, those above left out."""

LEFT_OUT = 0.01
BLOCK = 8
"""Speeds at once, neighbours with as many steps."""


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
    speeds = shaft_frequencies(shaft_frequency)
    varying = [spring for spring in springs if spring.variation.any()]
    groups = common_periods(varying)
    if len(groups) > 1:
        listed = first_few(sorted({varying[group[0]].ratio for group in groups}))
        raise NoCommonPeriodError(
            f"springs vary {listed} times per turn: without a common period there are no Floquet "
            "multipliers; ask for the springs of one period at a time"
        )
    modes = _Modes.of(system, springs, highest_hz)
    series, ratio = _series(springs, varying)
    kicks = _Kicks(modes, series)
    period = 1.0 / (ratio * speeds)
    order = np.argsort(period)
    growth = np.empty(speeds.size)

    def solve(part: slice) -> None:
        own = order[part]
        products = kicks.products(period[own])
        largest = np.abs(np.linalg.eigvals(products)).max(axis=1)
        growth[own] = np.log(largest) / period[own]

    each(solve, stretches(speeds.size, BLOCK), 64 * BLOCK * 2**16 * speeds.size)
    return Stability(speeds, read_only(growth), read_only(period), modes.left_out, len(modes.omega))


@dataclass(frozen=True, eq=False)
class _Modes:
    """η̈ + Γ η̇ + Ω² η = −Σ_m w_m κ_m (w_mᵀη − …): modes kept, and R of the others.

    Parameters
    ----------
    omega : array, shape (n,), rad/s
    damping : array, shape (n, n), 1/s
    rows : array, shape (n_spring, n), rad/s
        √k Φᵀv.
    residual : array, shape (n_spring, n_spring)
        R.
    """

    omega: FloatArray
    damping: FloatArray
    rows: FloatArray
    residual: FloatArray

    @property
    def left_out(self) -> float:
        """Largest share of a spring's flexibility in R."""
        return float(np.diag(self.residual).max())

    @classmethod
    def of(
        cls, system: SecondOrderSystem, springs: Sequence[PeriodicSpring], highest_hz: float | None
    ) -> _Modes:
        vectors = spring_vectors(system, springs)
        modes = real_modes(system)
        refuse_strained_rigid_motions(modes, vectors, springs)
        omega, shapes = (
            modes.angular_frequency[modes.n_rigid :],
            modes.shapes[:, modes.n_rigid :],
        )
        root = np.sqrt([[spring.stiffness] for spring in springs])
        rows = root * (vectors @ shapes)
        share = (rows / omega) ** 2
        if highest_hz is None:
            above = np.cumsum(share[:, ::-1], axis=1)[:, ::-1].max(axis=0)
            kept = above > LEFT_OUT
        else:
            kept = omega <= 2.0 * np.pi * highest_hz
        if not kept.any():
            lowest = omega.min(initial=np.inf) / (2.0 * np.pi)
            raise FbsError(f"no mode up to {highest_hz} Hz: the lowest is {lowest:g} Hz")
        left = rows[:, ~kept] / omega[~kept]
        damping = modal_damping(modes, system.damping)[modes.n_rigid :, modes.n_rigid :]
        return cls(omega[kept], damping[np.ix_(kept, kept)], rows[:, kept], left @ left.T)


def _series(
    springs: Sequence[PeriodicSpring], varying: Sequence[PeriodicSpring]
) -> tuple[list[tuple[int, int, ComplexArray]], float]:
    """Of springs that vary: position, periods per common period, κ_l; and the latter's ratio."""
    if not varying:
        return [], 1.0
    shared = lattice(varying, 1, 0)
    where = [m for m, spring in enumerate(springs) if spring.variation.any()]
    series = [
        (m, int(step), springs[m].variation)
        for m, step in zip(where, shared.steps[:, 0], strict=True)
    ]
    return series, float(shared.fundamentals[0])


@dataclass(frozen=True, eq=False)
class _Kicks:
    """What a period makes of (Ωη, η̇), up to a change of variables."""

    modes: _Modes
    series: list[tuple[int, int, ComplexArray]]

    def products(self, period: FloatArray) -> FloatArray:
        """(n_speed, 2n, 2n) for periods (n_speed,) in s."""
        omega, rows = self.modes.omega, self.modes.rows
        n, highest = len(omega), float(omega.max()) / (2.0 * np.pi)
        count = max(LEAST_STEPS, int(np.ceil(STEPS_PER_CYCLE * highest * period.max())))
        step = period / count
        free = self._free(step)
        stretch = rows / omega
        strengths = step[:, None, None, None] * self._corrected(self._variation(count), step)
        whole = np.tile(np.eye(2 * n), (len(period), 1, 1))
        for index in range(count):
            whole = free @ whole
            whole[:, n:] -= rows.T @ (strengths[:, index] @ (stretch @ whole[:, :n]))
        return whole

    def _free(self, step: FloatArray) -> FloatArray:
        """Exp of h [[0, Ω], [−Ω, −Γ]] (n_speed, 2n, 2n)."""
        from scipy.linalg import expm

        omega = np.diag(self.modes.omega)
        generator = np.block([[np.zeros_like(omega), omega], [-omega, -self.modes.damping]])
        return np.asarray(expm(step[:, None, None] * generator))

    def _variation(self, count: int) -> FloatArray:
        """(1 + κ R)⁻¹ κ at N instants of a period (count, n_spring, n_spring)."""
        size = len(self.modes.rows)
        turns = np.arange(count) / count
        varying = np.zeros((count, size, size))
        for m, step, coefficients in self.series:
            orders = step * np.arange(1, len(coefficients) + 1)
            below = 2 * orders < count
            waves = np.exp(2j * np.pi * np.multiply.outer(turns, orders[below]))
            varying[:, m, m] = (waves @ coefficients[below]).real
        return np.asarray(np.linalg.solve(np.eye(size) + varying @ self.modes.residual, varying))

    def _corrected(self, varying: FloatArray, step: FloatArray) -> FloatArray:
        """D (n_speed, count, n_spring, n_spring)."""
        rows = self.modes.rows
        second = varying @ (rows @ rows.T) @ varying
        return varying - (step**2 / 12.0)[:, None, None, None] * second

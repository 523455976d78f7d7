"""Stability of a system with periodic springs at every speed: Floquet theory in modes.

    η̈ + Γ η̇ + [Ω² + Σ_m κ_m(t) w_m w_mᵀ] η = 0,    w_m = √k_m Φᵀ v_m,

over the springs' common period T. A multiplier μ, an eigenvalue of what a period makes of (Ωη, η̇),
with |μ| > 1 makes a motion grow by ln|μ|/T. Motions of rigid bodies strain no spring and are left
out. Between incommensurate periods there are no multipliers (`NoCommonPeriodError`): each group of
springs with a common period is asked alone (`stability_by_period`), the others at their mean.

A period is cut into N steps of h. Between them modes vibrate freely, which is exact; at each the
springs' variation kicks, η̇ ← η̇ − h Wᵀ D W η (Strang 1968, SIAM J. Numer. Anal. 5, 506–517). With

    D = (1 − h²/12 κ W Wᵀ) κ,    κ = diag κ_m,

the eigenvalues of the product are right to h⁴ (Takahashi & Imada 1984, J. Phys. Soc. Jpn 53,
3765–3769): what is left at h² is a change of variables. To first order in κ they are exact: kicks
are κ with harmonics near N added, which meet no sum of two natural frequencies.

Modes left out follow at once, as springs: κ is then (1 + κ R)⁻¹ κ, R = Σ_r w_r w_rᵀ/ω_r² over them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._kernels.blocks import each, stretches
from .._kernels.checks import ComplexArray, FloatArray, read_only
from .._kernels.door import door
from ..damped_modes import is_proportional, modal_damping
from ..errors import FbsError, first_few
from ..second_order_system import SecondOrderSystem
from ..undamped_modes import real_modes
from ._spring_receptances import refuse_strained_rigid_motions, spring_vectors
from .periodic_springs import (
    IntArray,
    PeriodicSpring,
    common_periods,
    lattice,
    shaft_frequencies,
)

STEPS_PER_CYCLE = 6
"""Of the highest mode kept: (ωh)⁴/720, ωh = 1.05, is 2e-3, of κ² and of that mode alone."""

LEAST_STEPS = 64
"""Per period: harmonics of κ below half of it are taken, those above left out."""

LEFT_OUT = 0.01
"""Share of a spring's flexibility: a mode of that little grows by κ ω/400 at most, in its middle,
which a damping ratio of κ/400 prevents."""

WINDOW = 256
"""Steps whose kicks are worked out at once."""

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


@door
def stability(
    system: SecondOrderSystem,
    springs: Sequence[PeriodicSpring],
    shaft_frequency: ArrayLike,
    *,
    highest_hz: float | None = None,
    harmonics: int | None = None,
) -> Stability:
    """Growth rates at every speed.

    Parameters
    ----------
    system, springs
        As for `steady_state`; errors and static forces do not matter.
    shaft_frequency : array, shape (n_speed,), 1/s
    highest_hz
        Modes above are left out; by default as many as leave a hundredth of a spring's flexibility.
    harmonics
        Modes above this harmonic of the fastest spring at the fastest of these speeds are left out
        as well: l f = f_p + f_q is needed to excite two modes, so that these follow as they would
        a static force. None: no such limit.

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
    reach = np.inf
    if harmonics is not None and varying:
        reach = harmonics * max(spring.ratio for spring in varying) * float(speeds.max())
    modes = _Modes.of(system, springs, highest_hz, reach)
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

    each(
        solve, stretches(speeds.size, BLOCK), 32 * len(modes.omega) ** 2 * LEAST_STEPS * speeds.size
    )
    return Stability(speeds, read_only(growth), read_only(period), modes.left_out, len(modes.omega))


@door
def stability_by_period(
    system: SecondOrderSystem,
    springs: Sequence[PeriodicSpring],
    shaft_frequency: ArrayLike,
    *,
    highest_hz: float | None = None,
) -> tuple[tuple[tuple[int, ...], Stability], ...]:
    """Stability of every group of springs with a common period, the others at their mean.

    What several periods do together is not in it: instabilities at sums of harmonics of different
    periods, which are of second order in the variations (first order at each alone).

    Parameters
    ----------
    system, springs, shaft_frequency, highest_hz
        As for `stability`.

    Returns
    -------
    tuple of (positions in ``springs``, Stability)
        Groups of springs whose stiffness varies.
    """
    varying = [m for m, spring in enumerate(springs) if spring.variation.any()]
    found = []
    for group in common_periods([springs[m] for m in varying]):
        where = tuple(varying[m] for m in group)
        own = [springs[m] for m in where]
        result = stability(system, own, shaft_frequency, highest_hz=highest_hz)
        found.append((where, result))
    return tuple(found)


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
        cls,
        system: SecondOrderSystem,
        springs: Sequence[PeriodicSpring],
        highest_hz: float | None,
        reach_hz: float,
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
        kept &= omega <= max(2.0 * np.pi * reach_hz, float(omega.min()))
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
        vibrate = self._vibration(step)
        stretch = rows / omega
        whole = np.tile(np.eye(2 * n), (len(period), 1, 1))
        for part in stretches(count, WINDOW):
            strengths = self._strengths(np.arange(count)[part], count, step)
            for strength in strengths:
                whole = vibrate(whole)
                whole[:, n:] -= rows.T @ (strength @ (stretch @ whole[:, :n]))
        return whole

    def _vibration(self, step: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Left product with exp(h [[0, Ω], [−Ω, −Γ]]); mode by mode where they are not coupled."""
        from scipy.linalg import expm

        omega, damping = self.modes.omega, self.modes.damping
        n = len(omega)
        if not is_proportional(damping):
            turn = np.diag(omega)
            generator = np.block([[np.zeros_like(turn), turn], [-turn, -damping]])
            free = expm(step[:, None, None] * generator)
            return lambda whole: free @ whole
        each_mode = np.zeros((n, 2, 2))
        each_mode[:, 0, 1], each_mode[:, 1, 0] = omega, -omega
        each_mode[:, 1, 1] = -np.diag(damping)
        free = expm(step[:, None, None, None] * each_mode)
        own, other = free[..., [0, 1], [0, 1]], free[..., [0, 1], [1, 0]]
        own, other = (part.transpose(0, 2, 1)[..., None] for part in (own, other))
        crossed = np.empty((len(step), 2, n, 2 * n))  # new memory at each step takes as long again

        def vibrate(whole: FloatArray) -> FloatArray:
            halves = whole.reshape(crossed.shape)
            np.multiply(other, halves[:, ::-1], out=crossed)
            halves *= own
            halves += crossed
            return whole

        return vibrate

    def _strengths(self, instants: IntArray, count: int, step: FloatArray) -> FloatArray:
        """h D at some of the N instants of a period (n_instant, n_speed, n_spring, n_spring)."""
        rows = self.modes.rows
        varying = self._variation(instants, count)
        second = varying @ (rows @ rows.T) @ varying
        h = step[:, None, None]
        return np.asarray(h * varying[:, None] - h**3 / 12.0 * second[:, None])

    def _variation(self, instants: IntArray, count: int) -> FloatArray:
        """(1 + κ R)⁻¹ κ (n_instant, n_spring, n_spring)."""
        size = len(self.modes.rows)
        varying = np.zeros((len(instants), size, size))
        for m, step, coefficients in self.series:
            orders = step * np.arange(1, len(coefficients) + 1)
            below = 2 * orders < count
            waves = np.exp(2j * np.pi / count * np.multiply.outer(instants, orders[below]))
            varying[:, m, m] = (waves @ coefficients[below]).real
        return np.asarray(np.linalg.solve(np.eye(size) + varying @ self.modes.residual, varying))

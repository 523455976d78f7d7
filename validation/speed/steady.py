"""Steady states and stability at some speeds: what a worker computes.

Speeds are independent of each other, so that they go to any executor in pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fbs import Quantity
from fbs.periodic.floquet import stability
from fbs.periodic.harmonic_balance import (
    PeriodicResponse,
    SingularBalanceError,
    outputs,
    steady_state,
)
from fbs.periodic.periodic_extremes import extremes, waveform
from fbs.periodic.periodic_springs import Lattice, PeriodicSpring, common_periods, lattice
from fbs.second_order_system import SecondOrderSystem

from ..arrays import BoolArray, ComplexArray, FloatArray
from .turning import BEYOND, COMBINED, Bearing, Turning, shown_lines

BOUNDARY = "on the boundary of an instability: no steady state"
# Instants at which a bearing's force is looked at, per period of its highest line: the largest
# value is missed by less than ½ (π/24)² = 0.9 % of that line alone.
PER_PERIOD = 24
INSTANTS, LONG = 8192, 17.0  # where phases are independent, and periods from one to the next
# Of each mesh frequency, of which instabilities are looked for: a trapezoid's twentieth has 1/400
# of the first one's width, which any damping that gears have closes.
UNSTABLE_HARMONICS = 20
TOGETHER = 10  # speeds whose forces are looked at together, which takes 2 MB each


@dataclass(frozen=True, eq=False)
class SpeedSystem:
    """What vibrates at every speed; small enough to send.

    Attributes
    ----------
    constant, springs
        The drivetrain with its meshes at their mean, and the meshes.
    bearings
        Whose forces are asked for.
    harmonics
        Of each mesh frequency, that are shown.
    """

    constant: SecondOrderSystem
    springs: tuple[PeriodicSpring, ...]
    bearings: tuple[Bearing, ...]
    harmonics: int

    def solve(self, shaft_frequency: FloatArray) -> PeriodicResponse:
        """The steady state with all lines that are solved for."""
        return steady_state(
            self.constant,
            self.springs,
            shaft_frequency,
            harmonics=self.harmonics + BEYOND,
            combinations=COMBINED,
        )

    @cached_property
    def lines(self) -> Lattice:
        """The lines shown."""
        return lattice(self.springs, self.harmonics)


@dataclass(frozen=True, eq=False)
class SteadyStates:
    """What happens at some speeds (rows); NaN where there is no steady state.

    Lines, x(t) = Re Σ_h x_h exp(j2π f_h t), are those shown, the mean first. All other quantities
    have all the lines that are solved for.

    Attributes
    ----------
    rpm
        (n,) speed of the input.
    status
        (n,) "ok", or why there is no steady state.
    mesh
        (n, n_line, n_mesh) N, static force included.
    mesh_max, mesh_min, mesh_rms
        (n, n_mesh) N; the root mean square is that about the mean.
    bearing
        (n, n_line, n_bearing) amplitude of each line (N): the longer half axis of the ellipse on
        which the force goes round; the mean's length, without the static force.
    bearing_peak
        (n, n_bearing) longest vibrating force (N).
    acceleration
        (n, n_line, n_dof) m/s².
    growth
        (n,) growth of the fastest growing motion (1/s).
    residual, truncation, imbalance
        (n,) of the balance; what the choice of lines misses; and what is left of the mean forces
        on all DoFs, of the largest mean force of a mesh.
    """

    rpm: FloatArray
    status: NDArray[np.str_]
    mesh: ComplexArray
    mesh_max: FloatArray
    mesh_min: FloatArray
    mesh_rms: FloatArray
    bearing: FloatArray
    bearing_peak: FloatArray
    acceleration: ComplexArray
    growth: FloatArray
    residual: FloatArray
    truncation: FloatArray
    imbalance: FloatArray

    @property
    def ok(self) -> BoolArray:
        """Where there is a steady state."""
        return np.asarray(self.status == "ok")


def speed_system(turning: Turning) -> SpeedSystem:
    """What vibrates of a turning drivetrain."""
    return SpeedSystem(
        turning.periodic.system,
        turning.periodic.springs,
        turning.bearings,
        turning.plan.harmonics,
    )


def joined(pieces: Sequence[SteadyStates]) -> SteadyStates:
    """Pieces of a speed range as one, ascending."""
    names = [field.name for field in fields(SteadyStates)]
    whole = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in names}
    order = np.argsort(whole["rpm"])
    return SteadyStates(**{name: values[order] for name, values in whole.items()})


def evaluate(system: SpeedSystem, rpm: Sequence[float]) -> SteadyStates:
    """Steady states and growth rates at some speeds (rpm)."""
    speeds = np.asarray(rpm, dtype=float)
    solved = np.ones(len(speeds), dtype=bool)
    try:
        response = system.solve(speeds / 60.0)
    except SingularBalanceError as error:
        solved = ~np.isin(speeds / 60.0, error.shaft_frequencies)
        if not solved.any():
            return failed(system, speeds, BOUNDARY)
        response = system.solve(speeds[solved] / 60.0)
    steady = _steady(system, speeds[solved], response)
    pieces = [steady] if solved.all() else [steady, failed(system, speeds[~solved], BOUNDARY)]
    return replace(joined(pieces), growth=growth_rates(system, np.sort(speeds) / 60.0))


def failed(system: SpeedSystem, rpm: Sequence[float] | FloatArray, why: str) -> SteadyStates:
    """Speeds without a steady state, and why."""
    n, lines = len(rpm), len(system.lines.points)
    n_mesh, n_bearing = len(system.springs), len(system.bearings)

    def nothing(*shape: int) -> FloatArray:
        return np.full((n, *shape), np.nan)

    return SteadyStates(
        rpm=np.asarray(rpm, dtype=float),
        status=np.full(n, why),
        mesh=nothing(lines, n_mesh).astype(complex),
        mesh_max=nothing(n_mesh),
        mesh_min=nothing(n_mesh),
        mesh_rms=nothing(n_mesh),
        bearing=nothing(lines, n_bearing),
        bearing_peak=nothing(n_bearing),
        acceleration=nothing(lines, len(system.constant.dofs)).astype(complex),
        growth=nothing(),
        residual=nothing(),
        truncation=nothing(),
        imbalance=nothing(),
    )


def _steady(system: SpeedSystem, rpm: FloatArray, response: PeriodicResponse) -> SteadyStates:
    forces = response.spring_forces
    reached = extremes(forces, response.lattice)
    lengths, longest = _bearing_forces(system.bearings, response)
    everything = np.eye(len(system.constant.dofs))
    shown = shown_lines(system.lines, response.lattice)
    return SteadyStates(
        rpm=rpm,
        status=np.full(len(rpm), "ok"),
        mesh=forces[:, shown],
        mesh_max=reached.largest,
        mesh_min=reached.smallest,
        mesh_rms=np.sqrt(0.5 * np.sum(np.abs(forces[:, 1:]) ** 2, axis=1)),
        bearing=lengths[:, shown],
        bearing_peak=longest,
        acceleration=outputs(response, everything, quantity=Quantity.ACCELERANCE)[:, shown],
        growth=np.full(len(rpm), np.nan),
        residual=response.residual,
        truncation=response.truncation,
        imbalance=_imbalance(system, response),
    )


def _imbalance(system: SpeedSystem, response: PeriodicResponse) -> FloatArray:
    """max |K q₀ + Σ v p₀|, of the largest mean force of a mesh (n_speed,)."""
    mean = outputs(response, system.constant.stiffness)[:, 0].real
    vectors = np.array([spring.vector for spring in system.springs])
    left = np.abs(mean + response.excess[:, 0].real @ vectors).max(axis=1)
    largest = np.abs(response.spring_forces[:, 0].real).max(axis=1)
    return np.asarray(np.divide(left, largest, out=np.zeros_like(left), where=largest > 0.0))


def _bearing_forces(
    bearings: Sequence[Bearing], response: PeriodicResponse
) -> tuple[FloatArray, FloatArray]:
    """Amplitude of each line (n, n_line, n_bearing), and the longest force (n, n_bearing), N.

    A line Re F e^{jωt} of a vector F goes round an ellipse; with F·F = Σ F_i² its longer half axis
    is √(½(|F|² + |F·F|)).
    """
    shape = len(response.shaft_frequency), len(response.lattice.points)
    if not bearings:
        return np.zeros((*shape, 0)), np.zeros((shape[0], 0))
    lines = outputs(
        response,
        np.concatenate([bearing.rows for bearing in bearings]),
        np.concatenate([bearing.damping_rows for bearing in bearings]),
    )
    starts = np.cumsum([0, *(len(bearing.rows) for bearing in bearings)])[:-1]
    square = np.add.reduceat(np.abs(lines) ** 2, starts, axis=2)
    product = np.abs(np.add.reduceat(lines**2, starts, axis=2))
    turns = _instants(response.lattice)
    longest = np.empty((shape[0], len(bearings)))
    for first in range(0, shape[0], TOGETHER):
        block = slice(first, first + TOGETHER)
        forces = waveform(lines[block], response.lattice, turns)
        longest[block] = np.sqrt(np.add.reduceat(forces**2, starts, axis=2).max(axis=1))
    return np.sqrt(0.5 * (square + product)), longest


def _instants(lattice: Lattice) -> FloatArray:
    """Angles of the shaft (turns) at which forces are looked at.

    Over the period where there is one; otherwise, golden sections of a long time, which come close
    to every combination of the phases.
    """
    if lattice.n_phases == 1:
        count = PER_PERIOD * max(int(np.abs(lattice.points).max()), 1)
        return np.arange(count) / (count * float(lattice.fundamentals[0]))
    golden = (np.sqrt(5.0) - 1.0) / 2.0
    slowest = float(lattice.fundamentals.min())
    return np.asarray(np.arange(INSTANTS) * (LONG + golden) / slowest)


def growth_rates(system: SpeedSystem, shaft_frequency: FloatArray) -> FloatArray:
    """Growth of the fastest growing motion at every speed (1/s).

    Stages without a common period are asked one by one, the others' meshes at their mean.
    """
    groups = common_periods(varying := [s for s in system.springs if np.any(s.variation)])
    if not groups:
        return np.full(len(shaft_frequency), np.nan)
    rates = [
        stability(
            system.constant,
            [varying[i] for i in group],
            shaft_frequency,
            harmonics=UNSTABLE_HARMONICS,
        ).growth_rate
        for group in groups
    ]
    return np.asarray(np.max(rates, axis=0))

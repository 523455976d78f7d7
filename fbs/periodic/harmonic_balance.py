"""Steady vibration of a system with periodic springs at every speed, by harmonic balance.

About the static state, with the constant springs k_m, c_m in C and K already,

    M q̈ + C q̇ + K q + Σ_m v_m p_m(t) = 0,
    p_m = k_m κ_m (δ_m − e_m) − k_m e_m − c_m ė_m

is what the springs do beyond being constant. On the lattice of lines h·f (`Lattice`)

    δ_h = δ_static [h = 0] − Y(h·f) p_h,    Y = Vᵀ H V:

the constant system's receptances between the springs, coupled by a convolution with κ: the harmonic
transfer matrix (Wereley 1991, Analysis and control of linear periodically time varying systems,
MIT), in the form (1 + k κ∗ Y) p = k κ∗ (δ_static − e) − (k + jω c) e.
A motion of rigid bodies strains no spring and is no part of Y, which is therefore finite at 0 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels.blocks import each, stretches
from .._kernels.checks import ComplexArray, FloatArray, numbers, read_only
from .._kernels.door import door
from ..errors import FbsError, first_few
from ..frf import Quantity, as_quantity
from ..second_order_system import SecondOrderSystem
from ._balance import Balance, Convolution, moved, multiples
from ._spring_receptances import SpringModes, spring_modes
from .periodic_springs import (
    COMBINATIONS,
    HARMONICS,
    IntArray,
    Lattice,
    PeriodicSpring,
    lattice,
    series_at,
    shaft_frequencies,
)

BLOCK = 8
"""Speeds solved at once: their blocks' inverses stay in the cache."""

CARRIES_NOTHING = 1e-9
"""Of the largest force: a spring's that is round-off, whose missing lines say nothing."""


class SingularBalanceError(FbsError):
    """The balance has no solution at a speed: it lies on the boundary of an instability.

    Attributes
    ----------
    shaft_frequencies : array, shape (n,), 1/s
        All the speeds concerned.
    """

    def __init__(self, shaft_frequencies: ArrayLike) -> None:
        self.shaft_frequencies = np.atleast_1d(np.asarray(shaft_frequencies, dtype=float))
        count = self.shaft_frequencies.size
        super().__init__(
            f"the balance of periodic springs is singular at {count} "
            f"speed{'s' if count != 1 else ''} ({first_few(self.shaft_frequencies)} turns/s): they "
            "lie on the boundary of an instability, where no steady state exists; leave these "
            "speeds out or add damping"
        )

    def __reduce__(self) -> tuple[type[SingularBalanceError], tuple[FloatArray]]:
        return type(self), (self.shaft_frequencies,)


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
        How much of the vibration the choice of lines misses: of every spring the largest force line
        that is left out, over its largest that is not; of this the largest. Lines up to 2 H and
        P + 1 (at least 4) are looked at, as the lattice's lines excite them.
    step : float or None, s
        Of the trapezoidal rule whose solution it is; None: the exact one.
    """

    system: SecondOrderSystem
    springs: tuple[PeriodicSpring, ...]
    lattice: Lattice
    shaft_frequency: FloatArray
    excess: ComplexArray
    deflection: ComplexArray
    residual: FloatArray
    truncation: FloatArray
    step: float | None = None

    @property
    def frequency(self) -> FloatArray:
        """f_h (n_speed, n_line), Hz; with a step, as the trapezoidal rule sees them."""
        return line_frequencies(self.shaft_frequency, self.lattice, self.step)

    @property
    def spring_forces(self) -> ComplexArray:
        """F_h (n_speed, n_line, n_spring), N: the static force included at h = 0."""
        stiffness, damping, static = (
            np.array([getattr(spring, key) for spring in self.springs])
            for key in ("stiffness", "damping", "static_force")
        )
        speed = 2j * np.pi * self.frequency[..., None]
        forces: ComplexArray = (stiffness + speed * damping) * self.deflection + self.excess
        forces[:, 0] += static
        return forces


@door
def steady_state(
    system: SecondOrderSystem,
    springs: Sequence[PeriodicSpring],
    shaft_frequency: ArrayLike,
    *,
    harmonics: int = HARMONICS,
    combinations: int = COMBINATIONS,
    step: float | None = None,
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
    step
        h (s): the steady state of the trapezoidal rule with this step. It takes derivatives at
        w' = (2/h) tan(w h/2) instead of w (Tustin's transform), exactly, and at its instants k(t)
        is what it is.

    Raises
    ------
    SingularBalanceError
        At speeds on the boundary of an instability.
    SingularLineError
        A line lies on an undamped pole of the constant system.
    FbsError, NonFiniteError, IndefiniteMassError, IndefiniteStiffnessError, DefectiveModesError
    """
    speeds = shaft_frequencies(shaft_frequency)
    modes = spring_modes(system, springs)
    lines = lattice(springs, harmonics, combinations)
    more = lattice(springs, 2 * harmonics, max(combinations + 1, COMBINATIONS + 1))
    solver = _Solver.of(springs, modes, lines, more, step)
    shape = (speeds.size, len(lines.points), len(springs))
    excess, deflection = np.empty(shape, dtype=complex), np.empty(shape, dtype=complex)
    residual, truncation = np.empty(speeds.size), np.empty(speeds.size)
    singular = np.zeros(speeds.size, dtype=bool)

    def solve(part: slice) -> None:
        p, d, residual[part], truncation[part], singular[part] = solver.solve(speeds[part])
        excess[part], deflection[part] = p.transpose(0, 2, 1), d.transpose(0, 2, 1)

    each(solve, stretches(speeds.size, BLOCK), excess.nbytes * shape[1])
    if singular.any():
        raise SingularBalanceError(speeds[singular])
    return PeriodicResponse(
        system,
        tuple(springs),
        lines,
        speeds,
        read_only(excess),
        read_only(deflection),
        read_only(residual),
        read_only(truncation),
        step,
    )


@door
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

    Raises
    ------
    FbsError
        A or B has another shape.
    """
    size = len(response.system.dofs)
    modes = spring_modes(response.system, response.springs)
    speed = 2j * np.pi * response.frequency[..., None]
    force = -modes.factors(response.frequency) * (response.excess @ modes.excitation)
    drift = np.divide(force, speed, out=np.zeros_like(force), where=speed != 0.0)
    displacement = force @ modes.shapes.T + drift @ modes.rigid_shapes.T
    value = displacement @ _rows(rows, size, "rows").T
    if damping_rows is not None:
        value = value + speed * (displacement @ _rows(damping_rows, size, "damping_rows").T)
    return np.asarray(speed ** as_quantity(quantity).derivative * value)


def line_frequencies(
    shaft_frequency: FloatArray, lines: Lattice, step: float | None = None
) -> FloatArray:
    """f_h (n_speed, n_line), Hz, or with the trapezoidal rule's step tan(pi f h)/(pi h)."""
    frequency = np.multiply.outer(shaft_frequency, lines.orders)
    if step is None:
        return frequency
    return np.asarray(np.tan(np.pi * frequency * step) / (np.pi * step))


def _rows(rows: ArrayLike, size: int, name: str) -> FloatArray:
    matrix = numbers(rows, name)
    if matrix.ndim != 2 or matrix.shape[1] != size:
        raise FbsError(f"{name} have shape {matrix.shape}: must be (n_output, {size})")
    return matrix


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines of the springs, and what the springs' errors are there.

    Parameters
    ----------
    lattice
        The lines.
    stiffness, damping : array, shape (n_spring, 1)
    errors : complex array, shape (n_spring, n_line), m
    step : float or None, s
        Of the trapezoidal rule.
    """

    lattice: Lattice
    stiffness: FloatArray
    damping: FloatArray
    errors: ComplexArray
    step: float | None

    @classmethod
    def of(
        cls,
        springs: Sequence[PeriodicSpring],
        steps: IntArray,
        lines: Lattice,
        step: float | None,
    ) -> _Lines:
        errors = [
            2.0 * series_at(spring.error, multiples(lines.points, own))
            for spring, own in zip(springs, steps, strict=True)
        ]
        stiffness, damping = (
            np.array([[getattr(spring, key)] for spring in springs])
            for key in ("stiffness", "damping")
        )
        return cls(lines, stiffness, damping, np.array(errors), step)

    def frequency(self, speeds: FloatArray) -> FloatArray:
        """f_h (n_speed, n_line), Hz."""
        return line_frequencies(speeds, self.lattice, self.step)

    def constant(self, speeds: FloatArray, deflection: ComplexArray) -> ComplexArray:
        """(k + jω c) δ of the constant springs (n_speed, n_spring, n_line)."""
        omega = 2.0 * np.pi * self.frequency(speeds)[:, None]
        return np.asarray((self.stiffness + 1j * omega * self.damping) * deflection)


@dataclass(frozen=True, eq=False)
class _Solver:
    """The balance on chosen lines, and the lines next to them that are left out."""

    modes: SpringModes
    kept: _Lines
    dropped: _Lines
    balance: Balance
    dropping: Convolution
    static: FloatArray

    @classmethod
    def of(
        cls,
        springs: Sequence[PeriodicSpring],
        modes: SpringModes,
        lines: Lattice,
        more: Lattice,
        step: float | None,
    ) -> _Solver:
        known = {tuple(point) for point in lines.points.tolist()}
        beyond = [tuple(point) not in known for point in more.points.tolist()]
        dropped = Lattice(more.points[beyond], lines.fundamentals, lines.steps)
        static = np.zeros((len(springs), len(lines.points)))
        static[:, 0] = [spring.static_force / spring.stiffness for spring in springs]
        return cls(
            modes,
            _Lines.of(springs, lines.steps, lines, step),
            _Lines.of(springs, lines.steps, dropped, step),
            Balance.of(springs, lines),
            Convolution.between(springs, lines.steps, dropped.points, lines.points),
            static,
        )

    def solve(
        self, speeds: FloatArray
    ) -> tuple[ComplexArray, ComplexArray, FloatArray, FloatArray, NDArray[np.bool_]]:
        """p, d (n_speed, n_spring, n_line), residual, truncation, and where it is singular."""
        receptances = self._receptances(self.kept, speeds)
        pressed = np.broadcast_to(self.static - self.kept.errors, (speeds.size, *self.static.shape))
        right = self.balance.vary(pressed) - self.kept.constant(speeds, self.kept.errors)
        excess, residual, singular = self.balance.solve(receptances, right)
        deflection = -moved(receptances, excess)
        forces = self.kept.constant(speeds, self.static + deflection) + excess
        beyond = self._dropped_forces(speeds, pressed + deflection)
        return excess, deflection, residual, _missed(beyond, forces), singular

    def _dropped_forces(self, speeds: FloatArray, pressed: ComplexArray) -> ComplexArray:
        """F of lines left out, from δ − e of the others."""
        lines = self.dropped
        excess = lines.stiffness * self.dropping(pressed) - lines.constant(speeds, lines.errors)
        deflection = -moved(self._receptances(lines, speeds), excess)
        return lines.constant(speeds, deflection) + excess

    def _receptances(self, lines: _Lines, speeds: FloatArray) -> ComplexArray:
        return self.modes.receptances(self.modes.factors(lines.frequency(speeds)))


def _missed(beyond: ComplexArray, forces: ComplexArray) -> FloatArray:
    """Largest share of a spring's largest line that another one, left out, has (n_speed,)."""
    largest = np.abs(forces).max(axis=2)
    counts = largest > CARRIES_NOTHING * largest.max(axis=1, keepdims=True)
    missed = np.abs(beyond).max(axis=2, initial=0.0)
    return np.asarray(np.where(counts, missed / np.where(counts, largest, 1.0), 0.0).max(axis=1))

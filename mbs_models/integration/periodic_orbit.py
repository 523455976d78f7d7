"""exudyn in time: whole periods of the steady state under a multisine.

The motion is started on the periodic orbit instead of waiting until a lightly damped mode has died
out: the linearised system's steady state under the same lines, as the integrator sees it, solves
the integrator's own difference equations. What geometry adds to it is of second order and does not
change its sign with the force, nor does a free drivetrain's slow creep: half the difference of two
runs, the second with the force reversed, is free of both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model.excitation import Excitation
from ..signals.lines import Multisine, Signal
from ..system.drivetrain import MultibodySystem
from ..system.harmonic_response import harmonic_response
from ..system.linearization import LinearizedSystem
from .integrators import KNOWN_BEND, TRAPEZOIDAL, Integrator
from .reversal import odd_part, reversed_excitation
from .steady_state import steady_start
from .time_integration import simulate

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
BoolArray = NDArray[np.bool_]
Progress = Callable[[str, int, int], None]

# The orbit is closed when a period ends this near to where it began, of the largest motion (each
# DoF by its own). Round-off of a stiff hub's spring leaves 1e-9; what geometry does to odd order
# grows with the square of the force.
CLOSURE = 1e-6
# DoFs that symmetry keeps still, by the linearised system: what moves them is not linear.
STILL = 1e-9


@dataclass(frozen=True, eq=False)
class PeriodicRecord:
    """Whole periods of the steady state.

    Attributes
    ----------
    labels
        DoFs of the columns.
    velocity
        (n, n_dof) m/s, the part that changes its sign with the force.
    even
        (n, n_dof) m/s, the part that does not: geometry's even orders, and round-off. Zero where
        the force was not reversed.
    excitation
        The force.
    sampling_frequency
        Hz; a period is a whole number of samples.
    integrator
        Rule and step.
    closure
        Largest |x(t + T) − x(t)| of a DoF over its largest motion, at the last period's ends.
    """

    labels: tuple[str, ...]
    velocity: FloatArray
    even: FloatArray
    excitation: Excitation[Multisine]
    sampling_frequency: float
    integrator: Integrator
    closure: float

    @property
    def period(self) -> int:
        """Samples per period."""
        return round(self.excitation.signal.period * self.sampling_frequency)

    @property
    def periods(self) -> int:
        """How many were integrated, each way."""
        return len(self.velocity) // self.period

    @property
    def closed(self) -> bool:
        """Whether the motion is periodic."""
        return self.closure <= CLOSURE

    @property
    def even_share(self) -> float:
        """Largest of the even motion over the largest odd one: how far geometry is from linear."""
        return float(np.abs(self.even).max() / np.abs(self.velocity).max())

    @property
    def frequency(self) -> FloatArray:
        """(n_line,) f′ (Hz): what the integrator makes of a line f is exact at f′.

        f′ = tan(πfh)/(πh) of the trapezoidal rule (Tustin), f itself of others.
        """
        lines = self.excitation.signal.frequency
        if self.integrator.name != TRAPEZOIDAL:
            return lines
        half = np.pi * self.integrator.step
        return np.asarray(np.tan(half * lines) / half)

    def receptance(self) -> ComplexArray:
        """H(f′_k) = V_k/(jω′_k F_k), (n_line, n_dof): no leakage, no window (m/N).

        Of velocities, in which a free drivetrain's creep is but a constant.
        """
        return self._over_force(self.velocity)

    def unknown(self) -> FloatArray:
        """The same of the even motion: of the odd one as much may be round-off (m/N)."""
        return np.abs(self._over_force(self.even))

    def _over_force(self, motion: FloatArray) -> ComplexArray:
        signal = self.excitation.signal
        spectrum = np.fft.rfft(motion[-self.period :], axis=0)[signal.harmonics]
        force = np.fft.rfft(signal.samples(self.period))[signal.harmonics]
        ratio: ComplexArray = spectrum / (2j * np.pi * self.frequency * force)[:, None]
        return ratio


def steps_per_period(signal: Multisine) -> int:
    """Steps that keep the trapezoidal rule's (ωh)²/12 at the highest line below what is allowed."""
    highest = 2.0 * np.pi * float(signal.frequency.max())
    step = np.sqrt(12.0 * KNOWN_BEND) / highest
    return int(np.ceil(signal.period / step))


def trapezoidal(signal: Multisine, steps: int | None = None) -> Integrator:
    """The trapezoidal rule with so many steps per period (default: `steps_per_period`)."""
    step = signal.period / (steps or steps_per_period(signal))
    return Integrator(TRAPEZOIDAL, step, f"trapezoidal rule, h = {step:.3g} s")


def periodic_response(
    system: MultibodySystem,
    linear: LinearizedSystem,
    excitation: Excitation[Multisine],
    integrator: Integrator,
    *,
    sampling_frequency: float | None = None,
    periods: int = 1,
    loads: Sequence[Excitation[Signal]] = (),
    static: FloatArray | None = None,
    responses: Sequence[str] | None = None,
    reverse: bool = True,
    progress: Progress | None = None,
) -> PeriodicRecord:
    """Integrate a system over its periodic orbit under a multisine.

    Parameters
    ----------
    system, linear
        What is excited, and the same linearised about its equilibrium; it is left as it was found.
    excitation
        The multisine.
    integrator, sampling_frequency
        As for `simulate`; a period must be a whole number of samples.
    periods
        How many to integrate.
    loads, static
        A preload, and the equilibrium under it (m). None: unloaded.
    responses
        DoFs to record. None: all.
    reverse
        Whether to run with the force (not the preload) reversed as well.
    progress
        Called with a step's name, runs done, and how many there are.

    Raises
    ------
    ModelError
        A DoF is unknown.
    SimulationError
        The motion diverged.
    """
    rate = sampling_frequency or 1.0 / integrator.step
    signal = excitation.signal
    samples = periods * round(signal.period * rate)
    warped = integrator.step if integrator.name == TRAPEZOIDAL else None
    moved, moving = steady_start(linear, excitation.dof, signal.frequency, signal.spectrum, warped)
    rest = np.zeros(len(linear.dofs)) if static is None else static
    report = progress or (lambda name, done, total: None)

    def run(driving: Excitation[Signal], sign: float) -> tuple[FloatArray, FloatArray]:
        record = simulate(
            system,
            (driving, *loads),
            duration=(samples + 1) / rate,
            integrator=integrator,
            sampling_frequency=rate,
            start_state=(rest + sign * moved, sign * moving),
            responses=responses,
            record=("displacement", "velocity"),
        )
        assert record.displacement is not None
        assert record.velocity is not None
        return record.displacement, record.velocity

    report("time integration", 0, 1 + reverse)
    displacement, velocity = run(excitation, 1.0)
    even = np.zeros_like(velocity)
    if reverse:
        report("time integration", 1, 2)
        other = run(reversed_excitation(excitation), -1.0)
        even = (velocity + other[1]) / 2.0
        displacement, velocity = odd_part(displacement, other[0]), odd_part(velocity, other[1])
    report("time integration", 1 + reverse, 1 + reverse)
    return PeriodicRecord(
        labels=linear.dofs if responses is None else tuple(responses),
        velocity=velocity[:-1],
        even=even[:-1],
        excitation=excitation,
        sampling_frequency=rate,
        integrator=integrator,
        closure=_closure(
            displacement[-1 - samples // periods :], _responding(linear, excitation, responses)
        ),
    )


def _responding(
    linear: LinearizedSystem, excitation: Excitation[Multisine], responses: Sequence[str] | None
) -> BoolArray:
    """Which of the responses move at any line (all: None)."""
    labels = linear.dofs if responses is None else tuple(responses)
    lines = excitation.signal.frequency
    frf = harmonic_response(linear, lines, linear.dofs, (excitation.dof,))
    size = dict(zip(linear.dofs, np.abs(frf).max(axis=(0, 2)), strict=True))
    least = STILL * max(size.values())
    return np.array([size[label] > least for label in labels])


def _closure(displacement: FloatArray, responding: BoolArray) -> float:
    largest = np.abs(displacement).max(axis=0)[responding]
    gap = np.abs(displacement[-1] - displacement[0])[responding]
    return float((gap / largest).max())

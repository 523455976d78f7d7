"""exudyn in time: one period of the steady state under a multisine.

The motion is started on the periodic orbit instead of waiting until a lightly damped mode has died
out: from the linearised system's steady state, corrected by shooting, x₀ ← x₀ + (I − Φ)⁻¹(x(T) −
x₀), with the linearised Φ, until the period closes. Both are the integrator's own: the trapezoidal
rule takes s to (2/h) tanh(sh/2), which is known exactly. Geometry's even-order share is removed by
a second run with the force reversed; so is a free drivetrain's slow creep, which has no sign.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..errors import OrbitError
from ..interrupts import interrupts_held
from ..modal.mode_kinds import rigid_body_count
from ..model.excitation import Excitation
from ..model.parameters import Drivetrain
from ..signals.lines import Multisine
from ..system.drivetrain import build_drivetrain
from ..system.linearization import LinearizedSystem, coordinate_transform, linearize
from .integrators import KNOWN_BEND
from .probes import INITIAL, NodeSensors, add_force, solver_settings
from .steady_state import steady_lines

FloatArray = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

# The orbit is closed when a period ends this near to where it began, of the largest motion (each
# DoF by its own): about the integrator's round-off of a stiff hub's spring.
CLOSURE = 1e-6
MAX_SHOTS = 5


@dataclass(frozen=True)
class PeriodicRecord:
    """One period of the steady state.

    Attributes
    ----------
    labels
        DoFs of the columns.
    time
        (n,) s.
    displacement
        (n, n_dof) m, the part that is odd in the force, without what a free drivetrain creeps by.
    even
        (n, n_dof) m, the part that does not change sign with the force: geometry's even orders,
        and round-off.
    excitation
        The force.
    force
        (n,) N.
    step
        Integrator step (s); the integrator is the implicit trapezoidal rule.
    closure
        Largest |x(T) − x(0)| of a DoF over its largest motion.
    shots
        How many periods it took to close the orbit.
    """

    labels: tuple[str, ...]
    time: FloatArray
    displacement: FloatArray
    even: FloatArray
    excitation: Excitation[Multisine]
    force: FloatArray
    step: float
    closure: float
    shots: int

    @property
    def even_share(self) -> float:
        """Largest of the even motion over the largest odd one: how far geometry is from linear."""
        return float(np.abs(self.even).max() / np.abs(self.displacement).max())

    @property
    def frequency(self) -> FloatArray:
        """(n_line,) f′ = tan(πfh)/(πh) (Hz): what the rule makes of a line f is exact at f′."""
        half = np.pi * self.step
        return np.asarray(np.tan(half * self.excitation.signal.frequency) / half)

    def receptance(self) -> NDArray[np.complex128]:
        """H(f′_k) = X_k/F_k at the excited lines, (n_line, n_dof): no leakage, no window (m/N)."""
        return self._over_force(self.displacement)

    def unknown(self) -> FloatArray:
        """The same of the even motion, |E_k/F_k|: of the odd one as much may be round-off (m/N)."""
        return np.abs(self._over_force(self.even))

    def _over_force(self, motion: FloatArray) -> NDArray[np.complex128]:
        lines = self.excitation.signal.harmonics
        spectrum = np.fft.rfft(motion, axis=0)[lines]
        ratio: NDArray[np.complex128] = spectrum / np.fft.rfft(self.force)[lines, None]
        return ratio


def steps_per_period(signal: Multisine) -> int:
    """Steps that keep the trapezoidal rule's (ωh)²/12 at the highest line below what is allowed."""
    highest = 2.0 * np.pi * float(signal.frequency.max())
    step = np.sqrt(12.0 * KNOWN_BEND) / highest
    return int(np.ceil(signal.period / step))


def periodic_response(
    drivetrain: Drivetrain,
    excitation: Excitation[Multisine],
    *,
    steps: int | None = None,
    progress: Progress | None = None,
) -> PeriodicRecord:
    """Integrate the whole drivetrain over its periodic orbit under a multisine.

    Parameters
    ----------
    drivetrain
        What is excited; its own damping acts.
    excitation
        The multisine.
    steps
        Integrator steps per period (default: `steps_per_period`).
    progress
        Called with a step's name, periods integrated, and how many there may be.

    Raises
    ------
    ModelError
        The DoF is unknown.
    OrbitError
        The motion diverged, or the orbit does not close.
    """
    runner = _Runner(drivetrain, excitation, steps or steps_per_period(excitation.signal))
    report = progress or (lambda name, done, total: None)
    state = runner.linear_start()
    plus, shots = _close(runner, state, 1.0, lambda k: report("time integration", k, 4))
    minus, _ = _close(runner, -plus.start, -1.0, lambda k: report("time integration", 2 + k, 4))
    report("time integration", 4, 4)
    odd = (plus.displacement - minus.displacement) / 2.0
    even = (plus.displacement + minus.displacement) / 2.0
    return PeriodicRecord(
        labels=runner.linear.dofs,
        time=np.asarray(np.arange(runner.steps) * runner.step, dtype=float),
        displacement=odd,
        even=even,
        excitation=excitation,
        force=runner.force,
        step=runner.step,
        closure=max(plus.closure, minus.closure),
        shots=shots,
    )


@dataclass(frozen=True)
class _Shot:
    """One integrated period: state at its start, motion, state's change over it, closure."""

    start: FloatArray  # (2, n_dof): displacement, velocity
    displacement: FloatArray
    change: FloatArray
    closure: float


def _close(
    runner: _Runner, start: FloatArray, sign: float, report: Callable[[int], None]
) -> tuple[_Shot, int]:
    best = np.inf
    for number in range(1, MAX_SHOTS + 1):
        shot = runner.shoot(start, sign)
        report(min(number, 2))
        if shot.closure <= CLOSURE:
            return shot, number
        if number > 2 and shot.closure > best / 2.0:
            break  # what is left is no linear error: another period would not mend it
        best = min(best, shot.closure)
        start = start + runner.correction(shot.change)
    raise OrbitError(
        f"the periodic orbit under the multisine at {runner.excitation.dof} does not close: after "
        f"{number} periods its ends differ by {shot.closure:.1e} of the motion ({CLOSURE:g} "
        "allowed); the amplitude is too large for geometry to be linear, or so small that it "
        "drowns in the round-off of stiff springs"
    )


class _Runner:
    """A drivetrain with its load and sensors, ready to be integrated over one period."""

    def __init__(
        self, drivetrain: Drivetrain, excitation: Excitation[Multisine], steps: int
    ) -> None:
        self.excitation = excitation
        self.system = build_drivetrain(drivetrain)
        self.linear = linearize(self.system)
        self.steps = steps
        self.step = excitation.signal.period / self.steps
        self.force = excitation.signal.samples(self.steps)
        self.transform = coordinate_transform(self.system)
        self.modal = _Modal(self.linear, self.steps, self.step)
        self.responding = np.ones(len(self.linear.dofs), dtype=bool)
        self._sign = 1.0
        self._add_force()
        self._sensors = NodeSensors(self.system, (0, 1))
        self.system.mbs.Assemble()

    def _add_force(self) -> None:
        samples, steps, step = self.force.tolist(), self.steps, self.step

        def sampled(mbs: Any, time: float, share: float) -> float:
            return float(self._sign * share * samples[round(time / step) % steps])

        add_force(self.system, self.excitation.dof, sampled)

    def linear_start(self) -> FloatArray:
        """State at t = 0 of the linearised steady state, Re Σ H(ω_k) F_k, as integrated."""
        signal = self.excitation.signal
        lines = steady_lines(self.linear, self.excitation.dof, signal.frequency, self.step)
        expected = np.abs(lines[0] * signal.spectrum[:, None]).max(axis=0)
        # The others are zero by symmetry: what moves them is of second order.
        self.responding = expected > 1e-9 * expected.max()
        return np.stack([(signal.spectrum @ line).real for line in lines])

    def shoot(self, start: FloatArray, sign: float) -> _Shot:
        """Integrate one period from a state."""
        self._sign = sign
        data = self.system.mbs.systemData
        data.SetODE2Coordinates((self.transform @ start[0]).tolist(), INITIAL)
        data.SetODE2Coordinates_t((self.transform @ start[1]).tolist(), INITIAL)
        settings = _settings(self.steps, self.step)
        with interrupts_held(self.system.mbs):
            self.system.mbs.SolveDynamic(
                settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2
            )
        displacement, velocity = (self._read(kind) for kind in range(2))
        if not (np.isfinite(displacement).all() and np.isfinite(velocity).all()):
            raise OrbitError(
                f"the time integration diverged under the multisine at {self.excitation.dof} "
                f"(step {self.step:.2e} s); use a smaller amplitude"
            )
        change = np.stack([displacement[-1], velocity[-1]]) - start
        largest, moved = np.abs(displacement).max(axis=0), self.responding
        # A free drivetrain may creep on as a whole: nothing restores it, and nothing is strained.
        # What it turns by evenly is not periodic, and would leak into every line.
        creep = self.modal.rigid_part(change[0])
        gap = np.abs(change[0] - creep)
        share = np.arange(self.steps)[:, None] / self.steps
        return _Shot(
            start=start,
            displacement=displacement[:-1] - share * creep,
            change=change,
            closure=float((gap[moved] / largest[moved]).max()),
        )

    def correction(self, change: FloatArray) -> FloatArray:
        """(I − Φ)⁻¹ of a period's change of state."""
        return self.modal.correction(change)

    def _read(self, kind: int) -> FloatArray:
        """Displacements (0) or velocities (1) at every step, in labelled DoFs."""
        values = self._sensors.read(kind)
        labelled: FloatArray = values @ self.transform / np.sum(self.transform**2, axis=0)
        return labelled


def _settings(steps: int, step: float) -> Any:
    settings = solver_settings(0.0, steps * step, steps)
    # One solution of the linearised step: its error is of second order in a step's motion, 1e-15 m
    # here, where Newton's stopping rule would leave more.
    settings.timeIntegration.newton.active = False
    return settings


class _Modal:
    """The linearised state transition over one period, mode by mode.

    Each mode's η̈ + γη̇ + λη = 0 has its own 2 × 2 transition; a matrix exponential of the whole
    would lose its digits to the stiffest mode.
    """

    def __init__(self, linear: LinearizedSystem, steps: int, step: float) -> None:
        eigenvalues, self.shapes = eigh(linear.stiffness, linear.mass)
        self.n_rigid = rigid_body_count(linear.stiffness)
        eigenvalues[: self.n_rigid] = 0.0
        decay = np.einsum("im,ij,jm->m", self.shapes, linear.damping, self.shapes)
        self.mass = linear.mass
        self.transitions = [
            _transition(stiffness, damping, steps, step)
            for stiffness, damping in zip(np.maximum(eigenvalues, 0.0), decay, strict=True)
        ]

    def rigid_part(self, displacement: FloatArray) -> FloatArray:
        """The rigid-body part of a displacement."""
        rigid = self.shapes[:, : self.n_rigid]
        part: FloatArray = rigid @ (rigid.T @ self.mass @ displacement)
        return part

    def correction(self, change: FloatArray) -> FloatArray:
        """What to add to a state so that a period's ``change`` vanishes (least norm where free)."""
        modal = self.shapes.T @ self.mass @ change.T  # (n_mode, 2)
        added = [
            np.linalg.lstsq(np.eye(2) - transition, own, rcond=1e-9)[0]
            for transition, own in zip(self.transitions, modal, strict=True)
        ]
        corrected: FloatArray = (self.shapes @ np.array(added)).T
        return corrected


def _transition(stiffness: float, damping: float, steps: int, step: float) -> FloatArray:
    """(η, η̇) after so many steps of the trapezoidal rule, for the same before.

    V diag(z₁ⁿ, z₂ⁿ) V⁻¹ with z = (1 + sh/2)/(1 − sh/2) for the poles s.
    """
    root = np.sqrt(complex(damping**2 / 4.0 - stiffness))
    poles = np.array([-damping / 2.0 + root, -damping / 2.0 - root])
    gains = ((1.0 + poles * step / 2.0) / (1.0 - poles * step / 2.0)) ** steps
    period = steps * step
    if abs(poles[0] - poles[1]) * period < 1e-6:  # an undamped rigid-body motion
        return np.asarray(np.array([[1.0, period], [0.0, 1.0]]) * gains[0].real)
    vectors = np.array([[1.0, 1.0], poles])
    transition: FloatArray = (vectors @ np.diag(gains) @ np.linalg.inv(vectors)).real
    return transition

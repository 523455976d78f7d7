"""exudyn in time: any drivetrain under any excitations, as long as wanted.

    M(q) q̈ = f(q, q̇, t) + Σ_e b_e F_e(t)

with exudyn's own bodies and springs, large motions and all. A run goes in pieces, each continuing
from the state in which the last ended, so that memory does not grow with its length: over 40 pieces
of a stored run it stays at 105 MB from the second on, within 5 MB up and down, and so for an hour.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..gears.mesh_records import mesh_records
from ..interrupts import interrupts_held
from ..model.excitation import Excitation, check_record
from ..signals.lines import Signal
from ..system.drivetrain import MultibodySystem
from ..system.linearization import coordinate_transform, linearize, round_off_forces
from .aliasing import folded
from .energy_balance import EnergyBalance
from .fingerprint import code_digest, fingerprint
from .integrators import (
    RK44,
    ROUND_OFF,
    TRAPEZOIDAL,
    Integrator,
    check_stable,
    steps_per_sample,
)
from .loads import Loads
from .probes import (
    CURRENT,
    INITIAL,
    NodeSensors,
    as_found,
    leader,
    solver_settings,
)
from .run_store import Checkpoint, State, open_store, start
from .start_acceleration import acceleration_of_forces, without_fast_modes
from .transient_record import (
    MOTIONS,
    PLAIN,
    QUANTITIES,
    SMOOTH,
    RunDescription,
    TransientRecord,
)

FloatArray = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

SOLVERS = {
    RK44: exu.DynamicSolverType.RK44,
    TRAPEZOIDAL: exu.DynamicSolverType.TrapezoidalIndex2,
}
# Where in a step the loads are asked for, in steps: RK44's stages are half a step apart.
INSTANTS_PER_STEP = {RK44: 2, TRAPEZOIDAL: 1}
PIECE_STEPS = 20000  # a second or less, and 10 MB of samples
# The trapezoidal rule's equations are solved to so much of what a step begins with, or to a few
# times the round-off of the springs' forces. A linear system needs one iteration for either.
NEWTON_TOLERANCE = 1e-9
ROUND_OFF_FORCES = 10.0
DIVERGED = 1e15  # no displacement, velocity, acceleration or force in SI units is as large
CONSTRAINTS = ("ConnectorCoordinate", "ConnectorCoordinateVector")


class SimulationError(ModelError):
    """A run that diverged, or whose equations could not be solved: when, and why it may be."""


def simulate(
    system: MultibodySystem,
    excitations: Sequence[Excitation[Signal]],
    *,
    duration: float,
    integrator: Integrator,
    sampling_frequency: float | None = None,
    start_state: tuple[FloatArray, FloatArray] | None = None,
    responses: Sequence[str] | None = None,
    record: Sequence[str] = ("displacement",),
    store: Path | None = None,
    piece: float | None = None,
    progress: Progress | None = None,
) -> TransientRecord:
    """Integrate a system under excitations from t = 0.

    Parameters
    ----------
    system
        What is excited; it is left as it was found.
    excitations
        What acts on it; those at one DoF are added. None: it moves freely.
    duration
        s; the record's samples are at k/sampling_frequency < duration.
    integrator
        See `choose_integrator`.
    sampling_frequency
        Hz; every n-th step is a sample. None: every step.
    start_state
        Displacement (m) and velocity (m/s) of ``system.dofs``. None: as the system was built.
    responses
        Labels whose motion is recorded. None: every DoF.
    record
        Which of displacement, velocity, acceleration, mesh_forces, contact and energy.
    store
        A directory to keep the run in, and to resume it from. None: memory.
    piece
        Length of a piece (s). None: 20 000 steps.
    progress
        Called with what is done, steps done, and steps in all, after every piece.

    Raises
    ------
    ModelError
        A DoF or quantity is unknown; an excitation reaches half the sampling frequency, or its
        period is longer than the run; the step does not fit the sampling, or is not stable; the
        solver cannot run the system; the record is too large for memory; the directory holds
        another run.
    SimulationError
        The motion diverged, or a step's equations have no solution. The pieces before are kept.
    """
    report = progress or (lambda name, done, total: None)
    rate = _whole(1.0 / integrator.step) if sampling_frequency is None else sampling_frequency
    stride = steps_per_sample(integrator.step, rate)
    samples, length = _samples(duration, rate), _piece_samples(piece, rate, stride)
    for excitation in excitations:
        check_record(excitation, duration=duration, sampling_frequency=rate)
    if integrator.name == RK44:
        _check_explicit(system, integrator)
    state = _initial_state(system, start_state)
    with as_found(system):
        before = _items(system)
        run = _Run(system, excitations, integrator, rate, stride, tuple(record), responses)
        description = run.describe(samples)
        digest = fingerprint(
            exu.__version__, np.__version__, code_digest("mbs_models"), before, list(excitations),
            state, length, integrator.name, stride, rate, description.samples,
            description.columns(),
        )  # fmt: skip
        kept = open_store(store, description, digest)
        checkpoint = kept.checkpoint() or start(description, state)
        total = description.samples * stride
        report("time integration", checkpoint.samples * stride, total)
        while checkpoint.samples < description.samples:
            count = min(length, description.samples - checkpoint.samples)
            arrays, checkpoint = run.piece(checkpoint, count)
            kept.append(arrays, checkpoint)
            report("time integration", checkpoint.samples * stride, total)
    return kept.finish(checkpoint.folded)


class _Run:
    """A system with its loads and sensors, ready to be integrated piece by piece."""

    def __init__(
        self,
        system: MultibodySystem,
        excitations: Sequence[Excitation[Signal]],
        integrator: Integrator,
        rate: float,
        stride: int,
        recorded: tuple[str, ...],
        responses: Sequence[str] | None,
    ) -> None:
        if unknown := [what for what in recorded if what not in QUANTITIES]:
            raise ModelError(f"record '{unknown[0]}': must be one of {', '.join(QUANTITIES)}")
        for what in ("mesh_forces", "contact"):
            if what in recorded and not system.meshes:
                raise ModelError(f"record '{what}': the system has no meshes")
        self.system, self.mbs = system, system.mbs
        self.integrator, self.rate, self.stride = integrator, rate, stride
        self._step_rate = rate * stride
        self.recorded = recorded
        self.dofs = tuple(dof.label for dof in system.dofs)
        self.labels = self.dofs if responses is None else tuple(responses)
        self._reading = _reading(system, self.labels)
        self._linear = linearize(system)
        self._round_off = round_off_forces(system)
        per_step = INSTANTS_PER_STEP[integrator.name]
        self.loads = Loads(system, excitations, self._step_rate, per_step)
        derivatives = [MOTIONS.index(what) for what in recorded if what in MOTIONS]
        if {*PLAIN, "mesh_forces", "contact"} & set(recorded):
            derivatives += [0, 1]
        self._balance = None
        if {*PLAIN} & set(recorded):
            explicit = integrator.name == RK44
            self._balance = EnergyBalance(system, self._linear, explicit=explicit)
        self._derivatives = sorted(set(derivatives))
        self._sensors = NodeSensors(system, self._derivatives or [0])
        self._per_step = per_step
        self._load_rows = np.zeros((len(self.loads.dofs), len(self.dofs)))
        for row, label in enumerate(self.loads.dofs):
            dof, ratio = leader(system, label, "excitation at")
            self._load_rows[row, self.dofs.index(dof)] = ratio
        self.mbs.Assemble()

    def describe(self, samples: int) -> RunDescription:
        """What will be in the record."""
        return RunDescription(
            sampling_frequency=self.rate,
            samples=samples,
            labels=self.labels,
            excitations=self.loads.dofs,
            meshes=tuple(self.system.meshes),
            recorded=self.recorded,
            integrator=self.integrator,
        )

    def piece(self, before: Checkpoint, samples: int) -> tuple[dict[str, FloatArray], Checkpoint]:
        """The next samples, and where they lead."""
        first, steps = before.samples * self.stride, samples * self.stride
        self.loads.sample(first, steps)
        begin, rate = first * self._per_step, self._step_rate * self._per_step
        for mesh in self.system.meshes.values():
            mesh.samples.sample(begin / rate, rate, steps * self._per_step + 1)
        state = self._with_acceleration(before.state) if first == 0 else before.state
        self._solve(state, first, steps)
        motions = {d: self._motion(d, state, first, steps) for d in self._derivatives}
        responses = self._responses({d: motion[:-1] for d, motion in motions.items()}, first)
        after = _state(self.system, CURRENT)
        self._check_bounded(responses, after, first, steps)
        arrays = {what: values[:: self.stride] for what, values in responses.items()}
        if self._balance is not None:
            arrays |= self._energy_and_work(self._balance, motions, first)
        arrays["forces"] = self.loads.forces()[:: self.stride]
        above = before.folded
        if self.stride > 1:
            smooth = {what: v for what, v in responses.items() if what in SMOOTH}
            above = above + folded(smooth, self.stride)
        return arrays, Checkpoint(before.samples + samples, after, above)

    def _solve(self, state: State, first: int, steps: int) -> None:
        settings = solver_settings(
            first / self._step_rate, (first + steps) / self._step_rate, steps
        )
        integration = settings.timeIntegration
        integration.generalizedAlpha.computeInitialAccelerations = False  # the state has them
        integration.newton.relativeTolerance = NEWTON_TOLERANCE
        reach = np.abs(state[0]) + np.abs(state[1]) * steps / self._step_rate
        integration.newton.absoluteTolerance = ROUND_OFF_FORCES * self._round_off(reach)
        # Over the kink of a backlash modified Newton may not converge.
        integration.newton.useModifiedNewton = not self.system.has_backlash
        _set_state(self.system, state)
        try:
            with interrupts_held(self.mbs):
                self.mbs.SolveDynamic(settings, solverType=SOLVERS[self.integrator.name])
        except exu.SolverError:
            done = len(self._sensors.read(self._sensors.derivatives[0]))
            raise SimulationError(
                f"the equations of the step to {(first + done) / self._step_rate:.6g} s have no "
                f"solution ({self._words()}): the motion has grown beyond what the model can bear, "
                "or a force law jumps"
            ) from None

    def _with_acceleration(self, state: State) -> State:
        """The state with the acceleration that the run starts with."""
        _set_state(self.system, state)
        with interrupts_held(self.mbs):
            found = acceleration_of_forces(self.system)
        if self.integrator.name == TRAPEZOIDAL:
            found = without_fast_modes(self.system, self._linear, found, self.integrator.step)
        return (*state[:-1], found)

    def _motion(self, derivative: int, state: State, first: int, steps: int) -> FloatArray:
        """(n_step + 1, n_coordinate): the last instant is the next piece's first."""
        samples = self._sensors.read(derivative)
        if len(samples) != steps + 1:
            raise SimulationError(
                f"exudyn ended the run at {(first + len(samples) - 1) / self._step_rate:.6g} s "
                f"({self._words()})"
            )
        if derivative == 2:
            samples[0] = state[-1]
        return samples

    def _responses(self, motions: dict[int, FloatArray], first: int) -> dict[str, FloatArray]:
        found = {
            what: motions[MOTIONS.index(what)] @ self._reading
            for what in self.recorded
            if what in MOTIONS
        }
        if {"mesh_forces", "contact"} & set(self.recorded):
            time = (first + np.arange(len(motions[0]))) / self._step_rate
            with np.errstate(all="ignore"):  # a run that has diverged is told as that
                forces, contact = mesh_records(self.system, time, motions[0], motions[1])
            found |= {"mesh_forces": forces, "contact": contact}
        return {what: found[what] for what in self.recorded if what in found}

    def _energy_and_work(
        self, balance: EnergyBalance, motions: dict[int, FloatArray], first: int
    ) -> dict[str, FloatArray]:
        """E at the samples, and W from each to the next."""
        time = (first + np.arange(len(motions[0]))) / self._step_rate
        loads = self.loads.forces(last=True) @ self._load_rows
        energy, work = balance.energy_and_work(time, motions[0], motions[1], loads)
        found = {
            "energy": energy[: -1 : self.stride],
            "work": work.reshape(-1, self.stride).sum(axis=1),
        }
        return {what: found[what] for what in PLAIN if what in self.recorded}

    def _check_bounded(
        self, responses: dict[str, FloatArray], after: State, first: int, steps: int
    ) -> None:
        """exudyn reports success with NaN."""
        for what, values in responses.items():
            lost = ~(np.abs(values) < DIVERGED)
            if lost.any():
                row = int(lost.any(axis=1).argmax())
                raise self._diverged(first + row, f" ({what.replace('_', ' ')})")
        if not all(np.all(np.abs(part) < DIVERGED) for part in after):
            raise self._diverged(first + steps, "")

    def _diverged(self, step: int, what: str) -> SimulationError:
        cause = (
            "the motion grows without bound, as in a parametric instability, which backlash would "
            "end: teeth part"
        )
        if self.integrator.name == RK44:
            cause = f"the step is too long for the stiffness met on the way, or {cause}"
        return SimulationError(
            f"the run has diverged at {step / self._step_rate:.6g} s{what} ({self._words()}): "
            f"{cause}"
        )

    def _words(self) -> str:
        return f"{self.integrator.name}, h = {self.integrator.step:.3g} s"


def _whole(frequency: float) -> float:
    """The whole number of hertz that a frequency misses by rounding alone, or itself."""
    whole = float(round(frequency))
    return whole if abs(frequency - whole) <= 1e-12 * frequency else frequency


def _samples(duration: float, rate: float) -> int:
    if not np.isfinite(duration) or duration * rate < 1.0:
        raise ModelError(
            f"duration {duration:g} s: must be at least one sampling interval, {1.0 / rate:g} s"
        )
    return int(np.ceil(duration * rate * (1.0 - ROUND_OFF)))


def _piece_samples(piece: float | None, rate: float, stride: int) -> int:
    if piece is None:
        return max(1, PIECE_STEPS // stride)
    if not (np.isfinite(piece) and piece > 0.0):
        raise ModelError(f"piece {piece:g} s: must be above 0 s")
    return max(1, round(piece * rate))


def _check_explicit(system: MultibodySystem, integrator: Integrator) -> None:
    """An explicit solver takes coordinates held to ground, no other constraint, no long step."""
    data = system.mbs.systemData
    kinds = [system.mbs.GetObject(i)["objectType"] for i in range(data.NumberOfObjects())]
    if sum(kind in CONSTRAINTS for kind in kinds) > len(system.locked):
        raise ModelError(
            f"integrator '{RK44}': the system has constraints (rigid couplings or locked DoFs), "
            f"which explicit solvers do not take; use '{TRAPEZOIDAL}'"
        )
    check_stable(linearize(system), integrator.step)


def _initial_state(system: MultibodySystem, given: tuple[FloatArray, FloatArray] | None) -> State:
    state = _state(system, INITIAL)
    if given is None:
        return state
    transform = coordinate_transform(system)
    moved = []
    for what, values in zip(MOTIONS[:2], given, strict=True):
        values = np.asarray(values, dtype=float)
        if values.shape != (transform.shape[1],) or not np.isfinite(values).all():
            raise ModelError(
                f"start state: the {what} must be {transform.shape[1]} finite numbers, one for "
                "each DoF"
            )
        moved.append(transform @ values)
    return (*moved, *state[2:])


def _state(system: MultibodySystem, configuration: Any) -> State:
    """exudyn's state: displacements, velocities, … and last the accelerations."""
    data = system.mbs.systemData
    parts = (*data.GetSystemState(configuration), data.GetODE2Coordinates_tt(configuration))
    return tuple(np.array(part, dtype=float) for part in parts)


def _set_state(system: MultibodySystem, state: State) -> None:
    data = system.mbs.systemData
    data.SetSystemState(list(state[:-1]), INITIAL)
    data.SetODE2Coordinates_tt(state[-1], INITIAL)


def _reading(system: MultibodySystem, labels: Sequence[str]) -> FloatArray:
    """(n_coordinate, n_label): what exudyn's coordinates contribute to labels.

    The columns of T do not overlap: each DoF is read off the coordinates it moves.
    """
    transform = coordinate_transform(system)
    reading = transform / np.sum(transform**2, axis=0)
    index = {dof.label: column for column, dof in enumerate(system.dofs)}
    columns = [leader(system, label, "response") for label in labels]
    return np.stack([ratio * reading[:, index[dof]] for dof, ratio in columns], axis=1)


def _items(system: MultibodySystem) -> list[Any]:
    """All that exudyn was given, for the fingerprint."""
    mbs, data = system.mbs, system.mbs.systemData
    found: list[Any] = [mbs.GetPreStepUserFunction()]
    found += [mesh.law for mesh in system.meshes.values()]  # sampled piece by piece
    for number, get in (
        (data.NumberOfNodes(), mbs.GetNode),
        (data.NumberOfObjects(), mbs.GetObject),
        (data.NumberOfMarkers(), mbs.GetMarker),
        (data.NumberOfLoads(), mbs.GetLoad),
    ):
        found += [get(i) for i in range(number)]
    return found

"""The reference of a steady state: exudyn's time integration beside the balance at one speed.

The run starts in the steady state of the harmonic balance, so that nothing has to die out if that
is right. What is wrong in it rings at natural frequencies, while the lines of the meshes are forced
from the first instant; a mode that a line is too close to for the record to tell them apart is
given the time to die out by a hundred.

The record is fitted by least squares at the lines, whose frequencies are known, and a drift, under
a Hann window, which keeps what rings elsewhere out of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from fbs import Quantity
from fbs.periodic.harmonic_balance import PeriodicResponse, outputs
from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.integration.integrators import (
    TRAPEZOIDAL,
    Integrator,
    choose_integrator,
    poles,
)
from mbs_models.integration.time_integration import simulate
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import LinearizedSystem, linearize

from ..arrays import BoolArray, ComplexArray, FloatArray
from ..checks.check import Check
from ..errors import CommandError
from ..runtime.progress import Progress
from .lines import line_names
from .turning import Turning, shown_lines

ROUTES = ("exudyn in time", "harmonic balance")
LEAST = 0.01  # of a quantity's largest line: fainter ones are not judged
TOLERANCE, DECIBEL_TOLERANCE = 0.01, 0.1
# Of the frequency of the highest line judged, that the trapezoidal rule bends it by: the balance
# that the run is held against has the same bend. The record has every step: teeth that come into
# contact at once move accelerations at all harmonics, which a coarser one would fold onto lines.
BEND = 1e-3
PERIODS = 30  # of the slowest line that are measured, at least
APART = 6.0  # lines of a Hann window are told apart this many of its 1/T from each other
# What a line may differ by between the two halves of the record, of itself: a line that differs
# more has something in it that rings, and cannot be told.
SETTLED = 0.02
MOST_STEPS = 400_000  # measured at most; lines closer than that tells apart are not judged
BLOCK = 10_000  # of them at a time
DIED_OUT = 0.01
MAY_RING = 0.5  # of the amplitudes that can be told, near resonances that are slow to settle
LONGEST_RUN_IN = 3.0  # s; lines near modes that take longer are not judged


@dataclass(frozen=True, eq=False)
class TimeReference:
    """Amplitudes of the lines by both routes at one speed.

    Attributes
    ----------
    speed_rpm
        Of the input.
    names, frequency
        (n_line,) of the lines in the record, and Hz.
    meshes, dofs
        The channels: forces of meshes (N), then accelerations of DoFs (m/s²).
    balance, time
        (n_line, n_channel) lines Re x e^{jωt} by harmonic balance, and from exudyn's record.
    waited, comparable
        (n_line, n_channel) which can be told, and which of them had settled.
    integrator, run_in, measured
        How it was run, and how long (s).
    """

    speed_rpm: float
    names: tuple[str, ...]
    frequency: FloatArray
    meshes: tuple[str, ...]
    dofs: tuple[str, ...]
    balance: ComplexArray
    time: ComplexArray
    waited: BoolArray
    comparable: BoolArray
    integrator: Integrator
    run_in: float
    measured: float

    @property
    def unsettled(self) -> int:
        """How many amplitudes that can be told had not settled."""
        return int((self.waited & ~self.comparable).sum())

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all columns."""
        return (*self.meshes, *self.dofs)

    @property
    def ratio(self) -> FloatArray:
        """|time|/|balance| of the amplitudes judged, 1 elsewhere (n_line, n_channel)."""
        size = np.where(self.comparable, np.abs(self.balance), 1.0)
        return np.asarray(np.where(self.comparable, np.abs(self.time), 1.0) / size)


def time_reference(turning: Turning, speed_rpm: float, progress: Progress) -> TimeReference:
    """Integrate the turning gearbox at one speed, and read its lines.

    Raises
    ------
    ModelError, SimulationError
        exudyn cannot run it.
    CommandError
        The steady state has no line to compare.
    """
    plan = turning.plan
    point = operating_point(plan.drivetrain, speed_rpm=speed_rpm, torque=plan.torque)
    linear = linearize(build_drivetrain(plan.drivetrain))
    first = turning.steady_state([speed_rpm / 60.0])
    shown = shown_lines(turning.lines, first.lattice)[1:]
    frequency = first.lattice.orders * speed_rpm / 60.0
    loudness = _loudness(_channels(first), len(turning.meshes))
    if not (loudness[shown] > LEAST).any():
        raise CommandError(f"--check = {speed_rpm:g}: the steady state has no vibration to compare")
    layout = _layout(linear, loudness[shown], frequency[shown])
    if not layout.comparable.any():
        raise CommandError(
            f"--check = {speed_rpm:g}: no line can be told from its neighbours and from slow modes "
            f"within {LONGEST_RUN_IN + layout.measured:.3g} s; give another speed, or more damping"
        )
    steady = turning.steady_state([speed_rpm / 60.0], layout.integrator.step)
    fit = _apart(loudness.max(axis=1), frequency, 4.0 / layout.measured)
    time = np.full(_channels(steady).shape, np.nan, dtype=complex)
    settled = np.zeros(time.shape, dtype=bool)
    with TemporaryDirectory() as folder:
        time[fit], settled[fit] = _measure(
            turning, point, steady, layout, frequency[fit], Path(folder) / "run",
            lambda _, done, total: progress(f"exudyn at {speed_rpm:g} rpm", done, total),
        )  # fmt: skip
    return TimeReference(
        speed_rpm=speed_rpm,
        names=line_names(turning)[1:],
        frequency=frequency[shown],
        meshes=turning.meshes,
        dofs=linear.dofs,
        balance=_channels(steady)[shown],
        time=time[shown],
        waited=layout.comparable,
        comparable=layout.comparable & settled[shown],
        integrator=layout.integrator,
        run_in=layout.run_in,
        measured=layout.measured,
    )


@dataclass(frozen=True, eq=False)
class _Layout:
    """How a run is laid out, and which lines (n_line, n_channel) it can judge."""

    comparable: BoolArray
    integrator: Integrator
    run_in: float
    measured: float


def _layout(linear: LinearizedSystem, loudness: FloatArray, frequency: FloatArray) -> _Layout:
    """Long enough to tell loud lines apart and to let modes near them die out, if it can be."""
    loud = loudness > LEAST
    lines = frequency[loud.any(axis=1)]
    integrator = choose_integrator(linear, float(lines.max()), method=TRAPEZOIDAL, bend=BEND)
    gaps = np.diff(lines, prepend=0.0)
    wanted = max(PERIODS / float(lines.min()), APART / float(gaps.min()))
    measured = min(wanted, MOST_STEPS * integrator.step)
    reach = APART / measured
    distance = np.abs(np.subtract.outer(frequency, lines))
    alone = np.where(distance > 0.0, distance, np.inf).min(axis=1) > 0.999 * reach
    waits = _waits(linear, frequency, reach)
    comparable = loud & (alone & (waits <= LONGEST_RUN_IN))[:, None]
    run_in = float(waits[comparable.any(axis=1)].max(initial=PERIODS / float(lines.max())))
    return _Layout(comparable, integrator, run_in, measured)


def _loudness(channels: ComplexArray, n_mesh: int) -> FloatArray:
    """Of the largest line of any mesh, or of any acceleration (n_line, n_channel); the mean's 0."""
    size = np.abs(channels)
    size[0] = 0.0
    for kind in (slice(0, n_mesh), slice(n_mesh, None)):
        largest = size[:, kind].max(initial=0.0)
        size[:, kind] /= largest or 1.0
    return size


def _waits(linear: LinearizedSystem, frequency: FloatArray, reach: float) -> FloatArray:
    """Until modes within reach of a line have died out (n_line,), s."""
    waits = np.zeros(len(frequency))
    for pole in poles(linear):
        natural, decay = abs(pole.value) / (2.0 * np.pi), -pole.value.real
        wait = math.log(1.0 / DIED_OUT) / decay if decay > 0.0 else math.inf
        near = np.abs(frequency - natural) < reach
        waits[near] = np.maximum(waits[near], wait)
    return waits


def _apart(loudness: FloatArray, frequency: FloatArray, distance: float) -> NDArray[np.int64]:
    """Lines, the loudest first, none nearer to one before than a distance, nor to 0 Hz (Hz)."""
    kept: list[int] = []
    for line in np.argsort(-loudness, kind="stable"):
        near = np.abs(frequency[[*kept, 0]] - frequency[line])
        if line and loudness[line] > 0.0 and near.min() > distance:
            kept.append(int(line))
    return np.array(sorted(kept))


def _measure(
    turning: Turning,
    point: OperatingPoint,
    steady: PeriodicResponse,
    layout: _Layout,
    frequency: FloatArray,
    store: Path,
    progress: Progress,
) -> tuple[ComplexArray, BoolArray]:
    """Integrate from the steady state, and read some lines (n_line, n_channel); which had settled.

    Accelerations are jω′ times the lines of the velocity, as the trapezoidal rule has them: its own
    accelerations of near-massless bodies alternate from step to step.
    """
    dofs = steady.system.dofs
    start, rates = (
        outputs(steady, np.eye(len(dofs)), quantity=quantity)[0].sum(axis=0).real
        for quantity in (Quantity.RECEPTANCE, Quantity.MOBILITY)
    )
    record = simulate(
        build_drivetrain(turning.plan.drivetrain, point.laws),
        point.loads,
        duration=layout.run_in + layout.measured,
        integrator=layout.integrator,
        start_state=(point.displacement + start, rates),
        responses=dofs,
        record=("velocity", "mesh_forces"),
        store=store,
        progress=progress,
    )
    assert record.velocity is not None
    assert record.mesh_forces is not None
    rate, end = record.sampling_frequency, record.n_samples
    order = [record.meshes.index(name) for name in turning.meshes]
    forces, velocity = record.mesh_forces, record.velocity
    seen = np.tan(np.pi * frequency / rate) * 2.0 * rate

    def samples(part: slice) -> FloatArray:
        return np.hstack([np.asarray(forces[part])[:, order], np.asarray(velocity[part])])

    def lines(begin: int, end: int) -> ComplexArray:
        values = fitted(samples, begin, end, rate, frequency)
        values[:, len(order) :] *= 1j * seen[:, None]
        return values

    begin = math.ceil(layout.run_in * rate)
    middle = (begin + end) // 2
    whole, first, second = lines(begin, end), lines(begin, middle), lines(middle, end)
    return whole, np.abs(first - second) <= SETTLED * np.abs(whole)


def _channels(steady: PeriodicResponse) -> ComplexArray:
    """Forces of all meshes and accelerations of all DoFs at the one speed (n_line, n_channel)."""
    everything = np.eye(len(steady.system.dofs))
    acceleration = outputs(steady, everything, quantity=Quantity.ACCELERANCE)
    return np.hstack([steady.spring_forces[0], acceleration[0]])


def fitted(
    samples: Callable[[slice], FloatArray],
    begin: int,
    end: int,
    rate: float,
    frequency: FloatArray,
) -> ComplexArray:
    """x_h of x(t) ≈ a + b t + Re Σ x_h e^{j2π f_h t}, least squares under a Hann window.

    Parameters
    ----------
    samples
        (n, n_channel) of a range of instants.
    begin, end, rate
        The instants, k/rate.
    frequency
        (n_line,) Hz, 2/T apart or more: the normal equations lose few digits then.
    """
    middle, half = 0.5 * (begin + end - 1) / rate, 0.5 * (end - 1 - begin) / rate
    size = 2 * len(frequency) + 2
    square, right = np.zeros((size, size)), 0.0
    for first in range(begin, end, BLOCK):
        part = slice(first, min(first + BLOCK, end))
        time = np.arange(part.start, part.stop) / rate
        angle = 2.0 * np.pi * np.outer(time, frequency)
        place = (time - middle) / half
        weight = 0.5 * (1.0 + np.cos(np.pi * place))
        basis = np.hstack(
            [np.cos(angle), -np.sin(angle), np.ones_like(place)[:, None], place[:, None]]
        )
        weighted = (weight[:, None] * basis).T
        square += weighted @ basis
        right = right + weighted @ samples(part)
    solution = np.linalg.solve(square, right)
    n = len(frequency)
    return np.asarray(solution[:n] + 1j * solution[n : 2 * n])


def reference_checks(references: Sequence[TimeReference]) -> tuple[Check, ...]:
    """Verdicts on mesh forces and accelerations at every speed."""
    return tuple(check for reference in references for check in _checks(reference))


def _checks(reference: TimeReference) -> tuple[Check, ...]:
    ratio, n = reference.ratio, len(reference.meshes)
    relative = np.abs(ratio - 1.0)
    with np.errstate(divide="ignore"):
        decibels = np.abs(20.0 * np.log10(ratio))
    reason = (
        "both take derivatives at the frequencies that the trapezoidal rule bends lines to; its "
        "samples of k(t), and what the balance misses beyond its last harmonic, leave 0.3 % at the "
        "last one shown; what still rings in a line is below 1 %, or the line is not compared"
    )
    kinds = (
        ("mesh forces by order", "largest relative difference of an amplitude", relative, TOLERANCE,
         slice(0, n)),
        ("accelerations by order", "largest difference of an amplitude, dB", decibels,
         DECIBEL_TOLERANCE, slice(n, None)),
    )  # fmt: skip
    unsettled = f"; {reference.unsettled} more, of both kinds, had not settled"
    unsettled *= bool(reference.unsettled)
    return (*_settling(reference), *(
        Check(
            name, f"at {reference.speed_rpm:.6g} rpm", ROUTES, measure,
            float(values[:, part].max()), tolerance, reason,
            _findings(reference, values[:, part] > tolerance, part.start),
            f"{int(reference.comparable[:, part].sum())} amplitudes above 1 % of the largest"
            + unsettled,
        )
        for name, measure, values, tolerance, part in kinds
        if reference.comparable[:, part].any()
    ))  # fmt: skip


def _settling(reference: TimeReference) -> tuple[Check, ...]:
    """The run starts in the other route's steady state: what does not settle contradicts it."""
    waited = int(reference.waited.sum())
    if not waited:
        return ()
    share = reference.unsettled / waited
    return (
        Check(
            "steady state", f"at {reference.speed_rpm:.6g} rpm", ROUTES,
            "share of amplitudes that had not settled", share, MAY_RING,
            "exudyn starts in the steady state of the balance, and stays there if that is right; "
            "what is forced settles at once, what is not rings",
            (f"{reference.unsettled} of {waited} amplitudes differ by more than {SETTLED:.0%} "
             "between the two halves of the record: exudyn does not stay in the balance's steady "
             "state",)
            if share > MAY_RING else (),
        ),
    )  # fmt: skip


def torque_hint(reference: TimeReference, lower: TimeReference, share: float) -> str:
    """What a share of the torque makes of a disagreement: is the gearbox not linear there?

    All that the meshes excite grows with the torque, but for transmission errors; of what is not
    linear in the motion a share is left.
    """
    here, there = (
        max(check.value / check.tolerance for check in _checks(each)) for each in (reference, lower)
    )
    start = f"At {share:g} of the torque the largest difference at {reference.speed_rpm:g} rpm is "
    if there < here / 2.0:
        return (
            f"{start}{there / here:.0%} of the one here: at this load the vibration is not linear "
            "(lines of action tilt, carriers turn with their planets), and the harmonic balance, "
            "which is, is off by so much."
        )
    return (
        f"{start}{there / here:.0%} of the one here: it is not what a vibration that is too large "
        "to be linear would do; one of the two routes is wrong, or has not settled."
    )


def reference_warnings(references: Sequence[TimeReference]) -> tuple[str, ...]:
    """Where exudyn in time cannot tell."""
    warnings = []
    for reference in references:
        n = len(reference.meshes)
        for kind, part in (("mesh forces", slice(0, n)), ("accelerations", slice(n, None))):
            if not reference.comparable[:, part].any():
                warnings.append(
                    f"exudyn in time at {reference.speed_rpm:g} rpm cannot tell {kind}: no line "
                    "had settled, or can be warnings from its neighbours"
                )
    return tuple(warnings)


def _findings(reference: TimeReference, wrong: BoolArray, first: int) -> tuple[str, ...]:
    findings = []
    for line, column in np.argwhere(wrong):
        at = column + first
        unit = "N" if at < len(reference.meshes) else "m/s²"
        findings.append(
            f"{reference.channels[at]}, {reference.names[line]} "
            f"({reference.frequency[line]:.5g} Hz): "
            f"{abs(reference.time[line, at]):.4g} {unit} in time, "
            f"{abs(reference.balance[line, at]):.4g} {unit} by harmonic balance"
        )
    return tuple(findings)

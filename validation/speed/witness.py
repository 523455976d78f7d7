"""exudyn's time integration beside the harmonic balance at one speed.

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

import numpy as np
from numpy.typing import NDArray

from fbs import Quantity
from fbs.harmonic_balance import PeriodicResponse, outputs
from mbs_models.drivetrain import build_drivetrain
from mbs_models.integration.integrators import (
    TRAPEZOIDAL,
    Integrator,
    choose_integrator,
    poles,
)
from mbs_models.linearization import LinearizedSystem, linearize
from mbs_models.meshing.operating_point import operating_point
from mbs_models.time_integration import simulate

from ..errors import CommandError
from ..results import Check
from .lines import line_names
from .turning import Turning, shown_lines

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Progress = Callable[[str, int, int], None]

ROUTES = ("exudyn in time", "harmonic balance")
LEAST = 0.01  # of a quantity's largest line: fainter ones are not judged
TOLERANCE, DECIBEL_TOLERANCE = 0.01, 0.1
# Of the frequency of the highest line judged, that the trapezoidal rule bends it by: the balance
# that the run is held against has the same bend. The record has every step: teeth that come into
# contact at once move accelerations at all harmonics, which a coarser one would fold onto lines.
BEND = 1e-3
PERIODS = 30  # of the slowest line that are measured, at least
APART = 6.0  # lines of a Hann window are told apart this many of its 1/T from each other
LONGEST = 20.0  # s measured at most; lines closer than that tells apart are not judged
DIED_OUT = 0.01
LONGEST_RUN_IN = 10.0  # s


@dataclass(frozen=True, eq=False)
class Witness:
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
    judged
        (n_line, n_channel) which are.
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
    judged: NDArray[np.bool_]
    integrator: Integrator
    run_in: float
    measured: float

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all columns."""
        return (*self.meshes, *self.dofs)

    @property
    def ratio(self) -> FloatArray:
        """|time|/|balance| of the amplitudes judged, 1 elsewhere (n_line, n_channel)."""
        size = np.where(self.judged, np.abs(self.balance), 1.0)
        return np.asarray(np.where(self.judged, np.abs(self.time), 1.0) / size)


def witness(turning: Turning, speed_rpm: float, progress: Progress) -> Witness:
    """Integrate the turning gearbox at one speed, and read its lines.

    Raises
    ------
    ModelError, SimulationError
        exudyn cannot run it.
    CommandError
        The steady state has no line to compare.
    """
    plan = turning.plan
    drivetrain = plan.drivetrain
    point = operating_point(drivetrain, speed_rpm=speed_rpm, torque=plan.torque)
    linear = linearize(build_drivetrain(drivetrain))
    first = turning.steady_state([speed_rpm / 60.0])
    shown = shown_lines(turning.lines, first.lattice)[1:]
    frequency = first.lattice.orders * speed_rpm / 60.0
    n_mesh = len(turning.meshes)
    judged = _judged(_channels(first)[shown], n_mesh, frequency[shown])
    if not judged.any():
        raise CommandError(f"--check = {speed_rpm:g}: the steady state has no vibration to compare")
    lines = frequency[shown][judged.any(axis=1)]
    integrator = choose_integrator(linear, float(lines.max()), method=TRAPEZOIDAL, bend=BEND)
    found = turning.steady_state([speed_rpm / 60.0], integrator.step)
    measured = _measured(lines)
    run_in = _run_in(linear, lines, measured)
    everything = np.eye(len(linear.dofs))
    start, rates = (
        outputs(found, everything, quantity=quantity)[0].sum(axis=0).real
        for quantity in (Quantity.RECEPTANCE, Quantity.MOBILITY)
    )
    record = simulate(
        build_drivetrain(drivetrain, point.laws),
        point.loads,
        duration=run_in + measured,
        integrator=integrator,
        start_state=(point.displacement + start, rates),
        responses=linear.dofs,
        record=("acceleration", "mesh_forces"),
        progress=lambda _, done, total: progress(f"exudyn at {speed_rpm:g} rpm", done, total),
    )
    assert record.acceleration is not None
    assert record.mesh_forces is not None
    begin = math.ceil(run_in * record.sampling_frequency)
    order = [record.meshes.index(name) for name in turning.meshes]
    samples = np.hstack(
        [np.asarray(record.mesh_forces)[begin:, order], np.asarray(record.acceleration)[begin:]]
    )
    return Witness(
        speed_rpm=speed_rpm,
        names=line_names(turning)[1:],
        frequency=frequency[shown],
        meshes=turning.meshes,
        dofs=linear.dofs,
        balance=_channels(found)[shown],
        time=fitted(samples, record.time[begin:], frequency[1:])[shown - 1],
        judged=judged,
        integrator=integrator,
        run_in=run_in,
        measured=measured,
    )


def _channels(found: PeriodicResponse) -> ComplexArray:
    """Forces of all meshes and accelerations of all DoFs at the one speed (n_line, n_channel)."""
    everything = np.eye(len(found.system.dofs))
    acceleration = outputs(found, everything, quantity=Quantity.ACCELERANCE)
    return np.hstack([found.spring_forces[0], acceleration[0]])


def _judged(balance: ComplexArray, n_mesh: int, frequency: FloatArray) -> NDArray[np.bool_]:
    """Lines above a hundredth of the largest of any mesh, or of any acceleration."""
    size = np.abs(balance)
    largest = np.concatenate(
        [
            np.full(n_mesh, size[:, :n_mesh].max()),
            np.full(size.shape[1] - n_mesh, size[:, n_mesh:].max()),
        ]
    )
    judged = (size > LEAST * largest) & (size > 0.0)
    order = np.argsort(frequency)
    gaps = np.diff(frequency[order], prepend=-np.inf, append=np.inf)
    alone = np.empty(len(frequency), dtype=bool)
    alone[order] = np.minimum(gaps[:-1], gaps[1:]) > APART / LONGEST
    return np.asarray(judged & alone[:, None])


def _measured(frequency: FloatArray) -> float:
    lowest = float(frequency.min())
    gaps = np.diff(np.unique(frequency))
    closest = float(gaps.min()) if len(gaps) else lowest
    return min(max(PERIODS / lowest, APART / min(closest, lowest)), LONGEST)


def _run_in(linear: LinearizedSystem, frequency: FloatArray, measured: float) -> float:
    """Until modes within the window's reach of a line have died out."""
    waits = [PERIODS / float(frequency.max())]
    for pole in poles(linear):
        natural, decay = abs(pole.value) / (2.0 * np.pi), -pole.value.real
        near = np.abs(frequency - natural).min() < APART / measured
        if near and decay > 0.0:
            waits.append(math.log(1.0 / DIED_OUT) / decay)
    return min(max(waits), LONGEST_RUN_IN)


def fitted(samples: FloatArray, time: FloatArray, frequency: FloatArray) -> ComplexArray:
    """x_h of x(t) ≈ a + b t + Re Σ x_h e^{j2π f_h t}, least squares under a Hann window.

    Parameters
    ----------
    samples
        (n, n_channel).
    time
        (n,) s.
    frequency
        (n_line,) Hz.
    """
    angle = 2.0 * np.pi * np.outer(time, frequency)
    middle, half = 0.5 * (time[0] + time[-1]), 0.5 * (time[-1] - time[0])
    drift = np.column_stack([np.ones_like(time), (time - middle) / half])
    weight = np.sqrt(0.5 * (1.0 + np.cos(np.pi * (time - middle) / half)))[:, None]
    basis = weight * np.hstack([np.cos(angle), -np.sin(angle), drift])
    found, *_ = np.linalg.lstsq(basis, weight * samples, rcond=None)
    n = len(frequency)
    return np.asarray(found[:n] + 1j * found[n : 2 * n])


def witness_checks(witnesses: Sequence[Witness]) -> tuple[Check, ...]:
    """Verdicts on mesh forces and accelerations at every speed."""
    return tuple(check for found in witnesses for check in _checks(found))


def _checks(found: Witness) -> tuple[Check, ...]:
    ratio, n = found.ratio, len(found.meshes)
    relative = np.abs(ratio - 1.0)
    with np.errstate(divide="ignore"):
        decibels = np.abs(20.0 * np.log10(ratio))
    reason = (
        "both take derivatives at the frequencies that the trapezoidal rule bends lines to; its "
        "samples of k(t), and what the balance misses beyond its last harmonic, leave 0.3 % at the "
        "last one shown; a start that is wrong by a tenth has died out to 0.1 %"
    )
    subject = f"at {found.speed_rpm:.6g} rpm"
    judged = int(found.judged[:, :n].sum()), int(found.judged[:, n:].sum())
    return (
        Check(
            "mesh forces by order", subject, ROUTES,
            "largest relative difference of an amplitude",
            float(relative[:, :n].max()), TOLERANCE, reason,
            _findings(found, relative[:, :n] > TOLERANCE, 0),
            f"{judged[0]} amplitudes above 1 % of the largest",
        ),
        Check(
            "accelerations by order", subject, ROUTES,
            "largest difference of an amplitude, dB",
            float(decibels[:, n:].max()), DECIBEL_TOLERANCE, reason,
            _findings(found, decibels[:, n:] > DECIBEL_TOLERANCE, n),
            f"{judged[1]} amplitudes above 1 % of the largest",
        ),
    )  # fmt: skip


def _findings(found: Witness, wrong: NDArray[np.bool_], first: int) -> tuple[str, ...]:
    told = []
    for line, column in np.argwhere(wrong):
        at = column + first
        unit = "N" if at < len(found.meshes) else "m/s²"
        told.append(
            f"{found.channels[at]}, {found.names[line]} ({found.frequency[line]:.5g} Hz): "
            f"{abs(found.time[line, at]):.4g} {unit} in time, "
            f"{abs(found.balance[line, at]):.4g} {unit} by harmonic balance"
        )
    return tuple(told)

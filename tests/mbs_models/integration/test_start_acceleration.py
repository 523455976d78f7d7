"""Runs that start without the alternating accelerations of a mode far above the step.

The paper's coupling hub, 4.48e-8 kg between 1e8 N/m and 1e5 N/m, is in it: a mode of 7.5 MHz.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.gears.preload import Constant
from mbs_models.integration import time_integration
from mbs_models.integration.integrators import TRAPEZOIDAL
from mbs_models.integration.start_acceleration import acceleration_of_forces, without_fast_modes
from mbs_models.integration.time_integration import simulate
from mbs_models.integration.transient_record import QUANTITIES, TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.displaced import forces_at
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import LinearizedSystem, linearize, round_off_force
from tests.geared import geared_reducer
from tests.mbs_models.transient_runs import by, planetary
from tests.strategies import damped, paper

HUB, WHEEL, SUN = "coupling.w", "reducer.wheel.w", "planetary.sun.w"
HUB_MASS, TO_WHEEL, TO_SUN = 4.48e-8, 1e8, 1e5  # kg, N/m
LIGHTEST = 0.39  # kg, of the gears' DoFs: the sun's w
STEP = 1e-5
EPS = float(np.finfo(float).eps)
FloatArray = NDArray[np.float64]


@functools.cache
def geared() -> tuple[Drivetrain, OperatingPoint]:
    drivetrain = damped(geared_reducer())
    return drivetrain, operating_point(drivetrain, speed_rpm=2000.0, torque=20.0)


def at_speed(store: Path | None = None, **settings: Any) -> TransientRecord:
    drivetrain, point = geared()
    return simulate(
        build_drivetrain(drivetrain, point.laws), point.loads, duration=0.02,
        integrator=by(TRAPEZOIDAL, STEP), start_state=point.start_state, piece=5e-3,
        record=QUANTITIES, store=store, **settings,
    )  # fmt: skip


@functools.cache
def smooth() -> TransientRecord:
    return at_speed()


def fastest(linear: LinearizedSystem) -> float:
    """ω of the hub's mode (rad/s)."""
    return float(np.sqrt(eigh(linear.stiffness, linear.mass, eigvals_only=True)[-1]))


def beside_its_neighbours(record: TransientRecord) -> FloatArray:
    """The hub's acceleration less the mean of wheel's and sun's, each by its spring.

    Without mass it would follow (k₁w₁ + k₂w₂)/(k₁ + k₂), damped in proportion or not.
    """
    assert record.acceleration is not None
    hub, wheel, sun = (record.acceleration[:, record.labels.index(n)] for n in (HUB, WHEEL, SUN))
    beside: FloatArray = hub - (TO_WHEEL * wheel + TO_SUN * sun) / (TO_WHEEL + TO_SUN)
    return beside


def test_the_static_start_strains_nothing() -> None:
    """What is left is what the springs' forces are known to: ‖ε|K||x|‖, here 1e-7 N of 940 N."""
    drivetrain, point = geared()
    linear = linearize(system := build_drivetrain(drivetrain))
    load = np.zeros(len(linear.dofs))
    for excitation in point.loads:
        load[linear.dofs.index(excitation.dof)] += excitation.signal.force
    left = forces_at(system, point.displacement) + load
    assert np.abs(left).max() <= round_off_force(system) < 1e-9 * np.abs(load).max()


def test_a_hub_without_mass_accelerates_as_its_neighbours_do() -> None:
    """At speed, from the first sample on, to what is left of the wheel's start and to round-off.

    1/√(1 + (ωh/2)²) of the wheel's first acceleration, which the meshes' stiffness at t = 0 gives
    it at once; and ε k q/m in each step, added up at random.
    """
    drivetrain, _ = geared()
    record = smooth()
    assert record.acceleration is not None
    wheel = record.acceleration[:, record.labels.index(WHEEL)]
    half_angle = fastest(linearize(build_drivetrain(drivetrain))) * STEP / 2.0
    assert record.displacement is not None
    moved = np.abs(record.displacement[:, record.labels.index(WHEEL)]).max()
    round_off = EPS * TO_WHEEL * moved / HUB_MASS * np.sqrt(record.n_samples)
    bound = abs(wheel[0]) / half_angle + round_off
    assert np.abs(beside_its_neighbours(record)).max() < bound
    assert bound < 5e-3 * np.abs(wheel).max()


def test_all_else_is_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the acceleration of the forces instead the same run, but for the hub's acceleration.

    That alternates by a, and m a is all that its neighbours feel of it: 4e-6 N of 500 N, to and fro
    twice that; a jerk of m a h/2 is left to move them on.
    """
    after = smooth()
    monkeypatch.setattr(time_integration, "without_fast_modes", lambda s, linear, a, step: a)
    before = at_speed()
    hub = after.labels.index(HUB)
    assert before.acceleration is not None
    assert after.acceleration is not None
    assert before.displacement is not None
    assert after.displacement is not None
    assert before.mesh_forces is not None
    assert after.mesh_forces is not None
    felt = np.abs(before.acceleration[0, hub] - after.acceleration[0, hub]) * HUB_MASS
    assert np.abs(beside_its_neighbours(before)).max() > 0.9 * felt / HUB_MASS
    assert np.abs(after.mesh_forces - before.mesh_forces).max() < 2.0 * felt
    others = np.delete(after.acceleration - before.acceleration, hub, axis=1)
    assert np.abs(others).max() < 2.0 * felt / LIGHTEST
    deflection, speed = felt / (TO_WHEEL + TO_SUN), felt * STEP / 2.0 / LIGHTEST
    moved = np.abs(after.displacement - before.displacement).max()
    assert moved < 2.0 * deflection + speed * after.n_samples * STEP


@pytest.mark.parametrize("step", [1e-5, 1e-6, 3e-7])
def test_what_is_left_of_a_force_on_the_hub_itself(step: float) -> None:
    """1/√(1 + (ωh/2)²) of F/m without damping: from rest the first step ends so far from rest.

    The gears behind it accelerate by m/M = 4e-8 of that.
    """
    system = build_drivetrain(paper())
    half_angle = fastest(linearize(system)) * step / 2.0
    record = simulate(
        system, [Excitation(HUB, Constant(1.0))], duration=3000 * step,
        integrator=by(TRAPEZOIDAL, step), record=("acceleration",), responses=(HUB,),
    )  # fmt: skip
    assert record.acceleration is not None
    left = HUB_MASS * np.abs(record.acceleration).max()
    # A step turns the mode by half a turn and 2 arctan(2/(ωh)) more: 3000 pass every phase.
    assert left == pytest.approx(1.0 / np.hypot(1.0, half_angle), rel=1e-4)


def test_modes_that_the_steps_follow_start_as_the_forces_have_them() -> None:
    """At h = 1e-7 the hub's period is longer than a step; Lin & Parker's gears are at any."""
    system = build_drivetrain(paper())
    linear = linearize(system)
    assert fastest(linear) * 1e-7 < 2.0 * np.pi
    start = np.linspace(-1.0, 1.0, len(acceleration_of_forces(system)))
    np.testing.assert_array_equal(without_fast_modes(system, linear, start, 1e-7), start)
    assert np.abs(without_fast_modes(system, linear, start, 1e-6) - start).max() > 0.0
    gears = planetary()
    start = np.linspace(-1.0, 1.0, len(acceleration_of_forces(gears)))
    np.testing.assert_array_equal(without_fast_modes(gears, linearize(gears), start, 1e-5), start)


def test_a_resumed_run_is_the_uninterrupted_one(tmp_path: Path) -> None:
    """Bit for bit: a checkpoint has the accelerations."""

    def stop(name: str, done: int, total: int) -> None:
        if done >= 1000:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        at_speed(tmp_path, progress=stop)
    resumed = at_speed(tmp_path)
    for what in QUANTITIES:
        np.testing.assert_array_equal(getattr(resumed, what), getattr(smooth(), what), what)

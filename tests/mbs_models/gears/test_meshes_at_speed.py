"""Constant meshes under constant torque: nothing excites, whatever a shaft winds up, for ever.

A mesh that were a spring between two points of the gears would carry 8 times its torque's force
after a second, and the free rotation would run away by a factor of e in half a second.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigh

from mbs_models.gears.operating_point import operating_point
from mbs_models.gears.orders import free_motions
from mbs_models.integration.integrators import (
    FREQUENCY_BEND,
    RK44,
    TRAPEZOIDAL,
    choose_integrator,
)
from mbs_models.integration.time_integration import simulate
from mbs_models.model.model_file import load, loads
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize
from mbs_models.system.read_back import components
from tests.mbs_models.contact.test_involute_mesh import pair_drivetrain
from tests.mbs_models.transient_runs import by

CONSTANT = 1e-6  # of the force: a dynamic factor of 1.000000
RATED = {"paper-table2": 100.0, "wind-turbine": 4.18e6}  # N m at the input
CONSTANT_MESH_PAIR = """
name = "spur pair 20/20, module 10"
[damping]
stiffness_proportional = 5e-6
[operation]
input = "g.pinion"
output = "load"
speed_range = [100.0, 3000.0]
[[stage]]
type = "parallel"
name = "g"
mesh_stiffness = 517925405.0
pinion = { mass = 6.57, base_radius = 0.09396926207859085, teeth = 20, \
polar_inertia = 0.0365292, diametral_inertia = 0.0182646, bearing_y = 1e8, bearing_z = 1e8, \
bearing_rocking = 1e6 }
wheel = { mass = 6.57, base_radius = 0.09396926207859085, teeth = 20, \
polar_inertia = 0.0365292, diametral_inertia = 0.0182646, bearing_y = 1e8, bearing_z = 1e8, \
bearing_rocking = 1e6 }
[[inertia]]
name = "load"
radius = 1.0
polar_inertia = 1.0
[[coupling]]
name = "sh"
first = "g.wheel"
second = "load"
radius = 1.0
inertia = 0.0
first_stiffness = 1e5
second_stiffness = "rigid"
"""
TO_THE_END = [
    pytest.param(1.0, 1e-4, id="1s"),
    pytest.param(10.0, 1e-3, id="10s", marks=pytest.mark.slow),
    pytest.param(60.0, 2e-3, id="60s", marks=pytest.mark.slow),
]  # s, and the step (s): nothing vibrates, and the trapezoidal rule is stable whatever the step


def dynamic_factors(
    drivetrain: Drivetrain, speed: float, torque: float, duration: float, step: float
) -> tuple[dict[str, float], tuple[float, float]]:
    """Static force (N) of every mesh, and the least and largest share of it in time."""
    point = operating_point(drivetrain, speed_rpm=speed, torque=torque)
    record = simulate(
        build_drivetrain(drivetrain, point.laws), point.loads, duration=duration,
        integrator=by(TRAPEZOIDAL, step), start_state=point.start_state, record=("mesh_forces",),
    )  # fmt: skip
    assert record.mesh_forces is not None
    forces = dict(point.mesh_forces)
    shares = record.mesh_forces / [forces[mesh] for mesh in record.meshes]
    return forces, (float(shares.min()), float(shares.max()))


@pytest.mark.parametrize(("duration", "step"), TO_THE_END)
def test_the_pair_carries_its_torque(duration: float, step: float) -> None:
    """10 642 N, 1000 N m on 0.094 m, though the shaft is wound up by 0.6°. Measured 2e-12."""
    drivetrain = loads(CONSTANT_MESH_PAIR)
    forces, (least, largest) = dynamic_factors(drivetrain, 1200.0, 1000.0, duration, step)
    assert list(forces.values()) == pytest.approx([1000.0 / 0.09396926207859085], rel=1e-9)
    assert max(1.0 - least, largest - 1.0) < CONSTANT


@pytest.mark.parametrize("torque", [2.0, 10.0, 100.0, 1000.0])
@pytest.mark.parametrize(
    ("duration", "step"),
    [
        pytest.param(1.0, 1e-3, id="1s"),
        pytest.param(10.0, 2e-3, id="10s", marks=pytest.mark.slow),
        pytest.param(60.0, 1e-2, id="60s", marks=pytest.mark.slow),
    ],
)
def test_every_mesh_of_the_reducer_carries_its_torque(
    torque: float, duration: float, step: float
) -> None:
    """T/r of the pinion, a quarter of T/r_s of each sun and ring mesh; equal radii 24 mm.

    Measured 1e-10 with 2 N m, 2e-12 with 1000.
    """
    drivetrain = load("paper-table2")
    forces, (least, largest) = dynamic_factors(drivetrain, 1500.0, torque, duration, step)
    for mesh, force in forces.items():
        shared = 1.0 if "reducer" in mesh else 4.0
        assert force == pytest.approx(torque / 0.024 / shared, rel=1e-6)
    assert max(1.0 - least, largest - 1.0) < CONSTANT


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["paper-table2", "wind-turbine"])
@pytest.mark.parametrize("share", [0.1, 1.0, 10.0])
def test_the_free_rotation_does_not_grow(preset: str, share: float) -> None:
    """ln(v_end/v_start)/t of the input's speed, means of the first and sixth second.

    Springs between points would turn it away by e² a second. What is left, 4e-7 1/s, is Newton's
    method that ends at ten times the round-off of the springs' forces: 1e-6 N and less on 5 kg
    (reducer) at 0.1 m/s is 2e-6 1/s if it always pointed backwards; with a third of it it falls to
    a third.
    """
    drivetrain = load(preset)
    assert drivetrain.operation is not None
    point = operating_point(drivetrain, torque=share * RATED[preset])
    system = build_drivetrain(drivetrain, point.laws)
    (free,) = free_motions(components(system)).T
    driven = point.dofs.index(f"{drivetrain.operation.input}.w")
    record = simulate(
        system, point.loads, duration=6.0, integrator=by(TRAPEZOIDAL, 1e-3),
        start_state=(point.displacement, 0.1 / free[driven] * free),
        record=("velocity",), responses=(point.dofs[driven],),
    )  # fmt: skip
    assert record.velocity is not None
    first, *_, last = record.velocity.reshape(6, -1).mean(axis=1)
    assert first == pytest.approx(0.1, rel=1e-3)
    assert abs(math.log(last / first)) / 5.0 < 1e-6


def test_gears_that_have_turned_often_still_settle() -> None:
    """Newton's method ends at the round-off of what has turned, here by 230 rad in 14 s.

    Of such an angle fewer digits are left than of one at rest, and no iteration gets as near: with
    rest's 3e-7 N the run ends after 11.5 s. The speed falls by what is said above.
    """
    drivetrain = load("paper-table2")
    point = operating_point(drivetrain, torque=10.0)
    system = build_drivetrain(drivetrain, point.laws)
    (free,) = free_motions(components(system)).T
    driven = point.dofs.index("reducer.pinion.w")
    record = simulate(
        system, point.loads, duration=14.0, integrator=by(TRAPEZOIDAL, 2e-3),
        start_state=(point.displacement, 0.4 / free[driven] * free),
        record=("displacement",), responses=("reducer.pinion.w",),
    )  # fmt: skip
    assert record.displacement is not None
    turned = record.displacement[-1, 0] - record.displacement[0, 0]
    assert turned == pytest.approx(0.4 * (14.0 - 2e-3), rel=1e-4)


# The step


@pytest.mark.parametrize("method", [RK44, TRAPEZOIDAL])
@pytest.mark.parametrize("helix", [0.0, 20.0], ids=["spur", "helical"])
def test_the_step_bends_a_frequency_by_what_it_promises(helix: float, method: str) -> None:
    """(ωh)⁴/120 and (ωh)²/12, at most 1e-4 at the band's end: a free vibration in a mode there.

    The next terms are less than (ωh)² of them: ωh is 0.33 with RK44, 0.035 with the other.
    """
    system = build_drivetrain(pair_drivetrain(helix))
    linear = linearize(system)
    squares, shapes = eigh(linear.stiffness, linear.mass)
    omega, shape = math.sqrt(squares[3]), shapes[:, 3]
    integrator = choose_integrator(linear, omega / (2.0 * math.pi), method=method)
    periods = 50.0
    record = simulate(
        system, [], duration=periods * 2.0 * math.pi / omega, integrator=integrator,
        start_state=(1e-8 * shape, np.zeros_like(shape)), record=("displacement", "velocity"),
    )  # fmt: skip
    assert record.displacement is not None
    assert record.velocity is not None
    along = linear.mass @ shape
    turning = np.unwrap(
        np.angle(record.displacement @ along - 1j * record.velocity @ along / omega)
    )
    slope = np.polyfit(record.time, turning, 1)[0]
    bend = 1.0 - slope / omega
    phase = omega * integrator.step
    promised = phase**4 / 120.0 if method == RK44 else phase**2 / 12.0
    assert bend == pytest.approx(promised, rel=phase**2)
    assert bend <= FREQUENCY_BEND

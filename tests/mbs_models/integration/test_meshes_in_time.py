"""Mesh forces in time, exudyn's against the involute equations written out again.

Ten mesh periods under torque at speed, with k(t), transmission error, and backlash that parts; both
start from the drivetrain's static state. 1e-5 of the largest mesh force is asked for. RK44 is of
fourth order as long as forces are smooth: the ramps of k(t) end where steps do. Teeth that meet
within a step leave it of first order (the damper's force jumps) or second (the spring's bends); the
steps are as short as that asks for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mbs_models.gears.operating_point import operating_point
from mbs_models.integration.integrators import RK44
from mbs_models.integration.time_integration import simulate
from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.drivetrain import build_drivetrain
from tests.geared import TEETH, lin_parker, speed_for
from tests.mbs_models.involute_witness import (
    Teeth,
    Witness,
    pair,
    planetary,
    sines,
    trapezoid,
)
from tests.mbs_models.transient_runs import by, largest_error

FloatArray = NDArray[np.float64]
State = tuple[FloatArray, FloatArray]
AGREES = 1e-5  # of the largest mesh force
PERIODS = 10
COMPARED = 60  # instants in a mesh period
TRAPEZOID = {"shape": "trapezoid", "contact_ratio": 1.6, "amplitude": 0.3, "transition": 0.1}
HARMONICS = ((0.2, 30.0), (0.05, 0.0))  # of the mean stiffness, deg
SUN_ERROR, RING_ERROR = ((2e-6, 40.0), (1e-6, 10.0)), ((1e-6, 0.0),)  # m, deg


def listed(harmonics: Any, scale: float = 1.0) -> dict[str, Any]:
    return {"harmonics": [[scale * amplitude, phase] for amplitude, phase in harmonics]}


@dataclass(frozen=True)
class Case:
    """A drivetrain at an operating point, the same as equations, and how it is run."""

    drivetrain: Drivetrain
    witness: Witness
    torque: float
    speed: float  # rpm of the input
    frequency: float  # Hz, of the meshes
    steps: int  # in a mesh period

    def start(self) -> State:
        """The static state, as the DoFs of the model are ordered."""
        return operating_point(
            self.drivetrain, torque=self.torque, speed_rpm=self.speed
        ).start_state

    def exudyn(self, start: State, steps: int) -> TransientRecord:
        point = operating_point(self.drivetrain, torque=self.torque, speed_rpm=self.speed)
        frequencies = list(point.mesh_frequencies.values())
        assert frequencies == pytest.approx([self.frequency], rel=1e-12)
        return simulate(
            build_drivetrain(self.drivetrain, point.laws), point.loads,
            duration=PERIODS / self.frequency, integrator=by(RK44, 1.0 / self.frequency / steps),
            start_state=start, record=("displacement", "mesh_forces", "contact"),
        )  # fmt: skip

    def scipy(self, start: State, dofs: tuple[str, ...]) -> FloatArray:
        """Mesh forces (n, n_mesh), COMPARED in a period."""
        order = [dofs.index(label) for label in self.witness.labels]
        time = np.arange(PERIODS * COMPARED) / COMPARED / self.frequency
        own = start[0][order], start[1][order]
        return self.witness.run(own, time)


def errors(case: Case, start: State, *steps: int) -> tuple[list[float], TransientRecord]:
    """Largest error of the mesh forces over the largest force, of runs; and the last run."""
    found = []
    expected: FloatArray | None = None
    for count in steps:
        record = case.exudyn(start, count)
        if expected is None:
            expected = case.scipy(start, record.labels)
        assert record.mesh_forces is not None
        columns = [record.meshes.index(mesh) for mesh in case.witness.meshes]
        seen = record.mesh_forces[:: count // COMPARED, columns]
        found.append(largest_error(seen, expected))
    return found, record


def open_share(record: TransientRecord) -> float:
    """How much of the time, over all meshes, no flank touches."""
    assert record.contact is not None
    return float(np.mean(record.contact == 0.0))


# A pair


def pair_case(
    helix: float,
    *,
    torque: float = 100.0,
    frequency: float = 1500.0,
    beta: float = 1e-6,
    backlash: float = 0.0,
    steps: int = 240,
    smooth: bool = False,
) -> Case:
    """Two gears of 20 and 45 teeth, k 3e8 N/m."""
    gears = {
        name: {
            "mass": mass, "base_radius": r, "teeth": teeth, "polar_inertia_over_r2": mass / 2.0,
            "diametral_inertia_over_r2": mass / 3.0, "bearing_y": 2e8, "bearing_z": 1e8,
            "bearing_rocking_over_r2": 1e8,
        }
        for name, mass, r, teeth in (("pinion", 3.0, 0.04, 20), ("wheel", 9.0, 0.09, 45))
    }  # fmt: skip
    stage: dict[str, Any] = {
        "type": "parallel", "name": "pair", "helix_angle": helix, "mesh_stiffness": 3e8,
        "mesh_variation": {"shape": "harmonics", **listed(HARMONICS)} if smooth else TRAPEZOID,
        "mesh_transmission_error": listed(SUN_ERROR), "mesh_backlash": backlash, **gears,
    }  # fmt: skip
    operation = {"input": "pair.pinion", "output": "pair.wheel", "speed_range": [0.0, 1e4]}
    drivetrain = Drivetrain.model_validate(
        {
            "name": "pair", "damping": {"stiffness_proportional": beta}, "operation": operation,
            "stage": [stage],
        }
    )  # fmt: skip
    variation = sines(*HARMONICS)[0] if smooth else trapezoid(1.6, 0.3, 0.1)
    error = sines(*SUN_ERROR)
    teeth = Teeth(3e8, beta * 3e8, frequency, np.zeros(1), variation, *error, backlash)
    witness = pair(stage, beta, teeth, torque)
    return Case(drivetrain, witness, torque, 60.0 * frequency / 20.0, frequency, steps)


@pytest.mark.parametrize("helix", [0.0, 20.0], ids=["spur", "helical"])
def test_a_pair_with_varying_stiffness_and_transmission_error(helix: float) -> None:
    """Measured 2e-6."""
    case = pair_case(helix)
    found, record = errors(case, case.start(), case.steps)
    assert found[0] < AGREES
    moved = dict(zip(record.labels, record.displacement.T, strict=True))  # type: ignore[union-attr]
    axial = max(abs(moved[f"pair.pinion.{dof}"]).max() for dof in ("z", "rho"))
    assert (axial > 1e-6) == (helix != 0.0)


@pytest.mark.parametrize("helix", [0.0, 20.0], ids=["spur", "helical"])
def test_a_pair_whose_teeth_part(helix: float) -> None:
    """20 N m and 5 µm of play: loaded flanks, none, and their backs. Measured 1e-6."""
    case = pair_case(helix, torque=20.0, frequency=3000.0, beta=2e-8, backlash=5e-6, steps=1920)
    found, record = errors(case, case.start(), case.steps)
    assert found[0] < AGREES
    assert open_share(record) > 0.1
    assert record.contact is not None
    assert record.contact.min() == -1.0


@pytest.mark.parametrize("helix", [0.0, 20.0], ids=["spur", "helical"])
def test_a_pair_that_turns(helix: float) -> None:
    """At its mean speed: half a turn of the pinion in ten periods of 20 teeth."""
    case = pair_case(helix)
    displacement, _ = case.start()
    dofs = operating_point(case.drivetrain, torque=case.torque, speed_rpm=case.speed).dofs
    speed = 2.0 * math.pi * case.speed / 60.0 * 0.04
    velocity = np.array([speed * label.endswith(".w") for label in dofs])
    found, record = errors(case, (displacement, velocity), case.steps)
    assert found[0] < AGREES
    assert record.displacement is not None
    turned = record.displacement[-1, record.labels.index("pair.pinion.w")] / 0.04
    assert turned == pytest.approx(math.pi, rel=0.01)


@pytest.mark.parametrize("helix", [0.0, 20.0], ids=["spur", "helical"])
def test_rk44_is_of_fourth_order(helix: float) -> None:
    """Locked coordinates that move between a step's stages would make helical pairs of first.

    Steps of 11, 5.6 and 2.8 µs: a sixteenth each time. The next order adds ωh of the highest mode
    (3.3 kHz), a quarter at the longest.
    """
    case = pair_case(helix, smooth=True)
    (first, second, third), _ = errors(case, case.start(), 60, 120, 240)
    assert third < AGREES
    assert 13.0 < first / second < 19.0
    assert 13.0 < second / third < 19.0


# Planetary stages


def planetary_case(
    planets: int,
    *,
    torque: float = 100.0,
    frequency: float = 3000.0,
    beta: float = 1e-6,
    alpha: float = 0.0,
    backlash: float = 0.0,
    error: float = 1.0,
    steps: int = 360,
) -> Case:
    """Lin & Parker's gear set, its sun meshes trapezoidal and its ring meshes smooth."""
    drivetrain = lin_parker(
        planets,
        beta=beta,
        alpha=alpha,
        sun_mesh_variation=TRAPEZOID,
        ring_mesh_variation={"shape": "harmonics", **listed(HARMONICS)},
        sun_mesh_transmission_error=listed(SUN_ERROR, error),
        ring_mesh_transmission_error=listed(RING_ERROR, error),
        sun_mesh_backlash=backlash,
        ring_mesh_backlash=backlash,
    )
    z_s, z_p, z_r = TEETH[planets]
    turns = np.arange(planets) / planets
    common = Teeth(5e8, beta * 5e8, frequency, z_s * turns, backlash=backlash)
    errors = [
        sines(*((error * a, phase) for a, phase in terms)) for terms in (SUN_ERROR, RING_ERROR)
    ]
    sun = replace(
        common, variation=trapezoid(1.6, 0.3, 0.1), error=errors[0][0], error_slope=errors[0][1]
    )
    # Between a planet's two meshes lie half its teeth, and half a pitch from flank to flank.
    ring = replace(
        common, phases=-z_r * turns + (z_p - 1) / 2.0, variation=sines(*HARMONICS)[0],
        error=errors[1][0], error_slope=errors[1][1],
    )  # fmt: skip
    (stage,) = drivetrain.stages
    witness = planetary(stage.model_dump(exclude_unset=True), beta, alpha, sun, ring, torque)
    speed = speed_for(drivetrain, frequency)
    return Case(drivetrain, witness, torque, speed, frequency, steps)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_a_planetary_stage_with_varying_stiffness_and_transmission_error(planets: int) -> None:
    """Measured 1e-6 to 2e-6."""
    case = planetary_case(planets)
    found, _ = errors(case, case.start(), case.steps)
    assert found[0] < AGREES


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planets", "torque", "error", "parted"),
    [(3, 110.0, 0.4, 0.01), (4, 110.0, 0.4, 0.02), (5, 90.0, 0.35, 0.01)],
)
def test_a_planetary_stage_whose_teeth_part(
    planets: int, torque: float, error: float, parted: float
) -> None:
    """Light enough an excitation to part them now and then: rattle that fills a fifth of the time
    makes of an error of 1e-6 one of 1e-3 in ten periods, and no step is short enough.

    Damping of the masses, not of the springs, lets what the start excites die away: the damper of
    teeth that meet makes the force jump, and RK44 of first order. Measured at 1200 and 2400 steps a
    period: 1.2e-5 and 1.2e-6 (N = 3), 6.6e-6 and 2.4e-6 (4), 8e-6 and 2e-6 (5).
    """
    case = planetary_case(
        planets, torque=torque, frequency=4000.0, beta=2e-8, alpha=4000.0, backlash=5e-6,
        error=error, steps=2400,
    )  # fmt: skip
    found, record = errors(case, case.start(), case.steps)
    assert found[0] < AGREES
    assert open_share(record) > parted


def test_a_planetary_stage_that_turns() -> None:
    """At its mean speed, planets flying round: 28° of the carrier, and 2.4 rad of the sun."""
    case = planetary_case(4)
    displacement, _ = case.start()
    dofs = operating_point(case.drivetrain, torque=case.torque, speed_rpm=case.speed).dofs
    r_s, r_p = 0.0387, 0.0502
    carrier_radius = (r_s + r_p) / math.cos(math.radians(24.6))
    sun = 2.0 * math.pi * case.speed / 60.0
    carrier = sun * r_s / (2.0 * (r_s + r_p))
    planet = carrier - (sun - carrier) * r_s / r_p
    speeds = {"planetary.sun.w": sun * r_s, "planetary.carrier.w": carrier * carrier_radius}
    for number in range(1, 5):
        name = f"planetary.planet{number}"
        speeds |= {f"{name}.w": planet * r_p, f"{name}.v": carrier * carrier_radius}
    velocity = np.array([speeds.get(label, 0.0) for label in dofs])
    found, record = errors(case, (displacement, velocity), case.steps)
    assert found[0] < AGREES
    assert record.displacement is not None
    turned = record.displacement[-1, record.labels.index("planetary.carrier.w")] / carrier_radius
    assert turned == pytest.approx(carrier * PERIODS / case.frequency, rel=0.01)

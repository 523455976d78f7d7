"""Operating points: speeds, mesh frequencies, torque and its reaction, flanks, static start."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbs_models.contact.mesh_excitation import at_mean
from mbs_models.errors import ModelError
from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.integration.integrators import RK44, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, ParallelStage, Part, PlanetaryStage
from mbs_models.system.displaced import forces_at
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize, round_off_force
from tests.geared import geared_reducer, lin_parker, speed_for
from tests.strategies import changed, drivetrains, paper, with_stage

HARMONIC = {"shape": "harmonics", "harmonics": [[0.2, 0.0]]}
MESHES: dict[type[Part], list[str]] = {
    ParallelStage: ["mesh"],
    PlanetaryStage: ["sun_mesh", "ring_mesh"],
}
RATED = 4.18e6  # N m at the rotor of the 5-MW turbine


def turbine(**stage: Any) -> Drivetrain:
    """The wind turbine, keys of its high-speed stage changed."""
    return with_stage(load("wind-turbine"), "high_speed", **stage)


# Speeds and mesh frequencies


def test_the_turbines_speeds_and_mesh_frequencies_are_its_tooth_numbers() -> None:
    """Gear ratios 1 + 56/19, 1 + 93/18, 95/24; f = z_r Ω_c, z_r Ω_c, z Ω of the wheel.

    Base radii in the file have six digits.
    """
    point = operating_point(turbine(), speed_rpm=12.1)
    rotor = 12.1 / 60.0
    low, middle = 1.0 + 56.0 / 19.0, 1.0 + 93.0 / 18.0
    expected = {
        "low_speed": 56 * rotor,
        "intermediate": 93 * rotor * low,
        "high_speed": 95 * rotor * low * middle,
    }
    assert point.mesh_frequencies == pytest.approx(expected, rel=2e-5)
    generator = point.speeds["generator"] / (2.0 * math.pi)
    assert generator == pytest.approx(rotor * low * middle * 95 / 24, rel=2e-5)
    assert point.speeds["high_speed.pinion"] == pytest.approx(point.speeds["generator"])
    assert point.speeds["rotor"] > 0.0
    assert point.torque == 0.0
    assert not any(law.varies or law.backlash for law in point.laws.values())


def test_a_negative_speed_turns_everything_round() -> None:
    forward, back = (operating_point(turbine(), speed_rpm=rpm) for rpm in (12.1, -12.1))
    assert back.mesh_frequencies == pytest.approx(forward.mesh_frequencies)
    assert all(back.speeds[body] == pytest.approx(-speed) for body, speed in forward.speeds.items())


def test_a_stage_behind_a_wheel_turns_along_its_own_w() -> None:
    """Pinion and wheel turn against each other, but all w grow; the ring of the paper is held."""
    drivetrain = changed(paper(), operation={"input": "reducer.pinion", "speed_range": [0.0, 1.0]})
    speeds = operating_point(drivetrain, speed_rpm=60.0).speeds
    for body in ("reducer.pinion", "reducer.wheel", "planetary.sun", "planetary.carrier"):
        assert speeds[body] > 0.0
    assert speeds["planetary.sun"] == pytest.approx(2.0 * math.pi)  # equal radii
    assert abs(speeds["planetary.ring"]) < 1e-9


def test_phases_follow_the_rotation() -> None:
    drivetrain = lin_parker(4, sun_mesh_variation=HARMONIC)
    forward, back = (
        [
            operating_point(drivetrain, speed_rpm=rpm).phases[f"mesh planetary.sun – planet{p}"]
            for p in range(1, 5)
        ]
        for rpm in (900.0, -900.0)
    )
    assert forward == [0.0, 0.75, 0.5, 0.25]
    assert back == [0.0, 0.25, 0.5, 0.75]


def test_laws_are_those_of_the_families_that_vary() -> None:
    drivetrain = lin_parker(
        4, sun_mesh_variation=HARMONIC, ring_mesh_backlash=1e-5, sun_mesh_backlash=2e-5
    )
    point = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, 1000.0))
    assert len(point.laws) == 8
    for number, phase in enumerate((0.0, 0.75, 0.5, 0.25), start=1):
        sun = point.laws[f"mesh planetary.sun – planet{number}"]
        assert (sun.frequency, sun.phase) == pytest.approx((1000.0, phase))
        assert sun.relative_stiffness(np.zeros(1))[0] == pytest.approx(
            1.0 + 0.2 * math.cos(2.0 * math.pi * phase)
        )
        assert sun.backlash == 2e-5
        ring = point.laws[f"mesh planetary.ring – planet{number}"]
        assert (ring.frequency, ring.backlash, ring.varies) == (0.0, 1e-5, False)


def test_the_model_files_own_operating_point() -> None:
    drivetrain = turbine()
    assert drivetrain.operation is not None
    operation = drivetrain.operation.model_dump() | {
        "speed": 10.0,
        "torque": 1e6,
        "output": "generator",
    }
    point = operating_point(changed(drivetrain, operation=operation))
    assert (point.speed_rpm, point.torque, point.output) == (10.0, 1e6, "generator")


# Torque


def test_the_reaction_is_at_the_other_end_by_the_gear_ratio() -> None:
    point = operating_point(turbine(), torque=RATED)
    ratio = (1.0 + 56.0 / 19.0) * (1.0 + 93.0 / 18.0) * 95.0 / 24.0
    assert point.output == "generator"
    loads = {load.dof: load.signal.force for load in point.loads}
    # Both inertias have r = 1 m: N at w are N m.
    assert loads == pytest.approx({"rotor.w": RATED, "generator.w": -RATED / ratio}, rel=2e-5)


def test_mesh_forces_are_those_of_the_torque() -> None:
    """Sun torque over 3 r_s; pinion torque over r cos β; radii in the file have six digits."""
    point = operating_point(turbine(), torque=RATED)
    sun_torque = RATED / (1.0 + 56.0 / 19.0)
    pinion_torque = sun_torque / (1.0 + 93.0 / 18.0) / (95.0 / 24.0)
    expected = {
        "mesh low_speed.sun – planet2": sun_torque / 3.0 / 0.4017185,
        "mesh low_speed.ring – planet3": sun_torque / 3.0 / 0.4017185,
        "mesh high_speed.pinion – wheel": pinion_torque / 0.160013 / math.cos(math.radians(9.391)),
    }
    for name, force in expected.items():
        assert point.mesh_forces[name] == pytest.approx(force, rel=2e-5)
    assert all(force > 0.0 for force in point.mesh_forces.values())


@pytest.mark.parametrize("torque", [30.0, -30.0])
def test_flanks_follow_the_torque(torque: float) -> None:
    """A sun that pushes counter-clockwise presses the flanks of sun and ring meshes."""
    drivetrain = lin_parker(4, sun_mesh_backlash=1e-5, ring_mesh_backlash=1e-5)
    point = operating_point(drivetrain, torque=torque)
    way = math.copysign(1.0, torque)
    assert point.laws["mesh planetary.sun – planet1"].flank == way
    assert point.laws["mesh planetary.ring – planet1"].flank == way
    assert point.output == "planetary.carrier"


def test_who_drives_decides_between_sun_and_ring_phase() -> None:
    """α_s ≠ α_r: γ_rs of a driving and of a braking sun add up to z_p."""
    drivetrain = with_stage(turbine(), "low_speed", sun_mesh_variation=HARMONIC)
    driving, braking = (
        operating_point(drivetrain, speed_rpm=12.1, torque=torque).phases[
            "mesh low_speed.ring – planet1"
        ]
        for torque in (-RATED, RATED)
    )
    assert driving + braking == pytest.approx(1.0)
    assert driving != pytest.approx(braking)


# The start


def accelerations(drivetrain: Drivetrain, point: OperatingPoint, steps: int = 4) -> Any:
    """Accelerations (n, n_dof) of the first steps, and mesh forces, in exudyn."""
    system = build_drivetrain(drivetrain, point.laws)
    highest = math.sqrt(np.max(np.abs(np.linalg.eigvals(_dynamic(drivetrain)))))
    record = simulate(
        system,
        point.loads,
        duration=steps * 0.1 / highest,
        integrator=Integrator(RK44, 0.1 / highest, "test"),
        start_state=point.start_state,
        record=("acceleration", "mesh_forces"),
    )
    return record


def _dynamic(drivetrain: Drivetrain) -> Any:
    linear = linearize(build_drivetrain(drivetrain))
    return np.linalg.solve(linear.mass, linear.stiffness)


@pytest.mark.parametrize("torque", [1.0, 100.0, -100.0, 3000.0])
@pytest.mark.parametrize("backlash", [0.0, 2e-5])
def test_the_start_is_in_equilibrium(torque: float, backlash: float) -> None:
    """Nothing accelerates: to round-off of springs of 1e9 N/m at 0.1 m, and of the load itself.

    1e9 N/m × 1e-17 m / 0.4 kg = 2.5e-8 m/s²; ε × 3000 N m / 0.0387 m / 0.39 kg = 4e-11 m/s².
    """
    drivetrain = lin_parker(4, sun_mesh_backlash=backlash, ring_mesh_backlash=backlash)
    point = operating_point(drivetrain, torque=torque)
    record = accelerations(drivetrain, point)
    assert np.abs(record.acceleration[0]).max() < 1e-6
    names = dict(zip(record.meshes, record.mesh_forces[0], strict=True))
    # Positive where flanks press, whichever way the torque goes; exactly what the torque asks for.
    expected = abs(torque) / 4.0 / 0.0387
    assert names == pytest.approx(dict.fromkeys(names, expected), rel=1e-9)
    assert point.mesh_forces == pytest.approx(names, rel=1e-9)


def test_backlash_is_taken_up_by_half_at_each_mesh() -> None:
    """A parallel pair turns by b/2 more: (w₁ − w₂ + y₁ − y₂) cos β = F/k + b/2, to the geometry.

    A line of action tilted by 1e-5 changes it by 1e-10.
    """
    backlash = 2e-4
    drivetrain = with_stage(
        changed(paper(), operation={"input": "reducer.pinion", "speed_range": [0.0, 1.0]}),
        "reducer",
        mesh_backlash=backlash,
    )
    point = operating_point(drivetrain, torque=10.0)
    q = dict(zip(point.dofs, point.displacement, strict=True))
    delta = sum(
        sign * q[f"reducer.{gear}.{dof}"]
        for gear, sign in (("pinion", 1.0), ("wheel", -1.0))
        for dof in "wy"
    )
    force = 10.0 / 0.0387
    assert point.mesh_forces["mesh reducer.pinion – wheel"] == pytest.approx(force, rel=1e-9)
    assert delta == pytest.approx(force / 2e8 + backlash / 2.0, rel=1e-6)


def test_a_speed_of_0_is_a_standstill_with_every_mesh_at_its_mean() -> None:
    drivetrain = lin_parker(4, sun_mesh_variation=HARMONIC, sun_mesh_backlash=1e-5)
    point = operating_point(drivetrain, speed_rpm=0.0, torque=100.0)
    assert point.speed_rpm is None
    assert point.mesh_frequencies == {}
    assert not any(law.varies for law in point.laws.values())
    assert point.laws["mesh planetary.sun – planet1"].backlash == 1e-5


def test_without_torque_it_starts_as_built() -> None:
    point = operating_point(lin_parker(4, sun_mesh_backlash=1e-5))
    assert not np.any(point.displacement)
    assert point.loads == ()
    assert set(point.mesh_forces.values()) == {0.0}


def test_a_held_input_needs_no_reaction() -> None:
    """A sun on a torsional support of 1e8 N/m: it takes the torque, nothing else turns far."""
    (stage,) = lin_parker(4).stages_of(PlanetaryStage)
    sun = stage.sun.model_dump(exclude_unset=True) | {"torsional_support": 1e8}
    carrier = stage.carrier.model_dump(exclude_unset=True) | {"torsional_support": 1e8}
    point = operating_point(lin_parker(4, sun=sun, carrier=carrier), torque=10.0)
    assert point.output is None
    assert [load.dof for load in point.loads] == ["planetary.sun.w"]
    with pytest.raises(ModelError, match="cannot turn freely"):
        operating_point(lin_parker(4, sun=sun, carrier=carrier), speed_rpm=100.0)


@pytest.mark.parametrize("torque", [10.0, 100.0])
def test_a_mesh_that_carries_nothing_stays_open(torque: float) -> None:
    """Two planets, one with a ring mesh without stiffness: its sun mesh carries nothing either.

    With backlash both flanks of that mesh stay apart, and nothing is singular.
    """
    stiffness = [5e8, 0.0, 5e8, 0.0]
    drivetrain = lin_parker(
        4, ring_mesh_stiffness=stiffness, sun_mesh_backlash=1e-5, ring_mesh_backlash=1e-5
    )
    point = operating_point(drivetrain, torque=torque)
    forces = [point.mesh_forces[f"mesh planetary.sun – planet{p}"] for p in (1, 2, 3, 4)]
    assert forces[1] == forces[3] == 0.0
    assert forces[0] == pytest.approx(torque / 2.0 / 0.0387, rel=1e-9)


@pytest.mark.parametrize("torque", [10.0, 1000.0, 10000.0])
def test_a_shaft_may_twist_by_turns(torque: float) -> None:
    """k_sw = 1e5 N/m at 38.7 mm: 10 kN m twist it by ten turns, and every mesh carries T/r."""
    point = operating_point(geared_reducer(), speed_rpm=500.0, torque=torque)
    pinion = torque / 0.0387
    expected = {name: pinion / (1 if "reducer" in name else 4) for name in point.mesh_forces}
    assert point.mesh_forces == pytest.approx(expected, rel=1e-9)


def test_the_loaded_drivetrain_keeps_its_free_rotation() -> None:
    """A preload has a stiffness across the line of action, F/L, and none along the rotation."""
    drivetrain = turbine()
    rest = linearize(build_drivetrain(drivetrain))
    loaded = operating_point(drivetrain, torque=RATED).linear
    largest = np.abs(loaded.stiffness).max()
    np.testing.assert_allclose(loaded.stiffness, loaded.stiffness.T, atol=1e-14 * largest)
    squares = [
        np.sort(np.linalg.eigvals(np.linalg.solve(linear.mass, linear.stiffness)).real)
        for linear in (rest, loaded)
    ]
    # ε × the largest square, 1e11: what the smallest is known to.
    assert abs(squares[1][0]) < 1e-3
    # Struts of 3.2e5 N / 0.24 m against planet bearings of 1.2e8 N/m: 1 % each, of two meshes.
    np.testing.assert_allclose(squares[1][1:], squares[0][1:], rtol=2e-2)
    assert np.abs(squares[1][1:] / squares[0][1:] - 1.0).max() > 5e-3


def nearly_a_mechanism(drivetrain: Drivetrain) -> bool:
    """Whether springs hold some motion 1e8 times less than each body's own do."""
    stiffness = linearize(build_drivetrain(drivetrain)).stiffness
    root = np.sqrt(np.diag(stiffness))
    eigenvalues = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    return bool(((eigenvalues > 1e-14) & (eigenvalues < 1e-8)).any())


@settings(max_examples=25)
@given(drivetrain=drivetrains(), data=st.data())
def test_any_drivetrain_starts_in_equilibrium(drivetrain: Drivetrain, data: st.DataObject) -> None:
    """Random trees, held and free, open meshes and pressed ones: the laws' own meshes balance."""
    driven, output = data.draw(st.permutations(drivetrain.bodies))[:2]
    backlash = data.draw(st.sampled_from([0.0, 1e-6, 1e-4]))
    stages = [
        stage.model_dump(exclude_unset=True)
        | {f"{key}_backlash": backlash for key in MESHES[type(stage)]}
        for stage in drivetrain.stages
    ]
    operation = {"input": driven, "speed_range": [0.0, 1.0], "output": output}
    model = changed(drivetrain, stage=stages, operation=operation)
    try:
        point = operating_point(model, torque=0.1)
    except ModelError as error:
        if re.search("turn in one way only|does not turn with the input", str(error)):
            return
        # one tree in a thousand each: 1 N moves it by metres, or a gap is about to close
        if "no equilibrium" in str(error) and nearly_a_mechanism(model):
            return
        if "deflections decide" not in str(error):
            raise
        point = operating_point(model, torque=1e-3)  # which hardly twists
    system = build_drivetrain(model, at_mean(point.laws))
    forces = forces_at(system, point.displacement)
    loads = {load.dof: load.signal.force for load in point.loads}
    load = np.array([loads.get(dof, 0.0) for dof in point.dofs])
    # Both are 0 where input and output are welded to one another. What stiff springs' forces are
    # known to is no imbalance, however small the load.
    known = 1e-7 * np.abs(load).max() + round_off_force(system)
    assert np.abs(forces + load).max() <= known


# Refusals


@pytest.mark.parametrize(
    ("drivetrain", "keys", "words"),
    [
        (changed(lin_parker(4), operation=None), {}, r"no \[operation\] table"),
        (lin_parker(4, sun_mesh_variation=HARMONIC), {}, "sun_mesh varies .* no speed is given"),
        (lin_parker(4), {"speed_rpm": math.nan}, "speed = nan rpm: must be 0, or within"),
        (lin_parker(4), {"torque": math.inf}, "torque = inf"),
        (lin_parker(4), {"torque": 1.0, "output": "planetary.moon"}, "not a body"),
        (lin_parker(4), {"torque": 1.0, "output": "planetary.ring"}, "does not turn with"),
        (turbine(), {"torque": 1e12}, "no equilibrium|contact does not settle"),
    ],
)
def test_operating_points_that_are_none(
    drivetrain: Drivetrain, keys: dict[str, Any], words: str
) -> None:
    with pytest.raises(ModelError, match=words):
        operating_point(drivetrain, **keys)


def test_missing_teeth_are_named() -> None:
    drivetrain = changed(
        with_stage(paper(), "reducer", mesh_variation=HARMONIC),
        operation={"input": "reducer.pinion", "speed_range": [0.0, 1.0]},
    )
    with pytest.raises(ModelError, match=r"mesh frequency: pinion\.teeth or wheel\.teeth is miss"):
        operating_point(drivetrain, speed_rpm=1000.0)


def test_two_other_ends_need_an_output() -> None:
    """A ring that is free takes a reaction as well as the carrier: it turns in two ways."""
    (stage,) = lin_parker(4).stages_of(PlanetaryStage)
    ring = stage.ring.model_dump(exclude_unset=True) | {"torsional_support": 0.0}
    drivetrain = lin_parker(4, ring=ring)
    with pytest.raises(ModelError, match=r"there are 2 \(planetary\.ring, planetary\.carrier\)"):
        operating_point(drivetrain, torque=1.0)
    with pytest.raises(ModelError, match="must turn in one way only"):
        operating_point(drivetrain, torque=1.0, output="planetary.carrier")

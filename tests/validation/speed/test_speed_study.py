"""The speed study in numbers: closed forms, what symmetry keeps still, what it names."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load
from mbs_models.model.parameters import PlanetaryStage
from tests.gearboxes import ERROR, HARMONIC, MASS, RADIUS, STIFFNESS, TEETH, pair, planetary
from tests.strategies import changed, damped, with_stage
from validation.runtime.executors import process_pool
from validation.speed.findings import dynamic_factors, ranges
from validation.speed.lines import line_names
from validation.speed.plan import plan
from validation.speed.result import SpeedResult
from validation.speed.run import run
from validation.speed.turning import BEYOND

STATIC = 100.0 / RADIUS
NATURAL = np.sqrt(2.0 * STIFFNESS / MASS)  # rad/s of two gears against each other


@functools.cache
def pair_with_error() -> SpeedResult:
    return run(plan(pair(mesh_transmission_error=ERROR), speed="500:12000:50"))


def test_a_pair_with_a_transmission_error_against_the_closed_form() -> None:
    """μẍ + F = 0, F = k (x − e) + c (ẋ − ė): F = (k + jωc) μω²E/(k + jωc − μω²), μ = m/2.

    Bearings 5e4 times as stiff as the mesh give way by 1e-4 of it.
    """
    result = pair_with_error()
    found = result.states
    assert found is not None
    omega = 2.0 * np.pi * TEETH * found.rpm / 60.0
    spring = STIFFNESS * (1.0 + 4e-6j * omega)
    inertia = 0.5 * MASS * omega**2
    force = np.abs(spring * inertia * 2e-6 / (spring - inertia))
    factor = dynamic_factors(result.turning, found)[:, 0]
    np.testing.assert_allclose(factor, 1.0 + force / STATIC, rtol=2e-3)
    assert np.abs(found.mesh[:, 2:]).max() < 1e-9 * STATIC  # one line, no other


def test_the_resonance_is_named() -> None:
    (peak,) = pair_with_error().peaks
    result = pair_with_error()
    assert line_names(result.turning)[peak.line] == "mesh pair"
    assert peak.order == pytest.approx(TEETH)
    assert result.modes.modes[peak.mode].frequency_hz == pytest.approx(
        NATURAL / (2.0 * np.pi), rel=1e-3
    )
    # The force of a base that moves with all its inertia is highest ζ² above the natural frequency.
    assert peak.frequency_hz == pytest.approx(NATURAL / (2.0 * np.pi), rel=0.01)
    assert peak.mode_share == pytest.approx(1.0, abs=1e-3)
    assert result.energies.most("strain", peak.mode)[0][0] == peak.mesh


def test_teeth_part_where_the_least_force_is_below_zero() -> None:
    """1 − swing < 0 where the dynamic factor is above 2: the force swings alike both ways."""
    result = pair_with_error()
    found = result.states
    assert found is not None
    (parting,) = result.partings
    factor = dynamic_factors(result.turning, found)[:, 0]
    assert parting.ranges == ranges(found.rpm, factor > 2.0)
    assert parting.least == pytest.approx(2.0 - factor.max())


def test_mean_forces_carry_the_torque() -> None:
    for check in pair_with_error().checks:
        assert check.agrees
        assert check.value < 1e-10


def test_constant_meshes_excite_nothing() -> None:
    result = run(plan(pair(), speed="500:2000:500"))
    assert result.states is None
    assert result.agrees
    assert result.turning.static_forces == pytest.approx([STATIC])


def test_a_varying_stiffness_without_torque_excites_nothing() -> None:
    result = run(plan(pair(mesh_variation=HARMONIC, torque=None), speed="500:2000:500"))
    assert result.states is None
    assert any("no torque" in warning for warning in result.warnings)


def test_far_below_resonance_the_mesh_carries_its_static_force() -> None:
    """Where inertia does not matter a varying mesh yields, and its force stays T/r_b.

    x = F̄/k(1 + κ cos τ), and F = F̄ − μẍ is largest where κ cos τ = −κ: by (ω/ω_n)² κ/(1 − κ)².
    """
    result = run(plan(pair(mesh_variation=HARMONIC), speed="100"))
    assert result.states is not None
    ratio = 2.0 * np.pi * TEETH * 100.0 / 60.0 / NATURAL
    factor = dynamic_factors(result.turning, result.states)[0, 0]
    assert factor - 1.0 == pytest.approx(ratio**2 * 0.1 / 0.9**2, rel=1e-3)


@functools.cache
def four_planets() -> SpeedResult:
    return run(plan(planetary(4), speed="1000:6000:500"))


def test_planet_phasing_keeps_families_still() -> None:
    """z_s = 27, N = 4: l = 1, 3 shake (k = 3, 1), l = 2 moves planets alone (k = 2), l = 4 turns.

    Lines of mesh stiffness that varies alike in all planets, but later: Parker (2000).
    """
    result = four_planets()
    found, parts = result.states, result.turning.parts
    assert found is not None
    (stage,) = result.turning.plan.drivetrain.stages
    columns = {
        dof: parts.dofs.index(f"{stage.name}.{dof}")
        for dof in ("sun.u", "sun.v", "sun.w", "ring.w")
    }
    lines = np.abs(found.acceleration)
    largest = lines.max()
    names = line_names(result.turning)
    for harmonic in range(1, 9):
        line = next(
            i
            for i, name in enumerate(names)
            if name
            in (f"{harmonic}·mesh {stage.name}", f"mesh {stage.name}" if harmonic == 1 else "")
        )
        phasing = 27 * harmonic % 4
        turning = lines[:, line, [columns["sun.w"], columns["ring.w"]]].max()
        shaking = lines[:, line, [columns["sun.u"], columns["sun.v"]]].max()
        assert (turning > 1e-6 * largest) == (phasing == 0)
        assert (shaking > 1e-6 * largest) == (phasing in (1, 3))


def test_planets_share_the_load_and_its_mean() -> None:
    result = four_planets()
    found = result.states
    assert found is not None
    (stage,) = result.turning.plan.drivetrain.stages_of(PlanetaryStage)
    mean = found.mesh[:, 0].real
    np.testing.assert_allclose(mean, 100.0 / (4 * stage.sun.base_radius), rtol=1e-2)
    assert [check.agrees for check in result.checks] == [True] * 3


def test_symmetric_planets_have_one_resonance_a_line() -> None:
    """Resonances of mesh harmonics are of the family that phasing lets through."""
    result = four_planets()
    kinds = {0: Kind.ROTATIONAL, 1: Kind.TRANSLATIONAL, 2: Kind.PLANET, 3: Kind.TRANSLATIONAL}
    assert result.peaks
    for peak in result.peaks:
        harmonic = round(peak.order / result.turning.lines.fundamentals[0])
        assert result.modes.modes[peak.mode].kind == kinds[27 * harmonic % 4]


def test_an_unstable_range_is_named() -> None:
    """f_mesh = 2 f_n with κ = 0.1 and hardly any damping; Mathieu's first tongue, κ f_n/2 wide."""
    result = run(plan(pair(beta=1e-8, mesh_variation=HARMONIC), speed="18000:20000:20"))
    middle = 60.0 * 2.0 * NATURAL / (2.0 * np.pi) / TEETH
    (unstable,) = result.unstable
    half = 0.1 / 4.0 * middle
    assert unstable.range.first == pytest.approx(middle - half, abs=30.0)
    assert unstable.range.last == pytest.approx(middle + half, abs=30.0)
    # In its middle a motion grows by κ ω_n/4.
    assert unstable.growth == pytest.approx(0.1 * NATURAL / 4.0, rel=0.01)
    assert unstable.tongue is not None
    assert unstable.tongue.tongue.harmonic == 1
    assert unstable.tongue.tongue.modes == pytest.approx((NATURAL / (2.0 * np.pi),) * 2, rel=1e-3)


def test_narrow_resonances_are_not_stepped_over() -> None:
    """ζ = 0.1 % at 9549 rpm, 10 rpm to either side: 500 rpm apart nobody would see it."""
    drivetrain = pair(beta=1e-7, mesh_transmission_error={"harmonics": [[1e-8, 0.0]]})
    result = run(plan(drivetrain, speed="500:12000:500"))
    assert result.states is not None
    assert len(result.states.rpm) > len(result.turning.plan.speeds)
    peak = result.peaks[0]
    # F = k E/(2ζ) there
    assert peak.swing == pytest.approx(STIFFNESS * 1e-8 / (1e-7 * NATURAL), rel=0.02)
    single = run(plan(drivetrain, speed="500,1000"))
    assert single.states is not None
    assert single.states.rpm.tolist() == [500.0, 1000.0]


def test_processes_give_the_same_bits() -> None:
    asked = plan(pair(mesh_variation=HARMONIC), speed="500:6000:250")
    here = run(asked).states
    with process_pool(2) as workers:
        there = run(asked, workers).states
    assert here is not None
    assert there is not None
    np.testing.assert_array_equal(here.mesh, there.mesh)
    np.testing.assert_array_equal(here.growth, there.growth)


def test_margins_are_those_of_the_operating_speed() -> None:
    drivetrain = pair(mesh_transmission_error=ERROR)
    assert drivetrain.operation is not None
    operation = drivetrain.operation.model_copy(update={"speed": 9000.0})
    result = run(plan(changed(drivetrain, operation=operation), speed="9000"))
    closest = result.margins[0]
    assert closest.order.name == "mesh pair"
    assert closest.change == pytest.approx(
        60.0 * NATURAL / (2 * np.pi) / TEETH / 9000.0 - 1.0, abs=1e-3
    )


def test_more_harmonics_are_solved_than_shown() -> None:
    result = four_planets()
    steady = result.turning.steady_state([10.0])
    assert len(result.turning.lines.points) - 1 == 10
    assert len(steady.lattice.points) - 1 == 10 + BEYOND


def two_stages() -> SpeedResult:
    """The paper's drivetrain of Table 2, 40 teeth on the reducer's gears: mesh orders 40 and 21."""
    drivetrain = damped(load("paper-table2"))
    reducer = drivetrain.stage("reducer").model_dump(exclude_unset=True)
    gears = {gear: reducer[gear] | {"teeth": 40} for gear in ("pinion", "wheel")}
    drivetrain = with_stage(drivetrain, "reducer", mesh_variation=HARMONIC, **gears)
    drivetrain = with_stage(drivetrain, "planetary", sun_mesh_variation=HARMONIC)
    assert drivetrain.operation is not None
    operation = drivetrain.operation.model_copy(update={"torque": 10.0})
    return run(plan(changed(drivetrain, operation=operation), speed="1000,2000", harmonics=4))


def test_lines_of_two_stages_are_named() -> None:
    result = two_stages()
    names = line_names(result.turning)
    assert names[0] == "mean"
    orders = dict(zip(names, result.turning.lines.orders, strict=True))
    assert orders["3·mesh reducer"] == pytest.approx(120.0)
    assert orders["mesh planetary"] == pytest.approx(21.0)  # z_s z_r/(z_s + z_r) = 30·70/100
    assert result.turning.lines.n_phases == 2
    assert orders["mesh reducer + mesh planetary"] == pytest.approx(61.0)
    assert orders["mesh reducer − mesh planetary"] == pytest.approx(19.0)
    assert all(check.agrees for check in result.checks)


def test_teeth_with_backlash_and_without_load_are_told() -> None:
    drivetrain = pair(mesh_transmission_error=ERROR, mesh_backlash=1e-5, torque=None)
    result = run(plan(drivetrain, speed="600,900"))
    assert any("pair mesh: backlash and no load" in warning for warning in result.warnings)
    loaded = run(plan(drivetrain, speed="600,900", torque=100.0))
    assert not any("backlash" in warning for warning in loaded.warnings)


@pytest.mark.slow
def test_a_vibration_too_large_to_be_linear_is_told_as_that() -> None:
    """At 300 N m, beside a peak: a faint line of planets' rotation 0.30 dB off, at 30 N m 0.03 dB.

    Second order in the motion: exudyn's lines of action tilt, the harmonic balance's do not.
    """
    trapezoid = {"shape": "trapezoid", "contact_ratio": 1.6}
    drivetrain = planetary(ring_mesh_variation=trapezoid)
    found = run(plan(drivetrain, speed="3112.3", torque=300.0, check="3112.3"))
    assert not found.agrees
    assert any("the vibration is not linear" in warning for warning in found.warnings)

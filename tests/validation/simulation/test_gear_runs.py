"""Gearboxes at speed and under load: mesh forces, sidebands, phasing, stability, lift-off."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from fbs.signal.spectra import Spectrum
from mbs_models.gears.operating_point import operating_point
from mbs_models.modal.mode_kinds import Kind, family_bases
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import PlanetaryStage
from mbs_models.signals.lines import schroeder_multisine
from tests.geared import lin_parker, speed_for
from validation.errors import CommandError
from validation.routes.floquet import parametric_system, tongues
from validation.simulation.gear_run import RingSensor, harmonics_heard
from validation.simulation.options import Options
from validation.simulation.result import SimulationResult
from validation.simulation.run import run_simulation

VARYING: dict[str, Any] = {
    "sun_mesh_variation": {"shape": "trapezoid", "contact_ratio": 1.6, "amplitude": 0.3},
    "ring_mesh_variation": {"shape": "trapezoid", "contact_ratio": 1.8, "amplitude": 0.2},
}
# 4.6 % at 740 Hz: a run settles within 0.1 s
DAMPING: dict[str, Any] = {"beta": 2e-6, "alpha": 20.0}


@functools.cache
def at_speed(planets: int = 4, mesh_frequency: float = 2000.0) -> SimulationResult:
    drivetrain = lin_parker(planets, **DAMPING, **VARYING)
    options = Options(
        speed_rpm=speed_for(drivetrain, mesh_frequency), torque=20.0, duration=0.5, fmax=8000.0
    )
    return run_simulation(drivetrain, options)


def test_mesh_forces_carry_the_torque() -> None:
    """Mean: T = N r_s F of the sun's meshes; ring meshes carry as much."""
    simulation = at_speed()
    assert simulation.gears is not None
    stage = simulation.drivetrain.stages[0]
    assert isinstance(stage, PlanetaryStage)
    static = 20.0 / (4 * stage.sun.base_radius)
    for load in simulation.gears.loads:
        # k(t) has the mean k_m, but the force k(t)δ(t) has a mean of its own, of second order.
        assert abs(load.mean) == pytest.approx(static, rel=0.02)
        assert load.open_share == 0.0
        assert load.dynamic_factor is not None
        assert 1.001 < load.dynamic_factor < 2.0


def test_no_frfs_where_the_meshes_excite() -> None:
    simulation = at_speed()
    assert simulation.estimated == ()
    assert simulation.no_frfs == "nothing excites from outside"


SOME = [pytest.param(3, marks=pytest.mark.slow), 4, pytest.param(5, marks=pytest.mark.slow)]


@pytest.mark.parametrize("planets", SOME)
def test_sidebands_stand_where_tooth_numbers_put_them(planets: int) -> None:
    """Orders k of the carrier with Σ e^{jkψ} ≠ 0 and no others (McFadden & Smith 1985).

    Steady to 1e-3: the run-in leaves that much of the slowest mode.
    """
    simulation = at_speed(planets)
    assert simulation.gears is not None
    (sensor,) = simulation.gears.sensors
    largest = sensor.expected.max()
    np.testing.assert_allclose(sensor.measured, sensor.expected, atol=2e-3 * largest)
    silent = sensor.orders % planets != 0
    assert silent.sum() > planets
    assert sensor.measured[silent].max() < 2e-3 * largest
    assert sensor.measured[~silent].max() == pytest.approx(largest, rel=2e-3)
    (stage,) = simulation.drivetrain.stages_of(PlanetaryStage)
    teeth = stage.ring.teeth
    assert teeth is not None
    assert sensor.passing * teeth == pytest.approx(2000.0, rel=0.02)  # teeth and radii: within 2 %


def test_lines_of_other_meshes_are_no_sidebands() -> None:
    """A reducer's mesh at 100 Hz is heard at 100 ± 2m and 200 ± 2m Hz; theory has 144 Hz alone."""
    heard = harmonics_heard([100.0], 2.0, 250.0)
    assert sorted(set(heard)) == [*np.arange(76.0, 125.0, 2.0), *np.arange(176.0, 225.0, 2.0)]
    frequency = np.array([100.0, 144.0])
    sensor = RingSensor(
        "planetary", 2.0, Spectrum(frequency, np.ones((2, 1)), 1, 1.0), (), np.array([50, 72]),
        frequency, np.array([9.0, 1.02]), np.array([0.0, 1.0]), np.array([True, False]),
    )  # fmt: skip
    assert sensor.deviation == pytest.approx(0.02)
    left_out = "1 of 2 lines are other meshes' and left out."
    assert sensor.sentence.endswith(f"0.02 of the largest line; {left_out}")


@pytest.mark.parametrize("planets", SOME[1:])
def test_phasing_silences_two_families_of_three(planets: int) -> None:
    """l z_s mod N: 27 teeth on 4 or 5 planets (Parker 2000; Ambarisha & Parker 2006)."""
    simulation = at_speed(planets)
    assert simulation.gears is not None
    told = {p.harmonic: p.excited for p in simulation.gears.phasing["planetary"]}
    number = {1: 27 % planets, 2: 54 % planets}
    assert told[1] == (Kind.TRANSLATIONAL if number[1] in (1, planets - 1) else Kind.PLANET)
    stage = simulation.drivetrain.stages[0]
    assert isinstance(stage, PlanetaryStage)
    for harmonic in (1, 2):
        shares = _family_shares(simulation, stage, harmonic)
        excited = shares.pop(told[harmonic])
        assert max(shares.values()) < 2e-3 * excited, (harmonic, told[harmonic], shares)


def _family_shares(
    simulation: SimulationResult, stage: PlanetaryStage, harmonic: int
) -> dict[Kind, float]:
    """Size of each family's part of the acceleration at a mesh harmonic."""
    from fbs.signal.spectra import line_amplitudes

    record = simulation.record
    assert simulation.gears is not None
    assert record.acceleration is not None
    frequency = harmonic * simulation.gears.point.mesh_frequencies["planetary"]
    measured = record.span(round(simulation.run_in * record.sampling_frequency))
    assert measured.acceleration is not None
    lines = line_amplitudes(measured.acceleration, record.sampling_frequency, [frequency])[0]
    found = {}
    rest = float(np.linalg.norm(lines)) ** 2
    for kind, (labels, basis) in family_bases(stage.planet_set).items():
        rows = [record.labels.index(label) for label in labels]
        found[Kind(kind)] = float(np.linalg.norm(basis.T @ lines[rows]))
        rest -= found[Kind(kind)] ** 2
    return found | {Kind.PLANET: max(rest, 0.0) ** 0.5}


def test_floquet_tells_a_stable_from_an_unstable_speed() -> None:
    gears = at_speed().gears
    assert gears is not None
    (stable,) = gears.stability
    assert stable.growth_rate < 0.0
    assert stable.stages == ("planetary",)
    drivetrain = lin_parker(
        4, beta=1e-8, sun_mesh_variation={"shape": "harmonics", "harmonics": [[0.6, 0.0]]}
    )
    probe = operating_point(drivetrain, speed_rpm=1000.0)
    system = parametric_system(drivetrain, probe.laws, highest_hz=2e4)
    widest = tongues(system, [1])[0]
    options = Options(
        speed_rpm=speed_for(drivetrain, widest.centre), torque=1.0, duration=1e-3, fmax=3e4
    )
    simulation = run_simulation(drivetrain, options)
    assert simulation.gears is not None
    (unstable,) = simulation.gears.stability
    assert unstable.growth_rate > 0.5 * widest.growth_rate
    assert "Parametric instability" in unstable.sentence
    # No green verdict: without play nothing ends the growth.
    assert not simulation.agrees
    broken = [check for check in simulation.checks if not check.agrees]
    assert [check.name for check in broken] == ["steady state"]
    assert broken[0].value == unstable.growth_rate


def test_frfs_leave_fbs_where_teeth_lift_off() -> None:
    """Backlash is closed while the dynamic mesh force stays below the static one.

    The level at which it reaches it follows from the first run, which is linear.
    """
    drivetrain = lin_parker(4, **DAMPING, sun_mesh_backlash=2e-5)
    signal = schroeder_multisine(200.0, 3000.0, 50.0, 0.005)
    excitation = Excitation("planetary.sun.w", signal)
    first = run_simulation(drivetrain, Options(excitations=(excitation,), torque=2.0))
    assert first.agrees, [check.findings for check in first.checks]
    assert first.gears is not None
    lift_off = min(
        abs(load.mean) / (load.largest - abs(load.mean))
        for load in first.gears.loads
        if ".sun" in load.name
    )
    levels = (0.5 * lift_off, 4.0 * lift_off)
    options = Options(excitations=(excitation,), torque=2.0, levels=levels, reverse=False)
    simulation = run_simulation(drivetrain, options)
    assert simulation.levels is not None
    below, beyond = simulation.levels.levels
    assert below.worst_db <= 0.1
    assert beyond.worst_db > 1.0
    assert "FBS no longer applies" in simulation.levels.conclusion


def test_levels_of_meshes_that_vary_are_refused() -> None:
    drivetrain = lin_parker(4, **VARYING)
    excitation = Excitation("planetary.sun.w", schroeder_multisine(200.0, 3000.0, 50.0, 0.05))
    options = Options(excitations=(excitation,), speed_rpm=1000.0, levels=(1.0, 10.0))
    with pytest.raises(CommandError, match="needs meshes that do not vary"):
        run_simulation(drivetrain, options)

"""Mesh phases from tooth numbers, against turning gears tooth by tooth; what they suppress."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.gears.operating_point import operating_point
from mbs_models.gears.phasing import phasing
from mbs_models.integration.integrators import RK44, Integrator
from mbs_models.integration.time_integration import simulate
from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load
from mbs_models.model.parameters import PlanetaryStage
from mbs_models.stages.planet_set import check_assembly, mesh_phases, sun_to_ring_phase
from mbs_models.system.drivetrain import build_drivetrain
from tests.geared import TEETH, family_amplitudes, lin_parker, speed_for

TURN = 2.0 * math.pi


def stage_of(z_s: int, z_p: int, z_r: int, **keys: Any) -> PlanetaryStage:
    """A stage of those teeth; ``planets`` or ``planet_angles`` and more in ``keys``."""
    (stage,) = load("lin-parker-3").stages
    r_s = 0.04
    tables = stage.model_dump(exclude_unset=True) | {"planets": None} | keys
    for gear, teeth in (("sun", z_s), ("planet", z_p), ("ring", z_r)):
        tables[gear] = tables[gear] | {"teeth": teeth}
    tables["sun"] |= {"base_radius": r_s}
    tables["planet"] |= {"base_radius": r_s * z_p / z_s}
    return PlanetaryStage.model_validate({k: v for k, v in tables.items() if v is not None})


@st.composite
def stages(draw: st.DrawFn) -> PlanetaryStage:
    """Two or three planets anywhere they can be put in, as large as leaves them room."""
    z_s, z_p = draw(st.integers(20, 60)), draw(st.integers(11, 20))
    z_r = z_s + 2 * z_p
    steps = draw(st.lists(st.integers(0, z_s + z_r - 1), min_size=1, max_size=2, unique=True))
    angles = [360.0 * step / (z_s + z_r) for step in [0, *steps]]
    reach = 2.0 * math.degrees(math.asin(z_p / (z_s + z_p)))
    for i, one in enumerate(angles):
        for other in angles[i + 1 :]:
            gap = abs((one - other + 180.0) % 360.0 - 180.0)
            assume(gap > 1.05 * reach)
    first = draw(st.floats(-180.0, 180.0))
    # A profile shift's difference of working pressure angles that the radii allow.
    angle = draw(st.sampled_from([23.0, 24.6, 26.0]))
    return stage_of(
        z_s,
        z_p,
        z_r,
        planet_angles=[first + angle for angle in angles],
        pressure_angle=None,
        sun_pressure_angle=24.6,
        ring_pressure_angle=angle,
    )


def involute(angle: float) -> float:
    return math.tan(angle) - angle


def first_passage(at_zero: float, speed: float, teeth: int, where: float) -> float:
    """When the first of ``teeth`` flanks, one of them at an angle, passes another angle (s)."""
    return ((where - at_zero) / speed) % (TURN / teeth / abs(speed))


@given(stage=stages(), way=st.sampled_from([1.0, -1.0]), sun_drives=st.booleans())
def test_phases_are_when_teeth_pass_the_pitch_points(
    stage: PlanetaryStage, way: float, sun_drives: bool
) -> None:
    """Turn sun and planets tooth by tooth, seen from the carrier, and wait for the flanks."""
    z_s, z_p = stage.sun.teeth, stage.planet.teeth
    assert z_s is not None
    assert z_p is not None
    speed, planet_speed = way, -way * z_s / z_p
    period = TURN / z_s
    # At t = 0 a pressed flank of the sun is at the pitch point with planet 1.
    expected_sun, expected_ring = [], []
    for angle in stage.angles:
        meets = first_passage(stage.angles[0], speed, z_s, angle)
        expected_sun.append(meets / period)
        # Then the planet's flank is there too, on the side of its centre that faces the sun. The
        # sun pushes it the way it moves, or holds it back; the other flank of the same tooth
        # presses on the ring. On the sun's pitch circle it is half a pitch on, and towards the tip
        # both approach each other by the involute: the tooth is narrower where inv α is larger.
        flank = angle + math.pi - planet_speed * meets
        pushed = (
            math.copysign(1.0, planet_speed) if sun_drives else -math.copysign(1.0, planet_speed)
        )
        narrower = involute(stage.ring_mesh_angle) - involute(stage.sun_mesh_angle)
        other = flank + pushed * (math.pi / z_p - narrower)
        expected_ring.append(first_passage(other, planet_speed, z_p, angle) / period)
    found = mesh_phases(stage.planet_set, turning=way, sun_drives=sun_drives)
    assert_same_phase(found.sun, expected_sun)
    assert_same_phase(found.ring, expected_ring)


def assert_same_phase(found: Any, expected: Any) -> None:
    gap = (np.subtract(found, expected) + 0.5) % 1.0 - 0.5
    # Angles of a few rad times a hundred teeth.
    assert np.abs(gap).max() < 1e-9


def test_equal_spacing_gives_parker_and_lins_formulas() -> None:
    """γ_sn = ± z_s ψ_n/2π, γ_rn = ∓ z_r ψ_n/2π, and γ_rs = 0 for 35 teeth."""
    (stage,) = lin_parker(4).stages
    forward, back = mesh_phases(stage.planet_set), mesh_phases(stage.planet_set, turning=-1.0)  # type: ignore[attr-defined]
    assert_same_phase(forward.sun, [27 * n / 4 for n in range(4)])
    assert_same_phase(forward.ring, [-97 * n / 4 for n in range(4)])
    assert_same_phase(back.sun, [-27 * n / 4 for n in range(4)])
    assert_same_phase(back.ring, [97 * n / 4 for n in range(4)])


def test_sun_to_ring_phase_by_the_planets_teeth() -> None:
    even, odd = stage_of(24, 12, 48, planets=3), stage_of(24, 15, 54, planets=3)
    assert sun_to_ring_phase(even.planet_set) % 1.0 == pytest.approx(0.5)
    assert sun_to_ring_phase(odd.planet_set) % 1.0 == pytest.approx(0.0, abs=1e-12)
    given_key = stage_of(24, 12, 48, planets=3, ring_mesh_phase=0.25)
    assert mesh_phases(given_key.planet_set).ring == (0.25, 0.25, 0.25)


def test_a_wider_tooth_at_the_rings_pitch_circle() -> None:
    """α_s = 28.118°, α_r = 17.161°: by half of 2 (inv α_s − inv α_r) on either side."""
    (low_speed, *_) = load("wind-turbine").stages
    a, b = math.radians(28.118), math.radians(17.161)
    widening = 17 * ((math.tan(a) - a) - (math.tan(b) - b)) / TURN
    assert isinstance(low_speed, PlanetaryStage)
    assert sun_to_ring_phase(low_speed.planet_set) == pytest.approx(8.5 - 0.5 - widening)
    assert sun_to_ring_phase(low_speed.planet_set, sun_drives=False) == pytest.approx(
        8.5 + 0.5 + widening
    )


def test_planets_that_cannot_be_put_in_are_refused() -> None:
    bad = stage_of(27, 35, 97, planets=3)
    with pytest.raises(ModelError, match=r"planets = 3: \(z_s \+ z_r\)/N = 41.3333 with z_s = 27"):
        check_assembly(bad.planet_set)
    with pytest.raises(ModelError, match=r"from planet 1 to planet 2 .* = 31.5 .*not whole"):
        check_assembly(stage_of(27, 36, 99, planet_angles=[0.0, 90.0]).planet_set)
    # 124 teeth, a twelfth of a degree off: a rounded angle.
    check_assembly(stage_of(27, 35, 97, planet_angles=[0.0, 90.08]).planet_set)


@pytest.mark.parametrize(
    ("gear", "words"),
    [("sun", r"sun\.teeth is missing"), ("ring", r"ring\.teeth is"), ("planet", "ring_mesh_phase")],
)
def test_missing_teeth_are_named(gear: str, words: str) -> None:
    (stage,) = lin_parker(4).stages
    tables = stage.model_dump(exclude_unset=True)
    tables[gear].pop("teeth")
    with pytest.raises(ModelError, match=words):
        mesh_phases(PlanetaryStage.model_validate(tables).planet_set)


def test_what_harmonics_excite() -> None:
    """Parker (2000), N = 4 with z_s = 27: k = 3, 2, 1, 0, 3."""
    (stage,) = lin_parker(4).stages
    found = phasing(stage.planet_set)  # type: ignore[attr-defined]
    assert [p.phasing_number for p in found] == [3, 2, 1, 0, 3]
    assert [p.excited for p in found] == [
        Kind.TRANSLATIONAL,
        Kind.PLANET,
        Kind.TRANSLATIONAL,
        Kind.ROTATIONAL,
        Kind.TRANSLATIONAL,
    ]
    assert found[0].suppressed == (Kind.ROTATIONAL, Kind.PLANET)


def test_unequal_planets_have_no_phasing() -> None:
    with pytest.raises(ModelError, match="not equally spaced"):
        phasing(stage_of(27, 35, 97, planet_angles=[0.0, 90.0, 360.0 * 60 / 124]).planet_set)
    (stage,) = lin_parker(4, sun_mesh_stiffness=[5e8, 5e8, 5e8, 4e8]).stages
    with pytest.raises(ModelError, match="differs from planet to planet"):
        phasing(stage.planet_set)  # type: ignore[attr-defined]


# In exudyn


@pytest.mark.parametrize("planets", sorted(TEETH))
@pytest.mark.parametrize("harmonic", [1, 2, 3, 4, 5])
def test_a_transmission_errors_harmonic_moves_one_family_only(planets: int, harmonic: int) -> None:
    """exudyn in time, from rest: at every instant the motion is in the family phasing says.

    1 nm of error: geometry is linear to 1e-9/0.04 m = 3e-8 of the motion, round-off of 0.1 m is
    1e-17/1e-9 = 1e-8.
    """
    error = {"harmonics": [[0.0, 0.0]] * (harmonic - 1) + [[1e-9, 30.0]]}
    drivetrain = lin_parker(
        planets, sun_mesh_transmission_error=error, ring_mesh_transmission_error=error
    )
    frequency = 1000.0
    point = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, frequency))
    assert point.mesh_frequencies["planetary"] == pytest.approx(frequency)
    record = simulate(
        build_drivetrain(drivetrain, point.laws),
        point.loads,
        duration=2.0 / frequency,
        integrator=Integrator(RK44, 5e-6, "test"),
        start_state=point.start_state,
    )
    assert record.displacement is not None
    sizes = [family_amplitudes(record.labels, q, planets) for q in record.displacement]
    largest = {kind: max(size[kind] for size in sizes) for kind in sizes[0]}
    (stage,) = drivetrain.stages
    expected = phasing(stage.planet_set, harmonic)[-1]  # type: ignore[attr-defined]
    for kind in expected.suppressed:
        assert largest[kind] < 1e-6 * largest[expected.excited], (kind, largest)
    assert largest[expected.excited] > 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("planets", sorted(TEETH))
def test_varying_stiffness_under_torque_keeps_to_the_phasing(planets: int) -> None:
    """Once the steady state is reached each harmonic of k(t) is in its family, however large.

    The stage looks the same when turned by a planet and delayed by that planet's phase, geometry
    and all. What is left of the transient is e^(−α t/2) = e^−20.
    """
    table = {"shape": "trapezoid", "contact_ratio": 1.6, "transition": 0.3}
    alpha, frequency, per_period = 2000.0, 1000.0, 200
    drivetrain = lin_parker(
        planets, alpha=alpha, sun_mesh_variation=table, ring_mesh_variation=table
    )
    point = operating_point(drivetrain, speed_rpm=speed_for(drivetrain, frequency), torque=30.0)
    record = simulate(
        build_drivetrain(drivetrain, point.laws),
        point.loads,
        duration=(40.0 / alpha) + 1.0 / frequency,
        integrator=Integrator(RK44, 1.0 / (per_period * frequency), "test"),
        start_state=point.start_state,
    )
    assert record.displacement is not None
    steady = record.displacement[-per_period:]
    lines = np.fft.rfft(steady, axis=0) / per_period
    (stage,) = drivetrain.stages
    for expected in phasing(stage.planet_set, 4):  # type: ignore[attr-defined]
        sizes = family_amplitudes(record.labels, lines[expected.harmonic], planets)
        for kind in expected.suppressed:
            assert sizes[kind] < 1e-5 * sizes[expected.excited], (expected, sizes)

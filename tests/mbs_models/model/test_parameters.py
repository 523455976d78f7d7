"""Parameters: the two forms of a quantity, geometry that follows, what is connected."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbs_models.model.model_file import load, loads, template
from mbs_models.model.parameters import Drivetrain, ParallelStage, PlanetaryStage

sizes = st.floats(1e-3, 1e3)


def paper_with(old: str, new: str) -> Drivetrain:
    text = template("paper")
    assert old in text
    return loads(text.replace(old, new, 1))


def reducer(drivetrain: Drivetrain) -> ParallelStage:
    stage = drivetrain.stage("reducer")
    assert isinstance(stage, ParallelStage)
    return stage


def planetary(drivetrain: Drivetrain) -> PlanetaryStage:
    stage = drivetrain.stage("planetary")
    assert isinstance(stage, PlanetaryStage)
    return stage


@given(inertia_over_r2=sizes)
def test_both_forms_of_an_inertia_give_the_same_rotary_mass(inertia_over_r2: float) -> None:
    inertia = inertia_over_r2 * 0.0387**2
    drivetrain = paper_with("polar_inertia_over_r2 = 1.16", f"polar_inertia = {inertia!r}")
    pinion = reducer(drivetrain).pinion
    assert pinion.rotary_mass(pinion.base_radius) == pytest.approx(inertia_over_r2)


@pytest.mark.parametrize(
    ("key", "value", "unit"),
    [
        ("diametral_inertia", 0.58, "rocking_mass"),
        ("bearing_rocking", 1.0e8, "rocking_stiffness"),
    ],
)
def test_both_forms_of_a_rocking_quantity_are_the_same(key: str, value: float, unit: str) -> None:
    written = "1.0e8" if value == 1.0e8 else repr(value)
    physical = paper_with(f"{key}_over_r2 = {written}", f"{key} = {value * 0.0387**2!r}")
    assert getattr(reducer(physical).pinion, unit) == pytest.approx(
        getattr(reducer(load("paper")).pinion, unit)
    )


def test_both_forms_of_a_torsional_support_are_the_same() -> None:
    radius = planetary(load("paper")).ring_radius
    physical = paper_with(
        "torsional_support = 1.0e9", f"torsional_stiffness = {1.0e9 * radius**2!r}"
    )
    assert planetary(physical).ring.torsional_support_at(radius) == pytest.approx(1.0e9)
    assert planetary(load("paper")).ring.torsional_support_at(radius) == 1.0e9


def test_both_forms_of_a_hub_are_the_same() -> None:
    physical = paper_with("inertia_over_r2 = 4.48e-8", f"inertia = {4.48e-8 * 0.0387**2!r}")
    assert physical.couplings[0].hub_mass == pytest.approx(4.48e-8)


def test_split_bearings_equal_isotropic_ones() -> None:
    split = paper_with(" bearing = 1.0e8", " bearing_u = 1.0e8, bearing_v = 1.0e8")
    planets = paper_with(
        "planet_bearing = 1.0e8",
        "planet_bearing_radial = 1.0e8\nplanet_bearing_tangential = 1.0e8",
    )
    assert planetary(split).sun.support.stiffness == ((1e8, 0.0), (0.0, 1e8))
    assert planetary(planets).planet_support.stiffness == ((1e8, 0.0), (0.0, 1e8))


def test_radii_follow_from_the_geometry() -> None:
    stage = planetary(load("paper"))
    centre_distance = (0.0387 + 0.0502) / math.cos(math.radians(24.6))
    assert stage.radius("sun") == 0.0387
    assert stage.radius("carrier") == pytest.approx(centre_distance)
    assert stage.radius("ring") == pytest.approx(0.0387 + 2 * 0.0502)


def test_ring_radius_with_two_pressure_angles() -> None:
    drivetrain = paper_with(
        "pressure_angle = 24.6", "sun_pressure_angle = 24.6\nring_pressure_angle = 20.0"
    )
    stage = planetary(drivetrain)
    centre_distance = (0.0387 + 0.0502) / math.cos(math.radians(24.6))
    expected = 0.0502 + centre_distance * math.cos(math.radians(20.0))
    assert stage.ring_radius == pytest.approx(expected)


@pytest.mark.parametrize("factor", [1.0, 1.004, 0.996])
def test_a_radius_that_agrees_is_accepted(factor: float) -> None:
    radius = 0.1391 * factor
    assert paper_with("ring    = {", f"ring = {{ base_radius = {radius!r},")


def test_angles_of_equally_spaced_and_of_given_planets_agree() -> None:
    given_angles = paper_with("planets = 4", "planet_angles = [0, 90, 180, 270]")
    assert planetary(given_angles).angles == pytest.approx(planetary(load("paper")).angles)


def test_connected_stages_warn_of_nothing() -> None:
    assert load("paper").warnings() == ()
    assert load("paper").groups() == (frozenset({"reducer", "planetary"}),)


@pytest.mark.parametrize("key", ["first_stiffness = 1.0e8", "second_stiffness = 1.0e5"])
def test_a_stage_left_unconnected_is_warned_of(key: str) -> None:
    drivetrain = paper_with(key, f"{key.split(' =')[0]} = 0.0")
    (warning,) = drivetrain.warnings()
    assert warning.startswith("stage 'planetary' is not connected to the rest: no torque passes")
    assert "rigid-body modes" in warning


def test_a_drivetrain_without_its_coupling_is_warned_of() -> None:
    text = template("paper")
    assert loads(text[: text.index("[[coupling]]")]).warnings()

"""Presets: published drivetrains, with the values of their sources."""

from __future__ import annotations

import math

import pytest

from mbs_models.errors import ModelError
from mbs_models.model.model_file import describe, load, loads, preset_names, template
from mbs_models.model.parameters import ParallelStage, PlanetaryStage

LIN_PARKER = "J. Vib. Acoust. 121, 316-321, Table 1"


def planetary(preset: str) -> PlanetaryStage:
    stage = load(preset).stage("planetary")
    assert isinstance(stage, PlanetaryStage)
    return stage


def masses(stage: PlanetaryStage) -> tuple[float, ...]:
    return tuple(b.mass for b in (stage.sun, stage.ring, stage.carrier, stage.planet))


def rotary_masses(stage: PlanetaryStage) -> tuple[float, ...]:
    bodies = (stage.sun, stage.ring, stage.carrier, stage.planet)
    return tuple(body.rotary_mass(math.nan) for body in bodies)  # no radius is needed


def test_names() -> None:
    assert preset_names() == (
        "geared-torsional",
        "lin-parker-3",
        "lin-parker-4",
        "lin-parker-5",
        "paper",
        "paper-table2",
        "wind-turbine",
    )


@pytest.mark.parametrize("preset", preset_names())
def test_every_preset_loads_cites_its_source_and_warns_of_nothing(preset: str) -> None:
    drivetrain = load(preset)
    assert drivetrain.source
    assert drivetrain.warnings() == ()
    assert describe(preset) == f"{preset}: {drivetrain.name} ({drivetrain.source})"


@pytest.mark.parametrize("preset", preset_names())
def test_template_is_commented_and_gives_the_preset(preset: str) -> None:
    text = template(preset)
    assert text.startswith("# ")
    assert "N/m" in text
    assert loads(text) == load(preset)


def test_template_of_an_unknown_preset_suggests_the_nearest() -> None:
    with pytest.raises(ModelError, match="lin-parker-6: no preset of that name; did you mean"):
        template("lin-parker-6")


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_lin_parker_is_one_stage(planets: int) -> None:
    drivetrain = load(f"lin-parker-{planets}")
    assert LIN_PARKER in drivetrain.source
    assert [stage.name for stage in drivetrain.stages] == ["planetary"]
    assert drivetrain.couplings == ()
    assert planetary(f"lin-parker-{planets}").planet_count == planets


@pytest.mark.parametrize("preset", ["lin-parker-3", "lin-parker-4", "lin-parker-5", "paper"])
def test_lin_parker_values(preset: str) -> None:
    stage = planetary(preset)
    members = (stage.sun, stage.ring, stage.carrier)
    assert masses(stage) == (0.4, 2.35, 5.43, 0.66)
    assert rotary_masses(stage) == (0.39, 3.0, 6.29, 0.61)
    assert tuple(m.bearing for m in members) == (1e8, 1e8, 1e8)
    assert tuple(m.torsional_support for m in members) == (0.0, 1e9, 0.0)
    assert stage.planet_support.stiffness == ((1e8, 0.0), (0.0, 1e8))
    assert (stage.sun_mesh_stiffness, stage.ring_mesh_stiffness) == (5e8, 5e8)
    assert stage.pressure_angle == 24.6
    assert (stage.sun.base_radius, stage.planet.base_radius) == (0.0387, 0.0502)


def test_table_2_values() -> None:
    stage = planetary("paper-table2")
    members = (stage.sun, stage.ring, stage.carrier)
    assert masses(stage) == (0.46, 0.588, 3.0, 0.177)
    assert rotary_masses(stage) == (0.272, 0.759, 1.5, 0.1)
    assert tuple(m.bearing for m in members) == (1e8, 1e8, 1e8)
    assert tuple(m.torsional_support for m in members) == (0.0, 1e9, 0.0)
    assert stage.planet_support.stiffness == ((1e8, 0.0), (0.0, 1e8))
    assert (stage.sun_mesh_stiffness, stage.ring_mesh_stiffness) == (2e8, 2e8)
    assert stage.pressure_angle == 21.34
    assert stage.planet_count == 4
    assert stage.ring_radius == pytest.approx(0.056)  # as Table 2 prints it


@pytest.mark.parametrize("preset", ["paper", "paper-table2"])
def test_table_1_values_and_coupling(preset: str) -> None:
    drivetrain = load(preset)
    stage = drivetrain.stage("reducer")
    assert isinstance(stage, ParallelStage)
    assert stage.pinion == stage.wheel
    assert (stage.helix_angle, stage.mesh_stiffness) == (0.0, 2e8)
    assert (stage.pinion.mass, stage.pinion.rocking_mass) == (2.0, 0.58)
    assert stage.pinion.polar_inertia_over_r2 == 1.16
    assert (stage.pinion.bearing_y, stage.pinion.bearing_z) == (3.5e8, 1e8)
    assert stage.pinion.rocking_stiffness == 1e8
    (coupling,) = drivetrain.couplings
    assert coupling.ends == (("reducer.wheel", 1e8), ("planetary.sun", 1e5))
    assert coupling.hub_mass == 4.48e-8
    radii = {coupling.radius, *(drivetrain.radius(body) for body, _ in coupling.ends)}
    assert len(radii) == 1

"""The presets' numbers against a second transcription of their sources, typed by itself.

The paper (2017), Tables 1 and 2; Lin & Parker 1999, J. Vib. Acoust. 121, 316–321, Table 1.
"""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from mbs_models.model.model_file import model_text

# member: mass, I/r², bearing, torsional support
LIN_PARKER: dict[str, tuple[float, ...]] = {
    "sun": (0.4, 0.39, 1e8, 0.0),
    "ring": (2.35, 3.0, 1e8, 1e9),
    "carrier": (5.43, 6.29, 1e8, 0.0),
}
LIN_PARKER_PLANET = (0.66, 0.61)
TABLE_2: dict[str, tuple[float, ...]] = {
    "sun": (0.46, 0.272, 1e8, 0.0),
    "ring": (0.588, 0.759, 1e8, 1e9),
    "carrier": (3.0, 1.5, 1e8, 0.0),
}
TABLE_2_PLANET = (0.177, 0.1)


def planetary_of(preset: str) -> dict[str, Any]:
    data = tomllib.loads(model_text(preset))
    (stage,) = [stage for stage in data["stage"] if stage["type"] == "planetary"]
    return stage  # type: ignore[no-any-return]


def member(table: dict[str, Any]) -> tuple[float, ...]:
    keys = ("mass", "polar_inertia_over_r2", "bearing", "torsional_support")
    return tuple(table[key] for key in keys)


@pytest.mark.parametrize(
    ("preset", "planets"),
    [("lin-parker-3", 3), ("lin-parker-4", 4), ("lin-parker-5", 5), ("paper", 4)],
)
def test_lin_and_parkers_table_1(preset: str, planets: int) -> None:
    stage = planetary_of(preset)
    assert stage["planets"] == planets
    assert stage["pressure_angle"] == 24.6
    assert stage["sun_mesh_stiffness"] == stage["ring_mesh_stiffness"] == 5e8
    assert stage["planet_bearing"] == 1e8
    assert {name: member(stage[name]) for name in LIN_PARKER} == LIN_PARKER
    planet = stage["planet"]
    assert (planet["mass"], planet["polar_inertia_over_r2"]) == LIN_PARKER_PLANET


def test_the_papers_table_2() -> None:
    stage = planetary_of("paper-table2")
    assert stage["pressure_angle"] == 21.34
    assert stage["sun_mesh_stiffness"] == stage["ring_mesh_stiffness"] == 2e8
    assert stage["planet_bearing"] == 1e8
    assert {name: member(stage[name]) for name in TABLE_2} == TABLE_2
    planet = stage["planet"]
    assert (planet["mass"], planet["polar_inertia_over_r2"]) == TABLE_2_PLANET
    assert (stage["sun"]["base_radius"], planet["base_radius"]) == (0.024, 0.016)
    assert [stage[name]["teeth"] for name in ("sun", "ring", "planet")] == [30, 70, 20]


@pytest.mark.parametrize("preset", ["paper", "paper-table2"])
def test_the_papers_table_1(preset: str) -> None:
    data = tomllib.loads(model_text(preset))
    (stage,) = [stage for stage in data["stage"] if stage["type"] == "parallel"]
    assert stage["mesh_stiffness"] == 2e8
    assert stage["helix_angle"] == 0.0
    expected = {
        "mass": 2.0,
        "diametral_inertia_over_r2": 0.58,
        "polar_inertia_over_r2": 1.16,
        "bearing_y": 3.5e8,
        "bearing_z": 1e8,
        "bearing_rocking_over_r2": 1e8,
    }
    for gear in ("pinion", "wheel"):
        assert {key: stage[gear][key] for key in expected} == expected
    (coupling,) = data["coupling"]
    assert coupling["inertia_over_r2"] == 4.48e-8
    assert coupling["second_stiffness"] == 1e5  # K_sw

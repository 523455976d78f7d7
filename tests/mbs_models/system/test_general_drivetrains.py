"""Chains, trees and loops of stages and inertias: what a model file may and may not say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from fbs import direct_frf, real_modes
from mbs_models.errors import ModelError
from mbs_models.modal.mode_kinds import Kind
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import dumps, load, loads
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from tests.strategies import drivetrains, paper, with_coupling, with_stage
from validation.checks.metrics import scaled_error
from validation.checks.model_warnings import model_warnings
from validation.crosscheck.study import cross_check
from validation.routes import equations, multibody
from validation.routes.bands import Band
from validation.routes.routes import couple_stages
from validation.routes.source import exudyn_source

LINES = np.geomspace(5.0, 15000.0, 50)
SPRING = {"stiffness": 1e8}


def parallel(name: str, pinion_radius: float = 0.04, wheel_radius: float = 0.08) -> dict[str, Any]:
    gear = {
        "mass": 2.0,
        "polar_inertia_over_r2": 1.16,
        "diametral_inertia_over_r2": 0.58,
        "bearing_y": 3.5e8,
        "bearing_z": 1e8,
        "bearing_rocking_over_r2": 1e8,
    }
    return {
        "type": "parallel",
        "name": name,
        "helix_angle": 15.0,
        "mesh_stiffness": 2e8,
        "pinion": gear | {"base_radius": pinion_radius},
        "wheel": gear | {"base_radius": wheel_radius},
    }


def shaft(name: str, first: str, second: str, **keys: Any) -> dict[str, Any]:
    table = {
        "radius": 0.05,
        "inertia_over_r2": 0.02,
        "first_stiffness": 1e8,
        "second_stiffness": 1e7,
    }
    return {"name": name, "first": first, "second": second} | table | keys


def train(stages: list[dict[str, Any]], couplings: list[dict[str, Any]], **keys: Any) -> Drivetrain:
    damping = {"stiffness_proportional": 1e-6, "mass_proportional": 1.0}
    tables = {"name": "train", "damping": damping, "stage": stages, "coupling": couplings}
    return Drivetrain.model_validate(tables | keys)


def assert_everything_agrees(drivetrain: Drivetrain) -> None:
    result = cross_check(drivetrain, Band(10.0, 15000.0, 10.0))
    wrong = [(c.name, c.routes, c.value, c.findings) for c in result.checks if not c.agrees]
    assert wrong == []


def test_a_loop_of_two_stages_on_the_same_shafts() -> None:
    """Two meshes between the same two shafts, radii in the same ratio: it turns."""
    drivetrain = train(
        [parallel("a"), parallel("b", 0.05, 0.10)],
        [shaft("one", "a.pinion", "b.pinion"), shaft("two", "a.wheel", "b.wheel")],
    )
    assert equations.rigid_body_motions(drivetrain) == 1
    assert model_warnings(drivetrain) == ()
    assert_everything_agrees(drivetrain)


def test_a_loop_whose_radii_contradict_is_locked_and_said_so() -> None:
    drivetrain = train(
        [parallel("a"), parallel("b", 0.05, 0.11)],
        [shaft("one", "a.pinion", "b.pinion"), shaft("two", "a.wheel", "b.wheel")],
    )
    assert equations.rigid_body_motions(drivetrain) == 0
    warnings = model_warnings(drivetrain)
    assert len(warnings) == 2
    assert all("locked" in warning for warning in warnings)
    assert_everything_agrees(drivetrain)


def test_a_ring_of_three_external_gears_is_locked() -> None:
    """An odd loop of meshes turns against itself whatever the radii."""
    drivetrain = train(
        [parallel(name, 0.05, 0.05) for name in "abc"],
        [
            shaft("one", "a.wheel", "b.pinion"),
            shaft("two", "b.wheel", "c.pinion"),
            shaft("three", "c.wheel", "a.pinion"),
        ],
    )
    assert equations.rigid_body_motions(drivetrain) == 0
    assert any("locked" in warning for warning in model_warnings(drivetrain))
    assert_everything_agrees(drivetrain)


def test_translations_are_coupled_along_common_axes() -> None:
    """u to y between unlike stages; y and z between parallel ones, which face different ways."""
    planetary = load("lin-parker-3").stage("planetary").model_dump(exclude_unset=True)
    moves = {"y": {"stiffness": 1e8}, "z": {"stiffness": 3e7, "damping": 50.0}}
    drivetrain = train(
        [parallel("a"), parallel("b"), planetary],
        [
            shaft("one", "a.wheel", "b.pinion", dofs=moves),
            shaft("two", "b.wheel", "planetary.sun", dofs={"u": {"stiffness": "rigid"}}),
        ],
    )  # fmt: skip
    assert_everything_agrees(drivetrain)


def test_a_bearing_with_cross_terms_and_damping_of_its_own() -> None:
    (stage,) = paper().stages_of(PlanetaryStage)
    sun = stage.sun.model_dump(exclude_unset=True) | {
        "bearing": [[1e8, 3e7], [3e7, 6e7]],
        "bearing_damping": [[200.0, 20.0], [20.0, 100.0]],
    }
    drivetrain = with_stage(paper(), "planetary", sun=sun)
    assert_everything_agrees(drivetrain)
    # 200 N s/m on 0.4 kg is no proportional damping: the modes are told from complex poles.
    damped = [m.damping_ratio for m in drivetrain_modes(drivetrain).modes[1:]]
    assert max(damped) > 1e-3


def test_mesh_stiffness_per_planet() -> None:
    values = [5e8, 4e8, 5e8, 6e8]
    drivetrain = with_stage(paper(), "planetary", sun_mesh_stiffness=values)
    assert_everything_agrees(drivetrain)
    kinds = [mode.kind for mode in drivetrain_modes(drivetrain).modes]
    assert Kind.MIXED in kinds
    with pytest.raises(ValueError, match=r"sun_mesh_stiffness = .*3 values for 4 planets"):
        with_stage(paper(), "planetary", sun_mesh_stiffness=[5e8, 4e8, 5e8])


def test_a_massless_shaft_is_the_limit_of_a_light_hub() -> None:
    light = with_coupling(paper(), first_stiffness="rigid", inertia_over_r2=1e-12)
    none = with_coupling(paper(), first_stiffness="rigid", inertia_over_r2=0.0)
    ours, theirs = (
        real_modes(multibody.drivetrain_system(d)).natural_frequencies for d in (light, none)
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


@settings(max_examples=25)
@given(drivetrains(largest=5))
def test_as_many_rigid_body_modes_as_the_springs_say(drivetrain: Drivetrain) -> None:
    """Counted before any eigensolution, found in K's null space."""
    expected = equations.rigid_body_motions(drivetrain)
    assert real_modes(equations.drivetrain_system(drivetrain)).n_rigid == expected


@settings(max_examples=15)
@given(drivetrains(largest=3))
def test_files_keep_everything(drivetrain: Drivetrain) -> None:
    assert loads(dumps(drivetrain)) == drivetrain


def test_fbs_couples_a_chain_in_any_order() -> None:
    drivetrain = train(
        [parallel("a"), parallel("b"), parallel("c")],
        [shaft("one", "a.wheel", "b.pinion"), shaft("two", "b.wheel", "c.pinion")],
    )
    backwards = drivetrain.model_copy(
        update={
            "stages": drivetrain.stages[::-1],
            "couplings": drivetrain.couplings[::-1],
        }
    )
    one, other = (couple_stages(exudyn_source(d), LINES).frf for d in (drivetrain, backwards))
    labels = one.responses
    # Signs of w and z are told from the first part in the file: what counts is the size.
    error = scaled_error(np.abs(one.values), np.abs(other.select(labels, labels).values))
    assert error.max() <= 1e-8


@pytest.mark.parametrize(
    ("coupling", "words"),
    [
        (shaft("one", "a.wheel", "b.pinion", dofs={"v": SPRING}), ["dofs.v", "only y, z"]),
        (shaft("one", "a.wheel", "rotor", dofs={"y": SPRING}), ["dofs.y", "rotor", "none"]),
        (shaft("one", "a.wheel", "b.pinion", inertia_over_r2=0.0), ["inertia_over_r2 = 0.0"]),
        (shaft("one", "a.wheel", "nobody"), ["nobody", "a.wheel", "rotor"]),
        (shaft("a", "a.wheel", "b.pinion"), ["'a'", "used 2 times"]),
    ],
)  # fmt: skip
def test_couplings_that_cannot_be(coupling: dict[str, Any], words: list[str]) -> None:
    rotor = {"name": "rotor", "radius": 0.1, "polar_inertia": 1.0}
    with pytest.raises(ValueError, match="Value error") as caught:
        train([parallel("a"), parallel("b")], [coupling], inertia=[rotor])
    for word in words:
        assert word in str(caught.value)


def test_rigid_couplings_must_not_close_a_loop() -> None:
    drivetrain = train(
        [parallel("a"), parallel("b")],
        [
            shaft(name, f"a.{body}", f"b.{body}", first_stiffness="rigid", second_stiffness="rigid")
            for name, body in (("one", "pinion"), ("two", "pinion"))
        ],
    )
    for build in (multibody.drivetrain_system, equations.drivetrain_system):
        with pytest.raises(ModelError, match="twice"):
            build(drivetrain)


def test_an_inertia_alone() -> None:
    drivetrain = Drivetrain.model_validate(
        {"name": "flywheel", "inertia": [{"name": "wheel", "radius": 0.5, "polar_inertia": 2.0}]}
    )
    frf = direct_frf(multibody.drivetrain_system(drivetrain), [10.0])
    expected = -1.0 / ((2 * np.pi * 10.0) ** 2 * 2.0 / 0.25)
    assert frf.between("wheel.w", "wheel.w")[0] == pytest.approx(expected, rel=1e-12)

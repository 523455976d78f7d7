"""exudyn's linearised systems against the equations: M, C and K entry by entry."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from fbs import SecondOrderSystem
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from tests.strategies import damped, drivetrains, paper, with_coupling, with_stage
from validation.routes import equations, multibody

# Both routes add the same springs in double precision: what is left is the rounding of sines and
# of positions in space, 1e-15 of the largest entry.
TOLERANCE = 1e-12


def assert_same(multibody_system: SecondOrderSystem, equation_system: SecondOrderSystem) -> None:
    assert set(multibody_system.dofs) == set(equation_system.dofs)
    assert set(multibody_system.derived) == set(equation_system.derived)
    for label, (dof, factor) in multibody_system.derived.items():
        found, found_factor = equation_system.derived[label]
        assert found == dof
        assert found_factor == pytest.approx(factor, rel=1e-14)
    order = [equation_system.dofs.index(dof) for dof in multibody_system.dofs]
    for name in ("mass", "damping", "stiffness"):
        ours = getattr(multibody_system, name)
        theirs = getattr(equation_system, name)[np.ix_(order, order)]
        assert np.abs(ours - theirs).max() <= TOLERANCE * np.abs(theirs).max(), name


def assert_routes_agree(drivetrain: Drivetrain) -> None:
    assert_same(multibody.drivetrain_system(drivetrain), equations.drivetrain_system(drivetrain))
    for part in drivetrain.parts:
        assert_same(
            multibody.stage_system(drivetrain, part.name),
            equations.stage_system(drivetrain, part.name),
        )


@pytest.mark.parametrize("damping", [False, True])
@pytest.mark.parametrize("helix_angle", [0.0, 20.0, -12.5])
def test_drivetrain_with_any_helix_angle(helix_angle: float, damping: bool) -> None:
    drivetrain = with_stage(paper(), "reducer", helix_angle=helix_angle)
    assert_routes_agree(damped(drivetrain) if damping else drivetrain)


@pytest.mark.parametrize("preset", ["lin-parker-3", "lin-parker-4", "lin-parker-5", "paper-table2"])
def test_presets(preset: str) -> None:
    assert_routes_agree(damped(load(preset)))


@pytest.mark.parametrize("angles", [[0.0, 180.0], [0.0, 80.0, 170.0, 260.0], [10.0, 100.0, 215.0]])
def test_planets_at_given_angles(angles: list[float]) -> None:
    drivetrain = with_stage(paper(), "planetary", planets=None, planet_angles=angles)
    assert_routes_agree(damped(drivetrain))


def test_different_pressure_angles_at_sun_and_ring() -> None:
    drivetrain = with_stage(
        paper(), "planetary", pressure_angle=None, sun_pressure_angle=24.6, ring_pressure_angle=18.0
    )
    assert_routes_agree(damped(drivetrain))


def test_a_bearing_with_different_radial_and_tangential_stiffness() -> None:
    drivetrain = with_stage(
        paper(),
        "planetary",
        planet_bearing=None,
        planet_bearing_radial=2e8,
        planet_bearing_tangential=5e7,
    )
    assert_routes_agree(damped(drivetrain))


@pytest.mark.parametrize("first", ["rigid", 1e8, 0.0])
@pytest.mark.parametrize("second", ["rigid", 1e5, 0.0])
def test_couplings_rigid_sprung_or_apart(first: float | str, second: float | str) -> None:
    # A hub of its own radius and of gear size, so that a wrong ratio shows.
    drivetrain = with_coupling(
        paper(), first_stiffness=first, second_stiffness=second, radius=0.05, inertia_over_r2=0.58
    )
    assert_routes_agree(damped(drivetrain))


@pytest.mark.parametrize("first", ["reducer.pinion", "reducer.wheel"])
@pytest.mark.parametrize("second", ["planetary.sun", "planetary.ring", "planetary.carrier"])
def test_couplings_at_any_body(first: str, second: str) -> None:
    """At the pinion and at the wheel the planetary stage faces different ways."""
    assert_routes_agree(damped(with_coupling(paper(), first=first, second=second)))


@settings(max_examples=60)
@given(drivetrains(largest=5))
def test_random_drivetrains(drivetrain: Drivetrain) -> None:
    assert_routes_agree(drivetrain)


def test_a_rigid_roll_leaves_no_force() -> None:
    """The rigid-body motion of the gears is in K's null space: nothing is strained by rolling."""
    system = multibody.drivetrain_system(with_coupling(paper(), radius=0.05))
    singular_values = np.linalg.svd(system.stiffness, compute_uv=False)
    assert singular_values[-1] <= 1e-12 * singular_values[0]
    assert singular_values[-2] >= 1e-6 * singular_values[0]

"""Drivetrains as systems with periodic springs: the equation of motion, and Floquet's by Magnus."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fbs import extremes, outputs, stability, steady_state, waveform
from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.model.parameters import Drivetrain
from tests.geared import geared_reducer, lin_parker, speed_for
from validation.errors import CommandError
from validation.routes.floquet import growth_rate, parametric_system
from validation.routes.periodic_meshes import parametric

HARMONICS = {"shape": "harmonics", "harmonics": [[0.15, 20.0], [0.05, -70.0]]}
ERROR = {"harmonics": [[2e-6, 0.0], [1e-6, 50.0]]}
TRAPEZOID = {"shape": "trapezoid", "contact_ratio": 1.5, "amplitude": 0.6, "transition": 0.1}


def planetary(planets: int, **keys: Any) -> Drivetrain:
    varied: dict[str, Any] = {f"{m}_mesh_variation": HARMONICS for m in ("sun", "ring")}
    errors: dict[str, Any] = {f"{m}_mesh_transmission_error": ERROR for m in ("sun", "ring")}
    return lin_parker(planets, beta=2e-6, **varied, **errors, **keys)


def at(drivetrain: Drivetrain, speed: float, torque: float = 20.0) -> OperatingPoint:
    return operating_point(drivetrain, speed_rpm=speed, torque=torque)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_the_steady_state_satisfies_the_equation_of_motion(planets: int) -> None:
    """M q̈ + C q̇ + K q + Σ v p = 0 with every law evaluated in time, at 40 instants of a period.

    Of the largest term; 25 harmonics of smooth laws leave nothing else.
    """
    drivetrain = planetary(planets)
    speed = speed_for(drivetrain, 1500.0)
    point = at(drivetrain, speed)
    model = parametric(drivetrain, point)
    found = steady_state(model.system, model.springs, [speed / 60.0], harmonics=25)
    assert found.lattice.n_phases == 1
    times = np.arange(40) / 40 / 1500.0
    identity = np.eye(len(model.system.dofs))
    q, rate, acceleration = (
        waveform(outputs(found, identity, quantity=quantity), found.lattice, times * speed / 60.0)[
            0
        ]
        for quantity in ("receptance", "mobility", "accelerance")
    )
    system = model.system
    terms = [acceleration @ system.mass, rate @ system.damping.T, q @ system.stiffness]
    for spring in model.springs:
        law = point.laws[spring.name]
        kappa = law.relative_stiffness(times) - 1.0
        error, slope = law.error(times)
        pressed = spring.static_force / spring.stiffness + q @ spring.vector - error
        force = spring.stiffness * (kappa * pressed - error) - spring.damping * slope
        terms.append(np.outer(force, spring.vector))
    largest = max(float(np.abs(term).max()) for term in terms)
    assert np.abs(sum(terms)).max() < 1e-9 * largest


def test_static_forces_press_the_flanks() -> None:
    """k v·q of the static state, 1 N m: geometry moves it by less than a thousandth."""
    drivetrain = planetary(4)
    point = at(drivetrain, 1000.0, torque=1.0)
    for spring in parametric(drivetrain, point).springs:
        assert spring.static_force > 0.0
        linear = spring.stiffness * float(spring.vector @ point.displacement)
        assert linear == pytest.approx(spring.static_force, rel=1e-3)


def test_mesh_frequencies_go_with_the_speed() -> None:
    """Whatever speed the operating point has; two stages have two phases."""
    drivetrain = geared_reducer()
    slow, fast = (parametric(drivetrain, at(drivetrain, speed)) for speed in (300.0, 4000.0))
    for a, b in zip(slow.springs, fast.springs, strict=True):
        assert a.ratio == pytest.approx(b.ratio, rel=1e-12)
        np.testing.assert_array_equal(a.vector, b.vector)
    mesh = next(spring for spring in slow.springs if spring.varies)
    assert mesh.ratio == pytest.approx(40.0, rel=1e-12)


def test_teeth_part_where_the_least_force_is_negative() -> None:
    """Without a load errors alone excite, and forces go as far below zero as above."""
    drivetrain = planetary(4)
    speed = speed_for(drivetrain, 1500.0)
    loaded = parametric(drivetrain, at(drivetrain, speed, torque=2000.0))
    free = parametric(drivetrain, at(drivetrain, speed, torque=0.0))
    for model, parts in ((loaded, False), (free, True)):
        found = steady_state(model.system, model.springs, [speed / 60.0])
        least = extremes(found.spring_forces, found.lattice).smallest
        assert (least.min() < 0.0) == parts


@pytest.mark.parametrize("frequency", [5000.0, 9100.0, 12000.0, 14963.0, 20000.0])
def test_growth_against_magnus(frequency: float) -> None:
    """A trapezoid of 60 %, planets phased: growths to 4000 1/s, and −100 1/s between tongues.

    Harmonics of a trapezoid fall as 1/l²: beyond 128 they are below 1e-4 of the first.
    """
    drivetrain = lin_parker(
        4, sun_mesh_variation=TRAPEZOID, ring_mesh_variation=TRAPEZOID, alpha=200.0
    )
    speed = speed_for(drivetrain, frequency)
    point = at(drivetrain, speed, torque=0.0)
    model = parametric(drivetrain, point, series=128)
    found = stability(model.system, model.springs, [speed / 60.0])
    expected = growth_rate(parametric_system(drivetrain, point.laws), frequency)
    assert found.growth_rate[0] == pytest.approx(expected, abs=5e-3)


def test_without_a_speed() -> None:
    drivetrain = lin_parker(3)
    with pytest.raises(CommandError, match="mesh frequencies need a speed"):
        parametric(drivetrain, operating_point(drivetrain, torque=1.0))

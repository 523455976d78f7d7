"""Growth over a period: Mathieu's equation, damping, an ODE solver, modes left out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import mathieu_a, mathieu_b

from fbs import (
    FbsError,
    NoCommonPeriodError,
    PeriodicSpring,
    SecondOrderSystem,
    stability,
    stability_by_period,
)
from tests.fbs.periodic_systems import integrated, planetary, right_hand_side


def mathieu(a: float, q: float, damping: float = 0.0) -> tuple[SecondOrderSystem, Any]:
    """ẍ + c ẋ + (a − 2q cos 2t) x = 0; one period π is a turn."""
    system = SecondOrderSystem(np.eye(1), np.array([[damping]]), np.array([[a]]), ("x",))
    return system, [PeriodicSpring("s", [1.0], a, 1.0, [-2 * q / a], [])]


def growth(a: float, q: float, damping: float = 0.0) -> float:
    system, springs = mathieu(a, q, damping)
    return float(stability(system, springs, [1 / np.pi]).growth_rate[0])


@pytest.mark.parametrize("q", [0.1, 1.0, 5.0])
@pytest.mark.parametrize(
    ("function", "order", "side"),
    [(mathieu_a, 1, -1.0), (mathieu_b, 2, 1.0), (mathieu_a, 2, -1.0)],
)
def test_mathieus_boundaries(function: Any, order: int, side: float, q: float) -> None:
    """Growing on one side of a tabulated a, and not on the other.

    64 steps of h = π/64 leave some h⁴ (2q)³/100: 6e-5 at q = 5.
    """
    a = float(function(order, q))
    near = 1e-6 if q <= 1.0 else 6e-5
    assert growth(a + side * near, q) > 1e-5
    assert growth(a - side * near, q) < 1e-12


def test_damping_is_taken_off_the_growth() -> None:
    """x = e^{−ct/2} y takes c²/4 off a: exact for one mode."""
    assert growth(1.1, 0.5, 0.06) == pytest.approx(growth(1.1 - 0.03**2, 0.5) - 0.03, rel=1e-9)
    assert growth(6.0, 0.5, 0.06) == pytest.approx(-0.03, rel=1e-12)


def damped_by(system: SecondOrderSystem, rate: float) -> SecondOrderSystem:
    damping = system.damping.copy()
    damping[0, 0] += rate
    return replace(system, damping=damping)


@pytest.mark.parametrize("rate", [0.0, 20.0])
@pytest.mark.parametrize("ratios", [(1.0, 1.0, 1.0), (2.0, 3.0, 1.0)])
def test_an_ode_solver_finds_the_same(ratios: tuple[float, ...], rate: float) -> None:
    """DOP853 over a period; modes decoupled and coupled by damping, one period and multiples."""
    system, springs = planetary(np.random.default_rng(2), 3, ratios, beta=1e-5, variation=0.5)
    system = damped_by(system, rate)
    homogeneous = [replace(s, error=np.array([], complex), static_force=0.0) for s in springs]
    shafts = np.array([13.0, 21.0, 42.0])
    found = stability(system, springs, shafts)
    assert found.period == pytest.approx(1 / shafts)
    assert found.n_modes == 4
    assert found.left_out == 0.0
    expected = []
    for shaft in shafts:
        right = right_hand_side(system, homogeneous, shaft)
        ends = [integrated(right, e, np.array([0.0, 1 / shaft]))[-1] for e in np.eye(8)]
        multipliers = np.abs(np.linalg.eigvals(np.transpose(ends)))
        expected.append(np.log(multipliers.max()) * shaft)
    # 2e-3 κ² of the highest mode's frequency shift, see STEPS_PER_CYCLE: growths are of order 10.
    np.testing.assert_allclose(found.growth_rate, expected, atol=2e-3)


def test_free_turning_is_left_out() -> None:
    system, springs = planetary(np.random.default_rng(3), 3, (1.0,), free=True, beta=1e-4)
    found = stability(system, springs, [50.0, 3.0])
    assert found.n_modes == 3
    assert np.all(found.growth_rate < -0.1)


def test_modes_left_out_follow_as_springs() -> None:
    """A small mass on a stiff spring in the mesh, 100 times above: left out, it is that spring.

    (ω/ω_high)² is 2e-4 of its share of the flexibility, 1 %.
    """
    stiffness = np.array([[1.01e4, -1e4], [-1e4, 1e6 + 1e4]]) * 1.0
    system = SecondOrderSystem(np.diag([1.0, 1e-2]), np.zeros((2, 2)), stiffness, ("x", "y"))
    springs = [PeriodicSpring("s", [1.0, -1.0], 1e4, 1.0, [0.5], [])]
    shaft = 2 * 100.0 / (2 * np.pi)
    whole = stability(system, springs, [shaft], highest_hz=np.inf)
    part = stability(system, springs, [shaft], highest_hz=100.0)
    assert (whole.n_modes, part.n_modes) == (2, 1)
    assert part.left_out == pytest.approx(0.0099, rel=0.02)
    assert whole.growth_rate[0] > 10.0
    assert part.growth_rate == pytest.approx(whole.growth_rate, rel=1e-4)


def test_one_answer_for_each_period() -> None:
    """No period in common: refused together, and answered apart as if the others were constant."""
    system, springs = planetary(np.random.default_rng(4), 4, (1.0, 1.618, 1.0, 1.0), variation=0.4)
    springs[3] = replace(springs[3], variation=np.array([], complex))
    with pytest.raises(NoCommonPeriodError, match=r"vary 1, 1\.618 times per turn"):
        stability(system, springs, [10.0])
    found = dict(stability_by_period(system, springs, [10.0, 20.0]))
    assert list(found) == [(0, 2), (1,)]
    alone = stability(system, [springs[0], springs[2]], [10.0, 20.0])
    np.testing.assert_array_equal(found[0, 2].growth_rate, alone.growth_rate)


def test_without_variation_the_poles_remain() -> None:
    system, springs = planetary(np.random.default_rng(5), 3, [1.0] * 3)
    still = [replace(spring, variation=np.array([], complex)) for spring in springs]
    found = stability(system, still, [7.0])
    squares = np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness)).real
    assert found.growth_rate == pytest.approx([-5e-4 * squares.min() / 2], rel=1e-9)


def test_no_mode_is_left() -> None:
    system, springs = mathieu(4.0, 0.1)
    with pytest.raises(FbsError, match=r"no mode up to 0\.1 Hz: the lowest is 0\.3183"):
        stability(system, springs, [1.0], highest_hz=0.1)

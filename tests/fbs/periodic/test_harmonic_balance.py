"""Steady states with periodic springs: shooting, long integrations, closed forms, symmetries."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import mathieu_a, mathieu_b

from fbs import (
    FbsError,
    PeriodicSpring,
    SecondOrderSystem,
    SingularBalanceError,
    SingularLineError,
    direct_frf,
    outputs,
    steady_state,
    waveform,
)
from fbs.periodic import _balance
from tests.fbs.periodic_systems import (
    integrated,
    laws,
    periodic_orbit,
    planetary,
    right_hand_side,
)


def deflections(springs: list[PeriodicSpring], states: Any) -> Any:
    vectors = np.array([spring.vector for spring in springs])
    return states[:, : vectors.shape[1]] @ vectors.T


def scaled(found: Any, expected: Any) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


# One period


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize(("planets", "shaft"), [(3, 3.0), (4, 7.7), (5, 12.0)])
def test_shooting(planets: int, shaft: float, free: bool) -> None:
    """Planets in phases of their own, fixed and free to turn: DOP853's own tolerance is left."""
    system, springs = planetary(np.random.default_rng(planets), planets, [3.0] * planets, free=free)
    times = np.linspace(0.0, 1 / (3 * shaft), 20)
    orbit = periodic_orbit(right_hand_side(system, springs, shaft), 2 * planets + 2, times)
    found = steady_state(system, springs, [shaft], harmonics=30)
    assert found.truncation[0] < 1e-15
    value = waveform(found.deflection, found.lattice, shaft * times)[0]
    assert scaled(value, deflections(springs, orbit)) < 1e-9


@pytest.mark.parametrize("ratios", [(2.0, 3.0), (3.0, 3.0 * (1 + 1e-14), 1.0)])
def test_ratios_of_small_integers_share_a_period(ratios: tuple[float, ...]) -> None:
    system, springs = planetary(np.random.default_rng(1), 3, ratios)
    times = np.linspace(0.0, 0.2, 20)
    orbit = periodic_orbit(right_hand_side(system, springs, 5.0), 8, times)
    found = steady_state(system, springs, [5.0], harmonics=20, combinations=20)
    assert found.lattice.n_phases == 1
    value = waveform(found.deflection, found.lattice, 5.0 * times)[0]
    assert scaled(value, deflections(springs, orbit)) < 1e-8


def test_light_damping_at_resonances() -> None:
    """ζ about 1e-5, harmonics 1 and 2 of the mesh on natural frequencies, forces a thousandfold.

    DOP853's 1e-12 a step grow as the response, some 1/ζ.
    """
    system, springs = planetary(np.random.default_rng(4), 3, [1.0] * 3, beta=1e-7, variation=0.01)
    squares = np.linalg.eigvals(np.linalg.solve(system.mass, system.stiffness)).real
    for shaft in np.sqrt(np.sort(squares)[[0, 2]]) / (2 * np.pi) / np.array([1.0, 2.0]):
        times = np.linspace(0.0, 1 / shaft, 20)
        orbit = periodic_orbit(right_hand_side(system, springs, shaft), 8, times)
        found = steady_state(system, springs, [shaft], harmonics=20)
        value = waveform(found.deflection, found.lattice, shaft * times)[0]
        assert scaled(value, deflections(springs, orbit)) < 1e-6


def test_damping_that_couples_modes() -> None:
    """A damper on the sun alone, which also brakes the free turning."""
    system, springs = planetary(np.random.default_rng(2), 3, [2.0] * 3, free=True)
    damping = system.damping.copy()
    damping[0, 0] += 30.0
    system = replace(system, damping=damping)
    times = np.linspace(0.0, 0.1, 20)
    orbit = periodic_orbit(right_hand_side(system, springs, 5.0), 8, times)
    found = steady_state(system, springs, [5.0], harmonics=25)
    value = waveform(found.deflection, found.lattice, 5.0 * times)[0]
    assert scaled(value, deflections(springs, orbit)) < 1e-8
    speeds = waveform(outputs(found, np.eye(4), quantity="mobility"), found.lattice, 5.0 * times)[0]
    assert scaled(speeds, orbit[:, 4:]) < 1e-8


def test_forces_and_outputs() -> None:
    """Mesh forces by their own law, accelerations by the equation of motion, a bearing's force."""
    system, springs = planetary(np.random.default_rng(3), 3, [1.0] * 3)
    shaft, times = 6.0, np.linspace(0.0, 1 / 6.0, 20)
    right = right_hand_side(system, springs, shaft)
    orbit = periodic_orbit(right, 8, times)
    found = steady_state(system, springs, [shaft], harmonics=30)

    def in_time(lines: Any) -> Any:
        return waveform(lines, found.lattice, shaft * times)[0]

    law = np.array([laws(springs, shaft)(t) for t in times])
    for m, spring in enumerate(springs):
        kappa, error, slope = law[:, :, m].T
        moved = spring.static_force / spring.stiffness + orbit[:, :4] @ spring.vector - error
        rate = orbit[:, 4:] @ spring.vector - slope
        force = spring.stiffness * (1 + kappa) * moved + spring.damping * rate
        assert scaled(in_time(found.spring_forces)[:, m], force) < 1e-8
    acceleration = np.array([right(t, z)[4:] for t, z in zip(times, orbit, strict=True)])
    assert scaled(in_time(outputs(found, np.eye(4), quantity="accelerance")), acceleration) < 1e-8
    row = np.array([[0.0, 2.0, 0.0, -1.0]])
    bearing = in_time(outputs(found, 1e4 * row, 3.0 * row))
    assert scaled(bearing, 1e4 * orbit[:, :4] @ row.T + 3.0 * orbit[:, 4:] @ row.T) < 1e-8


# Several periods


@pytest.mark.parametrize(
    ("ratios", "combinations", "tolerance"),
    [((1.0, 1.3 * np.sqrt(2)), 24, 1e-7), ((1.0, 1.618, 2.23), 12, 2e-5)],
)
def test_independent_phases_against_a_long_integration(
    ratios: tuple[float, ...], combinations: int, tolerance: float
) -> None:
    """After 4 s the slowest transient is below e⁻³⁰; what is left are combinations left out."""
    system, springs = planetary(np.random.default_rng(5), 3, ratios, beta=4e-3, variation=0.1)
    poles = np.linalg.eigvals(
        np.block(
            [
                [np.zeros((4, 4)), np.eye(4)],
                [-np.linalg.solve(system.mass, m) for m in (system.stiffness, system.damping)],
            ]
        )
    )
    assert poles.real.max() * 4.0 < -30.0
    shaft, times = 9.0, np.linspace(4.0, 4.4, 40)
    states = integrated(right_hand_side(system, springs, shaft), np.zeros(8), times)
    found = steady_state(system, springs, [shaft], combinations=combinations)
    assert found.lattice.n_phases == len(ratios)
    assert found.residual[0] < 1e-10
    value = waveform(found.deflection, found.lattice, shaft * times)[0]
    assert scaled(value, deflections(springs, states)) < tolerance


def test_two_phases_whose_ratio_is_whole_after_all() -> None:
    """12 : 11 is no quotient of small integers; on the torus of two phases it comes out right."""
    system, springs = planetary(np.random.default_rng(6), 3, (12.0, 11.0), variation=0.1, beta=4e-3)
    times = np.linspace(4.0, 5.0, 50)
    orbit = integrated(right_hand_side(system, springs, 1.0), np.zeros(8), times)
    found = steady_state(system, springs, [1.0], combinations=24)
    assert found.lattice.n_phases == 2
    value = waveform(found.deflection, found.lattice, times)[0]
    assert scaled(value, deflections(springs, orbit)) < 1e-6


def test_the_whole_matrix_where_iterations_do_not_converge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two steps are not enough for 1e-12: every speed is solved densely, to the same forces."""
    system, springs = planetary(np.random.default_rng(10), 3, (1.0, 1.618), variation=0.4)
    speeds = np.linspace(2.0, 20.0, 9)
    iterated = steady_state(system, springs, speeds)
    monkeypatch.setattr(_balance, "MAX_STEPS", 2)
    dense = steady_state(system, springs, speeds)
    assert iterated.residual.max() < 1e-10
    assert dense.residual.max() < 1e-12
    assert scaled(iterated.spring_forces, dense.spring_forces) < 1e-9


@pytest.mark.parametrize(("harmonics", "combinations"), [(20, 0), (20, 3), (20, 12), (3, 12)])
def test_what_is_left_out_shows_in_the_truncation(harmonics: int, combinations: int) -> None:
    """The lines' errors are what the largest one left out says, within a factor of five.

    Against 20 harmonics and combinations to 1e-8; the largest line of each spring is 1.
    """
    system, springs = planetary(np.random.default_rng(7), 3, (1.0, 1.618), variation=0.3)
    exact = steady_state(system, springs, [8.0], harmonics=20, combinations=60)
    assert exact.truncation[0] < 1e-8
    found = steady_state(system, springs, [8.0], harmonics=harmonics, combinations=combinations)
    place = {tuple(point): line for line, point in enumerate(found.lattice.points.tolist())}
    worst = 0.0
    for line, point in enumerate(exact.lattice.points.tolist()):
        own = exact.spring_forces[0, line]
        kept = place.get(tuple(point))
        difference = own - (found.spring_forces[0, kept] if kept is not None else 0.0)
        worst = max(worst, *(np.abs(difference) / np.abs(exact.spring_forces[0]).max(axis=0)))
    assert found.truncation[0] / 5.0 < worst < 5.0 * found.truncation[0]


# Closed forms


def test_constant_springs_are_frfs_times_the_errors_force() -> None:
    """κ = 0: d = Y (k + jωc) e, and nothing at 0 Hz."""
    system, springs = planetary(np.random.default_rng(8), 4, [2.0] * 4)
    springs = [replace(spring, variation=np.array([], complex)) for spring in springs]
    found = steady_state(system, springs, [1.0, 4.0, 9.0])
    for line, order in ((2, 2), (1, 1)):
        frequency = found.frequency[:, line]
        frf = direct_frf(system, frequency).values
        vectors = np.array([spring.vector for spring in springs])
        force = [
            (spring.stiffness + 2j * np.pi * frequency * spring.damping) * spring.error[order - 1]
            for spring in springs
        ]
        expected = np.einsum("mi,kij,nj,nk->km", vectors, frf, vectors, np.array(force))
        assert scaled(found.deflection[:, line], expected) < 1e-12
    assert np.abs(found.deflection[:, [0, 3]]).max() == 0.0


def single(stiffness: float, variation: Any, error: Any = (), **keys: Any) -> tuple[Any, Any]:
    system = SecondOrderSystem(
        np.eye(1), np.array([[keys.pop("rate", 0.0)]]), np.array([[stiffness]]), ("x",)
    )
    return system, [PeriodicSpring("s", [1.0], stiffness, 1.0, variation, error, **keys)]


@pytest.mark.parametrize(("function", "order"), [(mathieu_a, 2), (mathieu_b, 2)])
@pytest.mark.parametrize("q", [0.5, 2.0])
def test_the_balance_is_singular_where_mathieus_tongue_begins(
    function: Any, order: int, q: float
) -> None:
    """ẍ + (a − 2q cos 2t) x = 0 has a motion of period π at a_2 (even) and b_2 (odd) alone.

    Forced, its even or odd response changes sign there through infinity. Between the last two
    numbers a can be, 1e-16 apart, the condition number is beyond 1e13.
    """

    def response(a: float) -> float:
        error = [1.0 if function is mathieu_a else 1j]
        system, springs = single(a, [-2 * q / a], error)
        line = steady_state(system, springs, [1 / np.pi], harmonics=20).deflection[0, 1, 0]
        return float(line.real if function is mathieu_a else line.imag)

    expected = float(function(order, q))
    assert bisected(response, expected) == pytest.approx(expected, rel=1e-10)


def test_several_periods_on_a_boundary_are_named_too() -> None:
    """A second spring with its own period, on a mass of its own, changes nothing of the first."""
    q, a = 2.0, float(mathieu_a(2, 2.0))
    system = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), np.diag([a, 3.3]), ("x", "y"))

    def springs(a: float) -> list[PeriodicSpring]:
        return [
            PeriodicSpring("x", [1, 0], a, 1.0, [-2 * q / a], [1.0]),
            PeriodicSpring("y", [0, 1], 3.3, 1.37, [0.1], [1.0]),
        ]

    def response(a: float) -> float:
        held = replace(system, stiffness=np.diag([a, 3.3]))
        found = steady_state(held, springs(a), [1 / np.pi], harmonics=20)
        line = found.lattice.harmonic(0, 1)
        return float(found.deflection[0, line, 0].real)

    middle = bisected(response, a)
    assert middle == pytest.approx(a, rel=1e-10)


def bisected(response: Any, near: float) -> float:
    """Where a response changes sign, to the last digit: the balance is refused on the way."""
    tried = []

    def bisect() -> None:
        low, high = near - 1e-3, near + 1e-3
        sign = np.sign(response(low))
        assert np.sign(response(high)) == -sign
        for _ in range(60):
            tried.append((low + high) / 2)
            below = np.sign(response(tried[-1])) == sign
            low, high = (tried[-1], high) if below else (low, tried[-1])

    with pytest.raises(SingularBalanceError, match="boundary of an instability") as caught:
        bisect()
    assert caught.value.shaft_frequencies == pytest.approx([1 / np.pi])
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    return tried[-1]


def test_an_undamped_pole() -> None:
    system, springs = single((2 * np.pi) ** 2 * 9.0, [0.1], [1.0])
    with pytest.raises(SingularLineError, match="3 Hz"):
        steady_state(system, springs, [1.0])


# Properties

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=25, deadline=None)


@few
@given(seeds, st.floats(-3, 3), st.sampled_from([(1.0,), (1.0, 1.618)]))
def test_linear_in_errors_and_loads(seed: int, factor: float, ratios: tuple[float, ...]) -> None:
    system, first = planetary(np.random.default_rng(seed), 3, ratios)
    _, second = planetary(np.random.default_rng(seed + 1), 3, ratios)
    second = [
        replace(a, error=b.error, static_force=b.static_force)
        for a, b in zip(first, second, strict=True)
    ]
    both = [
        replace(
            a,
            error=a.error + factor * b.error,
            static_force=a.static_force + factor * b.static_force,
        )
        for a, b in zip(first, second, strict=True)
    ]
    x, y, sum_ = (
        steady_state(system, springs, [2.0, 11.0]).spring_forces
        for springs in (first, second, both)
    )
    size = np.abs(x).max() + abs(factor) * np.abs(y).max()
    assert np.abs(x + factor * y - sum_).max() < 1e-9 * size


@few
@given(seeds, st.floats(0, 1), st.floats(0, 1))
def test_a_later_start_turns_every_line(seed: int, first: float, second: float) -> None:
    """φ → φ − φ_0 of each phase: line h by e^{−jh·φ_0}."""
    system, springs = planetary(np.random.default_rng(seed), 3, (1.0, 1.618, 1.0))
    late = 2 * np.pi * np.array([first, second])

    def turned(series: Any, phase: int) -> Any:
        return series * np.exp(-1j * late[phase] * np.arange(1, len(series) + 1))

    shifted = [
        replace(s, variation=turned(s.variation, p), error=turned(s.error, p))
        for s, p in zip(springs, (0, 1, 0), strict=True)
    ]
    x, y = (steady_state(system, own, [5.0]) for own in (springs, shifted))
    assert x.lattice.fundamentals == pytest.approx([1.0, 1.618])
    expected = x.spring_forces * np.exp(-1j * x.lattice.points @ late)[:, None]
    assert scaled(y.spring_forces, expected) < 1e-9


@few
@given(seeds)
def test_a_speed_does_not_depend_on_the_others(seed: int) -> None:
    system, springs = planetary(np.random.default_rng(seed), 3, (1.0, 1.618))
    speeds = np.random.default_rng(seed).uniform(1.0, 30.0, 11)
    together = steady_state(system, springs, speeds)
    alone = steady_state(system, springs, speeds[7:8])
    assert scaled(alone.spring_forces[0], together.spring_forces[7]) < 1e-9


# Refusals


def test_what_cannot_be_solved() -> None:
    system, springs = planetary(np.random.default_rng(9), 3, [1.0] * 3, free=True)
    none = np.array([], complex)
    with pytest.raises(FbsError, match="no spring varies"):
        steady_state(system, [replace(springs[0], variation=none, error=none)], [1.0])
    with pytest.raises(FbsError, match="no springs"):
        steady_state(system, [], [1.0])
    with pytest.raises(FbsError, match="'mesh 0': vector has 2 entries, the system 4"):
        steady_state(system, [replace(springs[0], vector=np.array([1.0, 0.0]))], [1.0])
    with pytest.raises(FbsError, match="'mesh 0' is strained by a motion that K leaves free"):
        steady_state(system, [replace(springs[0], vector=np.array([1.0, 0, 0, 0]))], [1.0])
    with pytest.raises(FbsError, match=r"loss factor 0\.01"):
        steady_state(replace(system, loss_factor=0.01), springs, [1.0])
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(FbsError, match=f"shaft frequency {wrong}: must be finite and positive"):
            steady_state(system, springs, [1.0, wrong])
    with pytest.raises(FbsError, match="harmonics = 0"):
        steady_state(system, springs, [1.0], harmonics=0)
    found = steady_state(system, springs, [1.0])
    with pytest.raises(FbsError, match=r"rows have shape \(3,\): must be \(n_output, 4\)"):
        outputs(found, np.ones(3))

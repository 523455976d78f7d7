"""Which springs share a period, which lines a motion has, and what lines add up to in time."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    FbsError,
    Lattice,
    NonFiniteError,
    PeriodicSpring,
    common_periods,
    extremes,
    lattice,
    waveform,
)


def springs(*ratios: float, varies: bool = True) -> list[PeriodicSpring]:
    own = [0.1] if varies else []
    return [PeriodicSpring(f"s{m}", [1.0], 1.0, ratio, own, []) for m, ratio in enumerate(ratios)]


# Periods


def test_an_idlers_two_meshes_are_one_phase() -> None:
    """977 rpm · 20 teeth = 325.667 Hz, worked out from either gear: the last digits differ."""
    first = 977.0 / 60.0 * 20.0
    second = math.nextafter(math.nextafter(first, math.inf), math.inf)
    assert first != second
    assert common_periods(springs(first, second)) == ((0, 1),)
    found = lattice(springs(first, second))
    assert found.n_phases == 1
    assert found.steps.tolist() == [[1], [1]]
    assert found.points.ravel().tolist() == list(range(11))


def test_ratios_of_small_integers() -> None:
    """30 : 20 : 70 as 3 : 2 : 7, with steps of 10 a turn; 13 stands apart."""
    own = springs(30.0, 20.0, 13.0, 70.0)
    assert common_periods(own) == ((0, 1, 3), (2,))
    found = lattice(own, harmonics=2, combinations=0)
    assert found.fundamentals == pytest.approx([10.0, 13.0])
    assert found.steps.tolist() == [[3, 0], [2, 0], [0, 1], [7, 0]]
    assert found.orders == pytest.approx([0, 13, 20, 26, 30, 40, 60, 70, 140])
    assert found.harmonic(0, 2) == 6
    with pytest.raises(FbsError, match="no line is harmonic 3 of spring 0"):
        found.harmonic(0, 3)


def test_a_chain_of_quotients() -> None:
    """9 : 10 and 10 : 7 share a period, and with it 9 : 7; the greatest common ratio is 1."""
    assert lattice(springs(9.0, 10.0, 7.0), 1, 0).steps.ravel().tolist() == [9, 10, 7]
    assert lattice(springs(12.0, 18.0), 1, 0).fundamentals == pytest.approx([6.0])


@pytest.mark.parametrize(("off", "groups"), [(1e-12, 1), (1e-6, 2)])
def test_how_near_is_the_same(off: float, groups: int) -> None:
    assert len(common_periods(springs(2.0, 3.0 * (1 + off)))) == groups


def test_springs_that_do_not_vary_are_in_no_group() -> None:
    own = [*springs(1.0), *springs(1.5, varies=False), *springs(1.0)]
    assert common_periods(own) == ((0, 2),)
    assert lattice(own).steps.tolist() == [[1], [0], [1]]
    with pytest.raises(FbsError, match="line is harmonic 1 of spring 1"):
        lattice(own).harmonic(1, 1)


def test_the_hyperbolic_cross() -> None:
    """H = 3, P = 2: axes to 3, (1, 1), (1, 2) and (2, 1); of ±h the one with h·f > 0."""
    found = lattice(springs(1.0, 1.618), harmonics=3, combinations=2)
    points = {tuple(point) for point in found.points.tolist()}
    both = {h for h in product((-2, -1, 1, 2), repeat=2) if abs(h[0]) + abs(h[1]) <= 3}
    axes = {(h, 0) for h in range(-3, 4)} | {(0, h) for h in range(-3, 4)}
    assert points | {(-a, -b) for a, b in points} == both | axes
    assert len(points) == (len(both | axes) + 1) // 2
    assert found.orders[0] == 0.0
    assert np.all(np.diff(found.orders) > 0.0)


@pytest.mark.parametrize("n", [2, 3, 8])
def test_few_combinations_of_many_periods(n: int) -> None:
    """P = 3: of three periods (1, ±1, ±1) alone, of four none, however many there are."""
    found = lattice(springs(*np.sqrt([2, 3, 5, 7, 11, 13, 17, 19])[:n]), harmonics=1)
    at_once = np.count_nonzero(found.points, axis=1)
    assert np.sum(at_once == 1) == n
    # (1, 1), (1, 2), (1, 3), (2, 1), (3, 1), and with a minus sign.
    assert np.sum(at_once == 2) == 10 * math.comb(n, 2)
    assert np.sum(at_once == 3) == 4 * math.comb(n, 3)
    assert np.sum(at_once > 3) == 0


def test_what_a_spring_must_be() -> None:
    with pytest.raises(FbsError, match="'s': stiffness = 0: must be positive"):
        PeriodicSpring("s", [1.0], 0.0, 1.0, [], [])
    with pytest.raises(FbsError, match="'s': ratio = -1: must be positive"):
        PeriodicSpring("s", [1.0], 1.0, -1.0, [], [])
    with pytest.raises(NonFiniteError, match="'s': error is not finite"):
        PeriodicSpring("s", [1.0], 1.0, 1.0, [], [np.nan])
    with pytest.raises(NonFiniteError, match="'s': static_force must be finite, got inf"):
        PeriodicSpring("s", [1.0], 1.0, 1.0, [], [], 0.0, np.inf)
    with pytest.raises(FbsError, match=r"'s': vector has shape \(1, 1\): must be a vector"):
        PeriodicSpring("s", [[1.0]], 1.0, 1.0, [], [])
    with pytest.raises(FbsError, match="combinations = -1"):
        lattice(springs(1.0), combinations=-1)


# In time


def one_phase(count: int) -> Lattice:
    return lattice(springs(1.0), harmonics=count)


def test_a_waveform_is_the_sum_of_its_lines() -> None:
    """1 + 2 cos(θ + 90°) + 3 cos 2θ at θ = 0, 1/4 turn."""
    lines = np.array([[[1.0], [2.0j], [3.0]]])
    assert waveform(lines, one_phase(2), [0.0, 0.25])[0, :, 0] == pytest.approx([4.0, -4.0])


def test_extremes_of_a_known_signal() -> None:
    """cos θ + cos 2θ: 2 at 0, −9/8 where cos θ = −1/4; and a mean alone."""
    lines = np.array([[[0.0, 5.0], [1.0, 0.0], [1.0, 0.0]]])
    found = extremes(lines, one_phase(2))
    assert found.largest[0] == pytest.approx([2.0, 5.0], rel=1e-14)
    assert found.smallest[0] == pytest.approx([-9 / 8, 5.0], rel=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_extremes_against_a_fine_grid(seed: int) -> None:
    """Of 20 000 points; the grid misses ½ (10 · π/20 000)² of the curvature, 1e-6."""
    rng = np.random.default_rng(seed)
    lines = rng.standard_normal((2, 11, 3)) + 1j * rng.standard_normal((2, 11, 3))
    lines[:, 0] = lines[:, 0].real
    found = extremes(lines, one_phase(10))
    values = waveform(lines, one_phase(10), np.arange(20000) / 20000)
    for own, grid in ((found.largest, values.max(1)), (found.smallest, values.min(1))):
        np.testing.assert_allclose(own, grid, atol=1e-4)
    assert np.all(found.largest >= values.max(1) - 1e-12)
    assert np.all(found.smallest <= values.min(1) + 1e-12)


def test_extremes_of_a_sum_of_phases_are_sums() -> None:
    """Independent phases: each reaches its own extreme, at some time together."""
    rng = np.random.default_rng(3)
    both = lattice(springs(1.0, 1.618, 2.23), harmonics=4, combinations=3)
    lines = np.zeros((1, len(both.points), 1), dtype=complex)
    expected = np.zeros(2)
    for axis in range(3):
        alone = np.zeros((1, 5, 1), dtype=complex)
        for order in range(1, 5):
            line = both.harmonic(axis, order)
            lines[0, line, 0] = alone[0, order, 0] = rng.standard_normal() + 1j
        one = extremes(alone, one_phase(4))
        expected += [one.largest[0, 0], one.smallest[0, 0]]
    found = extremes(lines, both)
    assert [found.largest[0, 0], found.smallest[0, 0]] == pytest.approx(expected, rel=1e-12)


def test_combinations_count_in_extremes() -> None:
    """(2 + cos a)(cos b) + …: at most 3, where a and b are 0, which no single phase shows."""
    both = lattice(springs(1.0, 1.618), harmonics=1, combinations=1)
    lines: Any = np.zeros((1, len(both.points), 1), dtype=complex)
    lines[0, both.harmonic(1, 1), 0] = 2.0
    for point in ([1, 1], [-1, 1]):
        lines[0, both.points.tolist().index(point), 0] = 0.5
    found = extremes(lines, both)
    assert found.largest[0, 0] == pytest.approx(3.0, rel=1e-12)
    assert found.smallest[0, 0] == pytest.approx(-3.0, rel=1e-12)


def test_lines_that_are_not_the_lattices() -> None:
    with pytest.raises(FbsError, match=r"lines have shape \(1, 2, 1\): must be \(n_speed, 3,"):
        extremes(np.zeros((1, 2, 1), dtype=complex), one_phase(2))

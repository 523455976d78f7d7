"""Condensation in its two senses, each against a model that shares no formula with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    AmbiguousDofError,
    FbsError,
    Frf,
    SecondOrderSystem,
    SingularLineError,
    UnknownDofError,
    direct_frf,
    frequency_axis,
    real_modes,
)
from fbs.condensation import (
    block_dofs,
    condense_blocked,
    condense_dynamic_stiffness,
    condense_free,
)
from tests.fbs.fbs_systems import hub_system, random_system, scaled_error, spring_matrices, unit

AXIS = frequency_axis(100, 4000, 20)


def damped(rng: np.random.Generator) -> Any:
    return rng.uniform(1e-7, 1e-5)


def two_masses() -> Any:
    """Ground - k - m1 - k - m2, with k = 4e6 N/m, m1 = 1 kg, m2 = 2 kg, undamped."""
    stiffness = np.array([[8e6, -4e6], [-4e6, 4e6]])
    return SecondOrderSystem(np.diag([1.0, 2.0]), np.zeros((2, 2)), stiffness, ("m1", "m2"))


def loss(whole: Any, condensed: Any) -> Any:
    """By how much H_MM - H_MS H_SS^-1 H_SM cancels, per line (at least 1)."""
    row = np.linalg.norm(condensed.values, axis=2)
    part = whole.select(condensed.responses, condensed.excitations).values
    ratio = np.abs(part) / np.sqrt(row[:, :, None] * row[:, None, :])
    return np.maximum(1.0, ratio.max(axis=(1, 2)))


def split(rng: np.random.Generator, labels: Any) -> Any:
    """Masters and slaves at random, neither empty, in a random order."""
    shuffled = [str(label) for label in rng.permutation(labels)]
    m = int(rng.integers(1, len(labels)))
    return shuffled[:m], shuffled[m:]


def test_two_masses_in_closed_form() -> None:
    system, w = two_masses(), 2 * np.pi * AXIS
    frf = direct_frf(system, AXIS)
    blocked = condense_blocked(frf, ["m1"]).values[:, 0, 0]
    np.testing.assert_allclose(blocked, 1 / (8e6 - w**2), rtol=1e-11)  # m1 between two springs
    free = condense_free(frf, ["m1"]).values[:, 0, 0]
    reduced = 8e6 - w**2 - 4e6**2 / (4e6 - 2 * w**2)
    np.testing.assert_allclose(free, 1 / reduced, rtol=1e-11)
    stiffness = condense_dynamic_stiffness(system, AXIS, ["m1"]).values[:, 0, 0]
    np.testing.assert_allclose(stiffness, reduced, rtol=1e-11)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 12))
def test_blocked_is_the_system_with_locked_coordinates(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, beta=damped)
    masters, slaves = split(rng, system.dofs)
    frf = direct_frf(system, AXIS)
    blocked = condense_blocked(frf, masters)
    locked = direct_frf(block_dofs(system, slaves), AXIS, masters, masters)
    assert blocked.responses == blocked.excitations == tuple(masters)
    error = scaled_error(blocked, locked)
    assert (error <= 1e-11 * loss(frf, locked)).all()
    assert np.median(error) < 1e-12


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 12))
def test_free_is_the_inverse_of_the_condensed_dynamic_stiffness(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, grounded=bool(rng.integers(2)), beta=damped)
    masters, _ = split(rng, system.dofs)
    free = condense_free(direct_frf(system, AXIS), masters)
    stiffness = condense_dynamic_stiffness(system, AXIS, masters).values
    assert stiffness.shape == (AXIS.size, len(masters), len(masters))
    error = scaled_error(np.linalg.inv(stiffness), free)
    assert error.max() < 1e-8  # near a lightly damped resonance both are ill-conditioned
    assert np.median(error) < 1e-12


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 12))
def test_blocking_in_two_steps_is_blocking_at_once(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, beta=damped)
    frf = direct_frf(system, AXIS)
    order = [str(label) for label in rng.permutation(system.dofs)]
    m = int(rng.integers(1, n - 1))
    between = condense_blocked(frf, order[: int(rng.integers(m + 1, n))])
    twice, once = condense_blocked(between, order[:m]), condense_blocked(frf, order[:m])
    bound = loss(frf, between) * np.maximum(loss(between, once), loss(frf, once))
    assert (scaled_error(twice, once) <= 1e-11 * bound).all()
    assert np.median(scaled_error(twice, once)) < 1e-12


def test_rows_and_columns_keep_their_places_without_symmetry() -> None:
    rng = np.random.default_rng(7)
    n = 6
    matrices = (
        np.diag(rng.uniform(1, 3, n)),
        rng.normal(size=(n, n)) * 30 + np.diag(np.full(n, 1e3)),
        rng.normal(size=(n, n)) * 1e7 + np.diag(np.full(n, 2e8)),
    )
    system = SecondOrderSystem(*matrices, tuple("abcdef"))
    frf, masters = direct_frf(system, AXIS), ["e", "a", "d"]
    locked = direct_frf(block_dofs(system, ["b", "c", "f"]), AXIS, masters, masters)
    assert scaled_error(condense_blocked(frf, masters), locked).max() < 1e-11
    stiffness = condense_dynamic_stiffness(system, AXIS, masters).values
    free = condense_free(frf, masters)
    assert scaled_error(np.linalg.inv(stiffness), free).max() < 1e-11


def test_responses_and_excitations_may_be_ordered_differently() -> None:
    system = random_system(np.random.default_rng(3), 5, beta=damped)
    frf = direct_frf(system, AXIS)
    turned = frf.select(frf.responses[::-1], frf.excitations)
    one, two = condense_blocked(frf, ["x3", "x1"]), condense_blocked(turned, ["x3", "x1"])
    assert scaled_error(two, one).max() < 1e-10


@pytest.mark.parametrize("quantity", ["mobility", "accelerance"])
def test_blocked_mobility_is_the_mobility_of_the_blocked(quantity: str) -> None:
    system = random_system(np.random.default_rng(5), 6, beta=damped)
    frf = direct_frf(system, AXIS)
    one = condense_blocked(frf.to(quantity), ["x0", "x4"])
    two = condense_blocked(frf, ["x0", "x4"]).to(quantity)
    assert one.quantity == quantity
    assert scaled_error(one, two).max() < 1e-10


def test_natural_frequencies_of_the_blocked_system_are_the_peaks() -> None:
    system = random_system(np.random.default_rng(11), 8)
    slaves = ["x1", "x4", "x6"]
    locked = block_dofs(system, slaves)
    natural = real_modes(locked).natural_frequencies
    for frequency in natural:
        axis = frequency * (1 + np.linspace(-5e-4, 5e-4, 100))  # the line itself would be singular
        blocked = condense_blocked(direct_frf(system, axis), locked.dofs)
        peak = axis[np.argmax(np.abs(blocked.values).sum(axis=(1, 2)))]
        assert abs(peak / frequency - 1) < 1e-5
    free = condense_free(direct_frf(system, natural * (1 + 1e-6)), locked.dofs)
    whole = direct_frf(system, natural * (1 + 1e-2)).select(locked.dofs, locked.dofs)
    assert np.abs(free.values).max() < 1e2 * np.abs(whole.values).max()


def test_a_hub_beside_heavy_bodies_is_no_reason_to_refuse() -> None:
    system = hub_system(2, grounded=True, beta=damped)
    frf = direct_frf(system, AXIS)
    masters = system.dofs[3:7]
    locked = direct_frf(block_dofs(system, [d for d in system.dofs if d not in masters]), AXIS)
    blocked = condense_blocked(frf, masters)
    assert (scaled_error(blocked, locked) <= 1e-11 * loss(frf, locked)).all()


def test_units_of_the_slaves_do_not_matter() -> None:
    system = random_system(np.random.default_rng(9), 6, beta=damped)
    scale = 10.0 ** np.array([0, 0, -9, 6, 0, 9])
    frf = direct_frf(system, AXIS)
    values = frf.values * np.outer(scale, scale)
    scaled = Frf(AXIS, values, frf.responses, frf.excitations)
    one, two = (condense_blocked(h, ["x0", "x1"]) for h in (frf, scaled))
    assert scaled_error(two, one).max() < 1e-10


def chain_through_one_coordinate() -> Any:
    """a0 - a1 - c - b0 - b1, both ends grounded: c alone joins a and b."""
    springs = [(unit(5, (i, 1.0), (i + 1, -1.0)), 1e8, 300.0) for i in range(4)]
    springs += [(unit(5, (0, 1.0)), 1e8, 100.0), (unit(5, (4, 1.0)), 2e8, 0.0)]
    stiffness, damping = spring_matrices(5, springs)
    mass = np.diag([1.0, 2.0, 0.5, 3.0, 1.0])
    return SecondOrderSystem(mass, damping, stiffness, ("a0", "a1", "c", "b0", "b1"))


def test_equation_21_holds_for_the_dynamic_stiffness_and_not_for_the_receptance() -> None:
    system, a, c, b = chain_through_one_coordinate(), [0, 1], [2], [3, 4]
    frf = direct_frf(system, AXIS)

    def printed(x: Any) -> Any:
        def part(i: Any, j: Any) -> Any:
            return x[:, i][:, :, j]

        kernel = part(c, c) - part(c, b) @ np.linalg.inv(part(b, b)) @ part(b, c)
        return part(a, a) - part(a, c) @ np.linalg.inv(kernel) @ part(c, a)

    of_a = condense_blocked(frf, ["a0", "a1"])
    hub_locked = block_dofs(system, ["c"])  # b is then out of reach and need not be locked
    locked = direct_frf(hub_locked, AXIS, ["a0", "a1"], ["a0", "a1"])
    assert scaled_error(of_a, locked).max() < 1e-11
    assert scaled_error(printed(frf.values), locked).max() > 1
    stiffness = printed(np.linalg.inv(frf.values))
    assert scaled_error(np.linalg.inv(stiffness), condense_free(frf, ["a0", "a1"])).max() < 1e-10


def test_all_masters_change_nothing() -> None:
    system = random_system(np.random.default_rng(4), 4, beta=damped)
    frf, order = direct_frf(system, AXIS), ["x2", "x0", "x3", "x1"]
    np.testing.assert_array_equal(
        condense_blocked(frf, order).values, frf.select(order, order).values
    )
    stiffness = condense_dynamic_stiffness(system, AXIS, order).values
    error = scaled_error(np.linalg.inv(stiffness), condense_free(frf, order))
    assert (error < 1e-9).all()


def test_blocked_lines_without_a_digit_are_named() -> None:
    frf = direct_frf(two_masses(), [50.0, np.sqrt(8e6) / (2 * np.pi), 700.0])
    # m1 between its springs has its pole where the drive point of m2 vanishes
    with pytest.raises(SingularLineError, match="H_SS is singular") as caught:
        condense_blocked(frf, ["m1"])
    np.testing.assert_allclose(caught.value.frequencies, [450.158158], rtol=1e-8)


def test_dynamic_stiffness_lines_without_a_digit_are_named() -> None:
    axis = [50.0, np.sqrt(2e6) / (2 * np.pi), 700.0]  # m2 on its spring, m1 blocked
    with pytest.raises(SingularLineError, match="Z_SS is singular") as caught:
        condense_dynamic_stiffness(two_masses(), axis, ["m1"])
    np.testing.assert_allclose(caught.value.frequencies, [225.079079], rtol=1e-8)


def test_a_vanishing_drive_point_of_a_master_is_no_singular_line() -> None:
    antiresonance = np.sqrt(8e6) / (2 * np.pi)
    blocked = condense_blocked(direct_frf(two_masses(), [antiresonance]), ["m2"])
    expected = 1 / (4e6 - 2 * 8e6)  # m2 on its spring, m1 blocked
    np.testing.assert_allclose(blocked.values[0, 0, 0], expected, rtol=1e-9)


def test_slaves_that_move_as_one_are_refused() -> None:
    rng = np.random.default_rng(6)
    system = random_system(rng, 4, beta=damped, derived={"hub": ("x1", 0.7)})
    frf = direct_frf(system, AXIS)
    with pytest.raises(SingularLineError, match="move as one") as caught:
        condense_blocked(frf, ["x0", "x2"])
    assert caught.value.frequencies.size == AXIS.size


def test_mobilities_at_zero_hertz_are_refused() -> None:
    frf = direct_frf(random_system(np.random.default_rng(8), 3, beta=damped), [0.0, 10.0])
    with pytest.raises(SingularLineError, match=r"1 line \(0 Hz\)"):
        condense_blocked(frf.to("mobility"), ["x0"])


def test_derived_labels_scale_the_condensed_dynamic_stiffness() -> None:
    rng = np.random.default_rng(12)
    system = random_system(rng, 4, beta=damped, derived={"hub": ("x1", 0.7)})
    free = condense_free(direct_frf(system, AXIS), ["hub", "x3"])
    stiffness = condense_dynamic_stiffness(system, AXIS, ["hub", "x3"]).values
    assert scaled_error(np.linalg.inv(stiffness), free).max() < 1e-9
    with pytest.raises(AmbiguousDofError, match="'x1' and 'hub' are one motion"):
        condense_dynamic_stiffness(system, AXIS, ["x1", "hub"])


def test_blocking_drops_the_derived_labels_of_a_locked_coordinate() -> None:
    rng = np.random.default_rng(13)
    derived = {"hub": ("x1", 0.7), "shaft": ("x2", 2.0)}
    system = random_system(rng, 4, derived=derived)
    by_coordinate, by_label = block_dofs(system, ["x1"]), block_dofs(system, ["hub"])
    for locked in (by_coordinate, by_label):
        assert locked.labels == ("x0", "x2", "x3", "shaft")
        np.testing.assert_array_equal(locked.stiffness, by_coordinate.stiffness)
    np.testing.assert_array_equal(by_coordinate.mass, np.diag(np.diag(system.mass)[[0, 2, 3]]))


def test_blocking_everything_is_refused() -> None:
    with pytest.raises(FbsError, match="nothing is left to move"):
        block_dofs(two_masses(), ["m1", "m2"])


@pytest.mark.parametrize("condense", [condense_blocked, condense_free])
def test_unknown_and_missing_masters_are_named(condense: Any) -> None:
    frf = direct_frf(two_masses(), AXIS)
    with pytest.raises(UnknownDofError, match="'m3'"):
        condense(frf, ["m1", "m3"])
    with pytest.raises(AmbiguousDofError, match="'m1' more than once"):
        condense(frf, ["m1", "m1"])
    with pytest.raises(FbsError, match="no masters"):
        condense(frf, [])
    with pytest.raises(FbsError, match="masters must be a sequence, in order, got 'm1'"):
        condense(frf, "m1")


def test_unknown_labels_of_a_system_are_named() -> None:
    with pytest.raises(UnknownDofError, match="'m3'"):
        condense_dynamic_stiffness(two_masses(), AXIS, ["m3"])
    with pytest.raises(UnknownDofError, match="'m3'"):
        block_dofs(two_masses(), ["m3"])


def test_every_label_must_be_response_and_excitation() -> None:
    frf = direct_frf(two_masses(), AXIS)
    with pytest.raises(UnknownDofError, match="'m2' is no excitation"):
        condense_blocked(frf.select(excitations=["m1"]), ["m1"])
    with pytest.raises(UnknownDofError, match="'m1' is no response"):
        condense_blocked(frf.select(responses=["m2"]), ["m1"])

"""Direct FRFs against closed forms and physics."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import (
    AmbiguousDofError,
    FbsError,
    NonFiniteError,
    SecondOrderSystem,
    SingularLineError,
    UnknownDofError,
    direct_frf,
    frequency_axis,
    real_modes,
)
from tests.fbs.fbs_systems import hub_system, long_double_frf, random_system, scaled_error


def one_dof(m: float = 2.0, c: float = 0.0, k: float = 8e6) -> Any:
    return SecondOrderSystem([[m]], [[c]], [[k]], ("x",))


def test_one_dof_closed_form() -> None:
    axis = frequency_axis(0, 2000, 10)
    w = 2 * np.pi * axis
    # a handful of roundings; w^2 m and k cancel by a factor of at most 20 on this axis
    expected = 1 / (8e6 - w**2 * 2 + 1j * w * 50)
    assert np.allclose(direct_frf(one_dof(c=50), axis).values[:, 0, 0], expected, rtol=1e-14)


def test_one_dof_with_a_loss_factor() -> None:
    axis = frequency_axis(0, 2000, 10)
    w = 2 * np.pi * axis
    system = replace(one_dof(c=50), loss_factor=0.02)
    expected = 1 / (8e6 * (1 + 0.02j) - w**2 * 2 + 1j * w * 50)
    # as above: the closed form and the solver round a few times each
    assert np.allclose(direct_frf(system, axis).values[:, 0, 0], expected, rtol=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 10), st.floats(1e-4, 1.0), st.booleans())
def test_a_loss_factor_is_a_damper_that_weakens_with_frequency(
    seed: int, n: int, eta: Any, damped: Any
) -> None:
    # j eta K = j w C with C = eta K / w, one line at a time
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, beta=lambda rng: rng.uniform(0, 1e-5) if damped else 0.0)
    lossy = replace(system, loss_factor=eta)
    assert not lossy.undamped
    for line in rng.uniform(1, 5000, 3):
        damping = system.damping + eta * system.stiffness / (2 * np.pi * line)
        error = scaled_error(
            direct_frf(lossy, [line]), direct_frf(replace(system, damping=damping), [line])
        )
        # eps times the condition of Z, which grows towards a pole as 1 / eta
        assert error.max() < 1e-9


def test_a_lossy_system_near_a_massless_hub_against_extended_precision() -> None:
    system = replace(hub_system(1, n=15, grounded=True), loss_factor=0.01)
    for line in (1.0, 50.0, 15000.0):
        error = scaled_error(direct_frf(system, [line]).values[0], long_double_frf(system, line))
        assert error < 1e-10  # eps cond(Z)


def test_the_loss_factor_is_checked_and_kept() -> None:
    system = random_system(np.random.default_rng(0), 3, derived={"hub": ("x1", 2.0)})
    assert system.loss_factor == 0.0
    assert system.undamped
    lossy = replace(system, loss_factor=1)
    assert lossy.loss_factor == 1.0
    assert pickle.loads(pickle.dumps(lossy)).loss_factor == 1.0
    with pytest.raises(FbsError, match=r"loss factor must be at least 0, got -0\.01"):
        replace(system, loss_factor=-0.01)
    for value in (np.nan, np.inf):
        with pytest.raises(NonFiniteError, match="loss factor must be finite"):
            replace(system, loss_factor=value)
    with pytest.raises(SingularLineError, match=r"\(0 Hz\)"):  # a loss factor resists no motion
        direct_frf(
            replace(random_system(np.random.default_rng(1), 4, grounded=False), loss_factor=0.1),
            [0.0, 10.0],
        )


def test_two_dof_closed_form() -> None:
    m1, m2, k1, k2 = 1.0, 3.0, 1e6, 4e6
    system = SecondOrderSystem(
        np.diag([m1, m2]), np.zeros((2, 2)), [[k1 + k2, -k2], [-k2, k2]], ("a", "b")
    )
    axis = frequency_axis(0, 1000, 20)
    w2 = (2 * np.pi * axis) ** 2
    a, d = k1 + k2 - w2 * m1, k2 - w2 * m2
    expected = np.array([[d, np.full_like(d, k2)], [np.full_like(d, k2), a]]) / (a * d - k2**2)
    # the determinant of the closed form cancels too: 1e-12 is 1e4 roundings
    assert np.allclose(direct_frf(system, axis).values, expected.transpose(2, 0, 1), rtol=1e-12)


def test_free_free_pair_of_masses() -> None:
    m, k = 2.0, 5e6
    system = SecondOrderSystem(np.diag([m, m]), np.zeros((2, 2)), [[k, -k], [-k, k]], ("a", "b"))
    axis = frequency_axis(5, 1000, 5)
    w2 = (2 * np.pi * axis) ** 2
    rigid, elastic = -1 / (2 * m * w2), 0.5 / (2 * k - w2 * m)
    frf = direct_frf(system, axis)
    # K - w^2 M has condition k / (w^2 m) = 2.5e3 at 5 Hz
    assert np.allclose(frf.between("a", "a"), rigid + elastic, rtol=1e-11)
    assert np.allclose(frf.between("a", "b"), rigid - elastic, rtol=1e-11)


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_a_nonsymmetric_matrix_proves_the_index_order(damping: float) -> None:
    # f_b acts on equation b; u_a = K^-1[a, b] f_b and K^-1[b, a] = 0
    stiffness = np.array([[2.0, 1.0], [0.0, 4.0]])
    system = SecondOrderSystem(np.zeros((2, 2)), damping * np.eye(2), stiffness, ("a", "b"))
    frf = direct_frf(system, [0.0])
    assert frf.between("a", "b")[0] == pytest.approx(-1 / 8)
    assert frf.between("b", "a")[0] == 0
    # one response, two excitations: solved by the transpose
    row = direct_frf(system, [0.0], responses=["a"])
    assert row.values[0, 0] == pytest.approx(frf.values[0, 0])
    column = direct_frf(system, [0.0], excitations=["b"])
    assert column.values[0, :, 0] == pytest.approx(frf.values[0, :, 1])


@pytest.mark.parametrize("beta", [0.0, 1e-6])
@pytest.mark.parametrize(
    ("responses", "excitations"),
    [(None, None), (["x3"], None), (None, ["x1", "x4"]), (["x2", "hub"], ["x2", "x0", "x5"])],
)
def test_parts_and_blocks_agree_with_the_whole(
    beta: float, responses: list[str] | None, excitations: list[str] | None
) -> None:
    rng = np.random.default_rng(1)
    system = random_system(rng, 6, beta=lambda rng: beta, derived={"hub": ("x2", 1.5)})
    axis = frequency_axis(10, 3000, 10)
    whole = direct_frf(system, axis).select(responses, excitations)
    for block in (1, 7, 64, 1000):
        part = direct_frf(system, axis, responses, excitations, block=block)
        assert part.responses == whole.responses
        # no line is closer than 1e-4 to a pole, so 1e-10 leaves 1e2 for the rest
        assert np.allclose(part.values, whole.values, rtol=1e-10, atol=1e-22)
        assert part.values.strides[0] == 16  # frequency-contiguous


def test_derived_labels_are_a_factor_times_their_dof() -> None:
    rng = np.random.default_rng(2)
    system = random_system(rng, 3, derived={"hub": ("x1", -2.0)})
    frf = direct_frf(system, [100.0])
    assert system.labels == ("x0", "x1", "x2", "hub")
    assert frf.between("hub", "x0")[0] == -2 * frf.between("x1", "x0")[0]
    assert frf.between("x0", "hub")[0] == -2 * frf.between("x0", "x1")[0]
    assert frf.between("hub", "hub")[0] == 4 * frf.between("x1", "x1")[0]


def test_quantities() -> None:
    axis = [10.0, 20.0]
    system = random_system(np.random.default_rng(3), 3)
    receptance = direct_frf(system, axis)
    for quantity in ("mobility", "accelerance"):
        frf = direct_frf(system, axis, quantity=quantity)
        assert frf.quantity == quantity
        assert np.allclose(frf.values, receptance.to(quantity).values, rtol=1e-15, atol=0)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.booleans())
def test_reciprocity_and_passivity(seed: int, n: int, grounded: Any) -> None:
    system = random_system(
        np.random.default_rng(seed), n, grounded=grounded, beta=lambda rng: rng.uniform(0, 1e-5)
    )
    mobility = direct_frf(system, frequency_axis(50, 15000, 50), quantity="mobility")
    assert scaled_error(mobility.values, mobility.values.transpose(0, 2, 1)).max() < 1e-10
    # Re v/f is power taken in: round-off of |Y| may make it slightly negative where nothing damps
    diagonal = np.einsum("kii->ki", mobility.values)
    assert (diagonal.real >= -1e-12 * np.abs(diagonal)).all()


@pytest.mark.parametrize("beta", [0.0, 1e-6])
def test_near_massless_hub_against_extended_precision(beta: float) -> None:
    system = hub_system(0, grounded=True, beta=lambda rng: beta)
    for line in (1.0, 100.0, 15000.0):
        reference = long_double_frf(system, line)
        # scaled condition of a grounded chain is below 1e3
        assert scaled_error(direct_frf(system, [line]).values[0], reference) < 1e-12


@pytest.mark.parametrize("damped", [False, True])
def test_a_free_system_is_singular_at_zero_hertz(damped: bool) -> None:
    for seed in range(10):
        system = random_system(
            np.random.default_rng(seed), 7, grounded=False, beta=lambda rng: 1e-6 * damped
        )
        with pytest.raises(SingularLineError, match=r"1 line \(0 Hz\)") as caught:
            direct_frf(system, frequency_axis(0, 100, 10))
        assert caught.value.frequencies.tolist() == [0.0]
        assert pickle.loads(pickle.dumps(caught.value)).frequencies.tolist() == [0.0]


def test_an_exactly_singular_matrix_is_found_per_line() -> None:
    system = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), np.diag([0.0, 1e6]), ("a", "b"))
    with pytest.raises(SingularLineError) as caught:
        direct_frf(system, frequency_axis(0, 50, 10))
    assert caught.value.frequencies.tolist() == [0.0]


def test_lines_on_a_pole_are_singular_and_lines_near_it_are_not() -> None:
    system = random_system(np.random.default_rng(4), 12)
    natural = real_modes(system).natural_frequencies
    with pytest.raises(SingularLineError) as caught:
        direct_frf(system, np.concatenate([[natural[0] / 2], natural[:6]]))
    # six lines meant to be poles; a pole rounds to within a few eps, and most are caught
    assert set(caught.value.frequencies) <= set(natural)
    assert caught.value.frequencies.size >= 1
    for distance in (1e-3, 1e-6, 1e-9):
        direct_frf(system, natural * (1 + distance))


def test_bad_systems_are_refused_by_name() -> None:
    eye, zero = np.eye(2), np.zeros((2, 2))
    with pytest.raises(FbsError, match=r"mass matrix has shape \(1, 1\)"):
        SecondOrderSystem([[1.0]], zero, eye, ("a", "b"))
    with pytest.raises(NonFiniteError, match="damping matrix holds nan"):
        SecondOrderSystem(eye, zero * np.nan, eye, ("a", "b"))
    with pytest.raises(FbsError, match="stiffness matrix must be real"):
        SecondOrderSystem(eye, zero, eye * 1j, ("a", "b"))
    with pytest.raises(AmbiguousDofError, match="'a' more than once"):
        SecondOrderSystem(eye, zero, eye, ("a", "a"))
    with pytest.raises(AmbiguousDofError, match="derived labels name 'b' more than once"):
        SecondOrderSystem(eye, zero, eye, ("a", "b"), {"b": ("a", 1.0)})
    with pytest.raises(UnknownDofError, match="derived label 'hub'"):
        SecondOrderSystem(eye, zero, eye, ("a", "b"), {"hub": ("c", 1.0)})
    with pytest.raises(FbsError, match="finite factor"):
        SecondOrderSystem(eye, zero, eye, ("a", "b"), {"hub": ("a", 0.0)})
    with pytest.raises(FbsError, match="at least one"):
        SecondOrderSystem(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0)), ())
    with pytest.raises(UnknownDofError, match="did you mean 'x0'"):
        direct_frf(random_system(np.random.default_rng(0), 1), [1.0], responses=["x9"])
    with pytest.raises(FbsError, match="block"):
        direct_frf(one_dof(), [1.0], block=0)


def test_systems_travel_between_processes() -> None:
    system = random_system(np.random.default_rng(0), 2, derived={"hub": ("x0", 2.0)})
    copy = pickle.loads(pickle.dumps(system))
    assert np.array_equal(copy.stiffness, system.stiffness)
    assert dict(copy.derived) == {"hub": ("x0", 2.0)}

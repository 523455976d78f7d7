"""Modes and modal FRFs: accuracy next to a hub of 2e-8 kg, rigid bodies, repeated modes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from fbs import (
    AxisMismatchError,
    DefectiveModesError,
    FbsError,
    IndefiniteMassError,
    IndefiniteStiffnessError,
    SecondOrderSystem,
    SingularLineError,
    complex_modes,
    direct_frf,
    frequency_axis,
    modal_frf,
    poles,
    real_modes,
)
from tests.fbs.fbs_systems import (
    HUB_MASS,
    HUB_STIFFNESS,
    hub_system,
    long_double_frf,
    random_system,
    scaled_error,
)

AXIS = frequency_axis(1, 15000, 1)
DAMPING = {
    "undamped": lambda rng: 0.0,
    "proportional": lambda rng: 1e-6,
    "general": lambda rng: rng.uniform(1e-7, 4e-6),
    "light": lambda rng: rng.uniform(1e-10, 4e-9),
    "heavy": lambda rng: rng.uniform(1e-5, 4e-4),
}


def reordered(system: SecondOrderSystem, order: list[int]) -> SecondOrderSystem:
    m, c, k = (m[np.ix_(order, order)] for m in (system.mass, system.damping, system.stiffness))
    return SecondOrderSystem(m, c, k, tuple(system.dofs[i] for i in order))


def diagonal_system(mass: ArrayLike, stiffness: ArrayLike, damping: float = 0.0) -> Any:
    n = np.size(mass)
    return SecondOrderSystem(
        np.diag(mass),
        damping * np.ones((n, n)),
        np.asarray(stiffness, dtype=float),
        tuple(f"x{i}" for i in range(n)),
    )


@pytest.mark.parametrize("grounded", [True, False])
@pytest.mark.parametrize("kind", list(DAMPING))
def test_modal_is_direct_with_a_near_massless_hub(kind: Any, grounded: bool) -> None:
    system = hub_system(3, n=20, grounded=grounded, beta=DAMPING[kind])
    assert real_modes(system).natural_frequencies[-1] > 7e6
    natural = real_modes(system).natural_frequencies
    lines = AXIS
    if kind in ("undamped", "light"):  # a pole's own round-off over the distance to it: 1e-14/1e-5
        distance = np.abs(AXIS[:, None] / natural[natural > 0] - 1).min(axis=1)
        lines = AXIS[distance > 1e-5]
    labels = ["hub", "x1", "x2", "x7", "x19"]  # rows of all DoFs scale the error
    direct = direct_frf(system, lines)
    modal = modal_frf(system, lines)
    # at 1 Hz a free system of 1e9 N/m has condition 1e9 / (w^2 m) = 1e7 in both routes
    assert scaled_error(modal, direct).max() < 1e-8
    part = modal_frf(system, lines[:50], labels, ["hub", "x3"])
    assert np.allclose(
        part.values, modal.band(0, lines[49]).select(labels, ["hub", "x3"]).values, rtol=1e-9
    )


@pytest.mark.parametrize("hub_at", [0, 7, 14])
@pytest.mark.parametrize("kind", list(DAMPING))
def test_modal_against_extended_precision(kind: Any, hub_at: int) -> None:
    order = [*range(1, 15)]
    order.insert(hub_at, 0)
    system = reordered(hub_system(1, n=15, grounded=True, beta=DAMPING[kind]), order)
    natural = real_modes(system).natural_frequencies
    for line in (1.0, 50.0, 15000.0, natural[2] * (1 + 1e-3)):
        error = scaled_error(modal_frf(system, [line]).values[0], long_double_frf(system, line))
        # 1e-14 of the modes, over a distance of 1e-3 to the pole
        assert error < 1e-10


@pytest.mark.parametrize("grounded", [True, False])
@pytest.mark.parametrize("kind", list(DAMPING))
def test_modal_is_direct_with_a_loss_factor(kind: Any, grounded: bool) -> None:
    beta = DAMPING[kind]
    system = replace(hub_system(3, n=20, grounded=grounded, beta=beta), loss_factor=0.01)
    lines = AXIS[::10]
    # free system at 1 Hz: condition 1e7, as without a loss factor
    assert scaled_error(modal_frf(system, lines), direct_frf(system, lines)).max() < 1e-8
    if grounded:
        for line in (1.0, 50.0, 15000.0):
            error = scaled_error(modal_frf(system, [line]).values[0], long_double_frf(system, line))
            assert error < 1e-10


@pytest.mark.parametrize("kind", ["undamped", "proportional"])
def test_poles_with_a_loss_factor(kind: str) -> None:
    system = random_system(np.random.default_rng(21), 6, grounded=False, beta=DAMPING[kind])
    lossy = replace(system, loss_factor=0.3)
    found = poles(lossy)
    assert found.values.size == 6
    assert found.values[0] == 0
    assert (found.values[1:].imag > 0).all()
    assert (found.values[1:].real < 0).all()
    for s in found.values[1:]:
        matrix = s**2 * system.mass + s * system.damping + (1 + 0.3j) * system.stiffness
        singular = np.linalg.svd(matrix, compute_uv=False)
        assert singular[-1] < 1e-12 * singular[0]  # a root, to round-off of the matrix
    every = complex_modes(lossy).poles
    distance = np.abs(found.values[1:, None] - every).min(axis=1)
    assert (distance < 1e-11 * np.abs(every).max()).all()
    if kind == "undamped":
        omega = real_modes(system).angular_frequency[1:]
        assert np.abs(found.values[1:]) == pytest.approx(omega * (1 + 0.09) ** 0.25, rel=1e-13)
        assert found.damping_ratios[1:] == pytest.approx(np.sin(np.arctan(0.3) / 2), rel=1e-13)


def test_an_overdamped_lossy_mode_keeps_both_its_poles() -> None:
    m, c, k = 1.0, 2e4, 200.0 * (1 + 0.5j)
    system = SecondOrderSystem([[m]], [[c]], [[k.real]], ("x",), loss_factor=0.5)
    low, high = poles(system).values
    assert low * high == pytest.approx(k / m, rel=1e-14)
    assert low + high == pytest.approx(-c / m, rel=1e-14)


def test_poles_of_a_loss_factor_and_general_damping_are_refused_by_name() -> None:
    system = random_system(np.random.default_rng(22), 5, beta=DAMPING["general"])
    with pytest.raises(FbsError, match=r"loss factor together with .* not proportional"):
        poles(replace(system, loss_factor=0.01))


def test_plain_eigh_is_what_this_is_better_than() -> None:
    # in this order of DoFs; with the hub first, eigh happens to do well
    system = reordered(hub_system(1, n=15, grounded=True), [*range(1, 15), 0])
    values, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
    reference = long_double_frf(system, 1.0)
    plain = (shapes / (values - (2 * np.pi) ** 2)) @ shapes.T
    assert scaled_error(plain, reference) > 1e-9  # eps * (1e7 Hz / lowest mode)^2
    assert scaled_error(modal_frf(system, [1.0]).values[0], reference) < 1e-13


def test_every_frequency_has_its_own_digits() -> None:
    # a grounded chain of two: w^2 from the quadratic in exact rationals is well known to 1e-15
    m, k, soft = HUB_MASS, HUB_STIFFNESS, 1e5
    system = diagonal_system([m, 1.0], [[k + soft, -k], [-k, k]])
    b, c = (k + soft) / m + k / 1.0, soft * k / (m * 1.0)
    high = (b + np.sqrt(b * b - 4 * c)) / 2
    expected = np.sqrt([c / high, high])  # without cancellation
    # eps cond(scaled K), cond = 2 (k + soft) / soft = 2e3
    assert np.allclose(real_modes(system).angular_frequency, expected, rtol=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.booleans(), st.booleans())
def test_modes_diagonalise_mass_and_stiffness(
    seed: int, n: int, grounded: Any, full_mass: Any
) -> None:
    rng = np.random.default_rng(seed)
    system = random_system(rng, n, grounded=grounded)
    if full_mass:
        spread = rng.standard_normal((n, n))
        system = SecondOrderSystem(
            system.mass + 0.1 * spread @ spread.T, system.damping, system.stiffness, system.dofs
        )
    modes = real_modes(system)
    assert modes.n_rigid == (0 if grounded else 1)
    assert np.allclose(modes.shapes.T @ system.mass @ modes.shapes, np.eye(n), atol=1e-12)
    stiffness = modes.shapes.T @ system.stiffness @ modes.shapes
    w2 = modes.angular_frequency**2
    # K's own round-off: eps * 1e9 N/m per kg
    assert np.allclose(stiffness, np.diag(w2), atol=1e-12 * max(w2.max(initial=0), 1e9))
    assert (np.diff(modes.angular_frequency) >= 0).all()


def test_rigid_body_shapes_are_exact() -> None:
    rngs = [np.random.default_rng(k) for k in range(3)]
    systems = [random_system(rng, 4, f"s{k}", grounded=False) for k, rng in enumerate(rngs)]
    mass, damping, stiffness = (
        scipy.linalg.block_diag(*(getattr(s, name) for s in systems))
        for name in ("mass", "damping", "stiffness")
    )
    system = SecondOrderSystem(mass, damping, stiffness, tuple(d for s in systems for d in s.dofs))
    modes = real_modes(system)
    assert modes.n_rigid == 3
    assert (modes.angular_frequency[:3] == 0).all()
    rigid = modes.shapes[:, :3]
    # round-off of the product itself: n eps |K| |phi|
    assert np.abs(system.stiffness @ rigid).max() <= 12 * 2.2e-16 * np.abs(system.stiffness).max()
    direct = direct_frf(system, AXIS[99::100])
    assert scaled_error(modal_frf(system, AXIS[99::100]), direct).max() < 1e-9


def test_a_rigid_body_that_carries_the_hub_is_exact_at_the_hub() -> None:
    system = hub_system(2)
    rigid = real_modes(system).shapes[:, 0]
    # the hub's row decides: an error of eps / sqrt(m_hub) there would be 1e-12
    assert np.allclose(rigid / rigid[1], 1, rtol=1e-13)


def test_unconnected_dofs_and_nothing_but_rigid_bodies() -> None:
    system = diagonal_system([1.0, 2.0, 4.0], np.diag([0.0, 8e6, 0.0]))
    modes = real_modes(system)
    assert modes.n_rigid == 2
    assert modes.angular_frequency == pytest.approx([0, 0, 2000])
    frf = modal_frf(system, [0.0, 5.0], ["x1"], ["x1", "x0"])  # takes no part in rigid motion
    assert frf.between("x1", "x1")[0] == pytest.approx(1 / 8e6)
    assert (frf.between("x1", "x0") == 0).all()
    loose = diagonal_system([1.0, 2.0], np.zeros((2, 2)))
    assert real_modes(loose).n_rigid == 2
    w2 = (2 * np.pi * 10) ** 2
    assert modal_frf(loose, [10.0]).between("x1", "x1")[0] == pytest.approx(-1 / (2 * w2))
    assert poles(loose).natural_frequencies.tolist() == [0, 0]


def test_repeated_modes() -> None:
    for kind in ("undamped", "proportional", "general"):
        one = random_system(np.random.default_rng(5), 6, beta=DAMPING[kind])
        copies = [np.kron(np.eye(3), m) for m in (one.mass, one.damping, one.stiffness)]
        # an orthogonal mix hides the copies from the solver
        turn = np.linalg.qr(np.random.default_rng(6).standard_normal((3, 3)))[0]
        mix = np.kron(turn, np.eye(6))
        mixed = [mix @ m @ mix.T for m in copies]
        system = SecondOrderSystem(
            copies[0],
            (mixed[1] + mixed[1].T) / 2,
            (mixed[2] + mixed[2].T) / 2,
            tuple(f"x{i}" for i in range(18)),
        )
        lines = AXIS[10::50]
        direct = direct_frf(system, lines)
        assert scaled_error(modal_frf(system, lines), direct).max() < 1e-9
        expected = np.repeat(poles(one).natural_frequencies, 3)
        assert np.allclose(poles(system).natural_frequencies, expected, rtol=1e-11)


@pytest.mark.parametrize("grounded", [True, False])
def test_poles_against_a_general_eigensolver(grounded: bool) -> None:
    system = random_system(
        np.random.default_rng(7), 8, grounded=grounded, beta=lambda rng: rng.uniform(0, 1e-5)
    )
    n = 8
    inverse = np.linalg.inv(system.mass)
    state = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-inverse @ system.stiffness, -inverse @ system.damping],
        ]
    )
    expected = scipy.linalg.eigvals(state)
    expected = expected[expected.imag > 1.0]  # without the rigid body's, which is round-off there
    expected = expected[np.argsort(abs(expected))]
    ours = poles(system)
    elastic = ours.values[ours.values.imag > 0]
    assert ours.values.size == n
    assert (ours.values == 0).sum() == (0 if grounded else 1)
    # the plain state matrix has norm w_max^2: eps w_max^2 / w_min relative
    assert np.allclose(elastic, expected, rtol=1e-8)
    assert np.allclose(ours.damping_ratios[-1], -expected[-1].real / abs(expected[-1]), rtol=1e-6)


def test_damped_rigid_motion_stays_non_defective() -> None:
    # two free bodies; a damper to ground on one of them, none on the other
    system = SecondOrderSystem(
        np.diag([2.0, 3.0, 1.0]),
        np.diag([40.0, 0.0, 0.0]),
        np.array([[5e6, -5e6, 0], [-5e6, 5e6, 0], [0, 0, 0]]),
        ("a", "b", "c"),
    )
    lines = AXIS[:3000:7]
    assert scaled_error(modal_frf(system, lines), direct_frf(system, lines)).max() < 1e-9
    found = poles(system)
    # c: a double zero counts once; a and b: zero, the decay of 5 kg at 40 N s/m, and one pair
    assert found.values.size == 4
    assert found.values[:2].tolist() == [0, 0]
    assert found.values[2].real == pytest.approx(-40 / 5, rel=1e-3)
    assert found.damping_ratios.tolist()[:3] == [0, 0, 1]


def test_skew_damping_is_general_damping() -> None:
    system = random_system(np.random.default_rng(8), 5)
    spin = np.random.default_rng(9).standard_normal((5, 5)) * 100
    gyroscopic = SecondOrderSystem(
        system.mass, spin - spin.T + 10 * np.eye(5), system.stiffness, system.dofs
    )
    lines = AXIS[9::20]
    assert scaled_error(modal_frf(gyroscopic, lines), direct_frf(gyroscopic, lines)).max() < 1e-9


def test_overdamped_pairs_are_two_real_poles() -> None:
    system = SecondOrderSystem([[1.0]], [[2e4 + 0.02]], [[200.0 + 2e-4]], ("x",))
    low, high = poles(system).values
    # (s + 0.01)(s + 2e4 + ...) without cancellation in the small root
    assert low * high == pytest.approx(200.0 + 2e-4, rel=1e-14)
    assert low + high == pytest.approx(-(2e4 + 0.02), rel=1e-14)
    assert poles(system).damping_ratios == pytest.approx([1, 1])


def test_one_dof_critically_damped_is_proportional_and_fine() -> None:
    system = SecondOrderSystem([[1.0]], [[2e3]], [[1e6]], ("x",))
    assert modal_frf(system, [0.0, 100.0]).values == pytest.approx(
        direct_frf(system, [0.0, 100.0]).values, rel=1e-14
    )
    assert poles(system).values.tolist() == [-1000, -1000]


def test_defective_modes_are_named() -> None:
    # modal damping [[2 w, e], [e, 2 w']] with the first mode critical and e -> small coupling
    system = SecondOrderSystem(
        np.eye(2), np.array([[2e3, 1e-3], [1e-3, 10.0]]), np.diag([1e6, 9e6]), ("a", "b")
    )
    with pytest.raises(DefectiveModesError, match=r"159\.15.* Hz\).*use direct_frf"):
        modal_frf(system, [10.0])
    direct_frf(system, [10.0])


def test_singular_lines_are_named() -> None:
    system = random_system(np.random.default_rng(10), 5, grounded=False)
    with pytest.raises(SingularLineError, match=r"1 line \(0 Hz\)") as caught:
        modal_frf(system, frequency_axis(0, 100, 10))
    assert caught.value.frequencies.tolist() == [0.0]
    pole = real_modes(system).natural_frequencies[2]
    with pytest.raises(SingularLineError):
        modal_frf(system, [10.0, pole])
    modal_frf(system, [10.0, pole * (1 + 1e-9)])
    damped = random_system(
        np.random.default_rng(10), 5, grounded=False, beta=lambda rng: rng.uniform(0, 1e-5)
    )
    with pytest.raises(SingularLineError, match=r"1 line \(0 Hz\)"):
        modal_frf(damped, frequency_axis(0, 100, 10))


@pytest.mark.parametrize("kind", ["undamped", "proportional", "general"])
@pytest.mark.parametrize("quantity", ["mobility", "accelerance"])
def test_quantities_and_derived_labels(kind: str, quantity: str) -> None:
    system = random_system(
        np.random.default_rng(11), 4, beta=DAMPING[kind], derived={"hub": ("x2", -1.5)}
    )
    lines = [10.0, 100.0, 333.0]
    direct = direct_frf(system, lines, quantity=quantity)
    assert scaled_error(modal_frf(system, lines, quantity=quantity), direct).max() < 1e-11
    one = modal_frf(system, lines, ["hub"], ["x0", "hub"], quantity)
    assert one.responses == ("hub",)
    assert np.allclose(one.values, direct.select(["hub"], ["x0", "hub"]).values, rtol=1e-9)
    assert one.values.strides[0] == 16


def test_modes_can_be_given_and_truncated() -> None:
    system = random_system(np.random.default_rng(12), 6, grounded=False, beta=DAMPING["general"])
    lines = [50.0, 500.0]
    full = modal_frf(system, lines)
    assert np.array_equal(modal_frf(system, lines, modes=real_modes(system)).values, full.values)
    assert np.array_equal(modal_frf(system, lines, modes=complex_modes(system)).values, full.values)
    undamped = SecondOrderSystem(system.mass, 0 * system.mass, system.stiffness, system.dofs)
    modes = real_modes(undamped)
    low, high = modes.truncated(slice(0, 4)), modes.truncated([4, 5])
    assert (low.n_rigid, high.n_rigid) == (1, 0)
    both = modal_frf(undamped, lines, modes=low) + modal_frf(undamped, lines, modes=high)
    assert scaled_error(both, modal_frf(undamped, lines)).max() < 1e-14
    with pytest.raises(AxisMismatchError, match="another system"):
        modal_frf(random_system(np.random.default_rng(0), 6, "y"), lines, modes=modes)


def test_a_noisy_stiffness_keeps_its_rigid_body_with_a_tolerance() -> None:
    system = random_system(np.random.default_rng(13), 6, grounded=False)
    noise = np.random.default_rng(14).standard_normal((6, 6))
    noisy = SecondOrderSystem(
        system.mass,
        system.damping,
        system.stiffness * (1 + 1e-9 * (noise + noise.T)),
        system.dofs,
    )
    assert real_modes(noisy, rigid_tolerance=1e-7).n_rigid == 1
    with pytest.raises(FbsError, match="rigid_tolerance"):
        real_modes(noisy, rigid_tolerance=0.0)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.integers(0, 4), st.floats(-14, -1))
def test_the_lowest_eigenvalue_decides_whether_a_stiffness_is_definite(
    seed: int, n: int, missing: Any, exponent: Any
) -> None:
    # of rank n - missing, then one direction pushed below zero; the factorisation must not miss it
    rng = np.random.default_rng(seed)
    factor = rng.standard_normal((max(1, n - missing), n))
    direction = rng.standard_normal(n)
    stiffness = factor.T @ factor - 10**exponent * np.outer(direction, direction)
    system = diagonal_system(np.ones(n), 1e6 * (stiffness + stiffness.T))
    root = np.sqrt(np.abs(np.diag(stiffness)))
    lowest = np.linalg.eigvalsh(stiffness / np.outer(root, root))[0]
    tolerance = 64 * n * np.finfo(float).eps
    assume(not 0.5 < -lowest / tolerance < 2)  # eigvalsh itself rounds by some n eps
    if lowest < -tolerance:
        with pytest.raises(IndefiniteStiffnessError):
            real_modes(system)
    else:
        real_modes(system)


def test_stiffness_and_mass_are_refused_by_name() -> None:
    with pytest.raises(IndefiniteStiffnessError, match=r"eigenvalue -0\.5, mostly motion of 'x"):
        real_modes(diagonal_system([1, 1], [[1e6, 1.5e6], [1.5e6, 1e6]]))
    with pytest.raises(IndefiniteStiffnessError, match="mostly motion of 'x1'"):
        real_modes(diagonal_system([1, 1], np.diag([1e6, -1.0])))
    with pytest.raises(IndefiniteStiffnessError, match="eigenvalue"):
        real_modes(diagonal_system([1, 1], [[1e6, 1.0], [1.0, 0.0]]))
    with pytest.raises(IndefiniteStiffnessError, match=r"not symmetric at \('x[01]', 'x[01]'\)"):
        real_modes(diagonal_system([1, 1], [[1e6, 1.0], [0.0, 1e6]]))
    with pytest.raises(IndefiniteMassError, match="'x1' has mass 0 kg"):
        real_modes(diagonal_system([1, 0], np.eye(2)))
    with pytest.raises(IndefiniteMassError, match=r"lowest eigenvalue is -0\.5"):
        real_modes(SecondOrderSystem([[1, 1.5], [1.5, 1]], np.zeros((2, 2)), np.eye(2), ("a", "b")))
    with pytest.raises(IndefiniteMassError, match="not symmetric"):
        real_modes(
            SecondOrderSystem([[1.0, 0.5], [0.0, 1.0]], np.zeros((2, 2)), np.eye(2), ("a", "b"))
        )

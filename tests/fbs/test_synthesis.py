"""The method is chosen by its cost, says so, and gives the same FRFs as the direct solution."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fbs import (
    FbsError,
    IndefiniteMassError,
    Method,
    MethodError,
    SecondOrderSystem,
    SingularLineError,
    UnknownDofError,
    direct_frf,
    frequency_axis,
    real_modes,
    schur_frf,
    synthesize,
)
from fbs.synthesis import costs
from tests.fbs.fbs_systems import hub_system, long_double_frf, random_system, scaled_error

AXIS = frequency_axis(20, 4000, 20)
DAMPING = {
    "undamped": lambda rng: 0.0,
    "proportional": lambda rng: 1e-6,
    "general": lambda rng: rng.uniform(0, 1e-5),
}


def critical() -> Any:
    """A pair of equal real poles: no two eigenvectors belong to them."""
    return SecondOrderSystem(
        np.eye(2), np.array([[2e3, 1e-3], [1e-3, 10.0]]), np.diag([1e6, 9e6]), ("a", "b")
    )


@pytest.mark.parametrize("kind", list(DAMPING))
@pytest.mark.parametrize("grounded", [True, False])
@pytest.mark.parametrize("quantity", ["receptance", "accelerance"])
def test_schur_is_direct(kind: Any, grounded: bool, quantity: str) -> None:
    for system in (
        random_system(np.random.default_rng(1), 8, grounded=grounded, beta=DAMPING[kind]),
        hub_system(1, grounded=grounded, beta=DAMPING[kind]),
    ):
        expected = direct_frf(system, AXIS, quantity=quantity)
        # as modal_frf: both carry eps times the condition of the line, below 1e5
        assert scaled_error(schur_frf(system, AXIS, quantity=quantity), expected).max() < 1e-9
        for rows, columns in ((["x2"], ["x1", "x4"]), (["x1", "x4", "x2"], ["x3"])):
            part = schur_frf(system, AXIS, rows, columns, quantity).values
            assert np.allclose(part, expected.select(rows, columns).values, rtol=1e-7, atol=0)


def test_schur_takes_critical_damping() -> None:
    system = critical()
    lines = [10.0, 159.0, 477.0]
    expected = np.array([long_double_frf(system, f) for f in lines])
    # round-off of the states, a few eps times the highest pole over the lowest (3)
    assert scaled_error(schur_frf(system, lines), expected).max() < 1e-13


def test_schur_with_many_states_a_loss_factor_and_derived_labels() -> None:
    base = random_system(np.random.default_rng(2), 40, beta=DAMPING["general"])
    system = SecondOrderSystem(
        base.mass, base.damping, base.stiffness, base.dofs, {"hub": ("x2", -1.5)}, 0.02
    )
    frf = schur_frf(system, AXIS, ["hub", "x7"], ["x39"])
    expected = direct_frf(system, AXIS, ["hub", "x7"], ["x39"])
    assert np.allclose(frf.values, expected.values, rtol=1e-9, atol=0)


def test_schur_names_singular_lines() -> None:
    system = random_system(np.random.default_rng(10), 5, grounded=False)
    with pytest.raises(SingularLineError, match=r"1 line \(0 Hz\)"):
        schur_frf(system, frequency_axis(0, 100, 10))
    pole = real_modes(system).natural_frequencies[2]
    with pytest.raises(SingularLineError) as caught:
        schur_frf(system, [10.0, pole])
    assert caught.value.frequencies.tolist() == [pole]


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("undamped", Method.MODAL),
        ("proportional", Method.MODAL),
        ("general", Method.COMPLEX_MODES),
    ],
)
def test_the_cheapest_that_applies(kind: str, expected: Any) -> None:
    system = random_system(np.random.default_rng(3), 20, beta=DAMPING[kind])
    for labels in (None, ["x1"]):
        made = synthesize(system, AXIS, labels, labels)
        assert made.method is expected
        assert (
            scaled_error(made.frf, direct_frf(system, AXIS, labels, labels)).max() < 1e-10
        )  # no line nearer than 1e-4 to a pole
        assert made.costs[made.method] == min(
            cost for method, cost in made.costs.items() if method not in made.refused
        )
        assert "operations" in made.reason


def test_every_cheaper_method_refused_is_named() -> None:
    made = synthesize(random_system(np.random.default_rng(3), 20, beta=DAMPING["general"]), AXIS)
    assert list(made.refused) == [Method.MODAL]
    assert "modal does not apply (the damping is not proportional" in made.reason


def test_ill_conditioned_modes_fall_back() -> None:
    # one pair of 60 coordinates is critical: complex modes are cheapest, but no basis
    n = 60
    frequency = np.linspace(1e3, 5e3, n)
    damping = np.diag(np.full(n, 10.0))
    damping[0, 0] = 2 * frequency[0]
    damping[0, 1] = damping[1, 0] = 1e-3
    system = SecondOrderSystem(
        np.eye(n), damping, np.diag(frequency**2), tuple(f"x{i}" for i in range(n))
    )
    axis = frequency_axis(1, 4000, 1)
    made = synthesize(system, axis, ["x1"], ["x0"])
    assert made.method is Method.SCHUR
    assert "complex modes does not apply (the complex modes are defective" in made.reason
    expected = direct_frf(system, axis, ["x1"], ["x0"]).values
    assert np.allclose(made.frf.values, expected, rtol=1e-9, atol=0)


def test_matrices_without_modes_are_solved_directly() -> None:
    lopsided = SecondOrderSystem(
        np.eye(30),
        np.zeros((30, 30)),
        np.diag(np.full(30, 1e6)) + np.diag(np.full(29, 5.0), 1),
        tuple(f"x{i}" for i in range(30)),
    )
    made = synthesize(lopsided, AXIS, ["x1"], ["x2"])
    assert made.method is Method.DIRECT
    assert "modal does not apply (the stiffness matrix is not symmetric" in made.reason
    expected = direct_frf(lopsided, AXIS, ["x1"], ["x2"]).values
    np.testing.assert_array_equal(made.frf.values, expected)


def test_a_method_asked_for_is_used_or_refused() -> None:
    system = random_system(np.random.default_rng(4), 6, beta=DAMPING["proportional"])
    expected = direct_frf(system, AXIS)
    for method in Method:
        made = synthesize(system, AXIS, method=method.value)
        assert (made.method, made.reason) == (method, "asked for")
        assert scaled_error(made.frf, expected).max() < 1e-11
    with pytest.raises(MethodError, match="'modal' does not apply: the damping is not prop"):
        synthesize(critical(), AXIS, method="modal")
    with pytest.raises(MethodError, match=r"'complex modes' does not apply: .* defective"):
        synthesize(critical(), AXIS, method=Method.COMPLEX_MODES)
    massless = SecondOrderSystem(np.diag([1.0, 0.0]), np.zeros((2, 2)), np.eye(2), ("a", "b"))
    with pytest.raises(MethodError, match="'schur' does not apply: 'b' has mass 0") as caught:
        synthesize(massless, AXIS, method="schur")
    assert isinstance(caught.value.__cause__, IndefiniteMassError)
    with pytest.raises(MethodError, match="'fast' is none of direct, modal"):
        synthesize(system, AXIS, method="fast")


def test_bad_input_is_no_reason_to_fall_back() -> None:
    system = random_system(np.random.default_rng(4), 6)
    with pytest.raises(UnknownDofError):
        synthesize(system, AXIS, ["nowhere"])
    with pytest.raises(FbsError, match="ascend"):
        synthesize(system, [2.0, 1.0])
    pole = real_modes(system).natural_frequencies[2]
    with pytest.raises(SingularLineError):
        synthesize(system, [10.0, pole])


def test_costs_are_the_counts_they_claim() -> None:
    system = random_system(np.random.default_rng(5), 10, beta=DAMPING["general"])
    one, all_ = ("x1",), system.labels
    pair = costs(system, 100, one, ("x2",))
    # LU and one right-hand side, complex: 4 (2/3 n^3 + 2 n^2) per line
    assert pair[Method.DIRECT] == pytest.approx(100 * 4 * (2000 / 3 + 200))
    # a thousand lines more cost n (15 + 4) more each; all FRFs are 55 sums
    more = costs(system, 1100, one, ("x2",))
    assert more[Method.MODAL] - pair[Method.MODAL] == 1000 * 10 * 19
    whole, more = costs(system, 100, all_, all_), costs(system, 101, all_, all_)
    assert more[Method.MODAL] - whole[Method.MODAL] == 10 * (15 + 4 * 55)

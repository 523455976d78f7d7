"""Sparse systems, solved directly and through a reduced model, against the dense solution."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from fbs import (
    AmbiguousDofError,
    FbsError,
    Joint,
    NonFiniteError,
    Quantity,
    SecondOrderSystem,
    SingularLineError,
    UnknownDofError,
    couple,
    direct_frf,
    frequency_axis,
    modal_frf,
    real_modes,
)
from fbs.large.chain import couple_chain
from fbs.large.krylov import ReductionError, reduced_frf
from fbs.large.sparse_system import SparseSystem, sparse_frf
from tests.fbs.fbs_systems import hub_system, random_system, scaled_error

AXIS = frequency_axis(10, 3000, 5)


def general(rng: np.random.Generator) -> Any:
    return rng.uniform(1e-7, 1e-5)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 30),
    st.sampled_from(["undamped", "general", "loss factor"]),
    st.booleans(),
    st.sampled_from(["receptance", "mobility", "accelerance"]),
)
def test_sparse_is_dense(
    seed: int, n: int, damping: str, grounded: Any, quantity: Quantity
) -> None:
    rng = np.random.default_rng(seed)
    beta = general if damping == "general" else lambda rng: 0.0
    system = random_system(rng, n, grounded=grounded, beta=beta, derived={"twice": ("x0", 2.0)})
    if damping == "loss factor":
        system = replace(system, loss_factor=0.01)
    axis = np.sort(rng.uniform(10, 3000, 5))
    columns = ["twice", *rng.choice(system.dofs, min(n, 2), replace=False)]
    found = sparse_frf(SparseSystem.of(system), axis, None, columns, quantity)
    dense = direct_frf(system, axis, quantity=quantity)
    assert (found.responses, found.excitations) == (system.labels, tuple(columns))
    scale = np.sqrt(np.linalg.norm(dense.values, axis=2))
    at = [system.labels.index(label) for label in columns]
    error = np.abs(found.values - dense.values[:, :, at]) / (scale[:, :, None] * scale[:, None, at])
    # both lose eps times the condition of Z, which is below 1e6 this far from poles
    assert error.max() < 1e-9
    few = sparse_frf(SparseSystem.of(system), axis, columns, None, quantity)
    assert np.allclose(few.values.transpose(0, 2, 1), found.values, rtol=1e-9, atol=0)


def test_rows_and_columns_of_a_system_that_is_not_symmetric() -> None:
    rng = np.random.default_rng(0)
    system = random_system(rng, 6, beta=general)
    spin = np.triu(rng.uniform(-100, 100, (6, 6)), 1)
    system = replace(system, damping=system.damping + spin - spin.T)
    dense, wanted = direct_frf(system, AXIS), (["x1"], ["x4", "x5"])
    for rows, columns in (wanted, wanted[::-1]):
        found = sparse_frf(SparseSystem.of(system), AXIS, rows, columns)
        # round-off times a condition that gyroscopic damping keeps below 1e4
        assert np.allclose(found.values, dense.select(rows, columns).values, rtol=1e-11, atol=0)
    with pytest.raises(FbsError, match="damping matrix is not symmetric"):
        reduced_frf(SparseSystem.of(system), AXIS, ["x1"], ["x4"])


def test_singular_lines_are_named() -> None:
    free = random_system(np.random.default_rng(0), 5, grounded=False)
    with pytest.raises(SingularLineError) as caught:
        sparse_frf(SparseSystem.of(free), [0.0, 100.0])
    assert caught.value.frequencies.tolist() == [0.0]
    with pytest.raises(SingularLineError) as caught:
        reduced_frf(SparseSystem.of(free), [0.0, 100.0, 200.0], ["x0"], ["x0"])
    assert caught.value.frequencies.tolist() == [0.0]
    one = SecondOrderSystem([[1.0]], [[0.0]], [[(2 * np.pi * 50) ** 2]], ("x",))
    with pytest.raises(SingularLineError) as caught:
        sparse_frf(SparseSystem.of(one), [49.0, 50.0, 51.0])
    assert caught.value.frequencies.tolist() == [50.0]


def test_an_undamped_pole_on_a_line_of_a_reduced_model_is_named() -> None:
    system = random_system(np.random.default_rng(4), 60)
    pole = real_modes(system).natural_frequencies[3]
    axis = np.sort(np.append(frequency_axis(10, 3000, 1), pole))
    with pytest.raises(SingularLineError) as caught:
        reduced_frf(SparseSystem.of(system), axis, ["x0"], ["x59"])
    assert pole in caught.value.frequencies


@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["undamped", "proportional", "general", "loss factor"]),
    st.booleans(),
    st.sampled_from([1e-4, 1e-7]),
)
def test_a_reduced_model_is_as_accurate_as_it_says(
    seed: int, damping: str, grounded: Any, tolerance: Any
) -> None:
    rng = np.random.default_rng(seed)
    beta = {"general": general, "proportional": lambda rng: 2e-6}.get(damping, lambda rng: 0.0)
    system = random_system(rng, 60, grounded=grounded, beta=beta, derived={"twice": ("x50", 2.0)})
    if damping == "loss factor":
        system = replace(system, loss_factor=0.01)
    asked = ["x0", "twice"]
    axis = AXIS + 1 / np.pi  # off the poles
    found = reduced_frf(SparseSystem.of(system), axis, asked, asked, tolerance=tolerance)
    error = scaled_error(found.frf, direct_frf(system, axis, asked, asked))
    assert found.error_estimate.max() <= tolerance + 1e-9  # 1e-9: the round-off part of it
    assert error.max() <= tolerance
    assert found.checked_error.max() <= tolerance
    assert not set(found.checked) & set(found.expansion)
    assert len(found.system.dofs) <= 60
    again = modal_frf(found.system, axis, asked, asked)
    assert np.array_equal(again.values, found.frf.values)


@pytest.mark.parametrize("grounded", [True, False])
@pytest.mark.parametrize("asked", [["x3", "x40"], ["hub", "x40"]])
def test_a_nearly_massless_hub(grounded: bool, asked: list[str]) -> None:
    system = hub_system(3, 60, grounded=grounded, beta=lambda rng: 1e-6)
    found = reduced_frf(SparseSystem.of(system), AXIS, asked, asked)
    error = scaled_error(found.frf, direct_frf(system, AXIS, asked, asked))
    assert error.max() <= 1e-8  # the default tolerance


def test_an_accuracy_out_of_reach_is_refused() -> None:
    system = random_system(np.random.default_rng(1), 60, beta=lambda rng: 1e-6)
    with pytest.raises(ReductionError, match="at most 20") as caught:
        reduced_frf(SparseSystem.of(system), AXIS, ["x0"], ["x59"], largest=20)
    assert "tolerance 1e-08" in str(caught.value)
    with pytest.raises(FbsError, match="between 0 and 1"):
        reduced_frf(SparseSystem.of(system), AXIS, ["x0"], ["x59"], tolerance=0.0)


def test_a_chain_of_sparse_parts() -> None:
    rng = np.random.default_rng(2)
    parts = {name: random_system(rng, 20, f"{name}.x", beta=general) for name in "ab"}
    joints = [Joint(("a", "a.x3"), ("b", "b.x7"), 1e8)]
    asked = ["a.x0", "b.x0"]
    wide = {name: SparseSystem.of(part) for name, part in parts.items()}
    chain = couple_chain(wide, joints, AXIS, asked, asked, sparse_frf)
    whole = couple({name: direct_frf(part, AXIS) for name, part in parts.items()}, joints)
    error = scaled_error(chain.frf, whole.frf.select(asked, asked))
    assert error.max() < 1e-10  # eps times the condition of Z and of the kernel
    with pytest.raises(FbsError, match=r"part 'a' is a SparseSystem: .* synthesis=sparse_frf"):
        couple_chain(wide, joints, AXIS, asked, asked)


def test_refused() -> None:
    eye, dofs = sparse.eye_array(2), ("a", "b")
    assert SparseSystem(eye, 0 * eye, eye, dofs).undamped
    assert pickle.loads(pickle.dumps(SparseSystem(eye, eye, eye, dofs))).dofs == dofs
    with pytest.raises(FbsError, match="mass matrix has shape"):
        SparseSystem(sparse.eye_array(3), eye, eye, dofs)
    with pytest.raises(FbsError, match="must be real"):
        SparseSystem(eye, eye, 1j * eye, dofs)
    wrong = sparse.csc_array(([np.nan], ([1], [0])), shape=(2, 2))
    with pytest.raises(NonFiniteError, match=r"damping matrix holds nan at \(1, 0\)"):
        SparseSystem(eye, wrong, eye, dofs)
    with pytest.raises(AmbiguousDofError):
        SparseSystem(eye, eye, eye, ("a", "a"))
    with pytest.raises(UnknownDofError):
        SparseSystem(eye, eye, eye, dofs, {"c": ("d", 1.0)})
    with pytest.raises(UnknownDofError, match="did you mean"):
        sparse_frf(SparseSystem(eye, eye, eye, ("one", "two")), [1.0], ["on"])

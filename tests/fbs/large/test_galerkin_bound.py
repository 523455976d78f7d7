"""Bounds of projected models against direct solutions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fbs import (
    FbsError,
    IndefiniteStiffnessError,
    SparseSystem,
    direct_frf,
    frequency_axis,
    galerkin_bound,
    real_modes,
    reduced_frf,
)
from fbs.reduction import craig_bampton, rubin
from tests.fbs.fbs_systems import random_system

LINES = frequency_axis(10, 2000, 10)
ROWS, COLUMNS = ["x0", "x9"], ["x9", "x20"]


def damped(kind: Any) -> Any:
    rng = np.random.default_rng(7)
    friction = (lambda r: r.uniform(1e-7, 1e-6)) if kind == "viscous" else lambda r: 0.0
    system = random_system(rng, 40, grounded=kind != "rayleigh", beta=friction)
    if kind == "rayleigh":
        return replace(system, damping=5.0 * system.mass + 1e-6 * system.stiffness)
    return replace(system, loss_factor=0.02)


@pytest.mark.parametrize("kind", ["hysteretic", "rayleigh", "viscous"])
@pytest.mark.parametrize("count", [6, 12, 30])
def test_kept_modes_are_bounded_by_their_residual(kind: str, count: int) -> None:
    system = damped(kind)
    found = galerkin_bound(system, real_modes(system).shapes[:, :count], LINES, ROWS, COLUMNS)
    error = np.abs(found.frf.values - direct_frf(system, LINES, ROWS, COLUMNS).values)
    assert (error <= found.bound).all()
    assert np.isfinite(found.bound).all()


def test_reduced_frfs_get_a_guarantee_beside_their_estimate() -> None:
    system = damped("hysteretic")
    reduced = reduced_frf(SparseSystem.of(system), LINES, ROWS, COLUMNS, tolerance=1e-6)
    found = galerkin_bound(system, reduced.vectors, LINES, ROWS, COLUMNS)
    exact = direct_frf(system, LINES, ROWS, COLUMNS).values
    assert (np.abs(reduced.frf.values - exact) <= found.of(reduced.frf)).all()
    # the residual is squared, so that what the norm of Z^-1 is taken too large by, 1 / (eta d),
    # leaves the guarantee below the tolerance all the same
    assert (found.of(reduced.frf) < 1e-6 * np.abs(exact).max()).all()


def test_undamped_there_is_no_guarantee() -> None:
    system = random_system(np.random.default_rng(7), 40)
    found = galerkin_bound(system, real_modes(system).shapes[:, :10], LINES, ROWS, COLUMNS)
    assert not found.distance.any()
    assert np.isinf(found.bound).all()


def test_bad_input_is_named() -> None:
    system = damped("hysteretic")
    with pytest.raises(FbsError, match=r"vectors have shape \(3, 3\); 40 DoFs need as many rows"):
        galerkin_bound(system, np.eye(3), LINES, ROWS, COLUMNS)
    negative = replace(system, stiffness=-system.stiffness)
    with pytest.raises(IndefiniteStiffnessError, match="not positive definite"):
        galerkin_bound(negative, np.eye(40)[:, :5], LINES, ROWS, COLUMNS)


@pytest.mark.parametrize("reduce", [craig_bampton, rubin])
@pytest.mark.parametrize("kind", ["hysteretic", "rayleigh", "viscous"])
def test_craig_bampton_and_rubin_are_bounded_through_their_basis(reduce: Any, kind: str) -> None:
    system = damped(kind)
    reduction = reduce(system, ["x0", "x9", "x20"], 8)
    found = galerkin_bound(system, reduction.basis, LINES, ROWS, COLUMNS)
    frf = direct_frf(reduction.system, LINES, ROWS, COLUMNS)
    exact = direct_frf(system, LINES, ROWS, COLUMNS)
    assert (np.abs(frf.values - exact.values) <= found.of(frf)).all()

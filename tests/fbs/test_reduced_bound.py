"""Bounds of coupled reduced parts against the whole drivetrain's exact FRFs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fbs import (
    FbsError,
    Reason,
    ReducedPart,
    SparseSystem,
    bounded_frf,
    direct_frf,
    frequency_axis,
    reduced_frf,
)
from fbs.reduction import craig_bampton, dual_craig_bampton, guyan, macneal, rubin, serep
from tests.fbs.fbs_systems import random_system
from tests.random_drivetrains import Whole, random_parts

CONSISTENT = {
    "guyan": lambda system, ends: guyan(system, [*ends, *others(system, ends)[:6]]),
    "craig_bampton": lambda system, ends: craig_bampton(
        system, ends, len(others(system, ends)) // 2
    ),
    "rubin": lambda system, ends: rubin(system, ends, len(system.dofs) // 2),
}


def others(system: Any, ends: list[str]) -> list[str]:
    return [dof for dof in system.dofs if dof not in ends]


@pytest.mark.parametrize("method", CONSISTENT)
@pytest.mark.parametrize("damping", ["undamped", "hysteretic", "rayleigh", "both"])
@pytest.mark.parametrize("seed", range(2))
def test_reduced_drivetrains_keep_their_bounds_on_every_line(
    method: str, damping: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    parts = random_parts(rng, stages=3, damping=damping)
    reduced = {}
    for name, system in parts.systems.items():
        pairs = (end for joint in parts.joints for end in (joint.first, joint.second))
        ends = list(dict.fromkeys(label for owner, label in pairs if owner == name))
        reduced[name] = ReducedPart.of(CONSISTENT[method](system, ends))
    whole = Whole.of(parts)
    nodes = [(name, dof) for name, system in parts.systems.items() for dof in system.dofs]
    nodes = [nodes[k] for k in rng.choice(len(nodes), 8, replace=False)]
    peaks = whole.natural_frequencies()
    peaks = rng.choice(peaks[peaks > 1], 20) * (1 + 10 ** rng.uniform(-7, -2, 20))
    axis = np.unique([*peaks, *rng.uniform(1, 4000, 40)])
    labels = [dof for _, dof in nodes]
    found = bounded_frf(reduced, parts.joints, axis, labels, labels)
    error = np.abs(found.frf.values - whole.frf(2 * np.pi * axis, nodes)).astype(float)
    assert not found.reason.any()
    assert (error <= found.bound).all()
    # the part's own modes up to twice the line are known: of the rest, tau < 0.08, 4e-6 is left
    told = error > 1e6 * np.finfo(float).eps * np.abs(found.frf.values)
    assert np.median(found.bound[told] / error[told]) < 1.001


LINES = frequency_axis(10, 2000, 10)
PORTS = ["x0", "x9"]


def part(**changed: Any) -> Any:
    return replace(random_system(np.random.default_rng(7), 40), **changed)


def test_krylov_and_serep_are_bounded_through_their_basis() -> None:
    system = part(loss_factor=0.02)
    exact = direct_frf(system, LINES, PORTS, PORTS).values
    reduced = reduced_frf(SparseSystem.of(system), LINES, PORTS, PORTS, tolerance=1e-6)
    for basis in (reduced.vectors, serep(system, system.dofs[:12]).basis):
        found = bounded_frf({"part": ReducedPart(system, basis)}, (), LINES, PORTS, PORTS)
        assert (np.abs(found.frf.values - exact) <= found.bound).all()
    found = bounded_frf({"part": ReducedPart(system, reduced.vectors)}, (), LINES, PORTS, PORTS)
    assert (np.abs(reduced.frf.values - exact) <= found.of(reduced.frf)).all()
    assert (found.of(reduced.frf) < 1e-6 * np.abs(exact).max()).all()


@pytest.mark.parametrize("reduce", [macneal, dual_craig_bampton])
def test_what_is_no_projection_is_refused_and_bounded_as_another_frf(reduce: Any) -> None:
    system = part()
    reduction = reduce(system, PORTS, 8)
    with pytest.raises(FbsError, match="are no projection"):
        ReducedPart.of(reduction)
    found = bounded_frf({"a": ReducedPart.of(rubin(system, PORTS, 8))}, (), LINES, PORTS, PORTS)
    error = np.abs(
        reduction.frf(LINES, PORTS, PORTS).values - direct_frf(system, LINES, PORTS, PORTS).values
    )
    assert (error <= found.of(reduction.frf(LINES, PORTS, PORTS))).all()


def test_other_viscous_damping_leaves_no_guarantee_and_is_solved_all_the_same() -> None:
    damper = np.zeros((40, 40))
    damper[0, 0] = 100.0
    reduction = rubin(part(damping=damper), PORTS, 8)
    reduced = ReducedPart.of(reduction)
    assert "C = alpha M + beta K" in str(reduced.no_guarantee)
    found = bounded_frf({"part": reduced}, (), LINES, PORTS, PORTS)
    assert (found.reason == Reason.PART).all()
    assert found.frf.values == pytest.approx(reduction.frf(LINES, PORTS, PORTS).values, rel=1e-9)


def test_bad_bases_are_named() -> None:
    with pytest.raises(FbsError, match=r"the basis has shape \(3, 3\); 40 DoFs need as many rows"):
        ReducedPart(part(), np.eye(3))
    twice = ReducedPart(part(), np.ones((40, 2)))
    with pytest.raises(FbsError, match="dependent columns"):
        bounded_frf({"part": twice}, (), LINES, PORTS, PORTS)

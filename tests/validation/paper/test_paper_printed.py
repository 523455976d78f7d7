"""The printed formulas are what the paper prints: faults found, and only those."""

from __future__ import annotations

import numpy as np
import pytest

from validation.paper import printed
from validation.paper.appendix_claims import appendix_claims, wrong_blocks
from validation.paper.curves import FrfBench
from validation.paper.formula_claims import (
    condensation_claims,
    helix_claim,
    kernel_claim,
    ring_mesh_claim,
    sign_claim,
    unconnected_claim,
)
from validation.paper.model import PAPER, PaperCase, Systems, parameter_sets
from validation.paper.results import Verdict


@pytest.fixture(scope="module")
def bench() -> FrfBench:
    return FrfBench(Systems(parameter_sets(None)[PAPER]))


@pytest.fixture(scope="module")
def case(bench: FrfBench) -> PaperCase:
    return bench.case


def test_appendix_a_is_indefinite(case: PaperCase) -> None:
    symmetry, definite = appendix_claims(case)
    assert symmetry.verdict == Verdict.CORRECTED
    assert definite.verdict == Verdict.FAILS
    assert definite.numbers["lowest_eigenvalue_printed"] < -1e8
    assert abs(definite.numbers["lowest_eigenvalue_springs"]) < 1.0


def test_which_blocks_are_no_outer_products(case: PaperCase) -> None:
    wrong = wrong_blocks(case)
    assert {"K_s1", "K_s2", "K_r1", "K_r2", "K_c1"} <= set(wrong)
    assert "K_s3" not in wrong
    assert "K_r3" not in wrong


def test_entry_3_3_of_the_carrier_block_is_zero(case: PaperCase) -> None:
    assert printed.appendix_blocks(case.planetary, 0).c1[2, 2] == 0.0


def test_printed_stiffness_is_symmetric_only_as_read(case: PaperCase) -> None:
    stiffness = printed.stiffness_b(case.planetary, case.shaft_stiffness)
    assert stiffness.shape == (22, 22)
    assert np.array_equal(stiffness, stiffness.T)
    above, below = printed.carrier_blocks(case.planetary)
    assert not np.allclose(above.T, below)


def test_eq_1_strains_a_rigid_translation(case: PaperCase) -> None:
    claim = ring_mesh_claim(case)
    assert claim.verdict == Verdict.CORRECTED
    assert claim.numbers["strain_printed"] > 0.5
    assert claim.numbers["strain_corrected"] < 1e-12
    assert claim.numbers["shift_corrected"] < 1e-9


def test_eq_7_leaves_the_hub_loose(bench: FrfBench) -> None:
    claim = unconnected_claim(bench)
    assert claim.verdict == Verdict.CORRECTED
    assert (claim.numbers["rows"], claim.numbers["dofs"]) == (8.0, 9.0)
    assert claim.numbers["rigid_modes_untied"] == 2.0
    assert claim.numbers["largest_transfer_untied"] == 0.0


def test_eq_9_is_right_without_a_helix_only(case: PaperCase) -> None:
    claim = helix_claim(case)
    assert claim.verdict == Verdict.CORRECTED
    assert claim.numbers["shift_own"] == pytest.approx(0.0, abs=1e-12)
    assert claim.numbers["shift_helical"] > 0.01
    helical = helix_claim(case.with_parallel(helix_angle=15.0))
    assert helical.numbers["shift_own"] > 1e-3


def test_eq_15_turns_the_sign_of_every_frf_between_the_stages(bench: FrfBench) -> None:
    claim = sign_claim(bench)
    assert claim.verdict == Verdict.CORRECTED
    assert claim.numbers["across_printed"] > 1e-2
    assert claim.numbers["within_printed"] < 1e-10
    assert claim.numbers["all_corrected"] < 1e-10


def test_flexible_kernel_lacks_an_inverse(bench: FrfBench) -> None:
    claim = kernel_claim(bench)
    assert claim.verdict == Verdict.CORRECTED
    assert claim.numbers["printed"] > 1e-2
    assert claim.numbers["corrected"] < 1e-10


def test_condensed_receptance_is_the_blocked_one(bench: FrfBench) -> None:
    meaning, between, literal = condensation_claims(bench)
    assert meaning.verdict == Verdict.FAILS
    assert meaning.numbers["formula_against_locked"] < 1e-8
    assert "889.0, 1125.4(2), 1808.3, 2089.8(2), 2105.4, 4044.4 Hz" in meaning.evidence
    assert between.verdict == Verdict.FAILS
    assert literal.verdict == Verdict.CORRECTED
    assert literal.numbers["worst"] > 1e-3

"""The printed formulas are what the paper prints: faults found, and only those."""

from __future__ import annotations

import numpy as np
import pytest

from validation.paper import appendix, condensation, formulas, printed
from validation.paper.bench import Bench
from validation.paper.case import PaperCase
from validation.paper.item import Statement, Verdict


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


@pytest.fixture(scope="module")
def case(bench: Bench) -> PaperCase:
    return bench.case


def test_appendix_a_is_indefinite(bench: Bench) -> None:
    assert appendix.symmetry.examine(bench).verdict == Verdict.CORRECTED
    definite = appendix.definiteness.examine(bench)
    assert definite.verdict == Verdict.FAILS
    assert definite.numbers["lowest_eigenvalue_printed"] < -1e8
    assert abs(definite.numbers["lowest_eigenvalue_springs"]) < 1.0


def test_which_blocks_are_no_outer_products(case: PaperCase) -> None:
    wrong = appendix.wrong_blocks(case)
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


def test_eq_1_strains_a_rigid_translation(bench: Bench) -> None:
    found = formulas.ring_mesh.examine(bench)
    assert found.verdict == Verdict.CORRECTED
    assert found.numbers["strain_printed"] > 0.5
    assert found.numbers["strain_corrected"] < 1e-12
    assert found.numbers["shift_corrected"] < 1e-9


def test_eq_7_leaves_the_hub_loose(bench: Bench) -> None:
    found = formulas.wheel_and_hub.examine(bench)
    assert found.verdict == Verdict.CORRECTED
    assert (found.numbers["rows"], found.numbers["dofs"]) == (8.0, 9.0)
    assert found.numbers["rigid_modes_untied"] == 2.0
    assert found.numbers["largest_transfer_untied"] == 0.0


def test_eq_9_is_right_without_a_helix_only(bench: Bench) -> None:
    found = formulas.mesh_of_a.examine(bench)
    assert found.verdict == Verdict.CORRECTED
    assert found.numbers["shift_own"] == pytest.approx(0.0, abs=1e-12)
    assert found.numbers["shift_helical"] > 0.01
    helical = formulas.mesh_of_a.examine(
        Bench(bench.case.with_parallel(helix_angle=15.0).drivetrain)
    )
    assert helical.numbers["shift_own"] > 1e-3


def test_eq_15_turns_the_sign_of_every_frf_between_the_stages(bench: Bench) -> None:
    found = formulas.coupling_sign.examine(bench)
    assert found.verdict == Verdict.CORRECTED
    assert found.numbers["across_printed"] > 1e-2
    assert found.numbers["within_printed"] < 1e-10
    assert found.numbers["all_corrected"] < 1e-10


def test_flexible_kernel_lacks_an_inverse(bench: Bench) -> None:
    found = formulas.flexible_kernel.examine(bench)
    assert found.verdict == Verdict.CORRECTED
    assert found.numbers["printed"] > 1e-2
    assert found.numbers["corrected"] < 1e-10


def test_condensed_receptance_is_the_blocked_one(bench: Bench) -> None:
    meaning = condensation.condensed_receptance.examine(bench)
    assert meaning.verdict == Verdict.FAILS
    assert meaning.numbers["formula_against_locked"] < 1e-8
    assert "889.0, 1125.4(2), 1808.3, 2089.8(2), 2105.4, 4044.4 Hz" in meaning.evidence
    assert condensation.between_stages.examine(bench).verdict == Verdict.FAILS


@pytest.mark.parametrize("printed_one", [condensation.condensed_a, condensation.condensed_b])
def test_eqs_21_and_22_lack_what_passes_between_the_stages(
    bench: Bench, printed_one: Statement
) -> None:
    found = printed_one.examine(bench)
    assert found.verdict == Verdict.CORRECTED
    assert found.numbers["worst"] > 1e-3


def test_blocks_of_eqs_14_and_19_do_not_fit(bench: Bench) -> None:
    row = condensation.third_row.examine(bench)
    assert row.verdict == Verdict.CORRECTED
    assert (row.numbers["rows_of_h_ab"], row.numbers["rows_of_the_place"]) == (8.0, 21.0)
    corner = condensation.lower_left.examine(bench)
    assert corner.verdict == Verdict.CORRECTED
    assert corner.numbers["corrected"] < 1e-10
    assert condensation.condensed_hub_and_b.examine(bench).verdict == Verdict.HOLDS

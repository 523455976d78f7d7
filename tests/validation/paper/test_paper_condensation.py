"""Condensed subsystems: the printed formula, blocked matrices, exudyn with locked coordinates."""

from __future__ import annotations

import pytest

from validation.paper.bench import Bench
from validation.paper.condensation import locked_checks


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


def test_locked_exudyn_is_the_condensed_receptance(bench: Bench) -> None:
    checks = bench.once(locked_checks)
    assert len(checks) == 5
    for check in checks:
        assert check.frequency_error < 1e-8, check.name
        assert check.matrix_error < 1e-8, check.name
        assert check.formula_error < 1e-8, check.name
        assert all(each.agrees for each in check.checks)


def test_condensed_a_as_the_paper_would_have_it(bench: Bench) -> None:
    # 1e8 N/m between wheel and hub, hub and B locked
    frequencies = bench.once(locked_checks)[0].frequencies_hz
    expected = (889.0, 1125.4, 1125.4, 1808.3, 2089.8, 2089.8, 2105.4, 4044.4)
    assert frequencies == pytest.approx(expected, abs=0.05)

"""Condensed subsystems: the printed formula, blocked matrices, exudyn with locked coordinates."""

from __future__ import annotations

import pytest

from validation.paper.condensation import locked_checks
from validation.paper.curves import FrfBench
from validation.paper.model import PAPER, Systems, parameter_sets


@pytest.fixture(scope="module")
def bench() -> FrfBench:
    return FrfBench(Systems(parameter_sets(None)[PAPER]))


def test_locked_exudyn_is_the_condensed_receptance(bench: FrfBench) -> None:
    checks = locked_checks(bench)
    assert len(checks) == 5
    for check in checks:
        assert check.frequency_error < 1e-8, check.name
        assert check.matrix_error < 1e-8, check.name
        assert check.formula_error < 1e-8, check.name
        assert check.agrees


def test_condensed_a_as_the_paper_would_have_it(bench: FrfBench) -> None:
    # 1e8 N/m between wheel and hub, hub and B locked
    frequencies = locked_checks(bench)[0].frequencies_hz
    expected = (889.0, 1125.4, 1125.4, 1808.3, 2089.8, 2089.8, 2105.4, 4044.4)
    assert frequencies == pytest.approx(expected, abs=0.05)

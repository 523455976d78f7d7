"""Modal truncation of subsystem B at 4 kHz, loss factor 1 %."""

from __future__ import annotations

import pytest

from validation.paper.curves import FrfBench
from validation.paper.model import PAPER, Systems, parameter_sets
from validation.paper.truncation import truncation_study
from validation.paper.truncation_results import TruncationRow, TruncationStudy


@pytest.fixture(scope="module")
def bench() -> FrfBench:
    return FrfBench(Systems(parameter_sets(None)[PAPER]))


@pytest.fixture(scope="module")
def study(bench: FrfBench) -> TruncationStudy:
    return truncation_study(bench, 0.1)


def row(study: TruncationStudy, left_out: int, hub_mode: bool, order: int | None) -> TruncationRow:
    wanted = (left_out, hub_mode, order)
    return next(r for r in study.rows if (r.left_out, r.hub_mode, r.residual_order) == wanted)


def test_nine_modes_lie_beyond_the_band(study: TruncationStudy) -> None:
    assert max(r.left_out for r in study.rows) == 9
    assert study.series_limit_hz == pytest.approx(5963.8, abs=0.1)


def test_all_nine_left_out(study: TruncationStudy) -> None:
    worst = row(study, 9, False, None).worst_db
    assert worst["hub"] == pytest.approx(43.0, abs=0.5)
    assert worst["sun w"] == pytest.approx(35.0, abs=0.5)
    assert worst["pinion w to sun w"] == pytest.approx(94.0, abs=0.5)


def test_eight_left_out_and_the_hubs_kept(study: TruncationStudy) -> None:
    worst = row(study, 8, True, None).worst_db
    assert worst["hub"] == pytest.approx(0.01, abs=0.005)
    assert worst["sun w"] == pytest.approx(10.0, abs=0.5)
    assert worst["sun u"] == pytest.approx(5.0, abs=0.5)


@pytest.mark.parametrize(("order", "limit"), [(0, 0.5), (1, 0.1), (2, 0.02)])
def test_residuals_mend_it(study: TruncationStudy, order: int, limit: float) -> None:
    assert row(study, 9, False, order).largest_db <= limit


def test_frac_would_not_have_told(study: TruncationStudy) -> None:
    assert min(min(r.frac.values()) for r in study.rows) > 0.99


def test_every_order_is_worth_the_square_of_the_frequency_ratio(study: TruncationStudy) -> None:
    assert study.expected_ratio == pytest.approx((4000.0 / 5964.0) ** 2, abs=1e-3)
    ratios = [ratio for _, _, ratio in study.order_ratio if ratio is not None]
    assert ratios == pytest.approx([study.expected_ratio] * len(ratios), rel=0.15)


def test_smallest_basis_follows_the_tolerance(bench: FrfBench, study: TruncationStudy) -> None:
    kept = {s.residual_order: s.kept for s in study.smallest}
    assert kept == {None: 22, 0: 21, 1: 13, 2: 13}
    coarse = truncation_study(bench, 1.0)
    assert {s.residual_order: s.kept for s in coarse.smallest}[0] == 13
    for found in study.smallest:
        assert found.worst_db <= 0.1

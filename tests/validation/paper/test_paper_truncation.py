"""Modal truncation of subsystem B at 4 kHz, loss factor 1 %."""

from __future__ import annotations

import pytest

from validation.paper import truncation
from validation.paper.bench import Bench
from validation.paper.item import Verdict
from validation.paper.modal_bases import TruncationStudy, truncation_study


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


@pytest.fixture(scope="module")
def study(bench: Bench) -> TruncationStudy:
    return bench.once(truncation_study)


def test_nine_modes_lie_beyond_the_band(study: TruncationStudy) -> None:
    assert study.beyond == 9
    assert study.series_limit_hz == pytest.approx(5963.8, abs=0.1)


def test_all_nine_left_out(study: TruncationStudy) -> None:
    worst = study.row(9, False, None).worst_db
    assert worst["hub"] == pytest.approx(43.0, abs=0.5)
    assert worst["sun w"] == pytest.approx(35.0, abs=0.5)
    assert worst["pinion w to sun w"] == pytest.approx(94.0, abs=0.5)


def test_eight_left_out_and_the_hubs_kept(study: TruncationStudy) -> None:
    worst = study.row(8, True, None).worst_db
    assert worst["hub"] == pytest.approx(0.01, abs=0.005)
    assert worst["sun w"] == pytest.approx(10.0, abs=0.5)
    assert worst["sun u"] == pytest.approx(5.0, abs=0.5)


@pytest.mark.parametrize(("order", "limit"), [(0, 0.5), (1, 0.1), (2, 0.02)])
def test_residuals_mend_it(study: TruncationStudy, order: int, limit: float) -> None:
    assert study.row(9, False, order).largest_db <= limit


def test_frac_would_not_have_told(study: TruncationStudy) -> None:
    assert min(min(r.frac.values()) for r in study.rows) > 0.99


def test_every_order_is_worth_the_square_of_the_frequency_ratio(study: TruncationStudy) -> None:
    assert study.expected_ratio == pytest.approx((4000.0 / 5964.0) ** 2, abs=1e-3)
    ratios = [ratio for _, _, ratio in study.order_ratio if ratio is not None]
    assert ratios == pytest.approx([study.expected_ratio] * len(ratios), rel=0.15)


def test_smallest_basis_follows_the_tolerance(study: TruncationStudy) -> None:
    kept = {s.residual_order: s.kept for s in study.smallest}
    assert kept == {None: 22, 0: 21, 1: 13, 2: 13}
    coarse = truncation_study(Bench(tolerance_db=1.0))
    assert {s.residual_order: s.kept for s in coarse.smallest}[0] == 13
    for found in study.smallest:
        assert found.worst_db <= 0.1


def test_an_antiresonance_decides_nothing(study: TruncationStudy) -> None:
    """10 dB from the pinion to the sun are a thousandth of what either does at that line."""
    kept = study.row(8, True, None)
    name = "pinion w to sun w"
    assert kept.worst_db[name] > 9.0
    assert kept.level_there[name] < -10.0
    assert kept.worst_scaled[name] < 2e-3


def test_the_verdict_follows_the_scaled_error(bench: Bench, study: TruncationStudy) -> None:
    found = truncation.modes_beyond.examine(bench)
    assert bench.tolerance == pytest.approx(0.0116, abs=1e-4)  # 0.1 dB
    assert study.row(8, True, None).largest_scaled > bench.tolerance
    assert study.row(9, False, 1).largest_scaled < bench.tolerance
    assert found.verdict == Verdict.CORRECTED


def test_tables_are_darker_the_further_beyond_the_tolerance(study: TruncationStudy) -> None:
    table = truncation.error_table(study, None)
    kept, out = table.rows[0], table.rows[9]
    assert all("shade" not in cell for cell in kept)
    assert 'class="shade-5"' in out[2]  # 43 dB where 0.1 dB is allowed

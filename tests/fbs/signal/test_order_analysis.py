"""Order spectra of steady and of varying speed against the lines put in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fbs import FbsError
from fbs.signal.order_analysis import order_spectrum, tracked_orders

FS = 8192.0
TIME = np.arange(4 * 8192) / FS


@given(frequency=st.floats(5.0, 40.0), order=st.integers(2, 60))
def test_whole_orders_lie_on_lines(frequency: float, order: int) -> None:
    x = 2.0 * np.cos(2 * np.pi * order * frequency * TIME + 0.3)
    spectrum = order_spectrum(x, FS, frequency, window="hann")
    at = int(np.argmin(np.abs(spectrum.order - order)))
    assert spectrum.values.argmax() == at
    # off its line by at most o turns / (2 size) lines; hann loses 0.65 off^2 of its amplitude there
    turns = np.floor(TIME.size * frequency / FS)
    off = order * turns / (2 * TIME.size * (1 - 1 / turns))
    assert spectrum.values[at] == pytest.approx(2.0, rel=0.7 * off**2 + 1e-6)


def test_a_segment_of_turns_spaces_the_lines() -> None:
    spectrum = order_spectrum(np.cos(2 * np.pi * 80 * TIME), FS, 32.0, turns=4, overlap=0.0)
    assert spectrum.order[:3] == pytest.approx([0, 0.25, 0.5])
    assert spectrum.n_averages == 32
    assert spectrum.values[10] == pytest.approx(1.0, rel=1e-12)  # order 2.5, on a line


def run_up(first: Any, last: Any) -> Any:
    """Angle of a shaft (rad) whose speed rises linearly from first to last turns per second."""
    return 2 * np.pi * (first * TIME + (last - first) / 2 / TIME[-1] * TIME**2)


@pytest.mark.parametrize(("first", "last"), [(10.0, 25.0), (25.0, 10.0), (16.0, 16.0)])
def test_run_up_keeps_orders_sharp(first: float, last: float) -> None:
    angle = run_up(first, last)
    # 25 turns/s, order 16.5: 20 samples per cycle at least, a spline error below 7e-8; the cubic
    # spline of time over angle, of a quadratic angle here, adds its own
    x = 3.0 * np.cos(16.5 * angle) + 0.5 * np.cos(7 * angle + 1.0)
    spectrum = tracked_orders(x, angle, turns=20)
    assert spectrum.order[[140, 330]] == pytest.approx([7.0, 16.5], rel=1e-12)
    assert spectrum.values[[140, 330]] == pytest.approx([0.5, 3.0], rel=1e-6)
    # both lie on lines of 1/20 order: between them only the splines' error is left
    assert spectrum.values[160:300].max() < 1e-6
    # by frequency the same record is smeared
    if first != last:
        smeared = order_spectrum(x, FS, (first + last) / 2, turns=20)
        assert smeared.values.max() < 1.5


@pytest.mark.parametrize(("per_cycle", "error"), [(20, 7e-8), (10, 5e-6), (5, 6e-4), (3, 3.2e-2)])
def test_error_of_the_spline_is_as_stated(per_cycle: int, error: float) -> None:
    angle = run_up(24.0, 25.0)
    order = np.floor(FS / 25.0 / per_cycle)  # `per_cycle` samples or more, hardly more
    spectrum = tracked_orders(2.0 * np.cos(order * angle), angle, turns=1, window="boxcar")
    at = int(np.argmin(np.abs(spectrum.order - order)))
    assert spectrum.values[at] == pytest.approx(2.0, rel=error)
    assert abs(spectrum.values[at] / 2.0 - 1.0) > error / 1e3  # the statement is no idle one


def test_orders_end_where_the_fastest_turn_is_sampled_twice() -> None:
    angle = run_up(10.0, 25.0)
    spectrum = tracked_orders(np.cos(angle), angle, turns=10)
    assert spectrum.order[-1] == pytest.approx(FS / 25 / 2, abs=0.11)  # one line is 0.1


def test_what_cannot_be_is_named() -> None:
    x = np.cos(TIME)
    with pytest.raises(FbsError, match=r"lasts 8 turns, 9 are needed"):
        order_spectrum(x, FS, 2.0, turns=9)
    with pytest.raises(FbsError, match="reference frequency must be above 0"):
        order_spectrum(x, FS, 0.0)
    with pytest.raises(FbsError, match="does not at sample 5"):
        tracked_orders(x, np.where(np.arange(TIME.size) == 5, 0.0, TIME))
    with pytest.raises(FbsError, match="one angle per sample"):
        tracked_orders(x, TIME[:-1])

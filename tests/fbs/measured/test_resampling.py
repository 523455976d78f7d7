"""FRFs on another axis: rational interpolation against the FRF itself, and its own error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fbs import AxisMismatchError, FbsError, SecondOrderSystem, direct_frf, frequency_axis
from fbs.measured.resampling import resample

MASS = np.diag([1.0, 2.0, 1.5])
STIFFNESS = np.array([[1.1e6, -1e6, 0], [-1e6, 3e6, -2e6], [0, -2e6, 2e6]])
SYSTEM = SecondOrderSystem(MASS, 1e-5 * STIFFNESS, STIFFNESS, ("a", "b", "c"))
AXIS = frequency_axis(2, 1000, 2)
GIVEN = direct_frf(SYSTEM, AXIS)
WANTED = np.linspace(2.0, 1000.0, 1331)


@pytest.mark.parametrize("quantity", ["receptance", "accelerance"])
def test_a_rational_function_is_met(quantity: str) -> None:
    found = resample(GIVEN.to(quantity), WANTED)
    exact = direct_frf(SYSTEM, WANTED, quantity=quantity).values
    off = np.abs(found.frf.values - exact).max(axis=0) / np.abs(exact).max(axis=0)
    assert off.max() < 1e-9  # six poles in all, and 16 supports a stretch
    assert found.error.max() < 1e-6
    straight = np.interp(WANTED, AXIS, np.abs(GIVEN.to(quantity).values[:, 0, 0]))
    assert np.abs(straight / np.abs(exact[:, 0, 0]) - 1).max() > 0.05  # what lines between do


def test_the_error_is_said_where_there_is_noise() -> None:
    """Noise cannot be interpolated: the error names its size, and covers what comes of it."""
    rng = np.random.default_rng(6)
    shape = GIVEN.values.shape
    noise = 1e-3 * np.abs(GIVEN.values).max(axis=0)
    noisy = replace(GIVEN, values=GIVEN.values + noise * rng.standard_normal(shape))
    found = resample(noisy, WANTED)
    exact = direct_frf(SYSTEM, WANTED).values
    off = np.abs(found.frf.values - exact).max(axis=(1, 2)) / np.abs(exact).max()
    assert np.median(found.error[found.error > 0]) > 1e-3
    assert np.median(off) < 0.02


def test_noise_brings_no_poles() -> None:
    """1 % of each value: what comes of it is of that size, and within three deviations stated.

    Of three FRFs a line, both in and beside resonances.
    """
    rng = np.random.default_rng(8)
    shape = GIVEN.values.shape
    noisy = replace(GIVEN, values=GIVEN.values * (1 + 0.01 * rng.standard_normal(shape)))
    found = resample(noisy, WANTED)
    exact = direct_frf(SYSTEM, WANTED).values
    off = np.abs(found.frf.values - exact)
    between = found.error > 0
    assert np.median(off / np.abs(exact)) < 0.02
    assert (off[between] < 3 * np.sqrt(found.variance[between])).mean() > 0.99
    assert not found.variance[~between].any()


def test_own_lines_keep_their_values() -> None:
    found = resample(GIVEN, AXIS[3:40:3])
    np.testing.assert_array_equal(found.frf.values, GIVEN.values[3:40:3])
    assert not found.error.any()
    assert found.frf.values.strides[0] == found.frf.values.itemsize


def test_nothing_is_extrapolated() -> None:
    with pytest.raises(AxisMismatchError, match="run from 2 to 1000 Hz; they have 2 to 1000 Hz"):
        resample(GIVEN, np.linspace(1.0, 1001.0, 50))
    with pytest.raises(AxisMismatchError, match="they have no frequency in common"):
        resample(GIVEN, [2000.0, 2001.0])
    with pytest.raises(FbsError, match="5 lines are too few"):
        resample(GIVEN.band(2.0, 10.0), [3.0])

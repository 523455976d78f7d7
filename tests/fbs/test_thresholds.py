"""Thresholds and exponents of the modal synthesis and the estimation, each by a closed form."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from fbs import SecondOrderSystem, modal_frf, real_modes, truncate
from fbs.damped_modes import is_proportional
from fbs.errors import SingularLineError
from fbs.signal.estimation import averaged_frf
from fbs.signal.records import Record

OSCILLATOR = SecondOrderSystem([[1.0]], [[0.0]], [[1.0]], ["x"])


def line(distance: float) -> list[float]:
    """A line so far (relative) above the pole of 1 rad/s."""
    return [(1.0 + distance) / (2.0 * np.pi)]


def test_a_line_is_on_a_pole_within_16_eps_and_not_beyond() -> None:
    with pytest.raises(SingularLineError):
        modal_frf(OSCILLATOR, line(1e-15))
    # 1/(1 − (1 + δ)²) = −1/2δ, to the eps/δ that rounding the line leaves
    found = modal_frf(OSCILLATOR, line(1e-13)).values[0, 0, 0]
    assert found.real == pytest.approx(-5e12, rel=1e-2)


@pytest.mark.parametrize(("off", "expected"), [(1e-12, True), (1e-10, False), (0.0, True)])
def test_damping_is_proportional_to_1e_11(off: float, expected: bool) -> None:
    assert is_proportional(np.array([[4.0, 2.0 * off], [2.0 * off, 1.0]])) is expected


def test_residuals_are_a_series_in_the_square_of_frequency() -> None:
    """Mode 2 left out: φφᵀ/ω₂² (1 + (ω/ω₂)²), its first two terms."""
    system = SecondOrderSystem(np.eye(2), np.zeros((2, 2)), [[3.0, -1.0], [-1.0, 3.0]], ["a", "b"])
    modes = real_modes(system)  # ω² = 2, 4
    omega = np.array([0.5, 0.9])
    kept = truncate(system, [0], residual_order=1, modes=modes)
    found = modal_frf(system, omega / (2.0 * np.pi), modes=kept).values
    first, second = (np.outer(s, s) for s in modes.shapes.T)
    for h, w in zip(found, omega, strict=True):
        expected = first / (2.0 - w**2) + second * (1.0 / 4.0 + w**2 / 16.0)
        np.testing.assert_allclose(h, expected, rtol=1e-12)


def test_spectra_are_averaged_not_ratios() -> None:
    """Two blows of 1 N and 3 N, answered by 2 and 12: H1 = (2 + 36)/(1 + 9), H2 = 148/38."""
    records = []
    for force, gain in ((1.0, 2.0), (3.0, 4.0)):
        blow = np.zeros((8, 1))
        blow[1] = force
        records.append(Record(8.0, blow, gain * blow, ("f",), ("y",), "receptance"))
    estimators: dict[Literal["H1", "H2"], float] = {"H1": 3.8, "H2": 148.0 / 38.0}
    for estimator, expected in estimators.items():
        found = averaged_frf(
            records, 8, overlap=0.0, window="boxcar", estimator=estimator, remove_mean=False
        )
        np.testing.assert_allclose(found.frf.values, expected, rtol=1e-12)

"""Tones of known frequencies in a record: between its lines, near each other, in noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.gears import line_fit
from mbs_models.gears.line_fit import APART, fit_tones

RATE = 1000.0


def record(size: int, tones: dict[float, complex], mean: float = 0.0) -> np.ndarray:
    """(size, 1) of Re z exp(2πj f t)."""
    time = np.arange(size) / RATE
    waves = [(z * np.exp(2j * np.pi * f * time)).real for f, z in tones.items()]
    return np.asarray(mean + np.sum(waves, axis=0))[:, None]


@given(
    size=st.integers(64, 3000),
    where=st.floats(0.0, 1.0),
    phase=st.floats(-math.pi, math.pi),
    mean=st.floats(-100.0, 100.0),
)
def test_a_pure_tone_is_read_in_full_wherever_it_lies(
    size: int, where: float, phase: float, mean: float
) -> None:
    """From two lines of the transform above 0 Hz to one below half the sampling frequency."""
    first, last = APART * RATE / size, RATE / 2 - 1.01 * RATE / size
    frequency = first + where * (last - first)
    tone = 2.0 * np.exp(1j * phase)
    fit = fit_tones(record(size, {frequency: tone}, mean), RATE, [frequency])
    assert fit.distinct.all()
    # Round-off of the mean, at most 100 times a few eps.
    np.testing.assert_allclose(fit.amplitudes[0], tone, atol=1e-10)


@settings(max_examples=50)
@given(
    steps=st.lists(st.floats(APART, 4.0), min_size=1, max_size=20),
    seed=st.integers(0, 1000),
)
def test_tones_two_lines_apart_do_not_touch_each_other(steps: list[float], seed: int) -> None:
    """Amplitudes over six decades; S being 3 % at most, the fit is well conditioned."""
    size = 400
    frequency = (10.0 + np.cumsum(steps)) * RATE / size
    draw = np.random.default_rng(seed)
    values = 10.0 ** draw.uniform(-6, 0, len(steps)) * np.exp(2j * np.pi * draw.random(len(steps)))
    tones = dict(zip(frequency.tolist(), values.tolist(), strict=True))
    order = draw.permutation(len(steps))
    fit = fit_tones(record(size, tones), RATE, frequency[order])
    assert fit.distinct.all()
    np.testing.assert_allclose(fit.amplitudes[:, 0], values[order], atol=1e-12)


def test_tones_nearer_than_two_lines_are_read_together() -> None:
    """Half a line apart and of opposite phase: what they make together, next to a third."""
    size = 1000
    tones = {100.0: 1.0 + 0j, 100.5: -1.0 + 0j, 110.0: 0.5j}
    fit = fit_tones(record(size, tones), RATE, list(tones))
    assert fit.distinct.tolist() == [False, False, True]
    np.testing.assert_allclose(fit.amplitudes[2, 0], 0.5j, atol=1e-6)
    alone = fit_tones(record(size, {100.0: 1.0, 100.5: -1.0}), RATE, [100.0])
    assert abs(fit.amplitudes[0, 0]) == pytest.approx(abs(alone.amplitudes[0, 0]), abs=2e-3)


def test_a_tone_with_less_than_two_periods_is_not_told_from_the_mean() -> None:
    fit = fit_tones(record(1000, {1.5: 1.0, 50.0: 2.0}, 1e3), RATE, [1.5, 50.0])
    assert fit.distinct.tolist() == [False, True]
    assert abs(fit.amplitudes[1, 0]) == pytest.approx(2.0, abs=1e-6)
    assert abs(fit.amplitudes[0, 0]) < 3.0  # bounded by what is left without the mean


def test_noise_spreads_amplitudes_as_theory_says() -> None:
    """Var Re z = var Im z = 2σ² Σw²/(Σw)² = 3σ²/n of white noise with a Hann window.

    400 channels of two parts each: the estimate of the variance has a relative spread of
    √(2/800) = 5 %, a quarter is five of it.
    """
    size, sigma, channels = 2000, 0.1, 400
    noise = sigma * np.random.default_rng(3).standard_normal((size, channels))
    fit = fit_tones(noise + record(size, {123.4: 1.0}), RATE, [123.4])
    error = fit.amplitudes[0] - 1.0
    assert np.mean(np.abs(error) ** 2) / 2.0 == pytest.approx(3.0 * sigma**2 / size, rel=0.25)


def test_what_is_not_listed_is_kept_out_by_the_window() -> None:
    """Hann's side lobes: |S(m)|/S(0) ≤ 1/(π m (m² − 1)) m lines off."""
    size, off = 1000, 10.5
    fit = fit_tones(record(size, {200.0: 1.0, 200.0 + off: 1.0}), RATE, [200.0])
    bound = 1.0 / (math.pi * off * (off**2 - 1.0))
    assert abs(fit.amplitudes[0, 0] - 1.0) < 1.1 * bound  # and its image, 400 lines off


def test_long_records_are_read_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    samples = record(5000, {123.456: 1.0 - 2.0j, 300.1: 0.1}, 5.0)
    whole = fit_tones(samples, RATE, [123.456, 300.1])
    monkeypatch.setattr(line_fit, "BLOCK", 64)
    monkeypatch.setattr(line_fit, "SEGMENT", 192)
    pieces = fit_tones(samples, RATE, [123.456, 300.1])
    np.testing.assert_allclose(pieces.amplitudes, whole.amplitudes, atol=1e-12)
    np.testing.assert_allclose(whole.amplitudes[:, 0], [1.0 - 2.0j, 0.1], atol=1e-12)


def test_wrong_frequencies_and_records_are_refused() -> None:
    for frequency in (0.0, -1.0, 500.1, math.nan):
        with pytest.raises(ModelError, match="is not above 0 and up to half"):
            fit_tones(np.ones((100, 1)), RATE, [frequency])
    with pytest.raises(ModelError, match=r"shape \(3, 1\)"):
        fit_tones(np.ones((3, 1)), RATE, [1.0])

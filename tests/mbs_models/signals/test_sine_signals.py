"""Stepped and swept sines and the half sine against their closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.signals.sines import HalfSine, SteppedSine, Sweep, stepped_sine

BAND = (20.0, 500.0)


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("down", [False, True])
def test_sweep_has_its_instantaneous_frequency(logarithmic: bool, down: bool) -> None:
    """φ'/2π from f'/√(A² − f²) by central differences, whose error is (2π f h)²/6 = 7e-6."""
    sweep = Sweep(*BAND, duration=4.0, amplitude=3.0, logarithmic=logarithmic, down=down)
    time, h = np.linspace(0.1, 3.9, 4001), 2e-6
    value = sweep.values(time)
    slope = (sweep.values(time + h) - sweep.values(time - h)) / (2.0 * h)
    steep = np.abs(value) < 2.0  # near the peaks the quotient is 0/0
    found = np.abs(slope[steep]) / np.sqrt(9.0 - value[steep] ** 2) / (2.0 * np.pi)
    np.testing.assert_allclose(found, sweep.instantaneous_frequency(time[steep]), rtol=2e-5)


def test_sweep_passes_its_band() -> None:
    ends = np.array([0.0, 4.0])
    for logarithmic in (False, True):
        up = Sweep(*BAND, 4.0, 1.0, logarithmic=logarithmic)
        down = Sweep(*BAND, 4.0, 1.0, logarithmic=logarithmic, down=True)
        np.testing.assert_allclose(up.instantaneous_frequency(ends), BAND, rtol=1e-14)
        np.testing.assert_allclose(down.instantaneous_frequency(ends), BAND[::-1], rtol=1e-14)
    middle = np.array([2.0])
    logarithmic_sweep = Sweep(*BAND, 4.0, 1.0, logarithmic=True)
    assert logarithmic_sweep.instantaneous_frequency(middle) == pytest.approx(np.sqrt(20.0 * 500.0))
    assert Sweep(*BAND, 4.0, 1.0).instantaneous_frequency(middle) == pytest.approx(260.0)


def test_sweep_is_a_linear_chirp() -> None:
    from scipy.signal import chirp

    time = np.linspace(0.0, 4.0, 1000)
    for logarithmic, method in ((False, "linear"), (True, "logarithmic")):
        sweep = Sweep(*BAND, 4.0, 2.0, logarithmic=logarithmic)
        expected = 2.0 * chirp(time, 20.0, 4.0, 500.0, method, phi=-90.0)
        # up to 6500 rad: their round-off
        np.testing.assert_allclose(sweep.values(time), expected, atol=1e-10)


def test_taper_and_ends() -> None:
    plain = Sweep(*BAND, 4.0, 1.0)
    tapered = Sweep(*BAND, 4.0, 1.0, taper=0.5)
    time = np.linspace(-1.0, 5.0, 601)
    outside = (time < 0.0) | (time > 4.0)
    assert not plain.values(time)[outside].any()
    middle = (time > 0.51) & (time < 3.49)
    np.testing.assert_array_equal(tapered.values(time)[middle], plain.values(time)[middle])
    quarter = np.array([0.25, 3.75])  # half way up a half cosine
    np.testing.assert_allclose(tapered.values(quarter), 0.5 * plain.values(quarter), rtol=1e-12)


@given(
    frequencies=st.lists(st.floats(1.0, 100.0), min_size=1, max_size=6),
    dwell=st.floats(0.05, 2.0),
)
def test_stepped_sine_is_continuous_and_holds_each_frequency(
    frequencies: list[float], dwell: float
) -> None:
    signal = SteppedSine(tuple(frequencies), (dwell,) * len(frequencies), 2.0)
    assert signal.duration == pytest.approx(dwell * len(frequencies))
    cycles = 0.0
    for start, frequency in zip(signal.starts, frequencies, strict=True):
        inside = start + np.linspace(0.001, 0.999, 20) * dwell
        expected = 2.0 * np.sin(2.0 * np.pi * (cycles + frequency * (inside - start)))
        np.testing.assert_allclose(signal.values(inside), expected, atol=1e-9)
        assert (signal.instantaneous_frequency(inside) == frequency).all()
        cycles += frequency * dwell
    # across a step in frequency the sine moves by no more than its slope
    across = np.stack([signal.starts[1:] - 1e-9, signal.starts[1:] + 1e-9])
    jump = np.abs(np.diff(signal.values(across), axis=0))
    assert (jump <= 2.0 * 2.0 * np.pi * 100.0 * 2e-9 + 1e-12).all()


def test_steps_of_whole_periods() -> None:
    signal = stepped_sine((10.0, 20.0), 1.0, periods=5, ramp=0.1)
    assert signal.dwells == (0.5, 0.25)
    assert signal.band == (10.0, 20.0)
    assert signal.values(np.array([0.0, 0.75, 0.8])) == pytest.approx(np.zeros(3))
    # within the ramps f = r A sin φ; between them r = 1
    assert signal.values(np.array([0.05 + 0.025])) == pytest.approx(
        (1.0 - np.cos(np.pi * 0.75)) / 2.0 * np.sin(2.0 * np.pi * 10.0 * 0.075)
    )


def test_half_sine_spectrum() -> None:
    """Trapezoidal rule over the blow; it errs by (πfh)²/3 at most, h = τ/20000: 1e-7 of F(0)."""
    blow = HalfSine(peak=7.0, contact_time=2e-3, start=0.01)
    time = 0.01 + np.linspace(0.0, 2e-3, 20_001)
    values = blow.values(time)
    at_zero = 2.0 * 7.0 * 2e-3 / np.pi
    for frequency in (0.0, 100.0, 260.0, 500.0, 740.0, 1000.0, 1300.0):
        transform = np.trapezoid(values * np.exp(-2j * np.pi * frequency * time), time)
        x = frequency * 2e-3
        expected = at_zero * abs(np.cos(np.pi * x) / (1.0 - (2.0 * x) ** 2))
        assert abs(transform) == pytest.approx(expected, abs=1e-7 * at_zero)
    low, high = blow.band
    assert low == 0.0
    assert high == pytest.approx(750.0)
    first_zero = np.trapezoid(values * np.exp(-2j * np.pi * 750.0 * time), time)
    assert abs(first_zero) < 1e-7 * at_zero
    at_reciprocal = abs(np.trapezoid(values * np.exp(-2j * np.pi * 500.0 * time), time))
    assert 20.0 * np.log10(at_reciprocal / at_zero) == pytest.approx(-9.54, abs=0.01)


def test_half_sine_is_zero_but_for_the_contact() -> None:
    blow = HalfSine(1.0, 0.1, 0.5)
    assert not blow.values(np.array([0.0, 0.49, 0.61, 0.7])).any()
    # 0.6 − 0.5 is 0.1 to 1e-15
    np.testing.assert_allclose(blow.values(np.array([0.5, 0.55, 0.6])), [0, 1, 0], atol=1e-14)
    assert blow.duration == 0.6


BAD = [
    (lambda: Sweep(20.0, 10.0, 1.0, 1.0), "sweep: fmin = 20 Hz: must be less than fmax = 10 Hz"),
    (lambda: Sweep(-1.0, 10.0, 1.0, 1.0), "sweep: fmin = -1 Hz"),
    (lambda: Sweep(1.0, np.inf, 1.0, 1.0), "sweep: fmax = inf Hz"),
    (lambda: Sweep(1.0, 2.0, 0.0, 1.0), "sweep: duration = 0 s"),
    (lambda: Sweep(1.0, 2.0, 0.5, 1.0), "sweep: duration = 0.5 s: is 0.75 of a period"),
    (lambda: Sweep(10.0, 20.0, 1.0, 0.0), "sweep: amplitude = 0 N"),
    (lambda: Sweep(10.0, 20.0, 1.0, 1.0, taper=0.6), "sweep: taper = 0.6 s: must be at most half"),
    (lambda: Sweep(10.0, 20.0, 1.0, 1.0, taper=-0.1), "sweep: taper = -0.1 s"),
    (lambda: SteppedSine((), (), 1.0), "stepped-sine: 0 frequencies"),
    (lambda: SteppedSine((1.0,), (1.0, 2.0), 1.0), "1 frequencies and 2 dwells"),
    (lambda: SteppedSine((0.0,), (1.0,), 1.0), "stepped-sine: frequencies = 0 Hz"),
    (lambda: SteppedSine((1.0,), (-1.0,), 1.0), "stepped-sine: dwell = -1 s"),
    (lambda: SteppedSine((1.0,), (1.0,), 0.0), "stepped-sine: amplitude = 0 N"),
    (lambda: SteppedSine((1.0,), (1.0,), 1.0, ramp=0.6), "stepped-sine: ramp = 0.6 s"),
    (lambda: stepped_sine((1.0,), 1.0, periods=0.0), "stepped-sine: periods = 0"),
    (lambda: stepped_sine((0.0,), 1.0, periods=1.0), "stepped-sine: frequencies = 0 Hz"),
    (lambda: HalfSine(0.0, 1.0), "impulse: amplitude = 0 N"),
    (lambda: HalfSine(1.0, 0.0), "impulse: contact_time = 0 s"),
    (lambda: HalfSine(1.0, 1.0, -1.0), "impulse: start = -1 s"),
    (lambda: HalfSine(1.0, np.nan), "impulse: contact_time = nan s"),
]


@pytest.mark.parametrize(("build", "words"), BAD)
def test_signals_that_are_none(build: object, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        build()  # type: ignore[operator]
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)

"""Periodic signals and noise against closed forms and their own discrete Fourier transforms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.signals.lines import (
    BandNoise,
    Harmonic,
    Multisine,
    fitted_spacing,
    own_seeds,
    random_multisine,
    schroeder_multisine,
)


def written_down(signal: Multisine, time: np.ndarray) -> np.ndarray:
    """The sum as its equation has it, line by line."""
    cycles = np.multiply.outer(np.mod(time, signal.period) / signal.period, signal.harmonics)
    angles = 2.0 * np.pi * np.mod(cycles, 1.0) + signal.phases
    return np.asarray(np.cos(angles) @ signal.amplitudes)


def test_harmonic() -> None:
    signal = Harmonic(2.0, 50.0, np.pi / 3.0)
    np.testing.assert_allclose(
        signal.values(np.array([0.0, 0.005, 0.01])),
        2.0 * np.cos(np.pi / 3.0 + np.array([0.0, np.pi / 2.0, np.pi])),
        rtol=0.0,
        atol=1e-14,
    )
    assert signal.period == 0.02
    assert signal.band == (50.0, 50.0)


@given(
    first=st.integers(1, 300),
    count=st.integers(1, 400),
    period=st.floats(0.01, 50.0),
    late=st.integers(0, 1000),
    seed=st.integers(0, 2**31),
)
def test_multisine_is_its_sum_at_any_instant(
    first: int, count: int, period: float, late: int, seed: int
) -> None:
    """A time is known to one part in 2^53 of the period, which turns the highest line by so much.

    That is 2π k ε of each amplitude at most, beside the round-off of a sum of n terms.
    """
    rng = np.random.default_rng(seed)
    harmonics = np.arange(first, first + count)
    signal = Multisine(
        period, harmonics, rng.uniform(0.1, 1.0, count), rng.uniform(0.0, 2.0 * np.pi, count)
    )
    time = rng.uniform(0.0, period, (3, 7)) + late * period
    allowed = signal.amplitudes.sum() * np.finfo(float).eps * (2.0 * np.pi * harmonics[-1] + 100.0)
    np.testing.assert_allclose(signal.values(time), written_down(signal, time), 0.0, allowed)


def test_multisine_has_its_lines_and_no_others() -> None:
    signal = random_multisine(10.0, 400.0, 0.5, 0.3, seed=7)
    count = 2048  # 1024 Hz
    spectrum = np.fft.rfft(signal.values(np.arange(count) * signal.period / count)) * 2 / count
    np.testing.assert_allclose(spectrum[20:801], signal.spectrum, rtol=0.0, atol=1e-12)
    others = np.delete(spectrum, np.arange(20, 801))
    assert np.abs(others).max() < 1e-12  # round-off of 781 lines of 0.3 N
    np.testing.assert_allclose(
        signal.samples(count), np.fft.irfft(spectrum * count / 2, count), atol=1e-11
    )


def test_values_of_a_long_signal_need_no_table_of_lines_by_instants() -> None:
    """400 000 lines at 10 000 instants would be 32 GB."""
    signal = random_multisine(10.0, 4000.0, 0.01, 1e-3, seed=1)
    time = np.linspace(0.0, 100.0, 10_000)
    values = signal.values(time)
    some = [0, 17, 9_999]
    # as above: Σ A = 399 N, k up to 400 000
    np.testing.assert_allclose(values[some], written_down(signal, time[some]), 0.0, 2e-7)


def test_values_do_not_depend_on_what_else_is_asked() -> None:
    """A run that goes on in pieces gets the same force to the last bit."""
    signal = schroeder_multisine(10.0, 4000.0, 1.0, 0.1)
    time = np.arange(30_000) / 1e5
    pieces = [signal.values(part) for part in np.split(time, [1, 777, 20_001])]
    np.testing.assert_array_equal(np.concatenate(pieces), signal.values(time))


def test_lines_are_the_multiples_within_the_band() -> None:
    signal = schroeder_multisine(10.0, 20.0, 3.0, 1.0)
    np.testing.assert_allclose(signal.frequency, [12.0, 15.0, 18.0])


@given(
    duration=st.floats(0.5, 500.0),
    df=st.floats(0.01, 20.0),
    rate=st.none() | st.integers(10_000, 100_000).map(float),
)
def test_period_is_fitted_to_the_record(duration: float, df: float, rate: float | None) -> None:
    if duration * df < 1.0:
        with pytest.raises(ModelError, match="is shorter than one period"):
            fitted_spacing(duration, df, rate)
        return
    fitted = fitted_spacing(duration, df, rate)
    periods = duration * fitted
    if rate is None:
        assert fitted <= df * (1.0 + 1e-9)
        assert periods == pytest.approx(round(periods), rel=1e-9)
        assert (round(periods) + 1) / duration > df  # one more would be wider than asked for
    else:
        samples = rate / fitted
        assert samples == pytest.approx(round(samples), rel=1e-12)
        count = int(duration * df * (1.0 + 1e-9))
        assert 0 <= duration * rate - count * round(samples) < count + 1


def test_noise_is_flat_in_its_band_and_nothing_outside() -> None:
    """|c_k|² of n lines is exponentially distributed: a mean over m lines scatters by 1/√m.

    Six of those scatters is exceeded once in 10⁸ (nearly normal for m = 500).
    """
    signal = BandNoise(100.0, 1100.0, rms=3.0, period=20.0, seed=4)
    count = 65536  # 3276.8 Hz
    values = signal.values(np.arange(count) * 20.0 / count)
    power = np.abs(np.fft.rfft(values) / count) ** 2 * 2.0
    inside = power[2000:22001]
    assert np.sqrt(power.sum()) == pytest.approx(3.0, rel=1e-12)
    assert np.delete(power, np.arange(2000, 22001)).max() < 1e-24 * inside.max()
    bands = inside[:20_000].reshape(40, 500).mean(axis=1) * len(inside) / 9.0
    assert np.abs(bands - 1.0).max() < 6.0 / np.sqrt(500.0)
    # exponential: half of the lines below ln 2 of the mean, to 6 √(¼/n)
    below = np.mean(inside < np.log(2.0) * inside.mean())
    assert abs(below - 0.5) < 6.0 * 0.5 / np.sqrt(len(inside))


def test_noise_is_gaussian_and_its_seed_decides() -> None:
    """Kurtosis 3 to 6 √(24/n), n = 2 B T independent values (Kendall & Stuart)."""
    noise = BandNoise(10.0, 2000.0, rms=1.0, period=10.0, seed=1)
    time = np.arange(40_000) / 4000.0
    values = noise.values(time)
    independent = 2 * 1990 * 10
    assert abs(np.mean(values**4) - 3.0) < 6.0 * np.sqrt(24.0 / independent)
    np.testing.assert_array_equal(
        values, BandNoise(10.0, 2000.0, rms=1.0, period=10.0, seed=1).values(time)
    )
    other = BandNoise(10.0, 2000.0, rms=1.0, period=10.0, seed=2).values(time)
    assert abs(np.mean(values * other)) < 6.0 / np.sqrt(independent)


def test_each_input_has_its_own_seed() -> None:
    assert own_seeds(3, 4) == own_seeds(3, 4)
    assert len({*own_seeds(3, 4), *own_seeds(4, 4)}) == 8
    assert own_seeds(3, 2) == own_seeds(3, 4)[:2]  # a further input leaves the others as they are


def test_shared_lines_add_up_to_the_whole() -> None:
    whole = schroeder_multisine(10.0, 100.0, 1.0, 1.0)
    parts = [whole.share(i, 3) for i in range(3)]
    together = np.concatenate([part.harmonics for part in parts])
    assert sorted(together) == whole.harmonics.tolist()
    time = np.linspace(0.0, 1.0, 50)
    total = sum(part.values(time) for part in parts)
    np.testing.assert_allclose(total, whole.values(time), atol=1e-11)


LINES = np.array([1, 2])
BAD = [
    (lambda: Harmonic(0.0, 1.0), "harmonic: amplitude = 0 N"),
    (lambda: Harmonic(1.0, -1.0), "harmonic: frequency = -1 Hz"),
    (lambda: Harmonic(1.0, 1.0, np.nan), "harmonic: phase = nan rad"),
    (lambda: Harmonic(np.inf, 1.0), "harmonic: amplitude = inf N"),
    (lambda: schroeder_multisine(20.0, 10.0, 1.0, 1.0), "fmin = 20 Hz: must be less than"),
    (lambda: schroeder_multisine(10.0, 10.0, 1.0, 1.0), "fmin = 10 Hz: must be less than"),
    (lambda: schroeder_multisine(-10.0, 10.0, 1.0, 1.0), "multisine: fmin = -10 Hz"),
    (lambda: schroeder_multisine(10.0, np.nan, 1.0, 1.0), "multisine: fmax = nan Hz"),
    (lambda: schroeder_multisine(10.0, 20.0, 0.0, 1.0), "multisine: df = 0 Hz"),
    (lambda: schroeder_multisine(10.0, 20.0, 50.0, 1.0), "no multiple of 50 Hz"),
    (lambda: schroeder_multisine(10.0, 20.0, 1e-7, 1.0), "at most line 5000000"),
    (lambda: schroeder_multisine(10.0, 20.0, 1.0, 0.0), "multisine: amplitude = 0 N"),
    (lambda: random_multisine(10.0, 20.0, 1.0, 1.0, -1), "multisine: seed = -1"),
    (lambda: fitted_spacing(0.5, 1.0), "record of 0.5 s is shorter than one period of 1 s"),
    (lambda: fitted_spacing(0.0, 1.0), "multisine: duration = 0 s"),
    (lambda: BandNoise(10.0, 5.0, 1.0, 1.0), "noise: fmin = 10 Hz: must be less than"),
    (lambda: BandNoise(10.0, 20.0, 0.0, 1.0), "noise: amplitude = 0 N"),
    (lambda: BandNoise(10.0, 20.0, 1.0, 0.0), "noise: period = 0 s"),
    (lambda: BandNoise(10.0, 20.0, 1.0, 0.01), "noise: no multiple of 100 Hz"),
    (lambda: BandNoise(10.0, 4000.0, 1.0, 3600.0), "use a period of 1250 s or less"),
    (lambda: BandNoise(10.0, 20.0, 1.0, 1.0, -3), "noise: seed = -3"),
    (lambda: Multisine(1.0, LINES, np.ones(1), np.zeros(2)), "2 harmonics, 1 amplitudes"),
    (lambda: Multisine(1.0, LINES - 1, np.ones(2), np.zeros(2)), "from 1 on"),
    (lambda: Multisine(1.0, LINES, np.ones(2), np.array([0.0, np.nan])), "must be finite"),
    (lambda: schroeder_multisine(1.0, 2.0, 1.0, 1.0).share(0, 3), "cannot be shared out"),
]


@pytest.mark.parametrize(("build", "words"), BAD)
def test_signals_that_are_none(build: object, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        build()  # type: ignore[operator]
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)

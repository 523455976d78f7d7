"""Spectra against closed forms, Parseval and scipy.signal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from fbs import FbsError, NonFiniteError
from fbs.signal.spectra import (
    Window,
    amplitude_spectrum,
    line_amplitudes,
    power_spectral_density,
    rms,
    spectrogram,
)

FS, N = 4096.0, 4096  # lines every hertz
TIME = np.arange(N) / FS
NOISE = np.random.default_rng(1).standard_normal((3 * N, 2))
WINDOWS: tuple[Window, ...] = ("boxcar", "hann", "flattop")


@pytest.mark.parametrize("window", WINDOWS)
@given(
    line=st.integers(5, N // 2 - 5),  # flattop's half width from 0 Hz and Nyquist
    amplitude=st.floats(1e-9, 1e9),
    phase=st.floats(-np.pi, np.pi),
)
def test_sine_on_a_line_reads_its_amplitude(
    window: Any, line: int, amplitude: float, phase: float
) -> None:
    x = amplitude * np.cos(2 * np.pi * line * TIME + phase)
    spectrum = amplitude_spectrum(x, FS, window=window)
    assert spectrum.frequency[line] == line
    # rounding of the 4096 samples' angles, up to 2 pi 2048 eps each
    assert spectrum.values[line] == pytest.approx(amplitude, rel=1e-12)
    assert np.abs(spectrum.values - amplitude * (np.arange(N // 2 + 1) == line)).max() <= (
        amplitude * (0.5 * (window == "hann") + 0.97 * (window == "flattop") + 1e-12)
    )  # the window's own side lines: 1/2, and 0.2773/0.2156/0.0836/0.0069 over 0.2156, halved


@pytest.mark.parametrize(("window", "worst"), [("hann", 0.152), ("flattop", 0.0012)])
def test_line_between_two_bins_loses_what_the_window_takes(window: Window, worst: float) -> None:
    # scalloping (Harris 1978, Table 1): hann 1.42 dB, flat-top 0.01 dB
    x = np.cos(2 * np.pi * 700.5 * TIME)
    loss = 1 - amplitude_spectrum(x, FS, window=window).values.max()
    assert 0 < abs(loss) < worst


def test_mean_and_nyquist_have_no_mirror_image() -> None:
    x = 3.0 + 2.0 * (-1.0) ** np.arange(N)
    values = amplitude_spectrum(x, FS, window="boxcar").values
    assert values[[0, -1]] == pytest.approx([3.0, 2.0], rel=1e-14)


@pytest.mark.parametrize("window", WINDOWS)
@pytest.mark.parametrize("size", [1000, 1001])
def test_density_is_scipys_welch(window: Any, size: int) -> None:
    ours = power_spectral_density(NOISE, FS, resolution=FS / size, window=window, overlap=0.5)
    frequency, theirs = scipy.signal.welch(
        NOISE, FS, window, size, size - round(size / 2), axis=0, detrend=False
    )
    assert ours.frequency == pytest.approx(frequency, rel=1e-14)
    assert ours.values == pytest.approx(theirs, rel=1e-11)


@pytest.mark.parametrize("window", WINDOWS)
def test_amplitudes_are_scipys_power_spectrum(window: Any) -> None:
    ours = amplitude_spectrum(NOISE, FS, resolution=4.0, window=window, overlap=0.5)
    _, power = scipy.signal.welch(
        NOISE, FS, window, 1024, 512, axis=0, detrend=False, scaling="spectrum"
    )
    power[1:-1] *= 2.0  # of a sine A^2 / 2; the ends have no mirror image
    assert ours.values == pytest.approx(np.sqrt(power), rel=1e-11)


def test_spectrogram_is_scipys() -> None:
    ours = spectrogram(NOISE[:, 0], FS, resolution=16.0, overlap=0.75)
    transform = scipy.signal.ShortTimeFFT(
        scipy.signal.get_window("hann", 256), 64, FS, fft_mode="onesided", scale_to="magnitude"
    )
    first = round(128 / 64)  # scipy's slices are centred on t = 0; ours begin there
    theirs = np.abs(transform.stft(NOISE[:, 0]))[:, first - transform.p_min :]
    twice = np.full(129, 2.0)
    twice[[0, -1]] = 1.0
    count = len(ours.time)
    assert ours.time == pytest.approx((first + np.arange(count)) * 64 / FS)
    assert ours.values == pytest.approx((twice[:, None] * theirs[:, :count]).T, rel=1e-10)


def test_white_noise_has_its_density() -> None:
    # sigma^2 = 1 over fs / 2; 382 averages of 2 channels: 5 % of a line, over 1000 lines 0.2 %
    noise = np.random.default_rng(2).standard_normal((1 << 19, 2))
    spectrum = power_spectral_density(noise, FS, resolution=2.0)
    assert spectrum.values.mean() == pytest.approx(2.0 / FS, rel=0.01)


def test_density_and_amplitude_of_one_line_agree() -> None:
    x = 5.0 * np.cos(2 * np.pi * 300 * TIME)
    for window in WINDOWS:
        amplitude = amplitude_spectrum(x, FS, window=window)
        density = power_spectral_density(x, FS, window=window)
        power = density.values[300] * density.noise_bandwidth
        assert power == pytest.approx(amplitude.values[300] ** 2 / 2, rel=1e-12)
        assert power == pytest.approx(12.5, rel=1e-12)


@given(
    seed=st.integers(0, 10**6),
    n=st.integers(8, 501),
    split=st.floats(0.05, 0.45),
    scale=st.floats(1e-6, 1e6),
)
def test_parseval(seed: int, n: int, split: float, scale: float) -> None:
    x = scale * np.random.default_rng(seed).standard_normal((n, 2))
    total = np.sqrt(np.mean(x**2, axis=0))
    assert rms(x, FS) == pytest.approx(total, rel=1e-13)
    assert rms(x, FS, (0.0, FS / 2)) == pytest.approx(total, rel=1e-12)
    edge = np.floor(split * n) * FS / n + 0.5 * FS / n  # between two lines
    low, high = rms(x, FS, (0.0, edge)), rms(x, FS, (edge, FS / 2))
    assert np.hypot(low, high) == pytest.approx(total, rel=1e-12)
    density = power_spectral_density(x, FS, window="boxcar")
    assert density.values.sum(axis=0) * FS / n == pytest.approx(total**2, rel=1e-12)


def test_rms_of_a_band_holds_the_sines_in_it() -> None:
    x = 1.0 + 3.0 * np.cos(2 * np.pi * 100 * TIME) + 4.0 * np.sin(2 * np.pi * 900 * TIME)
    assert rms(x, FS, (50, 200)) == pytest.approx(3 / np.sqrt(2), rel=1e-12)
    assert rms(x, FS, (50, 1000)) == pytest.approx(5 / np.sqrt(2), rel=1e-12)
    assert rms(x, FS) == pytest.approx(np.sqrt(13.5), rel=1e-12)


@given(offset=st.floats(-0.5, 0.5), phase=st.floats(-3.0, 3.0), window=st.sampled_from(WINDOWS[1:]))
def test_known_line_off_the_bins_reads_amplitude_and_phase(
    offset: float, phase: float, window: Any
) -> None:
    line = 700.0 + offset
    x = np.cos(2 * np.pi * line * TIME + phase)[:, None] * [2.0, 3.0]
    values = line_amplitudes(x, FS, [line], window=window)
    # the mirror image at -f leaks: 1400 lines away hann is below 1400^-3, flattop below 1e-5
    exact = np.exp(1j * phase) * np.array([[2.0, 3.0]])
    assert np.abs(values - exact).max() < 3.0 * {"hann": 1400.0**-3, "flattop": 2e-5}[window]


def test_further_axes_are_kept() -> None:
    spectrum = amplitude_spectrum(NOISE.reshape(-1, 2, 1), FS, resolution=8.0)
    flat = amplitude_spectrum(NOISE, FS, resolution=8.0)
    assert spectrum.values.shape == (257, 2, 1)
    assert np.array_equal(spectrum.values[:, :, 0], flat.values)
    assert flat.n_averages == 1 + (3 * N - 512) // 256


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"resolution": 0.1}, "need 40960 samples, the record has 12288"),
        ({"resolution": 2000.0}, "at most a quarter"),
        ({"resolution": -1.0}, "above 0"),
        ({"overlap": 1.0}, "overlap must be"),
        ({"window": "hamming"}, "window must be one of 'boxcar', 'hann', 'flattop', got 'hamming'"),
    ],
)
def test_impossible_cuts_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(FbsError, match=message):
        amplitude_spectrum(NOISE, FS, **change)


def test_bad_samples_are_named() -> None:
    broken = NOISE.copy()
    broken[7, 1] = np.nan
    with pytest.raises(NonFiniteError, match=r"nan at sample 7, channel 1 \(1 values"):
        rms(broken, FS)
    with pytest.raises(FbsError, match="must be real"):
        rms(NOISE + 0j, FS)
    with pytest.raises(FbsError, match="2 samples or more"):
        rms([1.0], FS)
    with pytest.raises(FbsError, match="positive and finite"):
        rms(NOISE, 0.0, (1.0, 2.0))
    with pytest.raises(FbsError, match="one channel"):
        spectrogram(NOISE, FS, resolution=8.0)
    with pytest.raises(FbsError, match="no line between 3000 and 3001"):
        rms(NOISE, FS, (3000, 3001))
    with pytest.raises(FbsError, match="below the Nyquist frequency 2048"):
        line_amplitudes(NOISE, FS, [2048.0])

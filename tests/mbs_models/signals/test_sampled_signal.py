"""A record from a file: between its samples, at its ends, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.fft import next_fast_len

from mbs_models.errors import ModelError
from mbs_models.signals.line_sum import fast_length
from mbs_models.signals.sampled import Sampled, read_sampled


def burst(time: np.ndarray) -> np.ndarray:
    """A Gaussian burst of 100 Hz: e^−69 of its peak at 0 s and 1 s; e^−(0.06π Δf)² Δf away."""
    return np.exp(-(((time - 0.5) / 0.06) ** 2)) * np.sin(2.0 * np.pi * 100.0 * time)


def test_a_band_limited_record_is_itself_between_its_samples() -> None:
    """Straight lines would be (π f/fs)²/2 = 12 % wrong at 100 of 640 Hz."""
    signal = Sampled(640.0, burst(np.arange(641) / 640.0))
    time = np.random.default_rng(1).uniform(0.0, 1.0, 500)
    np.testing.assert_allclose(signal.values(time), burst(time), atol=1e-12)
    assert signal.duration == 1.0
    # Its power is normally distributed over frequency, σ = 1/(2π 0.06) Hz: half a millionth lies
    # beyond 4.892 σ. The record's lines are 0.5 Hz apart.
    beyond = 4.892 / (2.0 * np.pi * 0.06)
    assert signal.band == pytest.approx((100.0 - beyond, 100.0 + beyond), abs=0.5)


def test_samples_are_kept_whatever_they_are() -> None:
    samples = np.random.default_rng(3).standard_normal(1001)
    signal = Sampled(51200.0, samples)
    np.testing.assert_allclose(signal.values(np.arange(1001) / 51200.0), samples, atol=1e-11)


def test_nothing_before_and_after() -> None:
    signal = Sampled(10.0, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(signal.values(np.array([-0.01, 0.21, 5.0])), np.zeros(3))
    assert signal.values(np.array([0.2])) == pytest.approx(3.0)


FORMS = {
    "commas and a header": "time,force\n0.0,1.0\n0.1,2.0\n0.2,-1.0\n",
    "semicolons": "0.0;1.0\n0.1;2.0\n0.2;-1.0",
    "tabs, a comment, a blank line": "# from the bench\n\nt\tF\n0\t1\n0.1\t2\n0.2\t-1\n",
    "blanks and a third column": " 5.0  1.0 9\n 5.1  2.0 9\n 5.2 -1.0 9\n",
    "a mark of Excel's": "\ufefftime [s], force [N]\r\n0.0, 1.0\r\n0.1, 2.0\r\n0.2, -1.0\r\n",
}


@pytest.mark.parametrize("text", FORMS.values(), ids=FORMS)
def test_forms_of_a_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "force.csv"
    path.write_text(text, encoding="utf-8", newline="")
    signal = read_sampled(path, scale=2.0)
    assert signal.sampling_frequency == 10.0
    np.testing.assert_array_equal(signal.samples, [2.0, 4.0, -2.0])


def test_a_time_column_of_few_digits_is_uniform(tmp_path: Path) -> None:
    """Seven decimals of 1/51200 s are 2.5e-3 steps off at most; nine are 2.5e-5."""
    path = tmp_path / "force.csv"
    lines = [f"{n / 51200.0:.9f},{n % 7}" for n in range(2000)]
    path.write_text("\n".join(lines))
    assert read_sampled(path).sampling_frequency == 51200.0


BAD = [
    ("", "it has 0 samples; must be at least 2 lines"),
    ("time,force\n0.0,1.0\n", "it has 1 samples"),
    ("0.0,1.0\n0.1,x\n", "line 2 must be two numbers"),
    ("0.0,1.0\n0.1\n", "line 2 must be two numbers"),
    ("0.0,1.0\n0.1,nan\n", "sample 1 is nan; must be finite"),
    ("0.0,1.0\nnan,1.0\n", "the time of sample 1 is nan"),
    ("0.0,0.0\n0.1,0.0\n", "every sample is 0 N"),
    ("0.1,1.0\n0.0,1.0\n", "must ascend"),
    (
        "0.0,1.0\n0.1,1.0\n0.2,1.0\n0.35,1.0\n0.4,1.0\n0.5,1.0\n",
        "time is not uniform: sample 3 is at 0.35 s, 0.15 s after the one before, where 0.1 s is "
        "usual",
    ),
]


@pytest.mark.parametrize(("text", "words"), BAD)
def test_files_that_are_no_record(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "force.csv"
    path.write_text(text)
    with pytest.raises(ModelError) as caught:
        read_sampled(path)
    message = str(caught.value)
    assert message.startswith(f"record {path}: ")
    assert words in message
    assert "\n" not in message


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="cannot be read: No such file"):
        read_sampled(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ModelError, match="not a text file in UTF-8"):
        read_sampled(tmp_path / "binary.csv")


def test_a_fast_length_is_scipys() -> None:
    lengths = [*range(1, 2000), 4097, 65_537, 999_983, 10_000_019]
    assert [fast_length(n) for n in lengths] == [next_fast_len(n, real=True) for n in lengths]

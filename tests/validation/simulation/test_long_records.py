"""Records longer than memory: what is taken of them piece by piece, and how much memory that is."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.lines import BandNoise
from validation.report.publish import publish
from validation.simulation.long_records import (
    PIECE,
    channels,
    odd_channels,
    thinned,
    thinned_places,
)
from validation.simulation.options import Options
from validation.simulation.run import run_simulation

RNG = np.random.default_rng(5)


def test_all_channels_are_not_copied() -> None:
    samples = RNG.standard_normal((10, 3))
    assert channels(samples, [0, 1, 2], None) is samples
    assert np.array_equal(channels(samples, [2, 0], None), samples[:, [2, 0]])


def test_the_odd_part_of_two_runs_over_several_pieces(tmp_path: Path) -> None:
    """x₊ = odd + even, x₋ = −odd + even: both come back, from memory and from a file."""
    count = 2 * PIECE + 17
    odd, even = RNG.standard_normal((count, 80)), 1e-3 * RNG.standard_normal((count, 80))
    columns = list(range(79, 0, -1))
    for scratch in (None, tmp_path):
        found, share = odd_channels(odd + even, even - odd, columns, scratch)
        # One rounding of each sum: 2e-16 of the samples, up to 6.
        assert np.abs(found - odd[:, columns]).max() < 1e-14
        expected = np.abs(even[:, columns]).max() / np.abs(odd[:, columns]).max()
        assert share == pytest.approx(expected, rel=1e-9)
    assert isinstance(found, np.memmap)  # 83 MB: too much for memory
    assert list(tmp_path.iterdir()) == []


def test_thinned_samples_keep_every_extreme() -> None:
    samples = RNG.standard_normal(10_001)
    kept, places = thinned(samples, 100), thinned_places(samples.size, 100)
    assert kept.shape == places.shape == (200,)
    for number, first in enumerate(places[::2]):
        stretch = samples[first : places[2 * number + 2] if number < 99 else None]
        assert (kept[2 * number], kept[2 * number + 1]) == (stretch.min(), stretch.max())
    few = samples[:150]
    assert np.array_equal(thinned(few, 100), few)
    assert np.array_equal(thinned_places(150, 100), np.arange(150))


class Watched:
    """The largest anonymous memory of this process while it is watched (bytes).

    Pages of files, which the system drops when it needs room, do not count.
    """

    def __enter__(self) -> Watched:
        self.before = self.largest = _anonymous()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._stop.is_set():
            self.largest = max(self.largest, _anonymous())
            time.sleep(0.005)

    @property
    def grown(self) -> int:
        return self.largest - self.before


def _anonymous() -> int:
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("RssAnon"):
            return 1024 * int(line.split()[1])
    raise AssertionError("no RssAnon")


@pytest.mark.slow
# Only Linux tells memory from the pages of mapped files, which come and go as it likes.
@pytest.mark.skipif(sys.platform != "linux", reason="reads RssAnon off /proc")
def test_memory_does_not_grow_with_the_record(tmp_path: Path) -> None:
    """A record of 260 MB is run, estimated, drawn and written in a fraction of that.

    What grows with the record is the segment that is transformed at once, an eighth of it, up to
    2²³ samples of all channels: seven times as many as here. From there on, and to any length,
    segments are only added: 1 h stays below ten times what is measured here, 1 GiB.
    """
    with Watched() as warm:
        _run_and_write(tmp_path / "short", 2.0)  # modules are loaded, figures drawn once
    with Watched() as memory:
        stored = _run_and_write(tmp_path / "long", 70.0)
    assert warm.largest > 0
    assert stored > 250e6  # what is copied of it for the FRFs, in a file without a name, is more
    assert memory.grown < 0.1 * 2**30  # measured: 63 MB


def _run_and_write(directory: Path, duration: float) -> int:
    """Bytes on the disk of a run under noise that is reported there."""
    directory.mkdir()
    options = Options(
        excitations=(Excitation("planetary.sun.u", BandNoise(10.0, 400.0, 0.01, duration)),),
        duration=duration,
        reverse=False,
    )
    found = run_simulation(load("lin-parker-4"), options, store=directory / "pieces")
    publish(found, directory)
    return sum(path.stat().st_size for path in (directory / "pieces").rglob("*"))

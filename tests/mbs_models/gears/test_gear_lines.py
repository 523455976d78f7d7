"""Names and places of mesh lines, and reading them out of a spectrum."""

import numpy as np
import pytest

from mbs_models.errors import ModelError
from mbs_models.gears.gear_lines import MeshTone, gear_lines, measured_lines, mesh_tones
from mbs_models.model.model_file import load

PLANETARY = MeshTone("mesh planetary", 700.0, -10.0, 3)
PARALLEL = MeshTone("mesh reducer", 1234.0)


def test_names_count_planet_passes_or_turns_of_the_carrier() -> None:
    names = {
        (x.harmonic, x.offset): x.name
        for x in gear_lines([PLANETARY], harmonics=2, sidebands=6, highest=1e4)
    }
    assert len(names) == 2 * 13
    assert names[2, -3] == "2·mesh planetary − 1·planet pass"
    assert names[1, 6] == "1·mesh planetary + 2·planet pass"
    assert names[1, 2] == "1·mesh planetary + 2·carrier"
    assert names[1, 0] == "1·mesh planetary"
    shaft = gear_lines([MeshTone("mesh a", 900.0, 30.0)], harmonics=1, sidebands=1, highest=1e3)
    assert [x.name for x in shaft] == ["1·mesh a − 1·shaft", "1·mesh a", "1·mesh a + 1·shaft"]


def test_lines_ascend_up_to_the_highest() -> None:
    lines = gear_lines([PLANETARY, PARALLEL], harmonics=3, sidebands=1, highest=1400.0)
    assert [x.frequency for x in lines] == [690, 700, 710, 1234, 1390, 1400]
    assert [x.offset for x in lines] == [-1, 0, 1, 0, -1, 0]


def waves(rate: float, size: int, tones: dict[float, float]) -> np.ndarray:
    """(size, 1) of cosines, each with a phase of its own."""
    time = np.arange(size) / rate
    parts = [a * np.cos(2 * np.pi * f * time + f) for f, a in tones.items()]
    return np.asarray(np.sum(parts, axis=0))[:, None]


def test_lines_are_read_at_their_own_frequencies() -> None:
    """A record of 1.037 s: no line lies on one of its transform's."""
    rate = 8000.0
    tones = {690.0: 2.0, 700.0: 3.0, 1234.0: 4.0}
    lines = gear_lines([PLANETARY, PARALLEL], harmonics=1, sidebands=1, highest=1999.0)
    (read,) = measured_lines(lines, 17.0 + waves(rate, 8296, tones), rate)
    found = {x.name: x for x in read}
    below = found["1·mesh planetary − 1·carrier"]
    assert below.frequency == 690.0
    assert below.amplitude == pytest.approx(2.0, abs=1e-9)
    assert found["1·mesh planetary"].amplitude == pytest.approx(3.0, abs=1e-9)
    assert found["1·mesh planetary + 1·carrier"].amplitude == pytest.approx(0.0, abs=1e-9)
    assert found["1·mesh reducer"].amplitude == pytest.approx(4.0, abs=1e-9)
    assert all(x.distinct for x in read)


def test_lines_too_near_for_the_record_say_so() -> None:
    """0.1 s: lines 10 Hz apart are one, at whose frequencies all they make is read."""
    rate, size = 8000.0, 800
    lines = gear_lines([PLANETARY, PARALLEL], harmonics=1, sidebands=1, highest=1999.0)
    (read,) = measured_lines(lines, waves(rate, size, {700.0: 3.0, 1234.0: 4.0}), rate)
    assert [x.distinct for x in read] == [False, False, False, True]
    # Hann: one line of the transform beside a tone half of it is read.
    assert [x.amplitude for x in read[:3]] == pytest.approx([1.5, 3.0, 1.5], abs=2e-3)
    assert read[3].amplitude == pytest.approx(4.0, abs=1e-9)


def test_lines_of_two_meshes_may_be_one() -> None:
    """Twice one mesh frequency is once another: each reads the whole line, not half of it."""
    tones = [MeshTone("mesh a", 600.0), MeshTone("mesh b", 1200.0)]
    lines = gear_lines(tones, harmonics=2, sidebands=0, highest=1500.0)
    (read,) = measured_lines(lines, waves(8000.0, 8000, {600.0: 1.0, 1200.0: 5.0}), 8000.0)
    assert [x.name for x in read] == ["1·mesh a", "2·mesh a", "1·mesh b"]
    assert [x.amplitude for x in read] == pytest.approx([1.0, 5.0, 5.0], abs=1e-6)
    assert [x.distinct for x in read] == [True, False, False]


def test_tones_of_a_drivetrain() -> None:
    drivetrain = load("paper")
    speeds = {"planetary.carrier": 2 * np.pi * 5, "planetary.ring": -2 * np.pi * 1}
    (tone,) = mesh_tones(drivetrain, {"planetary": 420.0}, speeds)
    assert tone == MeshTone("mesh planetary", 420.0, pytest.approx(6.0), 4)  # type: ignore[arg-type]
    assert mesh_tones(drivetrain, {"reducer": 9.0}, {}) == (MeshTone("mesh reducer", 9.0),)


def test_what_does_not_fit_is_named() -> None:
    lines = gear_lines([PARALLEL], harmonics=1, sidebands=0, highest=1e4)
    with pytest.raises(
        ModelError, match=r"1·mesh reducer at 1234 Hz is not above 0 and up to.* 1000"
    ):
        measured_lines(lines, np.ones((100, 1)), 2000.0)
    with pytest.raises(ModelError, match=r"shape \(1000,\); \(n, n_channel\)"):
        measured_lines(lines, np.ones(1000), 8000.0)
    with pytest.raises(ModelError, match="not finite"):
        measured_lines(lines, np.full((1000, 1), np.nan), 8000.0)
    assert measured_lines((), np.ones((1000, 2)), 8000.0) == ((), ())

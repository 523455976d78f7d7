"""Names and places of mesh lines, and reading them out of a spectrum."""

import numpy as np
import pytest

from mbs_models.errors import ModelError
from mbs_models.meshing.gear_lines import MeshTone, gear_lines, measured_lines, mesh_tones
from mbs_models.model_file import load

PLANETARY = MeshTone("mesh planetary", 700.0, -10.0, 3)
PARALLEL = MeshTone("mesh reducer", 1234.0)


def test_names_count_planet_passes_or_turns_of_the_carrier():
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


def test_lines_ascend_up_to_the_highest():
    lines = gear_lines([PLANETARY, PARALLEL], harmonics=3, sidebands=1, highest=1400.0)
    assert [x.frequency for x in lines] == [690, 700, 710, 1234, 1390, 1400]
    assert [x.offset for x in lines] == [-1, 0, 1, 0, -1, 0]


def test_lines_are_read_with_their_neighbours():
    frequency = np.arange(0, 2000, 0.5)
    amplitude = np.full(len(frequency), 1e-3)
    amplitude[np.searchsorted(frequency, [690.5, 700.0, 1234.0])] = [2.0, 3.0, 4.0]
    lines = gear_lines([PLANETARY, PARALLEL], harmonics=1, sidebands=1, highest=1999.0)
    found = {x.name: x for x in measured_lines(lines, frequency, amplitude)}
    below = found["1·mesh planetary − 1·carrier"]
    assert (below.frequency, below.amplitude) == (690.5, 2.0)  # half a hertz is one line
    assert found["1·mesh planetary"].amplitude == 3.0
    assert found["1·mesh planetary + 1·carrier"].amplitude == 1e-3
    assert found["1·mesh reducer"].amplitude == 4.0
    assert all(x.distinct for x in found.values())


def test_lines_too_near_for_the_spectrum_say_so():
    frequency = np.arange(0, 2000, 4.0)
    lines = gear_lines([PLANETARY, PARALLEL], harmonics=1, sidebands=1, highest=1999.0)
    found = measured_lines(lines, frequency, np.ones(len(frequency)))
    assert [x.distinct for x in found] == [False, False, False, True]


def test_tones_of_a_drivetrain():
    drivetrain = load("paper")
    speeds = {"planetary.carrier": 2 * np.pi * 5, "planetary.ring": -2 * np.pi * 1}
    (tone,) = mesh_tones(drivetrain, {"planetary": 420.0}, speeds)
    assert tone == MeshTone("mesh planetary", 420.0, pytest.approx(6.0), 4)
    assert mesh_tones(drivetrain, {"reducer": 9.0}, {}) == (MeshTone("mesh reducer", 9.0),)


def test_what_does_not_fit_is_named():
    lines = gear_lines([PARALLEL], harmonics=1, sidebands=0, highest=1e4)
    axis = np.arange(0, 1000, 1.0)
    with pytest.raises(ModelError, match="1·mesh reducer at 1234 Hz is not between 0 and 999"):
        measured_lines(lines, axis, axis)
    with pytest.raises(ModelError, match="one channel"):
        measured_lines(lines, axis, np.ones((1000, 2)))

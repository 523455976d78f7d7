"""Universal files to and from pyuff and sdynpy: nodes, directions, units and values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff

from fbs import Frf, frequency_axis, read_uff, write_uff
from fbs.files.frf_files import read_frf, write_frf
from fbs.files.uff_functions import Channel

AXIS = frequency_axis(1, 40, 0.5)
LABELS = ("gear.pinion.w", "gear.pinion.y", "gear.wheel.z")
CHANNELS = {
    "gear.pinion.w": Channel(1, -6, radius=0.05),
    "gear.pinion.y": Channel(1, 2),
    "gear.wheel.z": Channel(2, 3),
}


def measured(quantity: str = "accelerance") -> Frf:
    rng = np.random.default_rng(3)
    shape = (AXIS.size, 3, 3)
    return Frf(AXIS, rng.normal(size=shape) + 1j * rng.normal(size=shape), LABELS, LABELS, quantity)


def turned(frf: Frf) -> np.ndarray:
    """The values as others should find them: rotations in rad and N m."""
    scale = np.array([1 / 0.05, 1.0, 1.0])
    return np.asarray(frf.values * scale[:, None] * scale[None, :])


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_pyuff_finds_nodes_directions_and_units(form: str, tmp_path: Path) -> None:
    frf = measured()
    write_uff(frf, tmp_path / "a.uff", CHANNELS, form=form)
    sets = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    assert [int(s["type"]) for s in sets] == [164] + [58] * 9
    expected = turned(frf)
    places = [(1, -6), (1, 2), (2, 3)]
    units = ["rad/s^2", "m/s^2", "m/s^2"], ["N m", "N", "N"]
    for number, one in enumerate(sets[1:]):
        i, j = number % 3, number // 3
        assert (one["rsp_node"], one["rsp_dir"]) == places[i]
        assert (one["ref_node"], one["ref_dir"]) == places[j]
        assert one["ordinate_axis_units_lab"] == units[0][i]
        assert one["orddenom_axis_units_lab"] == units[1][j]
        assert (one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]) == (12, 13)
        np.testing.assert_allclose(one["data"], expected[:, i, j], rtol=1e-11)
        np.testing.assert_allclose(one["x"], AXIS, rtol=1e-12)


@pytest.mark.parametrize("form", ["ascii", "binary"])
@pytest.mark.parametrize("axis", [AXIS, np.array([1.0, 2.5, 7.0, 19.25])])
def test_our_own_file_comes_back(form: str, axis: np.ndarray, tmp_path: Path) -> None:
    frf = Frf(axis, measured().values[: axis.size], LABELS, LABELS, "mobility")
    write_uff(frf, tmp_path / "a.uff", form=form)
    back = read_uff(tmp_path / "a.uff")
    assert (back.responses, back.excitations, back.quantity) == (LABELS, LABELS, "mobility")
    np.testing.assert_array_equal(back.frequency, axis)
    np.testing.assert_allclose(back.values, frf.values, rtol=0 if form == "binary" else 1e-11)


def test_rotations_come_back_as_rotations(tmp_path: Path) -> None:
    frf = measured()
    write_frf(frf, tmp_path / "a.uff", CHANNELS)
    found = read_frf(tmp_path / "a.uff")
    assert found.frf.responses == LABELS
    assert found.angles == found.moments == {"gear.pinion.w"}
    np.testing.assert_allclose(found.frf.values, turned(frf), rtol=1e-10)


@pytest.mark.parametrize("binary", [0, 1])
def test_what_pyuff_writes_is_read(binary: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    data = rng.normal(size=(2, 30)) + 1j * rng.normal(size=(2, 30))
    path = tmp_path / "theirs.uff"
    file = pyuff.UFF(str(path))
    for spacing, one in enumerate(data):
        file.write_sets(
            {
                "type": 58, "binary": binary, "func_type": 4, "rsp_node": 4 + spacing,
                "rsp_dir": -2, "ref_node": 9, "ref_dir": 3, "abscissa_spacing": spacing,
                "abscissa_spec_data_type": 18, "ordinate_spec_data_type": 11,
                "orddenom_spec_data_type": 13, "ordinate_axis_units_lab": "mm/s",
                "orddenom_axis_units_lab": "kN", "x": 0.5 + np.arange(30), "data": one,
            },
            mode="add",
        )  # fmt: skip
    frf = read_uff(path)
    assert (frf.responses, frf.excitations, frf.quantity) == (("4.y", "5.y"), ("9.z",), "mobility")
    np.testing.assert_array_equal(frf.frequency, 0.5 + np.arange(30))
    np.testing.assert_allclose(frf.values[:, :, 0], -1e-6 * data.T, rtol=1e-10)


@pytest.mark.oracle
@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_sdynpy_reads_ours_and_we_read_theirs(form: str, tmp_path: Path) -> None:
    uff = pytest.importorskip("sdynpy.fileio.sdynpy_uff", exc_type=ImportError)
    frf = measured()
    write_uff(frf, tmp_path / "ours.uff", CHANNELS, form=form)
    functions = uff.readuff(str(tmp_path / "ours.uff"))[58]
    expected = turned(frf)
    places = [(1, -6), (1, 2), (2, 3)]
    units = ["rad/s^2", "m/s^2", "m/s^2"], ["N m", "N", "N"]
    for number, one in enumerate(functions):
        i, j = number % 3, number // 3
        assert (one.response_node, one.response_direction) == places[i]
        assert (one.reference_node, one.reference_direction) == places[j]
        assert one.ordinate_num_units_label == units[0][i]
        assert one.ordinate_den_units_label == units[1][j]
        np.testing.assert_allclose(one.ordinate, expected[:, i, j], rtol=1e-11)
        np.testing.assert_allclose(one.abscissa, AXIS, rtol=1e-12)
        one.idline4 = one.idline5 = "NONE"  # so that node and direction count
    theirs = "".join(f"{-1:6d}\n{58:6d}\n{one.write_string()}{-1:6d}\n" for one in functions)
    (tmp_path / "theirs.uff").write_text(theirs)
    back = read_frf(tmp_path / "theirs.uff")
    assert back.frf.responses == back.frf.excitations == ("1.rz", "1.y", "2.z")
    assert back.angles == back.moments == {"1.rz"}
    signs = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(
        back.frf.values, expected * signs[:, None] * signs[None, :], rtol=1e-10
    )

"""Mesh loads and RMS per body of forces with known answers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.meshing.gear_response import PIECE, mesh_loads, rms_per_body

TURN = 2 * np.pi * np.arange(1000) / 1000


def test_sine_on_a_mean():
    forces = np.column_stack([100 + 30 * np.sin(TURN), -100 - 30 * np.sin(TURN)])
    first, second = mesh_loads(("sun mesh", "ring mesh"), forces)
    for load in (first, second):
        assert load.dynamic_factor == pytest.approx(1.3, rel=1e-12)
        assert load.swing_factor == pytest.approx(1.3, rel=1e-12)
        assert load.rms == pytest.approx(30 / np.sqrt(2), rel=1e-12)
        assert (load.largest, load.smallest) == (pytest.approx(130), pytest.approx(70))
        assert (load.open_share, load.reversed_share) == (0.0, 0.0)
    assert (first.mean, second.mean) == (pytest.approx(100), pytest.approx(-100))


def test_contact_is_lost_for_its_share_of_the_time():
    # open for 300 of 1000 samples, on the back flank for 100
    force = np.full(1000, 10.0)
    force[200:500], force[700:800] = 0.0, -2.0
    load = mesh_loads(("mesh",), force[:, None])[0]
    assert load.open_share == pytest.approx(0.3)
    assert load.reversed_share == pytest.approx(0.1)
    mean = (600 * 10 - 100 * 2) / 1000
    assert load.mean == pytest.approx(mean)
    assert load.dynamic_factor == pytest.approx(10 / mean)
    assert load.swing_factor == pytest.approx(1 + (mean + 2) / mean)  # it dips further
    damped = mesh_loads(("mesh",), np.where(force == 0, 0.5, force)[:, None], none=0.6)[0]
    assert damped.open_share == pytest.approx(0.3)


def test_no_mean_no_factor():
    load = mesh_loads(("mesh",), np.sin(TURN)[:, None])[0]
    assert load.dynamic_factor is None
    assert load.swing_factor is None


@given(seed=st.integers(0, 10**6), scale=st.floats(1e-3, 1e6), offset=st.floats(-1e3, 1e3))
def test_factors_do_not_depend_on_unit_or_sense(seed, scale, offset):
    force = np.random.default_rng(seed).standard_normal((50, 1)) + offset
    one, other = (mesh_loads(("m",), factor * force)[0] for factor in (1.0, -scale))
    if one.dynamic_factor is None:
        assert other.dynamic_factor is None
    else:
        # cancellation in the mean amplifies rounding by as much as the factor itself
        tolerance = 1e-13 * one.dynamic_factor
        assert other.dynamic_factor == pytest.approx(one.dynamic_factor, rel=tolerance)
        assert other.swing_factor == pytest.approx(one.swing_factor, rel=2 * tolerance)
        assert one.swing_factor >= one.dynamic_factor * (1 - 1e-12)
    assert other.reversed_share == one.reversed_share


def test_pieces_of_a_long_record_make_one():
    count = 2 * PIECE + 123
    forces = np.random.default_rng(1).standard_normal((count, 2)) + np.array([5.0, -0.5])
    for number, load in enumerate(mesh_loads(("a", "b"), forces)):
        force = forces[:, number] * np.sign(load.mean)
        assert load.mean == pytest.approx(forces[:, number].mean(), rel=1e-12)
        assert load.rms == pytest.approx(forces[:, number].std(), rel=1e-12)
        assert (load.largest, load.smallest) == (force.max(), force.min())
        assert load.reversed_share == np.mean(force < 0)


def test_rms_of_bodies_is_about_the_mean():
    labels = ("planetary.sun.u", "planetary.sun.v", "planetary.planet1.w")
    motion = np.column_stack([3 * np.sin(TURN) + 1e6, 4 * np.cos(TURN), np.full(1000, 7.0)])
    found = rms_per_body(labels, motion)
    assert list(found) == ["planetary.sun", "planetary.planet1"]
    # 1e6 has 1e-10 left for the sine
    assert found["planetary.sun"]["u"] == pytest.approx(3 / np.sqrt(2), rel=1e-9)
    assert found["planetary.sun"]["v"] == pytest.approx(4 / np.sqrt(2), rel=1e-12)
    assert found["planetary.planet1"]["w"] == 0.0


def test_bad_records_are_named():
    with pytest.raises(ModelError, match=r"shape \(1000, 1\) do not fit 2 meshes"):
        mesh_loads(("a", "b"), TURN[:, None])
    with pytest.raises(ModelError, match="column 1 holds values that are not finite"):
        rms_per_body(("a.u", "a.v"), np.column_stack([TURN, np.where(TURN > 1, np.nan, 0.0)]))
    with pytest.raises(ModelError, match="at least 0 N"):
        mesh_loads(("a",), TURN[:, None], none=-1.0)

"""Mesh loads and RMS per body of forces with known answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbs_models.errors import ModelError
from mbs_models.gears.gear_response import PIECE, mesh_loads, rms_per_body

TURN = 2 * np.pi * np.arange(1000) / 1000


def loads(names: Any, forces: Any) -> Any:
    """Flanks touch as the force says."""
    return mesh_loads(names, forces, np.sign(forces))


def test_sine_on_a_mean() -> None:
    (load,) = loads(("sun mesh",), (100 + 30 * np.sin(TURN))[:, None])
    assert load.dynamic_factor == pytest.approx(1.3, rel=1e-12)
    assert load.rms == pytest.approx(30 / np.sqrt(2), rel=1e-12)
    assert (load.largest, load.smallest) == (pytest.approx(130), pytest.approx(70))
    assert (load.open_share, load.reversed_share) == (0.0, 0.0)
    assert load.mean == pytest.approx(100)


def test_contact_is_counted_on_the_deflection() -> None:
    # open for 300 of 1000 samples, on the back flank for 100, whatever dampers do there
    force, contact = np.full(1000, 10.0), np.ones(1000)
    force[200:500], force[700:800] = 0.5, -2.0
    contact[200:500], contact[700:800] = 0.0, -1.0
    (load,) = mesh_loads(("mesh",), force[:, None], contact[:, None])
    assert load.open_share == pytest.approx(0.3)
    assert load.reversed_share == pytest.approx(0.1)
    mean = (600 * 10 + 300 * 0.5 - 100 * 2) / 1000
    assert load.mean == pytest.approx(mean)
    assert load.dynamic_factor == pytest.approx(10 / mean)


def test_no_mean_no_factor() -> None:
    assert loads(("mesh",), np.sin(TURN)[:, None])[0].dynamic_factor is None


@given(seed=st.integers(0, 10**6), scale=st.floats(1e-3, 1e6), offset=st.floats(-1e3, 1e3))
def test_factors_do_not_depend_on_the_unit(seed: int, scale: float, offset: float) -> None:
    force = np.random.default_rng(seed).standard_normal((50, 1)) + offset
    one, other = (loads(("m",), factor * force)[0] for factor in (1.0, scale))
    if one.dynamic_factor is None:
        assert other.dynamic_factor is None
    else:
        # cancellation in the mean amplifies rounding by as much as the factor itself
        tolerance = 1e-13 * one.dynamic_factor
        assert other.dynamic_factor == pytest.approx(one.dynamic_factor, rel=tolerance)
    assert other.reversed_share == one.reversed_share


def test_pieces_of_a_long_record_make_one() -> None:
    count = 2 * PIECE + 123
    forces = np.random.default_rng(1).standard_normal((count, 2)) + np.array([5.0, 0.5])
    for number, load in enumerate(loads(("a", "b"), forces)):
        force = forces[:, number]
        assert load.mean == pytest.approx(force.mean(), rel=1e-12)
        assert load.rms == pytest.approx(force.std(), rel=1e-12)
        assert (load.largest, load.smallest) == (force.max(), force.min())
        assert load.reversed_share == np.mean(force < 0)


def test_rms_of_bodies_is_about_the_mean() -> None:
    labels = ("planetary.sun.u", "planetary.sun.v", "planetary.planet1.w")
    motion = np.column_stack([3 * np.sin(TURN) + 1e6, 4 * np.cos(TURN), np.full(1000, 7.0)])
    found = rms_per_body(labels, motion)
    assert list(found) == ["planetary.sun", "planetary.planet1"]
    # 1e6 has 1e-10 left for the sine
    assert found["planetary.sun"]["u"] == pytest.approx(3 / np.sqrt(2), rel=1e-9)
    assert found["planetary.sun"]["v"] == pytest.approx(4 / np.sqrt(2), rel=1e-12)
    assert found["planetary.planet1"]["w"] == 0.0


def test_bad_records_are_named() -> None:
    with pytest.raises(ModelError, match=r"shape \(1000, 1\) do not fit 2 meshes"):
        loads(("a", "b"), TURN[:, None])
    with pytest.raises(ModelError, match="column 1 holds values that are not finite"):
        rms_per_body(("a.u", "a.v"), np.column_stack([TURN, np.where(TURN > 1, np.nan, 0.0)]))

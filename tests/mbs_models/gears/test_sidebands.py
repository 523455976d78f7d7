"""Sidebands of synthetic planetary stages: lines where theory has them, and nothing elsewhere."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given
from hypothesis import strategies as st

from fbs._kernels.checks import FloatArray
from mbs_models.errors import ModelError
from mbs_models.gears.sidebands import (
    expected_sidebands,
    passing_window,
    ring_sensor,
)

COUNT = 4096  # samples of one turn of the carrier
CARRIER = 2.5  # turns per second
TIME = np.arange(COUNT) / COUNT / CARRIER
THETA = 2 * np.pi * CARRIER * TIME


def phasors(signal: FloatArray) -> Any:
    """A e^{j phi} at every order of the carrier; exact, for one turn is the record."""
    spectrum = np.fft.rfft(signal) / COUNT
    spectrum[1:] *= 2.0
    return spectrum


def planet_forces(teeth: Any, phases: Any, mesh: Any, shares: Any) -> Any:
    """F_n(t) of planets with the mesh phases (rad) given."""
    angle = teeth * THETA[:, None] + phases
    return shares * sum((f * np.exp(1j * i * angle)).real for i, f in enumerate(mesh))


def equally_spaced(planets: Any) -> Any:
    return 2 * np.pi * np.arange(planets) / planets


def sensor(
    teeth: Any,
    angles: Any,
    mesh: Any,
    window: Any,
    phases: Any = None,
    shares: Any = None,
    sensor_angle: float = 0.0,
) -> Any:
    phases = teeth * angles if phases is None else phases
    shares = np.ones(len(angles)) if shares is None else shares
    forces = planet_forces(teeth, phases, mesh, shares)
    return ring_sensor(forces, TIME, angles, CARRIER, window, sensor_angle)


@given(data=st.data(), planets=st.integers(2, 7), teeth=st.integers(20, 150))
def test_spectrum_of_the_sensor_is_the_expected_one(data: Any, planets: int, teeth: int) -> None:
    seed = np.random.default_rng(data.draw(st.integers(0, 10**6)))
    angles = np.sort(seed.uniform(0, 2 * np.pi, planets))
    phases, shares = seed.uniform(0, 2 * np.pi, planets), seed.uniform(0.5, 1.5, planets)
    mesh = np.array([2.0, *(seed.standard_normal(2) + 1j * seed.standard_normal(2))])
    window, stands = seed.uniform(0, 1, 6), seed.uniform(0, 6)
    felt = phasors(sensor(teeth, angles, mesh, window, phases, shares, stands))
    expected = np.zeros_like(felt)
    lines = expected_sidebands(
        teeth, angles, mesh, window, phases=phases, shares=shares, sensor_angle=stands
    )
    for line in lines:
        expected[line.order] = line.phasor
        assert line.order == line.harmonic * teeth + line.offset
    # angles of up to 300 turns are rounded to 2e-13 and twelve lines of order 10 summed
    assert np.abs(felt - expected).max() < 1e-10


@pytest.mark.parametrize(
    ("teeth", "planets"), [(70, 3), (99, 3), (125, 4), (126, 4), (124, 4), (228, 5)]
)
def test_equal_planets_leave_only_multiples_of_their_number(teeth: int, planets: int) -> None:
    """McFadden & Smith (1985): the mesh frequency itself vanishes unless N divides z_r."""
    angles = equally_spaced(planets)
    window = passing_window(planets, 2 * planets)
    felt = np.abs(phasors(sensor(teeth, angles, (0.0, 1.0), window)))
    orders = np.arange(len(felt))
    assert felt[orders % planets != 0].max() < 1e-12
    nearby = [k for k in range(teeth - planets, teeth + planets + 1) if k % planets == 0]
    for order in nearby:
        weight = window[abs(order - teeth)] / (1.0 if order == teeth else 2.0)
        assert felt[order] == pytest.approx(planets * weight, rel=1e-10)
    assert (felt[teeth] > 1e-3) == (teeth % planets == 0)


def test_sidebands_are_lopsided_where_the_planets_do_not_divide_the_teeth() -> None:
    # 70 teeth, 3 planets: 69 = f_m - f_c and 72 = f_m + 2 f_c remain, the nearer is stronger
    lines = {x.order: x for x in expected_sidebands(70, equally_spaced(3), (0, 1), (4, 3, 2, 1))}
    assert lines[69].amplitude == pytest.approx(3 * 3 / 2)
    assert lines[72].amplitude == pytest.approx(3 * 2 / 2)
    assert (lines[69].offset, lines[72].offset) == (-1, 2)
    assert lines[70].amplitude < 1e-12
    assert lines[71].amplitude < 1e-12


def test_one_unequal_planet_brings_the_mesh_frequency_back() -> None:
    share = np.array([1.2, 1.0, 1.0])
    line = {x.order: x for x in expected_sidebands(
        70, equally_spaced(3), (0, 1), (4, 3, 2, 1), shares=share
    )}[70]  # fmt: skip
    assert line.amplitude == pytest.approx(0.2 * 4, rel=1e-12)


def test_in_phase_meshes_have_sidebands_at_planet_passes() -> None:
    for line in expected_sidebands(72, equally_spaced(4), (1.0, 1.0), np.ones(10)):
        assert (line.amplitude > 1e-9) == (line.offset % 4 == 0)


def test_order_below_zero_is_its_mirror_image() -> None:
    # mesh order 3, window up to 5: -2 folds onto 2, where the mean's second term is as well
    angles, mesh, window = np.array([0.3, 2.0]), (1.0, 0.7j), (1.0, 0.5, 0.4, 0.3, 0.2, 0.1)
    felt = phasors(sensor(3, angles, mesh, window, sensor_angle=0.4))
    for line in expected_sidebands(3, angles, mesh, window, sensor_angle=0.4):
        assert abs(felt[line.order] - line.phasor) < 1e-12


@given(planets=st.integers(2, 8))
def test_window_hears_only_the_nearest_planet(planets: int) -> None:
    half = np.pi / planets
    window = passing_window(planets, 3 * planets)
    for number, value in enumerate(window):
        exact = scipy.integrate.quad(
            lambda x, m=number: (1 + np.cos(planets * x)) / 2 * np.cos(m * x), 0, half,
            epsabs=1e-14,
        )[0] * (2 / np.pi if number else 1 / np.pi)  # fmt: skip
        assert value == pytest.approx(exact, abs=1e-13)


@pytest.mark.parametrize("planets", [3, 4, 5])
@pytest.mark.parametrize("teeth", [70, 71, 72, 99])
def test_rigid_ring_moves_at_multiples_of_the_planets_too(planets: int, teeth: int) -> None:
    """The net force of equal planets on the ring, seen from outside, obeys the same rule."""
    angles = equally_spaced(planets)
    forces = planet_forces(teeth, teeth * angles, (0, 1.0, 0.5), np.ones(planets))
    u, v = forces @ np.cos(angles + 1.1), forces @ np.sin(angles + 1.1)  # along the lines of action
    felt = np.abs(phasors(u * np.cos(THETA) - v * np.sin(THETA)))  # turned past the sensor
    lines = np.flatnonzero(felt > 1e-10)
    assert (lines % planets == 0).all()
    allowed = {i * teeth + side for i in (1, 2) for side in (-1, 1)}
    assert set(lines) == {k for k in allowed if k % planets == 0}


def test_what_does_not_fit_is_named() -> None:
    with pytest.raises(ModelError, match="do not fit 4096 instants and 3 planets"):
        ring_sensor(np.ones((COUNT, 2)), TIME, (0, 1, 2), CARRIER, (1.0,))
    with pytest.raises(ModelError, match="one phase and share per planet"):
        expected_sidebands(70, (0, 1, 2), (1.0,), (1.0,), phases=(0.0,))
    with pytest.raises(ModelError, match="1 tooth or more"):
        expected_sidebands(0, (0, 1, 2), (1.0,), (1.0,))

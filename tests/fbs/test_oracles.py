"""The same numbers from two peers that share no code with this package.

sdynpy (systems, FRFs and coupling by coordinate pairs, with a pseudo-inverse of the kernel) and
pyFBS (eigensolution and line-by-line synthesis; its coupling is left to its users). Both bring
graphics and finite-element readers along, a gigabyte and some seconds of import, so they are no
dependencies: these tests run where they are installed and are skipped elsewhere.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fbs import Joint, SecondOrderSystem, couple, direct_frf, frequency_axis, modal_frf, real_modes
from tests.fbs.fbs_systems import random_system, scaled_error

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
pytestmark = pytest.mark.oracle
AXIS = frequency_axis(20, 4000, 20)


def stages(beta: Callable[..., Any] = lambda rng: rng.uniform(1e-7, 1e-5)) -> Any:
    rng = np.random.default_rng(21)
    return random_system(rng, 5, "a", beta=beta), random_system(rng, 6, "b", beta=beta)


@pytest.fixture(scope="module")
def sdynpy() -> Any:
    return pytest.importorskip("sdynpy")


@pytest.fixture(scope="module")
def pyfbs_model() -> Any:
    return pytest.importorskip("pyfbs.mck.mck").Model


def as_sdynpy(sdynpy: Any, system: SecondOrderSystem, first_node: Any) -> Any:
    nodes = np.arange(first_node, first_node + len(system.dofs))
    coordinates = sdynpy.coordinate_array(nodes, "X+")
    peer = sdynpy.System(coordinates, system.mass, system.stiffness, system.damping)
    return peer, coordinates


def test_sdynpy_has_the_same_frfs(sdynpy: Any) -> None:
    system, _ = stages()
    peer, coordinates = as_sdynpy(sdynpy, system, 1)
    frf = peer.frequency_response(AXIS, coordinates, coordinates)
    expected = np.moveaxis(frf.ordinate, -1, 0)
    # both invert the same matrices, of scaled condition below 1e3
    assert scaled_error(direct_frf(system, AXIS), expected).max() < 1e-11
    assert scaled_error(modal_frf(system, AXIS), expected).max() < 1e-11


def test_sdynpy_couples_alike(sdynpy: Any) -> None:
    a, b = stages()
    frfs = []
    for system, first in ((a, 1), (b, 101)):
        peer, coordinates = as_sdynpy(sdynpy, system, first)
        frfs.append(peer.frequency_response(AXIS, coordinates, coordinates))
    both = type(frfs[0]).block_diagonal_frf(tuple(frfs))
    pairs = np.array(
        [
            sdynpy.coordinate_array([5, 101], "X+"),
            sdynpy.coordinate_array([2, 104], "X+"),
        ]
    ).view(sdynpy.CoordinateArray)
    expected = np.moveaxis(both.substructure_by_coordinate(pairs).ordinate, -1, 0)
    joints = [Joint(("a", "a4"), ("b", "b0")), Joint(("a", "a1"), ("b", "b3"))]
    coupled = couple({"a": direct_frf(a, AXIS), "b": direct_frf(b, AXIS)}, joints)
    # eps times the scaled condition of the parts (1e3) times that of the kernel
    assert (scaled_error(coupled.frf, expected) <= 1e-12 * coupled.kernel_condition).all()


def test_pyfbs_has_the_same_modes_and_frfs(pyfbs_model: Any) -> None:
    system, _ = stages(beta=lambda rng: 0.0)
    expected, _, _ = pyfbs_model.eig_solve(system.mass, system.stiffness, 4)
    # its w^2 carry the largest one's round-off, 1e2 times the lowest here
    assert np.allclose(real_modes(system).angular_frequency[:4], expected, rtol=1e-12)
    model = pyfbs_model.__new__(pyfbs_model)  # its constructor reads finite-element files only
    model._k, model.m = system.stiffness, system.mass
    model.frf_synth_full(20, 4001, 20)
    assert np.array_equal(model.freq, AXIS)
    # no line is closer than 1e-4 to a pole
    assert scaled_error(direct_frf(system, AXIS), model.frf).max() < 1e-10
    assert scaled_error(modal_frf(system, AXIS), model.frf).max() < 1e-10

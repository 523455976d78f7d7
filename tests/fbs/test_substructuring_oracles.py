"""Interfaces, mixing and reductions against pyFBS and sdynpy, where they are installed.

Both share no code with this package. One thing of theirs does not hold: pyFBS 1.0.7 asks
``elif semm_type == "fully-extend" or "extended":``, which is always true, so that its
"fully-extend-svd" is the form without truncation (`test_pyfbs_semm_never_truncates`).
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pandas as pd
import pytest

from fbs import (
    Channel,
    Frf,
    SecondOrderSystem,
    VirtualPoint,
    craig_bampton,
    direct_frf,
    dynamic,
    frequency_axis,
    guyan,
    real_modes,
    semm,
    serep_expansion,
    singular_basis,
    transform,
)
from tests.fbs.fbs_systems import random_system, scaled_error

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
pytestmark = pytest.mark.oracle
AXIS = frequency_axis(50, 2000, 50)
POINT = (0.01, -0.02, 0.03)


@pytest.fixture(scope="module")
def sdynpy() -> Any:
    return pytest.importorskip("sdynpy")


def random_channels(prefix: str, count: int, seed: int) -> tuple[Channel, ...]:
    rng = np.random.default_rng(seed)
    found = []
    for k in range(count):
        direction = rng.standard_normal(3)
        direction /= np.linalg.norm(direction)
        found.append(Channel(f"{prefix}{k}", tuple(rng.uniform(-0.2, 0.2, 3)), tuple(direction)))
    return tuple(found)


def table(channels: tuple[Channel, ...], grouping: int = 1) -> pd.DataFrame:
    """Channels as pyFBS reads them."""
    rows = [
        {
            "Name": c.label, "Quantity": "Acceleration", "Grouping": grouping,
            **{f"Position_{k}": x for k, x in enumerate(c.position, start=1)},
            **{f"Direction_{k}": x for k, x in enumerate(c.direction, start=1)},
        }
        for c in channels
    ]  # fmt: skip
    return pd.DataFrame(rows)


def virtual(words: tuple[str, ...]) -> pd.DataFrame:
    """Six motions or loads at the point."""
    rows = [
        {
            "Grouping": 1, "Description": word, "Quantity": "Acceleration",
            **{f"Position_{k}": x for k, x in enumerate(POINT, start=1)},
        }
        for word in words
    ]  # fmt: skip
    return pd.DataFrame(rows)


def random_frf(rows: tuple[str, ...], columns: tuple[str, ...], seed: int = 1) -> Frf:
    rng = np.random.default_rng(seed)
    shape = (AXIS.size, len(rows), len(columns))
    return Frf(AXIS, rng.standard_normal(shape) + 1j * rng.standard_normal(shape), rows, columns)


SENSORS, IMPACTS = random_channels("s", 9, 2), random_channels("h", 8, 3)
MEASURED = random_frf(tuple(c.label for c in SENSORS), tuple(c.label for c in IMPACTS))
AT_POINT = transform(
    MEASURED, [VirtualPoint("v", SENSORS, POINT)], [VirtualPoint("v", IMPACTS, POINT)]
).frf


def test_pyfbs_has_the_same_virtual_point() -> None:
    vpt = pytest.importorskip("pyfbs.interface.vpt")
    peer = vpt.VPT(
        table(SENSORS), table(IMPACTS),
        virtual(("ux", "uy", "uz", "rx", "ry", "rz")),
        virtual(("fx", "fy", "fz", "mx", "my", "mz")),
    )  # fmt: skip
    peer.apply_vpt(AXIS, MEASURED.values)
    # eps times the squared condition of R: lengths of 0.1 m beside 1, so 1e2 squared
    assert scaled_error(AT_POINT, peer.frf).max() < 1e-11


def test_sdynpy_has_the_same_kinematic_transformation(sdynpy: Any) -> None:
    """Triaxial channels at four nodes: its coordinates lie along the axes."""
    rng = np.random.default_rng(5)
    places = rng.uniform(-0.2, 0.2, (4, 3))
    axes = np.eye(3)
    channels = tuple(
        Channel(f"{n}{axis}", tuple(place), tuple(axes[k]))
        for n, place in enumerate(places, start=1)
        for k, axis in enumerate("xyz")
    )
    labels = tuple(c.label for c in channels)
    frf = random_frf(labels, labels)
    ours = transform(
        frf, [VirtualPoint("v", channels, POINT)], [VirtualPoint("v", channels, POINT)]
    ).frf
    geometry = sdynpy.Geometry(
        node=sdynpy.node_array(np.arange(1, 5), places),
        coordinate_system=sdynpy.coordinate_system_array((1,)),
    )
    coordinates = sdynpy.coordinate_array(np.repeat(np.arange(1, 5), 3), np.tile([1, 2, 3], 4))
    motions = geometry.response_kinematic_transformation(coordinates, 9, POINT).matrix
    forces = geometry.force_kinematic_transformation(coordinates, 9, POINT).matrix
    # its force transformation sums up loads, ours is the least forces for a load: its inverse
    expected = motions @ frf.values @ np.linalg.pinv(forces)
    assert scaled_error(ours, expected).max() < 1e-11


def model(seed: int = 11) -> SecondOrderSystem:
    system: SecondOrderSystem = random_system(
        np.random.default_rng(seed), 10, "x", beta=lambda rng: rng.uniform(1e-7, 1e-6)
    )
    return system


def places(system: SecondOrderSystem) -> tuple[Channel, ...]:
    """A place for every DoF: what pyFBS matches DoFs by."""
    return tuple(
        Channel(dof, (float(k), 0.0, 0.0), (1.0, 0.0, 0.0)) for k, dof in enumerate(system.dofs)
    )


@pytest.mark.parametrize(("ours", "theirs"), [("basic", "basic"), ("extended", "fully-extend")])
def test_pyfbs_mixes_alike(ours: Any, theirs: str) -> None:
    peer = pytest.importorskip("pyfbs.expansion.semm")
    parent, truth = model(), model(12)
    at = ("x1", "x4", "x7")
    numerical = direct_frf(parent, AXIS)
    measured = direct_frf(truth, AXIS, at, at)
    known = {c.label: c for c in places(parent)}
    some = tuple(known[label] for label in at)
    every = tuple(known[label] for label in numerical.responses)
    expected = peer.semm(
        numerical.values, measured.values, table(every), table(every), table(some), table(some),
        semm_type=theirs,
    )  # fmt: skip
    # eps times the condition of a 3 × 3 block of FRFs, some 1e3
    assert scaled_error(semm(numerical, measured, ours).frf, expected).max() < 1e-10


def test_pyfbs_semm_never_truncates() -> None:
    """Its "fully-extend-svd" with two values left out is its form without truncation."""
    peer = pytest.importorskip("pyfbs.expansion.semm")
    numerical, measured = direct_frf(model(), AXIS), direct_frf(model(12), AXIS, ("x1", "x4"))
    known = table(places(model()))
    given = numerical.values, measured.select(None, ("x1", "x4")).values
    some = known[known["Name"].isin(("x1", "x4"))]
    cut, whole = (
        peer.semm(*given, known, known, some, some, semm_type=form, red_comp=1, red_eq=1)
        for form in ("fully-extend-svd", "fully-extend")
    )
    assert np.array_equal(cut, whole)
    measured = measured.select(None, ("x1", "x4"))
    ours = semm(numerical, measured, "extended", rank=1).frf
    assert scaled_error(ours, whole).max() > 1e-3


def test_pyfbs_expands_shapes_alike() -> None:
    peer = pytest.importorskip("pyfbs.expansion.serep")
    system = model()
    modes = real_modes(system).truncated(slice(3))
    at = ("x0", "x3", "x5", "x8")
    place = [modes.dofs.index(label) for label in at]
    shapes = np.random.default_rng(3).standard_normal((4, 2))
    known = places(system)
    expected = peer.serep(modes.shapes, shapes, table(known), table(tuple(known[k] for k in place)))
    assert np.allclose(serep_expansion(modes, at) @ shapes, expected, rtol=1e-10, atol=1e-12)


def test_pyfbs_reduces_to_the_same_singular_vectors() -> None:
    """Uᴴ Y V of the largest three: singular values are unique, vectors to a common phase."""
    svt = pytest.importorskip("pyfbs.interface.svt")
    interface = random_frf(tuple(f"s{k}" for k in range(6)), tuple(f"h{k}" for k in range(5)), 7)
    rows, columns = random_channels("s", 6, 1), random_channels("h", 5, 1)
    peer = svt.SVT(table(rows), table(columns), AXIS, interface.values, [1], 3)
    basis = singular_basis(interface, interface.responses, interface.excitations, 3)
    ours = basis.applied_to(interface).values
    theirs = peer.tu @ interface.values @ peer.tf
    assert np.allclose(np.abs(ours), np.abs(theirs), atol=1e-12 * np.abs(ours).max())
    for k in range(3):
        one, other = basis.motions[:, :, k], peer.ru[:, :, k]
        assert np.allclose(np.abs(np.einsum("fi,fi->f", one.conj(), other)), 1.0, atol=1e-10)


def as_sdynpy(sdynpy: Any, system: SecondOrderSystem, first_node: int = 1) -> Any:
    nodes = np.arange(first_node, first_node + len(system.dofs))
    coordinates = sdynpy.coordinate_array(nodes, "X+")
    return sdynpy.System(coordinates, system.mass, system.stiffness, system.damping), coordinates


def test_sdynpy_reduces_alike(sdynpy: Any) -> None:
    system = model()
    peer, coordinates = as_sdynpy(sdynpy, system)
    keep = ("x2", "x5", "x9")
    kept = coordinates[[2, 5, 9]]
    pairs = [
        (guyan(system, keep), peer.reduce_guyan(kept)),
        (dynamic(system, keep, 100.0), peer.reduce_dynamic(kept, 100.0)),
    ]
    for ours, theirs in pairs:
        for name in ("mass", "damping", "stiffness"):
            one, other = getattr(ours.system, name), getattr(theirs, name)
            assert np.allclose(one, other, rtol=0, atol=1e-12 * np.abs(other).max())
    ours, theirs = craig_bampton(system, keep, 4), peer.reduce_craig_bampton(kept, 4)
    frf = theirs.frequency_response(AXIS, coordinates, coordinates)
    expected = np.moveaxis(frf.ordinate, -1, 0)
    found = ours.frf(AXIS, system.dofs, system.dofs)
    assert scaled_error(found, expected).max() < 1e-11

"""Blocked forces belong to the source: whatever it is joined to, they are the same."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import FbsError, Frf, Joint, SecondOrderSystem, SingularLineError, couple, direct_frf
from fbs.transfer_paths import (
    Spectra,
    foretold,
    path_contributions,
    ranked,
    source_forces,
    transmissibility,
)

LINES = np.linspace(2.0, 60.0, 30)
AT = ("p", "q")


def part(labels: str, seed: int) -> Frf:
    """A random damped system."""
    rng = np.random.default_rng(seed)
    n = len(labels)
    root = 100.0 * rng.standard_normal((n, n))
    stiffness = root @ root.T + 1e4 * np.eye(n)
    mass = np.diag(rng.uniform(0.5, 2.0, n))
    return direct_frf(SecondOrderSystem(mass, 1e-3 * stiffness, stiffness, tuple(labels)), LINES)


SOURCE = part("ampq", 0)  # excited at a, from inside
INSIDE = np.exp(1j * LINES)[:, None]


def joined(receiver: Frf) -> Frf:
    return couple({"S": SOURCE, "R": receiver}, [Joint(("S", x), ("R", x)) for x in AT]).frf


def running(assembly: Frf, labels: str) -> Spectra:
    """Motions of the assembly under the force at a."""
    values = assembly.select(tuple(labels), ["a"]).values[:, :, 0] * INSIDE
    return Spectra(LINES, values, tuple(labels))


def test_blocked_forces_do_not_change_over_receivers() -> None:
    """100 random receivers, in situ, and free motions of the source alone: the same to 1e-9."""
    free = source_forces(SOURCE.select(AT, AT), running(SOURCE, "pq")).spectra.values
    for seed in range(100):
        assembly = joined(part("pqxyz", 100 + seed))
        in_situ = source_forces(assembly.select(None, AT), running(assembly, "xyz"))
        assert np.abs(in_situ.spectra.values - free).max() < 1e-9 * np.abs(free).max()
        assert in_situ.left.max() < 1e-9


def test_they_foretell_another_assembly() -> None:
    first, second = joined(part("pqxyz", 1)), joined(part("pquv", 2))
    blocked = source_forces(first.select(None, AT), running(first, "xyz")).spectra
    expected = running(second, "uv").values
    found = foretold(second.select(["u", "v"], AT), blocked).values
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_pseudo_forces_foretell_as_well() -> None:
    """Forces anywhere on the source that make the same motion behind the interface."""
    first, second = joined(part("pqxyz", 1)), joined(part("pquv", 2))
    pseudo = source_forces(first.select(None, ["m", "p"]), running(first, "xyz")).spectra
    found = foretold(second.select(["u", "v"], ["m", "p"]), pseudo).values
    np.testing.assert_allclose(found, running(second, "uv").values, rtol=1e-7)


def test_contact_forces_by_matrix_inversion() -> None:
    """The receiver alone: Y_A⁻¹-free check, the sum of paths is what is heard."""
    receiver = part("pqxyz", 3)
    assembly = joined(receiver)
    forces = source_forces(receiver.select(None, AT), running(assembly, "xyz")).spectra
    paths = path_contributions(receiver.select(["z"], AT), forces)
    total = sum(paths.values())
    np.testing.assert_allclose(
        np.asarray(total)[:, 0], running(assembly, "z").values[:, 0], rtol=1e-8
    )
    assert list(ranked(paths)) == sorted(paths, key=lambda name: -np.linalg.norm(paths[name]))


def test_a_motion_no_force_explains_is_left() -> None:
    assembly = joined(part("pqxyz", 4))
    motions = running(assembly, "xyz")
    values = np.array(motions.values)
    values[:, 2] *= 1.5
    found = source_forces(assembly.select(None, AT), Spectra(LINES, values, ("x", "y", "z")))
    assert np.median(found.left) > 1e-2


def test_transmissibility_from_running_alone() -> None:
    rng = np.random.default_rng(5)
    exact = rng.standard_normal((30, 2, 3)) + 1j * rng.standard_normal((30, 2, 3))
    references = rng.standard_normal((30, 3, 7)) + 1j * rng.standard_normal((30, 3, 7))
    np.testing.assert_allclose(transmissibility(references, exact @ references), exact, rtol=1e-9)


def test_what_tells_nothing() -> None:
    receiver = part("pqxyz", 3)
    with pytest.raises(FbsError, match="1 motions for 2 forces"):
        source_forces(receiver.select(None, AT), running(joined(receiver), "x"))
    twice = Frf(LINES, np.ones((30, 2, 2)), ("x", "y"), AT)
    with pytest.raises(SingularLineError, match="do not tell the forces apart"):
        source_forces(twice, running(joined(receiver), "xy"))
    with pytest.raises(FbsError, match="2 conditions for 3 references"):
        transmissibility(np.ones((4, 3, 2)), np.ones((4, 1, 2)))
    with pytest.raises(FbsError, match="spectra have shape"):
        Spectra(LINES, np.ones((3, 2)), ("x", "y"))

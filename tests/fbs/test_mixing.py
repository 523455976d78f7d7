"""Mixing a true measurement into a wrong model: right where it was measured, better elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import FbsError, Frf, Joint, SecondOrderSystem, couple, direct_frf, real_modes
from fbs.mixing import semm, serep_expansion, singular_basis

LINES = np.linspace(2.0, 40.0, 77)
N = 8


def chain(scale: float = 1.0) -> SecondOrderSystem:
    stiffness = np.zeros((N, N))
    stiffness[0, 0] = 2e4
    for k in range(N - 1):
        stiffness[k : k + 2, k : k + 2] += 4e4 * scale * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return SecondOrderSystem(
        np.eye(N), 1e-4 * stiffness, stiffness, tuple(f"x{k}" for k in range(N))
    )


TRUE, MODEL = direct_frf(chain(), LINES), direct_frf(chain(1.1), LINES)
MEASURED = ("x0", "x3", "x7")


def error(found: Frf) -> float:
    return float(np.linalg.norm(found.values - TRUE.values) / np.linalg.norm(TRUE.values))


def test_a_measurement_of_the_model_itself_changes_nothing() -> None:
    for form in ("basic", "extended"):
        mixed = semm(MODEL, MODEL.select(MEASURED, MEASURED), form)
        np.testing.assert_allclose(mixed.frf.values, MODEL.values, rtol=1e-9)
        for share in (*mixed.responses.values(), *mixed.excitations.values()):
            np.testing.assert_allclose(share, 1.0, rtol=1e-9)


def test_measured_everywhere_it_is_the_measurement() -> None:
    mixed = semm(MODEL, TRUE, "basic")
    np.testing.assert_allclose(mixed.frf.values, TRUE.values, rtol=1e-6, atol=1e-12)


def test_the_basic_form_follows_the_measurement_exactly() -> None:
    mixed = semm(MODEL, TRUE.select(MEASURED, ["x0", "x7", "x3"]), "basic")
    at = mixed.frf.select(MEASURED, MEASURED).values
    np.testing.assert_allclose(at, TRUE.select(MEASURED, MEASURED).values, rtol=1e-7)
    assert error(mixed.frf) < error(MODEL)


def test_a_contradicting_channel_shows() -> None:
    """One response of wrong sign is far less followed by the extended form than the others."""
    values = np.array(TRUE.select(("x0", "x2", "x5", "x7"), MEASURED).values)
    values[:, 1] *= -1.0
    measured = Frf(LINES, values, ("x0", "x2", "x5", "x7"), MEASURED)
    shares = {
        label: share.mean() for label, share in semm(MODEL, measured, rank=3).responses.items()
    }
    assert min(shares, key=lambda label: shares[label]) == "x2"


def test_serep_expansion_is_exact_for_the_modes() -> None:
    modes = real_modes(chain()).truncated(slice(3))
    expanded = serep_expansion(modes, MEASURED) @ modes.shapes[[0, 3, 7]]
    np.testing.assert_allclose(expanded, modes.shapes, atol=1e-12)


def test_parts_are_coupled_at_singular_vectors() -> None:
    """All vectors of an interface: a change of basis, the assembly is the same."""
    tail = SecondOrderSystem(
        np.eye(2), np.zeros((2, 2)), 1e4 * np.array([[3.0, -1.0], [-1.0, 2.0]]), ("x6", "x7")
    )
    other = direct_frf(tail, LINES)
    at = ("x6", "x7")
    whole = couple({"A": TRUE, "B": other}, [Joint(("A", x), ("B", x)) for x in at]).frf
    basis = singular_basis(TRUE, at, at, 2)
    # motions are compared along U; forces act along V: both parts in the same two bases
    a, b = basis.applied_to(TRUE), basis.applied_to(other)
    found = couple({"A": a, "B": b}, [Joint(("A", x), ("B", x)) for x in basis.labels]).frf
    np.testing.assert_allclose(found.between("x0", "x2"), whole.between("x0", "x2"), rtol=1e-9)
    assert (singular_basis(TRUE, at, at, 1).dropped > 0.0).all()


def test_what_cannot_be_mixed() -> None:
    with pytest.raises(FbsError, match="all against all"):
        semm(MODEL.select(None, ["x0"]), TRUE)
    with pytest.raises(FbsError, match="form must be one of"):
        semm(MODEL, TRUE, "other")  # type: ignore[arg-type]
    with pytest.raises(FbsError, match="rank = 9"):
        semm(MODEL, TRUE.select(MEASURED, MEASURED), rank=9)
    with pytest.raises(FbsError, match="do not tell 4 modes apart"):
        serep_expansion(real_modes(chain()).truncated(slice(4)), MEASURED)
    with pytest.raises(FbsError, match="between 1 and 2"):
        singular_basis(TRUE, ["x0", "x1"], ["x0", "x1"], 3)

"""What each number sees and what it is blind to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fbs import FbsError, Frf
from fbs.metrics import coherence_criterion, comac, csac, csf, fdac, frac, lac, mac

RNG = np.random.default_rng(0)
H: NDArray[np.complex128] = RNG.standard_normal((40, 3, 2)) + 1j * RNG.standard_normal((40, 3, 2))
LINES = np.arange(1.0, 41.0)


def frf(values: np.ndarray) -> Frf:
    return Frf(LINES, values, ("a", "b", "c"), ("p", "q"))


@pytest.mark.parametrize("factor", [1.0, 2.0, -1.0, 1j, 0.3 - 0.4j])
def test_a_factor(factor: complex) -> None:
    """Shape criteria are 1; those of size 2|f|/(1 + |f|²); the phase counts in one alone."""
    other = factor * H
    size = 2.0 * abs(factor) / (1.0 + abs(factor) ** 2)
    for shape in (frac(H, other), csac(frf(H), frf(other)), np.diag(fdac(frf(H), frf(other), "p"))):
        np.testing.assert_allclose(shape, 1.0, rtol=1e-12)
    np.testing.assert_allclose(csf(frf(H), frf(other)), size, rtol=1e-12)
    np.testing.assert_allclose(lac(H, other), size, rtol=1e-12)
    both = abs(1.0 + factor) ** 2 / (2.0 * (1.0 + abs(factor) ** 2))
    np.testing.assert_allclose(coherence_criterion(H, other), both, atol=1e-12)
    np.testing.assert_allclose(coherence_criterion(H, other, axis=1), both, atol=1e-12)


@given(st.integers(0, 1000))
def test_all_lie_between_0_and_1(seed: int) -> None:
    """Cauchy-Schwarz, and 2ab ≤ a² + b²."""
    rng = np.random.default_rng(seed)
    g = rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)
    one, two = frf(H), frf(g)
    for value in (frac(H, g), csac(one, two), csf(one, two), lac(H, g), fdac(one, two, "q"),
                  coherence_criterion(H, g), mac(H[0], g[0]), comac(H[0], g[0])):  # fmt: skip
        assert ((value >= 0.0) & (value <= 1.0 + 1e-12)).all()


def test_fdac_shows_a_shift() -> None:
    """Lines two apart are the same where all is shifted by two."""
    shifted = np.roll(H, 2, axis=0)
    found = fdac(frf(H), frf(shifted), "p")
    assert (np.argmax(found[:38], axis=1) == np.arange(38) + 2).all()


def test_mac_of_complex_shapes_is_blind_to_their_phase() -> None:
    shapes = H[:3, :, 0].T
    np.testing.assert_allclose(np.diag(mac(shapes, shapes * np.exp(0.7j))), 1.0, rtol=1e-12)
    np.testing.assert_allclose(
        mac([[1.0, 0.0], [0.0, 1.0]], [[1.0, 1.0], [0.0, 1.0]]), [[1, 0.5], [0, 0.5]]
    )


def test_comac_names_the_dof_that_spoils() -> None:
    shapes = RNG.standard_normal((5, 4))
    other = shapes.copy()
    other[2] = RNG.standard_normal(4)
    found = comac(shapes, other)
    assert np.argmin(found) == 2
    np.testing.assert_allclose(np.delete(found, 2), 1.0, rtol=1e-12)


def test_what_cannot_be_compared() -> None:
    with pytest.raises(FbsError, match="cannot be compared"):
        frac(H, H[:, :2])
    with pytest.raises(FbsError, match="over 2 and 3 DoFs"):
        mac(H[0, :2], H[0])
    assert np.isnan(frac(0.0 * H, H)).all()

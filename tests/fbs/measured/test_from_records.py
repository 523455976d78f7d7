"""Hammer and shaker records of a known structure give its FRFs, within the bands they state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.stats import f

from fbs import FbsError, Record, SecondOrderSystem, direct_frf
from fbs.measured.from_records import blows, frf_from_records

LABELS = ("a", "b")
MASS = np.diag([2.0, 1.0])
STIFFNESS = np.array([[5e5, -2e5], [-2e5, 3e5]])
DAMPING = 4e-5 * STIFFNESS + 4.0 * MASS
SYSTEM = SecondOrderSystem(MASS, DAMPING, STIFFNESS, LABELS)
RATE, N = 2048.0, 4096


def responses(force: NDArray[np.float64]) -> NDArray[np.float64]:
    """Accelerations under a force that runs straight between its samples, exactly."""
    n = len(LABELS)
    inverse = np.linalg.inv(MASS)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ STIFFNESS, -inverse @ DAMPING]])
    b = np.vstack([np.zeros((n, n)), inverse])
    h = 1 / RATE
    big = np.zeros((4 * n, 4 * n))
    big[: 2 * n, : 2 * n], big[: 2 * n, 2 * n : 3 * n] = a * h, b * h
    big[2 * n : 3 * n, 3 * n :] = np.eye(n)
    step = expm(big)[: 2 * n]
    phi, g1, g2 = step[:, : 2 * n], step[:, 2 * n : 3 * n], step[:, 3 * n :]
    state, found = np.zeros(2 * n), []
    for here, following in zip(force, np.vstack([force[1:], force[-1:]]), strict=True):
        found.append(a[n:] @ state + inverse @ here)
        state = phi @ state + g1 @ here + g2 @ (following - here)
    return np.array(found)


def blow(at: int, rng: np.random.Generator, noise: float = 0.0, n: int = N) -> Record:
    force = np.zeros((n, 2))
    pulse = np.sin(np.pi * np.arange(9) / 8) ** 2
    force[20:29, at] = rng.uniform(50, 150) * pulse
    motion = responses(force)
    motion += noise * np.abs(motion).max(axis=0) * rng.normal(size=motion.shape)
    return Record(RATE, force[:, [at]], motion, (LABELS[at],), LABELS, "accelerance")


def truth(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    return direct_frf(SYSTEM, frequency, quantity="accelerance").values


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_blows_at_each_point_give_the_matrix(estimator: str) -> None:
    rng = np.random.default_rng(1)
    records = [blow(at, rng) for at in (0, 1, 0, 1)]
    found = frf_from_records(records, estimator, fmin=20.0, fmax=200.0)  # type: ignore[arg-type]
    assert (found.signal, found.averages) == ("hammer", {"a": 2, "b": 2})
    assert found.frf.responses == found.frf.excitations == LABELS
    exact = truth(found.frf.frequency)
    # a force straight between samples has nothing above Nyquist but sinc²: (f/fs)² π²/6 = 1.6 %
    error = np.abs(found.frf.values - exact).max() / np.abs(exact).max()
    assert error < (np.pi * 200 / RATE) ** 2 / 3
    assert found.coherence is not None
    assert found.coherence.min() > 0.999


def test_the_variance_says_how_far_noise_goes() -> None:
    rng = np.random.default_rng(2)
    clean = frf_from_records([blow(0, rng)], fmin=30.0, fmax=150.0).frf.values
    records = [blow(0, rng, noise=0.003) for _ in range(8)]
    found = frf_from_records(records, fmin=30.0, fmax=150.0)
    assert found.variance is not None
    error = np.abs(found.frf.values - clean)
    # |error|² / variance has F(2, 2 (8 − 1)); the share inside of 482 values has 1 % of scatter
    inside = np.mean(error**2 < f.ppf(0.95, 2, 14) * found.variance)
    assert 0.91 < inside < 0.99


def test_a_record_of_several_blows_is_cut() -> None:
    rng = np.random.default_rng(3)
    singles = [blow(0, rng) for _ in range(3)]
    long = replace(
        singles[0],
        inputs=np.vstack([s.inputs for s in singles]),
        outputs=np.vstack([s.outputs for s in singles]),
    )
    cut = blows(long)
    assert len(cut) == 3
    assert {c.n_sample for c in cut} == {cut[0].n_sample}
    assert blows(singles[0]) == [singles[0]]
    found = frf_from_records([long], fmin=30.0, fmax=150.0)
    exact = truth(found.frf.frequency)[:, :, [0]]
    assert np.abs(found.frf.values - exact).max() < 0.02 * np.abs(exact).max()


def test_a_shaker_s_noise() -> None:
    rng = np.random.default_rng(4)
    force = np.zeros((2**16, 2))
    force[:, 0] = np.convolve(rng.normal(size=2**16), np.hanning(8), "same")
    record = Record(RATE, force[:, [0]], responses(force), ("a",), LABELS, "accelerance")
    found = frf_from_records([record], "Hv", fmin=30.0, fmax=150.0, segment=8192)
    assert (found.signal, found.added_damping) == ("noise", 0.0)
    exact = truth(found.frf.frequency)[:, :, [0]]
    error = np.abs(found.frf.values - exact) / np.abs(exact)
    assert np.median(error) < 0.01  # leakage: segments of 4 s, modes that fade in 0.1 s


def test_one_blow_has_no_coherence() -> None:
    found = frf_from_records([blow(0, np.random.default_rng(5))], fmin=30.0, fmax=150.0)
    assert found.coherence is None
    assert found.variance is None


def test_records_that_do_not_fit_together() -> None:
    one = blow(0, np.random.default_rng(6))
    both = replace(one, inputs=np.column_stack([one.inputs, one.inputs]), excitations=("a", "b"))
    with pytest.raises(FbsError, match="a excites in records together with different others"):
        frf_from_records([one, both])
    with pytest.raises(FbsError, match="no records given"):
        frf_from_records([])


def test_what_rings_on_is_told() -> None:
    """The slowest mode decays with α/2 + β ω²/2 = 2 + 2e-5 ω² 1/s, over a second and ten."""
    rng = np.random.default_rng(7)
    short = frf_from_records([blow(0, rng, n=2048)])
    omega = np.sqrt(np.linalg.eigvalsh(np.linalg.inv(np.sqrt(MASS)) @ STIFFNESS
                                       @ np.linalg.inv(np.sqrt(MASS))))[0]  # fmt: skip
    rate = 2.0 + 2e-5 * omega**2
    assert np.exp(-rate * 1.0) / 10 < short.remainder < 2 * np.exp(-rate * 0.95)
    assert frf_from_records([blow(0, rng, n=2048)], decay=5.0).remainder < 0.01
    long = frf_from_records([blow(0, rng, n=10 * 2048)])
    assert long.remainder < 1e-6

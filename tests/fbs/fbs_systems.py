"""Systems the tests share: random chains, a planetary-like one with a hub, and exact oracles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fbs import Frf, SecondOrderSystem

HUB_MASS = 2.24e-8  # kg, half the paper's coupling hub
HUB_STIFFNESS = 1e8  # N/m: a mode near 11 MHz


def spring_matrices(n: int, springs: Any) -> Any:
    """K and C as sums of k v v^T and c v v^T; springs are (v, k, c)."""
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for v, k, c in springs:
        stiffness += k * np.outer(v, v)
        damping += c * np.outer(v, v)
    return stiffness, damping


def unit(n: int, *signed: Any) -> Any:
    """A vector from (index, value) pairs."""
    v = np.zeros(n)
    for index, value in signed:
        v[index] = value
    return v


def random_springs(rng: np.random.Generator, n: int, grounded: Any, beta: Any) -> Any:
    """A chain with cross links; beta(rng) gives each spring's c / k."""
    vectors = [unit(n, (i, 1.0), (i + 1, -1.0)) for i in range(n - 1)]
    for _ in range(n if n > 2 else 0):
        i, j, k = rng.choice(n, 3, replace=False)
        vectors.append(unit(n, (i, 1.0), (j, -0.5), (k, -0.5)))
    if grounded:
        vectors.append(unit(n, (n - 1, 1.0)))
    stiffness = rng.uniform(1e8, 1e9, len(vectors))
    return [(v, k, k * beta(rng)) for v, k in zip(vectors, stiffness, strict=True)]


def random_system(
    rng: np.random.Generator,
    n: int,
    prefix: str = "x",
    grounded: bool = True,
    beta: Callable[..., Any] = lambda rng: 0.0,
    derived: Any = None,
) -> Any:
    stiffness, damping = spring_matrices(n, random_springs(rng, n, grounded, beta))
    mass = np.diag(rng.uniform(0.4, 5.0, n))
    return SecondOrderSystem(
        mass, damping, stiffness, tuple(f"{prefix}{i}" for i in range(n)), derived or {}
    )


def hub_system(
    seed: int, n: int = 22, grounded: bool = False, beta: Callable[..., Any] = lambda rng: 0.0
) -> Any:
    """Like a planetary stage that carries a nearly massless hub as its first DoF."""
    rng = np.random.default_rng(seed)
    body = [
        (np.concatenate([[0.0], v]), k, c) for v, k, c in random_springs(rng, n - 1, grounded, beta)
    ]
    hub = [
        (unit(n, (0, 1.0), (1, -1.0)), HUB_STIFFNESS, HUB_STIFFNESS * beta(rng)),
        (unit(n, (0, 1.0), (2, -1.0)), 1e5, 1e5 * beta(rng)),
    ]
    stiffness, damping = spring_matrices(n, hub + body)
    mass = np.diag(np.concatenate([[HUB_MASS], rng.uniform(0.4, 5.0, n - 1)]))
    return SecondOrderSystem(mass, damping, stiffness, ("hub", *(f"x{i}" for i in range(1, n))))


def long_double_frf(system: SecondOrderSystem, frequency: float) -> Any:
    """H at one line by Gauss-Jordan elimination in 80-bit arithmetic (three more digits)."""
    w = 2 * np.longdouble(np.pi) * np.longdouble(frequency)
    matrix = system.stiffness * (1 + 1j * np.longdouble(system.loss_factor))
    matrix += -(w**2) * system.mass + 1j * w * system.damping
    n = len(matrix)
    work = np.hstack([matrix, np.eye(n, dtype=np.clongdouble)])
    for k in range(n):
        pivot = k + int(np.argmax(np.abs(work[k:, k])))
        work[[k, pivot]] = work[[pivot, k]]
        work[k] /= work[k, k]
        for i in range(n):
            if i != k:
                work[i] -= work[i, k] * work[k]
    return work[:, n:]


def scaled_error(values: Any, reference: Any) -> Any:
    """|dH_ij| / sqrt(h_i h_j), h_i the norm of row i of the reference, per line: the largest."""
    values = values.values if isinstance(values, Frf) else np.asarray(values)
    reference = reference.values if isinstance(reference, Frf) else np.asarray(reference)
    row = np.sqrt((np.abs(reference) ** 2).sum(axis=-1).astype(float))
    scale = np.sqrt(row[..., :, None] * row[..., None, :])
    return np.asarray(np.abs(values - reference) / scale, dtype=float).max(axis=(-2, -1))

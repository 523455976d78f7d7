"""Systems with periodic springs for tests, and their motion as an ODE solver finds it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from fbs import PeriodicSpring, SecondOrderSystem


def planetary(
    rng: np.random.Generator, n: int, ratios: Sequence[float], *, free: bool = False, **keys: Any
) -> tuple[SecondOrderSystem, list[PeriodicSpring]]:
    """A sun, n planets on springs of their own, and a spring sun–planet each, varied in turn.

    As a planetary stage's torsional model: DoFs (sun, planets); ``free`` leaves out what holds the
    planets to ground, so that all turn together.
    """
    size = n + 1
    stretch = np.eye(size)[0] - np.eye(size)[1:]
    to_next = np.roll(np.eye(size)[1:], 1, axis=0) - np.eye(size)[1:]
    held = to_next if free else np.eye(size)[1:]
    stiffness = rng.uniform(1e4, 4e4, n)
    beta = keys.pop("beta", 5e-4)
    matrix = sum(
        k * np.outer(v, v)
        for k, v in zip([*stiffness, *rng.uniform(1e4, 4e4, n)], [*stretch, *held], strict=True)
    )
    springs = [
        random_spring(rng, f"mesh {m}", stretch[m], stiffness[m], ratio, beta, **keys)
        for m, ratio in enumerate(ratios)
    ]
    dofs = ("sun", *(f"planet{m}" for m in range(1, n + 1)))
    return SecondOrderSystem(np.diag(rng.uniform(0.5, 2, size)), beta * matrix, matrix, dofs), (
        springs
    )


def random_spring(
    rng: np.random.Generator,
    name: str,
    vector: Any,
    stiffness: float,
    ratio: float,
    beta: float,
    variation: float = 0.2,
) -> PeriodicSpring:
    """Three harmonics of stiffness, two of error (0.1 mm), 1 to 10 N of load."""

    def series(size: float, count: int) -> Any:
        angles = rng.uniform(0, 2 * np.pi, count)
        return size * np.exp(1j * angles) / np.arange(1, count + 1) ** 2

    return PeriodicSpring(
        name,
        vector,
        stiffness,
        ratio,
        series(variation, 3),
        series(1e-4, 2),
        beta * stiffness,
        rng.uniform(1, 10),
    )


def laws(
    springs: Sequence[PeriodicSpring], shaft: float
) -> Callable[[float], tuple[Any, Any, Any]]:
    """Of an instant: κ, e and ė of every spring."""
    count = max(max(s.variation.size, s.error.size) for s in springs)

    def padded(key: str) -> Any:
        return np.array(
            [np.pad(getattr(s, key), (0, count - getattr(s, key).size)) for s in springs]
        )

    omega = 2 * np.pi * shaft * np.outer([s.ratio for s in springs], np.arange(1, count + 1))
    variation, error, slope = padded("variation"), padded("error"), 1j * omega * padded("error")

    def at(t: float) -> tuple[Any, Any, Any]:
        wave = np.exp(1j * omega * t)
        return tuple((c * wave).sum(axis=1).real for c in (variation, error, slope))

    return at


def right_hand_side(
    system: SecondOrderSystem, springs: Sequence[PeriodicSpring], shaft: float
) -> Callable[[float, Any], Any]:
    """z' of z = (q, q̇), the springs' law written out: M q̈ = −C q̇ − K q − Σ v p."""
    law = laws(springs, shaft)
    n = len(system.dofs)
    k, c, static = (
        np.array([getattr(s, key) for s in springs])
        for key in ("stiffness", "damping", "static_force")
    )
    vectors = np.array([s.vector for s in springs])
    inverse = np.linalg.inv(system.mass)
    steady = -inverse @ np.hstack([system.stiffness, system.damping])
    pushed = -inverse @ vectors.T

    def right(t: float, z: Any) -> Any:
        kappa, error, slope = law(t)
        excess = k * kappa * (static / k + vectors @ z[:n] - error) - k * error - c * slope
        return np.concatenate([z[n:], steady @ z + pushed @ excess])

    return right


def integrated(right: Any, start: Any, times: Any) -> Any:
    """DOP853 at 1e-12, sampled (n_time, n)."""
    found = solve_ivp(
        right, (0.0, times[-1]), start, method="DOP853", rtol=1e-12, atol=1e-17, t_eval=times
    )
    return found.y.T


def periodic_orbit(right: Any, size: int, times: Any) -> Any:
    """The periodic motion of a linear system by shooting; ``times`` from 0 to a period.

    z(T) = Φ z(0) + b. What drifts freely is left out: the least of all solutions.
    """
    span = np.array([0.0, times[-1]])
    offset = integrated(right, np.zeros(size), span)[-1]
    scale = 1e-4
    ends = [integrated(right, scale * e, span)[-1] for e in np.eye(size)]
    monodromy = (np.array(ends) - offset).T / scale
    start = np.linalg.lstsq(np.eye(size) - monodromy, offset, rcond=1e-9)[0]
    return integrated(right, start, times)

"""Poles of a route that has only FRFs, by modal filter.

With the shapes Φ of a group of repeated modes, mass-normalised, and B = MΦ,

    (Bᵀ H(ω) B)⁻¹ = Λ − ω² + jωΓ

exactly, for every other mode is filtered out. One line close to the group is enough; because it
is close, a shape that is a little wrong does not matter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from .metrics import subspace_mac

Array = NDArray[Any]

# How far (relative) the line lies from the group: near enough for its poles to rule, far enough
# that an undamped H keeps eleven digits.
DETUNING = 1e-4


@dataclass(frozen=True)
class FilteredPole:
    """A pole read off an FRF, and how well the FRF's shapes span the group they should."""

    frequency_hz: float
    damping_ratio: float
    subspace_mac: float


def filtered_poles(
    receptance: Callable[[FloatArray], Array],
    mass: FloatArray,
    groups: Sequence[tuple[float, FloatArray]],
) -> list[FilteredPole]:
    """Poles of every mode, from FRFs.

    Parameters
    ----------
    receptance
        (n_frequency,) Hz → (n_frequency, n, n) m/N of all independent DoFs.
    mass
        (n, n) kg.
    groups
        Natural frequency (Hz) and mass-normalised shapes (n, m) of every group of (nearly)
        repeated modes.
    """
    lines = np.array([frequency * (1.0 - DETUNING) for frequency, _ in groups])
    order = np.argsort(lines)
    responses = dict(zip(order.tolist(), receptance(lines[order]), strict=True))
    poles: list[FilteredPole] = []
    for number, (_, shapes) in enumerate(groups):
        poles += _group_poles(responses[number], 2.0 * np.pi * lines[number], mass, shapes)
    return poles


def _group_poles(
    receptance: Array, omega: float, mass: FloatArray, shapes: FloatArray
) -> list[FilteredPole]:
    filtered = receptance @ (mass @ shapes)
    modal = np.linalg.inv(shapes.T @ mass @ filtered)
    eigenvalues = np.linalg.eigvalsh((modal.real + modal.real.T) / 2.0) + omega**2
    decay = np.sort(np.linalg.eigvals(modal.imag / omega).real)
    mac = subspace_mac(shapes, filtered, mass)
    natural = np.sqrt(np.maximum(eigenvalues, 0.0))
    return [
        FilteredPole(float(w / (2.0 * np.pi)), float(gamma / (2.0 * w)) if w > 0 else 0.0, mac)
        for w, gamma in zip(natural, decay, strict=True)
    ]

"""Functions of period 1 without a mean: a mesh's stiffness and error over a mesh period."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


class Waveform(Protocol):
    """A function of τ with period 1 and mean 0."""

    def value(self, turns: ArrayLike) -> FloatArray:
        """Its values at some τ."""

    def slope(self, turns: ArrayLike) -> FloatArray:
        """Its derivative by τ at some τ."""

    def harmonic(self, order: int) -> complex:
        """c_l of Re Σ c_l exp(j2π l τ), l = 1, 2, …"""

    @property
    def kinks(self) -> tuple[float, ...]:
        """The τ in [0, 1) where its slope jumps."""


@dataclass(frozen=True)
class FourierSeries:
    """Σ A_l cos(2π l τ + φ_l), l = 1, 2, …

    Attributes
    ----------
    amplitudes, phases
        A_l, and φ_l in rad.
    """

    amplitudes: tuple[float, ...] = ()
    phases: tuple[float, ...] = ()

    def value(self, turns: ArrayLike) -> FloatArray:
        """Its values at some τ."""
        values = np.zeros(np.shape(turns))
        for order, (a, phase) in enumerate(zip(self.amplitudes, self.phases, strict=True), 1):
            values = values + a * np.cos(2.0 * np.pi * order * np.asarray(turns) + phase)
        return values

    def slope(self, turns: ArrayLike) -> FloatArray:
        """Its derivative by τ at some τ."""
        values = np.zeros(np.shape(turns))
        for order, (a, phase) in enumerate(zip(self.amplitudes, self.phases, strict=True), 1):
            w = 2.0 * np.pi * order
            values = values - a * w * np.sin(w * np.asarray(turns) + phase)
        return values

    def harmonic(self, order: int) -> complex:
        """A_l exp(jφ_l)."""
        if order > len(self.amplitudes):
            return 0.0
        phase = self.phases[order - 1]
        return self.amplitudes[order - 1] * complex(math.cos(phase), math.sin(phase))

    @property
    def kinks(self) -> tuple[float, ...]:
        """None."""
        return ()


@dataclass(frozen=True)
class Trapezoid:
    """High for the share d of the period, low for the rest, with straight ramps between.

    The middle of the low part is at τ = ``phase``.

    Attributes
    ----------
    height
        High minus low.
    share
        d, counted between the middles of the ramps.
    transition
        How long each ramp takes.
    phase
        Where the middle of the low part lies.
    """

    height: float
    share: float
    transition: float
    phase: float = 0.0

    def value(self, turns: ArrayLike) -> FloatArray:
        """Its values at some τ."""
        raised: FloatArray = self.height * (np.clip(self._ramp(turns), 0.0, 1.0) - self.share)
        return raised

    def _ramp(self, turns: ArrayLike) -> FloatArray:
        """Below 0 where low, above 1 where high, between them on a ramp."""
        from_middle = np.abs((np.asarray(turns) - self.phase + 0.5) % 1.0 - 0.5)
        ramp: FloatArray = (from_middle - 0.5 * (1.0 - self.share)) / self.transition + 0.5
        return ramp

    def slope(self, turns: ArrayLike) -> FloatArray:
        """Its derivative by τ at some τ."""
        ramp = self._ramp(turns)
        way = np.where((np.asarray(turns) - self.phase) % 1.0 < 0.5, 1.0, -1.0)
        on_ramp = (ramp > 0.0) & (ramp < 1.0)
        return np.where(on_ramp, way * self.height / self.transition, 0.0)

    def harmonic(self, order: int) -> complex:
        """−2h sin(π l (1−d)) sin(π l s)/((π l)² s), s the transition, turned by the phase."""
        x = math.pi * order
        ramp = math.sin(x * self.transition) / (x * self.transition)
        amplitude = -2.0 * self.height * math.sin(x * (1.0 - self.share)) / x * ramp
        angle = 2.0 * x * self.phase
        return amplitude * complex(math.cos(angle), -math.sin(angle))

    @property
    def kinks(self) -> tuple[float, ...]:
        """The ends of both ramps."""
        middle, half = 0.5 * (1.0 - self.share), 0.5 * self.transition
        ends = (-middle - half, -middle + half, middle - half, middle + half)
        return tuple(sorted((end + self.phase) % 1.0 for end in ends))

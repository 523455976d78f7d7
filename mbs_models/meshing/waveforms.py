"""Functions of period 1 without a mean: what a mesh's stiffness and error are over a mesh period.

They are evaluated at every stage of every integration step, one instant at a time: plain floats.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol


class Waveform(Protocol):
    """A function of τ with period 1 and mean 0."""

    def value(self, turns: float) -> float:
        """Its value at τ."""

    def slope(self, turns: float) -> float:
        """Its derivative by τ."""

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

    @cached_property
    def _terms(self) -> tuple[tuple[float, float, float], ...]:
        pairs = zip(self.amplitudes, self.phases, strict=True)
        return tuple((a, 2.0 * math.pi * order, p) for order, (a, p) in enumerate(pairs, start=1))

    def value(self, turns: float) -> float:
        """Its value at τ."""
        value = 0.0
        for a, w, p in self._terms:
            value += a * math.cos(w * turns + p)
        return value

    def slope(self, turns: float) -> float:
        """Its derivative by τ."""
        slope = 0.0
        for a, w, p in self._terms:
            slope -= a * w * math.sin(w * turns + p)
        return slope

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

    def value(self, turns: float) -> float:
        """Its value at τ."""
        return self.height * (self._raised(turns) - self.share)

    def _raised(self, turns: float) -> float:
        """0 where low, 1 where high."""
        from_middle = abs((turns - self.phase + 0.5) % 1.0 - 0.5)
        ramp = (from_middle - 0.5 * (1.0 - self.share)) / self.transition + 0.5
        return 0.0 if ramp < 0.0 else 1.0 if ramp > 1.0 else ramp

    def slope(self, turns: float) -> float:
        """Its derivative by τ."""
        if not 0.0 < self._raised(turns) < 1.0:
            return 0.0
        rising = (turns - self.phase) % 1.0 < 0.5
        return (1.0 if rising else -1.0) * self.height / self.transition

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

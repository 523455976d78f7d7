"""The tables of a model file that say how a mesh excites: stiffness over a period, error, play.

All are periodic with the mesh, a function of the turns τ = f_mesh t − γ (γ: the mesh's phase). τ is
whole when the contact of the loaded flanks passes the pitch point.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ..signals.waveforms import FourierSeries, Trapezoid
from .bodies import Table, physical

# Samples per period of the highest harmonic when its smallest stiffness is looked for: between
# them k is at most ½(π/360)² of the harmonics' amplitudes smaller.
SAMPLES = 360

Phase = Annotated[float, physical(1e-12, 1e3, "mesh periods")]
Harmonic = Annotated[
    tuple[Annotated[float, physical(1e-15, 3600.0, "")], ...],
    Field(min_length=2, max_length=2, strict=False, description="[amplitude, phase in deg]"),
]
Harmonics = Annotated[
    tuple[Harmonic, ...],
    Field(
        min_length=1,
        max_length=100,
        strict=False,
        description="a list of [amplitude, phase in deg]",
    ),
]


def fourier_series(harmonics: tuple[Harmonic, ...]) -> FourierSeries:
    """Σ A_l cos(2π l τ + φ_l) of the pairs (A_l, φ_l in deg), l = 1, 2, …"""
    return FourierSeries(
        tuple(amplitude for amplitude, _ in harmonics),
        tuple(math.radians(phase) for _, phase in harmonics),
    )


class ConstantStiffness(Table):
    """k = k_m."""

    shape: Literal["constant"] = "constant"

    @property
    def waveform(self) -> FourierSeries:
        """Nothing."""
        return FourierSeries()


class HarmonicVariation(Table):
    """k = k_m (1 + Σ A_l cos(2π l τ + φ_l)): ``harmonics`` lists [A_l, φ_l (deg)], l = 1, 2, …"""

    shape: Literal["harmonics"]
    harmonics: Harmonics

    @model_validator(mode="after")
    def _positive(self) -> Self:
        count = SAMPLES * len(self.harmonics)
        smallest = 1.0 + min(map(self.waveform.value, np.arange(count) / count))
        if smallest <= 0.0:
            raise ValueError(
                f"harmonics: the stiffness falls to {smallest:.3g} of its mean; it must stay "
                "above 0: give smaller amplitudes"
            )
        return self

    @property
    def waveform(self) -> FourierSeries:
        """(k − k_m)/k_m over τ."""
        return fourier_series(self.harmonics)


class TrapezoidVariation(Table):
    """k between n and n + 1 pairs of teeth in contact, n = ⌊``contact_ratio``⌋; the mean is k_m.

    The share d = ε − n of a mesh period has n + 1 pairs. ``amplitude`` is (k_max − k_min)/k_m,
    peak to peak; without it all pairs are equally stiff: 1/ε. Each of the two ramps takes the share
    ``transition`` of the period. The middle of the time with fewer pairs is where the contact
    passes the pitch point, ``phase`` (mesh periods) later.
    """

    shape: Literal["trapezoid"]
    contact_ratio: Annotated[float, Field(gt=1.0, le=20.0)]
    amplitude: Annotated[float, Field(gt=0.0)] | None = None
    transition: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.1
    phase: Phase = 0.0

    @model_validator(mode="after")
    def _possible(self) -> Self:
        more = self.contact_ratio % 1.0
        if more == 0.0:
            raise ValueError(
                f"contact_ratio = {self.contact_ratio}: as many pairs of teeth at all times: "
                "the stiffness does not vary; give another, or leave the variation out"
            )
        longest = min(more, 1.0 - more)
        if self.transition > longest:
            raise ValueError(
                f"transition = {self.transition}: with contact_ratio = {self.contact_ratio} the "
                f"number of pairs stays for {longest:.3g} of a mesh period; the transition must "
                "not be longer"
            )
        if more * self.peak_to_peak >= 1.0:
            raise ValueError(
                f"amplitude = {self.amplitude}: the stiffness falls to "
                f"{1.0 - more * self.peak_to_peak:.3g} of its mean; it must stay above 0: give "
                f"less than {1.0 / more:.4g}"
            )
        return self

    @property
    def peak_to_peak(self) -> float:
        """(k_max − k_min)/k_m."""
        return 1.0 / self.contact_ratio if self.amplitude is None else self.amplitude

    @property
    def waveform(self) -> Trapezoid:
        """(k − k_m)/k_m over τ."""
        return Trapezoid(self.peak_to_peak, self.contact_ratio % 1.0, self.transition, self.phase)


MeshVariation = Annotated[
    TrapezoidVariation | HarmonicVariation | ConstantStiffness, Field(discriminator="shape")
]
CONSTANT_STIFFNESS = ConstantStiffness()


class TransmissionError(Table):
    """How far the driving gear runs ahead, unloaded: e = Σ E_l cos(2π l τ + φ_l) in m.

    Along the line of action; ``harmonics`` lists [E_l (m), φ_l (deg)], l = 1, 2, …
    """

    harmonics: Harmonics

    @property
    def waveform(self) -> FourierSeries:
        """e over τ (m)."""
        return fourier_series(self.harmonics)


Backlash = Annotated[
    float, Field(ge=0.0, json_schema_extra={"unit": "m"}), physical(1e-12, 1.0, "m")
]

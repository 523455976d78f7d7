"""Guo 2011 (see `test_guo_2011`), Eqs. (7.2) and (7.3): a trapezoid of mesh stiffness as a series.

    k̃ = 2 k_v Σ (A_μ sin μΩt + B_μ cos μΩt)

rises where the pitch point is in contact, t = γT, and is high for the share c − 1 of the period T.
"""

from __future__ import annotations

import numpy as np

SLOPE = 0.05  # ρ: each ramp takes 2ρ of a period


def coefficients(mu: int, contact_ratio: float, phase: float, slope: float) -> tuple[float, float]:
    """A_μ and B_μ for a contact ratio c, a phase γ and ρ."""
    x = mu * np.pi
    size = np.sin(2.0 * x * slope) / (slope * x**2) * np.sin(x * contact_ratio)
    angle = x * (contact_ratio + 2.0 * phase)
    return size * np.sin(angle), size * np.cos(angle)

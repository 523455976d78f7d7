"""Stiffnesses outside what their kind of machine element has.

A mesh has k = c_γ b with c_γ = 14 to 20 N/(mm µm) of steel gears (ISO 6336-1: about 20) and a face
width b between 0.05 and 2.5 pitch diameters of the smaller gear.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from ..model.parameters import Coupling, Part
from ..stages.given_springs import GivenSpring, SpringKind
from .finding import Finding

SOFTEST, STIFFEST = 14e9, 20e9  # N/m of mesh stiffness per m of face width
NARROWEST, WIDEST = 0.05, 2.5  # face width over pitch diameter
LEEWAY = 3.0  # for aluminium, contact ratios, thin rims: a wrong unit is a thousand

# N/m. Bearings: rolling and journal bearings have 1e7 to 2e10, soft mounts a tenth. Rocking seen
# at the base radius: self-aligning bearings leave little. Shafts are seen at a radius that the
# file chooses.
RANGES: Mapping[SpringKind, tuple[float, float]] = {
    SpringKind.BEARING: (1e6, 1e11),
    SpringKind.ROCKING: (1e5, 1e12),
    SpringKind.SUPPORT: (1e7, 1e12),
    SpringKind.SHAFT: (1e3, 1e12),
}
# From here on no machine element is as stiff: it stands for something rigid, as it may.
RIGID = 1e12


def stiffnesses_in_range(part: Part | Coupling) -> Iterator[Finding]:
    """Stiffnesses that no element of their kind has.

    0 is no spring at all, as it may be where it is no mesh; from 1e12 N/m on it is rigid.
    """
    for spring in part.given_springs():
        low, high = mesh_range(spring.diameter)
        fits = f"; that is a mesh of steel gears {spring.diameter * 1e3:.3g} mm in diameter"
        if spring.kind is not SpringKind.MESH:
            low, high = RANGES[spring.kind]
            fits = f" for {spring.kind.value}"
        if _outside(spring, low, high):
            reason = f"expected {low:.1e} to {high:.1e} N/m{fits}{_slip(spring.value, low, high)}"
            yield Finding(part.name, spring.key, spring.written, reason)


def mesh_range(diameter: float) -> tuple[float, float]:
    """Smallest and largest mesh stiffness (N/m) of gears of a pitch diameter (m)."""
    return SOFTEST * NARROWEST * diameter / LEEWAY, STIFFEST * WIDEST * diameter * LEEWAY


def _outside(spring: GivenSpring, low: float, high: float) -> bool:
    if spring.value == 0.0:
        return spring.kind is SpringKind.MESH  # no torque passes
    return spring.value < RIGID and not low <= spring.value <= high


def _slip(value: float, low: float, high: float) -> str:
    """What unit the number may be in."""
    in_range = low <= 1000.0 * value <= high and math.isfinite(value)
    return f"; {value:g} N/mm are {1000.0 * value:g} N/m" if in_range else ""

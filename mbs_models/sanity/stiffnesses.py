"""Stiffnesses outside what their kind of machine element has, or far off their neighbours.

A mesh has k = c_γ b with c_γ = 14 to 20 N/(mm µm) of steel gears (ISO 6336-1: about 20) and a face
width b between 0.05 and 2.5 pitch diameters of the smaller gear.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from decimal import Decimal
from statistics import median

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
    SpringKind.TORSION: (1e7, 1e12),
    SpringKind.SHAFT: (1e3, 1e12),
}
# From here on no machine element is as stiff: it stands for something rigid, as it may.
RIGID = 1e12
DECADES = 3.0  # a thousand times: what N/mm for N/m, or a forgotten k, makes
COUNTABLE = 6.0  # decades up to which a factor is written out


def stiffnesses_in_range(part: Part | Coupling) -> Iterator[Finding]:
    """Stiffnesses that no element of their kind has.

    0 is no spring at all, as it may be where it is no mesh; from 1e12 N/m on it is rigid.
    """
    for spring in part.given_springs():
        low, high = mesh_range(spring.diameter)
        fits = f"; that is a mesh of steel gears {spring.diameter * 1e3:.3g} mm in diameter"
        if spring.kind is not SpringKind.MESH:
            low, high = RANGES[spring.kind]
            fits = f" for a {spring.kind}"
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


def off_their_neighbours(part: Part | Coupling) -> Iterator[Finding]:
    """Stiffnesses more than a thousand times off the median of their part's or coupling's.

    They are pointed out, not refused: a soft coupling or a fixed ring may be meant.
    """
    # What a radius makes infinite is left to those who compute with it.
    given = [spring for spring in part.given_springs() if 0.0 < spring.value < math.inf]
    if len(given) < 2:
        return
    middle = median(math.log10(spring.value) for spring in given)
    for spring in given:
        decades = math.log10(spring.value) - middle
        if abs(decades) > DECADES:
            reason = f"{_times(decades)} its neighbours ({_power(middle)} N/m); is the unit right?"
            yield Finding(part.name, spring.key, spring.written, reason)


def _times(decades: float) -> str:
    """A factor of 10^decades in words."""
    if abs(decades) > COUNTABLE:
        return f"{_power(decades)} times"
    factor = f"{10.0 ** abs(decades):.0f}"
    return f"{factor} times" if decades > 0.0 else f"a {factor}th of"


def _power(decades: float) -> str:
    """10^decades in digits, though no float may hold it: 3.2e+152."""
    return f"{Decimal(10) ** Decimal(decades):.1e}"

"""Zhang & Jin 1996, *Computation of Special Functions* (Wiley): Mathieu's characteristic values.

A gear pair whose mesh stiffness varies as 1 + A cos ωt is Mathieu's equation ẍ + (a − 2q cos 2t) x
= 0 with a = 4 ω_0²/ω², A = 2q/a (the sign of A is a shift in time): its instabilities, the tongues
of the Ince–Strutt chart, end where a is a characteristic value a_r (even) or b_r (odd) of q, at

    f_mesh = 2 f_0/√a.

They are printed with nine decimals for q = 25 and n = 5 to 12 at the head of the book's programs
CVA1 and CVA2, which were read, the book not. Of these a mesh can have n ≥ 7: A < 1. These are
strong variations, A = 0.48 to 0.91, and high orders r ω = 2 ω_0, beyond first-order theory.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from fbs import PeriodicSpring, SecondOrderSystem, stability, steady_state
from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.signals.waveforms import FourierSeries
from tests.instability import instability_boundary
from validation.routes.floquet import ParametricSystem, growth_rate

Q = 25.0
PRINTED = {  # order → a_r, b_r
    7: (57.534689001, 55.002957151),
    8: (69.524065166, 69.057988351),
    9: (85.076999882, 85.023356505),
    10: (103.230204804, 103.225680042),
}
NATURAL = 1000.0  # Hz
MASSES = 2.0, 3.0  # kg, of pinion and wheel at their base radii


class Boundary(NamedTuple):
    """One end of a tongue."""

    order: int
    even: bool
    value: float

    @property
    def variation(self) -> float:
        return 2.0 * Q / self.value

    @property
    def frequency(self) -> float:
        """Of the mesh (Hz)."""
        return 2.0 * NATURAL / float(np.sqrt(self.value))


BOUNDARIES = [
    Boundary(order, even, value)
    for order, pair in PRINTED.items()
    for even, value in zip((True, False), pair, strict=True)
]


def identity(boundary: Boundary) -> str:
    return f"{'a' if boundary.even else 'b'}{boundary.order}"


def gear_pair(boundary: Boundary) -> tuple[SecondOrderSystem, PeriodicSpring]:
    """Two gears free to turn, loaded with 1000 N; an odd boundary also has an odd error."""
    reduced = MASSES[0] * MASSES[1] / sum(MASSES)
    mesh = np.array([1.0, -1.0])
    k = reduced * (2.0 * np.pi * NATURAL) ** 2
    system = SecondOrderSystem(
        np.diag(MASSES), np.zeros((2, 2)), k * np.outer(mesh, mesh), ("pinion.w", "wheel.w")
    )
    error = [] if boundary.even else [-1e-6j]
    spring = PeriodicSpring(
        "mesh", mesh, k, 1.0, [boundary.variation], error, static_force=1000.0 * boundary.even
    )
    return system, spring


def by_magnus(boundary: Boundary) -> tuple[Callable[[float], float], ParametricSystem]:
    omega = np.array([2.0 * np.pi * NATURAL])
    law = MeshLaw(1.0, 0.0, FourierSeries((boundary.variation,), (0.0,)))
    system = ParametricSystem(omega, np.zeros((1, 1)), omega[:, None], (law,))
    return lambda f: growth_rate(system, f), system


def by_splitting(boundary: Boundary) -> Callable[[float], float]:
    system, spring = gear_pair(boundary)
    return lambda f: float(stability(system, [spring], [f]).growth_rate[0])


def unstable_side(boundary: Boundary) -> float:
    """A tongue lies between the frequencies of a_r, the larger value, and b_r."""
    return 1.0 if boundary.even else -1.0


@pytest.mark.parametrize("boundary", BOUNDARIES, ids=identity)
def test_boundaries_by_magnus(boundary: Boundary) -> None:
    """Found by bisection; 16 steps a radian of the stiffest motion leave (1/16)⁴/720 = 2e-8."""
    _, system = by_magnus(boundary)
    width = abs(np.sqrt(PRINTED[boundary.order][0] / PRINTED[boundary.order][1]) - 1.0)
    step = 0.2 * width * boundary.frequency * unstable_side(boundary)
    found = instability_boundary(
        system,
        boundary.frequency - step,
        boundary.frequency + step,
        threshold=1e-9,
        tolerance=1e-11,
    )
    assert found == pytest.approx(boundary.frequency, rel=2e-8)


@pytest.mark.parametrize("boundary", BOUNDARIES, ids=identity)
def test_boundaries_by_kicks(boundary: Boundary) -> None:
    """64 steps a period: κ² (h ω_0)⁴/720 of the frequency, (1 + A)² ≤ 4 times where k is largest.

    That is 3e-5 to 8e-5. Of order 10, whose tongue is 2e-5 wide, it tells the place, not the ends.
    """
    growth = by_splitting(boundary)
    step = 2.0 * np.pi * NATURAL / (64.0 * boundary.frequency)
    error = 4.0 * boundary.variation**2 * step**4 / 720.0 * unstable_side(boundary)
    assert growth(boundary.frequency * (1.0 - error)) < 1e-9
    a, b = PRINTED[boundary.order]
    if np.sqrt(a / b) - 1.0 > 2.0 * abs(error):
        assert growth(boundary.frequency * (1.0 + error)) > 0.1


@pytest.mark.parametrize("boundary", [b for b in BOUNDARIES if b.order % 2 == 0], ids=identity)
def test_the_steady_state_has_a_pole_at_the_boundary(boundary: Boundary) -> None:
    """To every digit printed: 25 harmonics of a smooth law leave nothing else.

    Of an even order the boundary's motion has the mesh's own period: undamped, a force in its shape
    (the static one in that of a_r, the odd error in that of b_r) drives it without bound. From
    both sides, 1e-7 away, 1/amplitude passes 0 straight but for some 1e-14.
    """
    system, spring = gear_pair(boundary)
    frequencies = boundary.frequency * np.array([1.0 - 1e-7, 1.0 + 1e-7])
    response = steady_state(system, [spring], frequencies, harmonics=25)
    amplitude = response.deflection[:, boundary.order // 2, 0]
    part = amplitude.real if boundary.even else amplitude.imag
    first, second = 1.0 / part
    pole = frequencies[0] - first * (frequencies[1] - frequencies[0]) / (second - first)
    assert (2.0 * NATURAL / pole) ** 2 == pytest.approx(boundary.value, abs=1e-9)

"""Lin & Parker 2002, J. Vib. Acoust. 124, 68–76: instabilities of two meshes in a row.

An idler (both meshes at one frequency) and a countershaft (two frequencies). Of the paper its first
page was read; its boundaries

    Ω = [ω_e + ω_f ± ξ √(Λ/(ω_e ω_f))]/μ,    Λ = (Σ g k A_μ δ_e δ_f)² + (Σ g k B_μ δ_e δ_f)²,

with the sums over the meshes, are as Guo (2011, PhD thesis, Ohio State University, pp. 178–187)
gives them, who corrects a misprint of theirs: Eqs. (7.3), (7.17) to (7.19), and (7.24) for
harmonics of two frequencies that meet. The paper's example was not to be had: masses and springs
are our own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from fbs import PeriodicSpring, SecondOrderSystem, stability
from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.signals.waveforms import Trapezoid
from tests.literature.stiffness_series import SLOPE, coefficients
from validation.routes.floquet import ParametricSystem, growth_rate

AMPLITUDE = 0.001  # 2ξ of both meshes: second-order terms are 1 % of the widths
MESHES = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]])


@dataclass(frozen=True)
class TwoMeshes:
    """Three gears in a row, free to turn; along the lines of action.

    Attributes
    ----------
    masses, stiffness
        kg of the gears, N/m of the meshes.
    contact_ratios, phases
        Of the meshes; phases in periods.
    ratios
        Mesh frequencies, of one that is told.
    """

    masses: tuple[float, float, float] = (1.0, 1.7, 2.4)
    stiffness: tuple[float, float] = (1.0e8, 0.6e8)
    contact_ratios: tuple[float, float] = (1.4, 1.7)
    phases: tuple[float, float] = (0.0, 0.3)
    ratios: tuple[int, int] = (1, 1)

    @property
    def modes(self) -> tuple[Any, Any]:
        """ω (2,) rad/s, and √k δ (2 meshes, 2 modes) of the two that strain the meshes."""
        stiffness = MESHES.T @ np.diag(self.stiffness) @ MESHES
        squares, shapes = eigh(stiffness, np.diag(self.masses))
        rows = np.sqrt(self.stiffness)[:, None] * MESHES @ shapes[:, 1:]
        return np.sqrt(squares[1:]), rows

    @property
    def waveforms(self) -> list[Trapezoid]:
        """High from each mesh's pitch point on, as Eq. (7.3) has it."""
        return [Trapezoid(AMPLITUDE, c - 1.0, 2.0 * SLOPE, c / 2.0) for c in self.contact_ratios]

    def indicator(self, orders: tuple[int, int], e: int, f: int) -> float:
        """√(Λ/(ω_e ω_f)) or √(Π/(ω_e ω_f)): harmonics of each mesh that meet there, 0 for none."""
        omega, rows = self.modes
        key = np.zeros(2)
        for mesh, order in enumerate(orders):
            if order:
                terms = coefficients(order, self.contact_ratios[mesh], self.phases[mesh], SLOPE)
                key += np.array(terms) * rows[mesh, e] * rows[mesh, f]
        return float(np.hypot(*key) / np.sqrt(omega[e] * omega[f]))

    def by_magnus(self) -> Callable[[float], float]:
        """Growth (1/s) at a mesh frequency (Hz)."""
        omega, rows = self.modes
        laws = tuple(
            MeshLaw(1.0, phase, waveform)
            for phase, waveform in zip(self.phases, self.waveforms, strict=True)
        )
        system = ParametricSystem(omega, np.zeros((2, 2)), rows, laws)
        return lambda frequency: growth_rate(system, frequency)

    def by_kicks(self) -> Callable[[float], float]:
        """Growth (1/s) at a mesh frequency (Hz) of ratio 1."""
        orders = np.arange(1, 65)
        springs = []
        for mesh in range(2):
            series = np.array([self.waveforms[mesh].harmonic(int(order)) for order in orders])
            springs.append(
                PeriodicSpring(
                    f"mesh {mesh}",
                    MESHES[mesh],
                    self.stiffness[mesh],
                    float(self.ratios[mesh]),
                    series * np.exp(-2j * np.pi * orders * self.phases[mesh]),
                    [],
                )
            )
        stiffness = MESHES.T @ np.diag(self.stiffness) @ MESHES
        system = SecondOrderSystem(
            np.diag(self.masses), np.zeros((3, 3)), stiffness, ("a.w", "b.w", "c.w")
        )
        return lambda frequency: float(stability(system, springs, [frequency]).growth_rate[0])


def assert_boundaries(
    growth: Callable[[float], float], mu: int, total: float, indicator: float
) -> None:
    """Of the instability at μΩ = ω_e + ω_f (rad/s): growth in the middle, both ends to 2 %."""
    largest = AMPLITUDE / 2.0 * indicator / 2.0
    centre, half_width = total / (2.0 * np.pi * mu), largest / (np.pi * mu)
    assert growth(centre) == pytest.approx(largest, rel=0.01)
    for side in (-1.0, 1.0):
        assert growth(centre + 0.98 * side * half_width) > 0.1 * largest
        assert growth(centre + 1.02 * side * half_width) < 1e-6 * largest


@pytest.mark.parametrize("pair", [(0, 0), (0, 1), (1, 1)], ids=["first", "both", "second"])
@pytest.mark.parametrize("mu", [1, 2])
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5])
def test_an_idlers_boundaries(phase: float, mu: int, pair: tuple[int, int]) -> None:
    idler = TwoMeshes(phases=(0.0, phase))
    omega, _ = idler.modes
    indicator = idler.indicator((mu, mu), *pair)
    for growth in (idler.by_magnus(), idler.by_kicks()):
        assert_boundaries(growth, mu, float(omega[list(pair)].sum()), indicator)


@pytest.mark.parametrize(
    ("phase", "pair", "vanishes"),
    [
        (0.0, (0, 0), False),
        (0.0, (1, 1), False),
        (0.0, (0, 1), True),
        (0.5, (0, 0), True),
        (0.5, (1, 1), True),
        (0.5, (0, 1), False),
    ],
)
def test_the_phase_of_an_idler_between_equal_gears(
    phase: float, pair: tuple[int, int], vanishes: bool
) -> None:
    """w_1p w_1q = ± w_2p w_2q: meshes in phase make no combination, in opposition nothing else.

    Exactly, by symmetry: in phase the modes are mirror images and do not meet; in opposition the
    mirror image is half a period later, and half a period's map has no −1 at 2ω_p.
    """
    equal: dict[str, Any] = {
        "masses": (1.0, 1.7, 1.0),
        "stiffness": (1e8, 1e8),
        "contact_ratios": (1.4, 1.4),
    }
    idler = TwoMeshes(**equal, phases=(0.0, phase))
    omega, _ = idler.modes
    indicator = idler.indicator((1, 1), *pair)
    total = float(omega[list(pair)].sum())
    assert (indicator < 1e-9 * total) == vanishes
    for growth in (idler.by_magnus(), idler.by_kicks()):
        if vanishes:
            assert growth(total / (2.0 * np.pi)) < 1e-6
        else:
            assert_boundaries(growth, 1, total, indicator)


@pytest.mark.parametrize("pair", [(0, 0), (0, 1), (1, 1)], ids=["first", "both", "second"])
@pytest.mark.parametrize("phase", [0.0, 0.5])
def test_a_countershaft_whose_frequencies_meet(phase: float, pair: tuple[int, int]) -> None:
    """Eq. (7.24): the second harmonic of the slow mesh adds to the first of one twice as fast.

    It changes each width by 5 % at least.
    """
    shaft = TwoMeshes(phases=(0.0, phase), ratios=(1, 2))
    omega, _ = shaft.modes
    indicator = shaft.indicator((2, 1), *pair)
    alone = shaft.indicator((0, 1), *pair)
    assert abs(indicator / alone - 1.0) > 0.05
    assert_boundaries(shaft.by_kicks(), 2, float(omega[list(pair)].sum()), indicator)


def test_contact_ratios_that_end_instabilities() -> None:
    """sin(μπc) = 0 in both meshes; to second order what the first harmonic does twice is left."""
    idler = TwoMeshes(contact_ratios=(1.5, 1.5), phases=(0.0, 0.3))
    omega, _ = idler.modes
    for pair in ((0, 0), (0, 1), (1, 1)):
        assert idler.indicator((2, 2), *pair) < 1e-12 * omega[1]
        once = AMPLITUDE / 4.0 * idler.indicator((1, 1), *pair)
        centre = float(omega[list(pair)].sum()) / (4.0 * np.pi)
        for growth in (idler.by_magnus(), idler.by_kicks()):
            assert growth(centre) < 0.02 * once

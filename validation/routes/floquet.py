"""Parametric instability of meshes whose stiffness varies: Floquet theory on the linear model.

    M q̈ + C q̇ + [K + Σ_j k_j κ_j(t) v_j v_jᵀ] q = 0,    κ_j(t + T) = κ_j(t),    mean of κ_j 0

with the lumped equations' matrices and mesh vectors. Its monodromy matrix takes (q, q̇) over one
mesh period; a multiplier |μ| > 1, its eigenvalue, makes a motion grow by ln|μ|/T. The motions of
rigid bodies strain no mesh and are left out.

To first order in the variation (Lin & Parker 2002, J. Sound Vib. 249, 129–145; Nayfeh & Mook 1979,
Nonlinear Oscillations, ch. 5) the l-th harmonic makes modes p and q unstable where l ω_mesh is
within |E_pq|/(2√(ω_p ω_q)) of ω_p + ω_q, E = Σ_j k_j c_lj w_j w_jᵀ, w_j = Φᵀv_j. At ω_p − ω_q it
does not: E is symmetric.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fbs import SecondOrderSystem
from fbs.periodic.periodic_springs import SAME_PERIOD
from mbs_models.contact.mesh_excitation import MeshLaw
from mbs_models.model.parameters import Drivetrain

from ..arrays import ComplexArray, FloatArray
from ..errors import CommandError
from .equations import (
    Deflection,
    drivetrain_elements,
    drivetrain_system,
    rigid_body_motions,
)

# Of the stiffest motion. Magnus' fourth-order step is exact where nothing varies; this leaves 1e-7
# in the multipliers of a stage whose meshes vary by 60 %.
STEPS_PER_RADIAN = 16
REPEATED = 1e-6  # relative: frequencies of one group of modes, as in `mode_kinds`


@dataclass(frozen=True)
class ParametricSystem:
    """η̈ + Γ η̇ + [Ω² + Σ_j κ_j(t) w_j w_jᵀ] η = 0 in modes of unit modal mass.

    Attributes
    ----------
    omega
        (n,) natural frequencies at mean stiffness, Ω = diag(ω) (rad/s), none of them zero.
    damping
        (n, n) Γ (1/s).
    participation
        (n_mesh, n) rows √k_j Φᵀv_j (rad/s).
    laws
        (n_mesh) κ_j and phase of each.
    left_out
        Largest share of a mesh's flexibility that lies in modes left out: how much softer than here
        the drivetrain is to its variation.
    """

    omega: FloatArray
    damping: FloatArray
    participation: FloatArray
    laws: tuple[MeshLaw, ...]
    left_out: float = 0.0

    @property
    def frequency(self) -> FloatArray:
        """Natural frequencies at mean stiffness (Hz)."""
        frequency: FloatArray = self.omega / (2.0 * np.pi)
        return frequency


@dataclass(frozen=True)
class Tongue:
    """A region of instability to first order in the variation, without damping.

    Attributes
    ----------
    harmonic
        l, of the mesh frequency.
    modes
        The natural frequencies (Hz) whose sum it is about.
    centre, half_width
        Mesh frequencies (Hz): (f_p + f_q)/l, and how far it reaches to either side.
    growth_rate
        In its middle (1/s).
    """

    harmonic: int
    modes: tuple[float, float]
    centre: float
    half_width: float
    growth_rate: float


def parametric_system(
    drivetrain: Drivetrain, laws: Mapping[str, MeshLaw], *, highest_hz: float = np.inf
) -> ParametricSystem:
    """The drivetrain's varying meshes on its modes up to a frequency.

    Parameters
    ----------
    drivetrain
        Mass, damping and mean stiffness.
    laws
        Mesh → law (`operating_point`); its stiffness varies, backlash is left aside.
    highest_hz
        Modes above are left out.

    Raises
    ------
    CommandError
        A law has no mesh, meshes vary at different frequencies, or no mode is left.
    """
    from scipy.linalg import eigh

    system = drivetrain_system(drivetrain)
    meshes = mesh_vectors(drivetrain, system)
    for name in laws:
        if name not in meshes:
            raise CommandError(f"mesh law for '{name}': no such mesh; known: {', '.join(meshes)}")
    frequencies = _distinct([law.frequency for law in laws.values() if law.varies])
    if len(frequencies) > 1:
        listed = ", ".join(f"{frequency:g}" for frequency in frequencies)
        raise CommandError(
            f"meshes vary at {listed} Hz: without a common period there are no Floquet "
            "multipliers; give the laws of one stage at a time"
        )
    squares, shapes = eigh(system.stiffness, system.mass)
    rigid = rigid_body_motions(drivetrain)
    omega, shapes = np.sqrt(squares[rigid:]), shapes[:, rigid:]
    kept = omega <= 2.0 * np.pi * highest_hz
    if not np.any(kept):
        raise CommandError(
            f"no mode up to {highest_hz:g} Hz: the lowest is {omega[0] / (2.0 * np.pi):g} Hz"
        )
    rows = np.array([np.sqrt(meshes[name][0]) * meshes[name][1] @ shapes for name in laws])
    rows = rows.reshape(len(laws), len(omega))
    flexibility = np.sum((rows / omega)[:, ~kept] ** 2, axis=1)
    damping = shapes[:, kept].T @ system.damping @ shapes[:, kept]
    return ParametricSystem(
        omega[kept],
        damping,
        rows[:, kept],
        tuple(laws.values()),
        float(flexibility.max(initial=0.0)),
    )


def _distinct(frequencies: Sequence[float]) -> list[float]:
    """Ascending; an idler's two meshes, one frequency worked out in two ways, are one."""
    found: list[float] = []
    for frequency in sorted(frequencies):
        if not found or frequency > found[-1] * (1.0 + SAME_PERIOD):
            found.append(frequency)
    return found


def mesh_vectors(
    drivetrain: Drivetrain, system: SecondOrderSystem
) -> dict[str, tuple[float, FloatArray]]:
    """Mesh → stiffness k (N/m) and vector v (n_dof,) of its deflection vᵀq."""
    return {
        spring.mesh: (spring.stiffness, _vector(spring.deflection, system))
        for spring in drivetrain_elements(drivetrain).springs
        if spring.mesh
    }


def _vector(deflection: Deflection, system: SecondOrderSystem) -> FloatArray:
    vector = np.zeros(len(system.dofs))
    for label, coefficient in deflection.items():
        leader, factor = system.derived.get(label, (label, 1.0))
        vector[system.dofs.index(leader)] += coefficient * factor
    return vector


def multipliers(system: ParametricSystem, mesh_frequency: float) -> ComplexArray:
    """Floquet multipliers over one mesh period, the largest first (2n,).

    Parameters
    ----------
    system
        Its laws' phases and shapes count, not their frequencies.
    mesh_frequency
        Hz, of all varying meshes.
    """
    values = np.linalg.eigvals(monodromy(system, mesh_frequency)).astype(np.complex128)
    return values[np.argsort(-np.abs(values))]


def growth_rate(system: ParametricSystem, mesh_frequency: float) -> float:
    """max ln|μ|/T (1/s): positive where a motion grows."""
    return float(np.log(np.abs(multipliers(system, mesh_frequency)[0])) * mesh_frequency)


def monodromy(system: ParametricSystem, mesh_frequency: float) -> FloatArray:
    """What a mesh period makes of (Ωη, η̇), (2n, 2n): a product of Magnus' fourth-order steps.

    exp(h(A₁ + A₂)/2 − (√3/12) h² [A₁, A₂]) with A at the two Gauss points (Blanes et al. 2009,
    Phys. Rep. 470, 151–238). Steps end where a stiffness has a kink.
    """
    from scipy.linalg import expm

    period = 1.0 / mesh_frequency
    nodes = _nodes(system, period)
    steps, middles = np.diff(nodes), (nodes[:-1] + nodes[1:]) / 2.0
    offset = steps * np.sqrt(3.0) / 6.0
    first, second = (_generators(system, (middles + s * offset) / period) for s in (-1.0, 1.0))
    h = steps[:, None, None]
    commutator = first @ second - second @ first
    transitions = expm(h * (first + second) / 2.0 - np.sqrt(3.0) / 12.0 * h**2 * commutator)
    whole = np.eye(2 * len(system.omega))
    for transition in transitions:
        whole = transition @ whole
    return whole


def _nodes(system: ParametricSystem, period: float) -> FloatArray:
    """Instants (s) from 0 to T: every kink, and so many between that each step is short enough."""
    kinks = {(kink + law.phase) % 1.0 for law in system.laws for kink in law.stiffness.kinks}
    ends = np.array(sorted({0.0, 1.0} | kinks)) * period
    # κ is hardly above 1: no motion is stiffer than with all meshes at twice their mean.
    stiffest = np.hypot(system.omega.max(), np.linalg.norm(system.participation, 2))
    longest = 1.0 / (STEPS_PER_RADIAN * stiffest)
    pieces = [
        np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1)[:-1] for a, b in pairwise(ends)
    ]
    return np.concatenate([*pieces, [period]])


def _generators(system: ParametricSystem, turns: FloatArray) -> FloatArray:
    """A of (Ωη, η̇)' = A (Ωη, η̇) at times in mesh periods (n_time, 2n, 2n)."""
    omega, rows = system.omega, system.participation
    n = len(omega)
    relative = np.array(
        [[law.stiffness.value(t - law.phase) for law in system.laws] for t in turns]
    )
    varying = np.einsum("tj,jp,jq->tpq", relative, rows, rows)
    generators = np.zeros((len(turns), 2 * n, 2 * n))
    generators[:, :n, n:] = np.diag(omega)
    generators[:, n:, :n] = -np.diag(omega) - varying / omega
    generators[:, n:, n:] = -system.damping
    return generators


def tongues(
    system: ParametricSystem, harmonics: Sequence[int], *, narrowest_hz: float = 0.0
) -> tuple[Tongue, ...]:
    """Regions of instability to first order, the widest first; the equation is this module's.

    Repeated frequencies are one group of modes: |E_pq| is then the largest singular value of their
    block.

    Parameters
    ----------
    system
        The varying meshes.
    harmonics
        The l that are looked at.
    narrowest_hz
        Half widths of no more are left out.
    """
    groups = _groups(system.omega)
    found = []
    for harmonic in harmonics:
        fluctuation = _fluctuation(system, harmonic)
        for i, first in enumerate(groups):
            for second in groups[i:]:
                size = float(np.linalg.norm(fluctuation[np.ix_(first, second)], 2))
                w_p, w_q = float(system.omega[first[0]]), float(system.omega[second[0]])
                width = size / (2.0 * np.sqrt(w_p * w_q))
                half_width = width / (2.0 * np.pi * harmonic)
                if half_width > narrowest_hz:
                    modes = w_p / (2.0 * np.pi), w_q / (2.0 * np.pi)
                    found.append(
                        Tongue(harmonic, modes, sum(modes) / harmonic, half_width, width / 2.0)
                    )
    return tuple(sorted(found, key=lambda tongue: -tongue.half_width))


def _fluctuation(system: ParametricSystem, harmonic: int) -> ComplexArray:
    """E of the l-th harmonic: Σ κ_j w_j w_jᵀ holds Re E exp(jl ω_mesh t) (rad²/s²)."""
    phasors = np.array(
        [
            law.stiffness.harmonic(harmonic) * np.exp(-2j * np.pi * harmonic * law.phase)
            for law in system.laws
        ]
    )
    rows = system.participation
    fluctuation: ComplexArray = np.einsum("j,jp,jq->pq", phasors, rows, rows)
    return fluctuation


def _groups(omega: FloatArray) -> list[list[int]]:
    """Indices of modes by frequency, repeated ones together."""
    groups: list[list[int]] = []
    for index, value in enumerate(omega):
        if groups and value - omega[groups[-1][-1]] <= REPEATED * value:
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups

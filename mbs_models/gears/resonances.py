"""Resonances: where orders meet natural frequencies, and how far a speed is from them.

Harmonic l of a mesh frequency pushes mesh n of a row (all sun meshes, or all ring meshes, of a
planetary stage) like cos(2π l (f t − γ_n)). In mode φ the mesh is stretched by s_n = G_n φ, and

    F = Σ_n k s_n exp(−2πj l γ_n)

is what the row does to the mode: only the part of s that lies along cos 2π l γ_n and sin 2π l γ_n
counts. With P the projection on these two (one, where 2 l γ_n is whole for all n) the share of the
mode's strain energy that the harmonic can reach is

    Σ_rows ½ k |P s|² / U,    U the mode's strain energy.

With equally spaced planets γ_n = z_s ψ_n/2π, and P keeps the part of s that goes k = l z_s mod N
times (or −k times) round the stage. The rules of planet phasing (Parker 2000, J. Sound Vib. 236,
561–573) follow and need not be asserted: a rotational mode stretches all meshes of a row alike and
is reached by k = 0 alone, a translational one by k = ±1, a planet mode by the rest. So does what
they leave open, for modes that several stages share: a harmonic with k ≠ 0 puts no net torque on
sun, ring and carrier, hence reaches no motion that leaves the stage through its shafts; one with
k ≠ ±1 no net force, hence none that leaves it through a coupled translation. A shaft's unbalance
reaches the kinetic energy of the shaft's bodies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..modal.mode_kinds import Kind, Mode, Modes, mode_groups
from ..system.components import Components
from .orders import Order

FloatArray = NDArray[np.float64]

# Of a mode's energy: with less in reach of an order it is no resonance of it, unless it is so
# lightly damped that it moves all the same (`least_share`).
LEAST_SHARE = 0.01
# A margin of less is called close. API's standards ask 10 % of torsional natural frequencies; at
# 0.9 and 1.1 of resonance the amplification 1/|1 − (f/f_n)²| is 5.3 and 4.8 whatever the damping
# (Wang, Feese & Pettinato 2012, Proc. 41st Turbomachinery Symposium).
CLOSE = 0.10


@dataclass(frozen=True)
class Crossing:
    """Where an order meets a natural frequency.

    Attributes
    ----------
    speed_rpm, frequency_hz
        Speed of the input, and the natural frequency.
    mode
        Index of the mode.
    order, harmonic
        What meets it.
    energy
        Share of the mode's energy in what the order pushes: strain energy of the stage's meshes, or
        kinetic energy of the shaft's bodies. Of modes of one frequency: the largest share that any
        combination of them has.
    share
        The part of it that the harmonic can reach; the difference is suppressed by phasing.
    least
        The share from which on it is a resonance.
    """

    speed_rpm: float
    frequency_hz: float
    mode: int
    order: Order
    harmonic: int
    energy: float
    share: float
    least: float = LEAST_SHARE

    @property
    def telling(self) -> bool:
        """Whether it is a resonance."""
        return self.share >= self.least

    @property
    def suppressed(self) -> bool:
        """Whether it would be one if the planets' meshes pushed in any other phase."""
        return self.energy >= self.least > self.share


@dataclass(frozen=True)
class Margin:
    """The nearest resonance of a harmonic of an order at one speed.

    Attributes
    ----------
    order, harmonic
        What excites.
    order_hz
        Its frequency at the speed.
    mode, repeated
        Index of the mode (the first of those with that frequency), and how many have it.
    mode_hz, kind
        Its natural frequency, and what motion it is.
    share
        Of the mode's energy that the harmonic reaches.
    """

    order: Order
    harmonic: int
    order_hz: float
    mode: int
    repeated: int
    mode_hz: float
    kind: Kind
    share: float

    @property
    def change(self) -> float:
        """By how much of itself the speed, and with it the order, must rise to meet it."""
        return self.mode_hz / self.order_hz - 1.0

    @property
    def close(self) -> bool:
        """Whether a change of a tenth or less meets it."""
        return abs(self.change) <= CLOSE


@dataclass(frozen=True)
class Reach:
    """Shares (n_mode,) of every mode's energy: in what an order pushes, and within its reach."""

    energy: FloatArray
    share: FloatArray


@dataclass(frozen=True)
class ModeEnergies:
    """Mode shapes as energies have them.

    Attributes
    ----------
    groups
        Elastic modes, those of one frequency, kind and stage together: any combination of them is
        a mode.
    stretches, motions
        √(k/2U) G φ of every spring and √(M/2T) S φ of every body (m, n_mode), U and T the mode's
        whole strain and kinetic energy: their squares are shares. The modes of a group are combined
        so that this holds for all their combinations c, cᵀc = 1. Zero for rigid-body modes.
    """

    groups: tuple[tuple[int, ...], ...]
    stretches: Mapping[str, FloatArray]
    motions: Mapping[str, FloatArray]


def mode_energies(modes: Modes, parts: Components) -> ModeEnergies:
    """Energies of all springs and bodies in a drivetrain's modes."""
    shapes = modes.shapes[[modes.labels.index(dof) for dof in parts.dofs]]
    groups = tuple(_groups(modes))
    stretches = {s.name: _root(s.stiffness) @ s.deflection @ shapes for s in parts.springs}
    motions = {b: _root(mass) @ parts.motions[b] @ shapes for b, mass in parts.masses.items()}
    return ModeEnergies(groups, _normalised(stretches, groups), _normalised(motions, groups))


def _normalised(
    parts: Mapping[str, FloatArray], groups: Sequence[tuple[int, ...]]
) -> dict[str, FloatArray]:
    """Each group's modes combined so that the squares of all parts together sum to 1."""
    if not groups:
        return dict(parts)
    whole = np.concatenate(list(parts.values()))
    combined = np.zeros((whole.shape[1], whole.shape[1]))
    for group in groups:
        own = whole[:, list(group)]
        combined[np.ix_(group, group)] = np.linalg.inv(np.linalg.cholesky(own.T @ own)).T
    return {name: part @ combined for name, part in parts.items()}


def _groups(modes: Modes) -> Iterator[tuple[int, ...]]:
    n_rigid = sum(mode.kind == Kind.RIGID_BODY for mode in modes.modes)
    for repeated in mode_groups(modes.frequencies, n_rigid):
        alike: dict[tuple[Kind, str], list[int]] = {}
        for number in repeated:
            mode = modes.modes[number]
            home = max(mode.shares.kinetic, key=mode.shares.kinetic.__getitem__)
            alike.setdefault((mode.kind, home), []).append(number)
        yield from map(tuple, alike.values())


def _root(matrix: FloatArray) -> FloatArray:
    """R with RᵀR = matrix, of a symmetric semidefinite one."""
    values, turn = np.linalg.eigh(matrix)
    root: FloatArray = np.sqrt(np.maximum(values, 0.0))[:, None] * turn.T
    return root


def reach(order: Order, harmonic: int, energies: ModeEnergies) -> Reach:
    """What a harmonic of an order reaches of every mode; the equation is this module's.

    Of modes with one frequency any combination is a mode: each is given the largest share of all
    combinations. Rigid-body modes have none.
    """
    if order.rows:
        rows = [np.array([energies.stretches[name] for name in row]) for row in order.rows]
        basis = _pattern(order.phases, harmonic)
        pushed = np.concatenate([stretch for row in rows for stretch in row])
        reached = np.concatenate([s for row in rows for s in np.tensordot(basis.T, row, axes=1)])
    else:
        pushed = reached = np.concatenate([energies.motions[body] for body in order.bodies])
    groups = energies.groups
    return Reach(_largest_shares(pushed, groups), _largest_shares(reached, groups))


def _pattern(phases: Sequence[float], harmonic: int) -> FloatArray:
    """Orthonormal basis (n, 1 or 2) of cos 2π l γ_n and sin 2π l γ_n."""
    angle = 2.0 * np.pi * harmonic * np.asarray(phases)
    u, s, _ = np.linalg.svd(np.column_stack([np.cos(angle), np.sin(angle)]), full_matrices=False)
    # The sines of N planets are 0, or of the cosines' size: round-off is far from both.
    basis: FloatArray = u[:, s > 1e-3 * s[0]]
    return basis


def _largest_shares(part: FloatArray, groups: Sequence[tuple[int, ...]]) -> FloatArray:
    """Largest |part c|² of any combination c, cᵀc = 1, of each group's modes (columns)."""
    shares: FloatArray = np.sum(part**2, axis=0)
    for group in map(list, groups):
        if len(group) > 1:
            shares[group] = np.linalg.norm(part[:, group], 2) ** 2
    return shares


def least_share(mode: Mode) -> float:
    """The share s of a mode's energy from which on an order that reaches it makes it resonate.

    A hundredth, or less of a lightly damped mode: a mesh that closes by e then strains the rest of
    the drivetrain, where the other 1 − s of the energy is, like e √s/2ζ, which (2ζ)² makes e.
    """
    return min(LEAST_SHARE, (2.0 * mode.damping_ratio) ** 2) if mode.damping_ratio else LEAST_SHARE


def crossings(
    found: Sequence[Order],
    modes: Modes,
    parts: Components,
    speed_range: tuple[float, float],
) -> tuple[Crossing, ...]:
    """Where orders meet natural frequencies within a speed range (rpm), the largest share first."""
    energies = mode_energies(modes, parts)
    first, last = speed_range
    met = []
    for order in found:
        for harmonic in order.harmonics:
            reached = reach(order, harmonic, energies)
            for number, mode in enumerate(modes.modes):
                speed = 60.0 * mode.frequency_hz / (harmonic * order.factor)
                if mode.kind != Kind.RIGID_BODY and first <= speed <= last:
                    energy, share = float(reached.energy[number]), float(reached.share[number])
                    met.append(
                        Crossing(
                            speed,
                            mode.frequency_hz,
                            number,
                            order,
                            harmonic,
                            energy,
                            share,
                            least_share(mode),
                        )
                    )
    return tuple(sorted(met, key=lambda c: (-round(c.share, 6), -round(c.energy, 6), c.speed_rpm)))


def margins(
    found: Sequence[Order], modes: Modes, parts: Components, speed_rpm: float
) -> tuple[Margin, ...]:
    """The nearest resonance of every harmonic of every order, the closest first.

    A resonance is a mode of which the harmonic reaches a hundredth of the energy or more, or less
    where damping is light (`least_share`); what phasing suppresses is none. Harmonics without one
    are left out.

    Parameters
    ----------
    found
        The orders.
    modes, parts
        Of the same drivetrain.
    speed_rpm
        Of the input, whichever way it turns; not 0.
    """
    energies = mode_energies(modes, parts)
    nearest = []
    for order in found:
        for harmonic in order.harmonics:
            share = reach(order, harmonic, energies).share
            candidates = [
                _margin(order, harmonic, speed_rpm, modes, group, float(share[group[0]]))
                for group in energies.groups
                if share[group[0]] >= least_share(modes.modes[group[0]])
            ]
            nearest += sorted(candidates, key=lambda margin: abs(margin.change))[:1]
    return tuple(sorted(nearest, key=lambda margin: abs(margin.change)))


def _margin(
    order: Order,
    harmonic: int,
    speed_rpm: float,
    modes: Modes,
    group: tuple[int, ...],
    share: float,
) -> Margin:
    mode = modes.modes[group[0]]
    return Margin(
        order=order,
        harmonic=harmonic,
        order_hz=order.frequency(harmonic, speed_rpm),
        mode=group[0],
        repeated=len(group),
        mode_hz=mode.frequency_hz,
        kind=mode.kind,
        share=share,
    )

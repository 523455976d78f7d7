"""What kind of motion a mode is, from where its kinetic and strain energy sit.

A planetary stage with equally spaced planets is cyclically symmetric, so that its motions fall
into three families that do not mix (Lin & Parker 1999): rotational (central members turn, all
planets alike), translational (central members translate, planets follow cos φ_p and sin φ_p) and
planet modes (central members still). The share of a mode's kinetic energy in each family is
computed by projection, and the kind follows from the shares.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..model.parameters import Drivetrain
from ..model.placement import hub_ratios, translation_ends
from ..representation import MOST, counted, html_table
from ..stages.part import Kind as Kind
from ..stages.planet_set import PlanetSet

Shapes = NDArray[Any]  # real or complex

# A mode belongs to a stage that holds this much of both its energies. The rest is what a soft
# coupling lets through; a mode that shares more than a tenth is felt in two stages.
STAGE_SHARE = 0.9
# Families do not mix at all in a symmetric stage. The shapes are known to about 1e-6, so the
# energy shares to 1e-12; a millionth leaves room for a frequency close to another.
FAMILY_SHARE = 1.0 - 1e-6
# Frequencies closer than this (relative) count as repeated: shapes within such a group are any
# combination, and are turned so that each lies in one stage and family if it can.
REPEATED = 1e-6

FAMILIES = ("rotational", "translational", "planet")


@dataclass(frozen=True)
class EnergyShares:
    """Shares of a mode's energy.

    ``kinetic`` and ``strain`` are by stage and coupling and sum to one (strain of a rigid body:
    zero); ``families`` is the kinetic energy within planetary stages, by family, as a share of the
    whole.
    """

    kinetic: Mapping[str, float]
    strain: Mapping[str, float]
    families: Mapping[str, float]


@dataclass(frozen=True)
class Mode:
    """One mode.

    Attributes
    ----------
    frequency_hz
        |s|/2π of its pole s (undamped: the natural frequency); exactly 0 for a rigid-body mode.
    damping_ratio
        −Re s/|s|; above 1 for an overdamped mode (two real poles); 0 for a rigid-body mode.
    kind, shares
        What motion it is, and where its energy sits.
    round_off_hz
        How far round-off of the eigensolution may have moved the frequency.
    """

    frequency_hz: float
    damping_ratio: float
    kind: Kind
    shares: EnergyShares
    round_off_hz: float


@dataclass(frozen=True)
class Modes:
    """All modes of a drivetrain, ascending, with shapes (n_label, n_mode) over ``labels``."""

    modes: tuple[Mode, ...]
    labels: tuple[str, ...]
    shapes: Shapes

    def __repr__(self) -> str:
        highest = max((mode.frequency_hz for mode in self.modes), default=0.0)
        rigid = sum(mode.kind == Kind.RIGID_BODY for mode in self.modes)
        size = counted(len(self.modes), "mode")
        return f"<Modes: {size}, {rigid} rigid-body, up to {highest:.6g} Hz>"

    def _repr_html_(self) -> str:
        kinds = Counter(str(mode.kind) for mode in self.modes)
        title = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        rows = [
            (f"{k}", f"{mode.frequency_hz:.6g}", f"{100.0 * mode.damping_ratio:.3g}", mode.kind)
            for k, mode in enumerate(self.modes[:MOST], start=1)
        ]
        header = ("mode", "frequency, Hz", "damping ratio, %", "kind")
        return html_table(f"Modes: {title}", rows, header, max(0, len(self.modes) - MOST))

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Natural frequencies (Hz)."""
        return np.array([mode.frequency_hz for mode in self.modes])


@dataclass(frozen=True)
class StageStiffness:
    """Stiffness of a stage alone (without couplings), with the labels of its rows."""

    labels: tuple[str, ...]
    stiffness: NDArray[np.float64]


def match_poles(
    found: NDArray[np.complex128], expected: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Give every expected pole the nearest of those found, the largest first.

    Parameters
    ----------
    found
        (n,) rad/s, at least as many as expected.
    expected
        (n_mode, 2) rad/s, both poles of each mode.
    """
    poles = expected.copy()
    for mode in range(len(expected) - 1, -1, -1):
        for side in range(2):
            nearest = int(np.argmin(np.abs(found - expected[mode, side])))
            poles[mode, side] = found[nearest]
            found = np.delete(found, nearest)
    return poles


def undamped_estimate(
    eigenvalues: NDArray[np.float64], modal_damping: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Both poles −γ/2 ± √(γ²/4 − ω²) of each mode: exact if the damping is proportional."""
    root = np.sqrt(modal_damping**2 / 4.0 - eigenvalues.astype(complex))
    return np.stack([-modal_damping / 2.0 + root, -modal_damping / 2.0 - root], axis=1)


def frequency_and_ratio(
    poles: NDArray[np.complex128], n_rigid: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequency √(s₁s₂)/2π (Hz) and ζ = −(s₁ + s₂)/2ω of each pole pair; zero if rigid-body."""
    omega = np.sqrt(np.abs(np.prod(poles, axis=1)))
    omega[:n_rigid] = 0.0
    decay = np.abs(poles.sum(axis=1).real) / 2.0
    ratio = np.zeros_like(omega)
    np.divide(decay, omega, out=ratio, where=omega > 0.0)
    return omega / (2.0 * np.pi), ratio


def label_inertias(drivetrain: Drivetrain) -> dict[str, float]:
    """Inertia (kg) that moves with each label."""
    inertias: dict[str, float] = {}
    for part in (*drivetrain.inertias, *drivetrain.stages):
        for member in part.members():
            inertias |= member.label_inertias
    return inertias | {f"{c.name}.w": c.hub_mass for c in drivetrain.couplings}


def family_bases(planets: PlanetSet) -> dict[str, tuple[tuple[str, ...], NDArray[np.float64]]]:
    """Orthonormal bases of the rotational and translational families of a set of planets.

    Returns, by family, labels and a basis (n_labels, n_vectors); since all planets are alike, what
    is orthogonal to both is the planet family.
    """
    phi = np.array(planets.angles)
    patterns = {
        "rotational": [np.ones_like(phi)],
        "translational": [np.cos(phi), np.sin(phi)],
    }
    members = {"rotational": ("w",), "translational": ("u", "v")}
    axial = (planets.sun, planets.ring, planets.carrier)
    taken = np.zeros((len(phi), 0))
    bases: dict[str, tuple[tuple[str, ...], NDArray[np.float64]]] = {}
    for family, waves in patterns.items():
        independent = _orthonormal(np.column_stack(waves), taken)
        taken = np.column_stack([taken, independent])
        central = [f"{body}.{dof}" for body in axial for dof in members[family]]
        labels = (*central, *(f"{p}.{d}" for d in "uvw" for p in planets.planets))
        blocks = np.kron(np.eye(3), independent)
        basis = np.zeros((len(labels), len(central) + blocks.shape[1]))
        basis[: len(central), : len(central)] = np.eye(len(central))
        basis[len(central) :, len(central) :] = blocks
        bases[family] = (labels, basis)
    return bases


def _orthonormal(vectors: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis of the vectors' span, orthogonal to another orthonormal set."""
    rest = vectors - to @ (to.T @ vectors)
    u, s, _ = np.linalg.svd(rest, full_matrices=False)
    basis: NDArray[np.float64] = u[:, s > 1e-9 * np.sqrt(len(vectors))]
    return basis


def classify(
    drivetrain: Drivetrain,
    labels: Sequence[str],
    frequencies: NDArray[np.float64],
    shapes: Shapes,
    n_rigid: int,
    stage_stiffness: Mapping[str, StageStiffness],
) -> tuple[list[tuple[Kind, EnergyShares]], Shapes]:
    """Kind and energy shares of each mode.

    Parameters
    ----------
    drivetrain
        The drivetrain the modes belong to.
    labels
        Labels of the rows of ``shapes``, derived ones included.
    frequencies
        (n_mode,) ascending, to tell repeated modes.
    shapes
        (n_label, n_mode), real or complex.
    n_rigid
        How many of the first modes are rigid-body modes.
    stage_stiffness
        Stiffness of every stage alone, by name.

    Returns
    -------
    list, array
        Kind and shares of each mode, and the shapes, turned within repeated groups.
    """
    energies = _Energies(drivetrain, tuple(labels), stage_stiffness)
    shapes = shapes.copy()
    for group in mode_groups(frequencies, n_rigid):
        if len(group) > 1:
            shapes[:, group] = energies.separated(shapes[:, group])
    shares = [energies.shares(shape, rigid=i < n_rigid) for i, shape in enumerate(shapes.T)]
    kinds = [_kind(drivetrain, s, rigid=i < n_rigid) for i, s in enumerate(shares)]
    return list(zip(kinds, shares, strict=True)), shapes


def mode_groups(frequencies: NDArray[np.float64], n_rigid: int) -> list[list[int]]:
    """Elastic modes in groups of (nearly) equal frequency, ascending; alone where not repeated."""
    groups: list[list[int]] = []
    for mode in range(n_rigid, len(frequencies)):
        gap = frequencies[mode] - frequencies[groups[-1][-1]] if groups else np.inf
        if gap <= REPEATED * frequencies[mode]:
            groups[-1].append(mode)
        else:
            groups.append([mode])
    return groups


def scaled_singular_values(stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Singular values, descending, of K scaled to a unit diagonal, so that units do not matter."""
    diagonal = np.sqrt(np.diag(stiffness))
    scale = np.where(diagonal > 0.0, diagonal, 1.0)
    return np.linalg.svd(stiffness / np.outer(scale, scale), compute_uv=False)


def rigid_body_count(stiffness: NDArray[np.float64]) -> int:
    """Dimension of the null space of K: its scaled singular values that are round-off.

    Summing the springs leaves a few eps; a real mode as small as n·eps of the stiffest would be as
    unknown as its stiffness is.
    """
    values = scaled_singular_values(stiffness)
    return int(np.sum(values <= 10.0 * len(values) * np.finfo(float).eps))


def _kind(drivetrain: Drivetrain, shares: EnergyShares, *, rigid: bool) -> Kind:
    if rigid:
        return Kind.RIGID_BODY
    for stage in drivetrain.stages:
        if min(shares.kinetic[stage.name], shares.strain[stage.name]) < STAGE_SHARE:
            continue
        if not stage.planet_sets():
            return stage.mode_kind
        for family in FAMILIES:
            if shares.families[family] >= FAMILY_SHARE * sum(shares.families.values()):
                return Kind(family)
        return Kind.MIXED
    return Kind.GLOBAL


class _Energies:
    """The quadratic forms whose values are a mode's energies."""

    def __init__(
        self,
        drivetrain: Drivetrain,
        labels: tuple[str, ...],
        stage_stiffness: Mapping[str, StageStiffness],
    ) -> None:
        self.drivetrain = drivetrain
        self.ratios = hub_ratios(drivetrain)
        self.labels = labels
        inertias = label_inertias(drivetrain)
        self.root_mass = np.sqrt([inertias[label] for label in labels])
        self.stage_stiffness = stage_stiffness
        self.families = {
            stage.name: family_bases(planets)
            for stage in drivetrain.stages
            for planets in stage.planet_sets()
        }

    def _rows(self, labels: Sequence[str]) -> list[int]:
        return [self.labels.index(label) for label in labels]

    def _of_part(self, part: str) -> list[int]:
        return [i for i, label in enumerate(self.labels) if label.startswith(f"{part}.")]

    def kinetic_parts(self, shapes: Shapes) -> dict[tuple[str, str], Shapes]:
        """Mass-weighted components of shapes by (stage or coupling, family or '')."""
        weighted = self.root_mass[:, None] * shapes
        parts: dict[tuple[str, str], Shapes] = {}
        for item in self.drivetrain.items:
            rest = weighted[self._of_part(item.name)]
            for family, (labels, basis) in self.families.get(item.name, {}).items():
                inside = weighted[self._rows(labels)]
                parts[item.name, family] = basis.T @ inside
            if item.name in self.families:
                parts[item.name, "planet"] = self._planet_part(item.name, weighted)
            else:
                parts[item.name, ""] = rest
        return parts

    def _planet_part(self, stage: str, weighted: Shapes) -> Shapes:
        """What is left of the planets' motion beside the two families' patterns."""
        left = weighted.copy()
        for labels, basis in self.families[stage].values():
            rows = self._rows(labels)
            left[rows] -= basis @ (basis.T @ weighted[rows])
        return left[[i for i in self._of_part(stage) if ".planet" in self.labels[i]]]

    def separated(self, shapes: Shapes) -> Shapes:
        """Turn a group of repeated modes so that each lies in one stage and family if it can."""
        parts = self.kinetic_parts(shapes)
        total = sum(part.conj().T @ part for part in parts.values())
        weight = sum(
            (number + 1.0) * (part.conj().T @ part) for number, part in enumerate(parts.values())
        )
        scale = np.linalg.cholesky(np.asarray(total))
        whitened = np.linalg.solve(scale, np.linalg.solve(scale, np.asarray(weight)).conj().T)
        _, turn = np.linalg.eigh(whitened)
        mixed: Shapes = shapes @ np.linalg.solve(scale.conj().T, turn)
        return mixed

    def shares(self, shape: Shapes, *, rigid: bool) -> EnergyShares:
        """Energy shares of one mode."""
        parts = self.kinetic_parts(shape[:, None])
        energy = {key: float(np.sum(np.abs(part) ** 2)) for key, part in parts.items()}
        total = sum(energy.values())
        items = [item.name for item in self.drivetrain.items]
        kinetic = {
            item: sum(e for (name, _), e in energy.items() if name == item) / total
            for item in items
        }
        families = {
            family: sum(e for (_, f), e in energy.items() if f == family) / total
            for family in FAMILIES
        }
        return EnergyShares(kinetic, self._strain(shape, items, rigid=rigid), families)

    def _strain(self, shape: Shapes, items: Sequence[str], *, rigid: bool) -> dict[str, float]:
        if rigid:
            return dict.fromkeys(items, 0.0)
        strain: dict[str, float] = {}
        for part in self.drivetrain.parts:
            own = self.stage_stiffness[part.name]
            q = shape[self._rows(own.labels)]
            strain[part.name] = max(float(np.real(q.conj() @ own.stiffness @ q)), 0.0)
        value, ratios = dict(zip(self.labels, shape, strict=True)), self.ratios
        for coupling in self.drivetrain.couplings:
            hub = value[f"{coupling.name}.w"]
            strain[coupling.name] = sum(
                float(stiffness * abs(ratios[coupling.name, body] * value[f"{body}.w"] - hub) ** 2)
                for body, stiffness in coupling.ends
                if not isinstance(stiffness, str)
            )
            for dof, spring in coupling.dofs.items():
                first, second, sign = translation_ends(self.drivetrain, coupling, dof)
                if not isinstance(spring.stiffness, str):
                    stretch = value[first] - sign * value[second]
                    strain[coupling.name] += float(spring.stiffness * abs(stretch) ** 2)
        total = sum(strain.values())
        return {item: energy / total for item, energy in strain.items()}

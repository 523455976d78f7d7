"""Seeded random drivetrains as substructures, and their FRFs by another way than coupling.

Stages come from the equations (`validation.routes.equations`); what they are damped with, and how
they are joined, is drawn here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from fbs import (
    BoundedFrf,
    Joint,
    SecondOrderSystem,
    TruncatedPart,
    bounded_frf,
    real_modes,
)
from fbs._kernels.blocks import stretches
from mbs_models.model.parameters import Damping, ParallelStage, PlanetaryStage
from validation.routes.equations import Lumped, Spring, _parallel, _planetary, assemble

DAMPINGS = ("undamped", "hysteretic", "rayleigh", "both", "viscous")


@dataclass(frozen=True)
class Parts:
    """Substructures and joints, the kind of damping of each, and lines up to a band's end."""

    systems: Mapping[str, SecondOrderSystem]
    joints: tuple[Joint, ...]
    damping: str


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _gear(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "mass": _log(rng, 0.1, 30.0),
        "base_radius": _log(rng, 0.02, 0.3),
        "polar_inertia_over_r2": _log(rng, 0.1, 30.0),
        "diametral_inertia_over_r2": _log(rng, 0.1, 30.0),
        "bearing_rocking_over_r2": _log(rng, 1e6, 1e9),
        "bearing_y": _log(rng, 1e7, 1e9),
        "bearing_z": _log(rng, 1e7, 1e9),
    }


def _parallel_stage(rng: np.random.Generator, name: str) -> Lumped:
    stage = ParallelStage.model_validate(
        {
            "type": "parallel",
            "name": name,
            "helix_angle": rng.uniform(-30.0, 30.0),
            "pressure_angle": rng.uniform(14.5, 30.0),
            "mesh_stiffness": _log(rng, 1e7, 1e9),
            "pinion": _gear(rng),
            "wheel": _gear(rng),
        }
    )
    return _parallel(stage)


def _member(rng: np.random.Generator, free: bool) -> dict[str, Any]:
    return {
        "mass": _log(rng, 0.1, 30.0),
        "polar_inertia_over_r2": _log(rng, 0.1, 30.0),
        "bearing": _log(rng, 1e7, 1e9),
        "torsional_support": 0.0 if free else _log(rng, 1e7, 1e9),
    }


def _planetary_stage(rng: np.random.Generator, name: str, planets: int) -> Lumped:
    radius = _log(rng, 0.02, 0.2)
    room = np.sin(np.pi / planets - np.radians(6.0))
    largest = min(0.9 * room / (1.0 - room), 1.0)
    equal = rng.random() < 0.5
    turn = 0.0 if equal else rng.uniform(0.0, 360.0)
    play = np.zeros(planets) if equal else rng.uniform(-3.0, 3.0, planets)
    mesh = _log(rng, 1e7, 1e9)
    stage = PlanetaryStage.model_validate(
        {
            "type": "planetary",
            "name": name,
            "sun_pressure_angle": rng.uniform(14.5, 30.0),
            "ring_pressure_angle": rng.uniform(14.5, 30.0),
            "planet_angles": [turn + 360.0 * p / planets + play[p] for p in range(planets)],
            "sun_mesh_stiffness": [mesh * (1.0 if equal else rng.uniform(0.8, 1.2))] * planets,
            "ring_mesh_stiffness": _log(rng, 1e7, 1e9),
            "planet_bearing": _log(rng, 1e7, 1e9),
            "sun": _member(rng, True) | {"base_radius": radius},
            "ring": _member(rng, False),
            "carrier": _member(rng, True),
            "planet": {
                "mass": _log(rng, 0.1, 10.0),
                "base_radius": radius * rng.uniform(0.3 * largest, largest),
                "polar_inertia_over_r2": _log(rng, 0.1, 10.0),
            },
        }
    )
    return _planetary(stage)


def random_parts(
    rng: np.random.Generator, stages: int | None = None, damping: str | None = None
) -> Parts:
    """Draw 1 to 5 stages in a tree, 2 to 7 planets, hubs of 1e-8 to 10 kg or none."""
    count = int(rng.integers(1, 6)) if stages is None else stages
    kind = str(rng.choice(DAMPINGS)) if damping is None else damping
    names = [f"s{k}" for k in range(count)]
    planetary = rng.random(count) < 0.5
    lumped = {
        name: _planetary_stage(rng, name, int(rng.integers(2, 8)))
        if own
        else _parallel_stage(rng, name)
        for name, own in zip(names, planetary, strict=True)
    }
    ends = {
        name: [f"{name}.{b}.w" for b in (("sun", "carrier") if own else ("pinion", "wheel"))]
        for name, own in zip(names, planetary, strict=True)
    }
    sideways = {
        name: [f"{name}.{b}" for b in (("sun.u", "sun.v") if own else ("pinion.y", "pinion.z"))]
        for name, own in zip(names, planetary, strict=True)
    }
    joints = []
    for k in range(1, count):
        other = names[k - 1] if rng.random() < 0.8 else names[int(rng.integers(0, k))]
        one, two = ends[other][-1], ends[names[k]][0]
        ratio = float(rng.choice([1.0, -1.0, 0.5]))
        if rng.random() < 0.6:  # a hub, half on either side
            mass = _log(rng, 1e-8, 10.0)
            hubs = []
            for name, end in ((other, one), (names[k], two)):
                hub = f"{name}.hub{k}.w"
                spring = Spring(_log(rng, 1e5, 1e9), {end: 1.0, hub: -1.0})
                lumped[name] += Lumped(((hub, mass / 2),), (spring,))
                hubs.append(hub)
            joints.append(Joint((other, hubs[0]), (names[k], hubs[1]), ratio=ratio))
        else:
            stiffness = None if rng.random() < 0.3 else _log(rng, 1e5, 1e9)
            friction = 0.0 if stiffness is None or kind == "undamped" else 1e-6 * stiffness
            joints.append(Joint((other, one), (names[k], two), stiffness, friction, ratio))
        if rng.random() < 0.3:  # housings that push each other
            first, second = rng.choice(sideways[other]), rng.choice(sideways[names[k]])
            push = None if rng.random() < 0.3 else _log(rng, 1e5, 1e9)
            joints.append(Joint((other, str(first)), (names[k], str(second)), push))
    systems = {name: _damped(rng, part, kind) for name, part in lumped.items()}
    return Parts(systems, tuple(joints), kind)


def _damped(rng: np.random.Generator, part: Lumped, kind: str) -> SecondOrderSystem:
    loss = _log(rng, 1e-3, 5e-2) if kind in ("hysteretic", "both") else 0.0
    alpha, beta = 0.0, 0.0
    if kind in ("rayleigh", "both"):
        alpha, beta = _log(rng, 0.1, 100.0), _log(rng, 1e-7, 1e-5)
    if kind == "viscous":
        springs = tuple(
            replace(s, damping=s.stiffness * _log(rng, 1e-8, 5e-6)) for s in part.springs
        )
        part = Lumped(part.inertias, springs, part.ties)
    system = assemble(part, Damping(stiffness_proportional=beta, mass_proportional=alpha))
    return replace(system, loss_factor=loss)


@dataclass(frozen=True)
class Whole:
    """M, C and complex K of joined parts, motions L q of every (part, label)."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    motion: dict[tuple[str, str], np.ndarray]

    @classmethod
    def of(cls, parts: Parts) -> Whole:
        """Assemble primally: rigid joints tie coordinates, others are springs."""
        place = {
            (name, dof): k
            for k, (name, dof) in enumerate(
                (name, dof) for name, system in parts.systems.items() for dof in system.dofs
            )
        }
        n = len(place)
        mass, damping, stiffness = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n), complex)
        for name, system in parts.systems.items():
            at = np.ix_(*2 * [[place[name, dof] for dof in system.dofs]])
            mass[at], damping[at] = system.mass, system.damping
            stiffness[at] = system.stiffness * (1 + 1j * system.loss_factor)
        ties = np.eye(n)
        for joint in parts.joints:
            v = np.zeros(n)
            v[place[joint.first]] += 1.0
            v[place[joint.second]] -= joint.ratio
            if joint.stiffness is None:  # u_second = u_first / n, in whatever both follow
                follower = int(np.argmax(np.abs(ties[place[joint.second]])))
                row = v @ ties
                ties = ties - np.outer(ties[:, follower], row / row[follower])
                ties[np.abs(ties) < 1e-14] = 0.0
            else:
                spring, damper = joint.spring
                stiffness += spring * np.outer(v, v)
                damping += damper * np.outer(v, v)
        ties = ties[:, np.abs(ties).max(axis=0) > 0]
        m, c, k = (ties.T @ matrix @ ties for matrix in (mass, damping, stiffness))
        return cls(m, c, k, {node: ties[at] for node, at in place.items()})

    def natural_frequencies(self) -> np.ndarray:
        """Of the undamped whole, Hz."""
        square = eigh(self.stiffness.real, self.mass, eigvals_only=True)
        return np.asarray(np.sqrt(square.clip(min=0.0)) / (2 * np.pi))

    def frf(self, omega: np.ndarray, nodes: Sequence[tuple[str, str]]) -> np.ndarray:
        """Solve in double precision, with the residual r = f - Z x in 80 bits: H (nf, n, n).

        Z is symmetric, and so H_ij = f_i^T x_j + x_i^T r_j + r_i^T Z^-1 r_j: what is left out, the
        last, is wrong by the square of what a solution in double precision is wrong by.
        """
        motion = np.array([self.motion[node] for node in nodes])
        scale = (np.abs(np.diag(self.stiffness)) + omega[-1] ** 2 * np.diag(self.mass)) ** -0.5
        found = np.empty((omega.size, len(nodes), len(nodes)), np.clongdouble)
        for lines in stretches(omega.size, 16):  # they stay in the cache
            w = omega[lines, None, None]
            dynamic = (self.stiffness - w**2 * self.mass) + 1j * w * self.damping
            scaled = np.linalg.solve(dynamic * np.outer(scale, scale), (motion * scale).T)
            x = scale[:, None] * scaled
            rest = self._residual(omega[lines], motion, x).astype(complex)
            found[lines] = motion @ x.astype(np.clongdouble) + x.transpose(0, 2, 1) @ rest
        return found

    def _residual(self, omega: np.ndarray, motion: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return f - Z x, (nf, n, n_force); real sparse matrices take a fifth of the time."""
        wide = np.ascontiguousarray(x.transpose(1, 0, 2), np.clongdouble)
        w = omega.astype(np.longdouble)[:, None]
        total = np.broadcast_to(motion.T[:, None], wide.shape).astype(np.clongdouble)
        gains = (-1, -1j, w**2, -1j * w)
        for matrix, gain in zip(self._wide, gains, strict=True):
            if matrix.nnz:
                product = matrix @ wide.reshape(len(wide), -1).view(np.longdouble)
                total += gain * product.view(np.clongdouble).reshape(wide.shape)
        return total.transpose(1, 0, 2)

    @cached_property
    def _wide(self) -> list[Any]:
        """Re K, Im K, M and C."""
        full = (self.stiffness.real, self.stiffness.imag, self.mass, self.damping)
        return [csr_array(matrix.astype(np.longdouble)) for matrix in full]


@dataclass(frozen=True)
class Trial:
    """A truncated random drivetrain, and its exact FRFs (nf, n, n) between some of its DoFs."""

    parts: Parts
    truncated: Mapping[str, TruncatedPart]
    labels: tuple[str, ...]
    axis: np.ndarray
    exact: np.ndarray

    @classmethod
    def of(cls, rng: np.random.Generator, lines: int, dofs: int = 12, **drawn: Any) -> Trial:
        """Cut every part anywhere from the rigid-body modes up; a third of all lines at peaks."""
        parts = random_parts(rng, **drawn)
        band = _log(rng, 100.0, 8000.0)
        truncated = {name: _cut(rng, s, parts.damping, band) for name, s in parts.systems.items()}
        whole = Whole.of(parts)
        nodes = [(name, dof) for name, system in parts.systems.items() for dof in system.dofs]
        chosen = sorted(rng.choice(len(nodes), min(dofs, len(nodes)), replace=False))
        nodes = [nodes[k] for k in chosen]
        peaks = [whole.natural_frequencies()]
        peaks += [part.modes.kept.natural_frequencies for part in truncated.values()]
        peak = np.concatenate(peaks)
        peak = rng.choice(peak[peak > 1.0], lines // 3)
        beside = 1 + rng.choice([-1, 1], peak.size) * 10 ** rng.uniform(-7, -2, peak.size)
        axis = np.unique([*(peak * beside), *rng.uniform(0.5, band, lines - peak.size)])
        exact = whole.frf(2 * np.pi * axis, nodes)
        return cls(parts, truncated, tuple(dof for _, dof in nodes), axis, exact)

    def bounded(self) -> BoundedFrf:
        """Couple with the bound."""
        return bounded_frf(self.truncated, self.parts.joints, self.axis, self.labels, self.labels)


def _cut(
    rng: np.random.Generator, system: SecondOrderSystem, damping: str, band: float
) -> TruncatedPart:
    modes = real_modes(system)
    above = band * _log(rng, 0.7, 20.0)
    count = max(modes.n_rigid, int(np.sum(modes.natural_frequencies < above)))
    order = None if damping == "viscous" else [None, 0, 1, 2, 3][int(rng.integers(0, 5))]
    return TruncatedPart.of(system, slice(0, count), order, modes)

"""FRFs in ball arithmetic of 600 bits (FLINT), and random systems of any stiffness and mass.

Exact is what the matrices, taken as they are in double precision, have for FRFs: the balls that
come out have radii 150 digits below the last of a double.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from flint import acb, acb_mat, arb, ctx

from fbs import Joint, SecondOrderSystem
from tests.fbs.fbs_systems import spring_matrices, unit

BITS = 600


def ball(value: complex) -> acb:
    value = complex(value)
    return acb(arb(value.real), arb(value.imag))


def angular(frequency: float) -> arb:
    return 2 * arb.pi() * arb(float(frequency))


def dynamic_stiffness(system: SecondOrderSystem, w: arb) -> list[list[acb]]:
    loss = 1 + acb(0, 1) * arb(system.loss_factor)
    return [
        [
            acb(arb(float(k))) * loss - acb(w * w * arb(float(m))) + acb(0, 1) * w * arb(float(c))
            for m, c, k in zip(*rows, strict=True)
        ]
        for rows in zip(system.mass, system.damping, system.stiffness, strict=True)
    ]


@dataclass(frozen=True)
class Assembly:
    """Systems and joints, all coordinates in one list; no joints: side by side."""

    systems: Mapping[str, SecondOrderSystem]
    joints: Sequence[Joint] = ()
    blocked: Sequence[tuple[str, str]] = ()

    def coordinate(self, name: str, label: str) -> tuple[int, float]:
        start = 0
        for other, system in self.systems.items():
            if other == name:
                (i,), (factor,) = system.locate([label])
                return start + i, float(factor)
            start += len(system.dofs)
        raise KeyError(name)

    def receptances(
        self, frequency: float, rows: Iterable[tuple[str, str]], columns: Iterable[tuple[str, str]]
    ) -> list[list[acb]]:
        """Solve [[Z, B^T], [B, -1/Z_j]] [u; l] = [f; 0], locked coordinates among the joints."""
        ctx.prec = BITS
        w, ties = angular(frequency), len(self.joints) + len(self.blocked)
        n = sum(len(system.dofs) for system in self.systems.values())
        a = [[acb(0)] * (n + ties) for _ in range(n + ties)]
        start = 0
        for system in self.systems.values():
            for i, row in enumerate(dynamic_stiffness(system, w)):
                a[start + i][start : start + len(row)] = row
            start += len(system.dofs)
        ends = [((j.first, 1.0), (j.second, -j.ratio)) for j in self.joints]
        for k, tie in enumerate([*ends, *(((node, 1.0),) for node in self.blocked)], start=n):
            for node, sign in tie:
                i, factor = self.coordinate(*node)
                a[k][i] += acb(arb(sign) * arb(factor))
                a[i][k] += acb(arb(sign) * arb(factor))
        for k, joint in enumerate(self.joints, start=n):
            if not joint.rigid:
                stiffness, damping = map(arb, joint.spring)
                a[k][k] = -1 / (acb(stiffness) + acb(0, 1) * w * damping)
        driven = [self.coordinate(*node) for node in columns]
        right = [[acb(0)] * len(driven) for _ in range(n + ties)]
        for j, (i, factor) in enumerate(driven):
            right[i][j] = acb(arb(factor))
        u = acb_mat(a).solve(acb_mat(right), algorithm="precond")
        found = [self.coordinate(*node) for node in rows]
        return [[arb(factor) * u[i, j] for j in range(len(driven))] for i, factor in found]


def distance(value: complex, exact: acb) -> float:
    """|value - exact|, at least; an exact zero whose ball does not know is as near as can be."""
    return float((ball(value) - exact).abs_lower())


def random_part(rng: np.random.Generator, name: str, most: int = 5) -> SecondOrderSystem:
    """A chain of springs 1e-3 ... 1e15 N/m and masses 1e-9 ... 1e3 kg, free or on the ground.

    Half of them are of one size within a decade or two, as real parts are.
    """
    n = int(rng.integers(1, most + 1))
    spread = rng.choice([1.0, 6.0, 18.0])
    stiffness = 10.0 ** np.clip(rng.uniform(-3, 15) + spread * rng.uniform(-0.5, 0.5, n), -3, 15)
    mass = 10.0 ** np.clip(rng.uniform(-9, 3) + spread * rng.uniform(-0.5, 0.5, n), -9, 3)
    ratio = rng.choice([0.0, 1e-7, 1e-5, 1e-3])
    springs = [
        (
            unit(n, (i, 1.0), (i + 1, -1.0)),
            stiffness[i],
            stiffness[i] * ratio * rng.choice([1, 1, 3]),
        )
        for i in range(n - 1)
    ]
    if rng.random() < 0.5:
        springs.append((unit(n, (n - 1, 1.0)), stiffness[-1], stiffness[-1] * ratio))
    k, c = spring_matrices(n, springs)
    return SecondOrderSystem(
        np.diag(mass),
        c,
        k,
        tuple(f"{name}{i}" for i in range(n)),
        {f"{name}.hub": (f"{name}0", float(rng.choice([1.0, 0.7])))},
        float(rng.choice([0.0, 0.0, 0.01])),
    )


def random_joints(
    rng: np.random.Generator, systems: Mapping[str, SecondOrderSystem]
) -> list[Joint]:
    """A tree of rigid and flexible joints."""
    names = list(systems)
    joints = []
    for k in range(1, len(names)):
        other = names[int(rng.integers(k))]
        first = (other, str(rng.choice(systems[other].labels)))
        second = (names[k], str(rng.choice(systems[names[k]].labels)))
        rigid = rng.random() < 0.5
        stiffness = None if rigid else 10.0 ** rng.uniform(-3, 15)
        ratio = float(rng.choice([1.0, -1.0, 0.3]))
        joints.append(Joint(first, second, stiffness, ratio=ratio))
    return joints


def random_lines(rng: np.random.Generator, count: int, poles: np.ndarray) -> np.ndarray:
    """Lines from mHz to 1e5 Hz, some of them 1e-13 ... 1e-3 beside poles (Hz)."""
    lines = 10.0 ** rng.uniform(-3, 5, count)
    poles = poles[(poles > 1e-3) & (poles < 1e9)]
    if poles.size:
        beside = rng.choice(poles, count // 3 + 1) * (
            1 + 10.0 ** rng.uniform(-13, -3, count // 3 + 1)
        )
        lines[: beside.size] = beside
    return np.unique(lines)

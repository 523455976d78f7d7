"""What the lines of a steady state are called: harmonics of meshes, and their combinations."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from fbs.periodic.periodic_springs import Lattice

from .turning import MeshFamily, Turning

MOST_TERMS = 4  # |l₁| + |l₂| of a combination that is given a name


def line_names(turning: Turning) -> tuple[str, ...]:
    """A name for every line: ``mean``, ``2·mesh planetary``, ``mesh a − mesh b``, or its order.

    A line that is several things at once has all their names.
    """
    steps = stage_steps(turning.families, turning.lines)
    orders = turning.lines.orders
    most = turning.plan.harmonics
    return tuple(
        "mean" if not point.any() else _name(point, steps, most) or f"order {order:.4g}"
        for point, order in zip(turning.lines.points, orders, strict=True)
    )


def stage_steps(families: tuple[MeshFamily, ...], lattice: Lattice) -> dict[str, NDArray[np.int64]]:
    """Stage → the step of its first harmonic in the lattice, of the stages that excite."""
    return {
        family.stage: lattice.steps[family.columns[0]]
        for family in families
        if np.any(lattice.steps[family.columns[0]])
    }


def _name(point: NDArray[np.int64], steps: dict[str, NDArray[np.int64]], most: int) -> str:
    own = [
        _term(times, stage)
        for stage, step in steps.items()
        for times in range(1, most + 1)
        if np.array_equal(times * step, point)
    ]
    if own:
        return " = ".join(own)
    names = []
    for first, second in combinations(steps, 2):
        for a, b in product(range(-most, most + 1), repeat=2):
            if a and b and np.array_equal(a * steps[first] + b * steps[second], point):
                terms = sorted([(a, first), (b, second)], key=lambda term: term[0] < 0)
                sign = "+" if terms[1][0] > 0 else "−"
                words = f"{_term(terms[0][0], terms[0][1])} {sign} "
                names.append((abs(a) + abs(b), words + _term(abs(terms[1][0]), terms[1][1])))
    size, name = min(names, default=(MOST_TERMS + 1, ""))
    return name if size <= MOST_TERMS else ""


def _term(times: int, stage: str) -> str:
    return f"mesh {stage}" if times == 1 else f"{times}·mesh {stage}"

"""The shaft stiffness study of Figs. 8, 9 and 12, for u, v and w of the planetary stage."""

from __future__ import annotations

import numpy as np

from .curves import FrfBench, RouteName, curve, difference, scale
from .figures import WIDE, Drawing, routes_error
from .printed_values import SHAFT_STIFFNESSES
from .results import StiffnessRow


def stiffness_rows(bench: FrfBench) -> tuple[StiffnessRow, ...]:
    """Drive points of the members and a planet for every k_sw: by two routes, and their change."""
    b = bench.case.planetary.name
    labels = [
        f"{b}.{body}.{d}" for body in (*bench.case.planetary.bodies, "planet1") for d in "uvw"
    ]
    return tuple(_row(bench, label, shaft) for label in labels for shaft in SHAFT_STIFFNESSES)


def _row(bench: FrfBench, label: str, shaft: float) -> StiffnessRow:
    pair = (label, label)
    scaled, decibel = routes_error(bench, Drawing(pair, WIDE, shaft))
    softest = min(SHAFT_STIFFNESSES)
    lines = bench.axis(WIDE, softest).frequency
    first, other = (bench.frf(RouteName.EXUDYN, WIDE, k) for k in (softest, shaft))
    same_lines = np.array_equal(lines, bench.axis(WIDE, shaft).frequency)
    assert same_lines or shaft != softest
    change = difference(
        lines, curve("", "", first, *pair), curve("", "", other, *pair), scale(first, *pair)
    )
    return StiffnessRow(shaft, bench.case.dof(label), decibel, scaled, change.worst_db)

"""Gross causes in matrices and in lists of natural frequencies, each undone in turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from math import pi

import numpy as np

from ..arrays import FloatArray
from .candidates import Case
from .few_numbers import FrequencyEvidence, MatrixEvidence
from .file_hypotheses import Hypothesis

FREQUENCIES = (
    (1.0 / (2.0 * pi), "frequencies are in rad/s, not in Hz"),
    (2.0 * pi, "frequencies were divided by 2π once too often"),
    (1.0 / 60.0, "frequencies are in 1/min, not in Hz"),
    (1e3, "frequencies are in kHz, not in Hz"),
)
# Of K, M and C: what their values have to be multiplied by
UNITS = (
    ({"stiffness": 1e3, "damping": 1e3, "mass": 1e3}, "N/mm, N s/mm and t for N/m, N s/m and kg"),
    ({"stiffness": 1e3, "damping": 1e3}, "stiffness and damping are in N/mm and N s/mm"),
    ({"stiffness": 1e3}, "stiffness is in N/mm, not N/m"),
    ({"stiffness": 1e-3}, "stiffness is 1000 times too large"),
    ({"mass": 1e3}, "mass is in t, not kg"),
    ({"mass": 1e-3}, "mass is in g, not kg"),
    ({"mass": 9.80665}, "mass was divided by 9.81: it is a weight taken for a mass"),
    ({"mass": 1.0 / 9.80665}, "mass is a weight in N, not a mass in kg"),
    ({"mass": 0.45359237}, "mass is in lb, not kg"),
    ({"stiffness": 175.126835}, "stiffness is in lbf/in, not N/m"),
)  # fmt: skip


def matrix_hypotheses(case: Case) -> Iterator[Hypothesis]:
    """Every gross cause in a list of frequencies, or in matrices."""
    if isinstance(case.evidence, FrequencyEvidence):
        yield from _frequencies()
    elif isinstance(case.evidence, MatrixEvidence):
        yield from _matrices(case, case.evidence)


def _frequencies() -> Iterator[Hypothesis]:
    for factor, words in FREQUENCIES:

        def undone(case: Case, factor: float = factor) -> Case:
            assert isinstance(case.evidence, FrequencyEvidence)
            own = case.evidence
            return case.held_against(replace(own, frequencies_hz=own.frequencies_hz * factor))

        yield Hypothesis("unit", words, undone)


def _matrices(case: Case, evidence: MatrixEvidence) -> Iterator[Hypothesis]:
    for factors, words in UNITS:
        yield _multiplied("unit", words, factors)
    dofs = evidence.dofs
    radii = case.drivetrain.dof_radii()
    r = np.array([radii.get(dof) or 1.0 for dof in dofs])
    yield _transformed("radius", "rotations are angles in rad, not r·θ (r = 1 was used)", 1.0 / r)
    yield _transformed("radius", "rotations are r²·θ: the radius was applied twice", r)
    for k, dof in enumerate(dofs):
        sign = np.where(np.arange(len(dofs)) == k, -1.0, 1.0)
        yield _transformed("sign", f"{dof} counts the other way", sign)
    for i, j in combinations(range(len(dofs)), 2):
        order = list(range(len(dofs)))
        order[i], order[j] = j, i
        yield _permuted(f"the DoFs {dofs[i]} and {dofs[j]} are swapped", order)


def _multiplied(kind: str, words: str, factors: Mapping[str, float]) -> Hypothesis:
    def undone(case: Case) -> Case:
        assert isinstance(case.evidence, MatrixEvidence)
        own = case.evidence
        new = {name: factors.get(name, 1.0) * matrix for name, matrix in own.matrices.items()}
        return case.held_against(replace(own, matrices=new))

    return Hypothesis(kind, words, undone)


def _transformed(kind: str, words: str, scale: FloatArray) -> Hypothesis:
    def undone(case: Case) -> Case:
        assert isinstance(case.evidence, MatrixEvidence)
        own, weight = case.evidence, np.outer(scale, scale)
        new = {name: matrix * weight for name, matrix in own.matrices.items()}
        return case.held_against(replace(own, matrices=new))

    return Hypothesis(kind, words, undone)


def _permuted(words: str, order: Sequence[int]) -> Hypothesis:
    def undone(case: Case) -> Case:
        assert isinstance(case.evidence, MatrixEvidence)
        own, at = case.evidence, np.ix_(list(order), list(order))
        new = {name: matrix[at] for name, matrix in own.matrices.items()}
        return case.held_against(replace(own, matrices=new))

    return Hypothesis("labels", words, undone)

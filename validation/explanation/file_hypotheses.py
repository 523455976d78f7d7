"""Gross causes in a file of FRFs: units, quantity, signs, labels, axis; each undone in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import pi

import numpy as np

from ..arrays import FloatArray
from .candidates import Case
from .evidence import FrfEvidence


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A gross cause in words, and the case without it."""

    kind: str
    words: str
    undone: Callable[[Case], Case]


# Factors by which a file's values may be off: (file's/true, words)
FACTORS = (
    (1e3, "mm for m, or N for kN (values 1000 times too large)"),
    (1e-3, "m for mm, or kN for N (values 1000 times too small)"),
    (1e6, "µm for m (values 1e6 times too large)"),
    (1e-6, "m for µm (values 1e6 times too small)"),
    (1.0 / 9.80665, "g for m/s² (values 9.81 times too small)"),
    (9.80665, "kgf for N, or m/s² for g (values 9.81 times too large)"),
    (1.0 / 25.4e-3, "inches for m (values 39.4 times too large)"),
    (25.4e-3, "m for inches (values 39.4 times too small)"),
    (4.4482216, "lbf for N (values 4.45 times too large)"),
    (1.0 / 4.4482216, "N for lbf (values 4.45 times too small)"),
    (2.0 * pi, "a factor 2π too much, Hz for rad/s"),
    (0.5 / pi, "a factor 2π too little, rad/s for Hz"),
    ((2.0 * pi) ** 2, "a factor (2π)² too much"),
    ((0.5 / pi) ** 2, "a factor (2π)² too little"),
    (180.0 / pi, "degrees for radians (values 57.3 times too large)"),
    (pi / 180.0, "radians for degrees (values 57.3 times too small)"),
    (2.0, "two-sided for one-sided spectra, or peak to peak for peak (twice)"),
    (0.5, "one-sided for two-sided spectra, or peak for peak to peak (half)"),
    (2.0**0.5, "RMS for peak on one side (values √2 times too large)"),
    (0.5**0.5, "peak for RMS on one side (values √2 times too small)"),
    (-1.0, "all signs reversed"),
)
# (jω)ⁿ too much in the file's values
DERIVATIVES = (
    (1, "mobility given as receptance, or accelerance as mobility"),
    (2, "accelerance given as receptance"),
    (-1, "receptance given as mobility, or mobility as accelerance"),
    (-2, "receptance given as accelerance"),
)
AXES = (
    (1.0 / (2.0 * pi), "the frequency axis is in rad/s, not in Hz"),
    (2.0 * pi, "the frequency axis was divided by 2π once too often"),
    (1.0 / 60.0, "the frequency axis is in 1/min, not in Hz"),
    (60.0, "the frequency axis was divided by 60 once too often"),
    (1e3, "the frequency axis is in kHz, not in Hz"),
)


def on_file(kind: str, words: str, change: Callable[[FrfEvidence], FrfEvidence]) -> Hypothesis:
    """A hypothesis about the file alone."""

    def undone(case: Case) -> Case:
        assert isinstance(case.evidence, FrfEvidence)
        return case.held_against(change(case.evidence))

    return Hypothesis(kind, words, undone)


def file_hypotheses(case: Case) -> Iterator[Hypothesis]:
    """Every gross cause in a file of FRFs."""
    evidence = case.evidence
    assert isinstance(evidence, FrfEvidence)
    yield from _units()
    yield on_file(
        "convention", "the file is for e^{−jωt}: its FRFs are the conjugates",
        lambda e: e.with_values(e.frf.values.conj()),
    )  # fmt: skip
    yield from (
        on_file("axis", words, lambda e, x=factor: e.with_lines(e.lines * x))  # type: ignore[misc]
        for factor, words in AXES
    )
    yield from _signs(evidence)
    yield from _angles(case, evidence)
    yield from _labels(case, evidence)


def _units() -> Iterator[Hypothesis]:
    for factor, words in FACTORS:
        yield _scaled("unit", words, 1.0 / factor, 0)
    for power, words in DERIVATIVES:
        yield _scaled("quantity", words, 1.0, -power)
        for factor, unit in FACTORS:
            yield _scaled("quantity", f"{words}; {unit}", 1.0 / factor, -power)


def _scaled(kind: str, words: str, factor: float, power: int) -> Hypothesis:
    def change(evidence: FrfEvidence) -> FrfEvidence:
        weight = factor * (2j * pi * evidence.lines) ** power
        return evidence.with_values(evidence.frf.values * weight[:, None, None])

    return on_file(kind, words, change)


def _weighted(kind: str, words: str, rows: FloatArray, columns: FloatArray) -> Hypothesis:
    weight = np.outer(rows, columns)
    return on_file(kind, words, lambda e: e.with_values(e.frf.values * weight))


def _signs(evidence: FrfEvidence) -> Iterator[Hypothesis]:
    r, c = evidence.frf.responses, evidence.frf.excitations
    one = (np.ones(len(r)), np.ones(len(c)))
    for label in dict.fromkeys((*r, *c)):
        rows, columns = (np.array([-1.0 if x == label else 1.0 for x in side]) for side in (r, c))
        if label in r and label in c and len(r) > 1:
            yield _weighted("sign", f"{label} counts the other way", rows, columns)
        if label in r and len(r) > 1:
            yield _weighted("sign", f"the response {label} has the wrong sign", rows, one[1])
        if label in c and len(c) > 1:
            yield _weighted("sign", f"the excitation {label} has the wrong sign", one[0], columns)
    axial = [x for x in dict.fromkeys((*r, *c)) if x.endswith(".w")]
    if len(axial) > 1:
        rows, columns = (np.array([-1.0 if x in axial else 1.0 for x in s]) for s in (r, c))
        yield _weighted("sign", "all rotations count the other way", rows, columns)


def _angles(case: Case, evidence: FrfEvidence) -> Iterator[Hypothesis]:
    radii = case.drivetrain.dof_radii()
    r, c = evidence.frf.responses, evidence.frf.excitations
    rows, columns = (np.array([radii.get(x) or 1.0 for x in side]) for side in (r, c))
    one_r, one_c = np.ones(len(r)), np.ones(len(c))
    rotating_r, rotating_c = (np.array([radii.get(x) is not None for x in side]) for side in (r, c))
    if rotating_r.any() or rotating_c.any():
        yield _weighted(
            "radius", "rotations are angles in rad per N m, not r·θ (r = 1 was used)", rows, columns
        )
        yield _weighted(
            "radius", "rotations are r²·θ: the radius was applied twice", 1.0 / rows, 1.0 / columns
        )
    if rotating_r.any():
        degrees = np.where(rotating_r, pi / 180.0, 1.0)
        yield _weighted("radius", "responses of rotations are in rad, not r·θ", rows, one_c)
        yield _weighted(
            "radius", "responses of rotations are in degrees, not r·θ", rows * degrees, one_c
        )
        yield _weighted(
            "radius", "rotations are in degrees per N m, not r·θ", rows * degrees, columns
        )
    if rotating_c.any():
        yield _weighted(
            "radius", "excitations of rotations are per N m, not torque/r", one_r, columns
        )


def _labels(case: Case, evidence: FrfEvidence) -> Iterator[Hypothesis]:
    r, c = evidence.frf.responses, evidence.frf.excitations
    known = tuple(dict.fromkeys((*r, *c)))
    for first, second in combinations(known, 2):
        names = {first: second, second: first}
        yield _renamed(f"the labels {first} and {second} are swapped", names, names)
        if first in r and second in r:
            yield _renamed(f"the responses {first} and {second} are swapped", names, {})
        if first in c and second in c:
            yield _renamed(f"the excitations {first} and {second} are swapped", {}, names)
    for label in known:
        for other in case.system.labels:
            if other not in known:
                names = {label: other}
                yield _renamed(f"what is called {label} is {other}", names, names)
    yield from _planets(case)


def _planets(case: Case) -> Iterator[Hypothesis]:
    """Planets counted from another one, or the other way round."""
    for stage in case.drivetrain.stages:
        planets = [m.body for m in stage.members() if m.role == "planet"]
        n = len(planets)
        for shift in range(1, n):
            names = _planet_names(case, planets, [(k + shift) % n for k in range(n)])
            words = f"planets of {stage.name} are counted from number {shift + 1}"
            yield _renamed(words, names, names)
        for shift in range(n if n > 2 else 0):
            names = _planet_names(case, planets, [(shift - k) % n for k in range(n)])
            start = "" if not shift else f", from number {shift + 1}"
            words = f"planets of {stage.name} are counted the other way round{start}"
            yield _renamed(words, names, names)


def _planet_names(case: Case, planets: Sequence[str], order: Sequence[int]) -> dict[str, str]:
    return {
        label: planets[order[k]] + label.removeprefix(body)
        for k, body in enumerate(planets)
        for label in case.system.labels
        if label.startswith(f"{body}.")
    }


def _renamed(words: str, rows: dict[str, str], columns: dict[str, str]) -> Hypothesis:
    return on_file(
        "labels",
        words,
        lambda e: e.relabelled(
            [rows.get(x, x) for x in e.frf.responses],
            [columns.get(x, x) for x in e.frf.excitations],
        ),
    )

"""What the evidence can tell: which parameters it shows, which look alike, which FRF would tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf

from ..arrays import FloatArray
from .candidates import Case, Parameter, steps_of
from .evidence import NEGLIGIBLE, FrfEvidence, Remainder
from .fit import FAILURES, Explanation

INVISIBLE = 1e-7  # of the largest sensitivity: what derivatives by differences leave as round-off
COLLINEAR = 1e-5  # sine of the angle between two sensitivities; their own error is 1e-4 of 1 − cos²
RANK = 1e-6  # of the largest singular value of the columns scaled to one
SEEN = 3.0  # standard deviations
TELLING = 1e-3  # rms of a residual: 0.02 dB


@dataclass(frozen=True)
class Visible:
    """A parameter, and the smallest relative change of it that the evidence shows."""

    parameter: Parameter
    smallest_change: float


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What the evidence tells of the candidates.

    Attributes
    ----------
    visible
        Candidates that it shows.
    invisible
        Those that do not move it.
    alike
        Groups of visible ones whose changes it cannot tell from each other, small ones at least.
    rank
        How many changes of the candidates it tells at once: the rank of their sensitivities.
    """

    visible: tuple[Visible, ...]
    invisible: tuple[Parameter, ...]
    alike: tuple[tuple[Parameter, ...], ...]
    rank: int


def identifiability(
    case: Case, candidates: Sequence[Parameter], remainder: Remainder
) -> Identifiability:
    """By the sensitivities ∂(residual)/∂ ln p at the case.

    Parameters
    ----------
    case
        Where.
    candidates
        Parameters that may be wrong.
    remainder
        Its noise is what a change must stand out of.
    """
    kept, systems, steps = steps_of(case, candidates)
    slopes = case.evidence.sensitivities(case.system, systems, steps)
    sizes = np.linalg.norm(slopes, axis=0)
    seen = np.flatnonzero(sizes > INVISIBLE * sizes.max(initial=0.0))
    noise = max(remainder.noise, NEGLIGIBLE) / np.sqrt(2.0)
    visible = tuple(Visible(kept[k], float(SEEN * noise / sizes[k])) for k in seen)
    directions = slopes[:, seen] / sizes[seen]
    return Identifiability(
        visible,
        tuple(p for k, p in enumerate(kept) if k not in set(seen.tolist())),
        _groups([kept[k] for k in seen], directions),
        rank_of(directions),
    )


def rank_of(directions: FloatArray) -> int:
    """How many of the columns, scaled to length one, are independent."""
    if not directions.size:
        return 0
    singular = np.linalg.svd(directions, compute_uv=False)
    return int(np.sum(singular > RANK * singular[0]))


def _groups(
    visible: Sequence[Parameter], directions: FloatArray
) -> tuple[tuple[Parameter, ...], ...]:
    """Columns along each other: sin² = 1 − cos² below `COLLINEAR`²."""
    left, groups = list(range(len(visible))), []
    while left:
        first = left.pop(0)
        rest = directions[:, left] - np.outer(
            directions[:, first], directions[:, first] @ directions[:, left]
        )
        same = [k for k, sine in zip(left, np.linalg.norm(rest, axis=0), strict=True)
                if sine < COLLINEAR]  # fmt: skip
        if same:
            groups.append(tuple(visible[k] for k in (first, *same)))
        left = [k for k in left if k not in same]
    return tuple(groups)


@dataclass(frozen=True)
class SeparatingFrf:
    """The FRF that differs most between two explanations: where, and how much (a residual)."""

    response: str
    excitation: str
    frequency_hz: float
    size: float


def separating_frf(first: Explanation, second: Explanation) -> SeparatingFrf | None:
    """Of all DoFs over the evidence's band; None: no FRF tells them apart by 0.02 dB."""
    lines = first.case.evidence.lines
    lines = lines[np.unique(np.linspace(0, len(lines) - 1, 200).round().astype(int))]
    labels = first.case.system.labels
    empty = Frf(lines, np.zeros((len(lines), len(labels), len(labels))), labels, labels)
    try:
        ours = FrfEvidence(empty).ours(first.case.system)
        other = FrfEvidence(Frf(lines, ours, labels, labels))
        residual = other.residual(second.case.system).reshape(2, *ours.shape)
    except FAILURES:
        return None
    size = np.sqrt(np.mean(np.sum(residual**2, axis=0), axis=0))
    i, j = np.unravel_index(int(np.argmax(size)), size.shape)
    if size[i, j] < TELLING:
        return None
    at = int(np.argmax(np.sum(residual[:, :, i, j] ** 2, axis=0)))
    return SeparatingFrf(labels[i], labels[j], float(lines[at]), float(size[i, j]))

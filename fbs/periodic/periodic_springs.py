"""Springs whose stiffness and unloaded length vary with the turning of a shaft.

A spring m between DoFs, δ_m = δ_static,m + v_mᵀ q, has the force

    F_m = k_m [1 + κ_m(φ)] (δ_m − e_m(φ)) + c_m (δ̇_m − ė_m),    κ_m = Re Σ_l κ_ml e^{jlφ},

e_m likewise, φ = 2π r_m n t with n the shaft's turns per second and r_m the spring's ratio: what
varies r_m times a turn. Springs of one ratio go through their period together; different ratios are
independent phases unless their quotient is one of small integers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import gcd, lcm
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._kernels.checks import ComplexArray, FloatArray, frozen, numbers, read_only, scalar
from .._kernels.door import door
from ..errors import FbsError, NonFiniteError

IntArray = NDArray[np.int64]

SAME_PERIOD = 1e-9
"""Relative: ratios of speeds are products of tooth numbers, known to some ten eps."""

HARMONICS = 10
COMBINATIONS = 3
LARGEST_QUOTIENT = 10
"""Periods as 11 to 12 meet where one of them has only its eleventh harmonic."""


@dataclass(frozen=True, eq=False)
class PeriodicSpring:
    """A spring of a system whose matrices hold its constant part k v vᵀ and c v vᵀ.

    Parameters
    ----------
    name : str
    vector : array, shape (n_dof,)
        v: the deflection δ per unit of each DoF, positive as the force is.
    stiffness : float, N/m
        k, the mean.
    ratio : float
        r > 0: periods per turn of the shaft, f = r n.
    variation : complex array, shape (n,)
        κ_l, l = 1 … n; its phase is part of it.
    error : complex array, shape (n,), m
        e_l, l = 1 … n.
    damping : float, N s/m
        c.
    static_force : float, N
        k δ_static, under the mean load.

    Raises
    ------
    FbsError, NonFiniteError
        An array is no vector, a number is not finite, or k or r is not positive.
    """

    name: str
    vector: FloatArray
    stiffness: float
    ratio: float
    variation: ComplexArray
    error: ComplexArray
    damping: float = 0.0
    static_force: float = 0.0

    if TYPE_CHECKING:  # what `__post_init__` converts, said to type checkers

        def __init__(
            self,
            name: str,
            vector: ArrayLike,
            stiffness: float,
            ratio: float,
            variation: ArrayLike,
            error: ArrayLike,
            damping: float = 0.0,
            static_force: float = 0.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        for key, kind in (("vector", float), ("variation", complex), ("error", complex)):
            object.__setattr__(self, key, self._vector(key, kind))
        for key in ("stiffness", "ratio", "damping", "static_force"):
            value = scalar(getattr(self, key), f"spring {self.name!r}: {key}")
            if key in ("stiffness", "ratio") and value <= 0.0:
                raise FbsError(f"spring {self.name!r}: {key} = {value:g}: must be positive")
            object.__setattr__(self, key, value)

    def _vector(self, key: str, kind: type) -> NDArray[np.inexact]:
        array = frozen(numbers(getattr(self, key), f"spring {self.name!r}: {key}", kind))
        if array.ndim != 1:
            raise FbsError(f"spring {self.name!r}: {key} has shape {array.shape}: must be a vector")
        if not np.isfinite(array).all():
            raise NonFiniteError(f"spring {self.name!r}: {key} is not finite")
        return array

    @property
    def varies(self) -> bool:
        """Whether it is more than a constant spring."""
        return bool(self.variation.any() or self.error.any())


@dataclass(frozen=True, eq=False)
class Lattice:
    """The lines h·f of a motion in several phases; half of them, h and −h being conjugate.

    Of each pair the one with h·f > 0 stands here, the mean first. Each period has its harmonics up
    to H, and of combinations of several periods there are those with Π (1 + |h_g|) ≤ 2 (P + 1): of
    two periods the first harmonic of one with P of the other (a hyperbolic cross: Fourier
    coefficients of a product fall as a product).

    A lattice of several phases stays right where their frequencies happen to have a ratio of whole
    numbers: it is a motion on the torus of the phases, whichever way time runs through them.

    Parameters
    ----------
    points : int array, shape (n_line, n_phase)
        h.
    fundamentals : array, shape (n_phase,)
        Periods of each phase per turn of the shaft.
    steps : int array, shape (n_spring, n_phase)
        h of each spring's own first harmonic: (0, 3) where it passes three periods of its phase;
        zeros where it does not vary.
    """

    points: IntArray
    fundamentals: FloatArray
    steps: IntArray

    @property
    def orders(self) -> FloatArray:
        """Periods of each line per turn of the shaft (n_line,), the mean's 0."""
        orders: FloatArray = self.points @ self.fundamentals
        return orders

    @property
    def n_phases(self) -> int:
        """S: of how many independent phases."""
        return len(self.fundamentals)

    @cached_property
    def _place(self) -> dict[tuple[int, ...], int]:
        return {tuple(point): line for line, point in enumerate(self.points.tolist())}

    def harmonic(self, spring: int, order: int) -> int:
        """Which line is the l-th harmonic of a spring.

        Raises
        ------
        FbsError
            None is.
        """
        line = self._place.get(tuple((order * self.steps[spring]).tolist()))
        if line is None or (line == 0) != (order == 0):
            raise FbsError(f"no line is harmonic {order} of spring {spring}")
        return line


@door
def lattice(
    springs: Sequence[PeriodicSpring],
    harmonics: int = HARMONICS,
    combinations: int = COMBINATIONS,
) -> Lattice:
    """Choose the lines that a motion is made of.

    Parameters
    ----------
    springs
        Their ratios decide which share a period.
    harmonics
        H ≥ 1, of each spring's own period.
    combinations
        P ≥ 0; 0 leaves all combinations out.

    Raises
    ------
    FbsError
        A count is too small, or no spring varies.
    """
    if harmonics < 1:
        raise FbsError(f"harmonics = {harmonics}: must be at least 1")
    if combinations < 0:
        raise FbsError(f"combinations = {combinations}: must not be negative")
    groups = common_periods(springs)
    if not groups:
        raise FbsError("no spring varies: the steady state is the static state")
    steps = np.zeros((len(springs), len(groups)), dtype=np.int64)
    fundamentals = np.zeros(len(groups))
    for phase, group in enumerate(groups):
        fundamentals[phase], own = _shared_period([springs[m].ratio for m in group])
        steps[list(group), phase] = own
    periods = np.unique(steps[np.any(steps, axis=1)], axis=0)
    found = {(0,) * len(groups)}
    for counts in _cross(len(periods), harmonics, combinations):
        found.add(_forward(tuple((np.array(counts) @ periods).tolist()), fundamentals))
    points = np.array(sorted(found), dtype=np.int64)
    by_order = np.argsort(np.where(np.any(points, axis=1), points @ fundamentals, -1.0))
    return Lattice(read_only(points[by_order]), read_only(fundamentals), read_only(steps))


@door
def common_periods(springs: Sequence[PeriodicSpring]) -> tuple[tuple[int, ...], ...]:
    """Which springs share a period: their ratios are as p to q, at most `LARGEST_QUOTIENT`.

    Returns
    -------
    tuple of tuples
        Positions in ``springs``, each in one group; springs that do not vary are in none.
    """
    groups: list[list[int]] = []
    for number, spring in enumerate(springs):
        if not spring.varies:
            continue
        near = [
            group
            for group in groups
            if any(_quotient(spring.ratio, springs[m].ratio) for m in group)
        ]
        groups = [group for group in groups if group not in near]
        groups.append(sorted([number, *(m for group in near for m in group)]))
    return tuple(tuple(group) for group in sorted(groups))


def _quotient(first: float, second: float) -> Fraction | None:
    """p/q = first/second within `SAME_PERIOD`, if there is one of small integers."""
    largest = LARGEST_QUOTIENT
    if not 1.0 / (largest + 1) < first / second < largest + 1:
        return None
    near = Fraction(first / second).limit_denominator(largest)
    same = abs(first / second - near) <= SAME_PERIOD * near
    return near if same and near.numerator <= largest else None


def _shared_period(ratios: Sequence[float]) -> tuple[float, IntArray]:
    """The largest ratio that all are multiples of, and the multiples."""
    known = {0: Fraction(1)}
    while len(known) < len(ratios):  # `common_periods` has joined them by small quotients
        for number, ratio in enumerate(ratios):
            near = ((own, _quotient(ratio, ratios[other])) for other, own in known.items())
            steps = [own * step for own, step in near if step]
            if number not in known and steps:
                known[number] = steps[0]
    denominator = lcm(*(q.denominator for q in known.values()))
    multiples = [int(known[number] * denominator) for number in range(len(ratios))]
    common = gcd(*multiples)
    periods = np.array([m // common for m in multiples], dtype=np.int64)
    return ratios[0] / float(periods[0]), periods


def _cross(n: int, harmonics: int, combinations: int) -> Iterator[tuple[int, ...]]:
    """Counts of n periods: each one's own harmonics, and combinations of several; not all zero."""
    for axis in range(n):
        for order in range(1, harmonics + 1):
            yield tuple(order if g == axis else 0 for g in range(n))
    for counts in _combinations(n, 2 * (combinations + 1)):
        if n - counts.count(0) > 1:
            yield counts


def _combinations(n: int, most: int) -> Iterator[tuple[int, ...]]:
    """Counts with Π (1 + |h_g|) of at most ``most``."""
    if n == 0:
        yield ()
        return
    for size in range(most):
        for rest in _combinations(n - 1, most // (1 + size)):
            yield (size, *rest)
            if size:
                yield (-size, *rest)


def _forward(point: tuple[int, ...], fundamentals: FloatArray) -> tuple[int, ...]:
    """h or −h: that of positive frequency, or where both have none the later one."""
    order = float(np.array(point) @ fundamentals)
    size = float(np.abs(point) @ fundamentals)
    if abs(order) <= SAME_PERIOD * size:
        return max(point, tuple(-h for h in point))
    return point if order > 0.0 else tuple(-h for h in point)


def series_at(coefficients: ComplexArray, order: IntArray) -> ComplexArray:
    """Two-sided coefficients of Re Σ_l c_l e^{jlφ}: c_l/2, and its conjugate at −l; 0 beyond."""
    padded = np.concatenate([[0.0], coefficients / 2.0, [0.0]])
    size = np.minimum(np.abs(order), len(padded) - 1)
    value = padded[size]
    return np.where(order < 0, value.conj(), value)


def shaft_frequencies(values: ArrayLike) -> FloatArray:
    """Speeds as a vector (n_speed,) of turns per second, each finite and positive.

    Raises
    ------
    FbsError
    """
    speeds = frozen(numbers(values, "the shaft frequencies"))
    if speeds.ndim != 1 or speeds.size == 0:
        raise FbsError(f"shaft frequencies must be a vector, got shape {speeds.shape}")
    wrong = speeds[~(np.isfinite(speeds) & (speeds > 0.0))]
    if wrong.size:
        raise FbsError(f"shaft frequency {wrong[0]}: must be finite and positive (1/s)")
    return speeds

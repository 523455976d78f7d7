"""The fewest modes of each part with which the coupled FRFs are guaranteed to meet a tolerance."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.checks import FloatArray, ascending_frequency, read_only
from .bounded_assembly import Part, TruncatedPart
from .coupled_bound import BoundedFrf, bounded_frf, decibels
from .damped_modes import rayleigh_coefficients
from .errors import FbsError, SingularLineError
from .frf import Frf
from .joints import AnyJoint, rows_of
from .second_order_system import SecondOrderSystem
from .truncation_bound import moving
from .undamped_modes import RealModes, real_modes

Pair = tuple[str, str]
"""Response and excitation."""

SLACK = 2.0
"""How many times the bound of the complete parts may be where that is beyond the tolerance."""


@dataclass(frozen=True)
class Tolerance:
    """What an FRF's error may be: in dB, or scaled, |dH_ij| / sqrt(h_i h_j).

    Parameters
    ----------
    value : float
    scaled : bool
        h_i is the norm of row i of the FRFs between the DoFs asked for.

    Raises
    ------
    FbsError
        Not positive, or a scaled error of 1 and more.
    """

    value: float
    scaled: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.value < (1 if self.scaled else np.inf):
            kind = "scaled error" if self.scaled else "tolerance in dB"
            raise FbsError(f"a {kind} must be above 0{' and below 1' * self.scaled}: {self.value}")

    def used(self, found: BoundedFrf, pairs: Sequence[Pair]) -> FloatArray:
        """Return how much of the tolerance each FRF's bound takes, shape (n_pair, nf).

        A dB tolerance T is met where b / |H~| <= 1 - 10^(-T/20); h_i is |H~| less the bounds' at
        least.
        """
        bounds = np.array([found.between(*pair) for pair in pairs])
        if not self.scaled:
            size = np.abs([found.frf.between(*pair) for pair in pairs])
            allowed = (1 - 10 ** (-self.value / 20)) * size
        else:
            least = {label: _row_norm(found, label) for pair in pairs for label in pair}
            allowed = self.value * np.sqrt([least[i] * least[j] for i, j in pairs])
        share = np.divide(bounds, allowed, out=np.full_like(bounds, np.inf), where=allowed > 0)
        share[bounds == 0] = 0.0
        return np.asarray(share)

    def error(self, share: float) -> float:
        """Return the error that is such a share of the tolerance; infinite dB if none is left."""
        if self.scaled:
            return self.value * share
        return float(decibels(np.array((1 - 10 ** (-self.value / 20)) * share), np.array(1.0)))


def _row_norm(found: BoundedFrf, label: str) -> FloatArray:
    """Return what the norm of a row of H is at least, shape (nf,)."""
    row = [np.abs(found.frf.between(label, other)) for other in found.frf.excitations]
    bound = [found.between(label, other) for other in found.frf.excitations]
    least = np.sqrt(np.sum(np.square(row), axis=0)) - np.sqrt(np.sum(np.square(bound), axis=0))
    return np.asarray(least.clip(min=0.0))


@dataclass(frozen=True, eq=False)
class SmallestBasis:
    """What `smallest_basis` returns.

    Parameters
    ----------
    parts : mapping of str to TruncatedPart
        With the modes to keep and the residuals of the others.
    kept : mapping of str to tuple of int
        Positions among the part's modes.
    ladders : mapping of str to tuple of int
        Modes that were to choose from, in the order in which they are kept.
    orders : mapping of str to int or None
        Highest residual.
    bounded : BoundedFrf
        The FRFs asked for, and their bounds.
    error : float
        Largest error that the bounds allow where the tolerance can be met, in its unit; infinite
        where it can nowhere.
    unreachable : array of bool, shape (n_pair, nf)
        Where it cannot, round-off of the complete parts being more: their bound times `SLACK` is
        kept to there.
    """

    parts: Mapping[str, Part]
    kept: Mapping[str, tuple[int, ...]]
    ladders: Mapping[str, tuple[int, ...]]
    orders: Mapping[str, int | None]
    bounded: BoundedFrf
    error: float
    unreachable: NDArray[np.bool_]


def smallest_basis(
    parts: Mapping[str, SecondOrderSystem | Frf],
    joints: Sequence[AnyJoint],
    frfs: Iterable[Pair],
    frequency: ArrayLike,
    tolerance: Tolerance | float,
    largest_order: int = 2,
) -> SmallestBasis:
    """Find the fewest modes, then the lowest residual orders, whose bound meets a tolerance.

    Modes are kept from the lowest up; of a part with C = alpha M + beta K those that move neither
    a joint nor a DoF asked for are left out at no cost. Each part's number is found by bisection
    with the others complete; then, errors adding up, one mode more is given where it helps most
    until all bounds hold together, what is not needed any more is taken back, and orders are
    lowered as far as they may. Only bounds are looked at, never the exact FRF; what is returned
    holds at every line whether or not bounds fall with every mode.

    Parameters
    ----------
    parts : mapping of str to SecondOrderSystem or Frf
        FRFs stay as they are.
    joints : sequence of Joint
    frfs : iterable of (response, excitation)
    frequency : array, shape (nf,), Hz
    tolerance : Tolerance, or float in dB
    largest_order : int
        Of residuals; -1: none. General viscous damping takes none.

    Raises
    ------
    FbsError
        Nothing is asked for.
    As `bounded_frf`.
    """
    axis, pairs = ascending_frequency(frequency), list(dict.fromkeys(frfs))
    if not pairs:
        raise FbsError("no FRFs are asked for")
    search = _Search.of(
        parts, joints, pairs, axis,
        tolerance if isinstance(tolerance, Tolerance) else Tolerance(tolerance), largest_order,
    )  # fmt: skip
    return search.run()


@dataclass(frozen=True)
class _Ladder:
    """A part's modes in the order in which they are kept, and the residual order it may have.

    `least` is how many are kept at least: the rigid-body modes.
    """

    system: SecondOrderSystem
    modes: RealModes
    steps: tuple[int, ...]
    least: int
    highest: int

    @classmethod
    def of(cls, system: SecondOrderSystem, ports: Iterable[str], largest_order: int) -> _Ladder:
        modes = real_modes(system)
        steps = np.arange(modes.angular_frequency.size)
        rayleigh = rayleigh_coefficients(system) is not None
        if rayleigh:
            audible = moving(modes.shapes, system.locate(ports)[0])
            steps = steps[audible | (steps < modes.n_rigid)]
        highest = largest_order if rayleigh else -1
        return cls(system, modes, tuple(steps.tolist()), modes.n_rigid, highest)

    def part(self, count: int, order: int) -> TruncatedPart:
        """Keep so many modes, and residuals up to an order (-1: none)."""
        keep = list(self.steps[:count])
        return TruncatedPart.of(self.system, keep, None if order < 0 else order, self.modes)


Basis = dict[str, tuple[int, int]]
"""Part -> (number of modes, residual order)."""


@dataclass(eq=False)
class _Search:
    """Bases tried, at the lines that were hardest first."""

    given: dict[str, Frf]
    ladders: dict[str, _Ladder]
    joints: tuple[AnyJoint, ...]
    pairs: list[Pair]
    axis: FloatArray
    tolerance: Tolerance
    unreachable: NDArray[np.bool_] = field(init=False)
    room: FloatArray = field(init=False)
    hard: list[int] = field(default_factory=list)
    parts: dict[tuple[str, int, int], TruncatedPart] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        parts: Mapping[str, SecondOrderSystem | Frf],
        joints: Sequence[AnyJoint],
        pairs: list[Pair],
        axis: FloatArray,
        tolerance: Tolerance,
        largest_order: int,
    ) -> _Search:
        asked = dict.fromkeys(label for pair in pairs for label in pair)
        ladders = {}
        for name, part in parts.items():
            if isinstance(part, Frf):
                continue
            ends = (end for joint in rows_of(joints) for end in (joint.first, joint.second))
            joined = [label for owner, label in ends if owner == name]
            ports = dict.fromkeys([*joined, *(label for label in asked if label in part.labels)])
            ladders[name] = _Ladder.of(part, ports, largest_order)
        given = {name: part for name, part in parts.items() if isinstance(part, Frf)}
        return cls(given, ladders, tuple(joints), pairs, axis, tolerance)

    def run(self) -> SmallestBasis:
        whole = {name: (len(own.steps), own.highest) for name, own in self.ladders.items()}
        complete = self.tolerance.used(self._bounded(whole), self.pairs)
        self.unreachable = complete > 1
        self.room = np.where(self.unreachable, SLACK * complete, 1.0)
        basis = {name: (self._alone(whole, name), whole[name][1]) for name in whole}
        basis = self._raised(basis, whole)
        for name in basis:
            basis = self._lowered(basis, name, 0, self.ladders[name].least)
        for name in basis:
            basis = self._lowered(basis, name, 1, -1)
        found = self._bounded(basis)
        share = self.tolerance.used(found, self.pairs)[~self.unreachable]
        return SmallestBasis(
            {**self.given, **{name: self._part(name, *chosen) for name, chosen in basis.items()}},
            {name: self.ladders[name].steps[:count] for name, (count, _) in basis.items()},
            {name: own.steps for name, own in self.ladders.items()},
            {name: None if order < 0 else order for name, (_, order) in basis.items()},
            found,
            self.tolerance.error(float(share.max())) if share.size else np.inf,
            read_only(self.unreachable),
        )

    def _alone(self, whole: Basis, name: str) -> int:
        """Bisect for the number of modes of one part, the others complete."""
        count, order = whole[name]
        low, high = self.ladders[name].least, count
        while low < high:
            middle = (low + high) // 2
            if self._meets({**whole, name: (middle, order)}):
                high = middle
            else:
                low = middle + 1
        return high

    def _raised(self, basis: Basis, whole: Basis) -> Basis:
        """Give one mode more where it helps most, until all bounds hold."""
        while not self._meets(basis):
            room = [name for name, (count, _) in basis.items() if count < whole[name][0]]
            if not room:
                return basis
            tried = [{**basis, name: (basis[name][0] + 1, basis[name][1])} for name in room]
            basis = min(tried, key=lambda one: self._worst(one, self.hard))
        return basis

    def _lowered(self, basis: Basis, name: str, which: int, least: int) -> Basis:
        """Take modes (0) or residual orders (1) of a part back as long as bounds hold."""
        while basis[name][which] > least:
            count, order = basis[name]
            tried = {**basis, name: (count - 1, order) if which == 0 else (count, order - 1)}
            if not self._meets(tried):
                break
            basis = tried
        return basis

    def _meets(self, basis: Basis) -> bool:
        """Whether a basis meets what is allowed, at the hardest lines known and then at all."""
        if self.hard and self._worst(basis, self.hard) > 1:
            return False
        share = self._shares(basis, None)
        worst = int(np.argmax(share))
        if share[worst] <= 1:
            return True
        self.hard = sorted({*self.hard, worst})
        return False

    def _worst(self, basis: Basis, lines: list[int]) -> float:
        return float(self._shares(basis, lines).max())

    def _shares(self, basis: Basis, lines: list[int] | None) -> FloatArray:
        """Return the largest share of what is allowed that any FRF takes, per line."""
        try:
            share = self.tolerance.used(self._bounded(basis, lines), self.pairs)
        except SingularLineError:  # this basis has a pole on a line
            return np.full(self.axis.size if lines is None else len(lines), np.inf)
        room = self.room if lines is None else self.room[:, lines]
        lost = np.isinf(room)  # not even complete parts have a bound
        return np.asarray(np.where(lost, 0.0, share / np.where(lost, 1.0, room)).max(axis=0))

    def _bounded(self, basis: Basis, lines: list[int] | None = None) -> BoundedFrf:
        chosen = slice(None) if lines is None else lines
        axis = self.axis[chosen]
        given = {
            name: replace(frf, frequency=axis, values=frf.values[chosen])
            for name, frf in self.given.items()
        }
        parts = {name: self._part(name, *chosen) for name, chosen in basis.items()}
        rows = dict.fromkeys(response for response, _ in self.pairs)
        columns = dict.fromkeys(excitation for _, excitation in self.pairs)
        if self.tolerance.scaled:
            rows = columns = {**rows, **columns}
        return bounded_frf({**given, **parts}, self.joints, axis, rows, columns)

    def _part(self, name: str, count: int, order: int) -> TruncatedPart:
        key = name, count, order
        if key not in self.parts:
            self.parts[key] = self.ladders[name].part(count, order)
        return self.parts[key]

"""What is to be explained: a foreign result, and how far a system is from it.

A residual is e = (theirs − ours)/(|theirs| + |ours| + floor): half the relative error where both
are near each other, and never more than one, so that no resonance or antiresonance decides alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np

from fbs import FbsError, Frf, SecondOrderSystem, synthesize

from ..arrays import ComplexArray, FloatArray

FLOOR = 1e-2  # of √(row's · column's norm) at a line: what lies 40 dB below counts as zero
NOTHING = 1e-9  # of a line's largest FRF: what is zero by symmetry is round-off, 1e-16 of it or so
NEGLIGIBLE = 1e-6  # of a residual: 2e-5 dB, the digits that files of FRFs are written with
AUTOCORRELATION = 5.0  # standard deviations: one FRF of 3 million that are noise looks so
ALIKE = 1e-8
# Steps from line to line from which noise is told at all: what is half noise, half a difference
# keeps √(2n)/2 standard deviations
FEWEST_STEPS = int(2.0 * AUTOCORRELATION**2)
UNRELATED = 0.25  # mean square of a residual; unrelated numbers have (a² + b²)/(a + b)² ≥ ½
QUIET = 1e-7  # of a residual: less is no noise of a measurement
RANK = 1e-10
SEARCH_LINES = 150  # of those there are, to rank candidates by


@dataclass(frozen=True)
class Remainder:
    """What a residual says of itself.

    Attributes
    ----------
    rms
        Its size.
    noise
        Share of it that is as from line to line independent noise, a standard deviation.
    structured
        Whether more than noise is left.
    effective
        How many independent real numbers it counts for.
    """

    rms: float
    noise: float
    structured: bool
    effective: float


@dataclass(frozen=True, eq=False)
class Slope:
    """∂M/∂p, ∂C/∂p, ∂K/∂p of a parameter in which they are affine; (n, n) each."""

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray

    @property
    def is_zero(self) -> bool:
        """Whether the parameter changes nothing."""
        return not (self.mass.any() or self.damping.any() or self.stiffness.any())

    def added(self, system: SecondOrderSystem, amount: float) -> SecondOrderSystem:
        """A system with some of it."""
        return replace(
            system,
            mass=system.mass + amount * self.mass,
            damping=system.damping + amount * self.damping,
            stiffness=system.stiffness + amount * self.stiffness,
        )

    def basis(self) -> FloatArray:
        """(n, rank) orthonormal columns that span what it acts on."""
        pieces = [m / np.abs(m).max() for m in (self.mass, self.damping, self.stiffness) if m.any()]
        left, sizes, _ = np.linalg.svd(np.hstack(pieces), full_matrices=False)
        return np.asarray(left[:, sizes > RANK * sizes[0]])


class Evidence(Protocol):
    """A foreign result."""

    @property
    def lines(self) -> FloatArray:
        """Frequencies it spans (Hz)."""

    @property
    def count(self) -> str:
        """How much it is, in words."""

    @property
    def alike(self) -> float:
        """RMS of a residual below which one explanation is as good as another."""

    def residual(self, system: SecondOrderSystem) -> FloatArray:
        """(n,) of a system against it."""

    def remainder(self, residual: FloatArray) -> Remainder:
        """What is left in a residual."""

    def thinned(self) -> Self:
        """Less of it, to search with."""

    def along(self, system: SecondOrderSystem, slope: Slope, amounts: FloatArray) -> FloatArray:
        """(n_amount,) mean squares of the residual where multiples of a slope are added."""

    def sensitivities(
        self, system: SecondOrderSystem, changes: Sequence[SecondOrderSystem], steps: FloatArray
    ) -> FloatArray:
        """(n, n_change) ∂(residual)/∂p, systems being p's change by a small step each."""


@dataclass(frozen=True, eq=False)
class FrfEvidence:
    """FRFs between some of the model's DoFs.

    Attributes
    ----------
    frf
        Theirs, receptances.
    offset
        Ours from a file less the model's (m/N), of the FRFs' shape; None: the model's are ours.
    unknown
        Bound of what round-off makes of the model's (m/N), of the FRFs' shape; None: of nothing.
    """

    frf: Frf
    offset: ComplexArray | None = None
    unknown: FloatArray | None = None

    @property
    def lines(self) -> FloatArray:
        """Its lines (Hz)."""
        return self.frf.frequency

    @property
    def alike(self) -> float:
        """Round-off of FRFs near an undamped pole."""
        return ALIKE

    @property
    def count(self) -> str:
        """How many FRFs and lines."""
        n = len(self.frf.responses) * len(self.frf.excitations)
        return f"{n} FRFs on {len(self.lines)} lines"

    @cached_property
    def _floor(self) -> FloatArray:
        size = np.abs(self.frf.values)
        rows, columns = (np.sqrt((size**2).sum(axis=axis)) for axis in (2, 1))
        floor = FLOOR * np.sqrt(rows[:, :, None] * columns[:, None, :])
        floor = np.asarray(floor + NOTHING * size.max(axis=(1, 2), keepdims=True))
        # what round-off makes of a number is no residual, however small the number is
        return floor if self.unknown is None else floor + self.unknown / NEGLIGIBLE

    def ours(self, system: SecondOrderSystem) -> ComplexArray:
        """The same FRFs of a system (m/N), kept for the last one."""
        kept = self.__dict__.get("_ours")
        if kept is None or kept[0] is not system:
            frf = synthesize(system, self.lines, self.frf.responses, self.frf.excitations).frf
            kept = (system, frf.values if self.offset is None else frf.values + self.offset)
            self.__dict__["_ours"] = kept
        found: ComplexArray = kept[1]
        return found

    def residual(self, system: SecondOrderSystem) -> FloatArray:
        """Real parts, then imaginary ones, of (n_frequency, n_response, n_excitation)."""
        ours, theirs = self.ours(system), self.frf.values
        return _parts((theirs - ours) / self._size(ours))

    def _size(self, ours: ComplexArray) -> FloatArray:
        size = np.abs(self.frf.values) + np.abs(ours) + self._floor
        return np.maximum(size, np.finfo(float).tiny)

    def remainder(self, residual: FloatArray) -> Remainder:
        """By what each FRF's numbers keep from line to line, which noise does not.

        Of n independent phases Σ ēₖ eₖ₊₁ is 0 ± √(Σ|eₖ|²|eₖ₊₁|²/2), however large e is where: of
        the numbers as they are, and of their phases alone. Second differences of noise of
        variance σ² have 6σ², whatever is smooth below; where they have none, nothing is noise.
        What is as large as the FRFs themselves may be independent too, but is not noise on ours.
        """
        e = self._complex(residual).reshape(len(self.lines), -1)
        powers = np.mean(np.abs(e) ** 2, axis=0)
        rms, n = float(np.sqrt(powers.mean())), len(e) - 1
        if n < FEWEST_STEPS or rms <= NEGLIGIBLE:
            return Remainder(rms, 0.0, rms > NEGLIGIBLE, float(residual.size))
        second = np.abs(e[2:] - 2.0 * e[1:-1] + e[:-2]) ** 2
        noises = np.median(second, axis=0) / np.log(2.0) / 6.0
        phases = e / np.maximum(np.abs(e), NEGLIGIBLE)
        kept = np.maximum(_kept(e), _kept(phases)) > AUTOCORRELATION
        odd = (kept | (noises < QUIET**2)) & (powers > NEGLIGIBLE**2) | (powers > UNRELATED)
        pairs = float(np.sum((e[1:].conj() * e[:-1]).real)) / float(n * powers.sum())
        white = float(np.clip(pairs, 0.0, 0.999))
        effective = residual.size * (1.0 - white) / (1.0 + white)
        return Remainder(rms, float(np.sqrt(noises.mean())), bool(np.any(odd)), effective)

    def _complex(self, residual: FloatArray) -> ComplexArray:
        real, imaginary = residual.reshape(2, *self.frf.values.shape)
        return np.asarray(real + 1j * imaginary)

    def thinned(self) -> FrfEvidence:
        """Some of the lines, evenly chosen."""
        n = len(self.lines)
        chosen = np.unique(np.linspace(0, n - 1, min(n, SEARCH_LINES)).round().astype(int))
        offset = None if self.offset is None else self.offset[chosen]
        unknown = None if self.unknown is None else self.unknown[chosen]
        return FrfEvidence(self._with(self.frf.values[chosen], self.lines[chosen]), offset, unknown)

    def known_as(self, system: SecondOrderSystem) -> FrfEvidence:
        """The same, with what round-off makes of the FRFs of a system."""
        frf = synthesize(system, self.lines, self.frf.responses, self.frf.excitations).frf
        return replace(self, unknown=frf.round_off)

    def _everything(self, system: SecondOrderSystem) -> ComplexArray:
        """Receptances between all of a system's DoFs, kept for the last system."""
        kept = self.__dict__.get("_kept")
        if kept is None or kept[0] is not system:
            dofs = system.dofs
            kept = (system, synthesize(system, self.lines, dofs, dofs).frf.values)
            self.__dict__["_kept"] = kept
        found: ComplexArray = kept[1]
        return found

    def along(self, system: SecondOrderSystem, slope: Slope, amounts: FloatArray) -> FloatArray:
        """H − H Q (I + a D Qᵀ H Q)⁻¹ a D Qᵀ H, D = Qᵀ (∂Z/∂p) Q of low rank (Woodbury 1950)."""
        whole, q = self._everything(system), slope.basis()
        omega = 2.0 * np.pi * self.lines[:, None, None]
        d = (
            q.T @ slope.stiffness @ q
            + 1j * omega * (q.T @ slope.damping @ q)
            - omega**2 * (q.T @ slope.mass @ q)
        )
        i, row = system.locate(self.frf.responses)
        j, column = system.locate(self.frf.excitations)
        to, back = whole[:, i] @ q * row[:, None], q.T @ whole[:, :, j] * column
        base, inner, applied = self.ours(system), d @ (q.T @ whole @ q), d @ back
        eye, found = np.eye(q.shape[1]), np.empty(len(amounts))
        for number, amount in enumerate(amounts):
            ours = base - to @ np.linalg.solve(eye + amount * inner, amount * applied)
            error = (self.frf.values - ours) / self._size(ours)
            found[number] = 0.5 * np.mean(error.real**2 + error.imag**2)
        return np.where(np.isfinite(found), found, np.inf)

    def with_values(self, values: ComplexArray) -> FrfEvidence:
        """The same FRFs with other values."""
        other = replace(self, frf=self._with(values, self.lines))
        if "_ours" in self.__dict__:  # ours do not change with theirs
            other.__dict__["_ours"] = self.__dict__["_ours"]
        return other

    def with_lines(self, lines: FloatArray) -> FrfEvidence:
        """The same values at other lines (Hz)."""
        return replace(self, frf=self._with(self.frf.values, lines))

    def relabelled(self, responses: Sequence[str], excitations: Sequence[str]) -> FrfEvidence:
        """The same values between other DoFs."""
        return replace(self, frf=Frf(self.lines, self.frf.values, responses, excitations))

    def _with(self, values: ComplexArray, lines: FloatArray) -> Frf:
        return Frf(lines, values, self.frf.responses, self.frf.excitations)

    def sensitivities(
        self, system: SecondOrderSystem, changes: Sequence[SecondOrderSystem], steps: FloatArray
    ) -> FloatArray:
        """−∂H/∂p over the size, ∂H/∂p = −H (∂Z/∂p) H: rows of the responses, columns of the rest.

        Parameters
        ----------
        system
            Where.
        changes, steps
            The system with p changed by a step; ∂Z/∂p is the difference over the step.
        """
        dofs, r, c = system.dofs, self.frf.responses, self.frf.excitations
        ours = self.ours(system)
        rows = synthesize(system, self.lines, r, dofs).frf.values
        columns = synthesize(system, self.lines, dofs, c).frf.values
        size, omega = self._size(ours), 2.0 * np.pi * self.lines
        found = np.zeros((2 * ours.size, len(changes)))
        for number, (other, step) in enumerate(zip(changes, steps, strict=True)):
            total = np.zeros_like(ours)
            for matrix, weight in (
                ("stiffness", np.ones_like(omega)), ("damping", 1j * omega), ("mass", -(omega**2))
            ):  # fmt: skip
                change = (getattr(other, matrix) - getattr(system, matrix)) / step
                if change.any():
                    at = np.flatnonzero(change.any(axis=0) | change.any(axis=1))
                    inner = rows[:, :, at] @ change[np.ix_(at, at)] @ columns[:, at, :]
                    total += weight[:, None, None] * inner
            found[:, number] = _parts(total / size)
        return found


def _kept(e: ComplexArray) -> FloatArray:
    """(n_frf,) what numbers keep from line to line, in standard deviations of independent ones."""
    products = e[1:].conj() * e[:-1]
    spread = np.sqrt(np.sum(np.abs(products) ** 2, axis=0) / 2.0)
    return np.asarray(products.real.sum(axis=0) / np.maximum(spread, np.finfo(float).tiny))


def _parts(values: ComplexArray) -> FloatArray:
    return np.concatenate([values.real.ravel(), values.imag.ravel()])


def stepped(
    evidence: Evidence, system: SecondOrderSystem, slope: Slope, amounts: FloatArray
) -> FloatArray:
    """Mean squares along a slope, each system built."""
    found = []
    for amount in amounts:
        try:
            residual = evidence.residual(slope.added(system, float(amount)))
        except FbsError:  # a mass or stiffness below zero
            found.append(np.inf)
        else:
            found.append(float(np.mean(residual**2)))
    return np.array(found)


def differenced(
    evidence: Evidence,
    system: SecondOrderSystem,
    changes: Sequence[SecondOrderSystem],
    steps: FloatArray,
) -> FloatArray:
    """∂(residual)/∂p by differences: for evidence whose residuals cost next to nothing."""
    base = evidence.residual(system)
    columns = [
        (evidence.residual(other) - base) / step for other, step in zip(changes, steps, strict=True)
    ]
    return np.column_stack(columns) if columns else np.zeros((base.size, 0))

"""What the study of the paper finds: tables, figures and claims, each with a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mbs_models.modal.mode_kinds import Kind

from .truncation_results import TruncationStudy

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Verdict(StrEnum):
    """Whether what the paper says is so."""

    HOLDS = "holds"
    CORRECTED = "holds with a correction"
    FAILS = "does not hold"


class RowVerdict(StrEnum):
    """Whether a printed number is found."""

    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a stated correction"
    MISSED = "not reproduced"


@dataclass(frozen=True)
class Found:
    """The computed mode nearest to a printed one.

    Attributes
    ----------
    frequency_hz, kind, multiplicity
        Of the mode (a repeated one counts as one with its multiplicity).
    deviation_hz
        Computed minus printed.
    """

    frequency_hz: float
    kind: Kind
    multiplicity: int
    deviation_hz: float


@dataclass(frozen=True)
class TableRow:
    """One printed natural frequency.

    Attributes
    ----------
    number
        The row's number in the paper.
    printed
        As printed, e.g. ``727(2)``.
    column
        The column it stands in.
    frequency_hz, multiplicity, kind
        What the print says: Hz, how many modes, of which kind.
    found
        Parameter set → the nearest computed mode of that kind.
    verdict, reason
        The verdict, and what was found out, in words with numbers.
    """

    number: int
    printed: str
    column: str
    frequency_hz: float
    multiplicity: int
    kind: Kind
    found: Mapping[str, Found]
    verdict: RowVerdict
    reason: str


@dataclass(frozen=True)
class MissingMode:
    """A computed mode below the table's highest band that the table does not print."""

    frequency_hz: float
    multiplicity: int
    kind: Kind
    reason: str


@dataclass(frozen=True)
class PaperTable:
    """A table of natural frequencies, printed beside computed."""

    id: str
    caption: str
    place: str
    rows: tuple[TableRow, ...]
    missing: tuple[MissingMode, ...]
    tolerance_hz: float
    tolerance_reason: str
    best_set: str
    verdict: Verdict
    evidence: str


@dataclass(frozen=True)
class DofName:
    """A degree of freedom in the paper's words, as a label, and in plain words."""

    paper: str
    label: str
    words: str


@dataclass(frozen=True)
class Curve:
    """One FRF of a figure.

    Attributes
    ----------
    name
        What a legend says.
    route
        How it was computed.
    values
        (n_frequency,) receptance, m/N.
    """

    name: str
    route: str
    values: ComplexArray


@dataclass(frozen=True)
class Difference:
    """A curve against the figure's reference.

    Attributes
    ----------
    curve, reference
        Names of the curves compared.
    decibel
        (n_frequency,) 20 log₁₀|H/H_ref|; NaN where the reference is zero.
    scaled
        (n_frequency,) |ΔH|/√(h_i h_j), h the norm of the reference's rows; NaN where there is none.
    worst_db, worst_db_hz
        Largest modulus of ``decibel``, and where.
    worst_scaled, worst_scaled_hz
        Largest ``scaled``, and where.
    """

    curve: str
    reference: str
    decibel: FloatArray
    scaled: FloatArray
    worst_db: float
    worst_db_hz: float
    worst_scaled: float
    worst_scaled_hz: float


@dataclass(frozen=True)
class Resonance:
    """A natural frequency to be marked, of the system a curve belongs to."""

    system: str
    frequency_hz: float
    multiplicity: int
    kind: str
    visible: bool


@dataclass(frozen=True)
class Figure:
    """The data of one picture of the paper.

    Attributes
    ----------
    id, title, place
        ``fig8a``; what it shows; where it stands in the paper.
    caption
        The paper's caption, in short.
    quantity
        What is drawn.
    response, excitation
        The FRF's degrees of freedom.
    frequency
        (n_frequency,) Hz.
    band_note
        Band and step, and which lines were left out or shifted.
    curves, differences
        The routes, and each against the first curve.
    resonances
        To be marked.
    says
        What the paper says of the figure.
    verdict, evidence
        Whether it holds, and the numbers.
    """

    id: str
    title: str
    place: str
    caption: str
    quantity: str
    response: DofName
    excitation: DofName
    frequency: FloatArray
    band_note: str
    curves: tuple[Curve, ...]
    differences: tuple[Difference, ...]
    resonances: tuple[Resonance, ...]
    says: str
    verdict: Verdict
    evidence: str


@dataclass(frozen=True)
class StiffnessRow:
    """One planetary DoF's drive-point FRF for one k_sw (Figs. 8, 9, 12, for u, v and w).

    Attributes
    ----------
    shaft_stiffness
        k_sw (N/m).
    dof
        The degree of freedom.
    routes_db, routes_scaled
        Coupled against full system: largest error (dB, and scaled).
    change_db
        Full system against the smallest k_sw of the study: largest change (dB).
    """

    shaft_stiffness: float
    dof: DofName
    routes_db: float
    routes_scaled: float
    change_db: float


@dataclass(frozen=True)
class LockedCheck:
    """A condensed system by its formula, by blocked matrices, and by exudyn with locked DoFs.

    Attributes
    ----------
    name, equation
        What is condensed, by which equation.
    locked
        How many coordinates stand still.
    frequencies_hz
        Natural frequencies of exudyn's locked model.
    frequency_error, matrix_error, formula_error
        Largest relative difference of the natural frequencies; largest scaled error of the FRFs
        of the blocked matrices, and of the printed formula, against exudyn's locked model.
    tolerance
        What they may be.
    """

    name: str
    equation: str
    locked: int
    frequencies_hz: tuple[float, ...]
    frequency_error: float
    matrix_error: float
    formula_error: float
    tolerance: float

    @property
    def agrees(self) -> bool:
        """Whether all three are within the tolerance."""
        return max(self.frequency_error, self.matrix_error, self.formula_error) <= self.tolerance


@dataclass(frozen=True)
class Timing:
    """Seconds of one way to the FRFs, median of several runs after a warm-up."""

    name: str
    seconds: float
    relative: float


@dataclass(frozen=True)
class TimingStudy:
    """Full system against coupling, side by side in one run."""

    conditions: str
    single: tuple[Timing, ...]
    sweep: tuple[Timing, ...]


@dataclass(frozen=True)
class Claim:
    """One sentence of the paper and what became of it.

    Attributes
    ----------
    id, topic
        A short name; what it is about.
    says, place
        The paper's sentence in short, and where it stands.
    computed
        What was computed to judge it.
    verdict, evidence
        The verdict, and the numbers behind it.
    numbers
        The same numbers by name.
    """

    id: str
    topic: str
    says: str
    place: str
    computed: str
    verdict: Verdict
    evidence: str
    numbers: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class PaperStudy:
    """All of it; what was not asked for is empty or None."""

    drivetrain: str
    parameter_sets: tuple[str, ...]
    tables: tuple[PaperTable, ...]
    figures: tuple[Figure, ...]
    stiffness: tuple[StiffnessRow, ...]
    condensation: tuple[LockedCheck, ...]
    truncation: TruncationStudy | None
    timing: TimingStudy | None
    claims: tuple[Claim, ...]
    seconds: Mapping[str, float]

    @property
    def verdicts(self) -> tuple[tuple[str, str], ...]:
        """(id, verdict) of every table, table row, figure and claim, in the paper's order."""
        found: list[tuple[str, str]] = []
        for table in self.tables:
            found.append((table.id, table.verdict))
            found += [(f"{table.id} row {r.number}, {r.printed}", r.verdict) for r in table.rows]
        found += [(figure.id, figure.verdict) for figure in self.figures]
        return (*found, *((claim.id, claim.verdict) for claim in self.claims))

"""One record for each table, figure, equation and sentence of the paper that can be checked.

A `Statement` says where it stands, what it says and what is computed; examining it on a `Bench`
gives an `Item`: the same with a verdict, which follows from the numbers beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from ..arrays import ComplexArray, FloatArray
from ..checks.check import Check
from ..report.page import Block

if TYPE_CHECKING:
    from .bench import Bench


class Verdict(StrEnum):
    """Whether what the paper says is so."""

    HOLDS = "holds"
    CORRECTED = "holds with a correction"
    FAILS = "does not hold"
    OPEN = "cannot be told"

    @classmethod
    def of(cls, holds: bool, corrected: bool = False) -> Verdict:
        """It holds, or does with the correction that the evidence states, or does not."""
        return cls.HOLDS if holds else cls.CORRECTED if corrected else cls.FAILS


@dataclass(frozen=True)
class DofName:
    """A degree of freedom in the paper's words, as a label, and in plain words."""

    paper: str
    label: str
    words: str


@dataclass(frozen=True)
class Curve:
    """One FRF of a figure: its name in the legend, its route, (n_frequency,) values in m/N."""

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
class Picture:
    """The data of one picture of the paper.

    Attributes
    ----------
    caption, quantity
        The paper's caption, in short; what is drawn.
    response, excitation
        The FRF's degrees of freedom.
    frequency
        (n_frequency,) Hz.
    band_note
        Band and step, and which lines were shifted.
    curves, differences
        The curves, and each against the first one.
    resonances
        To be marked.
    """

    caption: str
    quantity: str
    response: DofName
    excitation: DofName
    frequency: FloatArray
    band_note: str
    curves: tuple[Curve, ...]
    differences: tuple[Difference, ...]
    resonances: tuple[Resonance, ...]


@dataclass(frozen=True)
class Finding:
    """What was found of a statement.

    Attributes
    ----------
    verdict, evidence
        Whether it holds, and the numbers it follows from, in words.
    numbers
        The same numbers by name.
    picture
        Of a figure: what it shows.
    blocks
        Tables of what is too much for a sentence.
    details
        All of them for paper.json, by name.
    checks
        Routes held against each other on the way.
    """

    verdict: Verdict
    evidence: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    picture: Picture | None = None
    blocks: tuple[Block, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()


@dataclass(frozen=True)
class Item:
    """A table, figure, equation or sentence of the paper, and what became of it.

    Attributes
    ----------
    id, title
        Its name for ``--only``; what it is about.
    subject
        The group it belongs to: tables, figures, formulas, truncation, ….
    place, says
        Where it stands in the paper, and what it says.
    computed
        What was computed to examine it.
    finding
        The verdict and what it follows from.
    """

    id: str
    title: str
    subject: str
    place: str
    says: str
    computed: str
    finding: Finding

    @property
    def verdict(self) -> Verdict:
        """Whether it holds."""
        return self.finding.verdict

    @property
    def evidence(self) -> str:
        """The numbers the verdict follows from, in words."""
        return self.finding.evidence


@dataclass(frozen=True)
class Statement:
    """What the paper says, and the function that examines it; attributes as of `Item`."""

    id: str
    title: str
    subject: str
    place: str
    says: str
    computed: str
    examine: Callable[[Bench], Finding]

    def on(self, bench: Bench) -> Item:
        """The statement, examined."""
        found = self.examine(bench)
        return Item(self.id, self.title, self.subject, self.place, self.says, self.computed, found)


def statement(
    id: str, title: str, place: str, says: str, computed: str, subject: str = ""
) -> Callable[[Callable[[Bench], Finding]], Statement]:
    """Make a statement of the function that examines it; by default its module is the subject."""

    def decorate(examine: Callable[[Bench], Finding]) -> Statement:
        own = subject or examine.__module__.rpartition(".")[2]
        return Statement(id, title, own, place, says, computed, examine)

    return decorate

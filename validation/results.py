"""What a cross-check finds: checks with verdicts, and the data behind them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fbs import frequency_axis
from fbs.frf import axis_ends
from mbs_models.components import Components
from mbs_models.energy import ComponentShares
from mbs_models.mode_kinds import Modes
from mbs_models.parameters import Damping, Drivetrain

from .errors import require_frequencies
from .judged import judged
from .peaks import Resonance
from .replacement import Replacement

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[Any]


@dataclass(frozen=True)
class Band:
    """The frequency lines fmin, fmin + df, … fmax (Hz), or those of a file."""

    fmin: float = 1.0
    fmax: float = 15000.0
    df: float = 1.0
    lines: FloatArray | None = field(default=None, compare=False, repr=False)

    def frequency(self) -> FloatArray:
        """The lines (Hz); refuses limits that are no axis."""
        if self.lines is not None:
            return self.lines
        return frequency_axis(self.fmin, self.fmax, self.df)

    @property
    def count(self) -> float:
        """How many lines there are, without making them; refuses limits that are no axis."""
        if self.lines is not None:
            return float(len(self.lines))
        first, last = axis_ends(self.fmin, self.fmax, self.df)
        return float(last - first) + 1.0

    @classmethod
    def of(cls, lines: FloatArray) -> Band:
        """The band of given lines; df is their mean step (0 for a single line)."""
        first, last = float(lines[0]), float(lines[-1])
        return cls(first, last, (last - first) / max(len(lines) - 1, 1), lines)


# Values a route computes by default: 1 Hz steps to 15 kHz for 57 DoFs, coarser for larger systems.
DEFAULT_VALUES = 5e7
DEFAULT_LINES = 1e6  # 1 Hz steps to 1 MHz, coarser for wider bands


def band(fmin: float | None, fmax: float | None, df: float | None, n_frfs: int = 1) -> Band:
    """A band from what is given of it.

    The step defaults to 1 Hz, or to the first of 2, 5, 10 … Hz at which there are no more than 1e6
    lines, and ``n_frfs`` FRFs are no more than 5e7 values; open ends are the multiples of the step
    within 1 Hz … 15 kHz.

    Raises
    ------
    CommandError, FbsError
        The step or a limit is no number an axis can be made of.
    """
    require_frequencies(fmin=fmin, fmax=fmax, df=df)
    if df is None:
        span = (15000.0 if fmax is None else fmax) - (fmin or 0.0)
        df = _round_step(span / min(DEFAULT_LINES, DEFAULT_VALUES / n_frfs))
    step = float(frequency_axis(0.0, df, df)[1])  # refuses a step that is none
    first = max(math.ceil(1.0 / step), 1)
    if fmin is None:
        fmin = first * step
    if fmax is None:
        fmax = max(math.floor(15000.0 / step), first) * step
    return Band(fmin, fmax, df)


def _round_step(least: float) -> float:
    """The first of 1, 2, 5, 10, 20 … Hz that is at least so much."""
    if least <= 1.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(least))
    return next(step for n in (1.0, 2.0, 5.0, 10.0) if (step := n * decade) >= least)


@dataclass(frozen=True)
class Check:
    """One comparison and its verdict.

    Attributes
    ----------
    name, subject
        What was compared, of what.
    routes
        The two routes; the first is the reference.
    measure, value, tolerance, reason
        The number compared, the most it may be, and why that much.
    findings
        Where and by what the routes disagree, in words; empty where they agree.
    note
        What else a reader should know.
    """

    name: str
    subject: str
    routes: tuple[str, str]
    measure: str
    value: float
    tolerance: float
    reason: str
    findings: tuple[str, ...] = ()
    note: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the value is within the tolerance (a NaN is not)."""
        return bool(self.value <= self.tolerance)


@dataclass(frozen=True)
class PoleRow:
    """One pole by three routes: exudyn's eigensolution, the equations, and FBS' coupled FRFs."""

    kind: str
    frequency_hz: Mapping[str, float]
    damping_ratio: Mapping[str, float]
    subspace_mac: Mapping[str, float]
    round_off_hz: float


@dataclass(frozen=True)
class FrfComparison:
    """All FRFs of a route against the reference's.

    Attributes
    ----------
    route
        The route compared.
    line_max, line_median
        (n_frequency,) largest and median scaled error over all FRFs, by line.
    pair_max
        (n_dof, n_dof) largest scaled error over all lines, by response and excitation.
    worst
        Frequency (Hz), response and excitation of the largest scaled error.
    frac
        Smallest FRAC of the report's curves, and the curve it belongs to.
    """

    route: str
    line_max: FloatArray
    line_median: FloatArray
    pair_max: FloatArray
    worst: tuple[float, str, str]
    frac: tuple[float, str]


@dataclass(frozen=True, eq=False)
class CurveChange:
    """What a swap changes in one FRF.

    Attributes
    ----------
    response, excitation
        Which FRF.
    before, after
        (n_frequency,) receptance (m/N): the model's, and with the file's.
    decibel
        (n_frequency,) 20 log₁₀|after/before|; NaN where both are round-off.
    largest_db, at_hz, rms_db
        The difference of largest modulus, where it is, and the root mean square over the band
        (NaN where there is none).
    scaled_error, frac
        The largest scaled error over the band, and the FRAC of before and after.
    resonances
        Of a drive point: its peaks before and after.
    """

    response: str
    excitation: str
    before: ComplexArray
    after: ComplexArray
    decibel: FloatArray
    largest_db: float
    at_hz: float
    rms_db: float
    scaled_error: float
    frac: float
    resonances: tuple[Resonance, ...]

    @property
    def name(self) -> str:
        """``planetary.sun.w``, or ``response ← excitation``."""
        if self.response == self.excitation:
            return self.response
        return f"{self.response} ← {self.excitation}"


@dataclass(frozen=True, eq=False)
class Swap:
    """What changes when parts' FRFs come from files: findings, not disagreements.

    Attributes
    ----------
    replacements
        The parts and their files.
    responses, excitations
        Labels of the FRFs compared: those of the whole that the swapped assembly has.
    comparison
        The swapped assembly against the reference; ``pair_max`` by ``responses`` and
        ``excitations``.
    changes
        Whether any scaled error is more than a file's digits and round-off explain.
    curves
        The report's FRFs of the assembly before and after.
    not_compared
        (response, excitation) of the report's FRFs that the files leave out.
    alone
        Part → its FRFs before any coupling, at its interface DoFs and those of ``curves`` that it
        has: the model's and the file's.
    resonances
        All drive points' resonances, each once.
    """

    replacements: tuple[Replacement, ...]
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    comparison: FrfComparison
    changes: bool
    curves: tuple[CurveChange, ...]
    not_compared: tuple[tuple[str, str], ...]
    alone: Mapping[str, tuple[CurveChange, ...]]
    resonances: tuple[Resonance, ...]


@dataclass(frozen=True)
class TimeDomain:
    """FRFs from one multisine run, beside FBS'.

    Attributes
    ----------
    excitation
        The excited DoF.
    labels
        The responses compared (those that are not zero by symmetry).
    frequency
        (n_line,) Hz.
    transient, substructured
        (n_line, n_label) receptance (m/N).
    damping
        What both routes used.
    step, shots, closure, even_share
        As in `PeriodicRecord`.
    compared
        (n_line, n_label) the lines judged.
    worst_db, worst_degrees
        (n_label,) largest differences over the lines compared.
    """

    excitation: str
    labels: tuple[str, ...]
    frequency: FloatArray
    transient: ComplexArray
    substructured: ComplexArray
    damping: Damping
    step: float
    shots: int
    closure: float
    even_share: float
    compared: BoolArray
    worst_db: FloatArray
    worst_degrees: FloatArray

    @property
    def judged(self) -> str:
        """On how many lines a verdict on them rests, and where it leaves out half of the band."""
        names = [f"{label} ← {self.excitation}" for label in self.labels]
        return judged(names, self.frequency, self.compared)


@dataclass(frozen=True)
class CrossCheck:
    """Everything a report says.

    Attributes
    ----------
    drivetrain, band
        What was checked, and over which lines.
    warnings
        What is allowed in the model but probably not meant.
    checks
        Every comparison with its verdict.
    modes
        exudyn's modes, with kinds and energy shares.
    poles
        The same poles by every route.
    dofs
        Labels of the FRFs compared (all against all).
    frequency
        (n_frequency,) Hz.
    reference
        Name of the reference route.
    comparisons
        The other routes.
    round_off
        (n_frequency,) scaled error that round-off of the stiffness alone explains.
    curves
        (response, excitation) → route → (n_frequency,) receptance (m/N).
    kernel_condition
        (n_frequency,) amplification in the interface kernel, or empty if nothing is coupled.
    components, component_energy
        Bodies and springs as exudyn has them, and their shares of every mode's energy.
    timings
        Seconds by step.
    swap
        What changes with parts from files; None if there are none.
    time_domain
        FRFs from exudyn's time integration; None if it was not run.
    """

    drivetrain: Drivetrain
    band: Band
    warnings: tuple[str, ...]
    checks: tuple[Check, ...]
    modes: Modes
    poles: tuple[PoleRow, ...]
    dofs: tuple[str, ...]
    frequency: FloatArray
    reference: str
    comparisons: tuple[FrfComparison, ...]
    round_off: FloatArray
    curves: Mapping[tuple[str, str], Mapping[str, ComplexArray]]
    kernel_condition: FloatArray
    components: Components
    component_energy: ComponentShares
    timings: Mapping[str, float] = field(default_factory=dict)
    swap: Swap | None = None
    time_domain: TimeDomain | None = None

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)

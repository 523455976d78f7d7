"""What a cross-check finds: checks with verdicts, and the data behind them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fbs import frequency_axis
from mbs_models.mode_kinds import Modes
from mbs_models.parameters import Drivetrain

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[Any]


@dataclass(frozen=True)
class Band:
    """The frequency lines fmin, fmin + df, … fmax (Hz)."""

    fmin: float = 1.0
    fmax: float = 15000.0
    df: float = 1.0

    def frequency(self) -> FloatArray:
        """The lines (Hz); refuses limits that are no axis."""
        return frequency_axis(self.fmin, self.fmax, self.df)


STEPS = [step * 10.0**decade for decade in range(8) for step in (1.0, 2.0, 5.0)]
# Values a route computes by default: 1 Hz steps to 15 kHz for 57 DoFs, coarser for larger systems.
DEFAULT_VALUES = 5e7


def band(fmin: float | None, fmax: float | None, df: float | None, n_dofs: int = 1) -> Band:
    """A band from what is given of it.

    The step defaults to 1 Hz, or to the first of 2, 5, 10 … Hz at which all FRFs of a large system
    are no more than 5e7 values; open ends are the multiples of the step within 1 Hz … 15 kHz.

    Raises
    ------
    FbsError
        The step or a limit is no number an axis can be made of.
    """
    if df is None:
        lines = DEFAULT_VALUES / n_dofs**2
        df = next(step for step in STEPS if ((fmax or 15000.0) - (fmin or 0.0)) / step <= lines)
    step = frequency_axis(0.0, df, df)[1]  # refuses a step that is none
    first = max(math.ceil(1.0 / step), 1)
    if fmin is None:
        fmin = first * step
    if fmax is None:
        fmax = max(math.floor(15000.0 / step), first) * step
    return Band(fmin, fmax, df)


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
    timings
        Seconds by step.
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
    timings: Mapping[str, float] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)

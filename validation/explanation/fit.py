"""Changes of parameters fitted to the evidence, in the logarithm of each, and how they compare."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from fbs import FbsError
from mbs_models.errors import ModelError

from ..arrays import FloatArray
from ..errors import CommandError
from .candidates import Case, Parameter, slope_of
from .evidence import Remainder

# Changes ln(p/p₀) tried before the fit: a resonance moved by more than its width has no slope to go
COARSE = tuple(
    s * x
    for x in (0.01, 0.03, 0.05, 0.075, 0.11, 0.16, 0.3, 0.6, 1.2, 2.4, 4.8)
    for s in (1.0, -1.0)
)
FROM_ZERO = tuple(float(x) for x in np.linspace(-9.0, 3.0, 13))  # ln(p/unit)
ZOOMS = 4
EVALUATIONS = 30
ROUND_OFF = 1e-9  # of residuals: likelihoods of what is exact but for it are alike


@dataclass(frozen=True)
class Change:
    """A parameter changed: ln of by how much."""

    parameter: Parameter
    log: float

    @property
    def value(self) -> float:
        """What it is then, at its first place."""
        return self.parameter.value(self.log)

    def on(self, case: Case) -> Case:
        """The case with it."""
        return self.parameter.at(case, self.log)


@dataclass(frozen=True, eq=False)
class Explanation:
    """A case before and after causes: gross ones in words, then changes of parameters.

    Attributes
    ----------
    start
        After the gross causes.
    gross
        What they are; empty: none.
    changes
        Of parameters.
    """

    start: Case
    gross: tuple[str, ...] = ()
    changes: tuple[Change, ...] = ()

    @cached_property
    def case(self) -> Case:
        """The case after all changes."""
        found = self.start
        for change in self.changes:
            found = change.on(found)
        return found

    @cached_property
    def power(self) -> float:
        """Mean square of what remains."""
        return float(np.mean(self.case.residual**2))

    @cached_property
    def remainder(self) -> Remainder:
        """What remains says of itself."""
        return self.case.evidence.remainder(self.case.residual)

    @property
    def causes(self) -> int:
        """How many."""
        return len(self.gross) + len(self.changes)

    @property
    def free(self) -> int:
        """How many numbers are fitted."""
        return len(self.changes)

    @property
    def key(self) -> tuple[str, ...]:
        """What it says, without numbers."""
        return (*self.gross, *sorted(change.parameter.name for change in self.changes))


FAILURES = (CommandError, FbsError, ModelError)  # a drivetrain that is none, a line on a pole


def power_of(case: Case, parameters: Sequence[Parameter], logs: Sequence[float]) -> float:
    """Mean square of the residual after changes; infinite where the model refuses them."""
    try:
        return float(np.mean(_residual(case, parameters, logs) ** 2))
    except FAILURES:
        return math.inf


def _residual(case: Case, parameters: Sequence[Parameter], logs: Sequence[float]) -> FloatArray:
    for parameter, log in zip(parameters, logs, strict=True):
        case = parameter.at(case, float(log))
    return case.residual


def fitted(start: Explanation, changes: Sequence[Change]) -> Explanation | None:
    """Changes that leave least, by Gauss–Newton steps from those given; None: the model refuses."""
    parameters = [change.parameter for change in changes]
    first = np.array([change.log for change in changes])
    size = start.start.residual.size

    def residual(logs: FloatArray) -> FloatArray:
        try:
            return _residual(start.start, parameters, logs.tolist())
        except FAILURES:
            return np.ones(size)  # as large as residuals become

    try:
        found = least_squares(
            residual, first, method="trf", diff_step=1e-6, x_scale=1.0,
            xtol=1e-12, ftol=1e-14, gtol=1e-14, max_nfev=EVALUATIONS,
        )  # fmt: skip
    except ValueError:
        return None
    new = tuple(Change(p, float(x)) for p, x in zip(parameters, found.x, strict=True))
    return Explanation(start.start, start.gross, new)


def scanned(case: Case, parameter: Parameter) -> tuple[float, float]:
    """(power, change) where a parameter alone leaves least: coarse changes, then finer ones.

    Where M, C, K are affine in it, the case's FRFs of all DoFs give those of every change.
    """
    slope = slope_of(case, parameter)
    grid = FROM_ZERO if parameter.unit else COARSE
    if slope is None:
        return min((power_of(case, [parameter], [log]), log) for log in grid)
    if slope.is_zero:
        return float(np.mean(case.residual**2)), 0.0
    best = (math.inf, 0.0)
    width, centres = 0.0, np.array(grid)
    for _ in range(ZOOMS):
        amounts = np.exp(centres) - (0.0 if parameter.unit else 1.0)
        powers = case.evidence.along(case.system, slope, amounts)
        at = int(np.argmin(powers))
        best = min(best, (float(powers[at]), float(centres[at])))
        width = width / 4.0 if width else _spacing(grid, best[1])
        centres = best[1] + width * np.linspace(-1.0, 1.0, 9)
    return best


def _spacing(grid: Sequence[float], at: float) -> float:
    """To the further of a grid's neighbours of a value."""
    values = np.array(sorted((*grid, 0.0)))
    near = np.abs(values - at)
    return float(np.sort(near[near > 0.0])[1])


def covariance(explanation: Explanation) -> FloatArray:
    """σ²(JᵀJ)⁻¹ of the changes' logarithms, σ² by what remains."""
    changes = explanation.changes
    step = 1e-5
    base = explanation.case.residual
    columns = []
    for number in range(len(changes)):
        moved = [Change(c.parameter, c.log + step * (k == number)) for k, c in enumerate(changes)]
        other = Explanation(explanation.start, explanation.gross, tuple(moved))
        columns.append((other.case.residual - base) / step)
    sensitivity = np.column_stack(columns)
    degrees = max(explanation.remainder.effective - len(changes), 1.0)
    variance = max(explanation.power, ROUND_OFF**2) * base.size / degrees
    return np.asarray(variance * np.linalg.pinv(sensitivity.T @ sensitivity))


def log_likelihood_ratio(best: Explanation, other: Explanation) -> float:
    """ln of how much more likely one is: n/2·ln(power/power'), n the best's independent numbers."""
    n = best.remainder.effective
    floor = ROUND_OFF**2
    return 0.5 * n * (math.log(other.power + floor) - math.log(best.power + floor))

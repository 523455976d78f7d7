"""What a cross-check finds: checks with verdicts, and the data behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbs_models.modal.energy import ComponentShares
from mbs_models.modal.mode_kinds import Modes
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.components import Components

from ..checks.check import Check
from ..checks.frfs import FrfComparison
from ..checks.peaks import Resonance
from ..checks.pole_checks import PoleRow
from ..routes.bands import Band
from ..routes.substitution import Replacement
from ..routes.time_domain import TimeDomain

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[Any]


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

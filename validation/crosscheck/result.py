"""What a cross-check finds: checks with verdicts, and the data behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from mbs_models.modal.energy import ComponentShares
from mbs_models.modal.mode_kinds import Modes
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.components import Components

from ..arrays import ComplexArray, FloatArray
from ..checks.check import Check
from ..checks.frfs import FrfComparison
from ..checks.part_uncertainty import Known
from ..checks.peaks import Resonance
from ..checks.pole_checks import PoleRow
from ..explorer.plots import PAGE as EXPLORER
from ..report.page import Page
from ..report.provenance import Provenance
from ..routes.bands import Band
from ..routes.substitution import Substitution
from ..routes.time_domain import TimeDomain
from ..runtime.output_folder import Writer
from .resonances import Resonances

ARRAYS = "results.npz"


@dataclass(frozen=True, eq=False)
class CurveChange:
    """What a substitution changes in one FRF.

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
class Changes:
    """What changes when parts' FRFs come from files: findings, not disagreements.

    Attributes
    ----------
    substitutions
        The parts and their files.
    responses, excitations
        Labels of the FRFs compared: those of the whole that the assembly with the files'
        parts has.
    comparison
        That assembly against the reference; ``pair_max`` by ``responses`` and ``excitations``.
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
    known
        (response, excitation) → how well the FRF after is known; empty where no error of a file's
        FRFs is.
    """

    substitutions: tuple[Substitution, ...]
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    comparison: FrfComparison
    changes: bool
    curves: tuple[CurveChange, ...]
    not_compared: tuple[tuple[str, str], ...]
    alone: Mapping[str, tuple[CurveChange, ...]]
    resonances: tuple[Resonance, ...]
    known: Mapping[tuple[str, str], Known]


@dataclass(frozen=True, eq=False)
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
    resonances
        What orders meet over the operation's speeds; None without one.
    timings
        Seconds by step.
    substitution
        What changes with parts from files; None if there are none.
    time_domain
        FRFs from exudyn's time integration; None if it was not run.
    explorer
        The page of every other FRF; empty if it was not asked for.
    """

    files: ClassVar = ("report.html", "results.json")

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
    resonances: Resonances | None = None
    timings: Mapping[str, float] = field(default_factory=dict)
    substitution: Changes | None = None
    time_domain: TimeDomain | None = None
    explorer: str = ""

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)

    @property
    def worst(self) -> FrfComparison:
        """The route with the largest scaled error (one that is not a number is larger than any)."""
        return max(self.comparisons, key=lambda comparison: comparison.largest)

    def page(self) -> Page:
        """What report.html says."""
        from .sections import report_page  # pictures take their time to load

        return report_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What results.json holds."""
        from .document import results_document

        return results_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """``results.npz``: every line of every curve; and the page of every other FRF."""
        from .document import arrays_writer

        more = {EXPLORER: self.explorer} if self.explorer else {}
        return {ARRAYS: arrays_writer(self), **more}

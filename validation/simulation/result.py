"""What a run in time finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Signal

from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .drive_level import DriveLevels
from .estimates import EstimatedFrfs
from .gear_run import GearRun


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """A run, and what was made of it.

    Attributes
    ----------
    drivetrain
        With the damping it was run with.
    borrowed_damping
        Whether that is not the model's own.
    excitations
        What it was excited with from outside.
    record
        The motion.
    run_in
        How long it was run before what is analysed begins (s).
    estimated
        FRFs beside FBS': one for all inputs that act together, or one for each that has lines of
        its own. Empty if they cannot be had from this run: ``no_frfs`` says why.
    even_share
        Largest motion that does not change sign with the force, over the largest that does; None
        if the run was not reversed.
    checks
        Verdicts on them.
    levels
        FRF against drive level; None if not asked for.
    gears
        Meshes, orders and sidebands of a turning or loaded gearbox; None otherwise.
    hints
        Why FRFs disagree, where a run at a lower level tells.
    warnings
        What to mind.
    seconds
        How long each step took.
    saved
        Formats in which the record is kept, of `records.FORMATS`.
    """

    files: ClassVar = ("simulation.html", "simulation.json")

    drivetrain: Drivetrain
    borrowed_damping: bool
    excitations: tuple[Excitation[Signal], ...]
    record: TransientRecord
    run_in: float
    estimated: tuple[EstimatedFrfs, ...]
    no_frfs: str
    even_share: float | None
    checks: tuple[Check, ...]
    levels: DriveLevels | None = None
    gears: GearRun | None = None
    hints: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    saved: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)

    def page(self) -> Page:
        """What simulation.html says."""
        from .page import simulation_page  # pictures take their time to load

        return simulation_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What simulation.json holds."""
        from .document import simulation_document

        return simulation_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """The record in every format it is kept in."""
        from .records import record_writer

        return {f"record.{name}": record_writer(self, made, name) for name in self.saved}

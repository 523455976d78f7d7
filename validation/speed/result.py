"""What a speed study finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from mbs_models.gears.resonances import Margin
from mbs_models.modal.energy import ComponentShares
from mbs_models.modal.mode_kinds import Modes

from ..checks.check import Check
from ..report.page import Page
from ..report.provenance import Provenance
from ..runtime.output_folder import Writer
from .findings import Parting, Peak
from .instability import Unstable
from .steady import SteadyStates
from .time_reference import ROUTES as TIME_ROUTES
from .time_reference import TimeReference
from .turning import Turning

ARRAYS = "speed.npz"


@dataclass(frozen=True, eq=False)
class SpeedResult:
    """What a speed study finds.

    Attributes
    ----------
    turning
        What turns: plan, operating point, meshes, lines.
    states
        Steady states and growth rates, speed by speed; None where nothing excites.
    modes, energies
        The drivetrain's, by which resonances are named.
    responses
        DoFs whose acceleration is shown.
    peaks, unstable, partings
        What stands out.
    margins
        The nearest resonances at the operating speed of the model file; empty without one.
    references
        exudyn's time integration beside the steady state.
    checks, warnings
        Verdicts, and what to mind.
    seconds
        How long each step took.
    """

    files: ClassVar = ("speed.html", "speed.json")

    turning: Turning
    states: SteadyStates | None
    modes: Modes
    energies: ComponentShares
    responses: tuple[str, ...] = ()
    peaks: tuple[Peak, ...] = ()
    unstable: tuple[Unstable, ...] = ()
    partings: tuple[Parting, ...] = ()
    margins: tuple[Margin, ...] = ()
    references: tuple[TimeReference, ...] = ()
    checks: tuple[Check, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def compared_in_time(self) -> bool:
        """Whether exudyn's time integration could judge anything."""
        return any(check.routes == TIME_ROUTES for check in self.checks)

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)

    def page(self) -> Page:
        """What speed.html says."""
        from .sections import speed_page  # pictures take their time to load

        return speed_page(self)

    def document(self, made: Provenance) -> dict[str, Any]:
        """What speed.json holds."""
        from .document import speed_document

        return speed_document(self, made)

    def companions(self, made: Provenance) -> dict[str, str | Writer]:
        """``speed.npz``, every line at every speed, where something vibrates."""
        from .document import arrays_writer

        return {} if self.states is None else {ARRAYS: arrays_writer(self, self.states)}

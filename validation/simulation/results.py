"""What is asked of a run in time, and what it finds, as its report says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Signal

from ..checks.check import Check
from .drive_level import DriveLevels
from .estimates import EstimatedFrfs
from .gear_run import GearRun


@dataclass(frozen=True)
class Request:
    """What is asked of a run; None leaves the choice to the run.

    Attributes
    ----------
    excitations
        From outside.
    responses
        DoFs that are recorded (None: all).
    duration
        Seconds, run-in included.
    fmax
        End of the band of interest (Hz).
    sampling_frequency
        Of what is kept (Hz).
    integrator, step
        Name, and s.
    speed_rpm, torque
        Operating point of the input (rpm, N m); None: the model file's.
    levels
        Factors on the excitation at which the FRF is asked for.
    reverse
        Whether FRFs are taken from what changes sign with the force: a second run, reversed.
    """

    excitations: tuple[Excitation[Signal], ...] = ()
    responses: tuple[str, ...] | None = None
    duration: float | None = None
    fmax: float | None = None
    sampling_frequency: float | None = None
    integrator: str | None = None
    step: float | None = None
    speed_rpm: float | None = None
    torque: float | None = None
    levels: tuple[float, ...] = ()
    reverse: bool = True


@dataclass(frozen=True, eq=False)
class Simulation:
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
    """

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

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)

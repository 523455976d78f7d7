"""A run in time from what is asked of it to what its report says."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from fbs import Quantity, Record
from fbs.errors import FbsError
from mbs_models.gears.operating_point import OperatingPoint, operating_point
from mbs_models.integration.reversal import reversed_excitation
from mbs_models.integration.run_store import StoredRunError, remove_run
from mbs_models.integration.time_integration import simulate
from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Multisine, Signal
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize

from ..checks.check import Check
from ..routes.time_domain import with_damping
from ..runtime.clock import Clock
from ..runtime.progress import Progress, silent
from .drive_level import DriveLevels, check_levels, drive_levels
from .estimates import (
    EstimatedFrfs,
    compare_with_fbs,
    estimate_checks,
    estimate_frfs,
    responding,
    unbent,
)
from .gear_run import flank_warnings, gear_run, steady_checks
from .long_records import channels, odd_channels
from .options import Options
from .plan import RunPlan, excited_by_meshes, plan
from .proof import run_checks
from .result import SimulationResult
from .ringing import ringing, ringing_warning

LOWER = 0.1  # of the force, to see whether a difference falls with it
RECORDED = ("displacement", "velocity", "acceleration")
FORWARD, BACKWARD = "forward", "reversed"  # folders of a store


def run_simulation(
    drivetrain: Drivetrain,
    options: Options,
    *,
    store: Path | None = None,
    progress: Progress = silent,
) -> SimulationResult:
    """Integrate a drivetrain in time, and analyse what comes out.

    Parameters
    ----------
    drivetrain
        What is run; without damping of its own it is given Rayleigh damping, in every route.
    options
        What is asked.
    store
        Where finished pieces of the run are kept, so that an interrupted one goes on.
    progress
        Told a step's name, how far it is, and how far it goes.

    Raises
    ------
    ModelError, FbsError, CommandError
        What is asked cannot be run: an unknown DoF, a band beyond Nyquist, an unstable step, a
        duration too short, a run that diverges.
    """
    return PlannedRun(drivetrain, options, store).simulation(progress)


class PlannedRun:
    """A run laid out: what is asked has been checked, and nothing written yet.

    Its steps share what is run and how. Parameters and errors as for `run_simulation`.
    """

    def __init__(self, drivetrain: Drivetrain, options: Options, store: Path | None = None) -> None:
        self.given, self.options, self.store = drivetrain, options, store
        self.progress: Progress = silent
        self.drivetrain = with_damping(drivetrain)
        self.point = _operating_point(self.drivetrain, options)
        self.linear = (
            self.point.linear if self.point else linearize(build_drivetrain(self.drivetrain))
        )
        self.plan: RunPlan = plan(self.linear, options, self.point)
        if options.levels:
            check_levels(options.excitations, self.point)
        self.clock = Clock()
        self.computed_again: list[str] = []

    def simulation(self, progress: Progress = silent) -> SimulationResult:
        """Run it, and analyse what comes out."""
        self.progress = progress
        record = self.clock.timed("time integration", lambda: self._record(FORWARD))
        physics, unjudged = self._physics(record)
        estimated, no_frfs, share = self._frfs(record)
        frf_checks = tuple(check for each in estimated for check in estimate_checks(each))
        levels = None
        if self.options.levels:
            levels = self.clock.timed("drive levels", lambda: self._levels(self.options.levels))
        point = self.point
        gears = gear_run(self.drivetrain, point, record, self.plan.run_in) if point else None
        return SimulationResult(
            drivetrain=self.drivetrain,
            borrowed_damping=self.drivetrain is not self.given,
            excitations=self.options.excitations,
            record=record,
            run_in=self.plan.run_in,
            estimated=estimated,
            no_frfs=no_frfs,
            even_share=share,
            checks=(*frf_checks, *physics, *steady_checks(gears)),
            levels=levels,
            gears=gears,
            hints=self._hints(frf_checks),
            warnings=(
                *self.given.warnings(),
                *self.computed_again,
                *record.warnings,
                *ringing_warning(ringing(record)),
                *self._length_warning(),
                *unjudged,
                *flank_warnings(self.point),
            ),
            seconds=self.clock.seconds,
        )

    def _physics(self, record: TransientRecord) -> tuple[tuple[Check, ...], tuple[str, ...]]:
        """Verdicts of statics and energy on a run under torque or at speed."""
        if self.point is None:
            return (), ()
        return run_checks(
            self.drivetrain,
            self.point,
            record,
            self.plan.run_in,
            max(self.plan.fmax, excited_by_meshes(self.point)),
            only_energy=bool(self.options.excitations) or self._too_short,
        )

    @property
    def _too_short(self) -> bool:
        return self.plan.duration < self.plan.least_duration * (1.0 - 1e-9)

    def _length_warning(self) -> tuple[str, ...]:
        if not self._too_short or self.options.excitations:
            return ()
        return (
            f"{self.plan.duration:.3g} s are too short to hold mean mesh forces against statics, "
            "and to tell what grows from what has not died out: --duration "
            f"{_rounded_up(self.plan.least_duration):g} or more would do",
        )

    def _record(self, direction: str) -> TransientRecord:
        """The run, forwards or with the excitations (not the preload) reversed."""
        static, dynamic, sign = self.plan.static, self.plan.dynamic, 1.0
        excitations = self.options.excitations
        if direction == BACKWARD:
            excitations = tuple(reversed_excitation(excitation) for excitation in excitations)
            sign = -1.0
        point = self.point
        gears = (
            ("mesh_forces", "contact", "energy", "work") if direction == FORWARD and point else ()
        )
        return self._kept(
            self.store and self.store / direction,
            lambda store: simulate(
                build_drivetrain(self.drivetrain, point.laws if point else None),
                (*excitations, *(point.loads if point else ())),
                duration=self.plan.duration,
                integrator=self.plan.integrator,
                sampling_frequency=self.plan.sampling_frequency,
                start_state=(static + sign * dynamic[0], sign * dynamic[1]),
                responses=self.options.responses,
                record=(*RECORDED, *gears),
                store=store,
                progress=lambda _, done, total: self.progress(_named(direction), done, total),
            ),
        )

    def _kept(
        self, store: Path | None, run: Callable[[Path | None], TransientRecord]
    ) -> TransientRecord:
        """A run that goes on from what is kept of it; from the start, where that does not fit."""
        try:
            return run(store)
        except StoredRunError as error:
            assert store is not None
            self.computed_again.append(f"what was kept of the run is computed again: {error}")
            remove_run(store)
            return run(store)

    def _frfs(self, record: TransientRecord) -> tuple[tuple[EstimatedFrfs, ...], str, float | None]:
        """FRFs beside FBS', or why there are none, and geometry's even-order share."""
        options = self.options
        moving: tuple[str, ...] = ()
        if options.excitations:
            dofs = [excitation.dof for excitation in options.excitations]
            moving = responding(self.linear, record.labels, dofs, _band(options.excitations))
        if not options.excitations:
            return (), "nothing excites from outside", None
        if self.point is not None and self.point.mesh_frequencies:
            why = "the meshes excite as well, and their force is no input that can be measured"
            return (), why, None
        if not moving:
            return (), "no response moves under these forces, by symmetry", None
        backward = None
        if options.reverse:
            backward = self.clock.timed("reversed run", lambda: self._record(BACKWARD))
        reason = ""
        for quantity in _quantities(options.excitations):
            measured, share = self._measured(record, backward, moving, quantity)
            try:
                estimates = estimate_frfs(measured, options.excitations)
            except FbsError as error:
                reason = str(error)
                continue
            integrator = record.integrator
            power = measured.inputs.var(axis=0)
            frfs = [
                compare_with_fbs(
                    unbent(e, integrator),
                    self.drivetrain,
                    power if len(estimates) == 1 else None,
                    self.point,
                )
                for e in estimates
            ]
            return tuple(frfs), "", share
        return (), reason, None

    def _measured(
        self,
        record: TransientRecord,
        backward: TransientRecord | None,
        outputs: tuple[str, ...],
        quantity: Quantity,
    ) -> tuple[Record, float | None]:
        """Forces and the motion that changes sign with them, after the run-in."""
        inputs = tuple(dict.fromkeys(excitation.dof for excitation in self.options.excitations))
        first, what = round(self.plan.run_in * record.sampling_frequency), quantity.derivative
        columns = [record.labels.index(label) for label in outputs]
        forward = getattr(record, RECORDED[what])[first:]
        share = None
        if backward is None:
            motion = channels(forward, columns, self.store)
        else:
            reverse = getattr(backward, RECORDED[what])[first:]
            motion, share = odd_channels(forward, reverse, columns, self.store)
        rows = [record.excitations.index(dof) for dof in inputs]
        forces = channels(record.forces[first:], rows, self.store)
        return Record(record.sampling_frequency, forces, motion, inputs, outputs, quantity), share

    def _levels(self, factors: tuple[float, ...]) -> DriveLevels:
        return drive_levels(
            self.drivetrain,
            self.options.excitations[0],
            factors,
            self.plan.integrator,
            self.plan.sampling_frequency,
            self.options.responses or self.linear.dofs,
            self.point,
            self.progress,
            reverse=self.options.reverse,
        )

    def _hints(self, checks: tuple[Check, ...]) -> tuple[str, ...]:
        """What a tenth of the force makes of a disagreement."""
        if all(check.agrees for check in checks) or self.options.levels:
            return ()
        if len(self.options.excitations) > 1 or not isinstance(
            self.options.excitations[0].signal, Multisine
        ):
            return (
                "A record that is cut off leaks: run longer (--duration). Geometry falls with the "
                "force: a multisine with --levels tells it.",
            )
        lower, here = self._levels((LOWER,)).levels[0].worst_db, checks[0].value
        if lower < here / 2.0:
            return (
                f"At a tenth of the force the largest difference is {lower:.2g} dB instead of "
                f"{here:.2g} dB: at this level the drivetrain is not linear, and FBS does not "
                "apply to every line.",
            )
        if lower > here * 2.0:
            return (
                f"At a tenth of the force the largest difference is {lower:.2g} dB, more than "
                f"{here:.2g} dB: this is round-off of the springs' forces. Excite harder.",
            )
        return (
            f"At a tenth of the force the largest difference is {lower:.2g} dB, much the same: it "
            "is neither geometry nor round-off. Either the routes differ, or the record has more "
            "in it than the steady state (--duration).",
        )


def _rounded_up(value: float) -> float:
    """To two digits, not below."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / unit) * unit


def _named(direction: str) -> str:
    return "time integration" + (", force reversed" if direction == BACKWARD else "")


def _operating_point(drivetrain: Drivetrain, options: Options) -> OperatingPoint | None:
    """The operating point asked for, or the model file's; None: unloaded and at rest.

    A speed of 0 asks for the FRFs of the drivetrain at rest, under the torque if there is one.
    """
    operation = drivetrain.operation
    if options.speed_rpm == 0.0 and not options.torque:
        torque = None if operation is None else operation.torque
        if not torque or options.torque == 0.0:
            return None
    asked = options.speed_rpm is not None or options.torque is not None
    given = operation is not None and (operation.speed is not None or operation.torque is not None)
    if not asked and not given:
        return None
    return operating_point(drivetrain, speed_rpm=options.speed_rpm, torque=options.torque)


def _band(excitations: tuple[Excitation[Signal], ...]) -> tuple[float, float]:
    bands = [excitation.signal.band for excitation in excitations]
    return min(first for first, _ in bands), max(last for _, last in bands)


def _quantities(excitations: tuple[Excitation[Signal], ...]) -> tuple[Quantity, ...]:
    """What FRFs are estimated from, in order of preference.

    A free drivetrain's displacement drifts away and has no spectrum. In a steady state its velocity
    has one, with less of the springs' round-off at low frequency than its acceleration; under noise
    only its acceleration does not drift. Of what ends, the first is taken that has died out by
    then: what a sharp impact folds back from above Nyquist is smallest in displacement.
    """
    signals = [excitation.signal for excitation in excitations]
    if all(signal.duration is not None for signal in signals):
        return Quantity.RECEPTANCE, Quantity.MOBILITY, Quantity.ACCELERANCE
    if all(isinstance(signal, Multisine) for signal in signals):
        return (Quantity.MOBILITY,)
    return (Quantity.ACCELERANCE,)

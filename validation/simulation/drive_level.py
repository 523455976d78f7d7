"""FRF against drive level: up to which force the drivetrain is linear, and FBS applies.

A gearbox is linear at small motion only. Driven harder, its lines of action tilt as centres move,
carriers turn the frames of their planets, and teeth lift off where there is backlash. The FRF from
a multisine, forwards and reversed, is then the best linear approximation at that level; where it
leaves FBS' FRF, substructuring by FRFs no longer applies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fbs import Frf, Quantity, Record
from mbs_models.gears.operating_point import OperatingPoint
from mbs_models.integration.integrators import Integrator
from mbs_models.integration.periodic_orbit import periodic_response
from mbs_models.integration.time_integration import SimulationError
from mbs_models.model.excitation import Excitation
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Multisine, Signal
from mbs_models.system.drivetrain import MultibodySystem, build_drivetrain
from mbs_models.system.linearization import linearize

from ..errors import CommandError
from ..runtime.progress import Progress, silent
from .estimates import DECIBEL_TOLERANCE, EstimatedFrfs, compare_with_fbs, multisine_frf, unbent

PERIODS = 3  # the orbit is the linear one at first; two periods to bend it, one to measure
# A motion that differs by this much from one period to the next is none that an FRF describes.
REPEATS = 1e-2


@dataclass(frozen=True, eq=False)
class Level:
    """What was found at one level.

    Attributes
    ----------
    factor
        Of the excitation as given.
    peak_force, rms_force
        Of the excitation (N).
    estimated
        FRFs beside FBS'; None where the motion diverged.
    period_change
        How much the last period differs from the one before, of the motion's RMS.
    """

    factor: float
    peak_force: float
    rms_force: float
    estimated: EstimatedFrfs | None
    period_change: float

    @property
    def worst_db(self) -> float:
        """Largest difference of any line and response (dB); infinite where it diverged."""
        return np.inf if self.estimated is None else float(self.estimated.decibels.max())

    @property
    def median_db(self) -> float:
        """Median difference over the lines compared (dB)."""
        if self.estimated is None:
            return np.inf
        return self.estimated.median_db

    @property
    def repeats(self) -> bool:
        """Whether the motion is periodic."""
        return self.period_change <= REPEATS


@dataclass(frozen=True, eq=False)
class DriveLevels:
    """FRFs at several levels of one excitation, by rising level."""

    excitation: Excitation[Multisine]
    levels: tuple[Level, ...]

    @property
    def linear(self) -> tuple[Level, ...]:
        """The first levels in a row that agree; motions below may drown in round-off."""
        agrees = [level.repeats and level.worst_db <= DECIBEL_TOLERANCE for level in self.levels]
        if not any(agrees):
            return ()
        first = agrees.index(True)
        last = agrees.index(False, first) if False in agrees[first:] else len(agrees)
        return self.levels[first:last]

    @property
    def linear_up_to(self) -> Level | None:
        """The last of them; None: none agrees."""
        return self.linear[-1] if self.linear else None

    @property
    def conclusion(self) -> str:
        """In a sentence, up to where FBS applies."""
        last, allowed = self.linear_up_to, f"{DECIBEL_TOLERANCE:g} dB"
        if last is None:
            return (
                f"Already at the lowest level, {self.levels[0].peak_force:.3g} N (peak), the FRFs "
                f"are off by {_decibels(self.levels[0])}: the drivetrain is not linear there, and "
                "FBS does not apply."
            )
        if last is self.levels[-1]:
            return (
                f"From {self.linear[0].peak_force:.3g} to {last.peak_force:.3g} N (peak) the FRFs "
                f"stay within {allowed} of FBS: linear at every one of these levels."
            )
        beyond = self.levels[self.levels.index(last) + 1]
        return (
            f"FBS applies up to {last.peak_force:.3g} N (peak) at {self.excitation.dof}: at "
            f"{beyond.peak_force:.3g} N the FRFs are off by {_decibels(beyond)}, more than "
            f"{allowed}, and FBS no longer applies."
        )


def _decibels(level: Level) -> str:
    if level.estimated is None:
        return "any amount (the motion diverged)"
    if not level.repeats:
        return f"{level.worst_db:.3g} dB, without the motion even repeating"
    return f"{level.worst_db:.3g} dB"


def drive_levels(
    drivetrain: Drivetrain,
    excitation: Excitation[Signal],
    factors: Sequence[float],
    integrator: Integrator,
    sampling_frequency: float,
    responses: Sequence[str],
    point: OperatingPoint | None = None,
    progress: Progress = silent,
    *,
    reverse: bool = True,
) -> DriveLevels:
    """Run a multisine at several levels, each from the linear orbit at that level.

    Parameters
    ----------
    drivetrain
        With its damping.
    excitation
        A multisine at a DoF.
    factors
        What its amplitudes are multiplied by.
    integrator, sampling_frequency
        As for `simulate`; the period must be a whole number of samples.
    responses
        DoFs.
    point
        Preload and backlash; meshes that vary in time are refused, for they excite by themselves.
    reverse
        Whether each level is run with the force reversed as well, which takes out what does not
        change its sign.

    Raises
    ------
    CommandError
        The excitation is no multisine, or the meshes vary.
    """
    signal = check_levels((excitation,), point)
    system = build_drivetrain(drivetrain, point.laws if point else None)
    results = []
    for number, factor in enumerate(sorted(factors)):
        scaled = Excitation(excitation.dof, replace(signal, amplitudes=factor * signal.amplitudes))
        progress("drive levels", number, len(factors))
        results.append(
            _level(
                drivetrain,
                system,
                scaled,
                factor,
                integrator,
                sampling_frequency,
                responses,
                point,
                reverse,
            )
        )
    progress("drive levels", len(factors), len(factors))
    return DriveLevels(Excitation(excitation.dof, signal), tuple(results))


def check_levels(
    excitations: Sequence[Excitation[Signal]], point: OperatingPoint | None
) -> Multisine:
    """The multisine whose level may be varied.

    Raises
    ------
    CommandError
        There is not exactly one excitation, it is no multisine, or the meshes vary.
    """
    if point is not None and point.speed_rpm:
        raise CommandError("--levels: needs meshes that do not vary; leave --speed out")
    if len(excitations) != 1:
        raise CommandError(
            f"--levels: needs one multisine, {len(excitations)} excitations are given; add "
            "--excitation multisine@DOF, or leave the others out"
        )
    (excitation,) = excitations
    signal = excitation.signal
    if not isinstance(signal, Multisine):
        raise CommandError(
            f"--levels: the excitation at {excitation.dof} is no multisine; only its FRF is free "
            "of leakage at every level"
        )
    return signal


def _level(
    drivetrain: Drivetrain,
    system: MultibodySystem,
    excitation: Excitation[Multisine],
    factor: float,
    integrator: Integrator,
    sampling_frequency: float,
    responses: Sequence[str],
    point: OperatingPoint | None,
    reverse: bool,
) -> Level:
    signal = excitation.signal
    size = round(signal.period * sampling_frequency)
    force = signal.samples(size)
    levels = float(np.abs(force).max()), float(np.sqrt(np.mean(force**2)))
    try:
        velocity = periodic_response(
            system,
            point.linear if point else linearize(system),
            excitation,
            integrator,
            sampling_frequency=sampling_frequency,
            periods=PERIODS,
            loads=point.loads if point else (),
            static=point.displacement if point else None,
            responses=responses,
            reverse=reverse,
        ).velocity
    except SimulationError:
        return Level(factor, *levels, None, np.inf)
    steady = Record(
        sampling_frequency,
        force[:, None],
        velocity[-size:],
        (excitation.dof,),
        tuple(responses),
        Quantity.MOBILITY,
    )
    before = velocity[-2 * size : -size]
    change = np.abs(velocity[-size:] - before).max() / np.sqrt(np.mean(before**2))
    estimate = multisine_frf(steady, signal)
    return Level(
        factor,
        *levels,
        compare_with_fbs(unbent(estimate, integrator), drivetrain, point=point),
        float(change),
    )


def frf_of(levels: DriveLevels) -> Frf | None:
    """FBS' FRF that all levels are held against; None where the motion diverged at every one."""
    return next(
        (level.estimated.reference for level in levels.levels if level.estimated is not None), None
    )

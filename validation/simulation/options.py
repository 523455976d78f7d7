"""The options of a run, and how the command line's are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mbs_models.model.excitation import Excitation, excitations_of
from mbs_models.model.parameters import Drivetrain
from mbs_models.signals.lines import Multisine, Signal
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import round_off_force

from ..errors import CommandError
from ..routes.source import exudyn_source
from ..routes.time_domain import even_amplitudes, with_damping
from .excitation_spec import parse_excitation

# The excitation of a run that names none: lines at odd multiples of 5 Hz up to 4 kHz. Geometry's
# even-order share falls between them, on the even ones.
SPACING, HIGHEST = 5.0, 4000.0
# m at each line of the DoF that moves most: geometry is linear at the first. Where a line's force
# would not stand out of the round-off of the springs' own, it is more, up to the second.
DISPLACEMENT, MOST_DISPLACEMENT = 1e-8, 1e-6
ABOVE_ROUND_OFF = 100.0

MOST_LEVELS = 100


@dataclass(frozen=True)
class Options:
    """The options of a run; None leaves the choice to the run.

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


def chosen_excitations(
    drivetrain: Drivetrain,
    specs: Sequence[str],
    *,
    folder: Path,
    duration: float | None,
    sampling_frequency: float | None,
    turning: bool,
    fmax: float | None = None,
) -> tuple[Excitation[Signal], ...]:
    """Excitations of the command line, else the model file's, else a multisine at the first DoF.

    Parameters
    ----------
    drivetrain
        Whose they are.
    specs
        As typed, each TYPE@DOF:key=value,….
    folder
        Where relative paths start.
    duration, sampling_frequency
        Of the record, if they are decided (s, Hz).
    turning
        Whether a speed is asked for: then nothing else need excite.
    fmax
        End of the band of interest (Hz), as far as one is asked for.

    Raises
    ------
    CommandError, ModelError
        A spec cannot be read, or its values are not allowed.
    """
    if specs:
        tables = tuple(parse_excitation(spec) for spec in specs)
        drivetrain = drivetrain.model_copy(update={"excitations": tables})
    if drivetrain.excitations:
        return excitations_of(
            drivetrain,
            folder=folder,
            duration=duration,
            sampling_frequency=sampling_frequency,
        )
    return () if turning else (default_excitation(drivetrain, fmax),)


def default_excitation(drivetrain: Drivetrain, fmax: float | None = None) -> Excitation[Multisine]:
    """A multisine at the first DoF under which every line moves the drivetrain alike.

    As gently as round-off lets, since geometry is linear in small motions only.
    """
    system = exudyn_source(with_damping(drivetrain)).whole
    dof = system.dofs[0]
    highest = HIGHEST if fmax is None else min(fmax, HIGHEST)
    harmonics = np.arange(1, max(int(highest / SPACING), 1) + 1, 2)
    order = np.arange(len(harmonics))
    amplitudes = even_amplitudes(system, dof, np.asarray(SPACING * harmonics), DISPLACEMENT)
    least = ABOVE_ROUND_OFF * round_off_force(build_drivetrain(drivetrain))
    amplitudes *= np.clip(least / amplitudes.min(), 1.0, MOST_DISPLACEMENT / DISPLACEMENT)
    phases = -np.pi * order * (order - 1) / len(order)  # Schroeder's
    return Excitation(dof, Multisine(1.0 / SPACING, harmonics, amplitudes, phases))


def turns(drivetrain: Drivetrain, options: Options) -> bool:
    """Whether a speed is asked for, here or by the model file."""
    given = drivetrain.operation.speed if drivetrain.operation else None
    return bool(given if options.speed_rpm is None else options.speed_rpm)


def parse_levels(text: str | None) -> tuple[float, ...]:
    """Factors from 1,10,100 or 1:1000:7log.

    Raises
    ------
    CommandError
        They cannot be read, or are not above 0.
    """
    if text is None:
        return ()
    try:
        levels = _range(text) if ":" in text else [float(level) for level in text.split(",")]
    except ValueError:
        levels = []
    if not levels:
        raise CommandError(f"--levels = {text!r}: must be 1,10,100 or 1:1000:7log")
    if len(levels) > MOST_LEVELS:
        raise CommandError(f"--levels = {text!r}: at most {MOST_LEVELS} levels are possible")
    if not all(np.isfinite(level) and level > 0.0 for level in levels):
        raise CommandError(f"--levels = {text!r}: every level must be finite and above 0")
    return tuple(levels)


def _range(text: str) -> list[float]:
    """Levels of a:b:N or a:b:Nlog; the ends themselves where they have no logarithm."""
    first, last, number = text.removesuffix("log").split(":")
    ends = float(first), float(last)
    if not all(np.isfinite(end) and end > 0.0 for end in ends):
        return list(ends)
    space = np.geomspace if text.endswith("log") else np.linspace
    return [float(level) for level in space(*ends, min(int(number), MOST_LEVELS + 1))]

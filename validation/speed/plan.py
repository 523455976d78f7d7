"""What is asked of a speed study, checked and complete before anything is computed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mbs_models.errors import ModelError
from mbs_models.modal.mode_kinds import label_inertias
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..errors import CommandError

DEFAULT_SPEEDS = 300
MOST_HARMONICS = 200
MOST_SPEEDS = 100_000
SPECIFIED = "must be FROM:TO:STEP, as 0:3000:10, or a list, as 600,900 (rpm)"


@dataclass(frozen=True, eq=False)
class SpeedPlan:
    """A speed study as laid out.

    Attributes
    ----------
    drivetrain
        What turns.
    speeds
        (n_speed,) of the input, ascending, above 0 (rpm).
    torque
        At the input (N m).
    responses
        DoFs whose acceleration is shown; None: all, empty: the loudest of every body.
    harmonics
        Of each mesh frequency.
    checked
        SteadyStates (rpm) at which exudyn's time integration is the reference.
    is_range
        Whether the speeds stand for all between them.
    notes
        What was left out or assumed.
    """

    drivetrain: Drivetrain
    speeds: FloatArray
    torque: float
    responses: tuple[str, ...] | None = ()
    harmonics: int = 10
    checked: tuple[float, ...] = ()
    is_range: bool = False
    notes: tuple[str, ...] = ()

    @property
    def input(self) -> str:
        """The body whose speed it is."""
        assert self.drivetrain.operation is not None
        return self.drivetrain.operation.input

    def with_note(self, note: str) -> SpeedPlan:
        """With one note more."""
        return replace(self, notes=(*self.notes, note))


def plan(
    drivetrain: Drivetrain,
    *,
    speed: str | None = None,
    torque: float | None = None,
    responses: Sequence[str] | None = (),
    harmonics: int = 10,
    check: str | None = None,
) -> SpeedPlan:
    """Lay a speed study out.

    Parameters
    ----------
    drivetrain
        With an ``[operation]`` table.
    speed, check
        As typed: FROM:TO:STEP or a list of speeds (rpm).
    torque
        At the input (N m); None: the table's, or none.
    responses, harmonics
        See `SpeedPlan`.

    Raises
    ------
    ModelError
        There is no ``[operation]``.
    CommandError
        SteadyStates cannot be read, the torque is not finite, or a DoF is unknown.
    """
    operation = drivetrain.operation
    if operation is None:
        raise ModelError(
            f"{drivetrain.name}: no [operation] table; a speed study needs its input and "
            "speed_range (and torque)"
        )
    if not 1 <= harmonics <= MOST_HARMONICS:
        raise CommandError(f"--harmonics = {harmonics}: must be from 1 to {MOST_HARMONICS}")
    if speed is None:
        first, last = operation.speed_range
        speeds = np.linspace(first, last, DEFAULT_SPEEDS + (first == 0.0))
    else:
        speeds = parse_speeds("--speed", speed)
    notes = []
    if speeds[0] == 0.0:
        if speed is not None:
            notes.append("0 rpm is the standstill: no mesh is passed, and it is left out")
        speeds = speeds[1:]
    if not len(speeds):
        raise CommandError("--speed = 0 rpm: no mesh is passed at a standstill; give a speed")
    moment = operation.torque if torque is None else torque
    if moment is not None and not math.isfinite(moment):
        raise CommandError(f"--torque = {moment}: must be a finite number (N m)")
    if not moment:
        notes.append(
            "no torque at the input: meshes carry no static force, a dynamic factor has nothing "
            "to refer to; give torque in [operation] or --torque"
        )
    _check_responses(drivetrain, responses)
    checked = () if check is None else tuple(float(n) for n in parse_speeds("--check", check))
    if 0.0 in checked:
        raise CommandError("--check: 0 rpm is a standstill; give speeds above 0")
    return SpeedPlan(
        drivetrain,
        speeds,
        moment or 0.0,
        None if responses is None else tuple(responses),
        harmonics,
        checked,
        (speed is None or ":" in speed) and len(speeds) > 1,
        tuple(notes),
    )


def parse_speeds(option: str, text: str) -> FloatArray:
    """SteadyStates (rpm), ascending, each once, of FROM:TO:STEP (the end included) or of a list.

    Raises
    ------
    CommandError
        They cannot be read, are negative, or too many.
    """
    wrong = CommandError(f"{option} = {text!r}: {SPECIFIED}")
    try:
        values = [float(item) for item in text.split(":" if ":" in text else ",")]
    except ValueError:
        raise wrong from None
    if not all(math.isfinite(value) for value in values):
        raise wrong
    if ":" in text:
        if len(values) != 3:
            raise wrong
        values = _range(option, text, *values)
    if min(values) < 0.0:
        raise CommandError(f"{option} = {text!r}: a speed must not be below 0 rpm")
    return np.unique(values)


def _range(option: str, text: str, first: float, last: float, step: float) -> list[float]:
    if step <= 0.0:
        raise CommandError(f"{option} = {text!r}: the step must be above 0 rpm, got {step:g}")
    if last < first:
        raise CommandError(f"{option} = {text!r}: the range must not end below its beginning")
    count = math.floor((last - first) / step * (1.0 + 1e-12)) + 1
    if count > MOST_SPEEDS:
        raise CommandError(
            f"{option} = {text!r}: {count} speeds; at most {MOST_SPEEDS}: give a larger step"
        )
    return [first + number * step for number in range(count)]


def _check_responses(drivetrain: Drivetrain, responses: Sequence[str] | None) -> None:
    known = label_inertias(drivetrain)
    for label in responses or ():
        if label not in known:
            raise CommandError(f"--response = {label!r}: no such DoF; known: {', '.join(known)}")

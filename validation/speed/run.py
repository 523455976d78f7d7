"""The study: from a plan to its result."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from mbs_models.gears.orders import orders
from mbs_models.gears.resonances import Margin, margins
from mbs_models.modal.energy import component_shares
from mbs_models.modal.mode_kinds import Modes
from mbs_models.modal.modes import drivetrain_modes

from ..arrays import FloatArray
from ..errors import CommandError
from ..runtime.clock import Clock
from ..runtime.executors import Workers
from ..runtime.pieces import Work, computed
from ..runtime.progress import Progress, silent
from .checks import steady_checks
from .findings import loose_meshes, loudest_dofs, partings, peaks
from .instability import unstable_ranges
from .plan import SpeedPlan
from .resonance_speeds import resonance_speeds
from .result import SpeedResult
from .steady import SpeedSystem, SteadyStates, evaluate, failed, joined, speed_system
from .time_reference import (
    TimeReference,
    reference_checks,
    reference_warnings,
    time_reference,
    torque_hint,
)
from .turning import Turning, turning

HERE = Workers()
CHUNK = 10  # speeds handed to a worker at a time
WORTH_A_PROCESS = 100  # speeds, before a process more is worth its start
LOWER = 0.1  # of the torque, to see whether a difference falls with it
TRUNCATED = 0.01  # of the vibration: what the choice of lines may miss before it is warned of


def processes_worth(plan: SpeedPlan) -> int:
    """How many processes the speeds are worth."""
    return max(1, min(os.cpu_count() or 1, len(plan.speeds) // WORTH_A_PROCESS))


def run(
    plan: SpeedPlan,
    workers: Workers = HERE,
    progress: Progress = silent,
    warn: Callable[[str], None] = lambda _: None,
) -> SpeedResult:
    """Compute the steady state at every speed, and say what stands out.

    Parameters
    ----------
    plan
        What is asked.
    workers
        Who computes the speeds.
    progress
        Told a step's name, how far it is, and how far it goes.
    warn
        Told of lost workers.

    Raises
    ------
    ModelError, FbsError, CommandError
        There is no operating point, or no steady state at any speed.
    """
    clock = Clock()
    turns = clock.timed("building", lambda: turning(plan))
    modes = clock.timed("modes", lambda: drivetrain_modes(plan.drivetrain))
    energies = component_shares(turns.parts, modes)
    near = _margins(plan, turns, modes)
    if turns.lattice is None:
        return SpeedResult(
            turns, None, modes, energies,
            margins=near, warnings=(*_given(plan), *_unchecked(plan)), seconds=clock.seconds,
        )  # fmt: skip
    speeds = np.union1d(plan.speeds, [*_operating_speed(plan), *resonance_speeds(turns, modes)])
    states = clock.timed(
        "steady states", lambda: _states(speed_system(turns), speeds, workers, progress, warn)
    )
    if not states.ok.any():
        raise CommandError(f"no speed has a steady state: {states.status[0]}")
    references = clock.timed("time integration", lambda: _references(turns, progress))
    hints = clock.timed("a tenth of the torque", lambda: _hints(turns, references, progress))
    return SpeedResult(
        turning=turns,
        states=states,
        modes=modes,
        energies=energies,
        responses=_responses(plan, turns, states),
        peaks=peaks(turns, states, modes),
        unstable=unstable_ranges(turns, states),
        partings=partings(turns, states),
        margins=near,
        references=references,
        checks=(*steady_checks(turns, states), *reference_checks(references)),
        warnings=(
            *_given(plan),
            *loose_meshes(turns),
            *_warnings(states),
            *reference_warnings(references),
            *hints,
        ),
        seconds=clock.seconds,
    )


def _operating_speed(plan: SpeedPlan) -> tuple[float, ...]:
    """The model's own speed (rpm), where a range that includes it would step over it."""
    operation = plan.drivetrain.operation
    if operation is None or operation.speed is None or not plan.is_range:
        return ()
    speed = abs(operation.speed)
    step = float(np.diff(plan.speeds).max())
    return (speed,) if plan.speeds[0] <= speed <= plan.speeds[-1] + step else ()


def _states(
    system: SpeedSystem,
    rpm: FloatArray,
    workers: Workers,
    progress: Progress,
    warn: Callable[[str], None],
) -> SteadyStates:
    work = Work(
        partial(evaluate, system),
        joined,
        lambda speed, why: failed(system, (speed,), why),
        "speeds",
    )
    speeds = [float(speed) for speed in rpm]
    pieces = {str(k): tuple(speeds[k : k + CHUNK]) for k in range(0, len(speeds), CHUNK)}
    done, parts = 0, []
    progress("steady states", done, len(speeds))
    for _, part in computed(work, pieces, workers, warn):
        parts.append(part)
        done += len(part.rpm)
        progress("steady states", done, len(speeds))
    return joined(parts)


def _references(turns: Turning, progress: Progress) -> tuple[TimeReference, ...]:
    return tuple(time_reference(turns, speed, progress) for speed in turns.plan.checked)


def _hints(
    turns: Turning, references: tuple[TimeReference, ...], progress: Progress
) -> tuple[str, ...]:
    """What a tenth of the torque makes of disagreements; with play, teeth would part there."""
    plan = turns.plan
    if not plan.torque or any(law.backlash for law in turns.point.laws.values()):
        return ()
    wrong = [
        reference
        for reference in references
        if not all(check.agrees for check in reference_checks((reference,)))
    ]
    if not wrong:
        return ()
    lower = turning(replace(plan, torque=LOWER * plan.torque))
    return tuple(
        torque_hint(each, time_reference(lower, each.speed_rpm, progress), LOWER) for each in wrong
    )


def _responses(plan: SpeedPlan, turns: Turning, states: SteadyStates) -> tuple[str, ...]:
    if plan.responses is None:
        return turns.parts.dofs
    return plan.responses or loudest_dofs(turns.parts, states)


def _margins(plan: SpeedPlan, turns: Turning, modes: Modes) -> tuple[Margin, ...]:
    operation = plan.drivetrain.operation
    if operation is None or operation.speed is None:
        return ()
    known = orders(plan.drivetrain, turns.parts)
    return margins(known, modes, turns.parts, operation.speed)


def _given(plan: SpeedPlan) -> tuple[str, ...]:
    return (*plan.drivetrain.warnings(), *plan.notes)


def _unchecked(plan: SpeedPlan) -> tuple[str, ...]:
    if not plan.checked:
        return ()
    return ("--check: nothing vibrates, exudyn in time was not run",)


def _warnings(states: SteadyStates) -> tuple[str, ...]:
    warnings = []
    for why in dict.fromkeys(states.status[~states.ok].tolist()):
        speeds = states.rpm[states.status == why]
        warnings.append(f"{len(speeds)} speeds from {speeds[0]:.5g} rpm on: {why}")
    missed = float(np.nanmax(states.truncation))
    if missed > TRUNCATED:
        at = float(states.rpm[int(np.nanargmax(states.truncation))])
        warnings.append(
            f"the lines chosen miss up to {100.0 * missed:.2g} % of the vibration "
            f"(at {at:.5g} rpm); more harmonics (--harmonics) have more of it"
        )
    return tuple(warnings)

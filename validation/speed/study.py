"""The study: from a plan to what its report says."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mbs_models.gears.orders import orders
from mbs_models.gears.resonances import Margin, margins
from mbs_models.modal.energy import ComponentShares, component_shares
from mbs_models.modal.mode_kinds import Modes
from mbs_models.modal.modes import drivetrain_modes

from ..checks.check import Check
from ..errors import CommandError
from ..runtime.executors import Workers
from ..runtime.pieces import Work, computed
from .checks import steady_checks
from .findings import Parting, Peak, loose_meshes, loudest_dofs, partings, peaks
from .instability import Unstable, unstable_ranges
from .plan import SpeedPlan
from .resonance_speeds import resonance_speeds
from .steady import Speeds, Task, evaluate, failed, joined, task
from .turning import Turning, turning
from .witness import ROUTES as WITNESS_ROUTES
from .witness import Witness, torque_hint, witness, witness_checks, witness_warnings

FloatArray = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

T = TypeVar("T")

HERE = Workers()
CHUNK = 10  # speeds handed to a worker at a time
WORTH_A_PROCESS = 100  # speeds, before a process more is worth its start
LOWER = 0.1  # of the torque, to see whether a difference falls with it
TRUNCATED = 0.01  # of the vibration: what the choice of lines may miss before it is warned of


@dataclass(frozen=True, eq=False)
class SpeedResult:
    """What a speed study finds.

    Attributes
    ----------
    turning
        What turns: plan, operating point, meshes, lines.
    found
        Steady states and growth rates, speed by speed; None where nothing excites.
    modes, energies
        The drivetrain's, by which resonances are named.
    responses
        DoFs whose acceleration is shown.
    peaks, unstable, partings
        What stands out.
    margins
        The nearest resonances at the operating speed of the model file; empty without one.
    witnesses
        exudyn's time integration beside the steady state.
    checks, warnings
        Verdicts, and what to mind.
    seconds
        How long each step took.
    """

    turning: Turning
    found: Speeds | None
    modes: Modes
    energies: ComponentShares
    responses: tuple[str, ...] = ()
    peaks: tuple[Peak, ...] = ()
    unstable: tuple[Unstable, ...] = ()
    partings: tuple[Parting, ...] = ()
    margins: tuple[Margin, ...] = ()
    witnesses: tuple[Witness, ...] = ()
    checks: tuple[Check, ...] = ()
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def witnessed(self) -> bool:
        """Whether exudyn's time integration could judge anything."""
        return any(check.routes == WITNESS_ROUTES for check in self.checks)

    @property
    def agrees(self) -> bool:
        """Whether every check agrees."""
        return all(check.agrees for check in self.checks)


def processes_worth(plan: SpeedPlan) -> int:
    """How many processes the speeds are worth."""
    return max(1, min(os.cpu_count() or 1, len(plan.speeds) // WORTH_A_PROCESS))


def run(
    plan: SpeedPlan,
    workers: Workers = HERE,
    progress: Progress = lambda _, done, total: None,
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
    clock = _Clock()
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
    found = clock.timed(
        "steady states", lambda: _speeds(task(turns), speeds, workers, progress, warn)
    )
    if not found.ok.any():
        raise CommandError(f"no speed has a steady state: {found.status[0]}")
    witnesses = clock.timed("time integration", lambda: _witnesses(turns, progress))
    hints = clock.timed("a tenth of the torque", lambda: _hints(turns, witnesses, progress))
    return SpeedResult(
        turning=turns,
        found=found,
        modes=modes,
        energies=energies,
        responses=_responses(plan, turns, found),
        peaks=peaks(turns, found, modes),
        unstable=unstable_ranges(turns, found),
        partings=partings(turns, found),
        margins=near,
        witnesses=witnesses,
        checks=(*steady_checks(turns, found), *witness_checks(witnesses)),
        warnings=(
            *_given(plan),
            *loose_meshes(turns),
            *_warnings(found),
            *witness_warnings(witnesses),
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


def _speeds(
    todo: Task,
    rpm: FloatArray,
    workers: Workers,
    progress: Progress,
    warn: Callable[[str], None],
) -> Speeds:
    work = Work(
        partial(evaluate, todo),
        joined,
        lambda speed, why: failed(todo, (speed,), why),
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


def _witnesses(turns: Turning, progress: Progress) -> tuple[Witness, ...]:
    return tuple(witness(turns, speed, progress) for speed in turns.plan.checked)


def _hints(turns: Turning, witnesses: tuple[Witness, ...], progress: Progress) -> tuple[str, ...]:
    """What a tenth of the torque makes of disagreements; with play, teeth would part there."""
    plan = turns.plan
    if not plan.torque or any(law.backlash for law in turns.point.laws.values()):
        return ()
    wrong = [w for w in witnesses if not all(check.agrees for check in witness_checks((w,)))]
    if not wrong:
        return ()
    lower = turning(replace(plan, torque=LOWER * plan.torque))
    return tuple(torque_hint(w, witness(lower, w.speed_rpm, progress), LOWER) for w in wrong)


def _responses(plan: SpeedPlan, turns: Turning, found: Speeds) -> tuple[str, ...]:
    if plan.responses is None:
        return turns.parts.dofs
    return plan.responses or loudest_dofs(turns.parts, found)


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


def _warnings(found: Speeds) -> tuple[str, ...]:
    told = []
    for why in dict.fromkeys(found.status[~found.ok].tolist()):
        speeds = found.rpm[found.status == why]
        told.append(f"{len(speeds)} speeds from {speeds[0]:.5g} rpm on: {why}")
    missed = float(np.nanmax(found.truncation))
    if missed > TRUNCATED:
        at = float(found.rpm[int(np.nanargmax(found.truncation))])
        told.append(
            f"the lines chosen miss up to {100.0 * missed:.2g} % of the vibration "
            f"(at {at:.5g} rpm); more harmonics (--harmonics) have more of it"
        )
    return tuple(told)


class _Clock:
    """Seconds by step."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def timed(self, name: str, step: Callable[[], T]) -> T:
        """Run a step and note how long it took."""
        began = perf_counter()
        result = step()
        self.seconds[name] = perf_counter() - began
        return result

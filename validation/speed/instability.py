"""Parametric instability over the speed range, and which tongue each unstable range is.

Floquet multipliers say where motions grow; to first order in the variation (`routes.floquet`)
harmonic l of a mesh frequency makes modes p and q unstable around l f_mesh = f_p + f_q.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mbs_models.contact.mesh_excitation import CONSTANT

from ..errors import CommandError
from ..routes.floquet import Tongue, parametric_system, tongues
from .findings import GROWING, SpeedRange, ranges
from .steady import SteadyStates
from .turning import Turning

HIGHEST = 2e4  # Hz; modes above are not named, unless a mesh reaches them with its harmonics
WITHIN = (
    2.0  # half widths from its centre a tongue may explain: damping narrows, second order moves
)


@dataclass(frozen=True)
class StageTongue:
    """A tongue of a stage's mesh frequency, as input speeds (rpm)."""

    stage: str
    tongue: Tongue
    centre: float
    half_width: float

    @property
    def description(self) -> str:
        """As ``2 × mesh reducer ≈ 1320 + 1320 Hz``."""
        first, second = self.tongue.modes
        times = f"{self.tongue.harmonic} × " if self.tongue.harmonic > 1 else ""
        return f"{times}mesh {self.stage} at {first:.5g} + {second:.5g} Hz"


@dataclass(frozen=True)
class Unstable:
    """Neighbouring speeds at which a motion grows.

    Attributes
    ----------
    range
        Of the speeds computed.
    fastest, growth
        Where it grows fastest (rpm), and how (1/s).
    tongue
        Which one it is; None where none to first order is near.
    """

    range: SpeedRange
    fastest: float
    growth: float
    tongue: StageTongue | None


def unstable_ranges(turning: Turning, states: SteadyStates) -> tuple[Unstable, ...]:
    """Where motions grow; their tongues."""
    slowest = float(np.min(turning.lines.fundamentals)) * states.rpm / 60.0
    growing = states.growth > GROWING * slowest
    if not growing.any():
        return ()
    known = stage_tongues(turning)
    unstable = []
    for reach in ranges(states.rpm, growing):
        inside = (states.rpm >= reach.first) & (states.rpm <= reach.last)
        at = int(np.flatnonzero(inside)[np.argmax(states.growth[inside])])
        speed = float(states.rpm[at])
        unstable.append(Unstable(reach, speed, float(states.growth[at]), _nearest(known, speed)))
    return tuple(unstable)


def _nearest(known: tuple[StageTongue, ...], speed: float) -> StageTongue | None:
    near = [t for t in known if abs(speed - t.centre) <= WITHIN * t.half_width]
    return max(near, key=lambda t: t.tongue.growth_rate, default=None)


def stage_tongues(turning: Turning) -> tuple[StageTongue, ...]:
    """Tongues of every stage whose mesh stiffness varies."""
    return tuple(_stage_tongues(turning))


def _stage_tongues(turning: Turning) -> Iterator[StageTongue]:
    plan, point = turning.plan, turning.point
    for stage in dict.fromkeys(family.stage for family in turning.families):
        own = {turning.meshes[c] for f in turning.families if f.stage == stage for c in f.columns}
        laws = {
            name: law
            for name, law in point.laws.items()
            if name in own and law.stiffness != CONSTANT
        }
        if not laws:
            continue
        frequency = point.mesh_frequencies[stage]
        highest = max(HIGHEST, plan.harmonics * frequency)
        try:
            system = parametric_system(plan.drivetrain, laws, highest_hz=highest)
        except CommandError:  # no mode up to there
            continue
        assert point.speed_rpm is not None
        per_hertz = point.speed_rpm / frequency
        for tongue in tongues(system, range(1, plan.harmonics + 1)):
            yield StageTongue(
                stage, tongue, tongue.centre * per_hertz, tongue.half_width * per_hertz
            )

"""Orders: how often meshes and shafts excite, per turn of an input shaft.

All bodies' speeds follow from one motion that strains no spring: G q = 0 with G the deflections of
all springs, and θ_input = 1. A mesh is passed z times per turn of a gear as seen from what carries
the mesh's line of action:

    parallel stage  f = z |Ω|,    planetary stage  f = z_s |Ω_s − Ω_c| = z_r |Ω_r − Ω_c|

What an order meets and comes close to is in `resonances`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from ..model.parameters import Drivetrain
from ..signals.waveforms import Waveform
from ..stages.part import Part
from ..system.components import Components
from .phasing import Phasing, phasing

ROTATION = {1: 0, 3: 2, 6: 5}  # which of a body's coordinates turns about the shaft, by their count
HARMONICS = (1, 2, 3)  # of every mesh: errors of teeth excite them whatever the model says
HIGHEST_HARMONIC = 10
TELLING_HARMONIC = 0.01  # of the largest harmonic of the same mesh law
STANDS_STILL = 1e-9  # of the input's speed


@dataclass(frozen=True)
class Order:
    """What is excited ``factor`` times per turn of the input.

    Attributes
    ----------
    name
        What to call it.
    factor
        Its frequency over the input's.
    harmonics
        Multiples of it that are looked at.
    bodies
        What a shaft's unbalance excites.
    rows
        What a stage's meshes excite: springs that push alike, each later than its row's first. In
        a planetary stage whose planets are alike a row of sun and one of ring meshes; every spring
        is a row of its own where nothing is known of the others.
    phases
        How much later the springs of every row push (mesh periods).
    phasing
        What each harmonic, from l = 1, excites; empty where no family is suppressed.
    """

    name: str
    factor: float
    harmonics: tuple[int, ...]
    bodies: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()
    phases: tuple[float, ...] = ()
    phasing: tuple[Phasing, ...] = ()

    def label(self, harmonic: int) -> str:
        """The order's name with the harmonic's number, where that is not the first."""
        return f"{self.name} ×{harmonic}" if harmonic > 1 else self.name

    def frequency(self, harmonic: int, speed_rpm: float) -> float:
        """Hz at a speed of the input, whichever way it turns."""
        return harmonic * self.factor * abs(speed_rpm) / 60.0


def speeds(parts: Components, driven: str) -> dict[str, float]:
    """Every body's speed over that of body ``driven``; empty where that cannot turn freely.

    Of all motions that strain nothing the smallest is taken: what is not driven stands still.
    """
    free = free_motions(parts)
    turns = {body: motion[ROTATION[len(motion)]] @ free for body, motion in parts.motions.items()}
    along = turns[driven]
    if not len(along) or np.linalg.norm(along) < 1e-6 * max(
        float(np.linalg.norm(row)) for row in turns.values()
    ):
        return {}
    drive = along / (along @ along)
    return {body: float(row @ drive) for body, row in turns.items()}


def free_motions(parts: Components) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Motions that strain no spring (n_dof, n), orthonormal, whatever the springs' stiffness."""
    rows = []
    for spring in parts.springs:
        values, turn = np.linalg.eigh(spring.stiffness)
        held = values > 1e-12 * values.max()
        rows.append((turn.T @ spring.deflection)[held])
    stretch = np.concatenate(rows) if rows else np.zeros((1, len(parts.dofs)))
    norms = np.linalg.norm(stretch, axis=1, keepdims=True)
    stretch = np.divide(stretch, norms, out=np.zeros_like(stretch), where=norms > 0.0)
    _, values, right = np.linalg.svd(stretch)
    rank = int(np.sum(values > 1e-10 * values.max()))
    return np.asarray(right[rank:].T)


def orders(drivetrain: Drivetrain, parts: Components) -> tuple[Order, ...]:
    """Shaft orders and, where teeth are given, mesh orders of the drivetrain's input.

    None where no operation is given, or where the input cannot turn freely.
    """
    if drivetrain.operation is None:
        return ()
    ratio = speeds(parts, drivetrain.operation.input)
    if not ratio:
        return ()
    return (*_shaft_orders(drivetrain, ratio), *_mesh_orders(drivetrain, parts, ratio))


def _shaft_orders(drivetrain: Drivetrain, ratio: Mapping[str, float]) -> Iterator[Order]:
    """One for each speed: bodies that turn equally fast are on one shaft, or as good as."""
    shafts: dict[float, list[str]] = {}
    for body in drivetrain.bodies:
        speed = abs(ratio[body])
        if speed > STANDS_STILL:
            known = (s for s in shafts if abs(s - speed) < 1e-9 * speed)
            shafts.setdefault(next(known, speed), []).append(body)
    for speed, bodies in sorted(shafts.items()):
        yield Order(f"shaft {bodies[0]}", speed, (1,), bodies=tuple(bodies))


def _mesh_orders(
    drivetrain: Drivetrain, parts: Components, ratio: Mapping[str, float]
) -> Iterator[Order]:
    springs = {spring.name for spring in parts.springs}
    for stage in drivetrain.stages:
        passed = teeth_passed(stage, ratio)
        rows = [tuple(n for n in family.names if n in springs) for family in stage.mesh_families()]
        rows = [row for row in rows if row]
        if rows and passed > STANDS_STILL:
            known, phases = _planet_set(stage)
            if not known:
                rows = [(name,) for row in rows for name in row]
            yield Order(
                f"mesh {stage.name}",
                passed,
                mesh_harmonics(stage),
                rows=tuple(rows),
                phases=phases,
                phasing=known,
            )


def _planet_set(stage: Part) -> tuple[tuple[Phasing, ...], tuple[float, ...]]:
    """What each harmonic excites, and the phases of the planets' meshes; of any stage else (0,).

    z_s ψ_n/2π of the sun's: the ring's −z_r ψ_n/2π are the same, (z_s + z_r) ψ_n/2π being whole.
    """
    for planets in stage.planet_sets():
        try:
            known = phasing(planets, HIGHEST_HARMONIC)
        except ModelError:
            continue  # planets that differ, or teeth missing: any family may be excited
        (teeth, _), first = planets.teeth, planets.angles[0]
        return known, tuple(teeth * (psi - first) / (2.0 * math.pi) for psi in planets.angles)
    return (), (0.0,)


def mesh_harmonics(stage: Part) -> tuple[int, ...]:
    """Harmonics of a stage's mesh frequency: the first three, and what its mesh laws have.

    A law has those of its first ten that are a hundredth of its largest or more.
    """
    found = set(HARMONICS)
    for law in _mesh_laws(stage):
        size = {order: abs(law.harmonic(order)) for order in range(1, HIGHEST_HARMONIC + 1)}
        least = TELLING_HARMONIC * max(size.values())
        found.update(order for order, value in size.items() if 0.0 < value >= least)
    return tuple(sorted(found))


def _mesh_laws(stage: Part) -> Iterator[Waveform]:
    """Stiffness and transmission error over a mesh period."""
    for family in stage.mesh_families():
        yield family.variation.waveform
        if family.error is not None:
            yield family.error.waveform


def teeth_passed(stage: Part, ratio: Mapping[str, float]) -> float:
    """Teeth passed per turn of the input; 0 where no teeth are given."""
    carrier = next((ratio[planets.carrier] for planets in stage.planet_sets()), 0.0)
    for member in stage.members():
        if member.teeth is not None:
            return member.teeth * abs(ratio[member.body] - carrier)
    return 0.0

"""Orders: how often meshes and shafts excite, per turn of an input shaft.

All bodies' speeds follow from one motion that strains no spring: G q = 0 with G the deflections of
all springs, and θ_input = 1. A mesh is passed z times per turn of a gear as seen from what carries
the mesh's line of action:

    parallel stage  f = z |Ω|,    planetary stage  f = z_s |Ω_s − Ω_c| = z_r |Ω_r − Ω_c|
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .components import Components, SpringKind
from .energy import ComponentShares
from .mode_kinds import Kind, Mode
from .parameters import Drivetrain, ParallelStage, PlanetaryStage

ROTATION = {1: 0, 3: 2, 6: 5}  # which of a body's coordinates turns about the shaft, by their count
HARMONICS = (1, 2, 3)
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
    bodies, springs
        What it excites: bodies (a shaft's unbalance) or springs (a stage's meshes).
    """

    name: str
    factor: float
    harmonics: tuple[int, ...]
    bodies: tuple[str, ...] = ()
    springs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Crossing:
    """Where an order meets a natural frequency.

    ``share`` is the share of the mode's energy in what the order excites: strain energy of the
    meshes, or kinetic energy of the shaft's bodies.
    """

    speed_rpm: float
    frequency_hz: float
    mode: int
    order: Order
    harmonic: int
    share: float


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
    for stage in drivetrain.stages:
        passed = teeth_passed(stage, ratio)
        if passed > STANDS_STILL:
            meshes = tuple(
                spring.name
                for spring in parts.springs
                if spring.kind is SpringKind.MESH
                and spring.ends[0].body.partition(".")[0] == stage.name
            )
            yield Order(f"mesh {stage.name}", passed, HARMONICS, springs=meshes)


def teeth_passed(stage: ParallelStage | PlanetaryStage, ratio: Mapping[str, float]) -> float:
    """Teeth passed per turn of the input; 0 where no teeth are given."""
    if isinstance(stage, ParallelStage):
        gears = {"pinion": stage.pinion.teeth, "wheel": stage.wheel.teeth}
        carrier = 0.0
    else:
        gears = {"sun": stage.sun.teeth, "ring": stage.ring.teeth, "planet1": stage.planet.teeth}
        carrier = ratio[f"{stage.name}.carrier"]
    for gear, teeth in gears.items():
        if teeth is not None:
            return teeth * abs(ratio[f"{stage.name}.{gear}"] - carrier)
    return 0.0


def crossings(
    found: Sequence[Order],
    modes: Sequence[Mode],
    shares: ComponentShares,
    speed_range: tuple[float, float],
) -> tuple[Crossing, ...]:
    """Where orders meet natural frequencies within a speed range (rpm), the largest share first."""
    first, last = speed_range
    met = []
    for order in found:
        energy = _excited(order, shares)
        for harmonic in order.harmonics:
            for number, mode in enumerate(modes):
                speed = 60.0 * mode.frequency_hz / (harmonic * order.factor)
                if mode.kind != Kind.RIGID_BODY and first <= speed <= last:
                    share = float(energy[number])
                    met.append(Crossing(speed, mode.frequency_hz, number, order, harmonic, share))
    return tuple(sorted(met, key=lambda c: (-round(c.share, 6), c.speed_rpm)))


def _excited(order: Order, shares: ComponentShares) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    bodies = [shares.bodies.index(body) for body in order.bodies]
    springs = [shares.springs.index(spring) for spring in order.springs]
    energy = shares.strain[springs].sum(axis=0) + shares.kinetic[bodies].sum(axis=0)
    return np.asarray(energy)

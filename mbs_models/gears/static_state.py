"""Static equilibrium of a preloaded drivetrain, flanks pressed: where a run begins without a jerk.

The start is linear: K q = f with the smallest |q| among a free drivetrain's equilibria. With
backlash the force of a mesh is k (δ − σ b/2), δ its deflection and σ = ±1 the flank it presses on,
or none in the gap (σ = 0): the σ are those of least energy; what then hangs loose in a gap is put
into its middle. From there Newton's method on exudyn's own residual, the meshes at their mean and
the geometry as it is under the load.

The free motions R strain nothing at any angle and under any load, so that a load that does no work
on them leaves no residual along them either: what is left there would turn the drivetrain, and is
refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contact.mesh_excitation import MeshLaw, at_mean
from ..errors import ModelError
from ..model.parameters import Drivetrain
from ..system.components import Components, Spring, SpringKind
from ..system.displaced import forces_at, linearized_at
from ..system.drivetrain import MultibodySystem, build_drivetrain
from ..system.linearization import (
    LinearizedSystem,
    coordinate_transform,
    round_off_force,
)
from .mesh_records import mesh_records
from .orders import STANDS_STILL, free_motions

FloatArray = NDArray[np.float64]

MAX_SEARCH = 100
HELD_LOOSELY = 1e-6  # share of the closed stiffness that steers the search for contact
IN_GAP = 1e-6  # of the gap: how far an open mesh may seem beyond it by round-off
SHARES = tuple(0.5**k for k in range(8))  # of a Newton step
MAX_NEWTON = 50
CARRIES_NOTHING = 1e-9  # of the load: a mesh force that is round-off
UNBALANCED = 1e-9  # of the load: work on a free motion that round-off explains
UNSTABLE = 1e-10  # of a stiffness scaled to 1: below is round-off of the free rotation
RESIDUAL = 1e-7  # of the load; round-off of the stiffest bearings leaves 1e-9


@dataclass(frozen=True)
class StaticState:
    """An equilibrium.

    Attributes
    ----------
    displacement
        (n_dof,) m.
    mesh_forces
        Force of every mesh by name (N), positive where the loaded flanks press.
    linear
        The drivetrain linearised there: meshes at their mean, open ones without stiffness.
    """

    displacement: FloatArray
    mesh_forces: Mapping[str, float]
    linear: LinearizedSystem


def linear_mesh_forces(
    linear: LinearizedSystem, parts: Components, load: FloatArray
) -> dict[str, float]:
    """Force of every mesh along δ (N) under a load, without backlash; 0 where it is round-off."""
    free = free_motions(parts)
    _check_balance(free, load)
    motion = _solve(linear.stiffness, free, load)
    nothing = CARRIES_NOTHING * float(np.abs(load).max())
    forces = {
        mesh.name: float(mesh.stiffness[0, 0] * (mesh.deflection[0] @ motion))
        for mesh in _meshes(parts)
    }
    return {name: force if abs(force) > nothing else 0.0 for name, force in forces.items()}


def static_state(
    drivetrain: Drivetrain,
    linear: LinearizedSystem,
    parts: Components,
    load: FloatArray,
    laws: Mapping[str, MeshLaw],
) -> StaticState:
    """Equilibrium under a load with all meshes at their mean.

    Parameters
    ----------
    drivetrain
        What is loaded.
    linear, parts
        The same without laws, linearised and read back.
    load
        (n_dof,) N, conjugate to the DoFs.
    laws
        Mesh → law; its backlash and flank count.

    Raises
    ------
    ModelError
        The load turns something that nothing holds, moves gears out of mesh, or no equilibrium is
        found.
    """
    if not np.any(load):
        at_rest = np.zeros(len(linear.dofs))
        return StaticState(at_rest, dict.fromkeys(laws, 0.0), linear)
    free = free_motions(parts)
    _check_balance(free, load)
    played = [mesh for mesh in _meshes(parts) if mesh.name in laws and laws[mesh.name].backlash]
    halves = np.array([0.5 * laws[mesh.name].backlash for mesh in played])
    sides = _pressed_flanks(linear.stiffness, free, played, halves, load)
    motion, free = _contact(linear, parts, load, played, sides * halves)
    _check_gaps(motion, played, sides, halves)
    pressed = {
        mesh.name: _pressed(laws[mesh.name], float(side))
        for mesh, side in zip(played, sides, strict=True)
    }
    closed = build_drivetrain(drivetrain, pressed)
    motion, left = _settle(closed, linear.mass, free, load, motion)
    residual = float(np.abs(left).max())
    # What stiff springs' forces are known to is no imbalance.
    allowed = RESIDUAL * float(np.abs(load).max()) + round_off_force(closed)
    if not residual <= allowed:
        raise ModelError(
            f"static state under the preload: no equilibrium; exudyn's residual stays at "
            f"{residual:.1e} N ({allowed:.1e} N allowed): the load moves gears out of mesh, "
            "or bearings are too soft for it; check their stiffness, or give a smaller torque"
        )
    system = build_drivetrain(drivetrain, at_mean(laws))
    forces, contact = _mesh_states(system, motion)
    for mesh, side in zip(played, sides, strict=True):
        if contact[mesh.name] != side * laws[mesh.name].flank:
            raise ModelError(
                f"static state under the preload: {mesh.name} does not press as it does in the "
                "undeformed geometry; the deflections decide on its contact: give another torque, "
                "or less backlash"
            )
    loaded = linearized_at(system, motion)
    loaded = replace(loaded, stiffness=neutral(loaded, loaded.stiffness, free))
    _check_stable(loaded)
    return StaticState(motion, forces, loaded)


def neutral(linear: LinearizedSystem, stiffness: FloatArray, free: FloatArray) -> FloatArray:
    """K with the free motions R as free as they are at rest: PᵀK P, P = 1 − R (RᵀM R)⁻¹ RᵀM.

    Where planets differ and bearings do by direction, displaced centres would make K R a small part
    of the load over the radius. That is no spring that turns with the gears, and of an order that
    the linear system leaves out elsewhere.
    """
    keep = straining(linear, free)
    kept: FloatArray = keep.T @ stiffness @ keep
    return 0.5 * (kept + kept.T)


def straining(linear: LinearizedSystem, free: FloatArray) -> FloatArray:
    """P = 1 − R (RᵀM R)⁻¹ RᵀM (n_dof, n_dof): a motion without its part along the free ones R."""
    momentum = linear.mass @ free
    keep: FloatArray = np.eye(len(momentum)) - free @ np.linalg.solve(free.T @ momentum, momentum.T)
    return keep


@dataclass(frozen=True)
class _Level:
    """A waveform that stays where it is."""

    level: float
    kinks: tuple[float, ...] = ()

    def value(self, turns: ArrayLike) -> FloatArray:
        return np.full(np.shape(turns), self.level)

    def slope(self, turns: ArrayLike) -> FloatArray:
        return np.zeros(np.shape(turns))

    def harmonic(self, order: int) -> complex:
        return 0.0


def _pressed(law: MeshLaw, side: float) -> MeshLaw:
    """A mesh as a spring from one side of its gap, k (δ − σ b/2), or none (σ = 0): no kinks.

    Newton's method would else lose the stiffness of a mesh that hardly presses.
    """
    if side == 0.0:
        return MeshLaw(stiffness=_Level(-1.0))
    gap = law.flank * side * 0.5 * law.backlash
    return MeshLaw(transmission_error=_Level(gap), flank=law.flank)


def _contact(
    linear: LinearizedSystem,
    parts: Components,
    load: FloatArray,
    played: list[Spring],
    shifts: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The linear system's equilibrium, and the free motions of what is in contact there.

    ``shifts`` are σ b/2 of the meshes with backlash.
    """
    offsets = np.zeros(len(linear.dofs))
    stiffness = linear.stiffness.copy()
    for mesh, shift in zip(played, shifts, strict=True):
        k, v = mesh.stiffness[0, 0], mesh.deflection[0]
        if shift == 0.0:
            stiffness -= k * np.outer(v, v)
        offsets += k * shift * v
    apart = [mesh for mesh, shift in zip(played, shifts, strict=True) if shift == 0.0]
    names = {mesh.name for mesh in apart}
    held = replace(parts, springs=tuple(s for s in parts.springs if s.name not in names))
    free = free_motions(held)
    _check_balance(free, load + offsets)
    motion = _carriers_at_rest(parts, _solve(stiffness, free, load + offsets), free)
    return _amid_gaps(motion, free, apart), free


def _check_gaps(
    motion: FloatArray, played: list[Spring], sides: FloatArray, halves: FloatArray
) -> None:
    for mesh, side, half in zip(played, sides, halves, strict=True):
        stretch = float(mesh.deflection[0] @ motion)
        if side == 0.0 and abs(stretch) > half * (1.0 + IN_GAP):
            raise ModelError(
                f"static state under the preload: whether {mesh.name} is in contact does not "
                "settle; give another torque, or another backlash"
            )


def _pressed_flanks(
    stiffness: FloatArray,
    free: FloatArray,
    played: list[Spring],
    halves: FloatArray,
    load: FloatArray,
) -> FloatArray:
    """σ of every mesh where the potential energy ½ qᵀK₀q + Σ ½ k g(s)² − fᵀq is least.

    It is convex: Newton's method with the line search to the least energy ends there. Some of the
    closed meshes' stiffness holds what is loose on the way. The result is checked where it is used.
    """
    from scipy.optimize import brentq

    if not played:
        return np.zeros(0)
    along = np.concatenate([mesh.deflection for mesh in played])
    k = np.array([mesh.stiffness[0, 0] for mesh in played])
    others = stiffness - (along.T * k) @ along

    def tensions(motion: FloatArray) -> FloatArray:
        stretch = along @ motion
        taken_up: FloatArray = k * (stretch - np.clip(stretch, -halves, halves))
        return taken_up

    def force(motion: FloatArray) -> FloatArray:
        left: FloatArray = load - others @ motion - along.T @ tensions(motion)
        return left

    motion = np.zeros(len(load))
    for _ in range(MAX_SEARCH):
        left = force(motion)
        if np.linalg.norm(left) <= UNBALANCED * np.linalg.norm(load):
            break
        pressed = k * (tensions(motion) != 0.0)
        tangent = others + (along.T * pressed) @ along + HELD_LOOSELY * stiffness
        way = _solve(tangent, free, left)

        def slope(share: float, start: FloatArray = motion, way: FloatArray = way) -> float:
            return float(way @ force(start + share * way))

        longest = 1.0
        while slope(longest) > 0.0:
            longest *= 2.0
        motion = motion + (brentq(slope, 0.0, longest) if slope(longest) < 0.0 else longest) * way
    carried = tensions(motion)
    carried[np.abs(carried) <= CARRIES_NOTHING * np.abs(load).max()] = 0.0
    return np.sign(carried)


def _amid_gaps(motion: FloatArray, free: FloatArray, apart: list[Spring]) -> FloatArray:
    """The motion plus that free one by which open meshes come nearest to their middle."""
    if not apart:
        return motion
    stretch = np.concatenate([mesh.deflection for mesh in apart])
    along = np.linalg.lstsq(stretch @ free, -stretch @ motion, rcond=1e-9)[0]
    moved: FloatArray = motion + free @ along
    return moved


def _carriers_at_rest(parts: Components, motion: FloatArray, free: FloatArray) -> FloatArray:
    """The motion plus that free one by which bodies are displaced least.

    A twisted shaft may turn a gear by radians, which strains nothing; what it turns a carrier by
    moves planets, and that is where a linear start goes wrong.
    """
    rotation = {3: 2, 6: 5}
    rows = [
        np.delete(own, rotation[len(own)], axis=0)
        for own in parts.motions.values()
        if len(own) in rotation
    ]
    displaced = np.concatenate(rows) if rows else np.zeros((1, len(motion)))
    if np.abs(displaced @ free).max(initial=0.0) < STANDS_STILL:
        return motion
    along = np.linalg.lstsq(displaced @ free, -displaced @ motion, rcond=1e-9)[0]
    moved: FloatArray = motion + free @ along
    return moved


def _settle(
    system: MultibodySystem,
    mass: FloatArray,
    free: FloatArray,
    load: FloatArray,
    motion: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Newton's method on exudyn's residual: the motion where it is smallest, and what is left.

    A step that moves something too far for K to tell is halved until it leads down (Nocedal &
    Wright 2006, Numerical Optimization, 11.2). A step does not move along the free motions.
    """
    inertia = mass @ free
    inertia /= np.linalg.norm(inertia, axis=0)
    left = forces_at(system, motion) + load
    for _ in range(MAX_NEWTON):
        if np.abs(left).max() <= np.finfo(float).eps * np.abs(load).max():
            break
        way = _solve(linearized_at(system, motion).stiffness, free, left, inertia)
        for share in SHARES:
            moved = motion + share * way
            next_left = forces_at(system, moved) + load
            if np.linalg.norm(next_left) < (1.0 - 0.1 * share) * np.linalg.norm(left):
                break
        else:
            break  # round-off
        motion, left = moved, next_left
    return motion, left


def _check_stable(linear: LinearizedSystem) -> None:
    """Refuse an equilibrium from which the load pushes gears aside: K has a negative eigenvalue."""
    scale = np.sqrt(np.abs(np.diag(linear.stiffness)))
    scale[scale == 0.0] = 1.0
    values, shapes = np.linalg.eigh(linear.stiffness / np.outer(scale, scale))
    if values[0] < -UNSTABLE:
        dof = linear.dofs[int(np.abs(shapes[:, 0]).argmax())]
        raise ModelError(
            f"static state under the preload: not stable; mesh forces push {dof} aside, against "
            "bearings softer than force over length of the line of action: stiffen them, or give "
            "a smaller torque"
        )


def _mesh_states(
    system: MultibodySystem, motion: FloatArray
) -> tuple[dict[str, float], dict[str, float]]:
    """Force (N) and touching flank of every mesh at rest in a position."""
    position = (coordinate_transform(system) @ motion)[None]
    forces, contact = mesh_records(system, np.zeros(1), position, np.zeros_like(position))
    names = tuple(system.meshes)
    return (
        dict(zip(names, forces[0].tolist(), strict=True)),
        dict(zip(names, contact[0].tolist(), strict=True)),
    )


def _check_balance(free: FloatArray, load: FloatArray) -> None:
    """Refuse a load that does work on a free motion."""
    work = np.abs(free.T @ load)
    if np.any(work > UNBALANCED * np.linalg.norm(load)):
        raise ModelError(
            "static state under the preload: the torque turns something that nothing holds; a "
            "drivetrain with one input and one output must turn in one way only"
        )


def _solve(
    stiffness: FloatArray, free: FloatArray, load: FloatArray, left: FloatArray | None = None
) -> FloatArray:
    """The smallest q with K q = f, orthogonal to the free motions R: [K A; Rᵀ 0] [q; λ] = [f; 0].

    f does no work on R, so that λ = 0 where K R = 0. Where the twist makes K R small but not 0, Aλ
    is what stays of f without a strain: along A = ``left``, or R itself.
    """
    scale = np.abs(stiffness).max()
    count = free.shape[1]
    border = scale * (free if left is None else left)
    bordered = np.block([[stiffness, border], [scale * free.T, np.zeros((count, count))]])
    try:
        motion: FloatArray = np.linalg.solve(bordered, np.concatenate([load, np.zeros(count)]))
    except np.linalg.LinAlgError as error:
        raise ModelError(
            "static state under the preload: nothing holds what the meshes that carry load leave "
            "loose"
        ) from error
    return motion[: len(load)]


def _meshes(parts: Components) -> list[Spring]:
    return [spring for spring in parts.springs if spring.kind is SpringKind.MESH]

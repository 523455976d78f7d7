"""Static equilibrium of a preloaded drivetrain, flanks pressed: where a run begins without a jerk.

K q = f with the smallest |q| among a free drivetrain's equilibria. With backlash the tension of a
mesh is k (s − σ b/2), s its stretch and σ = ±1 the flank it presses on, or none in the gap (σ = 0):
the σ are those of least energy; what then hangs loose in a gap is put into its middle. With the
σ fixed exudyn's own static residual f is brought to its round-off from there by Newton's method,
but for M R (RᵀM R)⁻¹ Rᵀf: what geometry leaves unbalanced accelerates the free motions R, and
spread over the bodies in any other way than by their inertia it would jerk the light ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ..components import Components, Spring, SpringKind
from ..drivetrain import MultibodySystem
from ..errors import ModelError
from ..interrupts import interrupts_held
from ..linearization import LinearizedSystem, coordinate_transform, linearize
from ..orders import free_motions
from .mesh_excitation import MeshLaw

FloatArray = NDArray[np.float64]

MAX_SEARCH = 100
HELD_LOOSELY = 1e-6  # share of the closed stiffness that steers the search for contact
IN_GAP = 1e-6  # of the gap: how far an open mesh may seem beyond it by round-off
SHARES = tuple(0.5**k for k in range(8))  # of a Newton step
MAX_NEWTON = 20
CARRIES_NOTHING = 1e-9  # of the load: a mesh force that is round-off
UNBALANCED = 1e-9  # of the load: work on a free motion that round-off explains
BEYOND_LINEAR = 0.4  # of the deflection: softly held gears 0.34, equilibria half a turn off 0.49 on
RESIDUAL = 1e-6  # of the load; round-off of the stiffest bearings leaves 1e-9


@dataclass(frozen=True)
class StaticState:
    """An equilibrium.

    Attributes
    ----------
    displacement
        (n_dof,) m.
    mesh_forces
        Tension of every mesh spring by name (N).
    residual
        Largest force that is left in exudyn's own residual and strains something, of the largest
        load.
    imbalance
        Largest inertia force of the free motions, likewise: the loads balance in the undeformed
        geometry, so that this grows with the square of the twist.
    """

    displacement: FloatArray
    mesh_forces: Mapping[str, float]
    residual: float = 0.0
    imbalance: float = 0.0


def mesh_tensions(
    linear: LinearizedSystem, parts: Components, load: FloatArray
) -> dict[str, float]:
    """Tension of every mesh spring (N) under a load, without backlash; 0 where it is round-off."""
    free = free_motions(parts)
    _check_balance(free, load)
    motion = _solve(linear.stiffness, free, load)
    nothing = CARRIES_NOTHING * float(np.abs(load).max())
    tensions = {
        mesh.name: float(mesh.stiffness[0, 0] * (mesh.deflection[0] @ motion))
        for mesh in _meshes(parts)
    }
    return {name: force if abs(force) > nothing else 0.0 for name, force in tensions.items()}


def static_state(
    system: MultibodySystem,
    linear: LinearizedSystem,
    parts: Components,
    load: FloatArray,
    laws: Mapping[str, MeshLaw],
) -> StaticState:
    """Equilibrium under a load with all meshes at their mean.

    Parameters
    ----------
    system
        The drivetrain without laws, for this alone: its mesh springs are set to their flanks.
    linear, parts
        The same linearised and read back.
    load
        (n_dof,) N, conjugate to the DoFs.
    laws
        Their backlash and flanks.

    Raises
    ------
    ModelError
        The load turns something that nothing holds, or no equilibrium is found.
    """
    if not np.any(load):
        at_rest = np.zeros(len(linear.dofs))
        forces = {mesh.name: 0.0 for mesh in _meshes(parts)}
        return StaticState(at_rest, forces)
    free = free_motions(parts)
    _check_balance(free, load)
    played = [mesh for mesh in _meshes(parts) if mesh.name in laws and laws[mesh.name].backlash]
    halves = np.array([0.5 * laws[mesh.name].backlash for mesh in played])
    sides = _pressed_flanks(linear.stiffness, free, played, halves, load)
    motion, free = _contact(linear, parts, load, played, sides * halves)
    _check_gaps(motion, played, sides, halves)
    for mesh, side, half in zip(played, sides, halves, strict=True):
        _press(system, mesh.name, float(side), float(half))
    small = motion
    motion, straining, turning = _settle(system, linear.mass, free, load, small)
    largest = float(np.abs(load).max())
    left = float(np.abs(straining).max()) / largest
    if not left <= RESIDUAL:
        raise ModelError(
            f"static state under the preload: exudyn's residual stays at {left:.1e} of the load "
            f"({RESIDUAL:g} allowed); the torque is too large for small rotations"
        )
    beyond = float(np.abs(motion - small).max() / np.abs(small).max())
    if not beyond <= BEYOND_LINEAR:
        raise ModelError(
            f"static state under the preload: geometry moves it by {beyond:.1e} of the linear "
            f"deflection ({BEYOND_LINEAR:g} allowed); the torque is too large for small rotations"
        )
    forces = spring_forces(system, motion)[1]
    stretches = _open_stretches(system, motion, played, sides)
    for mesh, side, half in zip(played, sides, halves, strict=True):
        closed = abs(stretches.get(mesh.name, 0.0)) > half * (1.0 + IN_GAP)
        if np.sign(forces[mesh.name]) != side or closed:
            raise ModelError(
                f"static state under the preload: {mesh.name} does not press as it does in the "
                "undeformed geometry; the twist decides on its contact: give another torque, or "
                "less backlash"
            )
    return StaticState(
        motion,
        forces,
        left,
        float(np.abs(turning).max()) / largest,
    )


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
    return _amid_gaps(_solve(stiffness, free, load + offsets), free, apart), free


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


def _press(system: MultibodySystem, mesh: str, side: float, half: float) -> None:
    """Make a mesh spring k (s − σ b/2), or none in the gap."""
    mbs, number = system.mbs, system.meshes[mesh]
    if side == 0.0:
        mbs.SetObjectParameter(number, "stiffness", 0.0)
    length = mbs.GetObjectParameter(number, "referenceLength")
    mbs.SetObjectParameter(number, "referenceLength", length + side * half)


def _open_stretches(
    system: MultibodySystem, motion: FloatArray, played: list[Spring], sides: FloatArray
) -> dict[str, float]:
    """How far exudyn's open meshes are stretched in a position (m); their springs come back."""
    apart = [mesh for mesh, side in zip(played, sides, strict=True) if side == 0.0]
    if not apart:
        return {}
    for mesh in apart:
        number = system.meshes[mesh.name]
        system.mbs.SetObjectParameter(number, "stiffness", mesh.stiffness[0, 0])
    tensions = spring_forces(system, motion)[1]
    return {mesh.name: tensions[mesh.name] / float(mesh.stiffness[0, 0]) for mesh in apart}


def _amid_gaps(motion: FloatArray, free: FloatArray, apart: list[Spring]) -> FloatArray:
    """The motion plus that free one by which open meshes come nearest to their middle."""
    if not apart:
        return motion
    stretch = np.concatenate([mesh.deflection for mesh in apart])
    along = np.linalg.lstsq(stretch @ free, -stretch @ motion, rcond=1e-9)[0]
    moved: FloatArray = motion + free @ along
    return moved


def _settle(
    system: MultibodySystem,
    mass: FloatArray,
    free: FloatArray,
    load: FloatArray,
    motion: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Newton's method on exudyn's residual: the motion where it is smallest, and what is left.

    A step that turns something too far for K to tell is halved until it leads down (Nocedal &
        Wright 2006, Numerical Optimization, 11.2). Of what is left, first the part that strains
    something, then the inertia forces of the free motions.
    """
    inertia = mass @ free
    inertia /= np.linalg.norm(inertia, axis=0)
    accelerating = inertia @ np.linalg.inv(free.T @ inertia)

    def parts_left(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        residual = spring_forces(system, at)[0] + load
        turning = accelerating @ (free.T @ residual)
        return residual - turning, turning

    straining, turning = parts_left(motion)
    for _ in range(MAX_NEWTON):
        if np.abs(straining).max() <= np.finfo(float).eps * np.abs(load).max():
            break
        way = _solve(_stiffness_at(system, motion), free, straining, inertia)
        for share in SHARES:
            moved = motion + share * way
            next_straining, next_turning = parts_left(moved)
            fallen = np.linalg.norm(next_straining) / np.linalg.norm(straining)
            if fallen < 1.0 - 0.1 * share:
                break
        else:
            break  # round-off
        motion, straining, turning = moved, next_straining, next_turning
        if share < 1.0 and np.abs(straining).max() <= RESIDUAL * np.abs(load).max():
            break  # round-off as well
    return motion, straining, turning


def _stiffness_at(system: MultibodySystem, motion: FloatArray) -> FloatArray:
    """K about a position (n_dof, n_dof)."""
    with _placed(system, motion):
        return linearize(system).stiffness


def spring_forces(
    system: MultibodySystem, motion: FloatArray
) -> tuple[FloatArray, dict[str, float]]:
    """What all springs exert on the DoFs at rest in a position (N), and the meshes' tensions."""
    mbs, transform = system.mbs, coordinate_transform(system)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    solver: Any = exu.MainSolverStatic()
    with interrupts_held(mbs), _placed(system, motion):
        solver.InitializeSolver(mbs, settings)
        solver.ComputeODE2RHS(mbs)
        forces = np.asarray(solver.GetSystemResidual())[: len(transform)]
        tensions = {
            name: float(mbs.GetObjectOutput(number, exu.OutputVariableType.ForceLocal))
            for name, number in system.meshes.items()
        }
        solver.FinalizeSolver(mbs, settings)
    return transform.T @ forces, tensions


@contextmanager
def _placed(system: MultibodySystem, motion: FloatArray) -> Iterator[None]:
    """The system with its initial state in a position; as built afterwards."""
    data, initial = system.mbs.systemData, exu.ConfigurationType.Initial
    as_built = data.GetODE2Coordinates(initial)
    data.SetODE2Coordinates((coordinate_transform(system) @ motion).tolist(), initial)
    try:
        yield
    finally:
        data.SetODE2Coordinates(as_built, initial)


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

"""The paper's lumped matrices from mesh vectors: a route of their own.

Every spring of stiffness k deflects by δ = vᵀq, so K = Σ k v vᵀ; C = β K + α M element by element.
The vectors are the printed equations (the paper, Eqs. 1 and 9), with two misprints put right:
δ_rp has u_r where the paper prints u_c, and φ_rp = φ_p + α_r (Lin & Parker 1999). Appendix A's
blocks are not used: as printed they are no sums of outer products. Nothing here knows exudyn or
positions in space.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from math import cos, radians, sin
from typing import TypeVar

import numpy as np

from fbs import SecondOrderSystem
from mbs_models.errors import ModelError
from mbs_models.model import parameters
from mbs_models.model.parameters import (
    Coupling,
    Damping,
    Drivetrain,
    Inertia,
    ParallelStage,
    Part,
    PlanetaryStage,
)
from mbs_models.stages.bodies import Matrix2
from mbs_models.stages.part import mesh_name

from . import table_values as raw

Deflection = Mapping[str, float]  # DoF label -> coefficient in δ = Σ c·q
P = TypeVar("P", bound=Part)


@dataclass(frozen=True)
class Spring:
    """A spring (N/m) and the damper beside it (N s/m; None: β k), with their deflection δ = vᵀq.

    ``mesh`` is the name of the mesh that it is, if it is one.
    """

    stiffness: float
    deflection: Deflection
    damping: float | None = None
    mesh: str = ""


@dataclass(frozen=True)
class Lumped:
    """Inertias (label → kg), springs, and rigid ties.

    A tie (follower, (leader, factor)) says q_follower = factor·q_leader.
    """

    inertias: tuple[tuple[str, float], ...] = ()
    springs: tuple[Spring, ...] = ()
    ties: tuple[tuple[str, tuple[str, float]], ...] = ()

    def __add__(self, other: Lumped) -> Lumped:
        return Lumped(
            self.inertias + other.inertias, self.springs + other.springs, self.ties + other.ties
        )


def drivetrain_system(drivetrain: Drivetrain) -> SecondOrderSystem:
    """M, C, K of the whole drivetrain (the paper, Eqs. 2, 11, 12)."""
    return assemble(drivetrain_elements(drivetrain), drivetrain.damping)


def drivetrain_elements(drivetrain: Drivetrain) -> Lumped:
    """Inertias, springs and ties of the whole drivetrain."""
    lumped, sides = Lumped(), raw.sides(drivetrain)
    for part in drivetrain.parts:
        lumped += part_elements(part)
    for coupling in drivetrain.couplings:
        lumped += _hub(drivetrain, sides, coupling, raw.ends(coupling), share=1.0)
        lumped += _translations(drivetrain, sides, coupling)
    return lumped


def stage_system(drivetrain: Drivetrain, name: str) -> SecondOrderSystem:
    """M, C, K of one stage with its halves of the hubs (the paper, Eqs. 6, 7, 10)."""
    lumped, sides = part_elements(drivetrain.part(name)), raw.sides(drivetrain)
    for coupling in drivetrain.couplings:
        ends = [end for end in raw.ends(coupling) if raw.split(end[0])[0] == name]
        if raw.over_r2(coupling, "inertia", coupling.radius) == 0.0:
            # cut at the rigid end, its spring left to the joint
            ends = [end for end in ends if end == raw.rigid_end(coupling)]
        if ends:
            lumped += _hub(drivetrain, sides, coupling, ends, share=0.5)
    return assemble(lumped, drivetrain.damping)


def rigid_body_motions(drivetrain: Drivetrain) -> int:
    """Motions that strain nothing, counted before any eigensolution: n − rank of the deflections.

    Only which springs there are and along what they act decides, not how stiff they are.
    """
    lumped = drivetrain_elements(drivetrain)
    derived = _resolve(lumped.ties)
    dofs = [label for label, _ in lumped.inertias if label not in derived]
    rows = []
    for spring in lumped.springs:
        if spring.stiffness > 0.0:
            row = dict.fromkeys(dofs, 0.0)
            for label, coefficient in spring.deflection.items():
                leader, factor = derived.get(label, (label, 1.0))
                row[leader] += coefficient * factor
            rows.append(list(row.values()))
    return len(dofs) - int(np.linalg.matrix_rank(np.array(rows))) if rows else len(dofs)


def locking_couplings(drivetrain: Drivetrain) -> tuple[str, ...]:
    """Couplings that close a loop and leave nothing to turn: the loop's radii contradict."""
    if rigid_body_motions(drivetrain) > 0:
        return ()
    locking = []
    for coupling in drivetrain.couplings:
        others = tuple(c for c in drivetrain.couplings if c is not coupling)
        opened = drivetrain.model_copy(update={"couplings": others})
        still_joined = len(opened.groups()) == len(drivetrain.groups())
        if still_joined and rigid_body_motions(opened) > 0:
            locking.append(coupling.name)
    return tuple(locking)


def assemble(lumped: Lumped, damping: Damping) -> SecondOrderSystem:
    """M = diag(m), K = Σ k v vᵀ, C = Σ c v vᵀ + α M, tied DoFs eliminated by q = L q_leaders."""
    beta, alpha = damping.stiffness_proportional, damping.mass_proportional
    labels = [label for label, _ in lumped.inertias]
    place = {label: i for i, label in enumerate(labels)}
    mass = np.diag([inertia for _, inertia in lumped.inertias])
    stiffness, dampers = np.zeros_like(mass), alpha * mass
    for spring in lumped.springs:
        v = np.array(list(spring.deflection.values()))
        at = np.ix_(*2 * ([place[label] for label in spring.deflection],))
        c = beta * spring.stiffness if spring.damping is None else spring.damping
        stiffness[at] += spring.stiffness * np.outer(v, v)
        dampers[at] += c * np.outer(v, v)

    derived = _resolve(lumped.ties)
    dofs = tuple(label for label in labels if label not in derived)
    column = {label: j for j, label in enumerate(dofs)}
    reduction = np.zeros((len(labels), len(dofs)))
    for row, label in enumerate(labels):
        leader, factor = derived.get(label, (label, 1.0))
        reduction[row, column[leader]] = factor
    mass, dampers, stiffness = (reduction.T @ m @ reduction for m in (mass, dampers, stiffness))
    return SecondOrderSystem(mass, dampers, stiffness, dofs, derived)


def _resolve(ties: Iterable[tuple[str, tuple[str, float]]]) -> dict[str, tuple[str, float]]:
    """Ties in terms of leaders that follow nobody: q_follower = factor·q_leader."""
    derived: dict[str, tuple[str, float]] = {}
    for follower, (leader, factor) in ties:
        own, inner = derived.get(follower, (follower, 1.0))
        base, outer = derived.get(leader, (leader, 1.0))
        if own == base:
            raise ModelError(f"rigid couplings tie {follower} and {leader} twice")
        ratio = factor * outer / inner
        for label, (of, value) in derived.items():
            if of == own:
                derived[label] = (base, value * ratio)
        derived[own] = (base, ratio)
    return derived


@singledispatch
def part_elements(part: Part) -> Lumped:
    """Inertias and springs of a stage or an inertia: one function for each type.

    Raises
    ------
    ModelError
        The type has none.
    """
    raise ModelError(
        f"'{part.name}': {type(part).__name__} has no equations; register it by "
        "validation.register_stage"
    )


def register_stage(stage_type: type[P], *, equations: Callable[[P], Lumped]) -> None:
    """Let drivetrains have stages of another type, built by exudyn and by equations.

    Parameters
    ----------
    stage_type
        Derived from `mbs_models.Part`, which see.
    equations
        Inertias and springs of such a stage, from its parameters alone.

    Raises
    ------
    ModelError
        It is no stage type, or its name is taken.
    """
    parameters.register_stage(stage_type)
    part_elements.register(stage_type, equations)


@part_elements.register
def _inertia(part: Inertia) -> Lumped:
    label, r = f"{part.name}.w", part.radius
    inertia = raw.over_r2(part, "polar_inertia", r)
    return Lumped(((label, inertia),), (Spring(raw.torsional_support(part, r), {label: 1.0}),))


def _bearing(
    stiffness: Matrix2, damping: Matrix2 | None, first: Deflection, second: Deflection
) -> list[Spring]:
    """A 2 × 2 bearing as springs and dampers along its principal directions: Σ λ e eᵀ."""
    springs = []
    for matrix, is_damper in ((stiffness, False), (damping, True)):
        if matrix is None:
            continue
        for value, (a, b) in zip(*_principal(matrix), strict=True):
            deflection = {label: a * c for label, c in first.items() if a}
            for label, c in second.items():
                if b:
                    deflection[label] = deflection.get(label, 0.0) + b * c
            if is_damper:
                springs.append(Spring(0.0, deflection, float(value)))
            else:
                own = None if damping is None else 0.0
                springs.append(Spring(float(value), deflection, own))
    return springs


def _own(damping: float | Matrix2 | None) -> Matrix2 | None:
    """A bearing's own damping; None: β times its stiffness."""
    return None if damping is None else raw.matrix(damping)


def _principal(matrix: Matrix2) -> tuple[Sequence[float], Sequence[Sequence[float]]]:
    """Principal values and directions of a symmetric 2 × 2 matrix."""
    if matrix[0][1] == 0.0:
        return (matrix[0][0], matrix[1][1]), ((1.0, 0.0), (0.0, 1.0))
    values, vectors = np.linalg.eigh(np.array(matrix))
    return list(values), [list(column) for column in vectors.T]


@part_elements.register
def _parallel(stage: ParallelStage) -> Lumped:
    """Eqs. 6–9, with the rocking entries sin β·(ρ₁ − ρ₂) that Eq. 9 leaves out."""
    inertias: list[tuple[str, float]] = []
    springs: list[Spring] = []
    for name, gear in (("pinion", stage.pinion), ("wheel", stage.wheel)):
        at, r = f"{stage.name}.{name}", gear.base_radius
        inertias += [
            (f"{at}.w", raw.over_r2(gear, "polar_inertia", r)),
            (f"{at}.y", gear.mass),
            (f"{at}.z", gear.mass),
            (f"{at}.rho", raw.over_r2(gear, "diametral_inertia", r)),
        ]
        bearing = raw.matrix(gear.bearing, gear.bearing_y, gear.bearing_z)
        springs += _bearing(bearing, _own(gear.bearing_damping), {f"{at}.y": 1.0}, {f"{at}.z": 1.0})
        springs.append(Spring(raw.over_r2(gear, "bearing_rocking", r), {f"{at}.rho": 1.0}))
    name = mesh_name(f"{stage.name}.pinion", f"{stage.name}.wheel")
    springs.append(Spring(stage.mesh_stiffness, parallel_mesh(stage), mesh=name))
    return Lumped(tuple(inertias), tuple(springs))


def parallel_mesh(stage: ParallelStage) -> Deflection:
    """δ = cos β (w₁ − w₂ + y₁ − y₂) + sin β (z₁ − z₂ + ρ₁ − ρ₂) (Eq. 9, completed)."""
    beta = radians(stage.helix_angle)
    weights = {"w": cos(beta), "y": cos(beta), "z": sin(beta), "rho": sin(beta)}
    return {
        f"{stage.name}.{gear}.{dof}": sign * weight
        for gear, sign in (("pinion", 1.0), ("wheel", -1.0))
        for dof, weight in weights.items()
    }


@part_elements.register
def _planetary(stage: PlanetaryStage) -> Lumped:
    """Lin & Parker's gear set: Eq. 10 and the springs behind Appendix A."""
    inertias: list[tuple[str, float]] = []
    springs: list[Spring] = []
    radii = raw.shape(stage).radii
    for name, member in (("sun", stage.sun), ("ring", stage.ring), ("carrier", stage.carrier)):
        at, r = f"{stage.name}.{name}", radii[name]
        inertias += _plane_inertias(at, member.mass, raw.over_r2(member, "polar_inertia", r))
        bearing = raw.matrix(member.bearing, member.bearing_u, member.bearing_v)
        damping = _own(member.bearing_damping)
        springs += _bearing(bearing, damping, {f"{at}.u": 1.0}, {f"{at}.v": 1.0})
        springs.append(Spring(raw.torsional_support(member, r), {f"{at}.w": 1.0}))
    bearing = raw.matrix(
        stage.planet_bearing, stage.planet_bearing_radial, stage.planet_bearing_tangential
    )
    for number, phi in enumerate(raw.planet_angles(stage), start=1):
        planet, body = f"planet{number}", stage.planet
        rotary = raw.over_r2(body, "polar_inertia", body.base_radius)
        inertias += _plane_inertias(f"{stage.name}.{planet}", body.mass, rotary)
        springs += [
            *(
                Spring(
                    stiffness[number - 1] if isinstance(stiffness, tuple) else stiffness,
                    deflection(stage, planet, phi),
                    mesh=mesh_name(f"{stage.name}.{gear}", f"{stage.name}.{planet}"),
                )
                for gear, stiffness, deflection in (
                    ("sun", stage.sun_mesh_stiffness, sun_mesh),
                    ("ring", stage.ring_mesh_stiffness, ring_mesh),
                )
            ),
            *_bearing(
                bearing,
                _own(stage.planet_bearing_damping),
                _planet_bearing_radial(stage, planet, phi),
                _planet_bearing_tangential(stage, planet, phi),
            ),
        ]
    return Lumped(tuple(inertias), tuple(springs))


def _plane_inertias(at: str, mass: float, rotary: float) -> list[tuple[str, float]]:
    return [(f"{at}.u", mass), (f"{at}.v", mass), (f"{at}.w", rotary)]


def sun_mesh(stage: PlanetaryStage, planet: str, phi: float) -> Deflection:
    """δ_sp = v_s cos φ_sp − u_s sin φ_sp − u_p sin α_s − v_p cos α_s + w_s + w_p (Eq. 1)."""
    alpha, _ = raw.mesh_angles(stage)
    phi_sp = phi - alpha
    at = stage.name
    return {
        f"{at}.sun.u": -sin(phi_sp),
        f"{at}.sun.v": cos(phi_sp),
        f"{at}.sun.w": 1.0,
        f"{at}.{planet}.u": -sin(alpha),
        f"{at}.{planet}.v": -cos(alpha),
        f"{at}.{planet}.w": 1.0,
    }


def ring_mesh(stage: PlanetaryStage, planet: str, phi: float) -> Deflection:
    """δ_rp = v_r cos φ_rp − u_r sin φ_rp + u_p sin α_r − v_p cos α_r + w_r − w_p (Eq. 1)."""
    _, alpha = raw.mesh_angles(stage)
    phi_rp = phi + alpha
    at = stage.name
    return {
        f"{at}.ring.u": -sin(phi_rp),
        f"{at}.ring.v": cos(phi_rp),
        f"{at}.ring.w": 1.0,
        f"{at}.{planet}.u": sin(alpha),
        f"{at}.{planet}.v": -cos(alpha),
        f"{at}.{planet}.w": -1.0,
    }


def _planet_bearing_radial(stage: PlanetaryStage, planet: str, phi: float) -> Deflection:
    at = stage.name
    return {f"{at}.carrier.u": cos(phi), f"{at}.carrier.v": sin(phi), f"{at}.{planet}.u": -1.0}


def _planet_bearing_tangential(stage: PlanetaryStage, planet: str, phi: float) -> Deflection:
    at = stage.name
    return {
        f"{at}.carrier.u": -sin(phi),
        f"{at}.carrier.v": cos(phi),
        f"{at}.carrier.w": 1.0,
        f"{at}.{planet}.v": -1.0,
    }


def _hub(
    drivetrain: Drivetrain,
    sides: Mapping[str, float],
    coupling: Coupling,
    ends: Sequence[tuple[str, float | str]],
    share: float,
) -> Lumped:
    """A share of the hub's inertia and its springs δ = (r/r_body)·w_body − w_hub."""
    hub = f"{coupling.name}.w"
    springs: list[Spring] = []
    ties: list[tuple[str, tuple[str, float]]] = []
    for body, stiffness in ends:
        ratio = raw.hub_ratio(drivetrain, sides, coupling, body)
        if not isinstance(stiffness, str):
            springs.append(Spring(stiffness, {f"{body}.w": ratio, hub: -1.0}))
        elif ties:
            ties.append((f"{body}.w", (hub, 1.0 / ratio)))
        else:
            ties.append((hub, (f"{body}.w", ratio)))
    inertia = raw.over_r2(coupling, "inertia", coupling.radius)
    return Lumped(((hub, share * inertia),), tuple(springs), tuple(ties))


def _translations(drivetrain: Drivetrain, sides: Mapping[str, float], coupling: Coupling) -> Lumped:
    """Springs δ = q_first − (±q_second) between two bodies' translations, or ties.

    The first transverse direction is everybody's; the others turn with the side a part is seen
    from.
    """
    both = coupling.first, coupling.second
    turned = sides[raw.split(both[0])[0]] * sides[raw.split(both[1])[0]]
    springs: list[Spring] = []
    ties: list[tuple[str, tuple[str, float]]] = []
    for dof, translation in coupling.dofs.items():
        direction = raw.SIDEWAYS[dof]
        first, second = (raw.translation_label(drivetrain, body, direction) for body in both)
        sign = 1.0 if direction == 1 else turned
        if isinstance(translation.stiffness, str):
            ties.append((second, (first, sign)))
        else:
            deflection = {first: 1.0, second: -sign}
            springs.append(Spring(translation.stiffness, deflection, translation.damping))
    return Lumped((), tuple(springs), tuple(ties))

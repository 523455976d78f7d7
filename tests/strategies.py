"""Drivetrains for tests: changed presets, and random ones."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from hypothesis import strategies as st
from pydantic import BaseModel

from mbs_models.model.model_file import load
from mbs_models.model.parameters import (
    Damping,
    Drivetrain,
    Inertia,
    ParallelStage,
    Part,
    PlanetaryStage,
)

DAMPED = Damping(stiffness_proportional=1e-6, mass_proportional=1.0)


T = TypeVar("T", bound=BaseModel)


def changed(table: T, **changes: Any) -> T:
    """A copy of a parameter table with some keys changed (None removes one), validated anew."""
    data = table.model_dump(by_alias=True, exclude_unset=True) | changes
    return type(table).model_validate({k: v for k, v in data.items() if v is not None})


def with_stage(drivetrain: Drivetrain, name: str, **changes: Any) -> Drivetrain:
    """A copy with one stage changed."""
    stages = [changed(s, **changes) if s.name == name else s for s in drivetrain.stages]
    return changed(drivetrain, stage=[s.model_dump(exclude_unset=True) for s in stages])


def with_coupling(drivetrain: Drivetrain, **changes: Any) -> Drivetrain:
    """A copy with its (only) coupling changed."""
    coupling = changed(drivetrain.couplings[0], **changes)
    return changed(drivetrain, coupling=[coupling.model_dump(exclude_unset=True)])


def damped(drivetrain: Drivetrain, damping: Damping = DAMPED) -> Drivetrain:
    """A copy with proportional damping."""
    return changed(drivetrain, damping=damping.model_dump())


def paper(**coupling: Any) -> Drivetrain:
    """The paper's drivetrain, its coupling changed."""
    drivetrain = load("paper")
    return with_coupling(drivetrain, **coupling) if coupling else drivetrain


stiffness = st.floats(1e5, 1e9)  # four decades, as couplings, bearings and meshes are
mass = st.floats(0.1, 10.0)
radius = st.floats(0.01, 0.2)


@st.composite
def bearing_matrices(draw: st.DrawFn) -> list[list[float]]:
    """A symmetric positive semi-definite 2 × 2 bearing with cross terms."""
    a, d = draw(stiffness), draw(stiffness)
    b = draw(st.floats(-0.9, 0.9)) * float(np.sqrt(a * d))
    return [[a, b], [b, d]]


@st.composite
def parallel_gears(draw: st.DrawFn) -> dict[str, Any]:
    gear = {
        "mass": draw(mass),
        "base_radius": draw(radius),
        "polar_inertia_over_r2": draw(mass),
        "diametral_inertia_over_r2": draw(mass),
        "bearing_rocking_over_r2": draw(stiffness),
    }
    if draw(st.booleans()):
        return gear | {"bearing_y": draw(stiffness), "bearing_z": draw(stiffness)}
    return gear | {"bearing": draw(bearing_matrices())}


@st.composite
def parallel_stages(draw: st.DrawFn, name: str = "reducer") -> ParallelStage:
    return ParallelStage.model_validate(
        {
            "type": "parallel",
            "name": name,
            "helix_angle": draw(st.floats(-30.0, 30.0)),
            "pressure_angle": draw(st.floats(14.5, 30.0)),
            "mesh_stiffness": draw(stiffness),
            "pinion": draw(parallel_gears()),
            "wheel": draw(parallel_gears()),
        }
    )


@st.composite
def central_members(draw: st.DrawFn) -> dict[str, Any]:
    return {
        "mass": draw(mass),
        "polar_inertia_over_r2": draw(mass),
        "bearing": draw(st.one_of(stiffness, bearing_matrices())),
        "torsional_support": draw(st.one_of(st.just(0.0), stiffness)),
    }


@st.composite
def planetary_stages(draw: st.DrawFn, name: str = "planetary") -> PlanetaryStage:
    n = draw(st.integers(2, 7))
    sun_radius = draw(radius)
    # Of the room between neighbours (pitch radius below d·sin(π/n)), less the play in their angles.
    room = np.sin(np.pi / n - np.radians(6.0))
    largest = min(0.9 * room / (1.0 - room), 1.0)
    planet_radius = sun_radius * draw(st.floats(0.3 * largest, largest))
    turn = draw(st.floats(0.0, 360.0))
    play = [draw(st.floats(-3.0, 3.0)) for _ in range(n)]
    return PlanetaryStage.model_validate(
        {
            "type": "planetary",
            "name": name,
            "planet_angles": [turn + 360.0 * p / n + play[p] for p in range(n)],
            "sun_pressure_angle": draw(st.floats(14.5, 30.0)),
            "ring_pressure_angle": draw(st.floats(14.5, 30.0)),
            "sun_mesh_stiffness": [draw(stiffness) for _ in range(n)],
            "ring_mesh_stiffness": draw(stiffness),
            "planet_bearing": draw(st.one_of(stiffness, bearing_matrices())),
            "sun": draw(central_members()) | {"base_radius": sun_radius},
            "ring": draw(central_members()),
            "carrier": draw(central_members()),
            "planet": {
                "mass": draw(mass),
                "base_radius": planet_radius,
                "polar_inertia_over_r2": draw(mass),
            },
        }
    )


@st.composite
def inertias(draw: st.DrawFn, name: str = "rotor") -> Inertia:
    return Inertia.model_validate(
        {"name": name, "radius": draw(radius), "polar_inertia_over_r2": draw(mass)}
    )


@st.composite
def couplings(draw: st.DrawFn, name: str, ends: list[tuple[Part, str]]) -> dict[str, Any]:
    """A coupling of two bodies: with or without a hub, rigid ends, and translations."""
    end = st.one_of(st.just("rigid"), stiffness)
    coupling: dict[str, Any] = {"name": name, "radius": draw(radius)}
    for key, (part, body) in zip(("first", "second"), ends, strict=True):
        coupling[key] = part.name if isinstance(part, Inertia) else f"{part.name}.{body}"
    if draw(st.booleans()):
        coupling |= {"inertia_over_r2": draw(st.floats(1e-6, 1.0))}
        coupling |= {"first_stiffness": draw(end), "second_stiffness": draw(end)}
    else:
        values = draw(st.permutations(["rigid", draw(stiffness)]))
        coupling |= {"inertia_over_r2": 0.0}
        coupling |= {"first_stiffness": values[0], "second_stiffness": values[1]}
    kinds = {type(part) for part, _ in ends}
    common = {
        frozenset({ParallelStage}): ["y", "z"],
        frozenset({PlanetaryStage}): ["u", "v"],
        frozenset({ParallelStage, PlanetaryStage}): ["u"],
    }.get(frozenset(kinds), [])
    coupling["dofs"] = {dof: {"stiffness": draw(end)} for dof in common if draw(st.booleans())}
    return coupling


@st.composite
def drivetrains(draw: st.DrawFn, largest: int = 4) -> Drivetrain:
    """A tree of up to ``largest`` parts, joined at any bodies."""
    kinds = draw(
        st.lists(st.sampled_from("psi"), min_size=1, max_size=largest).filter(
            lambda found: set(found) != {"i"}
        )
    )
    of_kind = {"p": parallel_stages, "s": planetary_stages, "i": inertias}
    parts: list[Part] = [draw(of_kind[kind](f"part{i}")) for i, kind in enumerate(kinds)]
    joined = []
    for i, part in enumerate(parts[1:], start=1):
        ends = [
            (p, draw(st.sampled_from(p.bodies))) for p in (parts[draw(st.integers(0, i - 1))], part)
        ]
        joined.append(draw(couplings(f"coupling{i}", ends)))
    return Drivetrain.model_validate(
        {
            "name": "random",
            "damping": {
                "stiffness_proportional": draw(st.floats(1e-6, 1e-5)),
                "mass_proportional": draw(st.floats(1.0, 10.0)),
            },
            "stage": [tables(p) for p in parts if not isinstance(p, Inertia)],
            "inertia": [tables(p) for p in parts if isinstance(p, Inertia)],
            "coupling": joined,
        }
    )


def tables(part: Part) -> dict[str, Any]:
    """A part as a model file has it."""
    return part.model_dump(exclude_unset=True)

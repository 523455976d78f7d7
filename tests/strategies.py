"""Drivetrains for tests: changed presets, and random ones."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from mbs_models.model_file import load
from mbs_models.parameters import (
    Coupling,
    Damping,
    Drivetrain,
    ParallelStage,
    PlanetaryStage,
)

DAMPED = Damping(stiffness_proportional=1e-6, mass_proportional=1.0)


def changed(table: Any, **changes: Any) -> Any:
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


stiffness = st.floats(1e6, 1e9)  # over three decades, as bearings and meshes are
mass = st.floats(0.1, 10.0)
radius = st.floats(0.01, 0.2)


@st.composite
def parallel_gears(draw: st.DrawFn) -> dict[str, Any]:
    return {
        "mass": draw(mass),
        "base_radius": draw(radius),
        "polar_inertia_over_r2": draw(mass),
        "diametral_inertia_over_r2": draw(mass),
        "bearing_y": draw(stiffness),
        "bearing_z": draw(stiffness),
        "bearing_rocking_over_r2": draw(stiffness),
    }


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
        "bearing_u": draw(stiffness),
        "bearing_v": draw(stiffness),
        "torsional_support": draw(st.one_of(st.just(0.0), stiffness)),
    }


@st.composite
def planetary_stages(draw: st.DrawFn, name: str = "planetary") -> PlanetaryStage:
    n = draw(st.integers(2, 5))
    sun_radius = draw(radius)
    # Planets of up to half the sun's radius leave room for five with some play in their angles.
    planet_radius = sun_radius * draw(st.floats(0.2, 0.5))
    turn = draw(st.floats(0.0, 360.0))
    play = [draw(st.floats(-8.0, 8.0)) for _ in range(n)]
    return PlanetaryStage.model_validate(
        {
            "type": "planetary",
            "name": name,
            "planet_angles": [turn + 360.0 * p / n + play[p] for p in range(n)],
            "sun_pressure_angle": draw(st.floats(14.5, 30.0)),
            "ring_pressure_angle": draw(st.floats(14.5, 30.0)),
            "sun_mesh_stiffness": draw(stiffness),
            "ring_mesh_stiffness": draw(stiffness),
            "planet_bearing_radial": draw(stiffness),
            "planet_bearing_tangential": draw(stiffness),
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
def couplings(draw: st.DrawFn, first: str, second: str, name: str = "coupling") -> Coupling:
    end = st.one_of(st.just("rigid"), stiffness)
    return Coupling.model_validate(
        {
            "name": name,
            "first": first,
            "second": second,
            "radius": draw(radius),
            "inertia_over_r2": draw(st.floats(1e-6, 1.0)),
            "first_stiffness": draw(end),
            "second_stiffness": draw(end),
        }
    )


@st.composite
def drivetrains(draw: st.DrawFn) -> Drivetrain:
    """A parallel and a planetary stage in either order, joined at any bodies."""
    stages: list[ParallelStage | PlanetaryStage] = [
        draw(parallel_stages()),
        draw(planetary_stages()),
    ]
    stages = draw(st.permutations(stages))
    ends = [f"{stage.name}.{draw(st.sampled_from(stage.bodies))}" for stage in stages]
    coupling = draw(couplings(*ends))
    return Drivetrain.model_validate(
        {
            "name": "random",
            "damping": {
                "stiffness_proportional": draw(st.floats(1e-7, 1e-5)),
                "mass_proportional": draw(st.floats(0.0, 10.0)),
            },
            "stage": [s.model_dump(exclude_unset=True) for s in stages],
            "coupling": [coupling.model_dump(exclude_unset=True)],
        }
    )

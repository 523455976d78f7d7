"""Drivetrains with teeth, and what excites their meshes, for tests."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from tests.strategies import changed, with_stage

# Teeth for Lin & Parker's base radii 38.7 and 50.2 mm (ring 139.1 mm): within 2 %, and such that N
# planets can be put in: (z_s + z_r)/N whole.
TEETH = {3: (28, 36, 101), 4: (27, 35, 97), 5: (27, 35, 98)}


def lin_parker(
    planets: int = 4, *, beta: float = 0.0, alpha: float = 0.0, **stage: Any
) -> Drivetrain:
    """Lin & Parker's (1999) gear set with teeth, driven at the sun; keys of the stage changed."""
    drivetrain = load(f"lin-parker-{planets}")
    (own,) = drivetrain.stages
    tables = own.model_dump(exclude_unset=True) | stage
    for gear, teeth in zip(("sun", "planet", "ring"), TEETH[planets], strict=True):
        tables[gear] = tables[gear] | {"teeth": teeth}
    return changed(
        drivetrain,
        stage=[tables],
        operation={"input": f"{own.name}.sun", "speed_range": [0.0, 10000.0]},
        damping={"stiffness_proportional": beta, "mass_proportional": alpha},
    )


def speed_for(drivetrain: Drivetrain, mesh_frequency: float) -> float:
    """Sun speed (rpm) for a mesh frequency (Hz): f = z_s Ω_s z_r/(z_s + z_r), the ring held."""
    (stage,) = drivetrain.stages_of(PlanetaryStage)
    z_s, z_r = stage.sun.teeth, stage.ring.teeth
    assert z_s is not None
    r_s, r_r = stage.sun.base_radius, stage.ring_radius
    return 60.0 * mesh_frequency * (r_s + r_r) / r_r / z_s if z_r else 0.0


def geared_reducer(**stage: Any) -> Drivetrain:
    """The paper's drivetrain with 40 teeth on pinion and wheel, and a mesh that varies."""
    reducer = load("paper").stage("reducer").model_dump(exclude_unset=True)
    gears = {gear: reducer[gear] | {"teeth": 40} for gear in ("pinion", "wheel")}
    variation = {"shape": "trapezoid", "contact_ratio": 1.6, "amplitude": 0.3}
    varying = with_stage(load("paper"), "reducer", mesh_variation=variation, **gears, **stage)
    return changed(varying, operation={"input": "reducer.pinion", "speed_range": [0.0, 10000.0]})


def family_amplitudes(labels: tuple[str, ...], motion: Any, planets: int) -> dict[Kind, float]:
    """Size of a motion (n_dof,) in each family, by projection (Lin & Parker 1999).

    Rotational: rotations of the central members and the planets' mean; translational: their
    translations and the planets' cos φ_p and sin φ_p; planet modes: the rest of the planets.
    """
    part = dict(zip(labels, motion, strict=True))
    angles = 2.0 * math.pi * np.arange(planets) / planets
    size = dict.fromkeys((Kind.ROTATIONAL, Kind.TRANSLATIONAL, Kind.PLANET), 0.0)
    for body in ("sun", "ring", "carrier"):
        size[Kind.ROTATIONAL] += abs(part[f"planetary.{body}.w"]) ** 2
        for dof in "uv":
            size[Kind.TRANSLATIONAL] += abs(part[f"planetary.{body}.{dof}"]) ** 2
    first = np.stack([np.cos(angles), np.sin(angles)]) * np.sqrt(2.0 / planets)
    for dof in "uvw":
        own = np.array([part[f"planetary.planet{p + 1}.{dof}"] for p in range(planets)])
        mean = own.mean()
        turned = first @ own
        size[Kind.ROTATIONAL] += planets * abs(mean) ** 2
        size[Kind.TRANSLATIONAL] += float(np.sum(np.abs(turned) ** 2))
        rest = own - mean - first.T @ turned
        size[Kind.PLANET] += float(np.sum(np.abs(rest) ** 2))
    return {kind: math.sqrt(value) for kind, value in size.items()}

"""Small gearboxes for the speed study."""

from __future__ import annotations

from typing import Any

from mbs_models.model.parameters import Drivetrain
from tests.geared import lin_parker
from tests.strategies import changed

TEETH, RADIUS, STIFFNESS, MASS = 20, 0.05, 2e8, 1.0  # of both gears; MASS: I/r², kg
HELD = 1e13  # N/m: bearings so stiff that the pair turns alone

HARMONIC = {"shape": "harmonics", "harmonics": [[0.1, 0.0]]}
ERROR = {"harmonics": [[2e-6, 0.0]]}


def pair(*, beta: float = 4e-6, torque: float | None = 100.0, **stage: Any) -> Drivetrain:
    """Two equal gears, held sideways: one elastic mode of turning at √(2k/m)."""
    gear = {
        "mass": MASS,
        "teeth": TEETH,
        "base_radius": RADIUS,
        "polar_inertia_over_r2": MASS,
        "diametral_inertia_over_r2": MASS,
        "bearing_y": HELD,
        "bearing_z": HELD,
        "bearing_rocking_over_r2": HELD,
    }
    table = {
        "type": "parallel",
        "name": "pair",
        "helix_angle": 0.0,
        "mesh_stiffness": STIFFNESS,
        "pinion": gear,
        "wheel": gear,
    }
    operation: dict[str, Any] = {"input": "pair.pinion", "speed_range": [0.0, 12000.0]}
    if torque is not None:
        operation["torque"] = torque
    return Drivetrain.model_validate(
        {
            "name": "Two gears",
            "stage": [table | stage],
            "operation": operation,
            "damping": {"stiffness_proportional": beta},
        }
    )


def planetary(planets: int = 4, **stage: Any) -> Drivetrain:
    """Lin & Parker's gear set, damped, its sun meshes varying unless told otherwise."""
    varying = {"sun_mesh_variation": {"shape": "trapezoid", "contact_ratio": 1.6}} | stage
    drivetrain = lin_parker(planets, beta=2e-6, alpha=20.0, **varying)
    assert drivetrain.operation is not None
    return changed(drivetrain, operation=drivetrain.operation.model_copy(update={"torque": 100.0}))

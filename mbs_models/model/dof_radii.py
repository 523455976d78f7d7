"""The DoFs of a drivetrain by label, without building it, and the radii of its rotations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .parameters import Drivetrain, ParallelStage, PlanetaryStage


def dof_radii(drivetrain: Drivetrain) -> Mapping[str, float | None]:
    """Label → radius r of a rotation carried as r·θ (m); None for a translation.

    The labels are those of the whole drivetrain, the derived ones of rigid hubs included.
    """
    radii: dict[str, float | None] = {}
    for stage in drivetrain.stages:
        radii |= _parallel(stage) if stage.type == "parallel" else _planetary(stage)
    radii |= {f"{rotor.name}.w": rotor.radius for rotor in drivetrain.inertias}
    return radii | {f"{coupling.name}.w": coupling.radius for coupling in drivetrain.couplings}


def _parallel(stage: ParallelStage) -> dict[str, float | None]:
    radii: dict[str, float | None] = {}
    for body in stage.bodies:
        at, r = f"{stage.name}.{body}", stage.radius(body)
        radii |= {f"{at}.w": r, f"{at}.y": None, f"{at}.z": None, f"{at}.rho": r}
    return radii


def _planetary(stage: PlanetaryStage) -> dict[str, float | None]:
    bodies = {body: stage.radius(body) for body in stage.bodies}
    bodies |= {f"planet{p}": stage.planet.base_radius for p in range(1, stage.planet_count + 1)}
    radii: dict[str, float | None] = {}
    for body, r in bodies.items():
        at = f"{stage.name}.{body}"
        radii |= {f"{at}.u": None, f"{at}.v": None, f"{at}.w": r}
    return radii

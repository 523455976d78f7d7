"""Gears over a whole speed range: seconds for 30, 100 and 300 speeds.

    python -m tests.benchmarks.speed_range

Two presets with varying meshes and transmission errors: ``paper-table2`` with teeth in its reducer
(9 meshes, two mesh frequencies) and ``wind-turbine`` (13 meshes, three). What is timed: the steady
state with all spring forces and accelerations, its extremes, and stability of each stage alone.
Beside it stand the largest residual and truncation of the balance, and what exudyn in time takes
for a single speed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fbs import (
    PeriodicResponse,
    Quantity,
    extremes,
    outputs,
    stability_by_period,
    steady_state,
)
from mbs_models.gears.operating_point import operating_point
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, ParallelStage
from tests.strategies import changed, with_stage
from validation.routes.periodic_meshes import PeriodicDrivetrain, parametric
from validation.speed.plan import plan
from validation.speed.run import run

SPEEDS = (30, 100, 300)
TRAPEZOID = {"shape": "trapezoid", "contact_ratio": 1.6, "amplitude": 0.3}
ERROR = {"harmonics": [[2e-6, 0.0], [1e-6, 30.0], [0.5e-6, 60.0]]}


def varied(drivetrain: Drivetrain) -> Drivetrain:
    """With a trapezoid and a transmission error at every mesh, and light damping."""
    for stage in drivetrain.stages:
        family = "mesh" if isinstance(stage, ParallelStage) else None
        keys: dict[str, Any] = {}
        for name in (family,) if family else ("sun_mesh", "ring_mesh"):
            keys[f"{name}_variation"] = TRAPEZOID
            keys[f"{name}_transmission_error"] = ERROR
        drivetrain = with_stage(drivetrain, stage.name, **keys)
    return changed(drivetrain, damping={"stiffness_proportional": 1e-6, "mass_proportional": 20.0})


def reducer() -> Drivetrain:
    """``paper-table2``, the reducer with 40 teeth on 40."""
    preset = load("paper-table2")
    tables = preset.stage("reducer").model_dump(exclude_unset=True)
    gears = {gear: tables[gear] | {"teeth": 40} for gear in ("pinion", "wheel")}
    return varied(with_stage(preset, "reducer", **gears))


def timed(name: str, job: Callable[[], Any]) -> Any:
    """Run once, print the seconds."""
    start = time.perf_counter()
    result = job()
    print(f"    {name:<34}{time.perf_counter() - start:8.2f} s")
    return result


def gears(model: PeriodicDrivetrain, speeds: np.ndarray) -> None:
    """Everything but stability, at all speeds."""

    def lines() -> PeriodicResponse:
        response = steady_state(model.system, model.springs, speeds)
        outputs(response, np.eye(len(model.system.dofs)), quantity=Quantity.ACCELERANCE)
        return response

    response = timed("steady state, accelerations", lines)
    timed("extremes of mesh forces", lambda: extremes(response.spring_forces, response.lattice))
    print(
        f"    {len(response.lattice.points)} lines in {response.lattice.n_phases} phases; residual "
        f"{response.residual.max():.1e}, truncation {response.truncation.max():.1e}"
    )


def stable(model: PeriodicDrivetrain, speeds: np.ndarray) -> None:
    """Stability of every stage that varies, the others at their mean."""
    name = "stability of each period"
    found = timed(name, lambda: stability_by_period(model.system, model.springs, speeds))
    for group, result in found:
        print(
            f"      {len(group)} meshes: {result.n_modes} modes, {result.left_out:.1e} of a mesh's "
            f"flexibility above; growth {result.growth_rate.min():.3g} to "
            f"{result.growth_rate.max():.3g} 1/s"
        )


def witnessed(drivetrain: Drivetrain, torque: float, rpm: float) -> None:
    """What exudyn takes for one speed."""
    asked = plan(drivetrain, speed=f"{rpm:g}", torque=torque, check=f"{rpm:g}")
    timed(f"exudyn in time, {rpm:g} rpm alone", lambda: run(asked))


def main() -> None:
    """Print the table."""
    for drivetrain, torque, span in (
        (reducer(), 20.0, (300.0, 6000.0)),
        (varied(load("wind-turbine")), 4e6, (6.9, 12.1)),
    ):
        point = operating_point(drivetrain, speed_rpm=span[1], torque=torque)
        model = parametric(drivetrain, point)
        print(f"{drivetrain.name}: {len(model.system.dofs)} DoFs, {len(model.springs)} meshes")
        for count in SPEEDS:
            speeds = np.linspace(*span, count) / 60.0
            print(f"  {count} speeds, {span[0]:g} to {span[1]:g} rpm")
            gears(model, speeds)
            stable(model, speeds)
        witnessed(drivetrain, torque, span[1])


if __name__ == "__main__":
    main()

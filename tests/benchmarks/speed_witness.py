"""Harmonic balance against exudyn in time: every order above 1 % of the largest, at random speeds.

    python -m tests.benchmarks.speed_witness [SPEEDS]

Three drivetrains with varying meshes and transmission errors: a pair, a planetary stage, and the
reducer with its planetary stage. Half of the speeds are random, half near the highest peaks.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from mbs_models.model.parameters import Drivetrain
from tests.benchmarks.speed_range import reducer
from tests.gearboxes import pair, planetary
from tests.strategies import changed
from validation.speed.plan import plan
from validation.speed.run import run

SPEEDS = 20
TRAPEZOID = {"shape": "trapezoid", "contact_ratio": 1.6}
ERROR = {"harmonics": [[1e-6, 0.0], [5e-7, 40.0]]}


def drivetrains() -> tuple[tuple[Drivetrain, float, float, float], ...]:
    """Each with its torque (N m) and the range of input speeds (rpm)."""
    damping = {"stiffness_proportional": 2e-6, "mass_proportional": 50.0}
    return (
        (pair(mesh_variation=TRAPEZOID, mesh_transmission_error=ERROR), 100.0, 500.0, 8000.0),
        (planetary(ring_mesh_variation=TRAPEZOID), 30.0, 500.0, 6000.0),
        (changed(reducer(), damping=damping), 100.0, 500.0, 3000.0),
    )


def chosen(drivetrain: Drivetrain, torque: float, first: float, last: float, n: int) -> list[float]:
    """Random speeds, and such as lie about 1 % beside the highest peaks."""
    generator = np.random.default_rng(7)
    found = run(plan(drivetrain, speed=f"{first}:{last}:{(last - first) / 100}", torque=torque))
    peaks = [peak.speed_rpm for peak in found.peaks][: n // 2]
    near = [rpm * (1.0 + 0.01 * generator.uniform(-1.0, 1.0)) for rpm in peaks]
    random = generator.uniform(first, last, n - len(near)).tolist()
    return [round(rpm, 1) for rpm in sorted([*near, *random]) if first < rpm < last]


def main() -> None:
    """Print the largest differences at every speed."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else SPEEDS
    for drivetrain, torque, first, last in drivetrains():
        print(f"{drivetrain.name}, {torque:g} N m")
        for rpm in chosen(drivetrain, torque, first, last, n):
            began = time.perf_counter()
            found = run(plan(drivetrain, speed=f"{rpm:g}", torque=torque, check=f"{rpm:g}"))
            (seen,) = found.references
            ratio = seen.ratio
            meshes = np.abs(ratio[:, : len(seen.meshes)] - 1.0).max()
            decibels = np.abs(20.0 * np.log10(ratio[:, len(seen.meshes) :])).max()
            print(
                f"  {rpm:8.1f} rpm: mesh forces {meshes:.1e}, accelerations {decibels:.1e} dB, "
                f"{int(seen.comparable.sum())} lines compared, {seen.unsettled} not settled, "
                f"{'agree' if found.agrees else 'DISAGREE'}, {time.perf_counter() - began:.0f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()

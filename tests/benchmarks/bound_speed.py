"""What bounding coupled FRFs costs on top of coupling them.

    python -m tests.benchmarks.bound_speed

Parts cut to their modes below 6 kHz, with R_0 and R_1, a loss factor of 1 %, 4000 lines to 4 kHz:
`modal_frf` and `couple` on the one hand, `bounded_frf` on the other, both from ready truncated
modes; the shortest of several runs each, in turn, in seconds of processor time. A few FRFs: the
drive points of five DoFs and one FRF through, whose bounds are asked for. All FRFs: what bounds
every one of them, one number of its response and one of its excitation for each part; the table of
all bounds, which takes as long to write as the FRFs do, is timed apart.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fbs import (
    BoundedFrf,
    Joint,
    SecondOrderSystem,
    TruncatedPart,
    bounded_frf,
    couple,
    frequency_axis,
    modal_frf,
    real_modes,
)
from mbs_models.model.model_file import load
from mbs_models.model.parameters import PlanetaryStage
from tests.planetary_chain import planetary_chain
from validation.routes.source import equations_source

LINES = frequency_axis(1, 4000, 1)
CUT, LOSS, FEW, STAGES, RUNS = 6000.0, 0.01, 5, 3, 11


def drivetrains() -> dict[str, Any]:
    """Return the paper's reducer and stage, the wind turbine, and a chain of planetary stages."""
    presets = {name: load(name) for name in ("paper", "wind-turbine")}
    stage = next(part for part in presets["paper"].parts if isinstance(part, PlanetaryStage))
    return presets | {f"chain of {STAGES}": planetary_chain(stage, STAGES)}


def seconds(jobs: Sequence[Callable[[], Any]]) -> list[float]:
    """Return the shortest time of each job, all of them in turn."""
    least = [np.inf] * len(jobs)
    for _ in range(RUNS):
        for k, job in enumerate(jobs):
            start = time.process_time()
            job()
            least[k] = min(least[k], time.process_time() - start)
    return least


def costs(
    systems: Mapping[str, SecondOrderSystem], joints: Sequence[Joint], labels: list[str], few: bool
) -> tuple[float, float, float]:
    """Return seconds of summing and coupling, of that with bounds, and of all bounds' table."""
    parts = {}
    for name, system in systems.items():
        modes = real_modes(system)
        below = modes.natural_frequencies < CUT
        parts[name] = TruncatedPart.of(system, below, 1, modes)
    ends = [end for joint in joints for end in (joint.first, joint.second)]
    ports = {
        name: list(
            dict.fromkeys(
                [label for owner, label in ends if owner == name]
                + [label for label in labels if label in system.labels]
            )
        )
        for name, system in systems.items()
    }
    pairs = [*((label, label) for label in labels), (labels[-1], labels[0])] if few else []

    def coupled() -> None:
        frfs = {
            name: modal_frf(part.system, LINES, ports[name], ports[name], modes=part.modes)
            for name, part in parts.items()
            if ports[name]
        }
        couple(frfs, joints, labels, labels)

    def bounded() -> BoundedFrf:
        found = bounded_frf(parts, joints, LINES, labels, labels)
        for pair in pairs:
            found.between(*pair)
        return found

    found = bounded()
    table = lambda: replace(found).bound  # noqa: E731
    plain, with_bounds, every = seconds([coupled, bounded, table])
    return plain, with_bounds, every


def main() -> None:
    """Print one row a drivetrain and choice of FRFs."""
    print(f"{'drivetrain':14} FRFs  joints  couple, ms  with bounds, ms  on top  table, ms")
    for name, drivetrain in drivetrains().items():
        source = equations_source(drivetrain)
        systems = {n: replace(s, loss_factor=LOSS) for n, s in source.stages.items()}
        every = list(dict.fromkeys(dof for system in systems.values() for dof in system.dofs))
        for labels in (every[:: len(every) // FEW][:FEW], every):
            few = len(labels) == FEW
            plain, bounded, table = costs(systems, source.joints, labels, few)
            asked = FEW + 1 if few else len(labels) ** 2
            print(
                f"{name:14} {asked:5} {len(source.joints):6} {1e3 * plain:11.1f} "
                f"{1e3 * bounded:15.1f} {100 * (bounded / plain - 1):6.0f}% {1e3 * table:10.1f}"
            )


if __name__ == "__main__":
    main()

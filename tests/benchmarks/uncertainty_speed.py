"""First-order errors of a measured part against the coupling itself, side by side in one run.

    python -m tests.benchmarks.uncertainty_speed [MODEL]

All FRFs of a drivetrain on 15 000 lines, each of its parts taken as measured in turn: processor
seconds (the least of several runs) of `couple` and of `coupled_uncertainty`, which couples too, and
their ratio.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator

import numpy as np

from fbs import couple, frequency_axis, synthesize
from fbs.measured.uncertainty import Scatter, coupled_uncertainty
from mbs_models.model.model_file import load
from tests.strategies import damped
from validation.routes.source import equations_source

RUNS = 7
LINES = frequency_axis(1.0, 15000.0, 1.0)


def seconds(job: Callable[[], object]) -> float:
    """Return the least processor time of several runs after a first one."""
    job()
    found = []
    for _ in range(RUNS):
        start = time.process_time()
        job()
        found.append(time.process_time() - start)
    return min(found)


def ratios(model: str = "paper") -> Iterator[tuple[str, float, float]]:
    """Yield part, seconds of the coupling, seconds with its errors."""
    source = equations_source(damped(load(model)))
    stages = {name: synthesize(system, LINES).frf for name, system in source.stages.items()}
    for part, frf in stages.items():
        errors = Scatter.relative(frf, 0.02, np.deg2rad(2.0))
        alone = seconds(lambda: couple(stages, source.joints))
        both = seconds(
            lambda part=part, errors=errors: coupled_uncertainty(  # type: ignore[misc]
                stages, source.joints, part, errors
            )
        )
        yield part, alone, both


def main() -> None:
    """Print the table."""
    for part, alone, both in ratios(*sys.argv[1:2]):
        print(f"{part}: coupling {alone:.4f} s, with errors {both:.4f} s, {both / alone:.2f} times")


if __name__ == "__main__":
    main()

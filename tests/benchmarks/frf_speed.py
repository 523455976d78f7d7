"""FRF synthesis and coupling against the cost of writing the result, side by side in one run.

    python -m tests.benchmarks.frf_speed [MODEL]

All FRFs of a drivetrain on 15 000 lines: seconds (median of several runs after a warm-up), the
ratio to writing the result once to fresh memory, and the largest scaled error against the direct
solve. Ratios are what to look at: they are measured in the same run on the same machine. With the
``oracles`` extra installed, sdynpy's coupling of the same stage FRFs stands beside ours.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import numpy as np

from fbs import Frf, couple, direct_frf, frequency_axis, modal_frf, real_modes
from mbs_models.model_file import load
from tests.strategies import damped
from validation.metrics import scaled_error
from validation.routes import EQUATIONS, Model, build_model

RUNS = 5
LINES = frequency_axis(1.0, 15000.0, 1.0)


def timed(job: Callable[[], Any]) -> tuple[float, Any]:
    """Median seconds of several runs after one that is not counted, and the last result."""
    result = job()
    seconds = []
    for _ in range(RUNS):
        del result
        start = time.perf_counter()
        result = job()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), result


def written(values: np.ndarray) -> np.ndarray:
    """The result written once to fresh memory."""
    fresh = np.empty_like(values)
    fresh[...] = 1.0
    return fresh


def general(model: Model) -> Any:
    """The whole with one damper that makes the damping non-proportional."""
    damping = model.whole.damping.copy()
    damping[0, 0] += 50.0
    return replace(model.whole, damping=damping)


def sdynpy_coupling(model: Model, stages: dict[str, Frf]) -> Callable[[], Any] | None:
    """sdynpy's coupling of the same stage FRFs by coordinates, where it is installed."""
    if find_spec("sdynpy") is None or len(model.joints) != 1:
        return None
    import sdynpy as sdpy

    numbers = {label: i for i, label in enumerate(dict.fromkeys(_labels(stages)), start=1)}
    parts = []
    for offset, frf in enumerate(stages.values()):
        nodes = np.array([numbers[label] + 1000 * offset for label in frf.responses])
        dofs = sdpy.coordinate_array(nodes, 1)
        pairs = sdpy.coordinate.outer_product(dofs, dofs)
        ordinate = np.ascontiguousarray(frf.values.transpose(1, 2, 0))
        parts.append(
            sdpy.data_array(
                sdpy.data.FunctionTypes.FREQUENCY_RESPONSE_FUNCTION, LINES, ordinate, pairs
            )
        )
    whole = sdpy.data.TransferFunctionArray.block_diagonal_frf(parts)
    (joint,) = model.joints
    names = list(stages)
    ends = [
        numbers[label] + 1000 * names.index(part) for part, label in (joint.first, joint.second)
    ]
    pair = sdpy.coordinate_array(np.array([ends]), 1)
    return lambda: whole.substructure_by_coordinate(pair)


def _labels(stages: dict[str, Frf]) -> list[str]:
    return [label for frf in stages.values() for label in frf.responses]


def main(preset: str) -> None:
    """Print the table."""
    model = build_model(EQUATIONS, damped(load(preset)))
    stages = {name: direct_frf(system, LINES) for name, system in model.stages.items()}
    modes = real_modes(model.whole)
    labels = model.whole.labels
    jobs: list[tuple[str, Callable[[], Frf], str]] = [
        ("direct solve, line by line", lambda: direct_frf(model.whole, LINES), "direct"),
        (
            "modal synthesis, modes ready",
            lambda: modal_frf(model.whole, LINES, modes=modes),
            "direct",
        ),
        ("modal synthesis, general damping", lambda: modal_frf(general(model), LINES), "general"),
        ("coupling of ready stage FRFs", lambda: couple(stages, model.joints).frf, "direct"),
        (
            "one FRF by modal synthesis",
            lambda: modal_frf(model.whole, LINES, labels[:1], labels[-1:], modes=modes),
            "",
        ),
    ]
    references = {
        "direct": direct_frf(model.whole, LINES),
        "general": direct_frf(general(model), LINES),
    }
    base, _ = timed(lambda: written(references["direct"].values))
    print(f"{preset}: {len(labels)} DoFs, {len(labels) ** 2} FRFs, {len(LINES)} lines")
    print(f"{'':36}{'s':>9}{'× writing':>11}{'largest scaled error':>22}")
    print(f"{'writing the result once':36}{base:9.4f}{1.0:11.2f}")
    for name, job, against in jobs:
        seconds, frf = timed(job)
        error = ""
        if against:
            found = frf.select(labels, labels).values
            error = f"{scaled_error(references[against].values, found).max():.1e}"
        print(f"{name:36}{seconds:9.4f}{seconds / base:11.2f}{error:>22}")
    peer = sdynpy_coupling(model, stages)
    if peer is not None:
        seconds, _ = timed(peer)
        print(f"{'sdynpy, coupling by coordinate':36}{seconds:9.4f}{seconds / base:11.2f}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "paper")

"""Sweeps against rebuilding and solving the whole for every sample, side by side in one run.

    python -m tests.benchmarks.sweep_speed [k_sw] [processes] [memory]

k_sw: 1000 stiffnesses of the paper's coupling × 15 000 lines × one FRF, everything counted, from
the parameters on; rebuilding is timed on a few of the samples, each several times, and scaled.
processes: 2000 samples of a Monte Carlo by one process and by two, the start of the two counted.
memory: the peak of a sweep's process above what it needs without a result, by the result's size.
"""

from __future__ import annotations

import statistics
import sys
import time
import tracemalloc
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fbs import Frf, SecondOrderSystem, direct_frf, modal_frf
from fbs._kernels.blas_threads import one_blas_thread
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain
from validation.routes.bands import Band
from validation.routes.model_parameters import changed, model_data, steps_to
from validation.routes.source import equations_source
from validation.runtime.executors import process_pool
from validation.sweep.files import write_sweep
from validation.sweep.parameters import Samples, samples_of
from validation.sweep.pieces import Pieces
from validation.sweep.plan import SampleResults, SweepPlan, sweep_plan
from validation.sweep.result import SweepResult
from validation.sweep.run import sweep
from validation.sweep.sample import forget

RUNS = 5
PAIR = ("planetary.sun.w", "reducer.pinion.w")
SPRING = "coupling.second_stiffness"
PAPER = 70.0  # % less time than the full system's solution, claimed by the paper for its coupling
REBUILT = range(0, 1000, 111)


def seconds(job: Callable[[], Any], runs: int = RUNS) -> float:
    """Median of several runs after one that is not counted."""
    job()
    found = []
    for _ in range(runs):
        start = time.perf_counter()
        job()
        found.append(time.perf_counter() - start)
    return statistics.median(found)


def damped() -> Drivetrain:
    """The paper's drivetrain with Rayleigh damping."""
    data = model_data(load("paper"))
    keys = {"stiffness_proportional": 1e-6, "mass_proportional": 1.0}
    return changed(data, {steps_to(data, f"damping.{key}"): v for key, v in keys.items()})


def rebuilt(
    drivetrain: Drivetrain, stiffness: float, solve: Callable[..., Frf], lines: np.ndarray
) -> Frf:
    """One sample from its parameters on: validated, assembled, solved."""
    data = model_data(drivetrain)
    system = equations_source(changed(data, {steps_to(data, SPRING): stiffness})).whole
    return solve(system, lines, [PAIR[0]], [PAIR[1]])


def scaled_error(system: SecondOrderSystem, lines: np.ndarray, magnitude: np.ndarray) -> float:
    """Largest |Δ|H|| / √(h_response h_excitation) against the direct solve."""
    frf = direct_frf(system, lines)
    rows = [np.linalg.norm(frf.select([label]).values[:, 0], axis=1) for label in PAIR]
    error = np.abs(magnitude - np.abs(frf.between(*PAIR)))
    return float((error / np.sqrt(rows[0] * rows[1])).max())


def stiffness_sweep(name: str, drivetrain: Drivetrain) -> None:
    """The k_sw sweep of one drivetrain."""
    lines = Band().frequency()
    found = samples_of(drivetrain, [f"{SPRING}=1e5:1e7:1000log"])
    todo = sweep_plan(drivetrain, found, Band(), PAIR, 0, "equations")

    def ours() -> SampleResults:
        forget()  # the base is part of the sweep
        return sweep(todo, found.rows)

    mine = seconds(ours)
    print(f"\n{name}: {len(found.rows)} stiffnesses × {len(lines)} lines × one FRF")
    print(f"{'':44}{'s':>9}{'× ours':>9}{'% less time':>13}")
    print(f"{'sweep, one process':44}{mine:9.3f}{1.0:9.1f}{'':>13}")
    for method, solve in (("modal synthesis", modal_frf), ("plain (direct) solve", direct_frf)):
        with one_blas_thread():
            each = [
                seconds(
                    partial(rebuilt, drivetrain, found.rows[i][0], solve, lines),
                    3,
                )
                for i in REBUILT
            ]
        whole = statistics.mean(each) * len(found.rows)
        print(
            f"{f'rebuilt each time, {method}':44}{whole:9.1f}{whole / mine:9.1f}"
            f"{100 * (1 - mine / whole):13.2f}"
        )
    print(f"{'the paper, coupled instead of full':44}{'':9}{'':9}{PAPER:13.0f}")
    outcome, data = ours(), model_data(drivetrain)
    place = steps_to(data, SPRING)
    worst = max(
        scaled_error(
            equations_source(changed(data, {place: found.rows[i][0]})).whole,
            lines,
            outcome.magnitude[i],
        )
        for i in REBUILT
    )
    print(f"largest scaled error against the direct solve, {len(REBUILT)} samples: {worst:.1e}")


def monte_carlo(samples: int) -> tuple[SweepPlan, Samples]:
    """Three tolerances of the planetary stage: an FRF on 600 lines and ten modes by exudyn."""
    drivetrain = damped()
    options = [f"planetary.{key}=±10%" for key in ("sun_mesh_stiffness", "ring_mesh_stiffness")]
    found = samples_of(drivetrain, [*options, "planetary.planet_bearing=~5%"], samples=samples)
    return sweep_plan(drivetrain, found, Band(5.0, 3000.0, 5.0), PAIR), found


def two_processes() -> None:
    """One process against two, in turn."""
    todo, found = monte_carlo(2000)
    ones, twos, starts = [], [], []
    outcomes = []
    for _ in range(3):
        start = time.perf_counter()
        forget()
        outcomes.append(sweep(todo, found.rows))
        ones.append(time.perf_counter() - start)
        start = time.perf_counter()
        with process_pool(2) as workers:
            outcomes.append(sweep(todo, found.rows, workers))
        twos.append(time.perf_counter() - start)
        starts.append(first_answers())
    same = all(
        np.array_equal(outcomes[0].magnitude, o.magnitude)
        and np.array_equal(outcomes[0].frequency_hz, o.frequency_hz)
        for o in outcomes
    )
    one, two = statistics.median(ones), statistics.median(twos)
    print(f"\n{len(found.rows)} samples, {todo.n_lines} lines, {todo.n_modes} modes, by exudyn")
    print(f"{'one process':44}{one:9.2f} s")
    print(f"{'two processes, their start included':44}{two:9.2f} s{one / two:9.2f} ×")
    print(f"{'of it: until both have answered once':44}{statistics.median(starts):9.2f} s")
    print(f"{'the same bits':44}{same!s:>9}")


def first_answers() -> float:
    """Seconds until two new processes have computed a sample each."""
    todo, found = monte_carlo(20)
    start = time.perf_counter()
    with process_pool(2) as workers:
        sweep(todo, found.rows, workers)
    return time.perf_counter() - start


def written_sweep(samples: int, *, streamed: bool) -> float:
    """Bytes of a stiffness sweep's result, computed and written with its percentiles."""
    lines = Band(1.0, 30000.0, 1.0)
    found = samples_of(load("paper"), [f"{SPRING}=1e6±50%"], samples=samples)
    todo = sweep_plan(load("paper"), found, lines, PAIR, 0, "equations", streamed=streamed)
    with TemporaryDirectory() as name:
        pieces = Pieces(todo, found.rows, Path(name), streamed=streamed)
        room = pieces.magnitude((samples, todo.n_lines)) if streamed else None
        outcome = sweep(todo, found.rows, magnitude=room)
        from validation.sweep.figures import percentiles  # not for the worker processes

        percentiles(outcome.magnitude, np.arange(samples))
        file = pieces.magnitude_file if streamed else None
        write_sweep(SweepResult(load("paper"), todo, found, outcome, file), Path(name))
    return 8.0 * samples * todo.n_lines


def resident_peak(samples: int) -> tuple[float, float]:
    """(peak of this new process' resident memory, size of the result), in bytes."""
    size = written_sweep(samples, streamed=False)
    # ru_maxrss would be the parent's where that is larger
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return 1024.0 * float(status.partition("VmHWM:")[2].split()[0]), size


def allocated_peak(samples: int) -> tuple[float, float]:
    """(peak of what is allocated, the mapped file left out; size of the file), in bytes."""
    import validation.sweep.figures  # noqa: F401  # what modules take is no part of it

    tracemalloc.start()
    size = written_sweep(samples, streamed=True)
    return float(tracemalloc.get_traced_memory()[1]), size


def memory() -> None:
    """Peaks of fresh processes."""
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        base, small = pool.submit(resident_peak, 10).result()
        top, size = pool.submit(resident_peak, 2000).result()
        streamed = {n: pool.submit(allocated_peak, n).result() for n in (500, 2000)}
    print(f"\nresult of {size / 1e6:.0f} MB, written with its percentiles")
    print(f"{'peak above that of ten samples, × result':44}{(top - base) / (size - small):9.2f}")
    for n, (allocated, file) in streamed.items():
        text = f"streamed, {n} samples ({file / 1e6:.0f} MB): allocated"
        print(f"{text:44}{allocated / 1e6:9.0f} MB")


def main(parts: list[str]) -> None:
    """Print the tables."""
    if "k_sw" in parts:
        stiffness_sweep("undamped", load("paper"))
        stiffness_sweep("damped", damped())
    if "processes" in parts:
        two_processes()
    if "memory" in parts:
        memory()


if __name__ == "__main__":
    main(sys.argv[1:] or ["k_sw", "processes", "memory"])

"""Chains of planetary stages: stage by stage, against the whole solved by every other method.

    python -m tests.benchmarks.chain_speed [LENGTH ...]

The four FRFs between the first stage's sun and the last stage's carrier (w), on 15 000 lines, from
ready M, C, K; all stages differ, damping is proportional. Seconds are medians; every method runs
with one BLAS thread and with two, and the faster counts (the reduced model and ``real_modes``:
with one, two only wait for each other there). Line by line methods are timed on some lines, as
stated, and scaled to all. Errors are the largest scaled error (between the two DoFs) against the
plain dense solution on its lines.
"""

from __future__ import annotations

import json
import os
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fbs import (
    FbsError,
    Frf,
    SecondOrderSystem,
    SparseSystem,
    couple_chain,
    direct_frf,
    frequency_axis,
    modal_frf,
    reduced_frf,
    sparse_frf,
)
from validation.checks.metrics import scaled_error

LENGTHS = (1, 2, 5, 10, 20, 50)
LINES = frequency_axis(1.0, 15000.0, 1.0)
THREADS = ("1", "2")
ROUNDS = 11
STAGE_WISE = "stage by stage"
OURS = "modal, real_modes"
EIGH = "modal, scipy eigh"
EIGH_FEW = "modal, eigh, modes at rest out"
DENSE, SPARSE, REDUCED = "dense direct", "sparse direct", "reduced (Krylov)"


def median_time(job: Callable[[], Any], runs: int) -> tuple[float, Any]:
    """Median seconds, after one run that is not counted where there are several."""
    result = job() if runs > 1 else None
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        result = job()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), result


def fastest_modal(whole: SecondOrderSystem, ends: list[str], few: bool) -> Frf:
    """Modal synthesis as bare as it gets: eigh with a diagonal M, C = alpha M + beta K known."""
    from scipy.linalg import eigh

    root = np.sqrt(np.diag(whole.mass))
    square, vectors = eigh(whole.stiffness / np.outer(root, root), driver="evd")
    at = [whole.dofs.index(label) for label in ends]
    shapes = vectors[at] / root[at, None]
    friction = np.einsum("ir,ir->r", vectors, (whole.damping / np.outer(root, root)) @ vectors)
    if few:
        part = (np.abs(vectors[at]) > 16 * len(root) * np.finfo(float).eps).any(axis=0)
        square, shapes, friction = square[part], shapes[:, part], friction[part]
    weights = np.stack([shapes[0] * shapes[0], shapes[0] * shapes[1], shapes[1] * shapes[1]])
    values = np.empty((2, 2, LINES.size), dtype=complex)
    for start in range(0, LINES.size, 256):
        lines = slice(start, start + 256)
        omega = 2 * np.pi * LINES[lines]
        real = square[:, None] - omega**2
        imaginary = friction[:, None] * omega
        size = 1 / (real**2 + imaginary**2)
        pairs = weights @ (real * size) - 1j * (weights @ (imaginary * size))
        values[0, 0, lines], values[0, 1, lines], values[1, 1, lines] = pairs
    values[1, 0] = values[0, 1]
    return Frf(LINES, values.transpose(2, 0, 1), tuple(ends), tuple(ends))


def measure(path: str) -> None:
    """Measure one chain with this process's BLAS threads; print JSON."""
    stages, joints, whole, ends = pickle.loads(Path(path).read_bytes())
    n = len(whole.dofs)
    dense_lines = LINES[:: min(500, max(1, int(LINES.size * n**3 / 2e9)))]
    sparse_lines = LINES[::50]
    sparse = SparseSystem.of(whole)
    seconds, exact = median_time(lambda: direct_frf(whole, dense_lines, ends, ends), 1)
    found: dict[str, dict[str, Any]] = {
        DENSE: {"s": seconds * LINES.size / dense_lines.size, "note": dense_lines.size}
    }

    def note(name: str, seconds: float, frf: Frf, text: Any = "") -> None:
        shared = np.isin(dense_lines, frf.frequency)
        at = np.searchsorted(frf.frequency, dense_lines[shared])
        error = scaled_error(exact.values[shared], frf.values[at]).max()
        found[name] = {"s": seconds, "error": float(error), "note": text}

    seconds, chain = median_time(lambda: couple_chain(stages, joints, LINES, ends, ends), 7)
    note(STAGE_WISE, seconds, chain.frf, f"kernel {chain.kernel_condition.max():.0e}")
    for name, few in ((EIGH, False), (EIGH_FEW, True)):
        seconds, frf = median_time(partial(fastest_modal, whole, ends, few), 5)
        note(name, seconds, frf)
    seconds, frf = median_time(lambda: sparse_frf(sparse, sparse_lines, ends, ends), 1)
    note(SPARSE, seconds * LINES.size / sparse_lines.size, frf, sparse_lines.size)
    if os.environ["OPENBLAS_NUM_THREADS"] == "1":
        seconds, frf = median_time(lambda: modal_frf(whole, LINES, ends, ends), 1 if n > 200 else 3)
        note(OURS, seconds, frf)
        try:
            seconds, reduced = median_time(lambda: reduced_frf(sparse, LINES, ends, ends), 1)
            order = f"order {len(reduced.system.dofs)}, est. {reduced.error_estimate.max():.0e}"
            note(REDUCED, seconds, reduced.frf, order)
        except FbsError as error:
            found[REDUCED] = {"s": float("nan"), "note": str(error)}
    print(json.dumps(found))


def measure_in_turn(paths: list[str]) -> None:
    """Time all chains in turn, round by round, so that they see the same machine; print JSON."""
    chains = [pickle.loads(Path(path).read_bytes()) for path in paths]
    seconds = np.empty((ROUNDS, len(chains)))
    for row in seconds:
        for k, (stages, joints, _, ends) in enumerate(chains):
            start = time.perf_counter()
            couple_chain(stages, joints, LINES, ends, ends)
            row[k] = time.perf_counter() - start
    print(json.dumps([np.median(seconds, axis=0).tolist(), seconds.min(axis=0).tolist()]))


def chain_files(folder: str, lengths: list[int]) -> dict[int, tuple[str, int]]:
    """Build the chains; {length: (file, DoFs)}."""
    from mbs_models.model.model_file import load
    from mbs_models.model.parameters import PlanetaryStage
    from tests.planetary_chain import planetary_chain
    from tests.strategies import DAMPED
    from validation.routes.source import equations_source

    (stage,) = load("lin-parker-4").stages_of(PlanetaryStage)
    files = {}
    for length in lengths:
        model = equations_source(planetary_chain(stage, length, damping=DAMPED))
        ends = ["stage1.sun.w", f"stage{length}.carrier.w"]
        path = Path(folder) / f"{length}.pickle"
        path.write_bytes(pickle.dumps((dict(model.stages), model.joints, model.whole, ends)))
        files[length] = str(path), len(model.whole.dofs)
    return files


def alone(threads: str, *arguments: str) -> Any:
    """What a process of its own prints, with so many BLAS threads."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
    command = [sys.executable, "-m", "tests.benchmarks.chain_speed", *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def measured(path: str) -> dict[str, dict[str, Any]]:
    """Each method's faster run of one and of two BLAS threads."""
    runs = [alone(threads, "--measure", path) for threads in THREADS]
    return {
        name: min((run[name] for run in runs if name in run), key=lambda one: one["s"])
        for name in runs[0]  # one thread: it has them all
    }


def print_table(length: int, size: int, table: dict[str, dict[str, Any]]) -> None:
    """Print one chain's methods."""
    ours = table[STAGE_WISE]["s"]
    print(f"\n{length} stages, {size} DoFs, {LINES.size} lines, 4 FRFs")
    print(f"{'':32}{'s':>10}{'ms/stage':>10}{'× ours':>8}{'error':>9}  note (timed on, order)")
    for name, row in table.items():
        error = f"{row['error']:.0e}" if "error" in row else ""
        each, ratio = 1e3 * row["s"] / length, row["s"] / ours
        note = f"{row['note']} lines" if isinstance(row["note"], int) else row["note"]
        print(f"{name:32}{row['s']:10.4f}{each:10.2f}{ratio:8.2f}{error:>9}  {note}", flush=True)


def main(lengths: list[int]) -> None:
    """Print the tables."""
    tables = {}
    with tempfile.TemporaryDirectory() as folder:
        files = chain_files(folder, lengths)
        for length, (path, size) in files.items():
            tables[length] = measured(path)
            print_table(length, size, tables[length])
        turns = alone("1", "--in-turn", *(path for path, _ in files.values()))
    ours = {length: table[STAGE_WISE]["s"] for length, table in tables.items()}
    print(f"\n{STAGE_WISE}, all lengths in turn, {ROUNDS} rounds, ms per stage")
    print(f"{'stages':>8}{'median':>8}{'least':>8}")
    for length, median, least in zip(lengths, *turns, strict=True):
        print(f"{length:8}{1e3 * median / length:8.2f}{1e3 * least / length:8.2f}")
    for name in (DENSE, SPARSE, OURS, EIGH, EIGH_FEW, REDUCED):
        faster = [length for length in lengths if tables[length][name]["s"] > ours[length]]
        ever = [n for n in faster if {m for m in lengths if m > n} <= set(faster)]
        where = f"from {min(ever)} stages on" if ever else "at no length for good"
        print(f"{STAGE_WISE} is faster than {name}: {where} ({faster})")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        measure(sys.argv[2])
    elif sys.argv[1:2] == ["--in-turn"]:
        measure_in_turn(sys.argv[2:])
    else:
        main([int(length) for length in sys.argv[1:]] or list(LENGTHS))

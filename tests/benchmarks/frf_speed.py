"""FRF synthesis and coupling against the cost of writing the result, side by side in one run.

    python -m tests.benchmarks.frf_speed [MODEL]

All FRFs of a drivetrain on 15 000 lines: seconds (the first call, then the median of several
runs), the ratio to writing the result once to fresh memory, and the largest scaled error against
the direct solve. Ratios are what to look at: they are measured in the same run on the same
machine. With the ``oracles`` extra installed, sdynpy and pyFBS stand beside ours, each by the way
its users go: pyFBS's modal synthesis of the stages (with our modes: its own come from
finite-element files) and, since its coupling module is empty, the expression
Y - Y B^T pinv(B Y B^T) B Y; sdynpy's line-by-line FRFs and its coupling by coordinate.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
import tracemalloc
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import numpy as np

from fbs import (
    Frf,
    RealModes,
    SecondOrderSystem,
    complex_modes,
    couple,
    direct_frf,
    frequency_axis,
    modal_frf,
    real_modes,
)
from fbs._kernels.blocks import cores
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Damping
from tests.strategies import damped
from validation.checks.metrics import scaled_error
from validation.routes.source import Source, equations_source

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # sdynpy's import opens a display else

RUNS = 7
LINES = frequency_axis(1.0, 15000.0, 1.0)
DAMPING = Damping(stiffness_proportional=1e-6)  # pyFBS has ratios only: none for rigid motion

Stages = Mapping[str, Frf]


@dataclass(frozen=True)
class Row:
    """One line of the table: a job, its values, and what they should be."""

    name: str
    job: Callable[[], Any]
    values: Callable[[Any], np.ndarray]
    reference: np.ndarray


@dataclass(frozen=True)
class Timing:
    """Seconds of the first call and of the others (median), and the last result."""

    first: float
    median: float
    result: Any


def timed(job: Callable[[], Any]) -> Timing:
    """Time several runs after a first one, each result let go of before the next begins."""
    seconds = []
    result = None
    for _ in range(RUNS + 1):
        del result
        start = time.perf_counter()
        result = job()
        seconds.append(time.perf_counter() - start)
    return Timing(seconds[0], statistics.median(seconds[1:]), result)


def peak_memory(job: Callable[[], Any]) -> int:
    """Bytes at the worst moment of a job, its result included."""
    tracemalloc.start()
    try:
        result = job()
        peak = tracemalloc.get_traced_memory()[1]
        del result
    finally:
        tracemalloc.stop()
    return peak


def written(count: int) -> np.ndarray:
    """All FRFs of `count` labels written once to fresh memory."""
    fresh = np.empty((count, count, len(LINES)), dtype=complex)
    fresh[...] = 1.0
    return fresh


def general(system: SecondOrderSystem) -> SecondOrderSystem:
    """The system with one damper that makes the damping non-proportional."""
    damping = system.damping.copy()
    damping[0, 0] += 50.0
    return replace(system, damping=damping)


def own(source: Source) -> Iterator[Row]:
    """Ours, of the whole drivetrain."""
    whole, other = source.whole, general(source.whole)
    labels = whole.labels
    direct, direct_general = (direct_frf(system, LINES).values for system in (whole, other))
    modes, pairs = real_modes(whole), complex_modes(other)
    jobs: list[tuple[str, Callable[[], Frf], np.ndarray]] = [
        ("direct solve, line by line", lambda: direct_frf(whole, LINES), direct),
        ("modal synthesis, modes ready", lambda: modal_frf(whole, LINES, modes=modes), direct),
        ("modal synthesis, modes included", lambda: modal_frf(whole, LINES), direct),
        (
            "general damping, modes ready",
            lambda: modal_frf(other, LINES, modes=pairs),
            direct_general,
        ),
        ("general damping, modes included", lambda: modal_frf(other, LINES), direct_general),
        (
            "one FRF, modes ready",
            lambda: modal_frf(whole, LINES, labels[:1], labels[-1:], modes=modes),
            direct[:, :1, -1:],
        ),
    ]
    for name, job, reference in jobs:
        yield Row(name, job, lambda frf: frf.values, reference)


def synthesis_of_stages(source: Source) -> Iterator[Row]:
    """Ours and the peers': every stage's FRFs, eigensolution and matrices ready."""
    systems = [*source.stages.values()]
    modes = [real_modes(system) for system in systems]
    reference = block_diagonal([direct_frf(system, LINES).values for system in systems])
    yield Row(
        "synthesis of the stages",
        lambda: [modal_frf(s, LINES, modes=m) for s, m in zip(systems, modes, strict=True)],
        lambda frfs: block_diagonal([frf.values for frf in frfs]),
        reference,
    )
    if find_spec("pyfbs") is not None:
        peers = [pyfbs_synthesis(s, m) for s, m in zip(systems, modes, strict=True)]
        yield Row("  pyFBS", lambda: [peer() for peer in peers], block_diagonal, reference)
    if find_spec("sdynpy") is not None:
        jobs = [sdynpy_synthesis(system) for system in systems]
        yield Row(
            "  sdynpy",
            lambda: [job() for job in jobs],
            lambda found: block_diagonal([lines_first(part) for part in found]),
            reference,
        )


def coupling(source: Source, stages: Stages) -> Iterator[Row]:
    """Ours and the peers': the same stage FRFs coupled."""
    nodes = [(name, label) for name, frf in stages.items() for label in frf.responses]
    labels = tuple(dict.fromkeys(label for _, label in nodes))
    kept = [next(i for i, node in enumerate(nodes) if node[1] == label) for label in labels]
    reference = direct_frf(source.whole, LINES, labels, labels).values
    yield Row(
        "coupling of ready stage FRFs",
        lambda: couple(stages, source.joints),
        lambda coupled: coupled.frf.values,
        reference,
    )
    if len(source.joints) != 1 or not source.joints[0].rigid:
        return
    (joint,) = source.joints
    ends = (nodes.index(joint.first), nodes.index(joint.second))
    if find_spec("pyfbs") is not None:
        y = block_diagonal([frf.values for frf in stages.values()])
        yield Row(
            "  the expression pyFBS's users write",
            lambda: lm_fbs(y, ends),
            lambda found: found[:, kept][:, :, kept],
            reference,
        )
    if find_spec("sdynpy") is not None:
        yield Row(
            "  sdynpy",
            sdynpy_coupling(stages, ends),
            lambda found: lines_first(found)[:, kept][:, :, kept],
            reference,
        )


def block_diagonal(parts: list[np.ndarray]) -> np.ndarray:
    """Lines first: one block-diagonal matrix per line."""
    sizes = [part.shape[1] for part in parts]
    whole = np.zeros((len(LINES), sum(sizes), sum(sizes)), dtype=complex)
    at = 0
    for part, size in zip(parts, sizes, strict=True):
        whole[:, at : at + size, at : at + size] = part
        at += size
    return whole


def pyfbs_synthesis(system: SecondOrderSystem, modes: RealModes) -> Callable[[], np.ndarray]:
    """pyFBS's sum over modes; what it would read from a finite-element mesh is put in its place."""
    from pyfbs.mck.mck import Model as Peer

    omega, shapes = modes.angular_frequency, modes.shapes
    gamma = np.diag(shapes.T @ system.damping @ shapes)
    ratios = np.divide(gamma, 2 * omega, out=np.zeros_like(omega), where=omega > 0)
    products = np.einsum("ir,jr->rij", shapes, shapes)
    peer = Peer.__new__(Peer)
    peer.damped_solver, peer.angular_eig_freq = False, omega
    peer.transform_modal_parameters = lambda **_: (len(omega), omega**2, ratios, products)

    def job() -> np.ndarray:
        peer.frf_synth(None, None, 1, len(LINES) + 1, 1)
        return np.asarray(peer.frf)

    return job


def lm_fbs(y: np.ndarray, ends: tuple[int, int]) -> np.ndarray:
    """Y - Y B^T pinv(B Y B^T) B Y on the block-diagonal Y."""
    b = np.zeros((1, y.shape[1]))
    b[0, ends[0]], b[0, ends[1]] = 1.0, -1.0
    return np.asarray(y - y @ b.T @ np.linalg.pinv(b @ y @ b.T) @ b @ y)


def sdynpy_synthesis(system: SecondOrderSystem) -> Callable[[], Any]:
    """sdynpy's FRFs of a system between all its coordinates."""
    import sdynpy

    coordinates = sdynpy.coordinate_array(np.arange(1, len(system.dofs) + 1), 1)
    peer = sdynpy.System(coordinates, system.mass, system.stiffness, system.damping)
    return lambda: peer.frequency_response(LINES)


def sdynpy_coupling(stages: Stages, ends: tuple[int, int]) -> Callable[[], Any]:
    """sdynpy's coupling of the same stage FRFs by coordinates."""
    import sdynpy

    kind = sdynpy.data.FunctionTypes.FREQUENCY_RESPONSE_FUNCTION
    parts, first = [], 0
    for frf in stages.values():
        dofs = sdynpy.coordinate_array(np.arange(first, first + len(frf.responses)), 1)
        ordinate = np.ascontiguousarray(frf.values.transpose(1, 2, 0))
        pairs = sdynpy.coordinate.outer_product(dofs, dofs)
        parts.append(sdynpy.data_array(kind, LINES, ordinate, pairs))
        first += len(frf.responses)
    whole = sdynpy.data.TransferFunctionArray.block_diagonal_frf(parts)
    pair = sdynpy.coordinate_array(np.array([ends]), 1)
    return lambda: whole.substructure_by_coordinate(pair)


def lines_first(found: Any) -> np.ndarray:
    """The values of sdynpy's FRFs."""
    return np.moveaxis(found.ordinate, -1, 0)


def main(preset: str) -> None:
    """Print the table."""
    source = equations_source(damped(load(preset), DAMPING))
    stages = {name: direct_frf(system, LINES) for name, system in source.stages.items()}
    count, unit = len(source.whole.labels), timed(lambda: written(len(source.whole.labels)))
    missing = [peer for peer in ("pyfbs", "sdynpy") if find_spec(peer) is None]
    print(f"{preset}: {count} labels, {count**2} FRFs, {len(LINES)} lines; {cores()} threads")
    print(f"{'':40}{'first s':>9}{'s':>9}{'× writing':>11}{'peak × result':>15}{'error':>10}")
    print(f"{'writing the result once':40}{unit.first:9.4f}{unit.median:9.4f}{1.0:11.2f}")
    for rows in (own(source), synthesis_of_stages(source), coupling(source, stages)):
        seconds: list[float] = []
        for row in rows:
            timing = timed(row.job)
            values = row.values(timing.result)
            error = scaled_error(row.reference, values).max()
            size = values.nbytes
            del values
            timing = replace(timing, result=None)
            seconds.append(timing.median)
            versus = f"  {seconds[-1] / seconds[0]:.1f} × ours" if row.name[0] == " " else ""
            print(
                f"{row.name:40}{timing.first:9.4f}{timing.median:9.4f}"
                f"{timing.median / unit.median:11.2f}{peak_memory(row.job) / size:15.2f}"
                f"{error:10.1e}{versus}",
                flush=True,
            )
        print()
    if missing:
        print(f"not installed, left out: {', '.join(missing)}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "paper")

"""Full system against coupling, timed side by side in one run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from statistics import median

import numpy as np

from fbs import Frf, Joint, SecondOrderSystem, couple, direct_frf, modal_frf

from ..routes.source import Source, exudyn_source
from .curves import FrfBench, PaperBand, axis
from .model import PaperCase
from .results import FloatArray, Timing, TimingStudy

BAND = PaperBand(4000.0, 4.0)
RUNS = 5
SWEEP = tuple(np.geomspace(1e5, 1e7, 9).tolist())
"""k_sw (N/m) of the sweep, over the range of Sec. 4.2."""

Way = Callable[[], object]


def timing_study(bench: FrfBench) -> TimingStudy:
    """Time the ways to all FRFs once, and to one FRF for many k_sw."""
    model = bench.systems.exudyn()
    lines = axis(BAND, bench.systems.modes().natural_frequencies).frequency
    sun = f"{bench.case.planetary.name}.sun.w"
    single: dict[str, Way] = {
        "full system, line by line": lambda: direct_frf(model.whole, lines),
        "full system, modal": lambda: modal_frf(model.whole, lines),
        "stages line by line, coupled": lambda: _coupled(model, lines, direct_frf),
        "stages modal, coupled": lambda: _coupled(model, lines, modal_frf),
    }
    split = SplitAtShaft(bench.case)
    wholes = [bench.systems.exudyn(k).whole for k in SWEEP]
    sweep: dict[str, Way] = {
        "full system, line by line, for every k_sw": lambda: [
            direct_frf(whole, lines, [sun], [sun]) for whole in wholes
        ],
        "full system, modal, for every k_sw": lambda: [
            modal_frf(whole, lines, [sun], [sun]) for whole in wholes
        ],
        "stages once, coupled for every k_sw": lambda: split.sweep(lines, SWEEP, [sun]),
    }
    n = len(model.whole.dofs)
    conditions = (
        f"{len(lines)} lines to {BAND.end:g} Hz; single: all {n} × {n} FRFs; sweep: the sun's w "
        f"for {len(SWEEP)} values of k_sw, which is the joint between the stages, so that their "
        f"FRFs are reused; systems built beforehand; one warm-up, then the median of {RUNS} runs "
        f"taken in turns; {os.cpu_count()} processors"
    )
    return TimingStudy(conditions, _timings(single), _timings(sweep))


def _coupled(
    model: Source, lines: FloatArray, synthesis: Callable[[SecondOrderSystem, FloatArray], Frf]
) -> Frf:
    stages = {name: synthesis(system, lines) for name, system in model.stages.items()}
    return couple(stages, model.joints).frf


class SplitAtShaft:
    """Subsystem A with the whole hub, subsystem B without, and k_sw as the joint between them."""

    def __init__(self, case: PaperCase) -> None:
        a, b = case.parallel.name, case.planetary.name
        bare = case.drivetrain.model_copy(update={"couplings": ()})
        whole_hub = case.with_hub(2.0 * case.coupling.hub_mass).drivetrain
        ratio = case.coupling.radius / case.planetary.sun.base_radius
        sun, self.end = f"{b}.sun.w", f"{b}.sun.w at the hub"
        stage = exudyn_source(bare).stage(b)
        self.stages = {
            a: exudyn_source(whole_hub).stage(a),
            b: SecondOrderSystem(
                stage.mass, stage.damping, stage.stiffness, stage.dofs, {self.end: (sun, ratio)}
            ),
        }
        self.ends = ((a, case.hub), (b, self.end))

    def frfs(self, lines: FloatArray, points: Sequence[str] | None = None) -> dict[str, Frf]:
        """The subsystems' FRFs, at points and at the joint's ends (default: all)."""
        found = {}
        for (name, system), (_, end) in zip(self.stages.items(), self.ends, strict=True):
            labels = None
            if points is not None:
                labels = (end, *(p for p in points if p in system.labels and p != end))
            found[name] = direct_frf(system, lines, labels, labels)
        return found

    def coupled(self, frfs: dict[str, Frf], stiffness: float) -> Frf:
        """FRFs with the joint k_sw between the subsystems."""
        return couple(frfs, [Joint(*self.ends, stiffness=stiffness)]).frf

    def sweep(
        self, lines: FloatArray, stiffnesses: Sequence[float], points: Sequence[str]
    ) -> list[Frf]:
        """FRFs at the points for many k_sw; the subsystems are solved once."""
        frfs = self.frfs(lines, points)
        return [self.coupled(frfs, stiffness) for stiffness in stiffnesses]


def _timings(ways: dict[str, Way]) -> tuple[Timing, ...]:
    """Each way's median time, and relative to the first way's."""
    for way in ways.values():
        way()
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(RUNS):
        for name, way in ways.items():
            start = time.perf_counter()
            way()
            times[name].append(time.perf_counter() - start)
    seconds = {name: median(found) for name, found in times.items()}
    first = next(iter(seconds.values()))
    return tuple(Timing(name, value, value / first) for name, value in seconds.items())

"""The two subsystems cut at the shaft spring k_sw, which becomes the joint between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fbs import Frf, Joint, SecondOrderSystem, couple, direct_frf

from ..arrays import FloatArray
from ..routes.source import exudyn_source
from .bench import Bench
from .case import PaperCase


class SplitAtShaft:
    """Subsystem A with the whole hub, subsystem B without, and k_sw as the joint between them."""

    def __init__(self, case: PaperCase) -> None:
        a, b = case.a, case.b
        whole_hub = case.with_hub(2.0 * case.coupling.hub_mass).drivetrain
        ratio = case.coupling.radius / case.planetary.sun.base_radius
        sun, self.end = f"{b}.sun.w", f"{b}.sun.w at the hub"
        stage = case.uncoupled.stage(b)
        self.stages = {
            a: exudyn_source(whole_hub).stage(a),
            b: SecondOrderSystem(
                stage.mass, stage.damping, stage.stiffness, stage.dofs, {self.end: (sun, ratio)}
            ),
        }
        self.ends = ((a, case.hub), (b, self.end))

    def frfs(
        self,
        lines: FloatArray,
        points: Sequence[str] | None = None,
        synthesis: Callable[..., Frf] = direct_frf,
    ) -> dict[str, Frf]:
        """The subsystems' FRFs, at points and at the joint's ends (default: all)."""
        found = {}
        for (name, system), (_, end) in zip(self.stages.items(), self.ends, strict=True):
            labels = None
            if points is not None:
                labels = (end, *(p for p in points if p in system.labels and p != end))
            found[name] = synthesis(system, lines, labels, labels)
        return found

    def coupled(self, frfs: dict[str, Frf], stiffness: float) -> Frf:
        """FRFs with the joint k_sw between the subsystems."""
        return couple(frfs, [Joint(*self.ends, stiffness=stiffness)]).frf


def split_at_shaft(bench: Bench) -> SplitAtShaft:
    """The bench's drivetrain so split, for `Bench.once`."""
    return SplitAtShaft(bench.case)

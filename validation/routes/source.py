"""A drivetrain's matrices by one way, each built once.

Sources share nothing but the parameters: exudyn's linearised multibody system, the lumped
equations, or whatever builder is given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from fbs import Frf, Joint, SecondOrderSystem, direct_frf
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from . import equations
from .joints import coupling_joints

if TYPE_CHECKING:
    from mbs_models.gears.operating_point import OperatingPoint
    from mbs_models.modal.mode_kinds import Modes

    from .multibody import ExudynSource

Synthesis = Callable[[SecondOrderSystem, FloatArray], Frf]


@dataclass(frozen=True, eq=False)
class Source:
    """M ẍ + C ẋ + K x = f of a drivetrain, whole and by part, built when first asked for.

    Attributes
    ----------
    name
        As reports have it.
    drivetrain
        The parameters.
    build_whole, build_stage
        The whole's system; a part's by its name, with its halves of the hubs.
    synthesis
        Makes the FRFs of this source's whole system.
    """

    name: str
    drivetrain: Drivetrain
    build_whole: Callable[[Drivetrain], SecondOrderSystem]
    build_stage: Callable[[Drivetrain, str], SecondOrderSystem]
    synthesis: Synthesis = direct_frf
    _stages: dict[str, SecondOrderSystem] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def whole(self) -> SecondOrderSystem:
        """The whole drivetrain's matrices."""
        return self.build_whole(self.drivetrain)

    def stage(self, name: str) -> SecondOrderSystem:
        """A stage's or inertia's matrices, with its halves of the hubs."""
        if name not in self._stages:
            self._stages[name] = self.build_stage(self.drivetrain, name)
        return self._stages[name]

    @property
    def stages(self) -> Mapping[str, SecondOrderSystem]:
        """The matrices of all parts, by name."""
        return {part.name: self.stage(part.name) for part in self.drivetrain.parts}

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """What joins the parts."""
        return tuple(
            joint
            for coupling in self.drivetrain.couplings
            for joint in coupling_joints(self.drivetrain, coupling)
        )

    @cached_property
    def modes(self) -> Modes:
        """Natural frequencies, damping ratios and kinds of the whole's modes."""
        from .modes import matrix_modes

        bare = self.drivetrain.model_copy(update={"couplings": ()})
        alone = {part.name: self.build_stage(bare, part.name) for part in bare.parts}
        return matrix_modes(self.drivetrain, self.whole, alone)


def exudyn_source(drivetrain: Drivetrain) -> ExudynSource:
    """exudyn's linearised multibody systems."""
    from .multibody import ExudynSource  # exudyn takes its time to load: only when it is used

    return ExudynSource(drivetrain)


def equations_source(drivetrain: Drivetrain) -> Source:
    """The lumped equations, K = Σ k v vᵀ."""
    return Source("equations", drivetrain, equations.drivetrain_system, equations.stage_system)


def loaded_source(drivetrain: Drivetrain, point: OperatingPoint) -> Source:
    """exudyn's systems, linearised where an operating point's torque has moved them."""
    from mbs_models.gears.operating_point import linearized_part

    from .multibody import as_second_order

    return Source(
        "exudyn under load",
        drivetrain,
        lambda _: as_second_order(point.linear),
        lambda train, name: as_second_order(linearized_part(train, name, point)),
    )

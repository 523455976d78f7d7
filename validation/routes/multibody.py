"""The adapter: exudyn's systems as a source of fbs objects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem
from mbs_models.modal.mode_kinds import Modes
from mbs_models.modal.modes import system_modes
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.components import Components
from mbs_models.system.drivetrain import MultibodySystem, build_drivetrain, build_stage
from mbs_models.system.harmonic_response import harmonic_response
from mbs_models.system.linearization import LinearizedSystem, linearize
from mbs_models.system.read_back import components

from .source import Source


def drivetrain_system(drivetrain: Drivetrain) -> SecondOrderSystem:
    """M, C, K of the whole drivetrain as exudyn linearises it."""
    return as_second_order(linearize(build_drivetrain(drivetrain)))


def stage_system(drivetrain: Drivetrain, name: str) -> SecondOrderSystem:
    """M, C, K of one stage with its halves of the hubs as exudyn linearises it."""
    return as_second_order(linearize(build_stage(drivetrain, name)))


def as_second_order(system: LinearizedSystem) -> SecondOrderSystem:
    """The same matrices and labels as an fbs object."""
    return SecondOrderSystem(
        system.mass, system.damping, system.stiffness, system.dofs, system.derived
    )


def frf(system: SecondOrderSystem, frequency: NDArray[np.float64]) -> Frf:
    """Receptances by ``mbs_models``' own harmonic response, as an fbs object."""
    linear = LinearizedSystem(
        system.mass, system.damping, system.stiffness, system.dofs, system.derived
    )
    return Frf(frequency, harmonic_response(linear, frequency), system.labels, system.labels)


@dataclass(frozen=True, eq=False, init=False)
class ExudynSource(Source):
    """The built exudyn system, which serves matrices, modes, components and runs in time."""

    def __init__(self, drivetrain: Drivetrain) -> None:
        super().__init__("exudyn", drivetrain, drivetrain_system, stage_system, frf)

    @cached_property
    def system(self) -> MultibodySystem:
        """The whole drivetrain in exudyn."""
        return build_drivetrain(self.drivetrain)

    @cached_property
    def linear(self) -> LinearizedSystem:
        """The same as exudyn linearises it."""
        return linearize(self.system)

    @cached_property
    def whole(self) -> SecondOrderSystem:
        """The whole drivetrain's matrices."""
        return as_second_order(self.linear)

    @cached_property
    def components(self) -> Components:
        """Bodies and springs, read back."""
        return components(self.system)

    @cached_property
    def modes(self) -> Modes:
        """exudyn's own eigensolution."""
        return system_modes(self.drivetrain, self.system, self.linear, self.components)

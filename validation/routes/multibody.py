"""The adapter: exudyn's linearised systems as fbs objects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem
from mbs_models.model.parameters import Drivetrain
from mbs_models.system.drivetrain import build_drivetrain, build_stage
from mbs_models.system.harmonic_response import harmonic_response
from mbs_models.system.linearization import LinearizedSystem, linearize


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

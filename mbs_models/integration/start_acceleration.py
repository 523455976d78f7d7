"""The acceleration that a run starts with.

The trapezoidal rule multiplies a mode of pole s by (1 + hs/2)/(1 − hs/2) in a step (Hairer & Wanner
1996, Solving Ordinary Differential Equations II, IV.3): by −1 in the limit of a large h|s|. What
a load that is there at once accelerates in a mode far above the band, such as a near-massless
hub's between its springs, would change its sign at every step and hardly die out, though the mode
itself is in its new equilibrium before the first step is over.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..system.drivetrain import MultibodySystem
from ..system.linearization import LinearizedSystem, coordinate_transform
from .probes import CURRENT, solver_settings

FloatArray = NDArray[np.float64]


def acceleration_of_forces(system: MultibodySystem) -> FloatArray:
    """q̈ = M⁻¹f of exudyn's coordinates in the system's initial state, at t = 0."""
    settings = solver_settings(0.0, 1.0, 1)
    settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    solver: Any = exu.MainSolverImplicitSecondOrder()
    solver.InitializeSolver(system.mbs, settings)
    found = system.mbs.systemData.GetODE2Coordinates_tt(CURRENT)
    solver.FinalizeSolver(system.mbs, settings)
    return np.array(found, dtype=float)


def without_fast_modes(
    system: MultibodySystem, linear: LinearizedSystem, acceleration: FloatArray, step: float
) -> FloatArray:
    """q̈ − Σ φ φᵀM q̈ over the modes φ whose period is shorter than a step, ωh > 2π.

    The rule takes it for the end of a step before the run, in whose course those modes came to
    their equilibrium. Of what one would alternate with, 1/√(1 + (ωh/2)²) is left without damping,
    and less with it. Displacement and velocity start as given.

    Parameters
    ----------
    system, linear
        What is run, and the same linearised.
    acceleration
        (n_coordinate,) of exudyn's coordinates.
    step
        h of the trapezoidal rule (s).
    """
    eigenvalues, shapes = eigh(linear.stiffness, linear.mass)
    fast = shapes[:, eigenvalues * step**2 > (2.0 * np.pi) ** 2]
    transform = coordinate_transform(system)
    of_dofs = acceleration @ transform / np.sum(transform**2, axis=0)
    slow: FloatArray = acceleration - transform @ (fast @ (fast.T @ (linear.mass @ of_dofs)))
    return slow

"""The steady state a linearised system starts in, so that no slow mode has to die out first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..modal.mode_kinds import rigid_body_count
from ..system.harmonic_response import harmonic_response
from ..system.linearization import LinearizedSystem

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def steady_lines(
    linear: LinearizedSystem, dof: str, frequency: FloatArray, step: float | None = None
) -> tuple[ComplexArray, ComplexArray]:
    """Receptance and mobility at some lines, as an integrator sees them.

    H(ω′) and jω′H(ω′) with ω′ = ω, or for the trapezoidal rule ω′ = (2/h) tan(ωh/2): its difference
    equations have exactly this solution (Tustin's transform).

    Parameters
    ----------
    linear
        The linearised system.
    dof
        The excited DoF.
    frequency
        (n_line,) Hz.
    step
        h of the trapezoidal rule (s); None: none, the exact solution.

    Returns
    -------
    receptance, mobility
        (n_line, n_dof) m/N, m/(N s).

    Raises
    ------
    ModelError
        The DoF is unknown, or a line lies on an undamped pole.
    """
    seen = frequency if step is None else np.tan(np.pi * frequency * step) / (np.pi * step)
    receptance = harmonic_response(linear, seen, linear.dofs, [dof])[:, :, 0]
    return receptance, 2j * np.pi * seen[:, None] * receptance


def steady_start(
    linear: LinearizedSystem,
    dof: str,
    frequency: FloatArray,
    spectrum: ComplexArray,
    step: float | None = None,
) -> tuple[FloatArray, FloatArray]:
    """State at t = 0 of the steady state under Σ F_k e^{jω_k t}: Re Σ H F_k, Re Σ jωH F_k.

    Parameters
    ----------
    linear, dof, frequency, step
        As for `steady_lines`.
    spectrum
        (n_line,) F_k (N).

    Returns
    -------
    displacement, velocity
        (n_dof,) m, m/s.
    """
    receptance, mobility = steady_lines(linear, dof, frequency, step)
    return (spectrum @ receptance).real, (spectrum @ mobility).real


def slowest_decay(linear: LinearizedSystem, fmax: float) -> float:
    """Smallest decay rate ζω of an elastic mode up to ``fmax`` (Hz): γ/2, γ = φᵀCφ (1/s).

    0 where one is undamped; infinite where there is none.
    """
    eigenvalues, shapes = eigh(linear.stiffness, linear.mass)
    elastic = slice(rigid_body_count(linear.stiffness), None)
    below = np.sqrt(np.maximum(eigenvalues[elastic], 0.0)) <= 2.0 * np.pi * fmax
    damping = np.einsum("im,ij,jm->m", shapes, linear.damping, shapes)[elastic]
    return float(damping[below].min(initial=np.inf) / 2.0)


def superposed(states: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """The sum of several states (displacement, velocity)."""
    displacement, velocity = zip(*states, strict=True)
    return np.sum(displacement, axis=0), np.sum(velocity, axis=0)

"""FRFs of an exudyn system: exudyn linearises, each line is solved directly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from .linearization import LinearizedSystem

VALUES_PER_BATCH = 2**17  # 2 MB of complex numbers fit a core's cache


def harmonic_response(
    system: LinearizedSystem,
    frequency: NDArray[np.float64],
    responses: Sequence[str] | None = None,
    excitations: Sequence[str] | None = None,
) -> NDArray[np.complex128]:
    """H(ω) = (K − ω²M + jωC)⁻¹, the receptance (the paper, Eq. 16).

    Parameters
    ----------
    system
        The linearised system.
    frequency
        (n_frequency,) Hz.
    responses, excitations
        Labels (default: every DoF and derived label).

    Returns
    -------
    (n_frequency, n_response, n_excitation) m/N.

    Raises
    ------
    ModelError
        A label is unknown, or a line is singular: an undamped pole, or 0 Hz of a free system.
    """
    rows, row_factors = _selection(system, responses)
    columns, column_factors = _selection(system, excitations)
    forces = np.zeros((len(system.dofs), len(columns)))
    forces[columns, np.arange(len(columns))] = column_factors
    result = np.empty((len(frequency), len(rows), len(columns)), dtype=complex)
    lines = max(1, VALUES_PER_BATCH // len(system.dofs) ** 2)
    for start in range(0, len(frequency), lines):
        batch = slice(start, start + lines)
        omega = 2.0 * np.pi * frequency[batch, None, None]
        dynamic_stiffness = system.stiffness - omega**2 * system.mass
        if system.damping.any():  # else real arithmetic does
            dynamic_stiffness = dynamic_stiffness + 1j * omega * system.damping
        try:
            motion = np.linalg.solve(dynamic_stiffness, forces)
        except np.linalg.LinAlgError:
            raise ModelError(
                f"the dynamic stiffness is singular at a line between {frequency[batch][0]:g} and "
                f"{frequency[batch][-1]:g} Hz: an undamped pole, or 0 Hz of a free system; "
                "move the line or add damping"
            ) from None
        result[batch] = motion[:, rows] * row_factors[:, None]
    return result


def _selection(
    system: LinearizedSystem, labels: Sequence[str] | None
) -> tuple[list[int], NDArray[np.float64]]:
    """Index of the DoF behind each label, derived ones included, and the factor on it."""
    wanted = system.labels if labels is None else labels
    indices, factors = [], []
    for label in wanted:
        dof, factor = system.derived.get(label, (label, 1.0))
        if dof not in system.dofs:
            raise ModelError(f"unknown DoF '{label}'; known: {', '.join(system.labels)}")
        indices.append(system.dofs.index(dof))
        factors.append(factor)
    return indices, np.array(factors)

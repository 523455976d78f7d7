"""FRFs of an exudyn system: exudyn linearises, each line is solved directly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .errors import ModelError
from .linearization import LinearizedSystem

LINES_PER_BATCH = 256  # 256 30×30 complex systems fit a core's cache


def harmonic_response(
    system: LinearizedSystem,
    frequency: NDArray[np.float64],
    responses: Sequence[str] | None = None,
    excitations: Sequence[str] | None = None,
) -> NDArray[np.complex128]:
    """H(ω) = (K − ω²M + jωC)⁻¹, the receptance (seed paper, Eq. 16).

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
    rows = _selection(system, responses)
    columns = _selection(system, excitations)
    result = np.empty((len(frequency), len(rows), len(columns)), dtype=complex)
    for start in range(0, len(frequency), LINES_PER_BATCH):
        batch = slice(start, start + LINES_PER_BATCH)
        omega = 2.0 * np.pi * frequency[batch, None, None]
        dynamic_stiffness = system.stiffness - omega**2 * system.mass + 1j * omega * system.damping
        try:
            motion = np.linalg.solve(dynamic_stiffness, columns.T.astype(complex))
        except np.linalg.LinAlgError:
            raise ModelError(
                f"the dynamic stiffness is singular at a line between {frequency[batch][0]:g} and "
                f"{frequency[batch][-1]:g} Hz: an undamped pole, or 0 Hz of a free system; "
                "move the line or add damping"
            ) from None
        result[batch] = rows @ motion
    return result


def _selection(system: LinearizedSystem, labels: Sequence[str] | None) -> NDArray[np.float64]:
    """Rows that pick labels, DoFs or derived ones, out of q."""
    wanted = system.labels if labels is None else labels
    rows = np.zeros((len(wanted), len(system.dofs)))
    for row, label in zip(rows, wanted, strict=True):
        dof, factor = system.derived.get(label, (label, 1.0))
        if dof not in system.dofs:
            raise ModelError(f"unknown DoF '{label}'; known: {', '.join(system.labels)}")
        row[system.dofs.index(dof)] = factor
    return rows

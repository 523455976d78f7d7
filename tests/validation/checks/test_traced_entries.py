"""Differences of FRFs traced to entries of M, C and K."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import SecondOrderSystem, direct_frf
from validation.checks.diagnosis import locate

LINES = np.linspace(1.0, 40.0, 24)
DOFS = ("a", "b", "c")
NO_ROUND_OFF = np.zeros((24, 3, 3))
MATRICES = {
    "mass": np.diag([2.0, 1.0, 3.0]),
    "damping": 1e-3
    * np.array([[200.0, -100.0, 0.0], [-100.0, 250.0, -150.0], [0.0, -150.0, 150.0]]),
    "stiffness": 1e4 * np.array([[3.0, -1.0, 0.0], [-1.0, 2.5, -1.5], [0.0, -1.5, 1.5]]),
}


def frfs(changed: str = "", at: tuple[int, int] = (0, 0), by: float = 0.0) -> np.ndarray:
    matrices = {name: matrix.copy() for name, matrix in MATRICES.items()}
    if changed:
        matrices[changed][at] += by
        if at[0] != at[1]:
            matrices[changed][at[::-1]] += by
    system = SecondOrderSystem(matrices["mass"], matrices["damping"], matrices["stiffness"], DOFS)
    return np.asarray(direct_frf(system, LINES, DOFS, DOFS).values)


@pytest.mark.parametrize("matrix", MATRICES)
@pytest.mark.parametrize("at", [(0, 0), (1, 2), (2, 2)])
def test_an_entry_is_found_with_both_values(matrix: str, at: tuple[int, int]) -> None:
    own = MATRICES[matrix][at]
    by = 0.01 * MATRICES[matrix].max()
    (found,) = locate(LINES, frfs(), frfs(matrix, at, by), NO_ROUND_OFF, DOFS)
    assert (found.matrix, found.row, found.column) == (matrix, DOFS[at[0]], DOFS[at[1]])
    assert found.reference == pytest.approx(own, abs=1e-6 * MATRICES[matrix].max())
    assert found.other == pytest.approx(own + by, abs=1e-6 * MATRICES[matrix].max())


def test_no_difference_is_no_entry() -> None:
    assert locate(LINES, frfs(), frfs(), NO_ROUND_OFF, DOFS) == ()

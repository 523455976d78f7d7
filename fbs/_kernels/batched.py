"""Many small dense systems at once, with the singular ones found and not thrown."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Batch = NDArray[Any]


def solve(matrices: Batch, right: Batch) -> tuple[Batch, NDArray[np.bool_]]:
    """Solve A[k] X[k] = R for every k.

    Parameters
    ----------
    matrices : array, shape (nk, n, n)
    right : array, shape (n, m)

    Returns
    -------
    solution : array, shape (nk, n, m)
        NaN where A[k] is exactly singular.
    singular : bool array, shape (nk,)
    """
    if matrices.shape[1:] == (1, 1):  # a division: LAPACK's calls would take ten times as long
        solution = np.full((len(matrices), *right.shape), np.nan, dtype=matrices.dtype)
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused later
            np.divide(right, matrices, out=solution, where=matrices != 0)
        return solution, (matrices == 0)[:, 0, 0]
    singular = np.zeros(len(matrices), dtype=bool)
    try:
        return np.linalg.solve(matrices, right), singular
    except np.linalg.LinAlgError:  # one bad matrix stops the whole batch: go one by one
        solution = np.full((len(matrices), *right.shape), np.nan, dtype=matrices.dtype)
        for k, matrix in enumerate(matrices):
            try:
                solution[k] = np.linalg.solve(matrix, right)
            except np.linalg.LinAlgError:
                singular[k] = True
        return solution, singular


def inverse(matrices: Batch) -> tuple[Batch, NDArray[np.bool_]]:
    """Invert every A[k]; NaN and True where it is exactly singular. See `solve`."""
    return solve(matrices, np.eye(matrices.shape[-1], dtype=matrices.dtype))

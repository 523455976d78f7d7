"""Measures of agreement between two routes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fbs import Frf

from ..arrays import FloatArray

Array = NDArray[Any]


def row_norms(frf: Frf) -> FloatArray:
    """h_i = √Σ_j |H_ij|², (n_line, n_response)."""
    values = frf.values.transpose(1, 2, 0)
    squares = np.sum(values.real**2 + values.imag**2, axis=1)
    norms: FloatArray = np.sqrt(squares).T
    return norms


def scaled_error(reference: Array, other: Array) -> FloatArray:
    """|ΔH_ij| / √(h_i h_j) per line, h_i the norm of row i of the reference H at that line.

    Antiresonances and DoFs of different size are compared alike: an error counts against what the
    two DoFs do at that frequency, not against the one value that happens to vanish.

    Parameters
    ----------
    reference, other
        (n_line, n, n), the same DoFs as responses and excitations.
    """
    norm = np.linalg.norm(reference, axis=2).T
    square = squared_errors((other - reference).transpose(1, 2, 0), error_scale(norm, norm))
    return np.sqrt(square).transpose(2, 0, 1)


def error_scale(rows: FloatArray, columns: FloatArray) -> FloatArray:
    """h_i h_j (n_response, n_excitation, n_line) of rows' norms (n, n_line).

    Raises
    ------
    ValueError
        A DoF responds to nothing.
    """
    if not (rows.all() and columns.all()):
        raise ValueError("a DoF of the reference does not respond to anything: nothing to scale by")
    return np.asarray(rows[:, None] * columns)


def squared_errors(difference: Array, scale: FloatArray) -> FloatArray:
    """|ΔH_ij|² / (h_i h_j): the squares of scaled errors, which are ranked as those are."""
    square: FloatArray = difference.real**2
    square += difference.imag**2
    square /= scale
    return square


def decibel_difference(reference: Array, other: Array) -> FloatArray:
    """20 log₁₀|H_other/H_reference| per line (dB)."""
    difference: FloatArray = 20.0 * np.log10(np.abs(other) / np.abs(reference))
    return difference


def frac(reference: Array, other: Array) -> float:
    """|Σ H̄ G|² / (Σ|H|² Σ|G|²), the frequency response assurance criterion.

    Reported for its popularity: the few lines at the peaks decide it (Heylen & Lammens 1996).
    Two FRFs that are zero everywhere (no path between the DoFs) count as equal.
    """
    norms = [np.sqrt(np.sum(h.real**2 + h.imag**2)) for h in (reference, other)]
    if not all(norms):
        return float(norms[0] == norms[1])
    return float(abs(np.sum((reference / norms[0]).conj() * (other / norms[1]))) ** 2)


def subspace_mac(first: Array, second: Array, mass: FloatArray) -> float:
    """cos² of the largest principal angle between two sets of shapes, in the metric of M.

    For one shape each this is the mass-weighted MAC |φᴴMψ|²/(φᴴMφ · ψᴴMψ); for repeated modes,
    whose shapes are any basis of their plane, it compares the planes.

    Parameters
    ----------
    first, second
        (n, m) shapes in columns, spanning m dimensions each.
    mass
        (n, n) kg.
    """
    root = np.linalg.cholesky(mass).T
    bases = [np.linalg.qr(root @ shapes)[0] for shapes in (first, second)]
    cosines = np.linalg.svd(bases[0].conj().T @ bases[1], compute_uv=False)
    return float(min(cosines) ** 2)

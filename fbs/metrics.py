"""Numbers that compare FRFs and mode shapes; complex throughout, each with its source.

All are 1 for equal data and between 0 and 1, but each is blind to something: FRAC and MAC to a
factor, LAC to phase, every sum to what is small beside its peaks. None is a verdict alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.checks import FloatArray
from .errors import FbsError
from .frf import Frf, require_same_layout

Values = NDArray[np.inexact]


def frac(reference: ArrayLike, other: ArrayLike) -> FloatArray:
    """|Σ_ω H* Ĥ|² / (Σ_ω |H|² Σ_ω |Ĥ|²) (Heylen & Lammens 1996, ISMA 21): alike in shape.

    Parameters
    ----------
    reference, other
        (nf, …) values of the same shape.

    Returns
    -------
    (…) of the axes after the first; NaN where one of the two is zero throughout.
    """
    h, g = _alike(reference, other)
    return _correlation(np.sum(h.conj() * g, axis=0), _energy(h, 0), _energy(g, 0))


def fdac(reference: Frf, other: Frf, excitation: str) -> FloatArray:
    """|Σ_i H_i*(ω_k) Ĥ_i(ω_l)|² / (Σ_i |H_i|² Σ_i |Ĥ_i|²), (nf, nf), of one excitation's columns.

    Away from the diagonal it shows by how much resonances are shifted (Pascual, Golinval & Razeto
    1997, IMAC 15).
    """
    require_same_layout(reference, other)
    h, g = (frf.select(None, [excitation]).values[:, :, 0] for frf in (reference, other))
    return _correlation(h.conj() @ g.T, _energy(h, 1)[:, None], _energy(g, 1)[None, :])


def csac(reference: Frf, other: Frf) -> FloatArray:
    """|Σ_ij H* Ĥ|² / (Σ |H|² Σ |Ĥ|²) per line (nf,): alike in shape (Dascotte & Strobbe 1999)."""
    h, g = _lines(reference, other)
    return _correlation(np.sum(h.conj() * g, axis=1), _energy(h, 1), _energy(g, 1))


def csf(reference: Frf, other: Frf) -> FloatArray:
    """2 |Σ_ij H* Ĥ| / (Σ |H|² + Σ |Ĥ|²) per line (nf,): alike in shape and size (ibid.)."""
    h, g = _lines(reference, other)
    return _ratio(2.0 * np.abs(np.sum(h.conj() * g, axis=1)), _energy(h, 1) + _energy(g, 1))


def lac(reference: ArrayLike, other: ArrayLike) -> FloatArray:
    """2 |H* Ĥ| / (|H|² + |Ĥ|²) value by value: alike in size, whatever the phase."""
    h, g = _alike(reference, other)
    return _ratio(2.0 * np.abs(h) * np.abs(g), np.abs(h) ** 2 + np.abs(g) ** 2)


def coherence_criterion(
    reference: ArrayLike, other: ArrayLike, axis: int | None = None
) -> FloatArray:
    """|H + Ĥ|² / (2 (|H|² + |Ĥ|²)): alike in size and phase; 0 where opposite.

    Value by value, or with the squares summed along an axis first (Voormeeren, de Klerk & Rixen
    2010, Mech. Syst. Signal Process. 24, 106).
    """
    h, g = _alike(reference, other)
    both, each = np.abs(h + g) ** 2, np.abs(h) ** 2 + np.abs(g) ** 2
    if axis is not None:
        both, each = both.sum(axis=axis), each.sum(axis=axis)
    return _ratio(both, 2.0 * each)


def mac(shapes: ArrayLike, others: ArrayLike) -> FloatArray:
    """|φ_r^H ψ_s|² / (φ_r^H φ_r ψ_s^H ψ_s), (n_r, n_s), of columns (Allemang & Brown 1982)."""
    a, b = np.atleast_2d(np.asarray(shapes)), np.atleast_2d(np.asarray(others))
    if a.shape[0] != b.shape[0]:
        raise FbsError(f"shapes over {a.shape[0]} and {b.shape[0]} DoFs cannot be compared")
    return _correlation(a.conj().T @ b, _energy(a, 0)[:, None], _energy(b, 0)[None, :])


def comac(shapes: ArrayLike, others: ArrayLike) -> FloatArray:
    """(Σ_r |φ_ir ψ_ir*|)² / (Σ_r |φ_ir|² Σ_r |ψ_ir|²) per DoF (n_dof,), of paired columns.

    Lieven & Ewins (1988), IMAC 6: which DoF spoils the agreement.
    """
    a, b = _alike(shapes, others)
    return _correlation(np.sum(np.abs(a) * np.abs(b), axis=1), _energy(a, 1), _energy(b, 1))


def _alike(reference: ArrayLike, other: ArrayLike) -> tuple[Values, Values]:
    h, g = np.asarray(reference), np.asarray(other)
    if h.shape != g.shape:
        raise FbsError(f"values of shapes {h.shape} and {g.shape} cannot be compared")
    return h, g


def _lines(reference: Frf, other: Frf) -> tuple[Values, Values]:
    require_same_layout(reference, other)
    count = len(reference.frequency)
    return reference.values.reshape(count, -1), other.values.reshape(count, -1)


def _energy(values: Values, axis: int) -> FloatArray:
    return np.asarray(np.sum(np.abs(values) ** 2, axis=axis))


def _correlation(product: Values, one: FloatArray, two: FloatArray) -> FloatArray:
    return _ratio(np.abs(product) ** 2, one * two)


def _ratio(part: FloatArray, whole: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore"):
        return np.asarray(part / whole)

"""Schur complements with a bound on their error: the one mechanism behind every `round_off`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import batched
from .checks import FloatArray

EPS = float(np.finfo(float).eps)

SWEEPS = 4
"""Of `equilibrating_size`: row maxima are then within 1e-5^(1/16), half a decade, of one."""


class Blocks(NamedTuple):
    """A = [[A_MM, A_MS], [A_SM, A_SS]] for many lines: (nk, r, e), (nk, r, s), (nk, s, e), ..."""

    mm: NDArray[Any]
    ms: NDArray[Any]
    sm: NDArray[Any]
    ss: NDArray[Any]

    @property
    def modulus(self) -> Blocks:
        """|A|, entry by entry."""
        return Blocks(*map(np.abs, self))


class Enclosure(NamedTuple):
    """Values and a bound on the modulus of their error, both (nk, r, e).

    Where there is no bound it is infinite; the values are NaN where A_SS is exactly singular.
    """

    values: NDArray[Any]
    bound: FloatArray


def eliminate(a: Blocks, error: Blocks) -> Enclosure:
    """Return S = A_MM - A_MS A_SS^-1 A_SM for A known to |dA| <= error, and a bound on its error.

    With X = A_SS^-1 A_SM, W = A_MS A_SS^-1, P_R = [I; -X] and P_L = [I, -W], exactly

        S(A + dA) - S(A) = P_L dA P_R - (P_L dA)_S (A_SS + dA_SS)^-1 (dA P_R)_S,

    the first term being first-order in dA. (For truncated modes the same holds, with a
    semi-definite dA in place of one bounded entry by entry; for variances, its squares.) What the
    arithmetic adds is of the same form: a product of inner dimension s rounds by
    gamma = (s + 4) eps of the products' moduli, in complex arithmetic too (Higham 2002, Accuracy
    and stability of numerical algorithms, 2nd ed., sec. 3.1 and lemma 3.5: sqrt(2) (s + 2) eps/2
    and higher orders), so that D = error + gamma |A| stands for both. A solver is not trusted at
    all: its residuals R = A_SM - A_SS X and R_L = A_MS - W A_SS, computed to within gamma of their
    terms, take part,

        dS <= D_MM + D_MS |X| + |W| Q_R + Q_L N Q_R,
    Q_R = D_SM + D_SS |X| + |R|,  Q_L = D_MS + |W| D_SS + |R_L|.

    N bounds |(A_SS + dA_SS)^-1|. With the inverse G as computed, N_0 = |G|, its residual
    F = I - A_SS G, T = |F| + D_SS N_0, all scaled to rows and columns of order one, and
    rho = ||T||_1 < 1,

        N <= N_0 sum_k T^k <= N_0 + max_l (N_0)_il rho / (1 - rho);

    where rho >= 1, A_SS cannot be told from a singular matrix, and there is no bound.

    Parameters
    ----------
    a, error : Blocks
        `error` >= 0 holds what the entries of A are known to, arithmetic here left out.
    """
    gamma = (a.ss.shape[-1] + 4) * EPS
    size = a.modulus
    d = Blocks(*(own + gamma * modulus for own, modulus in zip(error, size, strict=True)))
    root = np.sqrt(equilibrating_size(size.ss))
    inverse, singular = batched.inverse(a.ss / (root[:, :, None] * root[:, None, :]))
    with np.errstate(all="ignore"):  # what is singular is found and has no bound
        scaled = np.abs(inverse)
        inverse = inverse / (root[:, :, None] * root[:, None, :])
        x, w = inverse @ a.sm, a.ms @ inverse
        values = a.mm - a.ms @ x
        ax, aw = np.abs(x), np.abs(w)
        right = d.sm + d.ss @ ax + np.abs(a.sm - a.ss @ x)
        left = d.ms + aw @ d.ss + np.abs(a.ms - w @ a.ss)
        n_0 = scaled / (root[:, :, None] * root[:, None, :])
        moved = np.abs(np.eye(a.ss.shape[-1]) - a.ss @ inverse) + d.ss @ n_0
        rho = (moved * (root[:, None, :] / root[:, :, None])).sum(axis=1).max(axis=1, initial=0.0)
        rest = scaled.max(axis=2, initial=0.0) * (rho / (1 - rho))[:, None]
        n = n_0 + rest[:, :, None] / (root[:, :, None] * root[:, None, :])
        bound = d.mm + d.ms @ ax + aw @ right + left @ n @ right
    bound[singular | ~(rho < 1)] = np.inf
    bound[np.isnan(bound)] = np.inf
    return Enclosure(values, bound)


def equilibrating_size(modulus: FloatArray) -> FloatArray:
    """Return d with max_j |A_ij| / sqrt(d_i d_j) near one for every row and column i.

    Ruiz (2001), A scaling algorithm to equilibrate both rows and columns norms in matrices, RAL
    TR-2001-034. The diagonal alone would not do: a drive point vanishes at its antiresonances.

    Parameters
    ----------
    modulus : array, shape (nk, n, n)
    """
    root = np.ones(modulus.shape[:2])
    for _ in range(SWEEPS):
        scaled = modulus / (root[:, :, None] * root[:, None, :])
        largest = np.maximum(scaled.max(axis=1, initial=0.0), scaled.max(axis=2, initial=0.0))
        root *= np.sqrt(np.where(largest > 0, largest, 1.0))
    return np.asarray(root**2)

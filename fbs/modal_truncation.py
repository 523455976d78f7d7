"""Some of a system's modes, and the residuals of those left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._kernels.checks import FloatArray, read_only
from ._kernels.door import door
from .errors import FbsError
from .second_order_system import SecondOrderSystem
from .undamped_modes import (
    RealModes,
    Selection,
    StiffnessFactor,
    real_modes,
    require_own,
    stiffness_factor,
)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What statics tell of the modes left out, none of which was solved for.

    Parameters
    ----------
    shapes : array, shape (n_dof, n), m/sqrt(N m)
        phi_r / w_r; columns of round-off where n is more than the number of left-out modes.
    squares : array, shape (n,), s^2
        1 / w_r^2, descending; of the columns of round-off (nearly) zero.
    """

    shapes: FloatArray
    squares: FloatArray


@dataclass(frozen=True, eq=False)
class TruncatedModes:
    """H(w) ~ sum_kept phi phi^T / (mu w_r^2 - v) + sum_k R_k v^k / mu^(k+1).

    mu = 1 + j (eta + w beta) and v = w^2 - j w alpha, with the loss factor eta and the viscous
    damping C = alpha M + beta K of the system: undamped, mu = 1 and v = w^2. The residuals
    R_k = sum_left phi phi^T / w_r^(2k+2) expand what the left-out modes add,
    sum_left phi phi^T / (mu w_r^2 - v), in a geometric series. R_0 is their static flexibility;
    the higher ones are the force derivatives of Suarez & Matheu (1992), A modal synthesis
    technique based on the force derivative method, J. Vib. Acoust. 114, 209-216.

    With residuals up to order p, each left-out mode is wrong by the fraction
    (v / (mu w_r^2))^(p+1) of what it adds: the series converges below `series_limit` and the
    first left-out mode decides how fast. `modal_frf(system, ..., modes=this)` makes the FRF.

    Parameters
    ----------
    kept : RealModes
    residuals : tuple of array, shape (n_dof, n_dof)
        R_0, R_1, ... in m/N s^(2k); none of them: the left-out modes are simply missing.
    series_limit : float, Hz
        Natural frequency of the first left-out mode; infinite if none is left out.
    left_out : LeftOut or None
        What bounds the error, see `bounded_frf`; None where a rigid-body mode is left out.
    """

    kept: RealModes
    residuals: tuple[FloatArray, ...]
    series_limit: float
    left_out: LeftOut | None = None

    @property
    def dofs(self) -> tuple[str, ...]:
        """Labels of the coordinates."""
        return self.kept.dofs


@door
def truncate(
    system: SecondOrderSystem,
    keep: Selection,
    residual_order: int | None = None,
    modes: RealModes | None = None,
    rigid_tolerance: float | None = None,
) -> TruncatedModes:
    """Keep some modes; replace the others by R_k = F (F^T M F)^k F^T, F = P T, k = 0 ... order.

    T T^T is the flexibility K^-1, or for a free system that of the system held at as many DoFs as
    it has rigid-body modes, and P = I - Phi_kept Phi_kept^T M takes the kept modes out, the
    rigid-body ones included: R_0 = P K_held^-1 P^T is the inertia-relief form of the residual
    flexibility (Craig & Kurdila 2006, Fundamentals of structural dynamics, 2nd ed.).
    The left-out modes are not needed, and R_k has their own digits where a difference
    K^-1 - sum_kept phi phi^T / w_r^2 would leave none of a stiff mode's.

    Parameters
    ----------
    system : SecondOrderSystem
        Symmetric, K positive semi-definite, M positive definite. Its damping plays no part here.
    keep : slice, indices or mask
        Of `modes`. Of a repeated natural frequency keep all modes or none: some of them depend on
        the basis the eigensolver happened to choose.
    residual_order : int, optional
        Highest k; default: no residual.
    modes : RealModes, optional
        Those of the system if known already; the lowest of them are enough.
    rigid_tolerance : float, optional
        See `real_modes`; the same as for `modes`.

    Raises
    ------
    FbsError
        Rigid-body modes left out although residuals are asked for (they have none: -1/w^2 is no
        series in w^2), a negative order, or modes that do not exist or are named twice.
    AxisMismatchError, IndefiniteMassError, IndefiniteStiffnessError
    """
    if residual_order is not None and residual_order < 0:
        raise FbsError(f"residual_order must be 0 or more, or None, got {residual_order}")
    if modes is None:
        modes = real_modes(system, rigid_tolerance)
    else:
        require_own(system, modes)
    kept = modes.truncated(keep)
    stiffness = stiffness_factor(system, rigid_tolerance)
    n_rigid = len(system.dofs) - stiffness.rank
    if kept.n_rigid == n_rigid:
        factor = _left_out_flexibility(stiffness, kept, system.mass)
        inertia = factor.T @ system.mass @ factor  # its eigenvalues are 1 / w_r^2, and zeros
        left_out = _left_out(factor, inertia)
        limit = _limit(left_out.squares)
        return TruncatedModes(kept, _residuals(factor, inertia, residual_order), limit, left_out)
    if residual_order is not None:
        raise FbsError(
            f"{kept.n_rigid} of {n_rigid} rigid-body modes are kept; residuals need all of them, "
            "because what they add (-1/w^2) is no series in w^2"
        )
    return TruncatedModes(kept, (), 0.0)


def _left_out_flexibility(
    stiffness: StiffnessFactor, kept: RealModes, mass: FloatArray
) -> FloatArray:
    """Return F (n_dof, rank) with F F^T = sum over the left-out modes of phi phi^T / w_r^2."""
    factor = stiffness.flexibility_factor
    if kept.angular_frequency.size == len(mass):
        return np.zeros_like(factor)
    for _ in range(2):  # the second pass removes what the first one's round-off left of the kept
        factor = factor - kept.shapes @ (kept.shapes.T @ (mass @ factor))
    return factor


def _residuals(
    factor: FloatArray, inertia: FloatArray, order: int | None
) -> tuple[FloatArray, ...]:
    residuals = []
    left = factor
    for _ in range(0 if order is None else order + 1):
        product = left @ factor.T
        residuals.append(read_only((product + product.T) / 2))
        left = left @ inertia
    return tuple(residuals)


def _left_out(factor: FloatArray, inertia: FloatArray) -> LeftOut:
    """Turn F so that F^T M F is diagonal: its columns are phi_r / w_r then."""
    squares, turn = np.linalg.eigh(inertia)
    descending = slice(None, None, -1)
    return LeftOut(
        read_only(factor @ turn[:, descending]), read_only(squares[descending].clip(min=0.0))
    )


def _limit(squares: FloatArray) -> float:
    largest = float(squares.max(initial=0.0))
    return float(1 / (2 * np.pi * np.sqrt(largest))) if largest > 0 else np.inf

"""Modes of damped systems, solved in the basis of the undamped ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._kernels.blas_threads import blas_for
from ._kernels.checks import ComplexArray, FloatArray, read_only, require_type
from ._kernels.door import door
from ._kernels.elimination import EPS
from ._representation import MOST, counted, html_table
from .errors import AxisMismatchError, DefectiveModesError
from .second_order_system import SecondOrderSystem
from .undamped_modes import OWN, RealModes, real_modes, require_own

PROPORTIONAL_TOLERANCE = 1e-11
"""Of |G_ij| / sqrt(G_ii G_jj), G = Phi^T C Phi. At resonance of modes i and j the neglected G_ij
changes H by this much (scaled error), anywhere else by less; 30 modes stay below 1e-9."""

CONDITION_LIMIT = 1e6
"""Of an eigenvalue (1 / cosine between left and right vector): round-off times this is 1e-10."""


@dataclass(frozen=True, eq=False)
class ComplexModes:
    """H(s) = sum over k of (a_k + b_k / s) p_k^T / (s - s_k).

    Parameters
    ----------
    poles : complex array, shape (n_poles,), rad/s
        Both of every conjugate pair; with a loss factor eta both of every pair near
        +-j w_r sqrt(1 + j eta), of which the one at negative frequency grows. A rigid-body
        coordinate adds one pole: its other one is the exact 1 / s.
    elastic_shapes : complex array, shape (n_dof, n_poles)
        a: displacement without rigid-body motion.
    rigid_shapes : complex array, shape (n_dof, n_poles)
        b: velocity of the rigid-body motion.
    participation : complex array, shape (n_dof, n_poles)
        p: how a force excites the pole.
    dofs : tuple of str
    """

    poles: ComplexArray
    elastic_shapes: ComplexArray
    rigid_shapes: ComplexArray
    participation: ComplexArray
    dofs: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<ComplexModes: {self._summary}>"

    def _repr_html_(self) -> str:
        by_size = sorted(self.poles, key=lambda s: (abs(s), s.imag))
        rows = [
            (f"{k}", f"{abs(s) / (2 * np.pi):.6g}", f"{s.real:.6g}", f"{s.imag:.6g}")
            for k, s in enumerate(by_size[:MOST], start=1)
        ]
        header = ("pole", "|s| / 2π, Hz", "Re s, 1/s", "Im s, rad/s")
        more = max(0, self.poles.size - MOST)
        return html_table(f"ComplexModes: {self._summary}", rows, header, more)

    @property
    def _summary(self) -> str:
        size = f"{counted(self.poles.size, 'pole')} of {counted(len(self.dofs), 'DoF')}"
        if not self.poles.size:
            return size
        return f"{size}, |s| / 2π up to {np.abs(self.poles).max() / (2 * np.pi):.6g} Hz"


def modal_damping(modes: RealModes, damping: FloatArray) -> FloatArray:
    """Return Phi^T C Phi (1/s), with entries that are only round-off of the product set to zero.

    Round-off is 4 n eps (|Phi|^T |C| |Phi|)_ij: what rounding each entry of C would change.
    """
    absolute = np.abs(modes.shapes)
    result: FloatArray = modes.shapes.T @ damping @ modes.shapes
    noise = 4 * len(damping) * EPS * (absolute.T @ np.abs(damping) @ absolute)
    return np.where(np.abs(result) <= noise, 0.0, result)


def is_proportional(modal: FloatArray) -> bool:
    """Whether Phi^T C Phi is diagonal, within `PROPORTIONAL_TOLERANCE`."""
    size = np.sqrt(np.abs(np.diag(modal)))
    off = np.abs(modal - np.diag(np.diag(modal)))
    return bool((off <= PROPORTIONAL_TOLERANCE * np.outer(size, size)).all())


def rayleigh_coefficients(system: SecondOrderSystem) -> tuple[float, float] | None:
    """Return alpha (1/s) and beta (s) of C = alpha M + beta K; None if C is no such sum.

    Least squares over the entries, each divided by sqrt(C_ii C_jj); the sum must meet every one
    within `PROPORTIONAL_TOLERANCE`.
    """
    if not system.damping.any():
        return 0.0, 0.0
    damped = np.diag(system.damping) != 0
    if (system.damping[~damped] != 0).any() or (system.damping[:, ~damped] != 0).any():
        return None
    root = np.sqrt(np.abs(np.where(damped, np.diag(system.damping), 1.0)))
    scaled = [
        (matrix / np.outer(root, root)).ravel()
        for matrix in (system.mass, system.stiffness, system.damping)
    ]
    columns = np.column_stack(scaled[:2])
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0] = 1.0
    found = np.linalg.lstsq(columns / norms, scaled[2])[0] / norms
    if np.abs(columns @ found - scaled[2]).max() > PROPORTIONAL_TOLERANCE:
        return None
    return float(found[0]), float(found[1])


def require_own_pairs(system: SecondOrderSystem, modes: ComplexModes) -> None:
    """Refuse complex modes that are not those of this system; see `require_own`.

    Row by row, (s_k^2 M + s_k C + K (1 + j eta)) (a_k + b_k / s_k) = 0 for a combination of all k.

    Raises
    ------
    AxisMismatchError
    """
    require_type(modes, ComplexModes, "the modes")
    if modes.dofs != system.dofs:
        raise AxisMismatchError("the modes belong to another system: their dofs differ")
    moving = modes.poles != 0
    s = modes.poles[moving]
    if not s.size:
        return
    u = modes.elastic_shapes[:, moving] + modes.rigid_shapes[:, moving] / s
    u = u / np.abs(u).max(axis=0) / np.maximum(np.abs(s), float(np.median(np.abs(s))))
    terms = [
        (system.mass, s**2),
        (system.damping, s),
        (system.stiffness, np.full(s.size, 1 + 1j * system.loss_factor)),
    ]
    c = np.random.default_rng(0).uniform(0.5, 1.0, s.size)
    force = sum(matrix @ (u @ (c * power)) for matrix, power in terms)
    size = sum(np.abs(matrix) @ (np.abs(u) @ (c * np.abs(power))) for matrix, power in terms)
    root = np.sqrt(np.where(size > 0, np.abs(np.diag(system.stiffness)) + EPS * size, 1.0))
    if (np.abs(force) > OWN * (size + 1e-3 * root * (size / root).max())).any():
        raise AxisMismatchError(
            "the modes belong to another system: with this one's matrices they do not solve "
            "(s^2 M + s C + K (1 + j eta)) u = 0"
        )


@door
def complex_modes(system: SecondOrderSystem, modes: RealModes | None = None) -> ComplexModes:
    """Solve (s^2 M + s C + K (1 + j eta)) u = 0 as the state (W q, q') of the undamped modes.

    With x = Phi q, W = diag(w_r) sqrt(1 + j eta) and G = Phi^T C Phi, the state matrix is
    [[0, W], [-W, -G]]: its norm is the highest w, not w^2 as in (q, q'). Rigid-body coordinates
    (w = 0) keep only q', their displacement being q' / s; that leaves no defective pair at s = 0.
    Those that C does not resist are split off with the exact pole 0. C need not be symmetric.

    Parameters
    ----------
    system : SecondOrderSystem
    modes : RealModes, optional
        Those of the system, if known already.

    Raises
    ------
    DefectiveModesError
        Critical damping, or so near to it that the modes do not span the state.
    IndefiniteMassError, IndefiniteStiffnessError
    """
    with blas_for(len(system.dofs)):
        space = state_space(system, modes)
        poles, right, left = _eigen(space.matrix)
        steady = space.steady  # s_k = 0 and b = p = phi: phi phi^T / s^2
        return ComplexModes(
            read_only(np.concatenate([np.zeros(steady.shape[1]), poles])),
            _joined(np.zeros_like(steady), space.elastic @ right),
            _joined(steady, space.rigid @ right),
            _joined(steady, (left @ space.force).T),
            system.dofs,
        )


@dataclass(frozen=True, eq=False)
class StateSpace:
    """H(s) = (elastic + rigid / s) (s - matrix)^-1 force + steady steady^T / s^2.

    Parameters
    ----------
    matrix : array, shape (N, N), rad/s
    elastic, rigid : array, shape (n_dof, N)
        Displacement without rigid-body motion, and velocity of the rigid-body motion.
    force : array, shape (N, n_dof)
    steady : array, shape (n_dof, n_steady)
        Rigid-body modes that C does not resist.
    """

    matrix: FloatArray | ComplexArray
    elastic: FloatArray | ComplexArray
    rigid: FloatArray
    force: FloatArray
    steady: FloatArray


def state_space(system: SecondOrderSystem, modes: RealModes | None = None) -> StateSpace:
    """Write the system in the state (W q, q') of its undamped modes; see `complex_modes`.

    Raises
    ------
    IndefiniteMassError, IndefiniteStiffnessError
    """
    if modes is not None:
        require_own(system, modes)
    real = real_modes(system) if modes is None else modes
    real = _split_undamped_rigid(real, system.damping)
    gamma = modal_damping(real, system.damping)
    free = _free_count(real, gamma)
    mode, moving = _states(real, free)
    every = _complex_frequency(real.angular_frequency, system.loss_factor)
    omega, shapes = every[mode], real.shapes[:, mode]
    rigid = moving & (omega == 0)
    return StateSpace(
        _state_matrix(every, gamma, mode, moving),
        shapes * np.divide(1.0, omega, out=np.zeros_like(omega), where=~moving),
        shapes * rigid,
        (shapes * moving).T,
        real.shapes[:, :free],
    )


def _joined(steady: FloatArray, others: NDArray[np.inexact]) -> ComplexArray:
    return read_only(np.hstack([steady, others]).astype(complex))


def _split_undamped_rigid(modes: RealModes, damping: FloatArray) -> RealModes:
    """Turn the rigid-body shapes so that those which C does not resist come first."""
    count = modes.n_rigid
    if count < 2:
        return modes
    rigid = modes.shapes[:, :count]
    _, turn = np.linalg.eigh(rigid.T @ (damping + damping.T) @ rigid)
    shapes = np.hstack([rigid @ turn, modes.shapes[:, count:]])
    return RealModes(modes.angular_frequency, shapes, count, modes.dofs)


def _free_count(modes: RealModes, gamma: FloatArray) -> int:
    """Return how many leading rigid-body modes have neither row nor column in Phi^T C Phi."""
    count = 0
    while count < modes.n_rigid and not (gamma[count].any() or gamma[:, count].any()):
        count += 1
    return count


def _states(modes: RealModes, free: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return each state's mode, and whether it is q' (or w q), from the highest mode down.

    In this order the state matrix is graded from large to small, and the QR algorithm then keeps
    the digits of the low poles next to a hub's 1e7 rad/s; in any other order they lose three.
    """
    last = modes.angular_frequency.size - 1
    states = [
        (k, moving)
        for k in range(last, free - 1, -1)
        for moving in ((False, True) if k >= modes.n_rigid else (True,))
    ]
    mode = np.array([k for k, _ in states], dtype=np.intp)
    return mode, np.array([moving for _, moving in states], dtype=np.bool_)


def _complex_frequency(omega: FloatArray, loss_factor: float) -> FloatArray | ComplexArray:
    """Return w sqrt(1 + j eta); real without a loss factor, so that poles pair exactly."""
    return omega * np.sqrt(1 + 1j * loss_factor) if loss_factor else omega


def _state_matrix(
    omega: FloatArray | ComplexArray,
    gamma: FloatArray,
    mode: NDArray[np.intp],
    moving: NDArray[np.bool_],
) -> FloatArray | ComplexArray:
    same = mode[:, None] == mode
    rate = np.where(same & ~moving[:, None] & moving, omega[mode], 0.0)  # (w q)' = w q'
    friction = np.where(moving[:, None] & moving, gamma[np.ix_(mode, mode)], 0.0)
    return rate - rate.T - friction


def _eigen(
    matrix: FloatArray | ComplexArray,
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return eigenvalues, right vectors (columns) and left vectors (rows), left @ right = 1."""
    if not matrix.size:
        return np.zeros(0, dtype=complex), matrix.astype(complex), matrix.astype(complex)
    poles, right = np.linalg.eig(matrix)
    try:
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError:
        condition = np.full(len(poles), np.inf)
    else:
        condition = np.linalg.norm(right, axis=0) * np.linalg.norm(left, axis=1)
    worst = int(np.argmax(condition))
    if not condition[worst] <= CONDITION_LIMIT:
        raise DefectiveModesError(
            f"the complex modes are defective, or nearly: the pole at {poles[worst]:.6g} rad/s "
            f"({abs(poles[worst]) / (2 * np.pi):.6g} Hz) has condition {condition[worst]:.2g} "
            f"(limit {CONDITION_LIMIT:.0e}), as at critical damping; use direct_frf"
        )
    return poles.astype(complex), right.astype(complex), left.astype(complex)

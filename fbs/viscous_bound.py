r"""What left-out modes add where viscous damping ties them to kept ones; see `truncation_bound`.

C is symmetric and positive semi-definite, no more. `modal_frf` solves the modal equations of the
kept modes alone, x~ = Phi_k y (Galerkin). With G = Phi^T C Phi, X = diag(w_r^2), mu = 1 + j eta,
Z = mu X - w^2 + jwG and Schur's complement S of Z_kk,

    H - H~ = r^T S^-1 r,   S = mu X_l - w^2 + jw G_ll + w^2 G_lk Z_kk^-1 G_kl,

r = Phi_l^T (f - jwC x~): what the residual force does to the left-out modes; K x~ and M x~ do
nothing there. Write C = N N^T and N_l = N^T Phi_l, alike for k. Then

    jwG_ll + w^2 G_lk Z_kk^-1 G_kl = jw N_l^T T N_l,   T = (1 + B)^-1,   B = jw N_k^T D^-1 N_k,

D = mu X_k - w^2 (Woodbury). Im D >= 0, so that the Hermitian part of B is not negative (with
undamped kept modes on the line, in the limit), and 2 T - 1 = (1 - B)(1 + B)^-1 is a contraction U:
jwT = (jw/2)(1 + U), ||T|| <= 1. In the scale of X_l^(1/2), with tau the largest eigenvalue of
X_l^(-1/2) G_ll X_l^(-1/2), which is that of F^T C F and needs no left-out mode, S becomes
mu - w^2/X + jw N^T T N. Its Hermitian part is at least

    delta = 1 - w^2 t_c - w tau / 2,

the skew-Hermitian (jw/2) N^T N adding nothing, so that its inverse W has norm 1/delta at most if
delta > 0; else there is no bound at this line. With R_0 = F F^T and a(f) = F^T (f - jwC x~) the
part lacks a^T W a. Of W = 1 / (mu - Delta), Delta = w^2/X - jw N^T T N = w^2 F^T M F - jw F^T C F
- w^2 F^T C Phi_k Z_kk^-1 Phi_k^T C F in that scale, known and of norm w^2 t_c + w tau at most, it
takes what a Neumann series tells: W = 1/mu + Delta/mu^2 + Delta W Delta/mu^2 twice over, so

    a^T W a = a^T a/mu + a^T Delta a/mu^2 + b^T b/mu + b^T V b,   b = Delta a/mu,

with V = W - 1/mu, rho = || Delta W/mu || <= (w^2 t_c + w tau) / (delta |mu|).

Any left-out mode counts here, whether it moves a port or not: C may tie it to one that does.
Residuals are not added: with C = alpha M + beta K alone they are a series in w.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._kernels import batched as _batched
from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.elimination import EPS
from .errors import undamped_pole
from .frf import Frf
from .modal_truncation import LeftOut
from .second_order_system import SecondOrderSystem
from .truncation_bound import SURE, Missing, PartLines, bilinear, real_product
from .undamped_modes import RealModes


def viscous_part(
    system: SecondOrderSystem,
    kept: RealModes,
    left_out: LeftOut,
    axis: FloatArray,
    ports: Sequence[str],
) -> PartLines:
    """Solve the modal equations of a truncated part, and bound what they lack.

    Parameters
    ----------
    system : SecondOrderSystem
        C symmetric and positive semi-definite.
    kept : RealModes
    left_out : LeftOut
    axis : array, shape (nf,), Hz
    ports : sequence of str

    Raises
    ------
    SingularLineError
        A line on an undamped pole of the kept modes.
    """
    index, factor = system.locate(ports)
    left = left_out.shapes[:, : len(system.dofs) - kept.angular_frequency.size]
    tie = left.T @ system.damping @ kept.shapes  # F^T C Phi_k
    inner = left.T @ system.damping @ left
    omega, mu = 2 * np.pi * axis, 1 + 1j * system.loss_factor
    solve = _solver(system, kept, axis)
    at_ports = (kept.shapes[index] * factor[:, None]).T
    amplitudes = solve(at_ports[:, :, None])
    force = (left[index] * factor[:, None]).T[:, :, None]
    vectors = force - 1j * omega * real_product(tie, amplitudes)
    small = omega**2 * real_product(left.T @ system.mass @ left, vectors)
    small -= omega**2 * real_product(tie, solve(real_product(tie.T, vectors)))
    small -= 1j * omega * real_product(inner, vectors)
    small /= mu  # b
    longest = float(left_out.squares.max(initial=0.0)) * SURE
    friction = float(np.linalg.eigvalsh(inner).max(initial=0.0)) * SURE
    delta = 1 - omega**2 * longest - omega * friction / 2
    settled = delta > 0
    delta = np.where(settled, delta, 1.0)
    radius = (omega**2 * longest + omega * friction) / (delta * abs(mu))
    known = np.where(
        settled, (bilinear(vectors, vectors + small) + bilinear(small, small)) / mu, 0.0
    )
    missing = Missing.given(known, np.where(settled, radius, np.inf), small)
    beyond = np.linalg.norm(vectors, axis=0) / delta
    sizes = _sizes(system, omega, real_product(kept.shapes, amplitudes), left, beyond)
    receptance = real_product(at_ports.T, amplitudes).transpose(2, 0, 1)
    return PartLines(Frf(axis, receptance, tuple(ports), tuple(ports)), (sizes, sizes), missing)


def _sizes(
    system: SecondOrderSystem,
    omega: FloatArray,
    motion: ComplexArray,
    left: FloatArray,
    beyond: FloatArray,
) -> FloatArray:
    """Return eps_p^(1/2) ||D x|| of x = x~ + F W a, || W a || <= `beyond`; D^2 has a share of C."""
    weights = np.array([np.diag(m) for m in (system.stiffness, system.mass, system.damping)])
    loads = np.sqrt(np.einsum("wd,dpf->wpf", weights, np.abs(motion) ** 2))
    loads += np.sqrt((weights @ left**2).sum(axis=1))[:, None, None] * beyond
    stiffness = np.full(omega.size, abs(1 + 1j * system.loss_factor))
    scale = np.sqrt(np.array([stiffness, omega**2, omega]))
    return np.asarray(np.sqrt(4 * len(system.dofs) * EPS) * (loads * scale[:, None]).sum(axis=0))


def _solver(
    system: SecondOrderSystem, kept: RealModes, axis: FloatArray
) -> Callable[[NDArray[Any]], ComplexArray]:
    """Return what takes right sides (n_kept, n, nf or 1) to Z_kk^-1 of them."""
    omega = 2 * np.pi * axis
    square = kept.angular_frequency**2 * (1 + 1j * system.loss_factor)
    matrices = 1j * omega[:, None, None] * (kept.shapes.T @ system.damping @ kept.shapes)
    diagonal = np.arange(square.size)
    matrices[:, diagonal, diagonal] += square - omega[:, None] ** 2
    inverse, singular = _batched.inverse(matrices)
    if singular.any():
        raise undamped_pole(axis[singular])
    return lambda right: np.ascontiguousarray(
        (inverse @ right.transpose(2, 0, 1)).transpose(1, 2, 0)
    )

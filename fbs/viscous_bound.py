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
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._kernels import batched as _batched
from ._kernels.checks import ComplexArray, FloatArray
from .errors import undamped_pole
from .modal_truncation import TruncatedModes
from .second_order_system import SecondOrderSystem
from .truncation_bound import SURE, Missing, PartLines, real_product
from .undamped_modes import EPS, RealModes


@dataclass(frozen=True, eq=False)
class ViscousPart:
    """A truncated part with general viscous damping between its ports: what all lines share.

    Parameters
    ----------
    axis : array, shape (nf,), Hz
    loss_factor : float
    kept : RealModes
    friction : array, shape (n_kept, n_kept)
        Phi_k^T C Phi_k.
    shapes, left : array, shape (n_kept, n_port), (n_left, n_port)
        Phi_k^T and F^T at the ports.
    tie : array, shape (n_left, n_kept)
        F^T C Phi_k.
    inertia, inner : array, shape (n_left, n_left)
        F^T M F and F^T C F.
    longest, friction_left : float
        t_c and tau, s^2 and s.
    weights : array, shape (3, n_dof)
        Diagonals of K, M and C.
    left_loads : array, shape (3,)
        || weights^(1/2) F ||.
    round_off : float
        eps_p.
    """

    axis: FloatArray
    loss_factor: float
    kept: RealModes
    friction: FloatArray
    shapes: FloatArray
    left: FloatArray
    tie: FloatArray
    inertia: FloatArray
    inner: FloatArray
    longest: float
    friction_left: float
    weights: FloatArray
    left_loads: FloatArray
    round_off: float

    @classmethod
    def of(
        cls,
        system: SecondOrderSystem,
        modes: TruncatedModes,
        axis: FloatArray,
        ports: Sequence[str],
    ) -> ViscousPart | None:
        """Prepare a part; None where it has residuals, or a rigid-body mode is left out."""
        kept, left_out = modes.kept, modes.left_out
        if left_out is None or modes.residuals:
            return None
        n = len(system.dofs)
        index, factor = system.locate(ports)
        left = left_out.shapes[:, : n - kept.angular_frequency.size]
        weights = np.array([np.diag(m) for m in (system.stiffness, system.mass, system.damping)])
        inner = left.T @ system.damping @ left
        return cls(
            axis,
            system.loss_factor,
            kept,
            kept.shapes.T @ system.damping @ kept.shapes,
            (kept.shapes[index] * factor[:, None]).T,
            (left[index] * factor[:, None]).T,
            left.T @ system.damping @ kept.shapes,
            left.T @ system.mass @ left,
            inner,
            float(left_out.squares.max(initial=0.0)) * SURE,
            float(np.linalg.eigvalsh(inner).max(initial=0.0)) * SURE,
            weights,
            np.sqrt((weights @ left**2).sum(axis=1)),
            4 * n * EPS,
        )

    def on(self, lines: slice) -> PartLines:
        """Return the part on some lines.

        Raises
        ------
        SingularLineError
            A line on an undamped pole of the kept modes.
        """
        omega = 2 * np.pi * self.axis[lines]
        solve = self._solver(omega, lines)
        amplitudes = solve(self.shapes[:, :, None])
        receptance = np.einsum("kp,kqf->pqf", self.shapes, amplitudes)
        vectors = self.left[:, :, None] - 1j * omega * real_product(self.tie, amplitudes)
        mu = 1 + 1j * self.loss_factor
        tied = solve(real_product(self.tie.T, vectors))
        small = omega**2 * (real_product(self.inertia, vectors) - real_product(self.tie, tied))
        small -= 1j * omega * real_product(self.inner, vectors)
        small /= mu  # b
        known = _gram(vectors, vectors + small) + _gram(small, small)
        reach = omega**2 * self.longest + omega * self.friction_left
        delta = 1 - omega**2 * self.longest - omega * self.friction_left / 2
        settled = delta > 0
        delta = np.where(settled, delta, 1.0)
        radius = np.where(settled, reach / (delta * abs(mu)), np.inf)
        missing = Missing(np.where(settled, known / mu, 0.0), radius, small)
        beyond = np.linalg.norm(vectors, axis=0) / delta
        sizes = self._sizes(omega, abs(mu), amplitudes, beyond)
        return PartLines(receptance, (sizes, sizes), missing)

    def _solver(self, omega: FloatArray, lines: slice) -> Callable[[NDArray[Any]], ComplexArray]:
        """Return what takes right sides (n_kept, n, nf or 1) to Z_kk^-1 of them."""
        square = self.kept.angular_frequency**2 * (1 + 1j * self.loss_factor)
        matrices = 1j * omega[:, None, None] * self.friction
        diagonal = np.arange(square.size)
        matrices[:, diagonal, diagonal] += square - omega[:, None] ** 2
        inverse, singular = _batched.inverse(matrices)
        if singular.any():
            raise undamped_pole(self.axis[lines][singular])
        return lambda right: np.ascontiguousarray(
            (inverse @ right.transpose(2, 0, 1)).transpose(1, 2, 0)
        )

    def _sizes(
        self, omega: FloatArray, mu: float, amplitudes: ComplexArray, beyond: FloatArray
    ) -> FloatArray:
        """Return eps_p^(1/2) ||D x||, x = x~ + F W a."""
        motion = real_product(self.kept.shapes, amplitudes)
        energies = np.einsum("wd,dpf->wpf", self.weights, np.abs(motion) ** 2)
        loads = np.sqrt(energies) + self.left_loads[:, None, None] * beyond
        scale = np.sqrt(np.array([np.full(omega.size, mu), omega**2, omega]))
        return np.asarray(np.sqrt(self.round_off) * (loads * scale[:, None]).sum(axis=0))


def _gram(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Return a_i^T b_j."""
    return np.asarray(np.einsum("mif,mjf->ijf", left, right))

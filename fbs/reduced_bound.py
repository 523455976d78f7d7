r"""What a part reduced to u = T p lacks, by the residuals of its Ritz modes.

Notation as in `truncation_bound`. C = alpha M + beta K (or none), any loss factor. Craig and
Bampton's, Rubin's, Guyan's, SEREP's basis, a Krylov subspace: the projected system has modes of
its own, the Ritz modes psi_s at theta_s, psi^T M psi = 1, and with d_s = mu theta_s^2 - v

    H~_ij = sum_s psi_is psi_js / d_s,   x~_j = sum_s psi_s psi_js / d_s,
    r_j = f_j - Z x~_j = f_j - M Psi Psi^T f_j - mu sum_s (K - theta_s^2 M) psi_s psi_js / d_s.

Z is symmetric, and so exactly, whatever Psi is,

    H_ij - H~_ij = x~_i^T r_j + r_i^T Z^-1 r_j

(Prager & Synge 1947, Q. Appl. Math. 5, 241: the error is quadratic in the residual). The first term
is round-off, Psi^T r_j = 0. In the second, of the part's own modes those up to twice the last line
are taken as they are, and of the others no more than `truncate` tells: with b = Phi_k^T r and
a = F^T r, F's columns phi_r / w_r,

    r_i^T Z^-1 r_j = sum_k b_ik b_jk / (mu w_k^2 - v) + a_i^T g(t) a_j,   g(t) = 1 / (mu - v t),

enclosed on 0 <= t <= t_c as there. A basis that holds the modes of the band, as Rubin's, leaves
b = 0; Craig and Bampton's leaves b of the order of its error, and both terms are squares of it.
Undamped there is a bound, too: no left-out mode lies near the line, wherever Ritz modes lie.

MacNeal's and dual Craig-Bampton's matrices are no projection, and have no such residual; what they
give of the part alone is bounded by `BoundedFrf.of`. Of other viscous damping the modes are tied:
there is no bound through joints, and of the part alone that of `galerkin_bound`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, eigh

from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.elimination import EPS
from ._systems import Target
from .damped_modes import rayleigh_coefficients
from .errors import FbsError
from .frf import Frf, Quantity
from .modal_synthesis import real_sum
from .modal_truncation import truncate
from .reduction import Reduction
from .second_order_system import SecondOrderSystem
from .truncation_bound import (
    SURE,
    Missing,
    PartLines,
    bilinear,
    enclosed,
    loads,
    misfit,
    real_product,
)
from .undamped_modes import RealModes, real_modes

BEYOND = 2.0
"""Times the last line: the part's own modes above are left to the enclosure, |tau| <= 0.08."""

PROJECTED = 1e-9
"""Of |T^T K T - K_p| and its like, over diagonals: round-off of any sane basis is far below."""


@dataclass(frozen=True, eq=False)
class ReducedPart:
    """A part whose motion is u = T p, its matrices projected: T^T M T, T^T C T, T^T K T.

    Parameters
    ----------
    system : SecondOrderSystem
        The whole part.
    basis : array, shape (n_dof, n)
        T, linearly independent columns: `Reduction.basis`, `ReducedFrf.vectors`.

    Raises
    ------
    FbsError
        The basis does not fit the system.
    """

    system: SecondOrderSystem
    basis: FloatArray

    def __post_init__(self) -> None:
        if np.ndim(self.basis) != 2 or len(self.basis) != len(self.system.dofs):
            raise FbsError(
                f"the basis has shape {np.shape(self.basis)}; {len(self.system.dofs)} DoFs need "
                "as many rows"
            )

    @classmethod
    def of(cls, reduction: Reduction) -> ReducedPart:
        """Take a reduction that is a projection.

        Raises
        ------
        FbsError
            MacNeal's and dual Craig-Bampton's are none.
        """
        part = cls(reduction.source, reduction.basis)
        for name in ("mass", "stiffness"):
            found, given = (getattr(one, name) for one in (part._projected, reduction.system))
            root = np.sqrt(np.abs(np.diag(found)))
            if (np.abs(found - given) > PROJECTED * np.outer(root, root)).any():
                raise FbsError(
                    "the reduced matrices are no projection T^T M T, T^T K T of the part's "
                    "(MacNeal, dual Craig-Bampton): a residual says nothing of their error"
                )
        return part

    @property
    def no_guarantee(self) -> str | None:
        """Why nothing can be guaranteed, at any line; None if it can."""
        if rayleigh_coefficients(self.system) is not None:
            return None
        return (
            "a reduced part needs viscous damping C = alpha M + beta K, or none (galerkin_bound "
            "bounds other parts, each on its own)"
        )

    @cached_property
    def modes(self) -> RealModes:
        """The whole part's."""
        return real_modes(self.system)

    @cached_property
    def ritz(self) -> RealModes:
        """Of the projected matrices, in the whole part's coordinates."""
        projected = self._projected
        try:
            square, shapes = eigh(projected.stiffness, projected.mass)
        except LinAlgError:
            raise FbsError("the basis has dependent columns: T^T M T is not definite") from None
        # round-off of the largest; whatever psi and theta are, the residual counts it
        square[square < square.size * EPS * square[-1]] = 0.0
        n_rigid = int(np.sum(square == 0))
        return RealModes(np.sqrt(square), self.basis @ shapes, n_rigid, self.system.dofs)

    @property
    def _projected(self) -> SecondOrderSystem:
        system, names = self.system, tuple(f"p{k}" for k in range(self.basis.shape[1]))
        products = (
            self.basis.T @ m @ self.basis for m in (system.mass, system.damping, system.stiffness)
        )
        mass, damping, stiffness = ((m + m.T) / 2 for m in products)
        return SecondOrderSystem(mass, damping, stiffness, names, {}, system.loss_factor)

    def frf(self, axis: FloatArray, ports: Sequence[str]) -> Frf:
        """Sum the Ritz modes, or solve line by line where damping ties them.

        Raises
        ------
        SingularLineError
            A line on an undamped pole of the reduced part.
        """
        coefficients = rayleigh_coefficients(self.system)
        if coefficients is None:
            return Reduction(self._projected, self.basis, self.system).frf(axis, ports, ports)
        target = Target.of(self.system, axis, ports, ports, Quantity.RECEPTANCE)
        friction = coefficients[0] + coefficients[1] * self.ritz.angular_frequency**2
        return real_sum(self.ritz, friction, (), self.system, target)

    def lines(
        self, coefficients: tuple[float, float], axis: FloatArray, ports: Sequence[str]
    ) -> PartLines:
        """Sum the Ritz modes, and bound what they lack, C = alpha M + beta K.

        Raises
        ------
        As `frf`.
        """
        frf = self.frf(axis, ports)
        system, ritz, (alpha, beta) = self.system, self.ritz, coefficients
        index, factor = system.locate(ports)
        omega = frf.omega
        mu, v = 1 + 1j * (system.loss_factor + omega * beta), omega**2 - 1j * omega * alpha
        low = self.modes.natural_frequencies <= BEYOND * axis[-1]
        kept, left_out = self.modes.truncated(low), truncate(system, low, None, self.modes).left_out
        assert left_out is not None  # rigid-body modes lie at 0 Hz

        at_ports = ritz.shapes[index] * factor[:, None]
        gains = at_ports.T[:, :, None] / _dynamic(ritz, mu, v)[:, None]
        shapes = np.hstack([ritz.shapes, kept.shapes, left_out.shapes])
        constant = (shapes[index] * factor[:, None]).T
        constant -= shapes.T @ system.mass @ ritz.shapes @ at_ports.T
        defect = system.stiffness @ ritz.shapes
        defect -= system.mass @ ritz.shapes * ritz.angular_frequency**2
        rest = constant[:, :, None] - mu * real_product(shapes.T @ defect, gains)
        ends = np.cumsum([ritz.angular_frequency.size, kept.angular_frequency.size])
        of_ritz, of_kept, of_left = np.split(rest, ends)  # Psi^T r, b and a

        dynamic = _dynamic(kept, mu, v)
        on_pole = (np.abs(dynamic) <= EPS * np.abs(v)).any(axis=0)
        response = of_kept / np.where(on_pole, 1.0, dynamic)[:, None]
        longest = float(left_out.squares.max(initial=0.0)) * SURE
        middle = enclosed(mu, v, longest)
        y = 2 * left_out.squares / longest - 1 if longest > 0 else np.zeros_like(left_out.squares)
        inner = np.polynomial.chebyshev.chebval(y, middle.coefficients).T  # (n_left, nf)
        known = bilinear(gains, of_ritz) + bilinear(of_kept, response)
        known += bilinear(of_left, inner[:, None] * of_left)
        radius = np.where(on_pole, np.inf, middle.radius)
        known[:, :, ~np.isfinite(radius)] = 0.0

        sizes = np.abs(np.concatenate([gains, response, of_left * middle.largest]))
        of_stiffness, of_mass = np.einsum("wr,rpf->wpf", loads(system, shapes), sizes)
        total = np.sqrt(np.abs(mu)) * of_stiffness + np.sqrt(np.abs(v)) * of_mass
        total *= np.sqrt(len(system.dofs) * (4 * EPS + misfit(system, coefficients)))
        return PartLines(frf, (total, total), Missing.given(known, radius, of_left))


def _dynamic(
    modes: RealModes, mu: NDArray[np.complexfloating], v: NDArray[np.complexfloating]
) -> ComplexArray:
    """Return mu w_r^2 - v, shape (n, nf)."""
    return np.asarray(mu * (modes.angular_frequency**2)[:, None] - v)

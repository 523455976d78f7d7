r"""What the modes left out of a part add to its FRFs, enclosed without knowing them.

Notation: H = sum_r phi phi^T / (mu x_r - v), x_r = w_r^2, mu = 1 + j (eta + w beta) and
v = w^2 - j w alpha, as in `TruncatedModes`; f_r = phi_r / w_r. A part lacks, between forces f, f',

    E(f, f') = known(f, f') + a(f)^T V a(f'),   || V || <= rho,

a linear in the force and known, V an unknown operator, rho one number a line.

C = alpha M + beta K (or none), any loss factor
    Residuals R_0 ... R_p leave, mode by mode, a geometric series without its first p + 1 terms,

        1/(mu x - v) - sum_k v^k / (mu x)^(k+1) = (v / (mu x))^(p+1) / (mu x - v)
                                                = t^(p+2) (v/mu)^(p+1) g(t),

    t = 1/x and g(t) = 1 / (mu - v t). So a(f) holds the numbers t_r^((p+1)/2) f_r^T f of the
    left-out modes, and E = a^T diag(g(t_r)) a (v/mu)^(p+1). Of the t_r only 0 <= t_r <= t_c is
    used, 1/t_c the square of any lower bound of the first left-out frequency; what a^T q(t) a is
    for a polynomial q, sums of the next residuals R_(p+1), R_(p+2), ..., statics tell without the
    modes. With y = 2 t/t_c - 1, h = v t_c / 2 and zeta = (mu - h)/h,

        g = 1 / (h (zeta - y)) = 2 / (h s) (1/2 + sum_(k>=1) tau^k T_k(y)),

    s = (zeta^2 - 1)^(1/2), tau = zeta - s, the sign of the root such that |tau| < 1 (generating
    function of Chebyshev's polynomials, |T_k| <= 1). The sum to k = m is the known part, and

        rho = |2 / (h s)| |tau|^(m+1) / (1 - |tau|),   times |v/mu|^(p+1).

    Where damped modes are left out at or below the line tau is near the unit circle, and a disc is
    better: mu - v t runs along a straight segment from z_0 = mu to z_1 = mu - v t_c, so g(t) along
    an arc of a circle through 0, on the side that 0 is not on, and its measure is twice the angle
    at which the segment is seen from 0 (inscribed angle). Up to 90 degrees, Re z_0 z_1* >= 0, it
    is at most a semicircle and lies in the disc over its chord,

        c = (1/z_0 + 1/z_1) / 2,  rho = |v| t_c / (2 |z_0 z_1|);

    beyond, the disc of the whole circle is taken: c = 1/(2 z), rho = |c|, z the segment's point
    nearest to 0. The known part is c a^T a then. At every line the smaller rho counts. Undamped
    and at or above the first left-out frequency, z = 0 and |tau| = 1: there is no bound.

General viscous damping
    See `viscous_bound`.

Ports
    A mode that moves neither what is asked for nor a joint, 16 n eps of its largest entry at most,
    adds nothing and limits nothing, whether kept or not.

Round-off
    Solving for modes and summing them is as if Z had been changed by dZ, |x^T dZ y| <=
    eps_p ||D x|| ||D y||, D^2 = |mu| diag K + |v| diag M (Cholesky factors and one-sided Jacobi are
    backward stable in that scale, see `real_modes`); dH = -H dZ H, so

        |dH_ij| <= eps_p s_i s_j,   s_i = sum_r ||D phi_r|| |phi_ir| / |mu x_r - v|,

    which also bounds the rounding of the sum itself. eps_p = 4 n eps, and n times the largest
    |C - alpha M - beta K| / sqrt(C_ii C_jj) where residuals rest on alpha and beta.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._kernels.checks import ComplexArray, FloatArray
from .damped_modes import modal_damping, rayleigh_coefficients
from .frf import Frf
from .modal_synthesis import modal_frf
from .modal_truncation import TruncatedModes
from .second_order_system import SecondOrderSystem
from .undamped_modes import EPS, RealModes

SURE = 1 + 1e-9
"""By this much the first left-out frequency is taken lower: eps times any condition that leaves
modes their digits, and no loss but within a billionth of that frequency."""


SEMI_DEFINITE = 1e-12
"""Of C scaled to a unit diagonal: an eigenvalue above minus this is round-off of assembly."""


DEGREE = 4
"""m: the known part's error falls by |tau| with each; 0.17^5 with the first left-out mode a factor
of 1.4 above the line, 0.5^5 a factor of 1.06."""


@dataclass(frozen=True, eq=False)
class Missing:
    """What a part lacks between its ports: known + a_i^T V a_j, || V || <= rho.

    Parameters
    ----------
    known : complex array, shape (n_port, n_port, nf)
    radius : array, shape (nf,)
        rho; infinite where there is no bound, and `known` is 0 there.
    vectors : array, shape (m, n_port) or (m, n_port, nf)
        The columns a_i; real where they are the same on every line.
    """

    known: ComplexArray
    radius: FloatArray
    vectors: NDArray[np.inexact]

    def gram(self) -> NDArray[np.inexact]:
        """Return a_i^H a_j, shape (n_port, n_port, nf), or 1 in place of nf."""
        if self.vectors.ndim == 2:
            return np.asarray((self.vectors.T @ self.vectors)[:, :, None])
        return np.asarray(np.einsum("mif,mjf->ijf", self.vectors.conj(), self.vectors))

    def acting(self, forces: ComplexArray) -> ComplexArray:
        """Return a(f), shape (m, n, nf), of forces on the ports, shape (n_port, n, nf)."""
        if self.vectors.ndim == 2:
            return real_product(self.vectors, forces)
        return np.asarray(np.einsum("mpf,pjf->mjf", self.vectors, forces))


@dataclass(frozen=True, eq=False)
class PartLines:
    """A part between its ports on some lines.

    Parameters
    ----------
    receptance : complex array, shape (n_row, n_column, nf), m/N
    sizes : array, shape (n_row, nf), and (n_column, nf)
        Round-off changes no receptance by more than sizes_i sizes_j.
    missing : Missing or None
        None where the receptance is complete. Rows and columns are the same ports then.
    """

    receptance: ComplexArray
    sizes: tuple[FloatArray, FloatArray]
    missing: Missing | None


@dataclass(frozen=True, eq=False)
class GivenPart:
    """A part whose FRFs are given.

    Parameters
    ----------
    frf : Frf
        Between its ports.
    complete : bool
        Whether they are taken as they are; otherwise they lack what nothing bounds.
    """

    frf: Frf
    complete: bool = True

    def on(self, lines: slice) -> PartLines:
        """Return the part on some lines; |H_ij| <= sqrt(max_j |H_ij| max_i |H_ij|)."""
        values = np.ascontiguousarray(self.frf.values.transpose(1, 2, 0)[:, :, lines])
        modulus = np.abs(values)
        sizes = tuple(np.sqrt(EPS * modulus.max(axis=axis, initial=0.0)) for axis in (1, 0))
        if self.complete:
            return PartLines(values, (sizes[0], sizes[1]), None)
        nf = values.shape[2]
        unknown = Missing(np.zeros_like(values), np.full(nf, np.inf), np.zeros((0, len(values))))
        return PartLines(values, (sizes[0], sizes[1]), unknown)


@dataclass(frozen=True, eq=False)
class RayleighPart:
    """A truncated part with C = alpha M + beta K between its ports: what all lines share.

    Parameters
    ----------
    frf : Frf
        Of the truncated part.
    rates : (eta, alpha, beta)
    kept : RealModes
    friction : array, shape (n_kept,)
        phi^T C phi.
    vectors : array, shape (n, n_port)
        a, see `Missing`.
    moments : array, shape (m + 1, n_port, n_port)
        a^T T_k(y) a.
    power : int
        p + 1.
    longest : float, s^2
        t_c.
    amplitudes : array, shape (2, n_port, n_kept)
        |phi_ir| times ||D phi_r||, of the stiffness's part and the mass's.
    left_amplitudes : array, shape (2, n_port)
        The same of the left-out modes, each over w_r^2, added up.
    round_off : float
        eps_p.
    """

    frf: Frf
    rates: tuple[float, float, float]
    kept: RealModes
    friction: FloatArray
    vectors: FloatArray
    moments: FloatArray
    power: int
    longest: float
    amplitudes: FloatArray
    left_amplitudes: FloatArray
    round_off: float

    @classmethod
    def of(
        cls,
        system: SecondOrderSystem,
        modes: TruncatedModes,
        axis: FloatArray,
        ports: Sequence[str],
    ) -> RayleighPart | None:
        """Prepare a part; None where its damping is another, or a rigid-body mode is left out.

        Raises
        ------
        As `modal_frf`.
        """
        coefficients, kept, left_out = rayleigh_coefficients(system), modes.kept, modes.left_out
        if coefficients is None or left_out is None:
            return None
        index, factor = system.locate(ports)
        heard = moving(left_out.shapes, index)
        left, squares = left_out.shapes[:, heard], left_out.squares[heard]
        power = len(modes.residuals)
        weighted = left[index] * factor[:, None] * squares ** (power / 2)
        longest = float(squares.max(initial=0.0)) * SURE
        at_ports = np.abs(factor)[:, None]
        amplitudes = np.abs(kept.shapes[index]) * at_ports * _loads(system, kept.shapes)
        left_amplitudes = np.abs(left[index]) * at_ports * _loads(system, left)
        return cls(
            modal_frf(system, axis, ports, ports, modes=modes),
            (system.loss_factor, *coefficients),
            kept,
            np.diag(modal_damping(kept, system.damping)),
            np.linalg.qr(weighted.T, mode="r"),
            _moments(weighted, squares, longest),
            power,
            longest,
            amplitudes,
            left_amplitudes.sum(axis=2),
            len(system.dofs) * (4 * EPS + _misfit(system, coefficients)),
        )

    def on(self, lines: slice) -> PartLines:
        """Return the part on some lines."""
        omega = self.frf.omega[lines]
        eta, alpha, beta = self.rates
        mu, v = 1 + 1j * (eta + omega * beta), omega**2 - 1j * omega * alpha
        power = (v / mu) ** self.power
        middle = enclosed(mu, v, self.longest)
        known = np.tensordot(self.moments, middle.coefficients * power, (0, 0))
        values = np.ascontiguousarray(self.frf.values.transpose(1, 2, 0)[:, :, lines])
        radius = np.where(np.isfinite(middle.radius), middle.radius * np.abs(power), np.inf)
        missing = Missing(known, radius, self.vectors)
        sizes = self._sizes(omega, mu, v, middle.largest)
        return PartLines(values, (sizes, sizes), missing)

    def _sizes(
        self, omega: FloatArray, mu: ComplexArray, v: ComplexArray, largest: FloatArray
    ) -> FloatArray:
        square = self.kept.angular_frequency[:, None] ** 2
        real, imaginary = square - omega**2, self.friction[:, None] * omega
        imaginary = imaginary + self.rates[0] * square
        inverse = 1 / np.hypot(real, imaginary)
        of_stiffness, of_mass = (
            self.amplitudes @ inverse + self.left_amplitudes[:, :, None] * largest
        )
        total = np.sqrt(np.abs(mu)) * of_stiffness + np.sqrt(np.abs(v)) * of_mass
        return np.asarray(np.sqrt(self.round_off) * total)


@dataclass(frozen=True, eq=False)
class Enclosure:
    """|g - sum_k coefficients_k T_k(2 t/t_c - 1)| <= radius and |g| <= largest on 0 <= t <= t_c.

    Coefficients of shape (m + 1, nf), the others (nf,). Where g has a pole the radius is infinite,
    and the others are 0.
    """

    coefficients: ComplexArray
    radius: FloatArray
    largest: FloatArray


def enclosed(mu: ComplexArray, v: ComplexArray, longest: float) -> Enclosure:
    """Enclose g(t) = 1 / (mu - v t), 0 <= t <= `longest`; see the module."""
    end, size, half = mu - v * longest, np.abs(v), v * longest / 2
    foot = 1j * (mu * v.conj()).imag * v / np.where(size > 0, size, 1.0) ** 2
    along = (mu * v.conj()).real  # |v|^2 times the t at which mu - v t is nearest to 0
    beside = (along > 0) & (along < longest * size**2)
    nearest = np.where(beside, np.abs(foot), np.minimum(np.abs(mu), np.abs(end)))
    whole = (mu * end.conj()).real <= 0  # more than a semicircle
    lost = nearest == 0
    root = np.sqrt(mu * end)  # h s
    root *= np.where(((mu - half).conj() * root).real < 0, -1, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = np.abs(half) / (np.abs(mu) * np.abs(end))
        disc = np.where(whole, 1 / (2 * np.abs(foot)), chord)
        centre = np.where(whole, 1 / (2 * foot), (1 / mu + 1 / end) / 2)
        tau = half / (mu - half + root)  # 1 / (zeta + s)
        series = 2 / np.abs(root) * np.abs(tau) ** (DEGREE + 1) / (1 - np.abs(tau))
        better = (np.abs(tau) < 1) & (series < disc)
        coefficients = np.where(better, 2 / root, 0) * tau ** np.arange(DEGREE + 1)[:, None]
        largest = 1 / nearest
    coefficients[0] = np.where(better, coefficients[0] / 2, centre)
    coefficients[1:, ~better] = 0.0
    coefficients[:, lost] = 0.0
    radius = np.where(lost, np.inf, np.where(better, series, disc))
    return Enclosure(coefficients, radius, np.where(lost, 0.0, largest))


def _moments(weighted: FloatArray, squares: FloatArray, longest: float) -> FloatArray:
    """Return a^T T_k(2 t/t_c - 1) a, k = 0 ... m, of the columns `weighted`."""
    y = 2 * squares / longest - 1 if longest > 0 else np.zeros_like(squares)
    values = np.polynomial.chebyshev.chebvander(y, DEGREE)
    return np.asarray(np.einsum("ir,rk,jr->kij", weighted, values, weighted))


def no_guarantee(system: SecondOrderSystem, modes: TruncatedModes) -> str | None:
    """Return why nothing can be guaranteed of a truncated part, at any line; None if it can."""
    if modes.left_out is None:
        return "a rigid-body mode is left out: what it adds, -1/w^2, has no bound"
    damping = system.damping
    if rayleigh_coefficients(system) is not None:
        return None
    if not np.array_equal(damping, damping.T):
        return "the damping matrix is not symmetric"
    root = np.sqrt(np.where(np.diag(damping) > 0, np.diag(damping), 1.0))
    lowest = np.linalg.eigvalsh(damping / np.outer(root, root))[0]
    if lowest < -SEMI_DEFINITE:
        return f"the damping matrix is indefinite (an eigenvalue of {lowest:.3g}, scaled)"
    return None


def real_product(matrix: FloatArray, vectors: ComplexArray) -> ComplexArray:
    """Multiply vectors, shape (n, n_vector, nf), by a real matrix."""
    shape = vectors.shape[1:]
    flat = np.ascontiguousarray(vectors).reshape(len(vectors), shape[0] * shape[1]).view(float)
    return (matrix @ flat).view(complex).reshape(len(matrix), *shape)


def moving(shapes: FloatArray, index: Sequence[int]) -> NDArray[np.bool_]:
    """Whether each mode (column) moves one of some DoFs by more than round-off of its shape."""
    limit = 16 * len(shapes) * EPS * np.abs(shapes).max(axis=0, initial=0.0)
    return np.asarray(np.abs(shapes[index]).max(axis=0, initial=0.0) > limit)


def _loads(system: SecondOrderSystem, shapes: FloatArray) -> FloatArray:
    """Return || diag(K)^(1/2) phi || and || diag(M)^(1/2) phi ||, shape (2, 1, n)."""
    weights = np.array([np.diag(system.stiffness), np.diag(system.mass)])
    return np.asarray(np.sqrt(weights @ shapes**2)[:, None])


def _misfit(system: SecondOrderSystem, coefficients: tuple[float, float]) -> float:
    """Return the largest |C - alpha M - beta K| / sqrt(C_ii C_jj)."""
    alpha, beta = coefficients
    root = np.sqrt(np.abs(np.diag(system.damping)))
    rest = np.abs(system.damping - alpha * system.mass - beta * system.stiffness)
    size = np.outer(root, root)
    return float(np.divide(rest, size, out=np.zeros_like(rest), where=size > 0).max())

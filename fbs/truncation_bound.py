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
    function of Chebyshev's polynomials, |T_k| <= 1; Mason & Handscomb 2003, Chebyshev Polynomials,
    ch. 5). The sum to k = m is the known part, and

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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.elimination import EPS
from ._systems import Target
from .damped_modes import modal_damping
from .frf import Frf, Quantity
from .modal_synthesis import real_sum
from .modal_truncation import LeftOut, TruncatedModes
from .second_order_system import SecondOrderSystem

SURE = 1 + 1e-9
"""By this much the first left-out frequency is taken lower: eps times any condition that leaves
modes their digits, and no loss but within a billionth of that frequency."""


SEMI_DEFINITE = 1e-12
"""Of C scaled to a unit diagonal: an eigenvalue above minus this is round-off of assembly."""


DEGREE = 4
"""m: the known part's error falls by |tau| with each; 0.17^5 with the first left-out mode a factor
of 1.4 above the line, 0.5^5 a factor of 1.06."""


Known = Callable[[Sequence[int], Sequence[int]], ComplexArray]
"""The known part between some ports and others, shape (n_row, n_column, nf)."""


@dataclass(frozen=True, eq=False)
class Missing:
    """What a part lacks between its ports: known + a_i^T V a_j, || V || <= rho.

    Parameters
    ----------
    known : Known
    radius : array, shape (nf,)
        rho; infinite where there is no bound, and what is known is 0 there.
    vectors : array, shape (m, n_port) or (m, n_port, nf)
        The columns a_i; real where they are the same on every line.
    """

    known: Known
    radius: FloatArray
    vectors: NDArray[np.inexact]

    @classmethod
    def given(cls, known: ComplexArray, radius: FloatArray, vectors: ComplexArray) -> Missing:
        """Take what is known as it is, shape (n_port, n_port, nf)."""
        return cls(lambda rows, columns: np.asarray(known[np.ix_(rows, columns)]), radius, vectors)

    @property
    def finite_radius(self) -> FloatArray:
        """rho, 0 where it is infinite."""
        return np.where(np.isfinite(self.radius), self.radius, 0.0)

    def gram(self, ends: Ends) -> NDArray[np.inexact]:
        """Return (a B^T)^H a B^T, shape (n_end, n_end, nf), or 1 in place of nf."""
        at_joints = self._at_joints(ends)
        if at_joints.ndim == 2:
            return np.asarray((at_joints.T @ at_joints)[:, :, None])
        return np.asarray(np.einsum("mif,mjf->ijf", at_joints.conj(), at_joints))

    def squares(self, ends: Ends, own: Sequence[int | None], forces: ComplexArray) -> FloatArray:
        """Return ||a(p_j)||^2, shape (n, nf), p_j = e_j - B^T forces_j.

        Where vectors are the same on every line, a B^T = Q R leaves of each only what lies in the
        plane of Q to be found line by line.

        Parameters
        ----------
        ends : Ends
        own : sequence of int or None
            The port that is force j, None for another part's.
        forces : array, shape (n_end, n, nf)
            At the part's ends of joints.
        """
        at_joints = self._at_joints(ends)
        if at_joints.ndim == 3:
            moved = -np.einsum("mkf,kjf->mjf", at_joints, forces)
            for j, port in enumerate(own):
                if port is not None:
                    moved[:, j] += self.vectors[:, port]
            return np.asarray((np.abs(moved) ** 2).sum(axis=0))
        alone = np.array(
            [np.zeros(len(self.vectors)) if k is None else self.vectors[:, k] for k in own]
        ).T
        plane, upper = np.linalg.qr(at_joints)
        inside = plane.T @ alone
        total = np.zeros(forces.shape[1:])
        total += (np.abs(alone - plane @ inside) ** 2).sum(axis=0)[:, None]
        for row, start in zip(upper, inside, strict=True):
            moved = start[:, None] - sum(
                r * force for r, force in zip(row, forces, strict=True) if r
            )
            total += moved.real**2 + moved.imag**2
        return total

    def _at_joints(self, ends: Ends) -> NDArray[np.inexact]:
        """Return a B^T, one column an end."""
        ports, signs = ends
        chosen = self.vectors[:, list(ports)]
        weights = np.array(signs)
        return np.asarray(chosen * (weights if chosen.ndim == 2 else weights[:, None]))


Ends = tuple[Sequence[int], Sequence[float]]
"""Ports of a part's ends of joints, and the entries of B."""


@dataclass(frozen=True, eq=False)
class PartLines:
    """A part between its ports.

    Parameters
    ----------
    frf : Frf
        Receptances.
    sizes : array, shape (n_row, nf), and (n_column, nf)
        Round-off changes no receptance by more than sizes_i sizes_j.
    missing : Missing or None
        None where the receptance is complete. Rows and columns are the same ports otherwise.
    """

    frf: Frf
    sizes: tuple[FloatArray, FloatArray]
    missing: Missing | None

    @property
    def receptance(self) -> ComplexArray:
        """Values, shape (n_row, n_column, nf), m/N."""
        return self.frf.values.transpose(1, 2, 0)

    def between(self, rows: Sequence[int], columns: Sequence[int], better: bool) -> ComplexArray:
        """Return receptances between ports, with what is known of what they lack if `better`."""
        found = self.receptance[np.ix_(rows, columns)]
        if better and self.missing is not None and found.size:
            found += self.missing.known(rows, columns)
        return found


def given_part(frf: Frf, complete: bool = True) -> PartLines:
    """Take a part's FRFs as they are; |H_ij| <= sqrt(max_j |H_ij| max_i |H_ij|).

    If they are not complete, they lack what nothing bounds.
    """
    values = frf.values.transpose(1, 2, 0)
    modulus = np.abs(values)
    sizes = tuple(np.sqrt(EPS * modulus.max(axis=axis, initial=0.0)) for axis in (1, 0))
    unknown = Missing(
        lambda rows, columns: np.zeros((len(rows), len(columns), values.shape[2]), complex),
        np.full(values.shape[2], np.inf),
        np.zeros((0, len(values))),
    )
    return PartLines(frf, (sizes[0], sizes[1]), None if complete else unknown)


def rayleigh_part(
    system: SecondOrderSystem,
    modes: TruncatedModes,
    left_out: LeftOut,
    coefficients: tuple[float, float],
    axis: FloatArray,
    ports: Sequence[str],
) -> PartLines:
    """Sum the modes of a truncated part with C = alpha M + beta K.

    Parameters
    ----------
    system : SecondOrderSystem
    modes : TruncatedModes
    left_out : LeftOut
        Of the modes.
    coefficients : (alpha, beta)
    axis : array, shape (nf,), Hz
    ports : sequence of str

    Raises
    ------
    As `modal_frf`.
    """
    index, factor = system.locate(ports)
    heard = moving(left_out.shapes, index)
    left, squares = left_out.shapes[:, heard], left_out.squares[heard]
    kept = modes.kept
    friction = np.diag(modal_damping(kept, system.damping))
    target = Target.of(system, axis, ports, ports, Quantity.RECEPTANCE)
    # where the series of residuals diverges the bound says so, and of silent modes it is none
    frf = real_sum(kept, friction, modes.residuals, system, target)
    omega, (alpha, beta) = frf.omega, coefficients
    mu, v = 1 + 1j * (system.loss_factor + omega * beta), omega**2 - 1j * omega * alpha
    order = len(modes.residuals)
    power = np.ones_like(v)
    for _ in range(order):
        power *= v / mu
    longest = float(squares.max(initial=0.0)) * SURE
    weighted = left[index] * factor[:, None] * squares ** (order / 2)
    middle = enclosed(mu, v, longest)
    missing = Missing(
        partial(_series, _moments(weighted, squares, longest), middle.coefficients * power),
        np.where(np.isfinite(middle.radius), middle.radius * np.abs(power), np.inf),
        np.linalg.qr(weighted.T)[1],
    )
    of_kept = np.abs(kept.shapes[index] * factor[:, None]) * loads(system, kept.shapes)[:, None]
    of_left = (np.abs(left[index] * factor[:, None]) * loads(system, left)[:, None]).sum(axis=2)
    nearness = _nearness(kept.angular_frequency**2, friction, system.loss_factor, omega)
    of_stiffness, of_mass = of_kept @ nearness + of_left[:, :, None] * middle.largest
    total = np.sqrt(np.abs(mu)) * of_stiffness + np.sqrt(np.abs(v)) * of_mass
    total *= np.sqrt(len(system.dofs) * (4 * EPS + misfit(system, coefficients)))
    return PartLines(frf, (total, total), missing)


def _nearness(
    square: FloatArray, friction: FloatArray, loss_factor: float, omega: FloatArray
) -> FloatArray:
    """Return what 1 / |mu w_r^2 - v| is at most, 2^(1/2) / (|Re| + |Im|), shape (n, nf).

    On a pole 0: only of a mode that moves nothing asked for, whose share is 0.
    """
    found = square[:, None] - omega**2
    np.abs(found, out=found)
    found += loss_factor * square[:, None]
    if friction.any():
        found += friction[:, None] * omega
    return np.divide(np.sqrt(2), found, out=found, where=found > 0)


def _series(
    moments: FloatArray, coefficients: ComplexArray, rows: Sequence[int], columns: Sequence[int]
) -> ComplexArray:
    """Return sum_k moments_k coefficients_k between some ports."""
    chosen = moments[:, list(rows)][:, :, list(columns)]
    flat = chosen.reshape(len(chosen), chosen[0].size).T @ coefficients.view(float)
    return np.asarray(flat.view(complex)).reshape(*chosen.shape[1:], coefficients.shape[1])


@dataclass(frozen=True, eq=False)
class Enclosure:
    """|g - sum_k coefficients_k T_k(2 t/t_c - 1)| <= radius and |g| <= largest on 0 <= t <= t_c.

    Coefficients of shape (m + 1, nf), the others (nf,). Where g has a pole the radius is infinite,
    and the others are 0.
    """

    coefficients: ComplexArray
    radius: FloatArray
    largest: FloatArray


def enclosed(
    mu: NDArray[np.complexfloating], v: NDArray[np.complexfloating], longest: float
) -> Enclosure:
    """Enclose g(t) = 1 / (mu - v t), 0 <= t <= `longest`; see the module."""
    half, end, size = v * (longest / 2), mu - v * longest, np.abs(v) ** 2
    across = mu * v.conj()
    along = across.real  # |v|^2 times the t at which mu - v t is nearest to 0
    beside = (along > 0) & (along < longest * size)
    # exactly 0 where the segment runs through 0, as undamped from the first left-out mode on
    foot = 1j * across.imag * np.divide(v, size, out=np.zeros_like(across), where=size > 0)
    nearest = np.where(beside, np.abs(foot), np.minimum(np.abs(mu), np.abs(end)))
    lost = nearest == 0
    root = np.sqrt(mu * end)  # h s
    root *= np.where(((mu - half).conj() * root).real < 0, -1, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        tau = half / (mu - half + root)  # 1 / (zeta + s)
        decay = np.abs(tau)
        coefficients = np.empty((DEGREE + 1, v.size), complex)
        coefficients[0] = 2 / root
        for k in range(DEGREE):
            coefficients[k + 1] = coefficients[k] * tau
        radius = np.abs(coefficients[-1]) * decay / (1 - decay)
        coefficients[0] /= 2
        largest = 1 / nearest
        # a disc is half the width |v| t_c / (2 |z_0 z_1|) of the arc at least
        worse = ~((decay < 1) & (radius <= np.abs(half) / np.abs(root) ** 2))
    coefficients[:, worse], radius[worse] = _of_disc(
        (mu[worse], end[worse], foot[worse]), coefficients[:, worse], radius[worse], decay[worse]
    )
    coefficients[:, lost] = 0.0
    radius[lost] = np.inf
    return Enclosure(coefficients, radius, np.where(lost, 0.0, largest))


def _of_disc(
    segment: tuple[ComplexArray, ComplexArray, ComplexArray],
    coefficients: ComplexArray,
    radius: FloatArray,
    decay: FloatArray,
) -> tuple[ComplexArray, FloatArray]:
    """Take the disc where it is smaller; z_0, z_1 and their line's point nearest to 0."""
    start, end, foot = segment
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = (start * end.conj()).real <= 0  # more than a semicircle
        centre = np.where(whole, 1 / (2 * foot), (1 / start + 1 / end) / 2)
        disc = np.where(whole, np.abs(centre), np.abs(start - end) / (2 * np.abs(start * end)))
        better = ~((decay < 1) & (radius < disc))
    found = np.where(better, 0.0, coefficients)
    found[0, better] = centre[better]
    return found, np.where(better, disc, radius)


def _moments(weighted: FloatArray, squares: FloatArray, longest: float) -> FloatArray:
    """Return a^T T_k(2 t/t_c - 1) a, k = 0 ... m, of the columns `weighted`."""
    y = 2 * squares / longest - 1 if longest > 0 else np.zeros_like(squares)
    values = np.polynomial.chebyshev.chebvander(y, DEGREE)
    return np.asarray(np.einsum("ir,rk,jr->kij", weighted, values, weighted))


def no_guarantee(system: SecondOrderSystem) -> str | None:
    """Return why C, no alpha M + beta K, leaves nothing to guarantee; None if it does."""
    damping = system.damping
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
    return np.asarray((matrix @ flat).view(complex)).reshape(len(matrix), *shape)


def bilinear(left: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Return a_i^T b_j, shape (n, n, nf), of vectors (m, n, nf)."""
    return np.asarray(np.einsum("mif,mjf->ijf", left, right))


def moving(shapes: FloatArray, index: Sequence[int]) -> NDArray[np.bool_]:
    """Whether each mode (column) moves one of some DoFs by more than round-off of its shape."""
    limit = 16 * len(shapes) * EPS * np.abs(shapes).max(axis=0, initial=0.0)
    return np.asarray(np.abs(shapes[index]).max(axis=0, initial=0.0) > limit)


def loads(system: SecondOrderSystem, shapes: FloatArray) -> FloatArray:
    """Return || diag(K)^(1/2) phi || and || diag(M)^(1/2) phi ||, shape (2, n)."""
    weights = np.array([np.diag(system.stiffness), np.diag(system.mass)])
    return np.asarray(np.sqrt(weights @ shapes**2))


def misfit(system: SecondOrderSystem, coefficients: tuple[float, float]) -> float:
    """Return the largest |C - alpha M - beta K| / sqrt(C_ii C_jj)."""
    alpha, beta = coefficients
    root = np.sqrt(np.abs(np.diag(system.damping)))
    rest = np.abs(system.damping - alpha * system.mass - beta * system.stiffness)
    size = np.outer(root, root)
    return float(np.divide(rest, size, out=np.zeros_like(rest), where=size > 0).max())

"""FRFs summed over modes: structural damping, proportional or general viscous damping."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.door import door
from ._kernels.elimination import EPS, Enclosure
from ._kernels.weighted_sum import Gains, WeightedSum
from ._systems import Target
from .damped_modes import (
    ComplexModes,
    complex_modes,
    is_proportional,
    modal_damping,
    rayleigh_coefficients,
    require_own_pairs,
)
from .errors import FbsError, undamped_pole
from .frf import Frf, Origin, Quantity, computed_frf
from .modal_truncation import TruncatedModes
from .second_order_system import SecondOrderSystem, SystemOrigin
from .undamped_modes import RealModes, real_modes, require_own

__all__ = [
    "ComplexModes",
    "RealModes",
    "complex_modes",
    "modal_frf",
    "real_modes",
]


@door
def modal_frf(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
    modes: RealModes | ComplexModes | TruncatedModes | None = None,
) -> Frf:
    """Sum H_ij = sum_r phi_ir phi_jr / (w_r^2 (1 + j eta) - w^2 + j w g_r); the paper, Eq. (17).

    g_r = 2 zeta_r w_r = (Phi^T C Phi)_rr where that matrix is diagonal (`is_proportional`);
    otherwise H = sum_k (a_k + b_k / s) p_k^T / (s - s_k) over the complex modes. Structural
    damping K (1 + j eta) leaves the real modes as they are. `TruncatedModes` add their residuals.

    Parameters
    ----------
    system : SecondOrderSystem
        Symmetric, K positive semi-definite, M positive definite.
    frequency : array, shape (nf,), Hz
    responses, excitations : labels, optional
        Default: all of `system.labels`.
    quantity : Quantity
    modes : RealModes, ComplexModes or TruncatedModes, optional
        Those of the system if known already, or some of them only: the sum is then truncated.
        Residuals of truncated modes need C = alpha M + beta K.

    Returns
    -------
    Frf
        Frequency-contiguous.

    Raises
    ------
    SingularLineError
        A line on a pole of a mode that takes part in the FRFs asked for.
    DefectiveModesError, IndefiniteStiffnessError, IndefiniteMassError, UnknownDofError, FbsError
    """
    target = Target.of(system, frequency, responses, excitations, quantity)
    if isinstance(modes, ComplexModes):
        require_own_pairs(system, modes)
        return _complex_sum(modes, system, target)
    residuals: tuple[FloatArray, ...] = ()
    if isinstance(modes, TruncatedModes):
        residuals = modes.residuals
        if residuals:
            _require_convergence(target.axis, modes.series_limit)
    given = modes.kept if isinstance(modes, TruncatedModes) else modes
    if given is None:
        real = real_modes(system)
    else:
        require_own(system, given)
        real = given
    damping = modal_damping(real, system.damping)
    if residuals or is_proportional(damping):
        return real_sum(real, np.diag(damping), residuals, system, target)
    return _complex_sum(complex_modes(system, real), system, target)


def real_sum(
    real: RealModes,
    friction: FloatArray,
    residuals: tuple[FloatArray, ...],
    system: SecondOrderSystem,
    target: Target,
) -> Frf:
    """Sum modes of a system with Phi^T C Phi = diag(friction), and residuals of the others.

    Raises
    ------
    SingularLineError
    """
    terms = [_modal_terms(real, friction, system.loss_factor, target)]
    if residuals:
        terms.append(_residual_terms(residuals, system, target))
    origin: Origin = SystemOrigin.of(system)
    if residuals or real.angular_frequency.size < len(system.dofs):
        origin = _Truncation(SystemOrigin.of(system), real, friction, residuals)
    return _sum(terms, target, all(_is_symmetric(r) for r in residuals), origin)


def _require_convergence(axis: FloatArray, limit: float) -> None:
    beyond = axis >= limit
    if beyond.any():
        raise FbsError(
            f"the residuals' series diverges from the first left-out mode on, {limit:.10g} Hz, and "
            f"{beyond.sum()} of the lines lie there, from {axis[beyond][0]:.10g} Hz on: keep more "
            "modes, or leave these lines out"
        )


@dataclass(frozen=True, eq=False)
class _Truncation:
    """The origin of a sum over some of the modes: its round-off, the modes being taken as given.

    A term is known to gamma (1 + (w_r^2 + w^2) / |w_r^2 mu - w^2 + ...|), gamma = (n + 8) eps.
    """

    of: SystemOrigin
    modes: RealModes
    friction: FloatArray
    residuals: tuple[FloatArray, ...]

    def renamed(self, names: Mapping[str, str]) -> _Truncation:
        return _Truncation(self.of.renamed(names), self.modes, self.friction, self.residuals)

    def enclose(self, frf: Frf) -> Enclosure:
        left, right = (np.abs(self.of.ports(some)) for some in (frf.responses, frf.excitations))
        shapes, wr = np.abs(self.modes.shapes), self.modes.angular_frequency[:, None]
        w, gamma = frf.omega, (len(shapes) + len(self.residuals) + 8) * EPS
        loss = self.of.system.loss_factor * wr**2 + self.friction[:, None] * w
        distance = np.abs((wr - w) * (wr + w) + 1j * loss)
        gain = (1 + (wr**2 + w**2) / distance) / distance
        bound = np.einsum("ir,jr,rk->kij", left @ shapes, right @ shapes, gain, optimize=True)
        for k, residual in enumerate(self.residuals):  # |v|^k, and |mu| >= 1
            alpha, _ = rayleigh_coefficients(self.of.system) or (0.0, 0.0)
            bound += np.abs(w**2 - 1j * w * alpha)[:, None, None] ** k * (
                left @ np.abs(residual) @ right.T
            )
        bound *= gamma * w[:, None, None] ** float(frf.quantity.derivative)
        return Enclosure(frf.values, bound)


@dataclass(frozen=True, eq=False)
class _Terms:
    """Part of an FRF, with real weights; see `WeightedSum` for `row` and `gains`."""

    count: int
    row: Callable[[int], FloatArray]
    gains: Gains


def _modal_terms(
    modes: RealModes, damping: FloatArray, loss_factor: float, target: Target
) -> _Terms:
    left, right = target.responding(modes.shapes), target.exciting(modes.shapes)
    part = (_takes_part(left, modes.shapes) & _takes_part(right, modes.shapes))[:, None]
    wr, g = modes.angular_frequency[:, None], damping[:, None]
    tolerance = _pole_tolerance(len(wr))

    def gains(w: FloatArray, out: ComplexArray) -> NDArray[np.bool_]:
        return _resonances(w, wr, g, loss_factor, tolerance, part, out)

    return _Terms(len(wr), lambda i: np.asarray(left[i] * right, dtype=float), gains)


def _resonances(
    w: FloatArray,
    wr: FloatArray,
    g: FloatArray,
    loss_factor: float,
    tolerance: float,
    part: NDArray[np.bool_],
    out: ComplexArray,
) -> NDArray[np.bool_]:
    """Write 1 / (a + jb) = (a - jb) / (a^2 + b^2), a = w_r^2 - w^2 and b = g w + eta w_r^2.

    On a pole, within `tolerance`, it is 0; the line counts if the mode has a `part` in the FRFs.
    """
    a, minus_b = (wr - w) * (wr + w), -g * w
    if loss_factor:
        minus_b -= loss_factor * wr**2
    square = a * a
    square += minus_b * minus_b
    lines = np.zeros((len(w), w.shape[2]), dtype=bool)
    if (square.min(axis=2) <= (tolerance * (wr**2 + w[:, :, -1:] ** 2))[:, :, 0] ** 2).any():
        singular = square <= (tolerance * (wr**2 + w**2)) ** 2
        square[singular] = np.inf
        lines = np.asarray((singular & part).any(axis=1))
    np.reciprocal(square, out=square)
    np.multiply(a, square, out=out.real)
    np.multiply(minus_b, square, out=out.imag)
    return lines


def _residual_terms(
    residuals: tuple[FloatArray, ...], system: SecondOrderSystem, target: Target
) -> _Terms:
    """R_k v^k / mu^(k+1), mu = 1 + j (eta + w beta), v = w^2 - j w alpha."""
    coefficients = rayleigh_coefficients(system)
    if coefficients is None:
        raise FbsError(
            "residuals of left-out modes need viscous damping C = alpha M + beta K, or none; this "
            "system's is neither (leave the residuals out, or use direct_frf)"
        )
    alpha, beta = coefficients
    count = len(residuals)

    def gains(w: FloatArray, out: ComplexArray) -> NDArray[np.bool_]:
        mu, v = 1 + 1j * (system.loss_factor + w * beta), w**2 - 1j * w * alpha
        for k in range(count):
            out[:, k : k + 1] = v**k / mu ** (k + 1)
        return np.zeros((len(w), w.shape[2]), dtype=bool)

    def row(i: int) -> FloatArray:
        entries = [residual[target.rows[i], target.columns] for residual in residuals]
        factor: FloatArray = target.row_factor[i] * target.column_factor
        return np.stack(entries, axis=-1) * factor[:, None]

    return _Terms(count, row, gains)


def _complex_sum(modes: ComplexModes, system: SecondOrderSystem, target: Target) -> Frf:
    right = target.exciting(modes.participation)
    elastic = target.responding(modes.elastic_shapes)
    rigid = target.responding(modes.rigid_shapes)
    excited = _takes_part(right, modes.participation)
    floating = excited & _takes_part(rigid, modes.rigid_shapes)
    part = excited & _takes_part(elastic, modes.elastic_shapes) | floating
    used = elastic.any(axis=0) | rigid.any(axis=0)
    tolerance = _pole_tolerance(int(used.sum()))
    terms = []
    for chosen, kind in zip(_pairs(modes.poles), (_pair_terms, _pole_terms), strict=True):
        k = np.flatnonzero(chosen & used)
        some = _Poles(
            modes.poles[k], elastic[:, k], rigid[:, k], right[:, k], part[k], floating[k].any()
        )
        terms.append(kind(some, tolerance))
    return _sum(terms, target, _is_symmetric(system.damping), SystemOrigin.of(system))


@dataclass(frozen=True, eq=False)
class _Poles:
    """Some of the complex modes, between the DoFs asked for.

    `part` : which of them take part; `floating` : whether one does with rigid-body motion, so that
    the FRF is infinite at 0 Hz.
    """

    values: ComplexArray
    elastic: NDArray[np.inexact]
    rigid: NDArray[np.inexact]
    right: NDArray[np.inexact]
    part: NDArray[np.bool_]
    floating: np.bool_

    def inverse(self, w: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return 1 / w, and where the line is singular for it; 0 where w is."""
        still = w == 0
        return 1 / np.where(still, np.inf, w), still[:, 0] & self.floating


def _pairs(poles: ComplexArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which poles stand for themselves and their conjugate, and which for themselves alone.

    The poles of a real system come in pairs s_k, s_k*, and so do their residues.
    """
    upper, lower = poles[poles.imag > 0], poles[poles.imag < 0]
    if np.array_equal(np.sort_complex(upper), np.sort_complex(lower.conj())):
        return poles.imag > 0, poles.imag == 0
    return np.zeros(poles.size, dtype=bool), np.ones(poles.size, dtype=bool)


def _pair_terms(poles: _Poles, tolerance: float) -> _Terms:
    """R / (s - s_k) + R* / (s - s_k*) = (A + s B) q, 1 / q = |s_k|^2 - w^2 - 2 j w Re s_k.

    B = 2 Re R and A = -2 (Re s_k Re R + Im s_k Im R). R = a p^T + b p^T / s has two such parts:
    the weights of q, s q and q / s are A_a + B_b, B_a and A_b.
    """
    s_k, n = poles.values, poles.values.size
    wr, g, part = np.abs(s_k)[:, None], -2 * s_k.real[:, None], poles.part[:, None]
    rigid = bool(poles.rigid.any())

    def row(i: int) -> FloatArray:
        a, b = poles.elastic[i] * poles.right, poles.rigid[i] * poles.right
        static, slow = (-2 * (s_k.real * r.real + s_k.imag * r.imag) for r in (a, b))
        return np.hstack([static + 2 * b.real, 2 * a.real, *([slow] if rigid else [])])

    def gains(w: FloatArray, out: ComplexArray) -> NDArray[np.bool_]:
        q, derivative = out[:, :n], out[:, n : 2 * n]
        # |s - s_k| |s - s_k*| is about 2 w |s - s_k| at a pole: twice w_r^2 + w^2 is the size
        lines = _resonances(w, wr, g, 0.0, 2 * tolerance, part, q)
        np.multiply(q.imag, -w, out=derivative.real)
        np.multiply(q.real, w, out=derivative.imag)
        if rigid:
            inverse, still = poles.inverse(w)
            np.multiply(q.imag, inverse, out=out[:, 2 * n :].real)
            np.multiply(q.real, -inverse, out=out[:, 2 * n :].imag)
            lines |= still
        return lines

    return _Terms((3 if rigid else 2) * n, row, gains)


def _pole_terms(poles: _Poles, tolerance: float) -> _Terms:
    """R / (s - s_k) = Re R g + Im R j g; with R = a p^T + b p^T / s also for g / s."""
    n, modulus, part = poles.values.size, np.abs(poles.values)[:, None], poles.part[:, None]

    def row(i: int) -> FloatArray:
        a, b = poles.elastic[i] * poles.right, poles.rigid[i] * poles.right
        return np.hstack([a.real, a.imag, b.real, b.imag])

    def gains(w: FloatArray, out: ComplexArray) -> NDArray[np.bool_]:
        distance = 1j * w - poles.values[:, None]
        singular = np.abs(distance) <= tolerance * (w + modulus)
        distance[singular] = np.inf
        inverse, still = poles.inverse(w)
        out[:, :n] = 1 / distance
        out[:, n : 2 * n] = 1j * out[:, :n]
        out[:, 2 * n :] = out[:, : 2 * n] * (-1j * inverse)
        return np.asarray((singular & part).any(axis=1) | still)

    return _Terms(4 * n, row, gains)


def _sum(terms: Sequence[_Terms], target: Target, symmetric: bool, origin: Origin) -> Frf:
    order = target.quantity.derivative
    used = [term for term in terms if term.count]
    ends = np.cumsum([0, *(term.count for term in used)])

    def row(i: int) -> FloatArray:
        return np.hstack([np.zeros((len(target.columns), 0)), *(term.row(i) for term in used)])

    def gains(w: FloatArray, out: ComplexArray) -> NDArray[np.bool_]:
        singular = np.zeros((len(w), w.shape[2]), dtype=bool)
        for term, first, last in zip(used, ends, ends[1:], strict=False):
            singular |= term.gains(w, out[:, first:last])
        if order:
            out *= (1j * w) ** order
        return singular

    shape = (len(target.rows), len(target.columns), int(ends[-1]))
    weighted = WeightedSum(shape, row, gains, symmetric and target.symmetric)
    summed = weighted(2 * np.pi * target.axis)
    if summed.singular.any():
        raise undamped_pole(target.axis[summed.singular])
    return computed_frf(
        target.axis,
        summed.values.transpose(2, 0, 1),
        target.responses,
        target.excitations,
        target.quantity,
        summed.finite,
        origin,
    )


def _takes_part(asked: NDArray[np.inexact], shapes: NDArray[np.inexact]) -> NDArray[np.bool_]:
    """Whether each mode (column) moves a DoF asked for by more than round-off of its shape."""
    limit = 16 * len(shapes) * EPS * np.abs(shapes).max(axis=0)
    return np.asarray(np.abs(asked).max(axis=0, initial=0.0) > limit)


def _pole_tolerance(n: int) -> float:
    """A pole is known to a few n eps only: closer than that to it, no digit of the FRF is left."""
    return 16 * n * EPS


def _is_symmetric(matrix: FloatArray) -> bool:
    return np.array_equal(matrix, matrix.T)

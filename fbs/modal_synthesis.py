"""FRFs summed over modes: structural damping, proportional or general viscous damping."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._checks import ComplexArray, FloatArray, ascending_frequency, read_only
from .damped_modes import (
    ComplexModes,
    complex_modes,
    is_proportional,
    modal_damping,
    rayleigh_coefficients,
)
from .errors import AxisMismatchError, FbsError, SingularLineError
from .frf import Frf, Quantity, as_quantity
from .modal_truncation import TruncatedModes
from .second_order_system import SecondOrderSystem
from .undamped_modes import EPS, RealModes, real_modes

__all__ = [
    "ComplexModes",
    "Poles",
    "RealModes",
    "complex_modes",
    "modal_frf",
    "poles",
    "real_modes",
]


@dataclass(frozen=True, eq=False)
class _Target:
    """What was asked for: lines, labels, and the coordinates and factors behind the labels."""

    axis: FloatArray
    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    rows: list[int]
    columns: list[int]
    row_factor: FloatArray
    column_factor: FloatArray
    quantity: Quantity

    @property
    def omega(self) -> FloatArray:
        return 2 * np.pi * self.axis

    @property
    def derivative(self) -> ComplexArray:
        return np.asarray((1j * self.omega) ** self.quantity.derivative, dtype=complex)

    def responding(self, shapes: NDArray[np.inexact]) -> NDArray[np.inexact]:
        return shapes[self.rows] * self.row_factor[:, None]

    def exciting(self, shapes: NDArray[np.inexact]) -> NDArray[np.inexact]:
        return shapes[self.columns] * self.column_factor[:, None]


def modal_frf(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None = None,
    excitations: Iterable[str] | None = None,
    quantity: Quantity | str = Quantity.RECEPTANCE,
    modes: RealModes | ComplexModes | TruncatedModes | None = None,
) -> Frf:
    """Sum H_ij = sum_r phi_ir phi_jr / (w_r^2 (1 + j eta) - w^2 + j w g_r); seed paper, Eq. (17).

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
    target = _target(system, frequency, responses, excitations, quantity)
    if modes is not None and modes.dofs != system.dofs:
        raise AxisMismatchError("the modes belong to another system: their dofs differ")
    if isinstance(modes, ComplexModes):
        return _complex_sum(modes, target)
    residuals = modes.residuals if isinstance(modes, TruncatedModes) else ()
    given = modes.kept if isinstance(modes, TruncatedModes) else modes
    real = real_modes(system) if given is None else given
    damping = modal_damping(real, system.damping)
    if residuals or is_proportional(damping):
        terms = [_modal_terms(real, np.diag(damping), system.loss_factor, target)]
        if residuals:
            terms.append(_residual_terms(residuals, system, target))
        return _real_sum(terms, target)
    return _complex_sum(complex_modes(system, real), target)


def _target(
    system: SecondOrderSystem,
    frequency: ArrayLike,
    responses: Iterable[str] | None,
    excitations: Iterable[str] | None,
    quantity: Quantity | str,
) -> _Target:
    rows = system.labels if responses is None else tuple(responses)
    columns = system.labels if excitations is None else tuple(excitations)
    i, row_factor = system.locate(rows)
    j, column_factor = system.locate(columns)
    axis = ascending_frequency(frequency)
    return _Target(axis, rows, columns, i, j, row_factor, column_factor, as_quantity(quantity))


@dataclass(frozen=True, eq=False)
class _Terms:
    """Part of an FRF, sum_t weights[i, j, t] gains[t, line], with real weights."""

    weights: FloatArray
    gains: ComplexArray


def _modal_terms(
    modes: RealModes, damping: FloatArray, loss_factor: float, target: _Target
) -> _Terms:
    left, right = target.responding(modes.shapes), target.exciting(modes.shapes)
    w, wr = target.omega, modes.angular_frequency[:, None]
    part = _takes_part(left, modes.shapes) & _takes_part(right, modes.shapes)
    denominator = (wr - w) * (wr + w) + 1j * (damping[:, None] * w + loss_factor * wr**2)
    gains = _inverse(denominator, wr**2 + w**2, part, target)
    return _Terms(np.asarray(left[:, None] * right, dtype=float), gains)


def _residual_terms(
    residuals: tuple[FloatArray, ...], system: SecondOrderSystem, target: _Target
) -> _Terms:
    """R_k v^k / mu^(k+1), mu = 1 + j (eta + w beta), v = w^2 - j w alpha."""
    coefficients = rayleigh_coefficients(system)
    if coefficients is None:
        raise FbsError(
            "residuals of left-out modes need viscous damping C = alpha M + beta K, or none; this "
            "system's is neither (leave the residuals out, or use direct_frf)"
        )
    alpha, beta = coefficients
    w = target.omega
    mu, v = 1 + 1j * (system.loss_factor + w * beta), w**2 - 1j * w * alpha
    gains = np.array([target.derivative * v**k / mu ** (k + 1) for k in range(len(residuals))])
    factor = np.outer(target.row_factor, target.column_factor)
    pairs = np.ix_(target.rows, target.columns)
    return _Terms(np.stack([r[pairs] * factor for r in residuals], axis=-1), gains)


def _real_sum(terms: list[_Terms], target: _Target) -> Frf:
    weights = np.concatenate([term.weights for term in terms], axis=2)
    gain = np.concatenate([term.gains for term in terms])
    n_pairs = len(target.rows) * len(target.columns)
    w = target.omega
    values = np.empty((n_pairs, w.size), dtype=complex)
    # real weights: the complex sum is one real product over interleaved real and imaginary parts
    np.matmul(weights.reshape(n_pairs, -1), gain.view(float), out=values.view(float))
    return _frf(values, target)


def _complex_sum(modes: ComplexModes, target: _Target) -> Frf:
    s, poles = 1j * target.omega, modes.poles[:, None]
    distance, size = s - poles, np.abs(s) + np.abs(poles)
    right = target.exciting(modes.participation)
    excited = _takes_part(right, modes.participation)
    weights, gains = [], []
    for shapes, divisor in ((modes.elastic_shapes, 1.0), (modes.rigid_shapes, s)):
        left = target.responding(shapes)
        used = left.any(axis=0)
        part = (excited & _takes_part(left, shapes))[used]
        denominator = (distance * divisor)[used]
        gains.append(_inverse(denominator, (size * np.abs(divisor))[used], part, target))
        weights.append((left[:, None] * right)[:, :, used])
    n_pairs = len(left) * len(right)
    values = np.concatenate(weights, axis=2).reshape(n_pairs, -1) @ np.concatenate(gains)
    return _frf(values, target)


def _takes_part(asked: NDArray[np.inexact], shapes: NDArray[np.inexact]) -> NDArray[np.bool_]:
    """Whether each mode (column) moves a DoF asked for by more than round-off of its shape."""
    limit = 16 * len(shapes) * EPS * np.abs(shapes).max(axis=0)
    return np.asarray(np.abs(asked).max(axis=0, initial=0.0) > limit)


def _inverse(
    denominator: ComplexArray, size: FloatArray, part: NDArray[np.bool_], target: _Target
) -> ComplexArray:
    """Return (jw)^n / denominator, shape (mode, line); 0 at the pole of a mode without part.

    A pole is known to a few n eps only: closer than that to it, no digit of the FRF is left.
    """
    singular = np.abs(denominator) <= 16 * len(denominator) * EPS * size
    lines = (singular & part[:, None]).any(axis=0)
    if lines.any():
        raise SingularLineError(
            target.axis[lines],
            "an undamped mode, or rigid-body motion at 0 Hz, makes the FRF infinite",
            "leave these lines out, shift the axis or add damping",
        )
    gain = np.zeros_like(denominator)
    return np.divide(target.derivative, denominator, out=gain, where=~singular)


def _frf(values: ComplexArray, target: _Target) -> Frf:
    shape = (len(target.rows), len(target.columns), target.axis.size)
    return Frf(
        target.axis,
        values.reshape(shape).transpose(2, 0, 1),
        target.responses,
        target.excitations,
        target.quantity,
    )


@dataclass(frozen=True, eq=False)
class Poles:
    """Poles s of a system: one of every conjugate pair (Im s > 0), and every real one.

    A rigid-body mode that nothing damps has a double pole at 0, which counts as one pair.

    Parameters
    ----------
    values : complex array, shape (n,), rad/s
        By ascending modulus.
    """

    values: ComplexArray

    @property
    def natural_frequencies(self) -> FloatArray:
        """|s| / (2 pi), Hz."""
        frequency: FloatArray = np.abs(self.values) / (2 * np.pi)
        return frequency

    @property
    def damping_ratios(self) -> FloatArray:
        """-Re s / |s|; 0 for a pole at 0."""
        modulus = np.abs(self.values)
        return np.divide(-self.values.real, modulus, out=np.zeros_like(modulus), where=modulus > 0)


def poles(system: SecondOrderSystem) -> Poles:
    """Return the roots s of det(s^2 M + s C + K (1 + j eta)) = 0.

    Undamped and proportional systems: s = -g/2 +- sqrt(g^2/4 - w_r^2 (1 + j eta)) mode by mode,
    without cancellation; others from `complex_modes`. With a loss factor alone
    s = j w_r sqrt(1 + j eta): |s| = w_r (1 + eta^2)^(1/4), and the damping ratio is
    sin(atan(eta) / 2), about eta / 2. Its counterpart -s would grow; it stands for negative
    frequencies, which the loss factor does not describe, and is no pole of the structure.

    Raises
    ------
    FbsError
        A loss factor together with viscous damping that is not proportional: the roots do not
        come in pairs, and which of them stand for positive frequencies is not defined.
    DefectiveModesError, IndefiniteStiffnessError, IndefiniteMassError
    """
    real = real_modes(system)
    damping = modal_damping(real, system.damping)
    if is_proportional(damping):
        roots = _proportional_poles(real.angular_frequency, np.diag(damping), system.loss_factor)
    elif system.loss_factor:
        raise FbsError(
            "a loss factor together with viscous damping that is not proportional has no poles of "
            "positive frequency alone; all roots are in complex_modes(system).poles"
        )
    else:
        every = complex_modes(system, real)
        # each rigid-body coordinate that is damped has the pole 0 besides the one in `every`
        hidden = real.n_rigid - int((every.poles == 0).sum())
        roots = np.concatenate([np.zeros(hidden), every.poles])
        roots = roots[roots.imag >= 0]
    return Poles(read_only(roots[np.argsort(np.abs(roots), kind="stable")]))


def _proportional_poles(omega: FloatArray, damping: FloatArray, loss_factor: float) -> ComplexArray:
    half, loss = damping / 2, 1j * loss_factor * omega**2
    under = np.abs(half) < omega
    square = (omega - half) * (omega + half) + loss  # of the damped frequency
    pairs = -half[under] + 1j * np.sqrt(square[under])
    still = omega + np.abs(half) == 0
    over = ~under & ~still
    far = -half[over] - np.copysign(1.0, half[over]) * np.sqrt(-square[over])
    near = (omega[over] ** 2 + loss[over]) / far
    return np.concatenate([np.zeros(still.sum()), pairs, far, near]).astype(complex)

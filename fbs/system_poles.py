"""Poles of a system: natural frequencies and damping ratios without an FRF."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._kernels.checks import ComplexArray, FloatArray, read_only
from ._kernels.door import door
from .damped_modes import complex_modes, is_proportional, modal_damping
from .errors import FbsError
from .second_order_system import SecondOrderSystem
from .undamped_modes import real_modes


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


@door
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

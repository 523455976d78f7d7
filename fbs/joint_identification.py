"""A joint's dynamic stiffness from FRFs: of the assembly alone, or of assembly and parts.

Two forms. With the interface FRFs of the assembly on both sides of the joint, a and b, the joint
stands alone in the off-diagonal of the impedance (in-situ, "inverse substructuring": Meggitt,
Moorhouse & Elliott 2015, Appl. Acoust. 92, 88),

    Z_J = −[(Y_AB)⁻¹]_ab

With the parts' own FRFs too, the direct form: Y_AB between the two sides is the parts' relative
receptance R = Y_A + Y_B with the joint's impedance beside it,

    Z_J = R_AB⁻¹ − R⁻¹,    R_AB = Y_aa − Y_ab − Y_ba + Y_bb of the assembly

A spring and a dashpot are fitted to Z_J = k + jωc (diagonal entries) by weighted least squares, the
weights the spread of each line that noise of the data has by the first-order changes of the two
forms, δ(Y⁻¹) = −Y⁻¹ δY Y⁻¹. Lines are taken as independent, unless their misfits e_k are alike from
line to line, ρ = Re Σ e_k* e_k+1 / Σ |e_k|² beyond the 2/√n of noise: n lines are then worth
n (1 − ρ)/(1 + ρ) (Bartlett 1946, J. R. Stat. Soc. Suppl. 8, 27), so that a joint that is no spring
is not told as a sharp one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ._kernels import batched
from ._kernels.checks import ComplexArray, FloatArray
from ._kernels.door import door
from .axes import require_same_frequency
from .errors import FbsError, SingularLineError
from .frf import Frf, Quantity

EPS = float(np.finfo(float).eps)
CONFIDENCE = 0.95
FOUND = 0.5
"""Half-width of the interval over the value: above, the data do not tell the value."""

FEWEST = 8
"""Lines whose correlation says anything: 2/√n is 0.7 there."""

Pairs = Sequence[tuple[str, str]]


@dataclass(frozen=True, eq=False)
class JointStiffness:
    """Z_J over frequency.

    Attributes
    ----------
    frequency
        (nf,) Hz.
    at
        The pairs of labels, one for each row and column.
    values
        (nf, n, n) N/m.
    spread
        (nf, n, n) standard deviation of the complex values, to first order.
    """

    frequency: FloatArray
    at: tuple[tuple[str, str], ...]
    values: ComplexArray
    spread: FloatArray


@dataclass(frozen=True)
class Spring:
    """k + jωc fitted to one pair's Z_J.

    Attributes
    ----------
    stiffness, damping
        N/m, N s/m.
    stiffness_interval, damping_interval
        Half-widths of the 95 % intervals; where the residual is above 1, as many times wider, and
        wider where misfits are alike from line to line.
    residual
        Root mean square of the misfit over its spread: about 1 where a spring and a dashpot are
        all there is.
    """

    stiffness: float
    damping: float
    stiffness_interval: float
    damping_interval: float
    residual: float

    @property
    def tells_stiffness(self) -> bool:
        """Whether the data tell the stiffness: its interval is less than half of it."""
        return self.stiffness_interval < FOUND * abs(self.stiffness)

    @property
    def tells_damping(self) -> bool:
        """Whether the data tell the damping."""
        return self.damping_interval < FOUND * abs(self.damping)

    def describe(self) -> str:
        """What the data tell, in a sentence; first whether they tell anything."""
        told = []
        for name, value, half, tells, unit in (
            ("stiffness", self.stiffness, self.stiffness_interval, self.tells_stiffness, "N/m"),
            ("damping", self.damping, self.damping_interval, self.tells_damping, "N s/m"),
        ):
            if tells:
                told.append(f"{name} {_digits(value, half)} ± {half:.2g} {unit}")
            else:
                told.append(
                    f"the data do not tell the {name} (anything between {value - half:.2g} and "
                    f"{value + half:.2g} {unit})"
                )
        return "; ".join(told)


def _digits(value: float, half: float) -> str:
    """As many digits as the interval leaves, two to twelve; whole numbers in full below 1e7."""
    known = np.log10(abs(value) / half) + 1.0 if half > 0.0 else np.inf
    whole = np.log10(abs(value)) if abs(value) < 1e7 else 0.0
    return f"{value:.{int(np.clip(np.ceil(max(known, whole)), 2, 12))}g}"


@door
def joint_in_situ(assembly: Frf, at: Pairs, relative: float = EPS) -> JointStiffness:
    """Z_J = −[(Y_AB)⁻¹]_ab of the assembly's FRFs at both sides of the joint.

    Parameters
    ----------
    assembly
        Receptances (or what can be made them) at all labels of `at`, as responses and excitations.
    at
        Pairs (label on one side, label on the other).
    relative
        Standard deviation of each FRF value over its modulus, independent of the others.

    Raises
    ------
    FbsError, UnknownDofError
        A label or the noise does not fit.
    SingularLineError
        The interface FRFs have no inverse with a digit on a line.
    """
    _require_noise(relative)
    first, second = _sides(at)
    both = (*first, *second)
    y = assembly.to(Quantity.RECEPTANCE).select(both, both)
    inverse = _inverse(y.values, y.frequency)
    variance = _squared(inverse) @ (relative**2 * _squared(y.values)) @ _squared(inverse)
    n = len(first)
    return JointStiffness(y.frequency, tuple(at), -inverse[:, :n, n:], np.sqrt(variance[:, :n, n:]))


@door
def joint_between(
    assembly: Frf, first: Frf, second: Frf, at: Pairs, relative: float = EPS
) -> JointStiffness:
    """Z_J = R_AB⁻¹ − R⁻¹ from the assembly's FRFs and both parts' own.

    Parameters
    ----------
    assembly
        At all labels of `at`.
    first, second
        The parts, at the first and the second labels of `at`.
    at, relative
        As in `joint_in_situ`.

    Raises
    ------
    FbsError, UnknownDofError, SingularLineError
        As in `joint_in_situ`.
    """
    _require_noise(relative)
    one, two = _sides(at)
    sets = [frf.to(Quantity.RECEPTANCE) for frf in (assembly, first, second)]
    for frf, whose in zip(sets[1:], ("first", "second"), strict=True):
        require_same_frequency(
            sets[0].frequency,
            frf.frequency,
            f"the axes of the assembly and the {whose} part differ",
        )
    both = (*one, *two)
    y = sets[0].select(both, both).values
    a, b = sets[1].select(one, one).values, sets[2].select(two, two).values
    n, lines = len(one), sets[0].frequency
    difference = np.vstack([np.eye(n), -np.eye(n)])
    joined = _inverse(difference.T @ y @ difference, lines)
    apart = _inverse(a + b, lines)
    noise = relative**2
    variance = _squared(joined) @ (
        noise * difference.T**2 @ _squared(y) @ difference**2
    ) @ _squared(joined) + _squared(apart) @ (noise * (_squared(a) + _squared(b))) @ _squared(apart)
    return JointStiffness(lines, tuple(at), joined - apart, np.sqrt(variance))


@door
def fit_spring(joint: JointStiffness, pair: int = 0) -> Spring:
    """Fit k + jωc to the diagonal entry of a pair; the lines weighted by their spread.

    Raises
    ------
    FbsError
        There is no such pair.
    """
    if not 0 <= pair < len(joint.at):
        raise FbsError(f"pair = {pair}: there are {len(joint.at)}, from 0")
    z, omega = joint.values[:, pair, pair], 2.0 * np.pi * joint.frequency
    sigma = joint.spread[:, pair, pair] / np.sqrt(2.0)  # of the real and of the imaginary part
    weight = 1.0 / sigma**2
    stiffness = float(np.sum(weight * z.real) / np.sum(weight))
    pull = np.sum(weight * omega**2)
    damping = float(np.sum(weight * omega * z.imag) / pull)
    misfit = (z - stiffness - 1j * omega * damping) / (sigma * np.sqrt(2.0))
    residual = float(np.sqrt(np.mean(np.abs(misfit) ** 2)))
    # lines scatter by more than was said: their scatter is the better estimate
    half = float(norm.ppf(0.5 + CONFIDENCE / 2.0)) * max(1.0, residual * _alike(misfit))
    return Spring(
        stiffness=stiffness,
        damping=damping,
        stiffness_interval=half / float(np.sqrt(np.sum(weight))),
        damping_interval=half / float(np.sqrt(pull)),
        residual=residual,
    )


def _alike(misfit: ComplexArray) -> float:
    """√((1 + ρ)/(1 − ρ)) of misfits of correlation ρ from line to line; 1 where ρ may be chance."""
    size, n = float(np.sum(np.abs(misfit) ** 2)), misfit.size
    if n < FEWEST or size == 0.0:
        return 1.0
    rho = float(np.sum(misfit[:-1].conj() * misfit[1:]).real) / size
    return float(np.sqrt((1.0 + rho) / (1.0 - rho))) if rho > 2.0 / np.sqrt(n) else 1.0


def _sides(at: Pairs) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if not at:
        raise FbsError("a joint needs at least one pair of labels")
    first, second = (tuple(side) for side in zip(*at, strict=True))
    return first, second


def _require_noise(relative: float) -> None:
    if not 0.0 < relative < 1.0:
        raise FbsError(f"relative = {relative}: the noise must be between 0 and 1 of each value")


def _squared(values: ComplexArray) -> FloatArray:
    return np.asarray(values.real**2 + values.imag**2)


def _inverse(matrices: ComplexArray, lines: FloatArray) -> ComplexArray:
    inverse, singular = batched.inverse(matrices)
    norms = (np.linalg.norm(m, axis=(1, 2)) for m in (matrices, inverse))
    singular |= ~(np.prod(list(norms), axis=0) <= 1.0 / (10.0 * EPS))
    if singular.any():
        raise SingularLineError(
            lines[singular],
            "the FRFs at the joint have no inverse with a digit left",
            "the pairs name a motion twice, or the joint is rigid: leave pairs out",
        )
    return inverse

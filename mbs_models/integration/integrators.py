"""Which integrator, with which step: from the highest pole and the band of interest.

An integrator multiplies a mode of pole s by R(hs) in a step of h, where e^{hs} would be exact:

    RK44                R(z) = 1 + z + z²/2 + z³/6 + z⁴/24
    trapezoidal rule    R(z) = (1 + z/2)/(1 − z/2)

(Hairer & Wanner 1996, Solving Ordinary Differential Equations II, IV.2–3). RK44 is stable while no
mode is amplified, |R(hs)| ≤ 1: to ωh = 2√2 without damping, and to h|s| = 2.785 where damping is so
strong that s is real. The trapezoidal rule always is. What is left is how far they bend a frequency
ω: by (ωh)⁴/120 and (ωh)²/12. RK44 also damps a mode, by a ratio of (ωh)⁵/144.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError

if TYPE_CHECKING:
    from ..system.linearization import LinearizedSystem

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RK44 = "RK44"
TRAPEZOIDAL = "trapezoidal"

# Relative change of the frequency at the band's end. A mode of 1 % damping is then 0.04 dB wrong at
# its flanks.
FREQUENCY_BEND = 1e-4
# The same, of the trapezoidal rule where it is taken out afterwards: ω′ = (2/h) tan(ωh/2) is exact.
KNOWN_BEND = 1e-2
# A step of RK44 takes as long as so many of the trapezoidal rule (measured: 2.2 to 2.9); where
# meshes vary, which takes a second iteration (0.8), or may part, and a Jacobian for each (0.3).
STEP_COST, VARYING_STEP_COST, PARTING_STEP_COST = 2.5, 0.8, 0.3
# Part of RK44's stability limit that is used: a spring may stiffen by half before it is passed.
STABILITY_MARGIN = 0.8
# A step fits into a sampling interval if it misses a whole number of times by rounding alone.
ROUND_OFF = 1e-9
# exudyn ends a run as soon as it is within 1e-10 s of its end.
SHORTEST_STEP = 1e-9


@dataclass(frozen=True)
class Integrator:
    """An integrator with its step.

    Attributes
    ----------
    name
        ``RK44`` or ``TRAPEZOIDAL``.
    step
        h (s).
    reason
        Why, in words.
    """

    name: str
    step: float
    reason: str


@dataclass(frozen=True)
class Pole:
    """A pole s (rad/s) and the DoF that holds most of its mode's kinetic energy."""

    value: complex
    dof: str

    def __str__(self) -> str:
        if self.value.imag == 0.0:
            return f"{abs(self.value):.2g} 1/s ({self.dof}, overdamped)"
        return f"{in_hertz(abs(self.value) / (2.0 * np.pi))} ({self.dof})"


def choose_integrator(
    linear: LinearizedSystem,
    fmax: float,
    *,
    sampling_frequency: float | None = None,
    method: str | None = None,
    step: float | None = None,
    bend: float = FREQUENCY_BEND,
    step_cost: float = STEP_COST,
) -> Integrator:
    """Choose RK44 where it is the cheaper way to 1e-4 of the frequency at ``fmax``.

    h ≤ (120·10⁻⁴)^¼/ω and 0.8 of its stability limit for RK44, h ≤ (12·bend)^½/ω for the
    trapezoidal rule.

    Parameters
    ----------
    linear
        The linearised system.
    fmax
        End of the band of interest (Hz).
    sampling_frequency
        Hz; the step is made a whole fraction of 1/sampling_frequency. None: of a second.
    method, step
        To decide for oneself: ``RK44`` or ``TRAPEZOIDAL``; s.
    bend
        Relative change of the frequency at ``fmax`` that the trapezoidal rule is allowed: more
        than 1e-4 where it is taken out afterwards, since its ω′ = (2/h) tan(ωh/2) is known.
    step_cost
        How many steps of the trapezoidal rule take as long as one of RK44.

    Raises
    ------
    ModelError
        The step is longer than what is stable, or no whole fraction of a sampling interval; the
        band is none, or lies beyond Nyquist; the method is unknown, or cannot run the system.
    """
    _check_band(fmax, sampling_frequency)
    if method not in (None, RK44, TRAPEZOIDAL):
        raise ModelError(f"integrator '{method}': must be '{RK44}' or '{TRAPEZOIDAL}'")
    if linear.derived and method == RK44:
        raise ModelError(
            f"integrator '{RK44}': rigid couplings ({', '.join(linear.derived)}) are constraints "
            f"between bodies, which explicit solvers do not take; use '{TRAPEZOIDAL}'"
        )
    limit, pole = stable_step(linear)
    omega = 2.0 * np.pi * fmax
    explicit = min((120.0 * FREQUENCY_BEND) ** 0.25 / omega, STABILITY_MARGIN * limit)
    implicit = (12.0 * bend) ** 0.5 / omega
    if method is None:
        affordable = explicit >= step_cost * implicit and not linear.derived
        method = RK44 if affordable else TRAPEZOIDAL
    if step is None:
        wanted = explicit if method == RK44 else implicit
        chosen = _whole_fraction(wanted, sampling_frequency)
    else:
        chosen = _given_step(step, sampling_frequency)
    if method == RK44:
        _require_stable(chosen, limit, pole)
    if fmax * chosen >= 0.5:
        raise ModelError(
            f"step {chosen:.3g} s: the band to {in_hertz(fmax)} is not below half the step's "
            f"frequency, {in_hertz(0.5 / chosen)}"
        )
    return Integrator(method, chosen, _reason(linear, method, chosen, fmax, limit, pole))


def amplification(method: str, z: ComplexArray) -> ComplexArray:
    """R(z), what a mode is multiplied by in a step."""
    if method == RK44:
        taylor: ComplexArray = 1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))
        return taylor
    return (1.0 + z / 2.0) / (1.0 - z / 2.0)


def poles(linear: LinearizedSystem) -> tuple[Pole, ...]:
    """Poles of (s²M + sC + K)φ = 0, both of each pair.

    Of the first-order form in y = (σLᵀq, Lᵀq̇) with M = LLᵀ and σ² = ‖L⁻¹KL⁻ᵀ‖, where all
    entries are of one magnitude, so that a pole's error is round-off of the largest.
    """
    n = len(linear.dofs)
    factor = np.linalg.cholesky(linear.mass)
    inverse = np.linalg.inv(factor)
    stiffness = inverse @ linear.stiffness @ inverse.T
    damping = inverse @ linear.damping @ inverse.T
    scale = float(np.sqrt(np.linalg.norm(stiffness, 2))) or 1.0
    first_order = np.block([[np.zeros((n, n)), scale * np.eye(n)], [-stiffness / scale, -damping]])
    values, vectors = np.linalg.eig(first_order)
    motion = inverse.T @ (vectors[:n] + vectors[n:])  # one of the two is zero for a rigid body
    energy = np.abs(motion) ** 2 * np.diag(linear.mass)[:, None]
    return tuple(
        Pole(complex(value), linear.dofs[row])
        for value, row in zip(values, energy.argmax(axis=0), strict=True)
    )


def stable_step(linear: LinearizedSystem) -> tuple[float, Pole]:
    """RK44's longest stable step (s), and the pole that limits it."""
    found = poles(linear)
    values = np.array([pole.value for pole in found])
    size = np.abs(values)
    reach = np.divide(_reach(values), size, out=np.full(len(size), np.inf), where=size > 0.0)
    limiting = int(np.argmin(reach))
    return float(reach[limiting]), found[limiting]


def check_stable(linear: LinearizedSystem, step: float) -> None:
    """Refuse a step (s) with which RK44 cannot be stable.

    Raises
    ------
    ModelError
        It is too long: the mode is named, and the longest step.
    """
    _require_stable(step, *stable_step(linear))


def _require_stable(step: float, limit: float, pole: Pole) -> None:
    if step > limit:
        raise ModelError(
            f"step {step:.3g} s: RK44 is stable below {limit:.3g} s only; the highest mode is at "
            f"{pole}; shorten the step or use the trapezoidal rule"
        )


def _reach(values: ComplexArray) -> FloatArray:
    """h|s| to which RK44 amplifies no pole by more than it grows itself, |R(hs)| ≤ |e^{hs}| or 1.

    Both bounds have room for round-off alone; where nothing is met (a growing pole), infinite.
    """
    size = np.abs(values)
    unit = np.divide(values, size, out=np.ones_like(values), where=size > 0.0)[:, None]

    def stable(z: FloatArray) -> NDArray[np.bool_]:
        reached = np.asarray(z * unit, dtype=complex)
        allowed = np.maximum(np.abs(np.exp(reached)), 1.0) * (1.0 + ROUND_OFF)
        held: NDArray[np.bool_] = np.abs(amplification(RK44, reached)) <= allowed
        return held

    grid = np.broadcast_to(np.linspace(0.0, 3.5, 701), (len(values), 701))
    lost = ~stable(grid)
    rows, first = np.arange(len(values)), lost.argmax(axis=1)
    low, high = grid[rows, first - 1][:, None], grid[rows, first][:, None]
    for _ in range(40):
        middle = (low + high) / 2.0
        held = stable(middle)
        low, high = np.where(held, middle, low), np.where(held, high, middle)
    return np.where(lost.any(axis=1), low[:, 0], np.inf)


def steps_per_sample(step: float, sampling_frequency: float) -> int:
    """How many steps make a sampling interval.

    Raises
    ------
    ModelError
        Not a whole number, or the sampling frequency (Hz) is not above zero.
    """
    _check_sampling(sampling_frequency)
    steps = 1.0 / (sampling_frequency * step)
    whole = max(1, round(steps))
    if abs(steps - whole) > ROUND_OFF * whole:
        raise ModelError(
            f"step {step:.10g} s: {steps:.10g} of them make a sampling interval at "
            f"{in_hertz(sampling_frequency)}, which must be a whole number; "
            f"{1.0 / (sampling_frequency * whole):.10g} s would fit"
        )
    return whole


def in_hertz(frequency: float) -> str:
    """A frequency with the prefix that suits it."""
    for factor, unit in ((1e6, "MHz"), (1e3, "kHz")):
        if frequency >= factor:
            return f"{frequency / factor:.3g} {unit}"
    return f"{frequency:.3g} Hz"


def _check_band(fmax: float, sampling_frequency: float | None) -> None:
    if not (np.isfinite(fmax) and fmax > 0.0):
        raise ModelError(f"band of interest: its end must be above 0 Hz, got {fmax:g} Hz")
    if sampling_frequency is None:
        return
    _check_sampling(sampling_frequency)
    if 2.0 * fmax >= sampling_frequency:
        raise ModelError(
            f"band to {in_hertz(fmax)}: must end below half the sampling frequency, "
            f"{in_hertz(sampling_frequency / 2.0)}"
        )


def _check_sampling(frequency: float) -> None:
    if not (np.isfinite(frequency) and frequency > 0.0):
        raise ModelError(f"sampling frequency: must be above 0 Hz, got {frequency:g} Hz")


def _whole_fraction(longest: float, sampling_frequency: float | None) -> float:
    interval = 1.0 / (sampling_frequency or 1.0)
    step = interval / np.ceil(interval / longest * (1.0 - ROUND_OFF))
    return _long_enough(float(step))


def _given_step(step: float, sampling_frequency: float | None) -> float:
    if not (np.isfinite(step) and step > 0.0):
        raise ModelError(f"step: must be above 0 s, got {step:g} s")
    if sampling_frequency is not None:
        step = 1.0 / (sampling_frequency * steps_per_sample(step, sampling_frequency))
    return _long_enough(step)


def _long_enough(step: float) -> float:
    if step < SHORTEST_STEP:
        raise ModelError(
            f"step {step:.3g} s: exudyn tells times apart that differ by {SHORTEST_STEP:g} s or "
            "more; use the trapezoidal rule, or a lower band"
        )
    return step


def _reason(
    linear: LinearizedSystem, method: str, step: float, fmax: float, limit: float, pole: Pole
) -> str:
    phase = 2.0 * np.pi * fmax * step
    bend = phase**4 / 120.0 if method == RK44 else phase**2 / 12.0
    accuracy = f"what is at {in_hertz(fmax)} comes out {100.0 * bend:.1g} % lower"
    if method == RK44:
        why = f"{accuracy}; stable below {limit:.2g} s, the highest mode is at {pole}"
        return f"RK44, h = {step:.3g} s: {why}"
    if linear.derived:
        why = "rigid couplings are constraints between bodies, which explicit solvers do not take"
    else:
        why = f"the highest mode, {pole}, would ask an explicit solver for h < {limit:.2g} s"
    return f"trapezoidal rule, h = {step:.3g} s: {accuracy} (FRFs are freed of it); {why}"

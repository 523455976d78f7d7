"""Sidebands: what a sensor on the ring sees of a planetary stage, and where its lines lie.

The model lives in the carrier's frame, where planets stand still and everything happens at the
mesh frequency f_m = z_r f_c and its multiples. A sensor fixed to the ring is passed by the
carrier, f_c times a second (f_c relative to the ring), and two things move its lines:

- The ring's rigid motion (u, v) turns past it: x = u cos(θ − ψ) − v sin(θ − ψ), θ = 2π f_c t,
  with lines at l f_m ± f_c.
- Planets are louder when near: a = Σ_n W(θ + ψ_n − ψ) F_n with a transfer path W of period 2π
  (McFadden & Smith 1985, Proc. IMechE C 199, 65–70; Inalpolat & Kahraman 2009, J. Sound Vib. 323,
  677–696). A planet at ψ_n meets the ring's teeth with the phase z_r ψ_n, so order k = l z_r + m
  of the carrier is Σ_n e^{jkψ_n} strong: with N planets alike and equally spaced only multiples
  of N remain, and the mesh frequency itself vanishes unless N divides z_r.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ModelError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Sideband:
    """One line a sensor on the ring sees.

    Attributes
    ----------
    order
        Its frequency over the carrier's.
    harmonic, offset
        l and m of order = l z_r + m, m the smallest.
    phasor
        A e^{jφ} of A cos(order·θ + φ).
    """

    order: int
    harmonic: int
    offset: int
    phasor: complex

    @property
    def amplitude(self) -> float:
        """A; round-off where the planets cancel."""
        return abs(self.phasor)


def passing_window(planets: int, harmonics: int) -> FloatArray:
    """W_m of W(ψ) = Σ_m W_m cos mψ = ½(1 + cos Nψ) for |ψ| < π/N, else 0.

    Only the nearest planet is heard (Inalpolat & Kahraman 2009 weigh so): with h = π/N
    W_0 = h/2π, W_m = (h/π) sinc(mh)/(1 − (mh/π)²), and h/2π at m = N.
    """
    half = np.pi / planets
    ratio = np.arange(harmonics + 1) * half / np.pi
    pole = ratio == 1.0
    window = np.sinc(ratio) / np.where(pole, 1.0, 1.0 - ratio**2)
    window[pole] = 0.5
    window *= half / np.pi
    window[0] /= 2.0
    return np.asarray(window)


def ring_sensor(
    forces: FloatArray,
    time: FloatArray,
    planet_angles: Sequence[float],
    carrier_frequency: float,
    window: ArrayLike,
    sensor_angle: float = 0.0,
) -> FloatArray:
    """a(t) = Σ_n W(θ + ψ_n − ψ) F_n(t), θ = 2π f_c t: what passing planets make a sensor feel.

    Parameters
    ----------
    forces
        (n, N) ring mesh forces (N).
    time
        (n,) s.
    planet_angles
        (N,) ψ_n (rad) at t = 0.
    carrier_frequency
        f_c (Hz) relative to the ring, counter-clockwise.
    window
        (n_window,) W_0, W_1, … of W(ψ) = Σ_m W_m cos mψ.
    sensor_angle
        ψ (rad).

    Raises
    ------
    ModelError
        Shapes that do not fit.
    """
    angles, path = np.asarray(planet_angles, dtype=float), np.asarray(window, dtype=float)
    if forces.shape != (len(time), len(angles)) or not len(angles):
        raise ModelError(
            f"ring sensor: forces of shape {forces.shape} do not fit {len(time)} instants and "
            f"{len(angles)} planets"
        )
    carrier = 2.0 * np.pi * carrier_frequency * time - sensor_angle
    felt = np.zeros(len(time))
    for angle, force in zip(angles, forces.T, strict=True):
        felt += force * _series(path, carrier + angle)
    return felt


def _series(window: FloatArray, angle: FloatArray) -> FloatArray:
    """Σ_m W_m cos mψ, by Chebyshev's recursion (one cosine whatever the number of terms)."""
    return np.asarray(np.polynomial.chebyshev.chebval(np.cos(angle), window))


def expected_sidebands(
    ring_teeth: int,
    planet_angles: ArrayLike,
    mesh: ArrayLike,
    window: ArrayLike,
    *,
    phases: ArrayLike | None = None,
    shares: ArrayLike | None = None,
    sensor_angle: float = 0.0,
) -> tuple[Sideband, ...]:
    """Lines of `ring_sensor` for F_n = s_n Re Σ_l F_l e^{jl(z_r θ + γ_n)}.

    Order l z_r ± m has the phasor ½ F_l W_m Σ_n s_n e^{j(lγ_n ± m(ψ_n − ψ))} (m = 0: without ½);
    lines of different l and m that meet at one order add up. Where the carrier turns clockwise
    relative to the ring, count ψ_n and ψ clockwise.

    Parameters
    ----------
    ring_teeth
        z_r.
    planet_angles
        (N,) ψ_n (rad), equally spaced or not.
    mesh
        (n_harmonic,) F_0 (the mean), F_1, … of one ring mesh (N).
    window
        (n_window,) W_0, W_1, … of the transfer path.
    phases
        (N,) γ_n (rad), a lead (−2π times a delay in mesh periods); z_r ψ_n if not given: every
        planet does the same at the same tooth.
    shares
        (N,) s_n: how planets share the load; 1 if not given.
    sensor_angle
        ψ (rad).

    Returns
    -------
    Every order that a mesh harmonic and a term of the window reach, ascending; those that cancel
    have an amplitude of round-off.

    Raises
    ------
    ModelError
        No teeth, no planets, or not one phase and one share per planet.
    """
    angles = np.asarray(planet_angles, dtype=float)
    gamma = ring_teeth * angles if phases is None else np.asarray(phases, dtype=float)
    loads = np.ones(len(angles)) if shares is None else np.asarray(shares, dtype=float)
    if ring_teeth < 1 or not len(angles) or not gamma.shape == loads.shape == angles.shape:
        raise ModelError(
            f"sidebands: {ring_teeth} teeth, {len(angles)} planets, {gamma.size} phases and "
            f"{loads.size} shares; need 1 tooth or more and one phase and share per planet"
        )
    lines: dict[int, complex] = {}
    for harmonic, force in enumerate(np.asarray(mesh, dtype=complex)):
        for term, weight in enumerate(np.asarray(window, dtype=float)):
            for offset in {term, -term}:
                planets = np.exp(1j * (harmonic * gamma + offset * (angles - sensor_angle)))
                phasor = force * weight * (loads @ planets) / (2.0 if term else 1.0)
                order = harmonic * ring_teeth + offset
                # a cosine of negative frequency is its mirror image
                at, phasor = (order, phasor) if order >= 0 else (-order, np.conj(phasor))
                lines[at] = lines.get(at, 0.0) + complex(phasor)
    if 0 in lines:
        lines[0] = complex(lines[0].real)  # cos(0·θ + φ) is its real part
    return tuple(_named(order, ring_teeth, lines[order]) for order in sorted(lines))


def _named(order: int, teeth: int, phasor: complex) -> Sideband:
    harmonic = round(order / teeth)
    return Sideband(order, harmonic, order - harmonic * teeth, phasor)

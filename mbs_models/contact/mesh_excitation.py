"""The force of a mesh: stiffness over time, transmission error, backlash, damping in the teeth.

With δ the deflection of the mesh (`involute_mesh`) and the flank p = ±1 (the sign of δ where the
loaded flanks press), x = p δ − e(t) is how far the teeth are pressed together, b the backlash, and

    F = k(t) g(x) + c ẋ  in contact, |x| > b/2 or b = 0,    0 in the gap
    k(t) = k_m (1 + κ(τ)),    c = β k_m,    τ = f_mesh t − γ

with g the backlash function of Kahraman & Singh (1990, J. Sound Vib. 142, 49–75): g(x) = x − b/2
above b/2, x + b/2 below −b/2. Teeth that part do not pull: where the damper would, F = 0. F is
positive where the loaded flanks press. e is how far the driving gear runs ahead unloaded. Both
flanks act along the model's one line of action. Gears vibrate about their mean rotation, whose
speed enters by f_mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..signals.waveforms import FourierSeries, Waveform

FloatArray = NDArray[np.float64]
CONSTANT = FourierSeries()
# (t, δ, δ̇) → force along δ (N), and its derivatives by δ and δ̇ (N/m, N s/m).
MeshForce = Callable[[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class MeshLaw:
    """What a mesh does beyond being a constant spring.

    Attributes
    ----------
    frequency
        f_mesh (Hz); 0 where nothing varies.
    phase
        γ, in mesh periods: how much later this mesh goes through the same as the reference.
    stiffness
        κ(τ), relative to the mean stiffness.
    transmission_error
        e(τ) (m).
    backlash
        b (m), along the line of action, from flank to flank.
    flank
        p = ±1, sign of the deflection when the loaded flanks press.
    """

    frequency: float = 0.0
    phase: float = 0.0
    stiffness: Waveform = CONSTANT
    transmission_error: Waveform = CONSTANT
    backlash: float = 0.0
    flank: float = 1.0

    @property
    def varies(self) -> bool:
        """Whether it changes with time."""
        return self.stiffness != CONSTANT or self.transmission_error != CONSTANT

    def relative_stiffness(self, time: FloatArray) -> FloatArray:
        """k/k_m at some instants (s)."""
        return 1.0 + self.stiffness.value(self.frequency * time - self.phase)

    def error(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """e (m) and ė (m/s) at some instants (s)."""
        turns = self.frequency * time - self.phase
        rate: FloatArray = self.frequency * self.transmission_error.slope(turns)
        return self.transmission_error.value(turns), rate


@dataclass(frozen=True)
class LawSamples:
    """k/k_m, e and ė of a law at the instants an integrator asks for; filled piece by piece.

    A waveform costs more than all else of a mesh's force; sampled beforehand it costs a look-up.
    """

    law: MeshLaw
    first: list[float] = field(default_factory=lambda: [0.0, 0.0])  # instant (s), and 1/interval
    stiffness: list[float] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    error_rate: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.sample(0.0, 0.0, 1)

    def sample(self, first: float, rate: float, count: int) -> None:
        """Sample at ``count`` instants from ``first`` (s) on, ``rate`` a second."""
        offsets = np.arange(count) / rate if rate else np.zeros(count)
        time = first + offsets
        self.first[:] = first, rate
        self.stiffness[:] = self.law.relative_stiffness(time).tolist()
        error, error_rate = self.law.error(time)
        self.error[:], self.error_rate[:] = error.tolist(), error_rate.tolist()


def mesh_force(stiffness: float, damping: float, samples: LawSamples) -> MeshForce:
    """The force along δ at one instant, with its derivatives; the equation is this module's.

    Parameters
    ----------
    stiffness, damping
        k_m (N/m) and c (N s/m).
    samples
        The law at the instants that are asked for.
    """
    law = samples.law
    flank, half, first = law.flank, 0.5 * law.backlash, samples.first
    relative, errors, rates = samples.stiffness, samples.error, samples.error_rate

    def constant(time: float, deflection: float, rate: float) -> tuple[float, float, float]:
        return stiffness * deflection + damping * rate, stiffness, damping

    def varying(time: float, deflection: float, rate: float) -> tuple[float, float, float]:
        at = round((time - first[0]) * first[1])
        k = stiffness * relative[at]
        pressed = flank * deflection - errors[at]
        if -half <= pressed <= half and half > 0.0:
            return 0.0, 0.0, 0.0
        side = 1.0 if pressed > 0.0 else -1.0
        force = k * (pressed - side * half) + damping * (flank * rate - rates[at])
        if half > 0.0 and force * side < 0.0:
            return 0.0, 0.0, 0.0
        return flank * force, k, damping

    return varying if law.varies or half > 0.0 else constant


def mesh_forces(
    law: MeshLaw,
    stiffness: float,
    damping: float,
    time: FloatArray,
    deflection: FloatArray,
    rate: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The force F (N) at many instants, and which flank touches: 1 the loaded one, −1, or 0.

    Parameters
    ----------
    law
        What varies.
    stiffness, damping
        k_m (N/m) and c (N s/m).
    time, deflection, rate
        (n,) t (s), δ (m), δ̇ (m/s).
    """
    error, error_rate = law.error(time)
    pressed, half = law.flank * deflection - error, 0.5 * law.backlash
    side = np.sign(pressed) * (np.abs(pressed) > half)
    elastic = stiffness * law.relative_stiffness(time) * (pressed - side * half)
    force = elastic + damping * (law.flank * rate - error_rate)
    if half > 0.0:
        force = np.where(force * side > 0.0, force, 0.0)
    return force, side


def elastic_energy(
    law: MeshLaw, stiffness: float, time: FloatArray, deflection: FloatArray
) -> FloatArray:
    """½ k(t) g(x)² (J) at many instants; arguments as for `mesh_forces`."""
    error, _ = law.error(time)
    beyond = np.maximum(np.abs(law.flank * deflection - error) - 0.5 * law.backlash, 0.0)
    energy: FloatArray = 0.5 * stiffness * law.relative_stiffness(time) * beyond**2
    return energy


def at_mean(laws: Mapping[str, MeshLaw]) -> dict[str, MeshLaw]:
    """The same meshes without what varies."""
    return {name: MeshLaw(backlash=law.backlash, flank=law.flank) for name, law in laws.items()}

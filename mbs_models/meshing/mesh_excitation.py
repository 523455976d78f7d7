"""The force law of a mesh that excites: stiffness over time, transmission error, backlash.

With s the stretch of the mesh spring and the flank p = ±1 (the sign of s when the loaded flanks
press), δ = p s is how far the teeth are pressed together and

    p f = k(t) g(δ − e(t)) + c (δ̇ − ė(t)),    k(t) = k_m (1 + κ(τ)),    τ = f_mesh t − γ

with g the backlash function of Kahraman & Singh (1990, J. Sound Vib. 142, 49–75): g(x) = x − b/2
above b/2, x + b/2 below −b/2, 0 between. c = β k_m stays what it is without excitation, and acts in
the gap too, as it does there. e is how far the driving gear runs ahead unloaded. Both flanks act
along the model's one line of action. The gears themselves do not turn: speed enters by f_mesh.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .waveforms import FourierSeries, Waveform

ForceLaw = Callable[[float, float, float], float]  # (t, stretch, its rate) → tension (N)
CONSTANT = FourierSeries()


@dataclass(frozen=True)
class MeshLaw:
    """What a mesh spring does beyond being a constant spring.

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
        p = ±1, sign of the spring's stretch when the loaded flanks press.
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
        return self.frequency != 0.0

    def turns(self, time: float) -> float:
        """τ at an instant (s)."""
        return self.frequency * time - self.phase

    def relative_stiffness(self, time: float) -> float:
        """k/k_m at an instant (s)."""
        return 1.0 + self.stiffness.value(self.turns(time))


def separation(stretch: float, backlash: float) -> float:
    """g(x): what is left of a relative motion when the backlash is taken up."""
    half = 0.5 * backlash
    if stretch > half:
        return stretch - half
    return stretch + half if stretch < -half else 0.0


def force_law(law: MeshLaw, stiffness: float, damping: float) -> ForceLaw:
    """The spring's tension f(t, s, ṡ) (N) under a law; the equation is this module's.

    Parameters
    ----------
    law
        What varies.
    stiffness, damping
        k_m (N/m) and c (N s/m).
    """
    frequency, phase, flank, backlash = law.frequency, law.phase, law.flank, law.backlash
    relative = law.stiffness.value

    def without_error(time: float, stretch: float, rate: float) -> float:
        k = stiffness * (1.0 + relative(frequency * time - phase))
        return k * separation(stretch, backlash) + damping * rate

    if law.transmission_error == CONSTANT:
        return without_error
    error, slope = law.transmission_error.value, law.transmission_error.slope

    def tension(time: float, stretch: float, rate: float) -> float:
        turns = frequency * time - phase
        moved = stretch - flank * error(turns)
        return without_error(time, moved, rate - flank * frequency * slope(turns))

    return tension

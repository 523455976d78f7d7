"""The same run with every force reversed: what geometry does to even order changes no sign.

A drivetrain that turns by θ moves its planets inwards by r θ²/2 whichever way it turns. Half the
difference of the two runs is free of it, and of every other even order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..model.excitation import Excitation
from ..signals.lines import BandNoise, Signal

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Reversed:
    """−f(t) of a signal."""

    signal: Signal

    @property
    def band(self) -> tuple[float, float]:
        """As of the signal."""
        return self.signal.band

    @property
    def period(self) -> float | None:
        """As of the signal; None of noise, any part of which is noise: its period is no limit."""
        return None if isinstance(self.signal, BandNoise) else self.signal.period

    @property
    def duration(self) -> float | None:
        """As of the signal."""
        return self.signal.duration

    def values(self, time: FloatArray) -> FloatArray:
        """The force (N) at any instants (s)."""
        return -self.signal.values(time)


def reversed_excitation(excitation: Excitation[Signal]) -> Excitation[Signal]:
    """The excitation with its force reversed."""
    return Excitation(excitation.dof, Reversed(excitation.signal))


def odd_part(forward: FloatArray, backward: FloatArray) -> FloatArray:
    """(x₊ − x₋)/2: what changes sign with the force."""
    return np.asarray((forward - backward) / 2.0)

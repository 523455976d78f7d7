"""How much of a sampled response lies above half the sampling frequency, and is folded back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# A share above this is warned of: what is folded back is then 1 % of the response's RMS value.
ALIASING_LIMIT = 1e-4
# A DoF that symmetry keeps still moves by round-off; of it nothing is said. Share of the RMS value
# of the DoF that moves most.
STILL = 1e-5


@dataclass(frozen=True)
class Folded:
    """Variance above half the sampling frequency, and in all, of each column of each quantity."""

    above: Mapping[str, FloatArray]
    total: Mapping[str, FloatArray]

    def __add__(self, other: Folded) -> Folded:
        return Folded(
            {what: value + other.above[what] for what, value in self.above.items()},
            {what: value + other.total[what] for what, value in self.total.items()},
        )

    def worst(self, columns: Mapping[str, tuple[str, ...]]) -> tuple[float, str]:
        """The largest share, and where it is."""
        share, where = 0.0, ""
        for what, total in self.total.items():
            moving = total > STILL**2 * total.max(initial=0.0)
            shares = np.divide(self.above[what], total, out=np.zeros_like(total), where=moving)
            if shares.max(initial=0.0) > share:
                column = int(shares.argmax())
                share = float(shares[column])
                where = f"{what.replace('_', ' ')} of {columns[what][column]}"
        return share, where


def nothing_folded(columns: Mapping[str, tuple[str, ...]]) -> Folded:
    """Before a run."""
    zeros = {what: np.zeros(len(names)) for what, names in columns.items()}
    return Folded(zeros, zeros)


def folded(samples: Mapping[str, FloatArray], stride: int) -> Folded:
    """What sampling every ``stride``-th of some samples (n, n_column) folds back.

    Σ|X_k|² above half of 1/stride over that of all lines, of the samples less their line of
    regression under a Hann window: the edges of a piece leak by 18 dB per octave, not by 6.
    """
    from scipy.signal import detrend
    from scipy.signal.windows import hann

    above, total = {}, {}
    for what, values in samples.items():
        window = hann(len(values), sym=False)[:, None]
        spectrum = np.fft.rfft(detrend(values, axis=0) * window, axis=0)
        power = np.abs(spectrum) ** 2
        frequency = np.arange(len(power)) * stride / len(values)  # of the sampling frequency
        above[what] = power[frequency > 0.5].sum(axis=0)
        total[what] = power.sum(axis=0)
    return Folded(above, total)


def aliasing_warning(share: float, where: str, sampling_frequency: float) -> tuple[str, ...]:
    """Said where a share is above the limit."""
    if share <= ALIASING_LIMIT:
        return ()
    return (
        f"aliasing: {share:.2g} of the variance of the {where} lies above "
        f"{sampling_frequency / 2.0:g} Hz, half the sampling frequency, and is folded back "
        f"({ALIASING_LIMIT:g} is let pass); sample faster",
    )

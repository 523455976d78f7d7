"""Resonances as peaks of a drive point, before and after a change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray

PROMINENCE_DB = 3.0  # how far a peak stands above the higher of the valleys beside it
LARGEST_SHIFT = 0.1  # of the frequency: peaks further apart are not the same resonance
SHARPEST = 0.5  # of 1/|H|²: three lines do not tell how high a peak is that stands 3 dB above them
SAME = 2e-3  # of the frequency: one resonance, seen at two drive points


@dataclass(frozen=True)
class Peak:
    """A maximum of |H|: where, how high (dB re 1 m/N), and how far above the valleys beside it."""

    frequency_hz: float
    level_db: float
    prominence_db: float


@dataclass(frozen=True)
class Resonance:
    """A resonance seen at a drive point; before or after is None where it is not there."""

    dof: str
    before: Peak | None
    after: Peak | None

    @property
    def shift(self) -> float | None:
        """(f_after − f_before) / f_before."""
        if self.before is None or self.after is None:
            return None
        return self.after.frequency_hz / self.before.frequency_hz - 1.0

    @property
    def frequency_hz(self) -> float:
        """Where it is before, or after where it is new."""
        (first, *_) = self._peaks
        return first.frequency_hz

    @property
    def prominence_db(self) -> float:
        """How far it stands out, before or after."""
        return max(peak.prominence_db for peak in self._peaks)

    @property
    def _peaks(self) -> list[Peak]:
        return [peak for peak in (self.before, self.after) if peak is not None]


def find(frequency: FloatArray, values: NDArray[Any]) -> tuple[Peak, ...]:
    """Peaks of |H|: the vertex of the parabola through 1/|H|² at three lines.

    Near a resonance 1/|H|² ∝ (f − f₀)² + (ζf₀)²: a parabola, however sharp the peak.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz, evenly spaced or not.
    values
        (n_frequency,) a drive point's FRF.
    """
    from scipy.signal import find_peaks

    size = np.maximum(np.abs(values), np.finfo(float).tiny)
    level = 20.0 * np.log10(size)
    lines, properties = find_peaks(level, prominence=PROMINENCE_DB)
    found = []
    for k, prominence in zip(lines, properties["prominences"], strict=True):
        near = slice(k - 1, k + 2)
        at, ratio = _vertex(frequency[near], (size[k] / size[near]) ** 2)
        top = level[k] - 10.0 * np.log10(ratio if ratio > SHARPEST else 1.0)
        found.append(Peak(at, float(top), float(prominence)))
    return tuple(found)


def _vertex(f: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Where y = y₀ + d₁(f − f₀) + a(f − f₀)(f − f₁) is least, and how much it is there."""
    d1, d2 = np.diff(y) / np.diff(f)
    a = (d2 - d1) / (f[2] - f[0])
    if not a > 0.0:  # three values alike
        return float(f[1]), float(y[1])
    at = 0.5 * (f[0] + f[1]) - 0.5 * d1 / a
    return float(at), float(y[0] + d1 * (at - f[0]) + a * (at - f[0]) * (at - f[1]))


def match(dof: str, before: Sequence[Peak], after: Sequence[Peak]) -> tuple[Resonance, ...]:
    """Two sets of peaks as resonances: a pair are those that are each other's nearest."""
    if not before or not after:
        pairs: dict[int, int] = {}
    else:
        f, g = (np.log([peak.frequency_hz for peak in peaks]) for peaks in (before, after))
        distance = np.abs(f[:, None] - g)
        nearest, back = distance.argmin(axis=1), distance.argmin(axis=0)
        pairs = {
            i: int(j)
            for i, j in enumerate(nearest)
            if back[j] == i and distance[i, j] <= np.log1p(LARGEST_SHIFT)
        }
    found = [
        Resonance(dof, peak, after[pairs[i]] if i in pairs else None)
        for i, peak in enumerate(before)
    ]
    found += [Resonance(dof, None, peak) for j, peak in enumerate(after) if j not in pairs.values()]
    return tuple(sorted(found, key=lambda resonance: resonance.frequency_hz))


def merge(frequency: FloatArray, resonances: Iterable[Resonance]) -> tuple[Resonance, ...]:
    """Every resonance once, as the drive point shows it where it stands out most.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz; peaks a line apart may be one.
    resonances
        Of all drive points.
    """
    kept: list[Resonance] = []
    by_weight = sorted(
        resonances, key=lambda r: (r.shift is not None, r.prominence_db), reverse=True
    )
    for one in by_weight:
        if not any(_same(frequency, one, other) for other in kept):
            kept.append(one)
    return tuple(sorted(kept, key=lambda resonance: resonance.frequency_hz))


def _same(frequency: FloatArray, one: Resonance, other: Resonance) -> bool:
    """Whether all peaks that both have are at one place."""
    both = [
        np.array([a.frequency_hz, b.frequency_hz])
        for a, b in ((one.before, other.before), (one.after, other.after))
        if a is not None and b is not None
    ]
    return bool(both) and all(
        np.ptp(places) <= SAME * places[0] or np.ptp(np.searchsorted(frequency, places)) <= 1
        for places in both
    )

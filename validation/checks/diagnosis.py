"""Where two routes disagree, and by what: a difference of FRFs traced to entries of M, C and K.

A wrong element changes every FRF, but only a few entries of the dynamic stiffness Z = H⁻¹. The
difference ΔZ(ω) = ΔK + jωΔC − ω²ΔM, fitted over a few lines of the band, says which.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray

Array = NDArray[Any]

# An entry of ΔZ that is this small against its DoFs' own dynamic stiffness is round-off of the
# inversion (measured: below 1e-10 between routes that agree).
SIGNIFICANT = 1e-8
MAX_FINDINGS = 8
EPS = float(np.finfo(float).eps)


def number(value: float, form: str = ".6g") -> str:
    """A number as one writes it: 5.5e8, not 5.5e+08."""
    return re.sub(r"e([+-])0*(\d+)", lambda m: f"e{m[1].strip('+')}{m[2]}", f"{value:{form}}")


@dataclass(frozen=True)
class EntryDifference:
    """One entry of M, C or K in which two routes differ."""

    matrix: str  # "mass", "damping", "stiffness"
    row: str
    column: str
    reference: float
    other: float

    def __str__(self) -> str:
        unit = {"mass": "kg", "damping": "N s/m", "stiffness": "N/m"}[self.matrix]
        at = self.row if self.row == self.column else f"({self.row}, {self.column})"
        difference = self.other - self.reference
        percent = 100.0 * difference / self.reference if self.reference else None
        relative = "" if percent is None else f", {percent:+.3g} %"
        values = f"{number(self.reference)} against {number(self.other)} {unit}"
        return f"{self.matrix} at {at}: {values} ({number(difference, '+.3g')}{relative})"


def locate(
    frequency: FloatArray,
    reference: Array,
    other: Array,
    round_off: FloatArray,
    dofs: Sequence[str],
) -> tuple[EntryDifference, ...]:
    """Entries of M, C, K in which two sets of FRFs differ, the most telling first.

    ΔZ = Z₂ − Z₁ = Z₁ (H₁ − H₂) Z₂, so that errors E of H₁ − H₂ are errors |Z₁| E |Z₂| of ΔZ at
    most. They weigh the lines, entry by entry, and what is fitted must exceed what they can make
    of it: a DoF on a stiff spring moves with its neighbour, digit by digit, and says nothing of its
    own mass.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz, a few lines over the band, at least two of them different.
    reference, other
        (n_frequency, n, n) receptances of all independent DoFs.
    round_off
        (n_frequency, n, n) bound of both receptances' errors together.
    dofs
        Their labels.

    Raises
    ------
    numpy.linalg.LinAlgError
        A matrix of receptances has no inverse.
    """
    z_reference, z_other = np.linalg.inv(reference), np.linalg.inv(other)
    # LU's backward error is n eps |H| (Higham, Accuracy and Stability, 2002, 9.3), pivots not grown
    inversion = len(dofs) * EPS * (np.abs(reference) + np.abs(other))
    noise = np.abs(z_reference) @ (round_off + inversion) @ np.abs(z_other)
    own = np.max(np.abs(np.einsum("kii->ki", z_reference)), axis=0)
    scale = np.sqrt(np.outer(own, own))
    top = 2.0 * np.pi * frequency[-1]
    found: list[tuple[float, EntryDifference]] = []
    for name, part, power, weights in _fits(2.0 * np.pi * frequency, noise + EPS * scale):
        base, delta = (np.sum(weights * part(z), axis=0) for z in (z_reference, z_other))
        delta -= base
        explained = np.sum(np.abs(weights) * np.where(weights, noise, 0.0), axis=0)
        # What an entry's difference does at the band's top, against its DoFs' own stiffness.
        effect = np.abs(delta) * top**power / scale
        for i, j in np.argwhere(np.triu((effect > SIGNIFICANT) & (np.abs(delta) > explained))):
            entry = EntryDifference(
                name, dofs[i], dofs[j], float(base[i, j]), float(base[i, j] + delta[i, j])
            )
            found.append((float(effect[i, j]), entry))
    return _telling(found)


def _fits(
    omega: FloatArray, noise: FloatArray
) -> tuple[tuple[str, Callable[[Array], FloatArray], int, FloatArray], ...]:
    """Least squares of Z(ω) = K + jωC − ω²M by entry, lines weighted by 1/noise².

    Each matrix with the part of Z it is of, the power of ω with which it enters, and what each
    line's Z counts; NaN where fewer than two lines have any.
    """
    top = omega[-1]
    x = (omega / top)[:, None, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        w = (noise.min(axis=0) / noise) ** 2  # 0 where the noise is infinite
        s0, s2, s4 = (np.sum(w * x**power, axis=0) for power in (0, 2, 4))
        alone = s0 * s4 - s2**2
        return (
            ("stiffness", np.real, 0, w * (s4 - s2 * x**2) / alone),
            ("mass", np.real, 2, w * (s2 - s0 * x**2) / alone / top**2),
            ("damping", np.imag, 1, w * x / s2 / top),
        )


def _telling(found: list[tuple[float, EntryDifference]]) -> tuple[EntryDifference, ...]:
    """Strongest first; what the fit spills into the other matrices of an entry is left out."""
    strongest: dict[tuple[str, str], float] = {}
    for effect, entry in found:
        key = (entry.row, entry.column)
        strongest[key] = max(strongest.get(key, 0.0), effect)
    kept = [
        (effect, entry)
        for effect, entry in found
        if effect > 1e-3 * strongest[entry.row, entry.column]
    ]
    return tuple(entry for _, entry in sorted(kept, key=lambda item: -item[0]))


def differing_entries(
    name: str, reference: FloatArray, other: FloatArray, dofs: Sequence[str], tolerance: float
) -> tuple[EntryDifference, ...]:
    """Entries of two matrices that differ by more than ``tolerance`` (absolute), largest first."""
    delta = np.triu(np.abs(other - reference))
    pairs = np.argwhere(delta > tolerance)
    order = np.argsort([-delta[i, j] for i, j in pairs])
    return tuple(
        EntryDifference(name, dofs[i], dofs[j], float(reference[i, j]), float(other[i, j]))
        for i, j in pairs[order]
    )


def describe(found: Sequence[EntryDifference]) -> tuple[str, ...]:
    """The most telling differences, and how many more there are."""
    words = [str(entry) for entry in found[:MAX_FINDINGS]]
    if len(found) > MAX_FINDINGS:
        words.append(f"and {len(found) - MAX_FINDINGS} more entries")
    return tuple(words)

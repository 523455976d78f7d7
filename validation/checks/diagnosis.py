"""Where two routes disagree, and by what: a difference of FRFs traced to entries of M, C and K.

A wrong element changes every FRF, but only a few entries of the dynamic stiffness Z = H⁻¹. The
difference ΔZ(ω) = ΔK + jωΔC − ω²ΔM, fitted over a few lines of the band, says which.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
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


@dataclass(frozen=True)
class Fit:
    """Z(ω) = K + jωC − ω²M fitted to a few lines, entry by entry."""

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray


def fit_dynamic_stiffness(frequency: FloatArray, stiffness: Array) -> Fit:
    """Least-squares K, C, M of Z(ω) = K + jωC − ω²M.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz, at least two different lines.
    stiffness
        (n_frequency, n, n) dynamic stiffness.
    """
    omega = 2.0 * np.pi * frequency
    n = stiffness.shape[1]
    flat = stiffness.reshape(len(frequency), n * n)
    # Columns scaled to the band's top, so that K and M weigh alike in the fit.
    top = omega[-1]
    basis = np.column_stack([np.ones_like(omega), -((omega / top) ** 2)])
    real = np.linalg.lstsq(basis, flat.real, rcond=None)[0]
    slope = np.sum((omega / top)[:, None] * flat.imag, axis=0) / np.sum((omega / top) ** 2)
    return Fit(
        mass=real[1].reshape(n, n) / top**2,
        damping=slope.reshape(n, n) / top,
        stiffness=real[0].reshape(n, n),
    )


def locate(
    frequency: FloatArray, reference: Array, other: Array, dofs: Sequence[str]
) -> tuple[EntryDifference, ...]:
    """Entries of M, C, K in which two sets of FRFs differ, the most telling first.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz, a few lines over the band.
    reference, other
        (n_frequency, n, n) receptances of all independent DoFs.
    dofs
        Their labels.
    """
    z_reference, z_other = np.linalg.inv(reference), np.linalg.inv(other)
    ours = fit_dynamic_stiffness(frequency, z_reference)
    difference = fit_dynamic_stiffness(frequency, z_other - z_reference)
    own = np.max(np.abs(np.einsum("kii->ki", z_reference)), axis=0)
    scale = np.sqrt(np.outer(own, own))
    top = 2.0 * np.pi * frequency[-1]
    found: list[tuple[float, EntryDifference]] = []
    for name, weight in (("stiffness", 1.0), ("mass", top**2), ("damping", top)):
        delta, base = getattr(difference, name), getattr(ours, name)
        # What an entry's difference does at the band's top, against its DoFs' own stiffness.
        effect = np.abs(delta) * weight / scale
        for i, j in np.argwhere(np.triu(effect > SIGNIFICANT)):
            entry = EntryDifference(
                name, dofs[i], dofs[j], float(base[i, j]), float(base[i, j] + delta[i, j])
            )
            found.append((float(effect[i, j]), entry))
    return _telling(found)


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

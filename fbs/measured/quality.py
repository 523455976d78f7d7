"""Whether FRFs can be a passive, reciprocal structure's: each FRF, and the matrix as a whole.

Reciprocity: H_ij = H_ji. Passivity: the power Re(v^H f) = f^H (Y + Y^H)/2 f that forces put in is
never negative, so that the Hermitian part of the mobility matrix between the same DoFs is positive
semi-definite; drive points alone (Re Y_ii ≥ 0, phase within ±90°) do not show it. Mass: far below
its first elastic mode a free body's accelerance is that of its rigid-body motion.

Ewins (2000), Modal Testing, 2nd ed., ch. 3; Carne & Dohrmann (2006), Improving experimental
frequency response function matrices for admittance modeling, IMAC XXIV.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._kernels.checks import ComplexArray, FloatArray
from ..frf import Frf

NOISE = 0.05
"""Of the FRF: 3° of phase, five times the scatter of a fair measurement."""

FLOOR = 1e-6
"""Of the largest FRF: 120 dB below it nothing is measured."""

FAIR_COHERENCE = 0.9
"""Below it a single impact's FRF is uncertain by a third: (1 − γ²)/(2 γ²) = 0.06, root 0.24."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Defect:
    """One property that does not hold at some lines.

    Attributes
    ----------
    what : str
        "reciprocity", "passivity", "phase", "coherence" or "mass".
    labels : tuple of str
        The DoFs concerned.
    lines : bool array, shape (nf,)
        Where it does not hold.
    worst : float
        The largest relative violation (for coherence the least coherence, for mass the ratio).
    at : float
        Where that is, Hz.
    """

    what: str
    labels: tuple[str, ...]
    lines: Mask
    worst: float
    at: float


def defects(
    frf: Frf,
    coherence: FloatArray | None = None,
    rigid: Mapping[str, float] | None = None,
    below: float = 0.0,
    noise: float = NOISE,
) -> tuple[Defect, ...]:
    """Return everything that does not hold, of the pairs and of the matrix.

    DoFs whose drive points are zero (see `zeros`) are left out.

    Parameters
    ----------
    frf : Frf
        Any quantity; 0 Hz left out.
    coherence : array, shape of the FRF's values, optional
        NaN where it is not known.
    rigid : mapping of str to float, optional
        DoF → accelerance of the rigid-body motion at its drive point, 1/kg.
    below : float
        Up to this frequency (Hz) the structure is rigid.
    noise : float
        What is no defect, relative to the size of an FRF.
    """
    mobility = frf.band(np.nextafter(0, 1)).to("mobility")
    still = zeros(mobility)
    square = [label for label in frf_square(frf) if (label, label) not in still]
    found = [
        *_reciprocity(mobility, square, noise),
        *_phase(mobility, square, noise),
        *_passivity(mobility, square, noise),
        *_coherence(frf, coherence),
        *_mass(mobility, rigid or {}, below, noise),
    ]
    return tuple(found)


def zeros(frf: Frf) -> tuple[tuple[str, str], ...]:
    """Return response and excitation of the FRFs that are zero at every line.

    Such is a dead channel, unless symmetry lets nothing pass.
    """
    still = ~frf.values.any(axis=0)
    return tuple((frf.responses[i], frf.excitations[j]) for i, j in np.argwhere(still))


def reciprocity_defect(frf: Frf, labels: Sequence[str]) -> FloatArray:
    """Return |H_ij − H_ji| / √(h_i h_j), shape (nf, n, n), h the norm of a column of H."""
    values = frf.select(labels, labels).values
    size = _pair_size(values)
    difference = np.abs(values - values.transpose(0, 2, 1))
    defect: FloatArray = np.divide(difference, size, out=np.zeros_like(difference), where=size > 0)
    return defect


def passivity_defect(frf: Frf, labels: Sequence[str]) -> FloatArray:
    """Return −λ_min / ‖Y‖ of the Hermitian part of the mobility matrix, shape (nf,).

    Its DoFs are scaled to unit drive points first, so that units of the DoFs do not count. 0 is
    passive, 1 gives out all that it moves.
    """
    mobility = frf.to("mobility").select(labels, labels).values
    scale = 1 / np.sqrt(_drive_size(mobility))
    scaled = mobility * scale[:, :, None] * scale[:, None, :]
    hermitian = (scaled + scaled.conj().transpose(0, 2, 1)) / 2
    least = np.linalg.eigvalsh(hermitian)[:, 0]
    size = np.linalg.norm(scaled, ord=2, axis=(1, 2))
    return np.asarray(np.maximum(-least, 0) / size, dtype=float)


# --- parts -------------------------------------------------------------------------------------


def _drive_size(values: ComplexArray) -> FloatArray:
    size = np.abs(np.diagonal(values, axis1=1, axis2=2))
    return np.asarray(np.maximum(size, FLOOR * size.max(axis=0)) + np.finfo(float).tiny)


def _pair_size(values: ComplexArray) -> FloatArray:
    norms = np.linalg.norm(values, axis=2)
    size = np.sqrt(norms[:, :, None] * norms[:, None, :])
    return np.asarray(np.maximum(size, FLOOR * size.max(axis=0)))


def _defect(
    what: str, labels: tuple[str, ...], axis: FloatArray, size: FloatArray, lines: Mask
) -> list[Defect]:
    if not lines.any():
        return []
    worst = int(np.argmax(np.where(lines, size, -np.inf)))
    return [Defect(what, labels, lines, float(size[worst]), float(axis[worst]))]


def _reciprocity(frf: Frf, square: Sequence[str], noise: float) -> list[Defect]:
    found: list[Defect] = []
    if len(square) < 2:
        return found
    size = reciprocity_defect(frf, square)
    for i, first in enumerate(square):
        for j in range(i + 1, len(square)):
            pair = (first, square[j])
            found += _defect(
                "reciprocity", pair, frf.frequency, size[:, i, j], size[:, i, j] > noise
            )
    return found


def _phase(mobility: Frf, square: Sequence[str], noise: float) -> list[Defect]:
    found: list[Defect] = []
    for label in square:
        drive = mobility.between(label, label)
        size = np.maximum(np.abs(drive), FLOOR * np.abs(drive).max())
        given_out = -drive.real / size
        found += _defect("phase", (label,), mobility.frequency, given_out, given_out > noise)
    return found


def _passivity(mobility: Frf, square: Sequence[str], noise: float) -> list[Defect]:
    if len(square) < 2:
        return []
    size = passivity_defect(mobility, square)
    return _defect("passivity", tuple(square), mobility.frequency, size, size > noise)


def _coherence(frf: Frf, coherence: FloatArray | None) -> list[Defect]:
    found: list[Defect] = []
    if coherence is None:
        return found
    for i, response in enumerate(frf.responses):
        for j, excitation in enumerate(frf.excitations):
            lack = 1 - coherence[:, i, j]
            lines = lack > 1 - FAIR_COHERENCE  # NaN is not
            for one in _defect("coherence", (response, excitation), frf.frequency, lack, lines):
                found.append(Defect(one.what, one.labels, lines, 1 - one.worst, one.at))
    return found


def _mass(mobility: Frf, rigid: Mapping[str, float], below: float, noise: float) -> list[Defect]:
    found: list[Defect] = []
    accelerance = mobility.to("accelerance")
    low = accelerance.frequency <= below
    for label, expected in rigid.items():
        if not low.any() or label not in frf_square(mobility):
            continue
        ratio = np.abs(accelerance.between(label, label)) / expected
        typical = float(np.median(ratio[low]))
        if abs(typical - 1) > 2 * noise:
            at = float(np.median(accelerance.frequency[low]))
            found.append(Defect("mass", (label,), low, typical, at))
    return found


def frf_square(frf: Frf) -> tuple[str, ...]:
    """Return the labels that are both responses and excitations."""
    return tuple(label for label in frf.responses if label in frf.excitations)

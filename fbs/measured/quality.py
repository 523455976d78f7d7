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

from .._kernels.blocks import stretches
from .._kernels.checks import ComplexArray, FloatArray
from ..frf import Frf
from ..second_order_system import SecondOrderSystem, direct_frf
from ..undamped_modes import real_modes

NOISE = 0.05
"""Of the FRF: 3° of phase, five times the scatter of a fair measurement."""

FLOOR = 1e-6
"""Of the largest FRF: 120 dB below it nothing is measured."""

LINES = 256
"""Lines at once: matrices of many DoFs are large."""

STILL = 1e-12
"""Of the largest accelerance: what is below does not move as a rigid body, and is round-off."""

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


@dataclass(frozen=True, eq=False)
class Quality:
    """What is known of a measurement's quality, line by line.

    Attributes
    ----------
    frequency : array, shape (nf,), Hz
        The FRF's lines above 0 Hz.
    square : tuple of str
        DoFs that are both response and excitation.
    reciprocity : array, shape (nf,), or None
        Largest |H_ij − H_ji| / √(h_i h_j) of all pairs; None: there is no pair.
    passivity : array, shape (nf,), or None
        −λ_min / ‖Y‖ of the matrix between `square`; None: it has less than two.
    coherence : array, shape (nf,), or None
        The least of all FRFs; None: none is known.
    rigid : mapping of str to float array, shape (nf,)
        |accelerance| over the rigid body's, NaN where it is none; of the DoFs that have one.
    defects : tuple of Defect
        Everything that does not hold, of the pairs and of the matrix.
    """

    frequency: FloatArray
    square: tuple[str, ...]
    reciprocity: FloatArray | None
    passivity: FloatArray | None
    coherence: FloatArray | None
    rigid: Mapping[str, FloatArray]
    defects: tuple[Defect, ...]

    @property
    def doubtful(self) -> Mask:
        """Lines at which anything does not hold."""
        lines = np.zeros(self.frequency.size, dtype=bool)
        for defect in self.defects:
            lines |= defect.lines
        return lines


def quality(
    frf: Frf,
    coherence: FloatArray | None = None,
    rigid: Mapping[str, FloatArray] | None = None,
    noise: float = NOISE,
) -> Quality:
    """Judge FRFs as those of a passive, reciprocal structure.

    DoFs whose drive points are zero (see `zeros`) are left out.

    Parameters
    ----------
    frf : Frf
        Any quantity; 0 Hz is left out.
    coherence : array, shape of the FRF's values, optional
        NaN where it is not known.
    rigid : mapping of str to array, shape (nf,), optional
        DoF → accelerance of the rigid-body motion at its drive point, 1/kg, NaN where the
        structure is not rigid; see `rigid_accelerance`.
    noise : float
        What is no defect, relative to the size of an FRF.
    """
    kept = frf.frequency > 0
    mobility = frf.band(np.nextafter(0, 1)).to("mobility")
    still, axis = zeros(mobility), mobility.frequency
    square = tuple(label for label in frf_square(mobility) if (label, label) not in still)
    known = None if coherence is None else coherence[kept]
    ratios = _rigid_ratios(mobility, {k: v[kept] for k, v in (rigid or {}).items()})
    pairs = reciprocity_defect(mobility, square) if len(square) > 1 else None
    matrix = passivity_defect(mobility, square) if len(square) > 1 else None
    found = [
        *([] if pairs is None else _reciprocity(axis, pairs, square, noise)),
        *_phase(mobility, square, noise),
        *([] if matrix is None else _defect("passivity", square, axis, matrix, matrix > noise)),
        *([] if known is None else _coherence(mobility, known)),
        *_mass(axis, ratios, noise),
    ]
    return Quality(
        axis,
        square,
        None if pairs is None else pairs.max(axis=(1, 2)),
        matrix,
        None if known is None else np.nanmin(known, axis=(1, 2), initial=1.0),
        ratios,
        tuple(found),
    )


def rigid_accelerance(
    system: SecondOrderSystem, frequency: FloatArray, noise: float = NOISE
) -> dict[str, FloatArray]:
    """Return Σ φ_i² of the rigid-body modes (φᵀ M φ = 1) where the structure moves as a rigid body.

    That is below its first elastic mode, where its own accelerance is within half the noise of it.

    Parameters
    ----------
    system : SecondOrderSystem
        Symmetric.
    frequency : array, shape (nf,), Hz
        Above 0.

    Returns
    -------
    mapping of DoF to array, shape (nf,), 1/kg
        NaN elsewhere; without the DoFs that are rigid at none of the lines.
    """
    modes = real_modes(system)
    elastic = modes.natural_frequencies[modes.n_rigid :]
    low = frequency < (elastic[0] if elastic.size else np.inf)
    if not (modes.n_rigid and low.any()):
        return {}
    rows, factors = system.locate()
    line = (modes.shapes[rows, : modes.n_rigid] ** 2).sum(axis=1) * factors**2
    own = direct_frf(system, frequency[low]).to("accelerance")
    found = {}
    for label, expected in zip(system.labels, line, strict=True):
        if expected <= STILL * line.max():
            continue
        near = np.abs(np.abs(own.between(label, label)) / expected - 1) < noise / 2
        if near.any():
            found[label] = np.full(frequency.size, np.nan)
            found[label][np.flatnonzero(low)[near]] = expected
    return found


def zeros(frf: Frf) -> tuple[tuple[str, str], ...]:
    """Return response and excitation of the FRFs that are zero at every line.

    Such is a dead channel, unless symmetry lets nothing pass.
    """
    still = ~frf.values.any(axis=0)
    return tuple((frf.responses[i], frf.excitations[j]) for i, j in np.argwhere(still))


def reciprocity_defect(frf: Frf, labels: Sequence[str]) -> FloatArray:
    """Return |H_ij − H_ji| / √(h_i h_j), shape (nf, n, n), h the norm of a column of H."""
    values = frf.select(labels, labels).values
    norms = np.linalg.norm(values, axis=2)
    largest = np.max([norms * column[:, None] for column in norms.T], axis=1)
    least = FLOOR * np.sqrt(largest)
    defect = np.zeros(values.shape)
    for lines in stretches(len(values), LINES):
        size = np.sqrt(norms[lines, :, None] * norms[lines, None, :])
        size = np.maximum(size, least)
        difference = np.abs(values[lines] - values[lines].transpose(0, 2, 1))
        np.divide(difference, size, out=defect[lines], where=size > 0)
    return defect


def passivity_defect(frf: Frf, labels: Sequence[str]) -> FloatArray:
    """Return −λ_min / ‖Y‖ of the Hermitian part of the mobility matrix, shape (nf,).

    Its DoFs are scaled to unit drive points first, so that units of the DoFs do not count. 0 is
    passive, 1 gives out all that it moves.
    """
    mobility = frf.to("mobility").select(labels, labels).values
    scale = 1 / np.sqrt(_drive_size(mobility))
    defect = np.empty(len(mobility))
    for lines in stretches(len(mobility), LINES):
        scaled = mobility[lines] * scale[lines, :, None] * scale[lines, None, :]
        hermitian = (scaled + scaled.conj().transpose(0, 2, 1)) / 2
        given_out = np.maximum(-np.linalg.eigvalsh(hermitian)[:, 0], 0)
        active = given_out > 0
        given_out[active] /= np.linalg.norm(scaled[active], ord=2, axis=(1, 2))
        defect[lines] = given_out
    return defect


# --- parts -------------------------------------------------------------------------------------


def _drive_size(values: ComplexArray) -> FloatArray:
    size = np.abs(np.diagonal(values, axis1=1, axis2=2))
    return np.asarray(np.maximum(size, FLOOR * size.max(axis=0)) + np.finfo(float).tiny)


def _defect(
    what: str, labels: tuple[str, ...], axis: FloatArray, size: FloatArray, lines: Mask
) -> list[Defect]:
    if not lines.any():
        return []
    worst = int(np.argmax(np.where(lines, size, -np.inf)))
    return [Defect(what, labels, lines, float(size[worst]), float(axis[worst]))]


def _reciprocity(
    axis: FloatArray, size: FloatArray, square: Sequence[str], noise: float
) -> list[Defect]:
    found: list[Defect] = []
    for i, first in enumerate(square):
        for j in range(i + 1, len(square)):
            pair = (first, square[j])
            found += _defect("reciprocity", pair, axis, size[:, i, j], size[:, i, j] > noise)
    return found


def _phase(mobility: Frf, square: Sequence[str], noise: float) -> list[Defect]:
    found: list[Defect] = []
    for label in square:
        drive = mobility.between(label, label)
        size = np.maximum(np.abs(drive), FLOOR * np.abs(drive).max())
        given_out = -drive.real / size
        found += _defect("phase", (label,), mobility.frequency, given_out, given_out > noise)
    return found


def _coherence(frf: Frf, coherence: FloatArray) -> list[Defect]:
    found: list[Defect] = []
    for i, response in enumerate(frf.responses):
        for j, excitation in enumerate(frf.excitations):
            lack = 1 - coherence[:, i, j]
            lines = lack > 1 - FAIR_COHERENCE  # NaN is not
            for one in _defect("coherence", (response, excitation), frf.frequency, lack, lines):
                found.append(Defect(one.what, one.labels, lines, 1 - one.worst, one.at))
    return found


def _rigid_ratios(mobility: Frf, rigid: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    accelerance, square = mobility.to("accelerance"), frf_square(mobility)
    return {
        label: np.asarray(np.abs(accelerance.between(label, label)) / expected)
        for label, expected in rigid.items()
        if label in square
    }


def _mass(axis: FloatArray, ratios: Mapping[str, FloatArray], noise: float) -> list[Defect]:
    found: list[Defect] = []
    for label, ratio in ratios.items():
        low = np.isfinite(ratio)
        if not low.any():
            continue
        typical = float(np.median(ratio[low]))
        if abs(typical - 1) > 2 * noise:
            found.append(Defect("mass", (label,), low, typical, float(np.median(axis[low]))))
    return found


def frf_square(frf: Frf) -> tuple[str, ...]:
    """Return the labels that are both responses and excitations."""
    return tuple(label for label in frf.responses if label in frf.excitations)

"""Whether FRFs from a file can be a passive structure's: drive points, reciprocity, magnitude."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem, direct_frf
from fbs.measured.quality import passivity_defect, zeros

from ..arrays import FloatArray

NOISE = 0.05  # of the FRF: 3° of phase, five times the scatter of a fair measurement
FLOOR = 1e-6  # of the largest FRF: 120 dB below it nothing is measured
OTHER_UNIT = 100.0  # times the model's FRF: no change of a design, but mm for m is 1000
SHOWN = 3


def implausible(frf: Frf, model: Frf, interface: Sequence[str]) -> tuple[str, ...]:
    """What is odd about the receptances of a part, in words.

    Parameters
    ----------
    frf
        The file's receptances.
    model
        The model's receptances between the interface DoFs, on the same lines.
    interface
        Labels of the interface DoFs.
    """
    found = (
        _active(frf),
        _not_reciprocal(frf, interface),
        _active_matrix(frf, interface),
        _other_unit(frf, model, interface),
    )
    return tuple(warning for warning in found if warning)


def dead(frf: Frf, model: SecondOrderSystem) -> tuple[str, ...]:
    """FRFs of a part that are zero at every line and not in the model, in words."""
    still = zeros(frf)
    if not still:
        return ()
    responses, excitations = (list(dict.fromkeys(labels)) for labels in zip(*still, strict=True))
    by_symmetry = zeros(direct_frf(model, frf.frequency, responses, excitations))
    found = [pair for pair in still if pair not in by_symmetry]
    return (f"zero at every line, a dead channel? {_some(channels(frf, found))}",) if found else ()


def channels(frf: Frf, pairs: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Names for some FRFs: of a whole response or excitation, or one by one."""
    of = frozenset(pairs)
    rows = [i for i in frf.responses if all((i, j) in of for j in frf.excitations)]
    columns = [j for j in frf.excitations if all((i, j) in of for i in frf.responses)]
    return (
        *(f"response {i}" for i in rows),
        *(f"excitation {j}" for j in columns),
        *(f"{i} ← {j}" for i, j in pairs if i not in rows and j not in columns),
    )


def _active(frf: Frf) -> str:
    """Drive points with Re(jωH) < 0: they put out energy."""
    found = []
    for dof in square_labels(frf):
        mobility = 1j * frf.omega * frf.between(dof, dof)
        size = np.abs(mobility)
        wrong = mobility.real < -(NOISE * size + FLOOR * size.max())
        if wrong.any():
            found.append(f"{dof} {where(frf.frequency, wrong)}")
    if not found:
        return ""
    return f"not passive, Re(mobility) < −{100 * NOISE:g} % of it at a drive point: {_some(found)}"


def _not_reciprocal(frf: Frf, interface: Sequence[str]) -> str:
    """Pairs with |H_ij − H_ji| beyond noise of √(h_i h_j), one of them an interface DoF."""
    found = []
    labels = square_labels(frf)
    norms = np.linalg.norm(frf.select(labels, labels).values, axis=2)
    norm = dict(zip(labels, norms.T, strict=True))
    for n, first in enumerate(labels):
        for second in labels[n + 1 :]:
            if first not in interface and second not in interface:
                continue
            size = np.sqrt(norm[first] * norm[second])
            defect = np.abs(frf.between(first, second) - frf.between(second, first))
            wrong = defect > NOISE * size + FLOOR * size.max()
            if wrong.any():
                found.append(f"{first} and {second} {where(frf.frequency, wrong)}")
    if not found:
        return ""
    return f"not reciprocal, |H_ij − H_ji| beyond {100 * NOISE:g} % of √(h_i h_j): {_some(found)}"


def _active_matrix(frf: Frf, interface: Sequence[str]) -> str:
    """An interface matrix that puts out energy, though each of its drive points may not."""
    still = zeros(frf)
    labels = [
        label for label in interface if label in square_labels(frf) and (label, label) not in still
    ]
    if len(labels) < 2:
        return ""
    defect = passivity_defect(frf, labels)
    wrong = defect > NOISE
    if not wrong.any():
        return ""
    return (
        f"not passive as a matrix between {_some(labels, ', ')}, down to −{defect.max():.0%} of "
        f"its norm {where(frf.frequency, wrong)}"
    )


def _other_unit(frf: Frf, model: Frf, interface: Sequence[str]) -> str:
    """Interface drive points that are orders of magnitude off the model's."""
    found = []
    for dof in interface:
        file, own = (np.median(np.abs(h.between(dof, dof))) for h in (frf, model))
        if not own / OTHER_UNIT <= file <= own * OTHER_UNIT:
            found.append(f"{dof} is typically {file / own:.2g} times the model's")
    if not found:
        return ""
    return f"another unit or quantity? As receptance in m/N, the drive point {_some(found)}"


def square_labels(frf: Frf) -> tuple[str, ...]:
    """Labels that are both responses and excitations."""
    return tuple(label for label in frf.responses if label in frf.excitations)


def where(frequency: FloatArray, lines: NDArray[np.bool_]) -> str:
    """The lines of a mask in words: how many, and in which bands."""
    edges = np.flatnonzero(np.diff(lines.astype(int), prepend=0, append=0))
    starts, stops = frequency[edges[::2]], frequency[edges[1::2] - 1]
    bands = [
        f"{a:.6g} Hz" if a == b else f"{a:.6g}–{b:.6g} Hz"
        for a, b in zip(starts, stops, strict=True)
    ]
    return f"at {int(lines.sum())} of {len(lines)} lines ({_some(bands, ', ')})"


def _some(found: Sequence[str], separator: str = "; ") -> str:
    more = len(found) - SHOWN
    shown = separator.join(found[:SHOWN])
    return f"{shown} and {more} more" if more > 0 else shown

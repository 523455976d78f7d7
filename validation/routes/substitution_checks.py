"""Whether FRFs from a file can be a passive structure's: what is found, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fbs import Frf, SecondOrderSystem, direct_frf
from fbs.files.measurement import few
from fbs.measured.quality import NOISE, Defect, Quality, passivity_defect, zeros

from ..arrays import FloatArray

OTHER_UNIT = 100.0  # times the model's FRF: no change of a design, but mm for m is 1000
SHOWN = 3


def implausible(found: Quality, frf: Frf, model: Frf, interface: Sequence[str]) -> tuple[str, ...]:
    """What is odd about the receptances of a part where it is coupled, in words.

    Parameters
    ----------
    found
        Their quality.
    frf
        The file's receptances.
    model
        The model's receptances between the interface DoFs, on the same lines.
    interface
        Labels of the interface DoFs.
    """
    warnings = (
        _defects(
            found,
            "phase",
            f"not passive, Re(mobility) < −{100 * NOISE:g} % of it at a drive point",
            found.square,
        ),
        _defects(
            found,
            "reciprocity",
            f"not reciprocal, |H_ij − H_ji| beyond {100 * NOISE:g} % of √(h_i h_j)",
            interface,
        ),
        _active_matrix(frf, interface),
        _other_unit(frf, model, interface),
    )
    return tuple(warning for warning in warnings if warning)


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


def _defects(found: Quality, what: str, words: str, labels: Sequence[str]) -> str:
    """The defects of a kind at any of the labels."""
    concerned = [d for d in found.defects if d.what == what and set(d.labels) & set(labels)]
    if not concerned:
        return ""
    places = [f"{' and '.join(d.labels)} {where(found.frequency, d.lines)}" for d in concerned]
    return f"{words}: {_some(places)}"


def _active_matrix(frf: Frf, interface: Sequence[str]) -> str:
    """An interface matrix that puts out energy, though each of its drive points may not."""
    still = zeros(frf)
    interface = [label for label in interface if (label, label) not in still]
    if len(interface) < 2:
        return ""
    defect = passivity_defect(frf, interface)
    wrong = defect > NOISE
    if not wrong.any():
        return ""
    return (
        f"not passive as a matrix between {_some(interface, ', ')}, down to −{defect.max():.0%} of "
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


def describe(defect: Defect, frequency: FloatArray) -> str:
    """A defect in words, with its bands."""
    bands = where(frequency, defect.lines)
    labels = few(defect.labels)
    at = f"{defect.at:.6g} Hz"
    return {
        "reciprocity": f"not reciprocal: {labels} differ by {defect.worst:.1%} at {at}, {bands}",
        "passivity": f"not passive as a matrix: λ_min = −{defect.worst:.1%} at {at}, {bands}",
        "phase": f"drive point {labels}: mobility's phase beyond ±90°, worst at {at}, {bands}",
        "coherence": f"coherence of {labels} down to {defect.worst:.2f} at {at}, {bands}",
        "mass": f"{labels}: {defect.worst:.3g} times the rigid body's accelerance, {bands}",
    }[defect.what]


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

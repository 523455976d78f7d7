"""What a difference of two routes' FRFs is: entries of M, C, K and their share, or none of these.

A statement is believed by what it explains: it is made of the reference, and what is then left of
the difference counts. Simple slips come first, since a fit of M, C, K to them would be nonsense.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations

import numpy as np

from ..arrays import ComplexArray, FloatArray
from .diagnosis import EntryDifference, describe, locate, number

EXPLAINED = 0.99  # of the scaled difference's mean square
NEIGHBOURS = 1e-4  # of a line's error: a change of M, C, K is no such spike, even at a pole
PATTERN = 0.999  # of the difference, in one pattern that is the same at all lines
SUSPECTS = 6  # DoFs, of which an exchange or a sign changes one or two
NO_CHANGE = "not a change of M, C, K"


def traced(
    frequency: FloatArray,
    reference: ComplexArray,
    other: ComplexArray,
    round_off: FloatArray,
    dofs: Sequence[str],
) -> tuple[str, ...]:
    """What the difference is, in words.

    Parameters
    ----------
    frequency
        (n_frequency,) Hz, a few lines over the band.
    reference, other
        (n_frequency, n, n) receptances of all independent DoFs.
    round_off
        (n_frequency, n, n) of both.
    dofs
        Their labels.
    """
    rows = np.sum(np.abs(other - reference) ** 2 / np.abs(reference).max() ** 2, axis=(0, 2))
    suspects = np.argsort(-rows)[:SUSPECTS].tolist()
    for words, slip in slips(dofs, suspects):
        if explained(reference, other, slip(reference)) > EXPLAINED:
            return (f"{NO_CHANGE}: {words}",)
    try:
        found = locate(frequency, reference, other, round_off, dofs)
    except np.linalg.LinAlgError:
        return ("not traced to entries of M, C, K: the FRFs of all DoFs have no inverse",)
    if not found:
        return ("no entry of M, C or K stands out of round-off",)
    share = explained(reference, other, changed(frequency, reference, found, dofs))
    if share > EXPLAINED:
        return (*describe(found), f"this explains {percent(share)} of the difference")
    return (_pattern(frequency, other - reference, dofs), *describe(found[:1]))


def single_lines(frequency: FloatArray, line_max: FloatArray) -> FloatArray:
    """Lines (Hz) that alone differ: their neighbours have less than `NEIGHBOURS` of their error."""
    around = np.maximum(
        np.concatenate([[0.0], line_max[:-1]]), np.concatenate([line_max[1:], [0.0]])
    )
    spikes = frequency[around < NEIGHBOURS * line_max]
    return np.asarray(spikes if len(line_max) > 2 else spikes[:0])


def percent(share: float) -> str:
    """A share that is said to be all only where it is."""
    return f"{100.0 * share:.4g} %" if share < 0.99995 else "all but round-off"


def explained(reference: ComplexArray, other: ComplexArray, stated: ComplexArray) -> float:
    """1 − Σ|other − stated|²/Σ|other − reference|², each entry over √(h_i h_j) of its line."""
    size = np.sqrt(np.sum(np.abs(reference) ** 2, axis=2))
    scale = size[:, :, None] * size[:, None, :]
    before, after = (np.sum(np.abs(other - each) ** 2 / scale) for each in (reference, stated))
    return float(1.0 - after / before) if before > 0.0 else 0.0


def slips(
    dofs: Sequence[str], suspects: Sequence[int]
) -> Iterator[tuple[str, Callable[[ComplexArray], ComplexArray]]]:
    """Statements that are no change of the system, and what they make of its FRFs.

    Signs and exchanges are those of ``suspects``, the DoFs whose FRFs differ most.
    """
    yield "all FRFs are the conjugates, as for e^{−jωt}", np.conj
    yield "all signs are reversed", np.negative
    yield "the labels of the responses are shifted by one", lambda h: np.roll(h, 1, axis=1)
    for k in suspects:
        yield f"{dofs[k]} counts the other way", lambda h, k=k: _reversed(h, k)  # type: ignore[misc]
    for i, j in combinations(sorted(suspects), 2):
        yield f"{dofs[i]} and {dofs[j]} are exchanged", lambda h, i=i, j=j: _exchanged(h, i, j)  # type: ignore[misc]


def _reversed(h: ComplexArray, k: int) -> ComplexArray:
    signs = np.where(np.arange(h.shape[1]) == k, -1.0, 1.0)
    return np.asarray(h * np.outer(signs, signs))


def _exchanged(h: ComplexArray, i: int, j: int) -> ComplexArray:
    order = np.arange(h.shape[1])
    order[[i, j]] = j, i
    return np.asarray(h[:, order][:, :, order])


def changed(
    frequency: FloatArray,
    reference: ComplexArray,
    entries: Sequence[EntryDifference],
    dofs: Sequence[str],
) -> ComplexArray:
    """FRFs where entries of M, C, K are as found: (I + H ΔZ)⁻¹ H."""
    omega = 2.0 * np.pi * frequency
    weight = {"stiffness": np.ones_like(omega), "damping": 1j * omega, "mass": -(omega**2)}
    difference = np.zeros_like(reference)
    for entry in entries:
        i, j = dofs.index(entry.row), dofs.index(entry.column)
        value = weight[entry.matrix] * (entry.other - entry.reference)
        difference[:, i, j] += value
        if i != j:
            difference[:, j, i] += value
    return np.asarray(np.linalg.solve(np.eye(len(dofs)) + reference @ difference, reference))


def _pattern(frequency: FloatArray, difference: ComplexArray, dofs: Sequence[str]) -> str:
    """One pattern at all lines is a factor, or a mode's share; else nothing is said."""
    flat = difference.reshape(len(frequency), -1)
    over_lines, sizes, patterns = np.linalg.svd(flat, full_matrices=False)
    if sizes[0] ** 2 < PATTERN * np.sum(sizes**2):
        return f"{NO_CHANGE} that is the same at all lines; nearest to it:"
    i, j = divmod(int(np.argmax(np.abs(patterns[0]))), len(dofs))
    at = frequency[int(np.argmax(np.abs(over_lines[:, 0])))]
    return (
        f"{NO_CHANGE}: one pattern at all lines, as a mode's residue is, largest at {dofs[i]} ← "
        f"{dofs[j]} and at {number(float(at))} Hz; nearest change:"
    )

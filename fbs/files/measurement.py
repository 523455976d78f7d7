"""What is taken from a file of many functions: a complete block of FRFs, of one run or of all.

A measurement's file also holds other references, microphones, coherences, repeated runs. Taken is
the largest block in which every response is there for every excitation; all else is listed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .._kernels.checks import ComplexArray, FloatArray
from ..axes import require_same_frequency
from ..errors import FbsError, QuantityMismatchError
from ..frf import Frf, Quantity

Pair = tuple[str, str]
SHOWN = 5


@dataclass(frozen=True)
class Given:
    """What the user says about a file: its quantity, its units, and which run is meant.

    Attributes
    ----------
    quantity : Quantity or None
        Of functions whose data types do not say it.
    units : tuple of str
        Such as "m/s^2/N" and "rad/s^2/(N m)"; the one of a function's dimension counts.
    run : int or None
        Of several complete ones, from 1 on; None: their mean.
    """

    quantity: Quantity | None = None
    units: tuple[str, ...] = ()
    run: int | None = None


AS_STATED = Given()
"""The file says it all."""


@dataclass(frozen=True, eq=False)
class Measured:
    """One FRF: values (nf,), m or rad per N or N m, as `angle` and `moment` say."""

    response: str
    excitation: str
    quantity: Quantity
    frequency: FloatArray
    values: ComplexArray
    angle: bool = False
    moment: bool = False
    note: str = ""

    def __str__(self) -> str:
        return f"the FRF from {self.excitation!r} to {self.response!r}"


@dataclass(frozen=True, eq=False)
class Candidate:
    """An FRF of a file, brought to SI only when it is taken."""

    response: str
    excitation: str
    measured: Callable[[], Measured]

    @property
    def pair(self) -> Pair:
        """Response and excitation."""
        return self.response, self.excitation


@dataclass(frozen=True, eq=False)
class Contents:
    """What a file of FRFs holds.

    Parameters
    ----------
    candidates : tuple of Candidate
        In the order of the file; a pair stands there once for every run.
    coherences : mapping
        (response, excitation) → arrays (nf,), one for every run.
    averages : mapping of str to int
        Excitation → of how many averages its coherences are, where the file says it.
    others : tuple of str
        What else is there, in words.
    notes : tuple of str
    """

    candidates: tuple[Candidate, ...]
    coherences: Mapping[Pair, Sequence[FloatArray]] = field(default_factory=dict)
    averages: Mapping[str, int] = field(default_factory=dict)
    others: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Measurement:
    """FRFs from a file, with what is known of them.

    Parameters
    ----------
    frf : Frf
        In SI. Between labels that are angles or moments: rad and N m.
    angles, moments : frozenset of str
        Responses in rad, excitations in N m.
    notes : tuple of str
        What was left out, averaged or assumed.
    repeats : tuple of Frf
        The runs whose mean `frf` is; empty if there is one.
    coherence : array, shape of the FRF's values, or None
        NaN where the file has none.
    averages : int or None
        Of how many averages the coherence is, at least; None: the file does not say it.
    """

    frf: Frf
    angles: frozenset[str] = frozenset()
    moments: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()
    repeats: tuple[Frf, ...] = ()
    coherence: FloatArray | None = None
    averages: int | None = None


def take(
    contents: Contents,
    responses: Sequence[str] | None = None,
    excitations: Sequence[str] | None = None,
    run: int | None = None,
) -> Measurement:
    """Take the complete block between the labels wanted, and list what of them is left out.

    Parameters
    ----------
    contents : Contents
    responses, excitations : labels, optional
        Those wanted, as far as the file has them; None: all.
    run : int, optional
        Which of several complete runs, from 1 on; None: their mean.

    Raises
    ------
    FbsError
        None of them is there, a run that is not there, or FRFs of a block that do not fit together.
    """
    chosen = [
        c
        for c in contents.candidates
        if (responses is None or c.response in responses)
        and (excitations is None or c.excitation in excitations)
    ]
    if not chosen:
        raise FbsError(f"it has no FRF between the DoFs wanted; it has {_pairs(contents)}")
    rows, columns = complete_block([c.pair for c in chosen])
    inside = [c for c in chosen if c.response in rows and c.excitation in columns]
    counts = Counter(c.pair for c in inside)
    n_runs = min(counts.values())
    if run is not None and not 1 <= run <= n_runs:
        raise FbsError(f"run {run} was asked for; the complete runs are 1 to {n_runs}")
    numbers = range(n_runs) if run is None else [run - 1]
    occurrences: dict[Pair, list[Candidate]] = {}
    for candidate in inside:
        occurrences.setdefault(candidate.pair, []).append(candidate)
    runs = [
        [occurrences[r, e][number].measured() for e in columns for r in rows] for number in numbers
    ]
    notes = [*contents.notes, *_left_out(contents, chosen, rows, columns, counts, n_runs)]
    return _measurement(contents, runs, (rows, columns), numbers, n_runs, notes)


def complete_block(found: Iterable[Pair]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return responses and excitations of a block in which no pair is missing.

    While one is, the row or column that lacks the largest share of its pairs is left out, of
    equal ones the last. Labels keep their order.
    """
    pairs = dict.fromkeys(found)
    rows, columns = (
        list(dict.fromkeys(r for r, _ in pairs)),
        list(dict.fromkeys(e for _, e in pairs)),
    )
    while True:
        lacking = [
            *((sum((r, e) not in pairs for e in columns) / len(columns), 0, r) for r in rows),
            *((sum((r, e) not in pairs for r in rows) / len(rows), 1, e) for e in columns),
        ]
        share, side, label = max(reversed(lacking), key=lambda one: one[0])
        if share == 0:
            return tuple(rows), tuple(columns)
        (rows, columns)[side].remove(label)


def _measurement(
    contents: Contents,
    runs: Sequence[Sequence[Measured]],
    block: tuple[tuple[str, ...], tuple[str, ...]],
    numbers: Sequence[int],
    n_runs: int,
    notes: list[str],
) -> Measurement:
    first, columns = runs[0][0], block[1]
    for one in (one for run in runs for one in run):
        _require_alike(first, one)
    angles, moments = (_rotations(runs, side) for side in ("response", "excitation"))
    axis, keep = first.frequency, slice(None)
    if axis[0] == 0.0 and any(not np.isfinite(one.values[0]) for run in runs for one in run):
        notes.append("its line at 0 Hz holds no numbers and is left out")
        keep = slice(1, None)
    frfs = [_frf(run, block, axis[keep], keep) for run in runs]
    if n_runs > 1:
        which = f"run {numbers[0] + 1} is taken" if len(runs) == 1 else "their mean is taken"
        notes.append(f"it holds {n_runs} complete runs: {which}")
    if len(frfs) > 1 and all(np.array_equal(frfs[0].values, one.values) for one in frfs[1:]):
        notes.append("they are one run written several times: nothing is known of their scatter")
        frfs = frfs[:1]
    notes += dict.fromkeys(one.note for run in runs for one in run if one.note)
    return Measurement(
        _mean(frfs),
        angles,
        moments,
        tuple(notes),
        tuple(frfs) if len(frfs) > 1 else (),
        _coherence(contents, block, numbers, axis, keep),
        min(contents.averages[e] for e in columns)
        if set(columns) <= set(contents.averages)
        else None,
    )


def _require_alike(first: Measured, one: Measured) -> None:
    if one.quantity != first.quantity:
        raise QuantityMismatchError(f"{first} is {first.quantity}, {one} is {one.quantity}")
    require_same_frequency(
        first.frequency, one.frequency, f"the axes of {first} and of {one} differ"
    )


def _rotations(runs: Sequence[Sequence[Measured]], side: str) -> frozenset[str]:
    """Labels of angles (or moments); one label cannot be both."""
    what = "angle" if side == "response" else "moment"
    found: dict[str, bool] = {}
    for one in (one for run in runs for one in run):
        label, is_so = getattr(one, side), getattr(one, what)
        if found.setdefault(label, is_so) != is_so:
            raise FbsError(f"the {side} {label!r} is in units of a rotation and of a translation")
    return frozenset(label for label, is_so in found.items() if is_so)


def _frf(
    run: Sequence[Measured],
    block: tuple[tuple[str, ...], tuple[str, ...]],
    axis: FloatArray,
    keep: slice,
) -> Frf:
    rows, columns = block
    values = np.empty((len(rows), len(columns), axis.size), dtype=complex)
    for number, one in enumerate(run):
        values[number % len(rows), number // len(rows)] = one.values[keep]
    return Frf(axis, values.transpose(2, 0, 1), rows, columns, run[0].quantity)


def _mean(frfs: Sequence[Frf]) -> Frf:
    total = frfs[0]
    for frf in frfs[1:]:
        total = total + frf
    return total if len(frfs) == 1 else total * (1 / len(frfs))


def _coherence(
    contents: Contents,
    block: tuple[tuple[str, ...], tuple[str, ...]],
    numbers: Sequence[int],
    axis: FloatArray,
    keep: slice,
) -> FloatArray | None:
    rows, columns = block
    found = np.full((axis[keep].size if axis.size else 0, len(rows), len(columns)), np.nan)
    for i, response in enumerate(rows):
        for j, excitation in enumerate(columns):
            runs = contents.coherences.get((response, excitation), ())
            usable = [runs[n] for n in numbers if n < len(runs) and runs[n].size >= axis.size]
            if usable:
                found[:, i, j] = np.mean([one[-axis.size :][keep] for one in usable], axis=0)
    return None if np.isnan(found).all() else found


def _left_out(
    contents: Contents,
    chosen: Sequence[Candidate],
    rows: Sequence[str],
    columns: Sequence[str],
    counts: Mapping[Pair, int],
    n_runs: int,
) -> list[str]:
    notes = [f"left out: {words}" for words in contents.others]
    for what, labels, taken in (
        ("responses", [c.response for c in chosen], rows),
        ("references", [c.excitation for c in chosen], columns),
    ):
        out = [label for label in dict.fromkeys(labels) if label not in taken]
        if out:
            notes.append(f"left out: the {what} {few(out)}")
    surplus = {pair: n - n_runs for pair, n in counts.items() if n > n_runs}
    if surplus:
        notes.append(
            f"left out: {sum(surplus.values())} FRFs of runs that are not complete "
            f"({few([f'{e} to {r}' for r, e in surplus])})"
        )
    return notes


def few(labels: Sequence[str], limit: int = SHOWN) -> str:
    """List the first labels, and how many more there are."""
    more = len(labels) - limit
    return ", ".join(labels[:limit]) + (f" and {more} more" if more > 0 else "")


def _pairs(contents: Contents) -> str:
    pairs = dict.fromkeys(c.pair for c in contents.candidates)
    return few([f"{e!r} to {r!r}" for r, e in pairs]) or "none at all"

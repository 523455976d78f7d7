"""The FRFs of an assembly, written row by row from its parts' and the joint forces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ._kernels.blocks import SPAN, each, stretches
from ._kernels.checks import ComplexArray, FloatArray, positions, unique_labels
from ._kernels.finite import square_sum, surely_finite
from .frf import Frf

Values = ComplexArray | FloatArray

LINES = 1024
"""Lines of a span, at least."""

COLUMNS = 2**20
"""Bytes of FRFs at once, over all lines of a span: written in one run and still in the cache."""


class End(NamedTuple):
    """An entry of B: 1 or -ratio, in the row of a joint, at a response and excitation."""

    joint: int
    response: int
    excitation: int
    sign: float


class Columns(NamedTuple):
    """Excitations of the assembly, and the same ones in a substructure; None: another's."""

    place: slice
    own: slice | None

    def joined(self, after: Columns) -> Columns | None:
        """Return this run and the next as one, if they are one."""
        place = slice(self.place.start, after.place.stop)
        if self.own is None and after.own is None:
            return Columns(place, None)
        if self.own is None or after.own is None or self.own.stop != after.own.start:
            return None
        return Columns(place, slice(self.own.start, after.own.stop))

    def pieces(self, step: int) -> Iterator[Columns]:
        """Cut the run into pieces of `step`."""
        for piece in stretches(self.place.stop - self.place.start, step):
            own = None if self.own is None else _shifted(piece, self.own.start)
            yield Columns(_shifted(piece, self.place.start), own)


def _shifted(piece: slice, by: int) -> slice:
    return slice(piece.start + by, piece.stop + by)


@dataclass(frozen=True, eq=False)
class Layout:
    """Labels of what is asked for, and where they stand in the substructures.

    rows[i] : (substructure, its response) of response i
    columns[name] : runs of all excitations of the assembly, and those of the substructure that
        they are; None where they are another's
    """

    responses: tuple[str, ...]
    excitations: tuple[str, ...]
    rows: tuple[tuple[str, int], ...]
    columns: dict[str, list[Columns]]

    @classmethod
    def of(
        cls,
        substructures: Mapping[str, Frf],
        responses: Iterable[str] | None,
        excitations: Iterable[str] | None,
    ) -> Layout:
        rows = owners({name: frf.responses for name, frf in substructures.items()})
        columns = owners({name: frf.excitations for name, frf in substructures.items()})
        wanted = tuple(rows) if responses is None else unique_labels(responses, "the responses")
        driven = (
            tuple(columns) if excitations is None else unique_labels(excitations, "the excitations")
        )
        positions(wanted, tuple(rows), "the assembly's responses")
        positions(driven, tuple(columns), "the assembly's excitations")
        places = [columns[label] for label in driven]
        return cls(
            wanted,
            driven,
            tuple(rows[label] for label in wanted),
            {name: runs(name, places) for name in substructures},
        )


def owners(labels: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, int]]:
    """Return the first substructure that has each label, and where."""
    owners: dict[str, tuple[str, int]] = {}
    for name, own in labels.items():
        for position, label in enumerate(own):
            owners.setdefault(label, (name, position))
    return owners


def runs(name: str, places: Sequence[tuple[str, int]]) -> list[Columns]:
    """Cut the excitations into runs that are contiguous on both sides, or another's."""
    found: list[Columns] = []
    for place, (owner, position) in enumerate(places):
        own = slice(position, position + 1) if owner == name else None
        run = Columns(slice(place, place + 1), own)
        joined = found[-1].joined(run) if found else None
        if joined is None:
            found.append(run)
        else:
            found[-1] = joined
    return found


def assemble(
    layout: Layout,
    substructures: Mapping[str, ComplexArray],
    ends: Mapping[str, list[End]],
    inverse: ComplexArray,
) -> tuple[ComplexArray, bool]:
    """Return Y - (Y B^T) (kernel^-1 B Y), (n_response, n_excitation, nf), and if it is finite."""
    count, nf = inverse.shape[0], inverse.shape[2]
    values = np.empty((len(layout.responses), len(layout.excitations), nf), dtype=complex)
    scattered = any(frf.strides[2] != frf.itemsize for frf in substructures.values())
    doubtful: list[int] = []
    for lines in stretches(nf, _span(len(layout.responses), count, nf, scattered)):
        frfs = {
            name: np.ascontiguousarray(frf[:, :, lines])
            if frf.strides[2] != frf.itemsize
            else frf[:, :, lines]
            for name, frf in substructures.items()
        }
        forces = _forces(layout, ends, frfs, inverse[:, :, lines])
        part = values[:, :, lines]
        rows = _Rows(part, layout, ends, frfs, forces, square_sum(forces), doubtful)
        each(rows.fill, range(len(values)), part.nbytes)
    return values, not doubtful


def _span(n_responses: int, n_joints: int, nf: int, scattered: bool) -> int:
    """Lines assembled in one go: copies of `scattered` FRFs, and the forces, stay small."""
    share = n_responses / max(1, n_joints)
    return min(SPAN, max(LINES, int(nf / 8 * min(share, 1 if scattered else share))))


def _forces(
    layout: Layout,
    ends: Mapping[str, list[End]],
    frfs: Mapping[str, ComplexArray],
    inverse: ComplexArray,
) -> ComplexArray:
    """Return minus the joint forces per unit excitation, shape (nj, n_excitation, nf)."""
    count, nf = inverse.shape[0], inverse.shape[2]
    forces = np.empty((count, len(layout.excitations), nf), dtype=complex)
    tasks = [
        (k, name, run)
        for name, runs in layout.columns.items()
        for whole in runs
        for run in whole.pieces(max(1, COLUMNS // (16 * nf)))
        if run.own is not None
        for k in range(count)
    ]

    def fill(task: tuple[int, str, Columns]) -> None:
        k, name, run = task
        out = forces[k, run.place]
        if not ends[name]:
            out[:] = 0.0
        for position, end in enumerate(ends[name]):
            gain = -end.sign * inverse[k, end.joint]
            if position == 0:
                np.multiply(frfs[name][end.response, run.own], gain, out=out)
            else:
                out += frfs[name][end.response, run.own] * gain

    each(fill, tasks, forces.nbytes)
    return forces


@dataclass(frozen=True, eq=False)
class _Rows:
    """What the rows of Y_c over a span of lines are made of.

    `force_squares` : sum of |forces|^2; `doubtful` : rows that may be infinite; `spare` : memory
    that a row is done with and the next one takes over, since it is not fresh.
    """

    values: ComplexArray
    layout: Layout
    ends: Mapping[str, list[End]]
    frfs: Mapping[str, ComplexArray]
    forces: ComplexArray
    force_squares: float
    doubtful: list[int]
    spare: list[ComplexArray] = field(default_factory=list)

    def fill(self, row: int) -> None:
        """Write one response of Y_c, a few whole columns at a time."""
        name, own = self.layout.rows[row]
        frf = self.frfs[name][own]
        gains = [(end.joint, end.sign * frf[end.excitation]) for end in self.ends[name]]
        # |sum g f|^2 <= sum |g|^2 sum |f|^2: a product of two such sums that is finite leaves no
        # room for more, and what consists of products only need not be read again
        bounded = np.isfinite(self.force_squares * sum(square_sum(gain) for _, gain in gains))
        n_lines = self.values.shape[2]
        step = max(1, COLUMNS // (16 * n_lines))
        scratch = self.spare.pop() if self.spare else np.empty((step, n_lines), dtype=complex)
        for run in self.layout.columns[name]:
            for place, same in run.pieces(step):
                out = self.values[row, place]
                base = None if same is None else frf[same]
                terms = [(self.forces[joint, place], gain) for joint, gain in gains]
                add_up(out, base, terms, scratch[: len(out)])
                if not (bounded and base is None) and not surely_finite(out):
                    self.doubtful.append(row)
        self.spare.append(scratch)


def add_up(
    out: Values, base: Values | None, terms: Sequence[tuple[Values, Values]], scratch: Values
) -> None:
    """Write base + sum of forces times gain, touching `out` as seldom as may be."""
    for forces, gain in terms:
        if base is None:
            np.multiply(forces, gain, out=out)
        else:
            np.multiply(forces, gain, out=scratch)
            np.add(base, scratch, out=out)
        base = out
    if not terms:
        out[:] = 0.0 if base is None else base

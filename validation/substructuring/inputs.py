"""What the commands read: files of FRFs, pairs of DoFs, joints."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fbs import FbsError, Frf, StiffnessTable
from fbs.axes import require_same_frequency
from fbs.files.channel_map import channels_of
from fbs.files.measurement import few
from fbs.measured.quality import quality
from fbs.measured.resampling import overlap
from fbs.measured.uncertainty import Scatter

from ..checks.part_uncertainty import Noise
from ..errors import CommandError, require_frequencies
from ..routes import frf_input
from ..routes.frf_input import FileOptions
from ..routes.substitution_checks import describe

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Part:
    """FRFs from a file.

    Attributes
    ----------
    name
        What the command calls it: A, B or AB.
    path
        The file.
    frf
        Its receptances above 0 Hz.
    quality
        What a passive, reciprocal structure does not have.
    notes
        What was left out, averaged or assumed.
    repeats
        The runs whose mean ``frf`` is.
    """

    name: str
    path: Path
    frf: Frf
    quality: tuple[str, ...]
    notes: tuple[str, ...]
    repeats: tuple[Frf, ...] = ()

    def scatter(self, noise: Noise | None) -> Scatter | None:
        """Of its FRFs: the noise stated, else that of its runs, else none."""
        if noise is not None:
            return Scatter.relative(self.frf, noise.amplitude, noise.phase)
        return Scatter.of_repeats(self.repeats) if len(self.repeats) > 1 else None

    def renamed(self, names: dict[str, str]) -> Part:
        """With labels replaced."""
        own = {old: new for old, new in names.items() if old in labels(self.frf)}
        repeats = tuple(frf.renamed(own) for frf in self.repeats)
        return replace(self, frf=self.frf.renamed(own), repeats=repeats)


def labels(frf: Frf) -> tuple[str, ...]:
    """All of its labels."""
    return tuple(dict.fromkeys((*frf.responses, *frf.excitations)))


def read_parts(
    paths: dict[str, Path], options: FileOptions, fmin: float | None, fmax: float | None
) -> dict[str, Part]:
    """Read the files, by the names the command gives them.

    Raises
    ------
    CommandError
        A file that does not fit; the message begins with its path.
    """
    require_frequencies(fmin=fmin, fmax=fmax)
    parts = {name: _read(name, path, options, fmin, fmax) for name, path in paths.items()}
    first, *others = parts.values()
    for other in others:
        _require_same_lines(first, other)
    return parts


def _require_same_lines(first: Part, other: Part) -> None:
    own, theirs = first.frf.frequency, other.frf.frequency
    try:
        require_same_frequency(
            own, theirs, f"{other.path}: its lines are not those of {first.path}"
        )
    except FbsError as error:
        raise CommandError(
            f"{error}; {overlap(own, theirs)} (--fmin and --fmax cut them)"
        ) from error


def _read(
    name: str, path: Path, options: FileOptions, fmin: float | None, fmax: float | None
) -> Part:
    contents = frf_input.contents(path, options)
    wanted = None
    if options.channel_map is not None:  # one map for all files: what this one has of it
        own = frf_input.labels(contents)
        sides = (options.channel_map.responses, options.channel_map.excitations)
        wanted = [
            dof
            for dof in dict.fromkeys(dof for side in sides for dof in side)
            if all(
                channel in own
                for side in sides
                if dof in side
                for channel in channels_of({dof: side[dof]})
            )
        ]
        if not wanted:
            raise CommandError(f"{path}: has the channels of no DoF in the map; it has {few(own)}")
    found = frf_input.measured(path, contents, wanted, {}, options)
    low = max(fmin or 0.0, math.nextafter(0.0, 1.0))
    with frf_input.naming(path):
        frf, *repeats = (
            one.band(low, math.inf if fmax is None else fmax).to("receptance")
            for one in (found.frf, *found.repeats)
        )
    doubts = tuple(describe(defect, frf.frequency) for defect in quality(frf).defects)
    notes = list(found.notes)
    if found.frf.frequency[0] == 0.0:
        notes.append("its line at 0 Hz is left out: what is free to move has no FRF there")
    return Part(name, path, frf, doubts, tuple(notes), tuple(repeats))


def parse_pairs(option: str, given: Sequence[str] | None) -> tuple[Pair, ...]:
    """Pairs of DoFs, as ``a.x=b.y``, or ``x`` for ``x=x``; repeated, or separated by commas.

    Raises
    ------
    CommandError
    """
    pairs = []
    for item in (piece.strip() for text in given or () for piece in text.split(",")):
        first, sign, second = (word.strip() for word in item.partition("="))
        if not first or (sign and not second):
            raise CommandError(
                f"{option} = {item!r}: give DoFs of the two files, such as a.x=b.y, or one name if "
                "both have it"
            )
        pairs.append((first, second or first))
    for side in zip(*pairs, strict=True) if pairs else ():
        for label in side:
            if side.count(label) > 1:
                raise CommandError(f"{option}: names {label!r} more than once")
    return tuple(pairs)


@dataclass(frozen=True, eq=False)
class JointOption:
    """What ``--joint`` says: k and c, or a table; without it the joint is rigid."""

    stiffness: complex | StiffnessTable | None = None
    damping: float = 0.0
    words: str = "rigid"


RIGID = JointOption()


def parse_joint(text: str | None) -> JointOption:
    """``1e6``, ``1e6,10`` (N/m, N s/m), ``1e6+5e4j``, or a CSV table of Hz, Re and Im of N/m.

    Raises
    ------
    CommandError
    """
    if text is None:
        return RIGID
    if text.lower().endswith(".csv"):
        return JointOption(_table(Path(text)), 0.0, text)
    try:
        k, *rest = (complex(word.replace(" ", "")) for word in text.split(","))
        c = rest[0] if rest else 0.0
        if len(rest) > 1 or complex(c).imag or not (np.isfinite(k) and np.isfinite(c)):
            raise ValueError
    except ValueError:
        raise CommandError(
            f"--joint = {text!r}: give k or k,c (N/m, N s/m), as 1e6,10, with k complex where it "
            "is hysteretic, as 1e6+5e4j; or a table FILE.csv of Hz, Re k and Im k"
        ) from None
    stiffness = k if k.imag else k.real
    damping = complex(c).real
    return JointOption(stiffness, damping, f"{stiffness:g} N/m, {damping:g} N s/m")


def _table(path: Path) -> StiffnessTable:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
        numbers = np.array([[float(word) for word in row] for row in rows[1:]])
        if numbers.ndim != 2 or numbers.shape[1] not in (2, 3):
            raise ValueError(f"{numbers.shape[-1] if numbers.size else 0} columns")
        imaginary = numbers[:, 2] if numbers.shape[1] == 3 else 0.0
        return StiffnessTable(numbers[:, 0], numbers[:, 1] + 1j * imaginary)
    except OSError as error:
        raise CommandError(
            f"--joint = {path}: cannot be read: {error.strerror or error}"
        ) from error
    except (ValueError, FbsError) as error:
        raise CommandError(
            f"--joint = {path}: must be a table with a heading and columns Hz, Re k and Im k (N/m) "
            f"of one joint: {error}"
        ) from error

"""What a file of FRFs or records holds, how good it is, and a map to start from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fbs import FbsError
from fbs.files.frf_files import FORMATS as FRF_FORMATS
from fbs.files.measurement import Contents, Measurement, few, take
from fbs.files.record_files import FORMATS as RECORD_FORMATS
from fbs.files.record_files import read_record
from fbs.files.universal import FUNCTION_TYPES, TIME_RESPONSE, Function, read_universal
from fbs.measured.quality import quality, zeros
from mbs_models.model.parameters import Drivetrain

from ..errors import CommandError
from ..routes import frf_input
from ..routes.frf_input import FileOptions
from ..routes.substitution_checks import channels, describe

UNIVERSAL = (".uff", ".unv")
CLIPPED = 4  # samples in a row at one extreme: no signal rests there, a converter at its end does


def channel_options(given: Sequence[str]) -> Mapping[str, tuple[str, str]]:
    """What ``--channel NAME=LABEL UNIT`` says of a record's channels.

    Raises
    ------
    CommandError
        One that is not of this form.
    """
    found = {}
    for item in given:
        name, sign, rest = item.partition("=")
        label, _, unit = rest.strip().partition(" ")
        if not (name and sign and label and unit.strip()):
            raise CommandError(
                f"--channel = {item!r}: give NAME=LABEL UNIT, such as '1=hammer.z 50 N'"
            )
        found[name.strip()] = (label, unit.strip())
    return found


def inspection(
    path: Path,
    options: FileOptions,
    channels: Mapping[str, tuple[str, str]],
    drivetrain: Drivetrain | None = None,
) -> list[str]:
    """Say in lines of text what a file holds.

    Parameters
    ----------
    path
        A file of FRFs or of records.
    options
        What the user says of its FRFs.
    channels
        What the user says of its channels of time.
    drivetrain
        A model whose DoFs the map is for (None: none).

    Raises
    ------
    CommandError
        It holds neither; the message starts with the path.
    """
    if path.suffix.lower() not in {**FRF_FORMATS, **RECORD_FORMATS}:
        raise CommandError(
            f"{path}: the ending {path.suffix or '(none)'} is not known; allowed: "
            f"{', '.join({**FRF_FORMATS, **RECORD_FORMATS})}"
        )
    stated = _universal(path)
    found: list[str] = []
    failures: list[str] = []
    for what in ("FRFs", "a record"):
        try:
            if what == "FRFs":
                found += _frfs(path, options, drivetrain)
            else:
                found += _record(path, channels)
        except CommandError as error:
            failures.append(f"as {what}: {str(error).removeprefix(f'{path}: ')}")
    if not (found or stated):
        raise CommandError(f"{path}: {'; '.join(failures)}")
    if not found:
        found = [f"  {words}" for words in failures]
    return [f"{path}:", *stated, *found]


def _universal(path: Path) -> list[str]:
    """What the headers of a universal file state, whether or not anything can be taken."""
    if path.suffix.lower() not in UNIVERSAL:
        return []
    try:
        file = read_universal(path)
    except (FbsError, OSError):
        return []  # said where its functions are read
    kinds = Counter(f.kind for f in file.functions)
    lines = [
        f"  {n} {FUNCTION_TYPES.get(kind, f'functions of type {kind}')}"
        for kind, n in kinds.items()
    ]
    stated = Counter(_stated(f) for f in file.functions)
    lines += [f"  {n} of {words}" for words, n in stated.items()]
    for one in file.units:
        lines.append(
            f"  unit system (dataset 164): {one.description or 'no name'}, length {one.length:g}, "
            f"force {one.force:g}"
        )
    return lines if file.functions else []


def _stated(f: Function) -> str:
    if f.kind == TIME_RESPONSE:
        return f"data type {f.ordinate.kind}, unit {f.ordinate.unit}, {f.x.size} values"
    return (
        f"data type {f.ordinate.kind} per {f.denominator.kind}, units {f.ordinate.unit} per "
        f"{f.denominator.unit}, {f.x.size} values"
    )


def _frfs(path: Path, options: FileOptions, drivetrain: Drivetrain | None) -> list[str]:
    contents = frf_input.contents(path, options)
    pairs = Counter(c.pair for c in contents.candidates)
    most = max(pairs.values())
    responses = list(dict.fromkeys(c.response for c in contents.candidates))
    references = list(dict.fromkeys(c.excitation for c in contents.candidates))
    lines = [
        f"  FRFs: {len(pairs)} pairs" + (f", up to {most} times" if most > 1 else ""),
        f"  responses: {few(responses, 30)}",
        f"  references: {few(references, 30)}",
    ]
    try:
        taken = take(contents, run=options.given.run)
    except FbsError as error:
        return [*lines, f"  cannot be taken as it is: {error}"]
    return [*lines, *_taken(taken), *_map(contents, drivetrain)]


def _taken(taken: Measurement) -> list[str]:
    frf = taken.frf
    lines = [
        f"  taken: {frf.quantity}, {len(frf.responses)} × {len(frf.excitations)}, "
        f"{frf.frequency.size} lines from {frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz",
        *(f"  {note}" for note in taken.notes),
    ]
    if taken.angles or taken.moments:
        lines.append(f"  rotations (rad, N m): {few(sorted(taken.angles | taken.moments))}")
    found = quality(frf, taken.coherence)
    n = len(found.square)
    lines.append(f"  quality (drive points: {n}, reciprocal pairs: {n * (n - 1) // 2}):")
    lines += [f"    {describe(one, found.frequency)}" for one in found.defects]
    if still := zeros(frf):
        words = few(channels(frf, still))
        lines.append(f"    zero at every line, a dead channel or no path: {words}")
    elif not found.defects:
        lines.append("    nothing that a passive, reciprocal structure does not have")
    if taken.coherence is not None:
        known = taken.coherence[np.isfinite(taken.coherence)]
        averages = f", of {taken.averages} averages" if taken.averages else ""
        lines.append(
            f"    coherence: median {np.median(known):.4f}, least {known.min():.3f}{averages}"
        )
    return lines


def _map(contents: Contents, drivetrain: Drivetrain | None) -> list[str]:
    """A table [map] with a line for every channel, to be completed."""
    labels = list(dict.fromkeys(label for c in contents.candidates for label in c.pair))
    known = set() if drivetrain is None else set(drivetrain.dof_radii())
    if known and known >= set(labels):
        return (
            [f"  its labels are DoFs of {drivetrain.name!r}: no map is needed"]
            if drivetrain
            else []
        )
    sides = {
        label: [
            words
            for words, there in (
                ("response", {c.response for c in contents.candidates}),
                ("reference", {c.excitation for c in contents.candidates}),
            )
            if label in there
        ]
        for label in labels
    }
    lines = [
        "  a map to start from (--map FILE.toml; DOF stands for a label of the model):",
        "",
        "[map]",
    ]
    if known:
        free = sorted(known - set(labels))
        lines.insert(2, f"# DoFs of the model: {few(free, 200)}")
    for label in labels:
        dof = label if label in known else "DOF"
        lines.append(f'"{dof}" = "{label}"  # {" and ".join(sides[label])}')
    return lines


def _record(path: Path, channels: Mapping[str, tuple[str, str]]) -> list[str]:
    with frf_input.naming(path):
        record, _ = read_record(path, channels)
    lines = [
        f"  record: {record.n_sample} samples at {record.sampling_frequency:g} Hz, "
        f"{record.n_sample * record.time_step:g} s; outputs as {record.quantity.motion}"
    ]
    for kind, labels, samples in (
        ("force", record.excitations, record.inputs),
        ("motion", record.responses, record.outputs),
    ):
        for label, values in zip(labels, samples.T, strict=True):
            peak, rms = np.abs(values).max(), np.sqrt(np.mean(values**2))
            words = f"  {kind} {label}: peak {peak:.4g}, rms {rms:.4g}, mean {values.mean():.2g}"
            lines.append(words + _oddity(values))
    return lines


def _oddity(values: NDArray[np.float64]) -> str:
    if not values.any():
        return ", a dead channel?"
    return ", clipped?" if _clipped(values) else ""


def _clipped(values: NDArray[np.float64]) -> bool:
    """Whether several samples in a row stand at an extreme."""
    for extreme in (values.max(), values.min()):
        at = values == extreme
        if extreme != 0 and at.sum() >= CLIPPED:
            runs = np.convolve(at, np.ones(CLIPPED, dtype=int))
            if runs.max() >= CLIPPED:
                return True
    return False

"""Parts of a drivetrain whose FRFs come from files instead of from the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fbs import AxisMismatchError, FbsError, Frf, direct_frf
from fbs.axes import require_same_frequency
from fbs.measured.quality import Quality, frf_square, quality, rigid_accelerance
from fbs.measured.resampling import overlap, resample
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray
from ..errors import CommandError, require_frequencies
from . import frf_input
from .frf_input import NOTHING_SAID, FileOptions
from .routes import known_part
from .source import Source, equations_source
from .substitution_checks import dead, implausible

ROUNDED = 1e-6  # of 1, in single precision
SAME_STEP = 1e-9  # relative: the round-off of decimal input


@dataclass(frozen=True, eq=False)
class Substitution:
    """A part's FRFs from a file.

    Attributes
    ----------
    part, path
        The stage or inertia, and the file.
    frf
        Its receptances between the DoFs that the model has too, on the run's lines.
    interface
        Labels of the DoFs at which it is coupled.
    left_out
        The part's labels that the file does not have both as response and as excitation.
    unknown
        The file's labels that the model does not have.
    warnings
        What is implausible about the file.
    quality
        Of its FRFs, on the file's lines.
    repeats
        The runs whose mean ``frf`` is, on its lines; empty if there is one.
    coherence
        Of ``frf``, NaN where the file has none; None if it has none at all.
    averages
        Of how many the coherence is; None if neither the file nor the user says it.
    interpolation
        E |ΔH|² of what is interpolated; None: nothing is.
    """

    part: str
    path: Path
    frf: Frf
    interface: tuple[str, ...]
    left_out: tuple[str, ...]
    unknown: tuple[str, ...]
    warnings: tuple[str, ...]
    quality: Quality
    repeats: tuple[Frf, ...] = ()
    coherence: FloatArray | None = None
    averages: int | None = None
    interpolation: FloatArray | None = None


def read_substitutions(
    drivetrain: Drivetrain,
    given: Sequence[str],
    fmin: float | None = None,
    fmax: float | None = None,
    df: float | None = None,
    options: FileOptions = NOTHING_SAID,
) -> tuple[Substitution, ...]:
    """Read the files of ``--replace PART=FILE``.

    Parameters
    ----------
    drivetrain
        Whose parts are substituted.
    given
        The options, one for each part.
    fmin, fmax
        Limits of the lines used (Hz; None: all of the file but 0 Hz).
    df
        A step that the lines must have (Hz; None: any).
    options
        What the user says of the files.

    Raises
    ------
    CommandError
        An option or a file that does not fit: it is named, with what is allowed.
    """
    require_frequencies(fmin=fmin, fmax=fmax, df=df)
    paths = _paths(drivetrain, given)
    source = equations_source(drivetrain)
    found = tuple(
        _substitution(source, part, path, fmin, fmax, options) for part, path in paths.items()
    )
    if options.averages and all(one.coherence is None for one in found):
        files = ", ".join(str(one.path) for one in found) or "there is no file (--replace), and"
        raise CommandError(f"--averages = {options.averages}: {files} has no coherences")
    if found and options.resample:
        return _on_common_lines(found, fmin, fmax, df)
    for other in found[1:]:
        _refuse_other_axis(found[0], other)
    if found and df is not None:
        _refuse_other_step(found[0], df)
    return found


def interface_labels(source: Source, part: str) -> tuple[str, ...]:
    """Labels of the DoFs at which a part is coupled."""
    ends = [end for joint in source.joints for end in (joint.first, joint.second)]
    return tuple(dict.fromkeys(label for owner, label in ends if owner == part))


def _paths(drivetrain: Drivetrain, given: Sequence[str]) -> dict[str, Path]:
    paths: dict[str, Path] = {}
    for item in given:
        name, sign, file = item.partition("=")
        if not (name and sign and file):
            raise CommandError(
                f"--replace = {item!r}: give a stage and a file, such as planetary=measured.uff"
            )
        part = known_part(drivetrain, name, "--replace")
        if part in paths:
            raise CommandError(
                f"--replace = {item!r}: '{part}' is replaced by {paths[part]} already; "
                "one file for each stage"
            )
        paths[part] = Path(file)
    return paths


def _substitution(
    source: Source,
    part: str,
    path: Path,
    fmin: float | None,
    fmax: float | None,
    options: FileOptions,
) -> Substitution:
    interface = interface_labels(source, part)
    system = source.stage(part)
    contents = frf_input.contents(path, options)
    labels = frf_input.labels(contents)
    if options.channel_map is None:
        _refuse_other_parts(source, part, path, labels)
    radii = source.drivetrain.dof_radii()
    measured = frf_input.measured(path, contents, system.labels, radii, options)
    frf = measured.frf
    _refuse_missing_interface(part, path, frf, interface)
    unknown = () if options.channel_map else tuple(x for x in labels if x not in system.labels)
    lines = _lines(path, frf.frequency, fmin, fmax)
    static = frf.frequency[0] == 0.0 and (fmin is None or fmin <= 0.0)
    known = frf.band(lines[0], lines[-1]).to("receptance")
    averages = options.averages or measured.averages
    coherence = measured.coherence
    if coherence is not None:
        coherence = _coherence(path, known, coherence[np.isin(frf.frequency, known.frequency)])
    found = quality(known, coherence, rigid_accelerance(system, known.frequency))
    own = direct_frf(system, known.frequency, interface, interface) if interface else known
    notes = [
        *measured.notes,
        *_notes(static, unknown),
        *dead(known, system),
        *_unused(coherence, averages),
        *implausible(found, known, own, interface),
    ]
    return Substitution(
        part=part,
        path=path,
        frf=known,
        interface=interface,
        left_out=tuple(x for x in system.labels if x not in frf_square(known)),
        unknown=unknown,
        warnings=tuple(f"{path} ('{part}'): {words}" for words in notes),
        quality=found,
        repeats=tuple(one.band(lines[0], lines[-1]).to("receptance") for one in measured.repeats),
        coherence=coherence,
        averages=averages,
    )


def _coherence(path: Path, frf: Frf, coherence: FloatArray) -> FloatArray:
    """Coherence that can be one; single precision may round 1 up."""
    wrong = ~np.isnan(coherence) & ~((coherence > 0.0) & (coherence <= 1.0 + ROUNDED))
    if wrong.any():
        f, i, j = (int(places[0]) for places in np.nonzero(wrong))
        raise CommandError(
            f"{path}: the coherence of {frf.responses[i]} ← {frf.excitations[j]} is "
            f"{coherence[f, i, j]:g} at {frf.frequency[f]:g} Hz; must be above 0 and at most 1"
        )
    return np.minimum(coherence, 1.0)


def _unused(coherence: FloatArray | None, averages: int | None) -> list[str]:
    """What coherence there is does not tell."""
    if coherence is None:
        return []
    if averages is None:
        return [
            "it has coherences but does not say of how many averages: no bands follow from them "
            "(--averages N)"
        ]
    bare = int(np.isnan(coherence).any(axis=0).sum())
    return [f"{bare} of its FRFs have no coherence: taken as certain"] if bare else []


def _notes(static: bool, unknown: Sequence[str]) -> list[str]:
    notes = []
    if static:
        notes.append("its line at 0 Hz is left out: what is free to move has no FRF there")
    if unknown:
        notes.append(f"the model has no DoF {_listing(unknown)}: left out")
    return notes


def _refuse_other_parts(source: Source, part: str, path: Path, labels: Sequence[str]) -> None:
    """FRFs of the whole drivetrain are no part's."""
    own = source.stage(part).labels
    for name, other in source.stages.items():
        theirs = other.labels
        strange = [x for x in labels if x in theirs and x not in own]
        if name != part and strange:
            raise CommandError(
                f"{path}: {strange[0]!r} belongs to '{name}', not to '{part}'; FRFs of "
                f"'{part}' alone are needed (crosscheck frf --stage {part} writes such a file)"
            )


def _refuse_missing_interface(part: str, path: Path, frf: Frf, interface: tuple[str, ...]) -> None:
    for role, labels in (("response", frf.responses), ("excitation", frf.excitations)):
        missing = [label for label in interface if label not in labels]
        if missing:
            raise CommandError(
                f"{path}: {', '.join(missing)} is missing as {role}; '{part}' is coupled at "
                f"{', '.join(interface)}, needed as response and as excitation; the file's "
                f"{role}s are {_listing(labels)}"
            )


def _lines(path: Path, frequency: FloatArray, fmin: float | None, fmax: float | None) -> FloatArray:
    low, high = (0.0 if fmin is None else fmin), (np.inf if fmax is None else fmax)
    lines = frequency[(frequency > 0.0) & (frequency >= low) & (frequency <= high)]
    if not lines.size:
        raise CommandError(
            f"{path}: no line above 0 Hz from fmin = {low:g} to fmax = {high:g} Hz; the file "
            f"has {frequency.size}, {frequency[0]:g} to {frequency[-1]:g} Hz"
        )
    return lines


def _refuse_other_axis(first: Substitution, other: Substitution) -> None:
    try:
        require_same_frequency(
            first.frf.frequency,
            other.frf.frequency,
            f"{other.path}: its frequency lines are not those of {first.path}",
        )
    except AxisMismatchError as error:
        raise CommandError(
            f"{error}; {overlap(first.frf.frequency, other.frf.frequency)}; all files need the "
            "same lines (--fmin and --fmax cut them, --resample interpolates)"
        ) from error


def _on_common_lines(
    found: Sequence[Substitution], fmin: float | None, fmax: float | None, df: float | None
) -> tuple[Substitution, ...]:
    """Interpolate to the first file's lines, or to a step, within what all files have."""
    low = max(one.frf.frequency[0] for one in found)
    high = min(one.frf.frequency[-1] for one in found)
    if df is None:
        own = found[0].frf.frequency
        lines = own[(own >= low) & (own <= high)]
    else:
        first, last = np.ceil(low / df * (1 - SAME_STEP)), np.floor(high / df * (1 + SAME_STEP))
        lines = df * np.arange(first, last + 1)
    if not lines.size:
        raise CommandError(
            f"{found[-1].path}: no line from {low:g} to {high:g} Hz, which is all that the files "
            "have in common"
        )
    return tuple(_resampled(one, lines) for one in found)


def _resampled(one: Substitution, lines: FloatArray) -> Substitution:
    if np.array_equal(one.frf.frequency, lines):
        return one
    try:
        new = resample(one.frf, lines)
    except FbsError as error:
        raise CommandError(f"{one.path}: {error}") from error
    worst = int(np.argmax(new.error))
    note = (
        f"{one.path} ('{one.part}'): interpolated to {lines.size} lines, with an error of up to "
        f"{new.error[worst]:.2g} of the largest FRF at {lines[worst]:g} Hz"
    )
    repeats = tuple(resample(other, lines).frf for other in one.repeats)
    coherence = one.coherence
    if coherence is not None:
        own = one.frf.frequency
        nearest = np.rint(np.interp(lines, own, np.arange(own.size))).astype(int)
        coherence = coherence[nearest]
    return replace(
        one,
        frf=new.frf,
        warnings=(*one.warnings, note),
        repeats=repeats,
        coherence=coherence,
        interpolation=new.variance,
    )


def _refuse_other_step(substitution: Substitution, df: float) -> None:
    steps = np.diff(substitution.frf.frequency)
    if not np.all(np.abs(steps - df) <= SAME_STEP * df):
        raise CommandError(
            f"--df = {df:g}: the lines are those of {substitution.path}, {steps.min():.6g} to "
            f"{steps.max():.6g} Hz apart; leave --df out with --replace, or give --resample"
        )


def _listing(labels: Sequence[str], limit: int = 8) -> str:
    return ", ".join(labels[:limit]) + (", …" if len(labels) > limit else "")

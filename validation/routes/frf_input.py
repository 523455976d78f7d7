"""FRFs of a part from a file: the block of the model's DoFs, by labels or by a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from fbs import FbsError
from fbs.files.channel_map import (
    ChannelMap,
    channels_of,
    in_lengths,
    mapped,
    parse_map,
    read_map,
)
from fbs.files.frf_files import frf_contents
from fbs.files.measurement import AS_STATED, Contents, Given, Measurement, few, take
from fbs.frf import as_quantity

from ..errors import CommandError


@dataclass(frozen=True)
class FileOptions:
    """What the user says about files of FRFs.

    Attributes
    ----------
    given
        Quantity, units and run, where the files do not say them.
    channel_map
        From their channels to the model's DoFs; None: their labels are the model's.
    resample
        Whether lines that differ are brought to common ones by rational interpolation.
    averages
        Of how many averages the files' coherences are (None: as the files say).
    """

    given: Given = AS_STATED
    channel_map: ChannelMap | None = None
    resample: bool = False
    averages: int | None = None


NOTHING_SAID = FileOptions()


def file_options(
    quantity: str | None = None,
    unit: str | None = None,
    run: int | None = None,
    channel_map: str | None = None,
    resample: bool = False,
    averages: int | None = None,
) -> FileOptions:
    """What ``--quantity``, ``--unit``, ``--run``, ``--map``, … say.

    Raises
    ------
    CommandError
        One that does not fit, named, with what is allowed.
    """
    if run is not None and run < 1:
        raise CommandError(f"--run = {run}: runs count from 1 on")
    if averages is not None and averages < 2:
        raise CommandError(f"--averages = {averages}: coherence needs two at least")
    try:
        known = None if quantity is None else as_quantity(quantity)
    except FbsError as error:
        raise CommandError(f"--quantity = {quantity!r}: {error}") from error
    units = tuple(u.strip() for u in (unit or "").split(",") if u.strip())
    return FileOptions(Given(known, units, run), _channel_map(channel_map), resample, averages)


def _channel_map(text: str | None) -> ChannelMap | None:
    if text is None:
        return None
    try:
        if "=" not in text:
            return read_map(text)
        return parse_map(text)
    except OSError as error:
        raise CommandError(f"--map = {text}: cannot be read: {error.strerror or error}") from error
    except FbsError as error:
        raise CommandError(f"--map: {error}") from error


def contents(path: Path, options: FileOptions) -> Contents:
    """What FRFs a file holds.

    Raises
    ------
    CommandError
        The ending is none, or the file holds no FRFs; the message starts with the path.
    """
    with naming(path):
        return frf_contents(path, options.given)


def read(
    path: Path,
    wanted: Sequence[str] | None = None,
    radii: Mapping[str, float | None] | None = None,
    options: FileOptions = NOTHING_SAID,
) -> Measurement:
    """Read the FRFs between the DoFs wanted, rotations as w = r·θ.

    Parameters
    ----------
    path
        Its ending says the format.
    wanted
        Labels of the model (None: all of the file).
    radii
        The model's radii of its rotations.
    options
        What the user says of the file.

    Raises
    ------
    CommandError
        The file holds no FRFs between these DoFs, or contradicts itself; the message starts with
        the path.
    """
    return measured(path, contents(path, options), wanted, radii or {}, options)


def measured(
    path: Path,
    found: Contents,
    wanted: Sequence[str] | None,
    radii: Mapping[str, float | None],
    options: FileOptions,
) -> Measurement:
    """Take the FRFs between the DoFs wanted from what a file holds; see `read`."""
    with naming(path):
        return _measurement(found, wanted, radii, options)


def labels(found: Contents) -> tuple[str, ...]:
    """All labels of a file's FRFs."""
    return tuple(dict.fromkeys(label for c in found.candidates for label in c.pair))


def _measurement(
    found: Contents,
    wanted: Sequence[str] | None,
    radii: Mapping[str, float | None],
    options: FileOptions,
) -> Measurement:
    if options.channel_map is None:
        if wanted is not None:
            _require_some(found, wanted)
        return in_lengths(take(found, wanted, wanted, options.given.run), radii.get)
    sides = [
        {dof: c for dof, c in side.items() if wanted is None or dof in wanted}
        for side in (options.channel_map.responses, options.channel_map.excitations)
    ]
    if not all(sides):
        known = [*options.channel_map.responses, *options.channel_map.excitations]
        raise FbsError(
            f"the map has no DoF of this part; it has {few(list(dict.fromkeys(known)))}, the part "
            f"{few(wanted or ())}"
        )
    named = list(dict.fromkeys(c for side in sides for c in channels_of(side)))
    _require_some(found, named)
    block = take(found, channels_of(sides[0]), channels_of(sides[1]), options.given.run)
    rest = [label for label in labels(found) if label not in named]
    found_dofs = mapped(block, ChannelMap(*sides), radii.get)
    if not rest:
        return found_dofs
    return replace(
        found_dofs, notes=(*found_dofs.notes, f"left out: channels not in the map ({few(rest)})")
    )


def _require_some(found: Contents, wanted: Sequence[str]) -> None:
    if not set(labels(found)) & set(wanted):
        raise FbsError(
            f"none of its DoFs are wanted here: it has {few(labels(found))}, wanted are "
            f"{few(wanted)}; a map says which is which (--map; crosscheck inspect prints one to "
            "start from)"
        )


class naming:
    """Let what goes wrong in a file start with its path, once."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, OSError):
            raise CommandError(f"{self.path}: cannot be read: {error.strerror or error}") from error
        if isinstance(error, FbsError):
            words = str(error).removeprefix(f"{self.path}: ")
            raise CommandError(f"{self.path}: {words}") from error

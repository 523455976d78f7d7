"""Writing a report's files: all of them whole, or none."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..errors import CommandError


class ReportError(CommandError):
    """A report that cannot be written: one line with the path and what is wrong."""


def write_together(directory: Path, texts: Mapping[str, str]) -> tuple[Path, ...]:
    """Write text files into a directory, which is made if it is not there.

    Every text is on the disk in full before the first existing file is replaced, so that a
    full disk or an interruption leaves what was there.

    Parameters
    ----------
    directory
        Where to.
    texts
        File name → text.

    Raises
    ------
    ReportError
        The directory or a file in it cannot be written.
    """
    targets = {directory / name: text for name, text in texts.items()}
    make_directory(directory)
    partials = {path: path.with_name(f".{path.name}.{os.getpid()}.partial") for path in targets}
    try:
        for path, text in targets.items():
            if path.is_dir():
                raise ReportError(f"{path}: is a directory; the report needs a file of that name")
            partials[path].write_text(text, encoding="utf-8")
        for path, partial in partials.items():
            partial.replace(path)
    except OSError as error:
        raise ReportError(f"{directory}: cannot be written: {error.strerror}") from error
    finally:
        for partial in partials.values():
            _discard(partial)
    return tuple(targets)


def make_directory(directory: Path) -> None:
    """Make a directory and its parents, if they are not there.

    Raises
    ------
    ReportError
        Something else is in the way, or it may not be made.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise ReportError(f"{directory}: is, or lies below, a file; give a directory") from error
    except OSError as error:
        raise ReportError(f"{directory}: cannot be made: {error.strerror}") from error


def _discard(partial: Path) -> None:
    """Remove what an error left; where even that is refused, the first error is the telling one."""
    try:
        partial.unlink(missing_ok=True)
    except OSError:
        return

"""Text files of anybody's: read whole, if they are files, small enough, and text."""

from __future__ import annotations

from pathlib import Path

from .errors import ModelError


def read_text(path: Path, largest: int, what: str) -> str:
    """The text of a file in UTF-8.

    Parameters
    ----------
    path
        The file.
    largest
        Bytes; more is not read.
    what
        Files that large are none of, in words.

    Raises
    ------
    ModelError
        It cannot be read, is a device or a pipe, is larger, or no text.
    FileNotFoundError
        There is none.
    """
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise ModelError(f"{path}: is a device or a pipe, no file")
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = error.strerror if isinstance(error, OSError) else error
        raise ModelError(f"{path}: cannot be read: {reason}") from error
    if len(content) > largest:
        raise ModelError(f"{path}: is larger than {largest / 1e6:g} MB, as no {what} is")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: not a text file in UTF-8 (byte {error.start} is not)") from error

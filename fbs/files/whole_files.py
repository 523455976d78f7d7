"""Files that appear whole or not at all, and take the place of nothing that is protected."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO


@contextmanager
def written_whole(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a new file that takes the path's place once all is written, and not before.

    It is created exclusively, under a name nobody can guess, in the folder it is for; the system
    gives it the permissions of any new file (0666 less the umask). A symbolic link of the path's
    name is replaced itself: what it points to is not touched.

    Raises
    ------
    OSError
        As `require_writable`, or the file cannot be written.
    """
    target = Path(path)
    _refuse_protected(target)
    file = _beside(target)
    try:
        with file:
            yield file
        os.replace(file.name, target)
    finally:
        with suppress(OSError):  # gone to its place; else the first error is the telling one
            os.unlink(file.name)


def require_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a path that `written_whole` would, before there is anything to write.

    That is a folder, a device, a file that is read-only, a folder that takes no file.

    Raises
    ------
    OSError
        Its `strerror` says why; FileNotFoundError where there is no such folder.
    """
    target = Path(path)
    _refuse_protected(target)
    with _beside(target) as file:
        pass
    os.unlink(file.name)


def _beside(target: Path) -> BinaryIO:
    return target.with_name(f".{secrets.token_hex(8)}.partial").open("xb")


def _refuse_protected(target: Path) -> None:
    """Renaming would replace a read-only file, and the superuser may write to any: modes decide."""
    if not target.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "the directory does not exist", str(target.parent))
    try:
        mode = target.lstat().st_mode  # refuses a name that is too long
    except FileNotFoundError:
        return
    if stat.S_ISLNK(mode):
        return
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory", str(target))
    if not stat.S_ISREG(mode):
        raise PermissionError(errno.EACCES, "it is a device or a pipe, no file", str(target))
    if not mode & 0o222 or not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, "it is read-only", str(target))

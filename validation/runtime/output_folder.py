"""The one guard of every folder that a command writes to.

Files appear together, or none does. A command holds its folder while it runs; what it keeps there
between runs lies in a private folder with a marker, and nothing else is ever removed.
"""

from __future__ import annotations

import os
import secrets
import socket
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from fbs.files.whole_files import require_writable, written_whole

from ..errors import CommandError
from .streams import warn

Writer = Callable[[BinaryIO], None]

WORK = ".crosscheck"  # the private folder
MARKER = "marker.txt"
MARK = "Unfinished work of crosscheck, which goes on from here and removes this when it is done.\n"
LOCK = "lock"
LOCKED_BYTE = 1 << 20  # on Windows, where what is locked cannot be read: behind what is told


class ReportError(CommandError):
    """A result that cannot be written: one line with the path and what is wrong."""


# Files


def write_together(directory: Path, contents: Mapping[str, str | Writer]) -> tuple[Path, ...]:
    """Write files into a directory, which is made if it is not there.

    All are on the disk in full before the first existing one is replaced, so that a full disk or an
    interruption leaves what was there.

    Parameters
    ----------
    directory
        Where to.
    contents
        File name → its text, or what writes it to an open file.

    Raises
    ------
    ReportError
        The directory or a file in it cannot be written.
    """
    make_directory(directory)
    with ExitStack() as files:  # which on its way out puts one after the other in its place
        for name, content in contents.items():
            files.enter_context(telling(directory / name))
            file = files.enter_context(written_whole(directory / name))
            if isinstance(content, str):
                file.write(content.encode())
            else:
                content(file)
    return tuple(directory / name for name in contents)


@contextmanager
def telling(path: Path | str) -> Iterator[None]:
    """Say in one message that a file cannot be written, and why.

    Raises
    ------
    ReportError
        For an OSError.
    """
    try:
        yield
    except OSError as error:
        raise ReportError(f"{path}: cannot be written: {error.strerror or error}") from error


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


# Holding a folder


@contextmanager
def held(directory: Path, names: Sequence[str]) -> Iterator[Path]:
    """Hold a directory for one command, and give its private folder for unfinished work.

    The system lets go of the lock with the process, however that ends.

    Parameters
    ----------
    directory
        Made if it is not there.
    names
        Files that will be written to it, refused now rather than after the computation.

    Raises
    ------
    ReportError
        Another command writes there, the private folder's name is taken, or a file cannot be
        written.
    """
    make_directory(directory)
    for name in names:
        with telling(directory / name):
            require_writable(directory / name)
    with telling(directory):
        work, lock = _locked(directory)
    try:
        _take_over(directory, lock)
        yield work
    finally:
        if sys.platform == "win32":  # which moves no folder with an open file
            os.close(lock)
        _leave(work)
        if sys.platform != "win32":  # only now: whoever waits must not lock what is going
            os.close(lock)


def _locked(directory: Path) -> tuple[Path, int]:
    """The private folder, and its lock, taken."""
    while True:
        work = _private(directory)
        with suppress(FileNotFoundError), ExitStack() as undo:  # a command ended in between: again
            lock = os.open(
                work / LOCK, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o600
            )
            undo.callback(os.close, lock)
            try:
                _lock(lock)
            except BlockingIOError as error:
                raise ReportError(
                    f"{directory}: another command writes there ({_told(lock) or 'just begun'}); "
                    "wait for it, or give another --out"
                ) from error
            if os.path.samestat(os.fstat(lock), (work / LOCK).stat()):
                undo.pop_all()
                return work, lock


if sys.platform == "win32":
    import msvcrt

    def _lock(file: int) -> None:
        os.lseek(file, LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError(*error.args) from error
else:
    import fcntl

    def _lock(file: int) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _told(lock: int) -> str:
    """Who holds a lock, or held it."""
    os.lseek(lock, 0, os.SEEK_SET)
    return os.read(lock, 200).decode(errors="replace").strip()


def _take_over(directory: Path, lock: int) -> None:
    """Write down who holds a lock; a name in it is that of a process that was killed."""
    if before := _told(lock):
        warn([f"{directory}: taken over from a command that was killed ({before})"])
    os.ftruncate(lock, 0)
    os.lseek(lock, 0, os.SEEK_SET)
    os.write(lock, f"process {os.getpid()} on {socket.gethostname()}\n".encode())


def _private(directory: Path) -> Path:
    """The private folder, made with its marker in one step if there is none."""
    work = directory / WORK
    if not os.path.lexists(work):
        made = Path(tempfile.mkdtemp(prefix=f"{WORK}-", dir=directory))
        (made / MARKER).write_bytes(MARK.encode())
        try:
            made.rename(work)
        except OSError:  # another command was faster
            _remove_folder(made)
    if not _is_ours(work):
        raise ReportError(
            f"{work}: is not crosscheck's, which needs that name; move it, or give another --out"
        )
    return work


def _is_ours(work: Path) -> bool:
    try:
        return stat.S_ISDIR(work.lstat().st_mode) and (work / MARKER).read_bytes() == MARK.encode()
    except (FileNotFoundError, NotADirectoryError):
        return False


def _leave(work: Path) -> None:
    """Remove the private folder if nothing is kept in it, else its lock alone."""
    with suppress(OSError):
        if {path.name for path in work.iterdir()} <= {MARKER, LOCK}:
            # moved first: at no instant is it there without its marker
            gone = work.with_name(f"{WORK}-{secrets.token_hex(8)}")
            work.rename(gone)
            _remove_folder(gone)
        else:
            (work / LOCK).unlink()


def _remove_folder(folder: Path) -> None:
    for name in (LOCK, MARKER):
        (folder / name).unlink(missing_ok=True)
    folder.rmdir()

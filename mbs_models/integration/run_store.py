"""Where the samples of a run go: memory, or a directory from which it is resumed.

A directory holds ``run.json`` (what is run, and its fingerprint), one ``.npy`` per array, named
``.npy.part`` until the run is finished, and ``checkpoint``: how many samples are good, their
checksums, and the state from which the next piece starts, behind a SHA-256 of all that and the
fingerprint. The checkpoint is replaced when a piece's samples are on the disk; what stands behind
it in the arrays is written again. Files that are replaced are written beside their places under
names nobody can guess.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import secrets
import shutil
import stat
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from .aliasing import Folded, aliasing_warning, nothing_folded
from .integrators import Integrator
from .transient_record import QUANTITIES, SMOOTH, RunDescription, TransientRecord, as_record

FloatArray = NDArray[np.float64]
State = tuple[FloatArray, ...]

MEMORY_LIMIT = 2**30  # bytes of a record kept in memory
FORMAT = 2
RUN, CHECKPOINT = "run.json", "checkpoint"
DIGEST_BYTES = 32
LARGEST_CHECKPOINT = 1 << 28
BLOCK = 1 << 24  # bytes read at a time
PARTIAL = re.compile(r"\.[0-9a-f]{16}\.partial")  # what a process that was killed leaves


class StoredRunError(ModelError):
    """What a directory holds is another run, or damaged: nothing can go on from it."""


@dataclass(frozen=True)
class Checkpoint:
    """How far a run has come.

    Attributes
    ----------
    samples
        How many there are.
    state
        The system's state at the next.
    folded
        What was above half the sampling frequency till then.
    """

    samples: int
    state: State
    folded: Folded


class RunStore(Protocol):
    """Takes the pieces of a run."""

    def checkpoint(self) -> Checkpoint | None:
        """Where to go on; None at the start."""

    def append(self, arrays: Mapping[str, FloatArray], checkpoint: Checkpoint) -> None:
        """Keep a piece, and how far the run has come with it."""

    def finish(self, folded: Folded) -> TransientRecord:
        """The record of the run."""


class MemoryStore:
    """Keeps a run in memory.

    Raises
    ------
    ModelError
        It takes more than 1 GiB.
    """

    def __init__(self, description: RunDescription) -> None:
        size = _size(description)
        if size > MEMORY_LIMIT:
            raise ModelError(
                f"the record of {description.samples} samples takes {size / 2**30:.2g} GiB of "
                f"memory, {MEMORY_LIMIT / 2**30:g} GiB are allowed: store it in a directory, or "
                "record less"
            )
        self.description = description
        self._arrays = {what: np.empty(shape) for what, shape in description.shapes().items()}
        self._samples = 0

    def checkpoint(self) -> Checkpoint | None:
        """Nothing was kept before."""
        return None

    def append(self, arrays: Mapping[str, FloatArray], checkpoint: Checkpoint) -> None:
        """Copy a piece into its place."""
        for what, values in arrays.items():
            self._arrays[what][self._samples : checkpoint.samples] = values
        self._samples = checkpoint.samples

    def finish(self, folded: Folded) -> TransientRecord:
        """The record of the run."""
        share, warnings = _judged(self.description, folded)
        return as_record(self.description, self._arrays, share, warnings)


class DirectoryStore:
    """Keeps a run in a directory.

    Raises
    ------
    StoredRunError
        Another run is there, or what is there is damaged.
    ModelError
        Something else is there, or there is not enough room.
    """

    def __init__(self, directory: Path, description: RunDescription, digest: str) -> None:
        self.directory, self.description, self._digest = directory, description, digest
        self._sums = dict.fromkeys(description.shapes(), 0)  # CRC-32 of what is good
        directory.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(directory / RUN):
            if _read_header(directory)["fingerprint"] != digest:
                raise StoredRunError(
                    f"{directory}: holds another run (drivetrain, excitations, start, integrator, "
                    "sampling, pieces or versions differ); name another directory, or empty this "
                    "one"
                )
        else:
            self._begin()
        if not (directory / CHECKPOINT).exists():  # nor need the arrays be, of a run just begun
            for what, shape in description.shapes().items():
                if not self._part(what).exists():
                    with _whole(self._part(what)) as file:
                        _write_npy_header(file, shape)

    def checkpoint(self) -> Checkpoint | None:
        """How far the run in the directory has come."""
        path = self.directory / CHECKPOINT
        if not path.exists():
            return None
        content = _read_small(path)
        if content[:DIGEST_BYTES] != self._sealed(content[DIGEST_BYTES:]):
            raise StoredRunError(f"{path}: is damaged, or another run's; empty the directory")
        with np.load(io.BytesIO(content[DIGEST_BYTES:]), allow_pickle=False) as file:
            found = Checkpoint(
                samples=int(file["samples"]),
                state=tuple(file[f"state{i}"] for i in range(_count(file.files, "state"))),
                folded=Folded(_group(file, "above"), _group(file, "total")),
            )
            sums = {what: int(file[f"sum {what}"]) for what in self._sums}
        for what, wanted in sums.items():
            if self._checksum(what, found.samples) != wanted:
                raise StoredRunError(
                    f"{self._file(what)}: its samples are not those of its checkpoint; empty the "
                    "directory"
                )
        self._sums = sums
        return found

    def append(self, arrays: Mapping[str, FloatArray], checkpoint: Checkpoint) -> None:
        """Write a piece, then the checkpoint that makes it good."""
        try:
            for what, values in arrays.items():
                with self._part(what).open("r+b") as file:
                    row = values.itemsize * int(np.prod(values.shape[1:]))
                    file.seek(self._offset(what) + (checkpoint.samples - len(values)) * row)
                    file.truncate()
                    content = np.ascontiguousarray(values).tobytes()
                    self._sums[what] = zlib.crc32(content, self._sums[what])
                    file.write(content)
                    file.flush()
                    os.fsync(file.fileno())
            self._save_checkpoint(checkpoint)
        except OSError as error:
            raise ModelError(
                f"{self.directory}: a piece cannot be written ({error.strerror}); the pieces "
                "before it are good, and the same run goes on from there"
            ) from None

    def finish(self, folded: Folded) -> TransientRecord:
        """Give the arrays their names; the record has memory maps of them."""
        for what in self.description.shapes():
            if self._part(what).exists():
                self._part(what).replace(self.directory / f"{what}.npy")
        share, warnings = _judged(self.description, folded)
        self._write_header({"aliasing": share, "warnings": warnings})
        return read_run(self.directory)

    def _begin(self) -> None:
        for name in (CHECKPOINT, *_array_files(self.description.shapes())):
            if os.path.lexists(self.directory / name):
                raise ModelError(
                    f"{self.directory / name}: is there without a {RUN}; name another directory"
                )
        room = shutil.disk_usage(self.directory).free
        size = _size(self.description)
        if size > room:
            raise ModelError(
                f"{self.directory}: the record takes {size / 2**30:.3g} GiB, "
                f"{room / 2**30:.3g} GiB are free"
            )
        self._write_header({})

    def _write_header(self, result: Mapping[str, Any]) -> None:
        header = {"format": FORMAT, "fingerprint": self._digest, "run": asdict(self.description)}
        text = json.dumps(header | {"result": dict(result)}, indent=2, ensure_ascii=False)
        with _whole(self.directory / RUN) as file:
            file.write(text.encode())

    def _save_checkpoint(self, checkpoint: Checkpoint) -> None:
        arrays: dict[str, Any] = {"samples": np.array(checkpoint.samples)}
        arrays |= {f"state{i}": part for i, part in enumerate(checkpoint.state)}
        arrays |= {f"above {what}": value for what, value in checkpoint.folded.above.items()}
        arrays |= {f"total {what}": value for what, value in checkpoint.folded.total.items()}
        arrays |= {f"sum {what}": np.array(value) for what, value in self._sums.items()}
        content = io.BytesIO()
        np.savez(content, **arrays)
        with _whole(self.directory / CHECKPOINT) as file:
            file.write(self._sealed(content.getvalue()) + content.getvalue())

    def _sealed(self, content: bytes) -> bytes:
        return hashlib.sha256(self._digest.encode() + content).digest()

    def _part(self, what: str) -> Path:
        return self.directory / f"{what}.npy.part"

    def _file(self, what: str) -> Path:
        finished = self.directory / f"{what}.npy"
        return finished if finished.exists() else self._part(what)

    def _offset(self, what: str) -> int:
        with self._file(what).open("rb") as file:
            np.lib.format.read_magic(file)
            np.lib.format.read_array_header_1_0(file)
            return file.tell()

    def _checksum(self, what: str, samples: int) -> int | None:
        """CRC-32 of an array's first samples; None where there are not so many."""
        path = self._file(what)
        width = int(np.prod(self.description.shapes()[what][1:]))
        left, found = samples * width * 8, 0
        try:
            with path.open("rb") as file:
                file.seek(self._offset(what))
                while left and (block := file.read(min(BLOCK, left))):
                    found, left = zlib.crc32(block, found), left - len(block)
        except (OSError, ValueError):  # gone, or no header
            return None
        return None if left else found


def open_store(directory: Path | None, description: RunDescription, digest: str) -> RunStore:
    """A directory's store, or without one memory's.

    Raises
    ------
    ModelError
        As for `MemoryStore` and `DirectoryStore`.
    """
    if directory is None:
        return MemoryStore(description)
    return DirectoryStore(directory, description, digest)


def read_run(directory: Path, first: int = 0, last: int | None = None) -> TransientRecord:
    """Samples first, … last − 1 of a finished run, as memory maps of these samples alone.

    A long record read piece by piece, each in a call of its own, keeps memory bounded.

    Raises
    ------
    ModelError
        There is no run, or it is not finished.
    """
    header = _read_header(directory)
    if not header["result"]:
        raise ModelError(f"{directory}: the run is not finished; run it again to resume it")
    description = _description(header)
    begin, end, _ = slice(first, last).indices(description.samples)
    arrays = {what: _mapped(directory / f"{what}.npy", begin, end) for what in description.shapes()}
    result = header["result"]
    record = as_record(description, arrays, result["aliasing"], tuple(result["warnings"]))
    return replace(record, start=begin / description.sampling_frequency)


def remove_run(directory: Path) -> None:
    """Remove the files of a run, and its directory if nothing else is in it."""
    if not directory.is_dir():
        return
    if os.path.lexists(directory / RUN):
        arrays = _array_files(("forces", *QUANTITIES))
        left = [path.name for path in directory.iterdir() if PARTIAL.fullmatch(path.name)]
        for name in (CHECKPOINT, *arrays, *left, RUN):  # what is left at any instant is a run begun
            (directory / name).unlink(missing_ok=True)
    if not any(directory.iterdir()):
        directory.rmdir()


@contextmanager
def _whole(path: Path) -> Iterator[BinaryIO]:
    """A new file that takes the path's place once all of it is on the disk."""
    partial = path.with_name(f".{secrets.token_hex(8)}.partial")
    try:
        with partial.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        with suppress(OSError):  # gone to its place; else the first error is the telling one
            partial.unlink()


def _array_files(names: Iterable[str]) -> list[str]:
    return [f"{what}{ending}" for what in names for ending in (".npy", ".npy.part")]


def _mapped(path: Path, first: int, last: int) -> FloatArray:
    with path.open("rb") as file:
        np.lib.format.read_magic(file)
        (_, *columns), _, _ = np.lib.format.read_array_header_1_0(file)
        begin = file.tell() + first * 8 * int(np.prod(columns))
    shape = (max(last - first, 0), *columns)
    if 0 in shape:  # there is no map of nothing
        return np.empty(shape)
    return np.memmap(path, float, "r", offset=begin, shape=shape)


def _read_header(directory: Path) -> dict[str, Any]:
    path = directory / RUN
    try:
        header: dict[str, Any] = json.loads(_read_small(path))
        if header["format"] == FORMAT and {"fingerprint", "run", "result"} <= header.keys():
            return header
    except FileNotFoundError:
        raise ModelError(f"{directory}: no run is stored there") from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    raise StoredRunError(f"{path}: is not a run's description; name another directory")


def _read_small(path: Path) -> bytes:
    """A file of ours that is never large: what is, or is no file, is none."""
    if path.is_symlink() or not stat.S_ISREG(path.stat().st_mode):
        return b""
    with path.open("rb") as file:
        return file.read(LARGEST_CHECKPOINT)


def _description(header: Mapping[str, Any]) -> RunDescription:
    run = header["run"]
    names = {key: tuple(run[key]) for key in ("labels", "excitations", "meshes", "recorded")}
    return RunDescription(**(run | names | {"integrator": Integrator(**run["integrator"])}))


def _write_npy_header(file: Any, shape: tuple[int, ...]) -> None:
    np.lib.format.write_array_header_1_0(
        file, {"descr": "<f8", "fortran_order": False, "shape": shape}
    )


def _judged(description: RunDescription, folded: Folded) -> tuple[float, tuple[str, ...]]:
    share, where = folded.worst(description.columns())
    return share, aliasing_warning(share, where, description.sampling_frequency)


def _size(description: RunDescription) -> int:
    return sum(8 * int(np.prod(shape)) for shape in description.shapes().values())


def _count(names: list[str], prefix: str) -> int:
    return sum(name.startswith(prefix) for name in names)


def _group(file: Any, prefix: str) -> dict[str, FloatArray]:
    return {
        name.removeprefix(f"{prefix} "): file[name]
        for name in file.files
        if name.startswith(f"{prefix} ")
    }


def start(description: RunDescription, state: State) -> Checkpoint:
    """Before the first sample."""
    columns = description.columns()
    followed = {what: names for what, names in columns.items() if what in SMOOTH}
    return Checkpoint(0, state, nothing_folded(followed))

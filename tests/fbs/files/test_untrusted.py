"""Files that would harm: one message, no memory, nothing executed."""

from __future__ import annotations

import io
import os
import pickle
import sys
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy
from scipy.io import savemat

from fbs import FbsError, Frf, Record
from fbs.files.frf_files import read_frf, write_frf
from fbs.files.record_files import read_record, write_record
from fbs.files.untrusted import PACKED_FREELY
from tests.fbs.files.foreign_files import Foreign, written

BILLION = 10**12
LITTLE = 4 * PACKED_FREELY  # bytes; up to PACKED_FREELY is unpacked before a ratio is judged


def header(shape: object, kind: str) -> bytes:
    buffer = io.BytesIO()
    npy.write_array_header_1_0(
        buffer,
        {"shape": shape, "fortran_order": False, "descr": kind},
    )
    return buffer.getvalue()


def zipped(path: Path, **arrays: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in arrays.items():
            archive.writestr(f"{name}.npy", content)
    return path


def labels() -> dict[str, bytes]:
    buffer = io.BytesIO()
    np.save(buffer, np.array(["a.w"]))
    return {"responses": buffer.getvalue(), "excitations": buffer.getvalue()}


def claiming(folder: Path) -> Path:
    many = header((BILLION,), "<f8")
    values = header((BILLION, 1, 1), "<c16")
    return zipped(folder / "x.npz", frequency=many, values=values, **labels())


def bomb(folder: Path) -> Path:
    """300 MB of zeros in 300 kB, announced as they are."""
    n = 300 * 2**20 // 16
    values = header((n, 1, 1), "<c16") + bytes(16 * n)
    path = zipped(folder / "x.npz", frequency=header((n,), "<f8"), values=values, **labels())
    assert path.stat().st_size < 2**20
    return path


def nested(folder: Path) -> Path:
    content = bytes(4 * 2**20)
    for _ in range(3):
        inner = io.BytesIO()
        with zipfile.ZipFile(inner, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("frequency.npy", content)
        content = inner.getvalue()
    (folder / "x.npz").write_bytes(content)
    return folder / "x.npz"


class Harmful:
    def __reduce__(self) -> tuple[Callable[[str], object], tuple[str]]:
        return os.mkdir, (str(Path(os.environ["HARM"])),)


def pickled(folder: Path) -> Path:
    objects = np.array([Harmful()], dtype=object)
    content = header((1,), "|O") + pickle.dumps(objects)
    return zipped(folder / "x.npz", frequency=content, values=content, **labels())


def bare_pickle(folder: Path) -> Path:
    (folder / "x.npz").write_bytes(pickle.dumps(Harmful()))
    return folder / "x.npz"


def announcing(kind: str) -> Callable[[Path], Path]:
    def made(folder: Path) -> Path:
        text = Foreign().text()
        count = f"{5:10d}{500:10d}"
        assert count in text
        text = text.replace(count, f"{5:10d}{9_999_999_999:10d}")
        if kind == "binary":
            text = text.replace(f"{58:6d} ", f"{58:6d}b{1:6d}{2:6d}{11:12d}{8:12d}", 1)
        return written(folder / "x.uff", text)

    return made


def matlab_claim(folder: Path) -> Path:
    """A cell array whose header claims 2e9 cells."""
    path = folder / "x.mat"
    savemat(path, {"frequency": np.array(["a", "b"], dtype=object)}, do_compression=False)
    content = bytearray(path.read_bytes())
    dims = np.array([1, 2], "<i4").tobytes()
    at = content.index(dims)
    content[at : at + 8] = np.array([1, 2_000_000_000], "<i4").tobytes()
    path.write_bytes(content)
    return path


def matlab_bomb(folder: Path) -> Path:
    path = folder / "x.mat"
    savemat(path, {"values": np.zeros(2**20)}, do_compression=True)
    content = path.read_bytes()
    packer = zlib.compressobj()
    body = b"".join(packer.compress(bytes(2**20)) for _ in range(300)) + packer.flush()
    path.write_bytes(content[:128] + np.array([15, len(body)], "<u4").tobytes() + body)
    return path


def matlab_structure(folder: Path) -> Path:
    savemat(folder / "x.mat", {"values": {"a": 1.0}})
    return folder / "x.mat"


def matlab_cut(folder: Path) -> Path:
    savemat(folder / "x.mat", {"values": np.ones(1000)})
    (folder / "x.mat").write_bytes((folder / "x.mat").read_bytes()[:-100])
    return folder / "x.mat"


def hdf5_claim(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "x.mat", "w") as file:
        file.create_dataset("frequency", (BILLION,), "f8", chunks=(2**16,), compression="gzip")
    return folder / "x.mat"


def hdf5_link(folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "x.mat", "w") as file:
        file["frequency"] = h5py.ExternalLink("/etc/passwd", "/")
    return folder / "x.mat"


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "x.uff")
    return folder / "x.uff"


def device(folder: Path) -> Path:
    (folder / "x.csv").symlink_to("/dev/zero")
    return folder / "x.csv"


def large(folder: Path) -> Path:
    """A file of holes."""
    with (folder / "x.uff").open("wb") as file:
        file.truncate(2**43)
    return folder / "x.uff"


def deep(folder: Path) -> Path:
    (folder / "x.csv").write_text("[" * 100_000)
    return folder / "x.csv"


HARM = [
    (claiming, "announces 1000000000000 values; the 0 bytes that follow hold at most 0"),
    (bomb, "unpacks from .* MiB to more than 100 times that, which no measurement does"),
    (nested, "there is no array values"),
    (pickled, "its array frequency holds Python objects"),
    (bare_pickle, r"the file is damaged, or no \.npz"),
    (announcing("ascii"), "announces 9999999999 values"),
    (announcing("binary"), "announces 9999999999 values|record|is '"),
    (matlab_claim, "the cell array frequency announces 2000000000 values"),
    (matlab_bomb, "a variable unpacks from .* which no measurement does"),
    (matlab_structure, "the variable values is a structure, an object or a function"),
    (matlab_cut, "the file is cut short|damaged"),
    (hdf5_claim, "the variable frequency unpacks to .* GiB|announces 1000000000000 values"),
    (hdf5_link, "the variable frequency is a link to somewhere else"),
    (pipe, "it is a device or a pipe, no file"),
    (device, "it is a device or a pipe, no file"),
    (large, "it has 8.19e.03 GiB; at most 4 GiB are read"),
    (deep, "there are no rows below the header"),
]


@pytest.mark.parametrize(
    ("program", "words"),
    [
        ("import os; os.abort()", r"the file is damaged \(HDF5 ends with it, -6\)"),
        ("import time; time.sleep(60)", r"the file is damaged \(HDF5 is not done with it"),
    ],
)
def test_a_file_that_ends_hdf5s_library_ends_nothing_else(
    program: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What damaged files do to it, done by an h5py of that name."""
    (tmp_path / "h5py.py").write_text(program)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "h5py", raising=False)
    monkeypatch.setattr("fbs.files.hdf5.LONGEST", 5.0)
    path = tmp_path / "x.mat"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(FbsError, match=words):
        read_frf(path)


@pytest.mark.parametrize(("made", "words"), HARM)
@pytest.mark.parametrize("read", [read_frf, read_record])
def test_harm_is_refused(
    made: Callable[[Path], Path],
    words: str,
    read: Callable[[Path], object],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("HARM", str(tmp_path / "harm"))
    path = made(tmp_path)
    tracemalloc.start()
    try:
        with pytest.raises(FbsError, match=words if read is read_frf else None) as caught:
            read(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    message = str(caught.value)
    assert message.startswith(str(path))
    assert message.count(str(path)) == 1
    assert "\n" not in message
    assert len(message) < 600
    assert peak < LITTLE
    assert not (tmp_path / "harm").exists()


# --- damage of any kind ------------------------------------------------------------------------

PIECES = (b"-1\n", b"    -1\n", b"99999999999", b"nan", b"\n", b"\r", b";", b"D", b"-", b"\0" * 8)


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    found = bytearray(content)
    for _ in range(rng.integers(1, 6)):
        at, kind = int(rng.integers(len(found))), rng.integers(5)
        if kind == 0:
            found[at] = rng.integers(256)
        elif kind == 1:
            del found[at : at + int(rng.integers(1, 40))]
        elif kind == 2:
            found[at:at] = rng.bytes(int(rng.integers(1, 12)))
        elif kind == 3:
            found[at:at] = PIECES[rng.integers(len(PIECES))]
        else:
            found = found[: max(1, at)]
        found = found or bytearray(b"x")
    return bytes(found)


@pytest.mark.parametrize("ending", [".uff", ".npz", ".mat", ".csv", ".wav"])
@pytest.mark.parametrize("read", [read_frf, read_record])
def test_damaged_files_end_in_one_message(
    ending: str, read: Callable[[Path], object], tmp_path: Path
) -> None:
    """A flipped bit may leave a sound file; whatever it leaves, nothing else is raised."""
    path = tmp_path / f"x{ending}"
    rng = np.random.default_rng(21)
    values = rng.normal(size=(12, 2, 1)) + 1j * rng.normal(size=(12, 2, 1))
    if read is read_frf:
        if ending == ".wav":
            return  # holds records only
        write_frf(Frf(np.arange(1.0, 13.0), values, ("a.w", "b"), ("a.w",)), path)
    else:
        samples = rng.normal(size=(20, 3))
        write_record(
            Record(100.0, samples[:, :1], samples[:, 1:], ("f",), ("x", "y"), "mobility"), path
        )
    content = path.read_bytes()
    for _ in range(150):
        path.write_bytes(damaged(content, rng))
        try:
            read(path)
        except FbsError as error:
            assert str(error).startswith(str(path))  # noqa: PT017  # not every file is damaged
            assert "\n" not in str(error)  # noqa: PT017

"""Files of FRFs, records and forces, changed."""

from __future__ import annotations

import io
import random
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from fbs import Quantity, Record, read_uff
from fbs.files.frf_files import read_frf
from fbs.files.record_files import read_record, write_record
from mbs_models.model.model_file import load
from validation.routes.substitution import read_substitutions

from .mutations import changed_bytes, changed_text, odd_text
from .trial import DOFS, SMALL, Fault, command, ended, refused_or


@cache
def _frf_files() -> Mapping[str, bytes]:
    """Files as `crosscheck frf` writes them."""
    import tempfile

    found = {}
    with tempfile.TemporaryDirectory() as name:
        for ending in (".npz", ".uff"):
            file = Path(name, f"part{ending}")
            command(
                "frf",
                "paper",
                "--stage",
                "planetary",
                "--response",
                "all",
                "--excitation",
                "all",
                "--df",
                "500",
                "--output",
                str(file),
            )
            found[ending] = file.read_bytes()
    return found


@cache
def _frf_arrays() -> Mapping[str, np.ndarray]:
    with np.load(io.BytesIO(_frf_files()[".npz"])) as file:
        return {name: file[name] for name in file.files}


@cache
def _hdf5_file() -> bytes:
    """FRFs as MATLAB 7.3 writes them: numbers and a cell of text."""
    import h5py

    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        file["frequency"] = np.arange(1.0, 21.0)[None, :]
        file["values"] = np.ones((1, 1, 20), dtype=[("real", "f8"), ("imag", "f8")])
        file["#refs#/a"] = np.array([[ord("a")]], dtype="u2")
        label = np.array([[file["#refs#/a"].ref]], dtype=h5py.ref_dtype)
        for name in ("responses", "excitations"):
            file.create_dataset(name, data=label)
        file["quantity"] = np.array([[ord(letter)] for letter in "mobility"], dtype="u2")
        file["quantity"].attrs["MATLAB_class"] = np.bytes_("char")
    return content.getvalue()


def hdf5_files(rng: random.Random, folder: Path) -> str:
    """A file of MATLAB 7.3, changed."""
    file = folder / "frf.mat"
    file.write_bytes(changed_bytes(rng, _hdf5_file()))
    return refused_or(lambda: read_frf(file))


def frf_files(rng: random.Random, folder: Path) -> str:
    """A part's FRFs, changed, in the part's place: refused, or as they were where nothing shows."""
    ending = rng.choice((".npz", ".uff"))
    content = _frf_files()[ending]
    if ending == ".uff" and rng.random() < 0.6:
        content = changed_text(rng, content.decode()).encode(errors="replace")
    elif ending == ".npz" and rng.random() < 0.4:
        content = _other_arrays(rng)
    else:
        content = changed_bytes(rng, content)
    file = folder / f"part{ending}"
    file.write_bytes(content)
    return refused_or(lambda: read_substitutions(load("paper"), [f"planetary={file}"]))


def _other_arrays(rng: random.Random) -> bytes:
    """Whole archives of arrays that are not as they should be."""
    arrays = dict(_frf_arrays())
    name = rng.choice(list(arrays))
    value = arrays[name]
    match rng.randrange(8):
        case 0:
            del arrays[name]
        case 1:
            arrays[name] = np.atleast_1d(value)[..., :-1]
        case 2:
            arrays[name] = value.ravel()
        case 3:
            arrays[name] = np.flip(value)
        case 4:
            arrays[name] = np.array(odd_text(rng).encode(errors="replace").decode())
        case 5:
            arrays[name] = np.full(value.shape, rng.choice((np.nan, np.inf, 1e300, 0.0, -1.0)))
        case 6:
            arrays[name] = np.full(value.shape, odd_text(rng)[:50].replace("\ud800", ""))
        case _:
            arrays[name] = np.zeros((0, *value.shape[1:]), value.dtype)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    return file.getvalue()


@cache
def _record_files() -> Mapping[str, bytes]:
    import tempfile

    rng = np.random.default_rng(1)
    record = Record(
        1000.0,
        rng.normal(size=(256, 1)),
        rng.normal(size=(256, 2)),
        ("a.w",),
        ("a.w", "b.w"),
        Quantity.MOBILITY,
    )
    found = {}
    with tempfile.TemporaryDirectory() as name:
        for ending in (".npz", ".csv", ".uff"):
            file = Path(name, f"record{ending}")
            write_record(record, file)
            found[ending] = file.read_bytes()
    return found


def record_files(rng: random.Random, folder: Path) -> str:
    """A record, changed."""
    ending = rng.choice((".npz", ".csv", ".uff"))
    content = _record_files()[ending]
    if ending != ".npz" and rng.random() < 0.6:
        content = changed_text(rng, content.decode()).encode(errors="replace")
    else:
        content = changed_bytes(rng, content)
    file = folder / f"record{ending}"
    file.write_bytes(content)
    reader = rng.choice((read_record, read_record, read_uff if ending == ".uff" else read_record))
    return refused_or(lambda: reader(file))


def force_files(rng: random.Random, folder: Path) -> str:
    """A force over time as an excitation of a run."""
    time = np.arange(200) / 5000.0
    rows = "\n".join(f"{t:.6g},{np.sin(600.0 * t):.6g}" for t in time)
    file = folder / "force.csv"
    file.write_bytes(changed_text(rng, f"time,force\n{rows}\n").encode(errors="replace"))
    spec = f"record@{DOFS[0]}:file={file}"
    called = command(
        "simulate",
        SMALL,
        "--excitation",
        spec,
        "--duration",
        "0.04",
        "--once",
        "--out",
        "out",
        "--sampling",
        "10000",
        "--response",
        DOFS[0],
    )
    if called.code == 2 and list(Path("out").glob("*")):
        raise Fault(f"refused, and files are left: {list(Path('out').glob('*'))}")
    return ended(called)

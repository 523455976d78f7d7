"""Files of FRFs that are none: one message in our own words, the file named once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fbs import Frf
from tests.validation.command_line import call
from validation.errors import CommandError
from validation.inspection.frf_output import write
from validation.routes.frf_input import read

FRF = Frf([1.0, 2.0], np.ones((2, 1, 1), complex), ("a.w",), ("a.w",))


def junk(path: Path) -> None:
    path.write_bytes(b"no file of FRFs\n" * 10)


def empty(path: Path) -> None:
    path.touch()


def cut(path: Path) -> None:
    write(FRF, path, "")
    path.write_bytes(path.read_bytes()[:-200])


def flipped(path: Path) -> None:
    """One bit of the compressed values is another."""
    values = np.random.default_rng(1).normal(size=(100, 1, 1)) + 0j
    write(Frf(np.arange(1.0, 101.0), values, ("a.w",), ("a.w",)), path, "")
    content = bytearray(path.read_bytes())
    content[content.index(b"values.npy") + 400] ^= 1
    path.write_bytes(content)


def objects(path: Path) -> None:
    np.savez(path, frequency=np.array([{}]), values=1j, responses="a.w", excitations="a.w")


def nameless(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.ones(3))


NPZ = "the file is damaged, or no .npz"
FAULTS = [
    (junk, ".npz", NPZ),
    (empty, ".npz", NPZ),
    (cut, ".npz", "the file is damaged"),
    (flipped, ".npz", "the file is damaged"),
    (objects, ".npz", "its array frequency holds Python objects; it must be real numbers (Hz)"),
    (nameless, ".npz", "it is one array without names; needed are frequency, values"),
    (junk, ".uff", "it is no universal file: there are no datasets at all"),
    (empty, ".uff", "no FRF (dataset 58, function type 4) inside"),
    (cut, ".uff", "the file is truncated: its last dataset has no end"),
]


@pytest.mark.parametrize(("made", "ending", "words"), FAULTS)
def test_what_is_no_frf_is_told_once(
    made: Callable[[Path], None], ending: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / f"broken{ending}"
    made(path)
    with pytest.raises(CommandError) as told:
        read(path)
    message = str(told.value)
    assert message.startswith(f"{path}: {words}")
    assert message.count(str(path)) == 1
    assert "pickle" not in message
    assert "\n" not in message


def test_run_names_the_file_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "broken.uff"
    cut(path)
    assert call("run", "--replace", f"planetary={path}", "--out", str(tmp_path / "out")) == 2
    told = capsys.readouterr().err
    assert told == f"crosscheck: {path}: the file is truncated: its last dataset has no end\n"
    assert not (tmp_path / "out").exists()

"""No command deletes, follows or overwrites what it did not create, nor shares its folder."""

from __future__ import annotations

import hashlib
import os
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fbs.files.whole_files import require_writable, written_whole
from mbs_models.model.model_file import dumps
from tests.gearboxes import ERROR, pair
from tests.validation.command_line import call
from validation.runtime.output_folder import (
    LOCK,
    MARK,
    MARKER,
    WORK,
    ReportError,
    held,
    write_together,
)

W = "planetary.sun.w"
SPRING = "coupling.second_stiffness"
FRF = ("--response", W, "--excitation", W, "--df", "50", "--fmax", "1000")
SWEEP = ("sweep", "paper", "--vary", f"{SPRING}=1e5,1e6", *FRF, "--route", "equations")
COMMANDS = {
    "run": (("run", "lin-parker-3", "--no-time", "--fmax", "500", "--df", "10"), "report.html"),
    "paper": (("paper", "--only", "fig8"), "paper.html"),
    "speed": (("speed", "MODEL", "--speed", "600"), "speed.npz"),
    "sweep": (SWEEP, "sweep.csv"),
    "streamed": ((*SWEEP, "--stream"), "magnitude.npy"),
    "simulate": (
        ("simulate", "lin-parker-4", "--excitation", f"multisine@{W}:fmin=50,fmax=2000,df=50",
         "--save", "csv", "--once"), "record.csv",
    ),
}  # fmt: skip
posix = pytest.mark.skipif(os.name == "nt", reason="modes, masks and links are POSIX' own")


def command(name: str, folder: Path) -> list[str]:
    """A command line into ``folder/out``, and a model file for the one that needs it."""
    model = folder / "model.toml"
    model.write_text(dumps(pair(mesh_transmission_error=ERROR)), encoding="utf-8")
    words = [str(model) if word == "MODEL" else word for word in COMMANDS[name][0]]
    return [*words, "--out", str(folder / "out")]


@pytest.fixture
def umask() -> Iterator[int]:
    before = os.umask(0o027)
    yield 0o027
    os.umask(before)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


# --- every command ------------------------------------------------------------------------------


@posix
@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_foreign_stays(name: str, tmp_path: Path, umask: int) -> None:
    """Files, folders and links where earlier versions removed, followed or overwrote them."""
    out, outside = tmp_path / "out", tmp_path / "outside"
    (out / "pieces" / "photos").mkdir(parents=True)
    (out / "pieces" / "photos" / "1.jpg").write_bytes(b"photo")
    written = COMMANDS[name][1]
    foreign = {"magnitude.npy", "bands.svg", "frf_map.svg", "speed.npz", "record.npz"} - {
        "frf_map.svg" if name in ("sweep", "streamed") else "",
        written,
    }
    for other in foreign:
        (out / other).write_bytes(b"mine")
    outside.write_bytes(b"outside")
    for link in (written, f".{written}.partial"):
        (out / link).symlink_to(outside)
    before = contents(out / "pieces")

    assert call(*command(name, tmp_path)) == 0

    assert contents(out / "pieces") == before
    assert {(out / other).read_bytes() for other in foreign} == {b"mine"}
    assert outside.read_bytes() == b"outside"
    assert (out / f".{written}.partial").is_symlink()
    # a link of a result's name is replaced itself
    assert not (out / written).is_symlink()
    assert stat.S_IMODE((out / written).stat().st_mode) == 0o666 & ~umask
    assert not (out / WORK).exists()


@posix
@pytest.mark.parametrize("name", COMMANDS)
def test_a_read_only_result_is_refused_first(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, written = tmp_path / "out", COMMANDS[name][1]
    out.mkdir()
    (out / written).write_bytes(b"mine")
    (out / written).chmod(0o400)
    assert call(*command(name, tmp_path)) == 2
    assert f"{out / written}: cannot be written: it is read-only" in capsys.readouterr().err
    assert contents(out) == {written: b"mine"}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_private_folder_of_others_is_refused_first(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out" / WORK).mkdir(parents=True)
    (tmp_path / "out" / WORK / "1.jpg").write_bytes(b"photo")
    assert call(*command(name, tmp_path)) == 2
    assert f"{WORK}: is not crosscheck's, which needs that name" in capsys.readouterr().err
    assert contents(tmp_path / "out") == {str(Path(WORK, "1.jpg")): b"photo"}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_folder_written_to_is_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with held(out, ()):
        assert call(*command(name, tmp_path)) == 2
        error = capsys.readouterr().err
        *warnings, message = error.splitlines()
        assert f"{out}: another command writes there (process {os.getpid()} on " in message
        assert all(line.startswith("warning: ") for line in warnings)
    assert list(out.iterdir()) == []


# --- the lock -----------------------------------------------------------------------------------

HOLD = """
import sys
from pathlib import Path
from validation.runtime.output_folder import held
with held(Path(sys.argv[1]), ()) as work:
    (work / "piece").write_bytes(b"kept")
    print("held", flush=True)
    sys.stdin.read()
"""


def holding(out: Path) -> subprocess.Popen[str]:
    """Another process that holds a folder until it is told to end."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(out)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_of_two_processes_the_second_is_refused(tmp_path: Path) -> None:
    with holding(tmp_path) as first:
        said = f"another command writes there .process {first.pid}"
        with pytest.raises(ReportError, match=said), held(tmp_path, ()):
            pass
        first.communicate()
    with held(tmp_path, ()) as work:
        assert (work / "piece").read_bytes() == b"kept"


@posix
def test_the_lock_of_a_killed_process_is_taken_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with holding(tmp_path) as first:
        first.send_signal(signal.SIGKILL)
        first.communicate()
    assert (tmp_path / WORK / LOCK).exists()
    with held(tmp_path, ()) as work:
        told = capsys.readouterr().err
        assert f"taken over from a command that was killed (process {first.pid} on " in told
        (work / "piece").unlink()
    assert list(tmp_path.iterdir()) == []


def test_only_what_was_made_is_removed(tmp_path: Path) -> None:
    with held(tmp_path, ()) as work:
        (work / "photo").write_bytes(b"mine")
    assert contents(tmp_path / WORK) == {MARKER: MARK.encode(), "photo": b"mine"}


@posix
@pytest.mark.parametrize("kind", ["folder", "lock"])
def test_planted_links_are_not_followed(kind: str, tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (elsewhere / MARKER).write_bytes(MARK.encode())
    if kind == "folder":
        (out / WORK).symlink_to(elsewhere)
    else:
        (out / WORK).mkdir()
        (out / WORK / MARKER).write_bytes(MARK.encode())
        (out / WORK / LOCK).symlink_to(elsewhere / "new")
    with pytest.raises(ReportError), held(out, ()):
        pass
    assert contents(elsewhere) == {MARKER: MARK.encode()}


@posix
def test_the_private_folder_is_private(tmp_path: Path) -> None:
    with held(tmp_path, ()) as work:
        assert stat.S_IMODE(work.stat().st_mode) == 0o700


# --- sweeps and simulations, run after one another ----------------------------------------------


def test_a_picture_of_an_earlier_sweep_that_was_changed_stays(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert call(*command("streamed", tmp_path)) == 0
    assert {"magnitude.npy", "frf_map.svg"} <= {path.name for path in out.iterdir()}
    (out / "frf_map.svg").write_bytes(b"mine")
    options = ("--vary", f"{SPRING}=1e5±10%", "--samples", "3", *FRF, "--route", "equations")
    assert call("sweep", "paper", *options, "--out", str(out)) == 0
    assert (out / "frf_map.svg").read_bytes() == b"mine"
    assert not (out / "magnitude.npy").exists()


def test_a_foreign_list_of_files_removes_no_others(tmp_path: Path) -> None:
    """Only names that a sweep writes are looked for in what claims to be an earlier one's."""
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "photo").write_bytes(b"mine")
    digest = hashlib.sha256(b"mine").hexdigest()
    with (out / "sweep.npz").open("wb") as file:
        np.savez(file, files=np.array(["../photo"]), sha256=np.array([digest]))
    assert call(*command("sweep", tmp_path)) == 0
    assert (tmp_path / "photo").read_bytes() == b"mine"


# --- single files -------------------------------------------------------------------------------


@posix
@pytest.mark.parametrize("ending", [".npz", ".csv", ".uff", ".svg"])
def test_output_takes_the_mask_and_replaces_links(ending: str, tmp_path: Path, umask: int) -> None:
    outside, path = tmp_path / "outside", tmp_path / f"frf{ending}"
    outside.write_bytes(b"outside")
    path.symlink_to(outside)
    assert call("frf", "paper", *FRF, "--output", str(path)) == 0
    assert not path.is_symlink()
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask
    assert outside.read_bytes() == b"outside"
    assert {file.name for file in tmp_path.iterdir()} == {"outside", path.name}


@posix
def test_output_leaves_a_read_only_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "frf.csv"
    path.write_bytes(b"mine")
    path.chmod(0o400)
    assert call("frf", "paper", *FRF, "--output", str(path)) == 2
    assert f"--output = {path}: cannot be written: it is read-only" in capsys.readouterr().err
    assert contents(tmp_path) == {"frf.csv": b"mine"}


@posix
def test_a_pipe_is_no_file_to_replace(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(PermissionError, match="a device or a pipe"):
        require_writable(tmp_path / "pipe")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


def test_what_is_written_is_seen_by_nobody_until_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "result"
    path.write_bytes(b"old")
    with written_whole(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_bytes() == b"old"
    assert contents(tmp_path) == {"result": b"new"}

    def fail() -> None:
        with written_whole(path) as file:
            file.write(b"newer")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert contents(tmp_path) == {"result": b"new"}


def test_files_come_together_or_not_at_all(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    with pytest.raises(ReportError, match="b: cannot be written: it is a directory"):
        write_together(tmp_path, {"a": "new", "b": "new"})
    assert contents(tmp_path) == {}


@posix
@pytest.mark.parametrize("there", [True, False])
def test_new_follows_no_link(
    there: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str], umask: int
) -> None:
    outside, path = tmp_path / "outside", tmp_path / "gear.toml"
    if there:
        outside.write_bytes(b"outside")
    path.symlink_to(outside)
    before = contents(tmp_path)
    assert call("new", str(path)) == 2
    assert "gear.toml: exists already and is not overwritten" in capsys.readouterr().err
    assert path.is_symlink()
    assert contents(tmp_path) == before
    path.unlink()
    assert call("new", str(path)) == 0
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask

"""Folders that hold something already, and kept pieces that are not as they were."""

from __future__ import annotations

import random
import re
from functools import cache
from pathlib import Path

import numpy as np

from mbs_models.model.model_file import load
from validation.routes.bands import Band
from validation.runtime.kept import KeptPieces
from validation.sweep.parameters import Samples, samples_of
from validation.sweep.pieces import FIELDS, Pieces
from validation.sweep.plan import SampleResults, SweepPlan, sweep_plan
from validation.sweep.run import sweep

from .mutations import changed_bytes, odd_text
from .trial import ACCEPTED, DOFS, REFUSED, SMALL, Fault, command, ended


def folders(rng: random.Random, folder: Path) -> str:
    """Where results go: what lies there is left as it is."""
    theirs = {}
    out = folder / "out"

    def put(path: Path, content: bytes = b"theirs") -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            path.write_bytes(content)
            theirs[path] = content

    names_ = (
        "photo.jpg",
        "pieces/photo",
        "sweep/1.npz",
        "magnitude.npy",
        "bands.svg",
        "metrics.svg",
    )
    for name in rng.sample(names_, rng.randrange(len(names_))):
        put(out / name)
    target = str(out)
    match rng.randrange(9):
        case 0:
            put(out / ".crosscheck")
        case 1:
            put(out / ".crosscheck" / "marker.txt")
        case 2:
            (out / ".crosscheck").parent.mkdir(exist_ok=True)
            (out / ".crosscheck").symlink_to(folder)
        case 3:
            (out / rng.choice(("sweep.csv", "sweep.html", "sweep.npz"))).mkdir(parents=True)
        case 4:
            put(folder / "file")
            target = str(folder / "file" / "out")
        case 5:
            target = str(folder / ("x" * rng.choice((250, 256, 5000))))
        case 6:
            target = f"{folder}/{odd_text(rng)[:200]}"
        case 7:
            put(folder / "victim")
            out.mkdir(exist_ok=True)
            (out / "sweep.csv").symlink_to(folder / "victim")
        case _:
            out.mkdir(exist_ok=True)
            (out / "sweep.csv").write_bytes(b"")
            (out / "sweep.csv").chmod(0o400)
    line = ["sweep", SMALL, "--vary", "planetary.sun.mass=1,2", "--out", target, "--workers", "1"]
    if rng.random() < 0.3:
        line += ["--stream", "--response", DOFS[0], "--excitation", DOFS[0], "--df", "1000"]
        theirs.pop(out / "magnitude.npy", None)
    called = command(*line, within=(0, 2))
    written = {Path(name).name for name in re.split(r"[,\s]+", called.out)}
    for path, content in theirs.items():
        if path.name in written and path.parent == out:
            continue  # a result of this name takes its place
        if not path.is_file() or path.read_bytes() != content:
            raise Fault(f"{path} is not as it was ({called.code})")
    for path in folder.rglob("*.partial"):
        raise Fault(f"{path} is left")
    return ended(called)


@cache
def _swept() -> tuple[Samples, SweepPlan, SampleResults]:
    drivetrain = load(SMALL)
    found = samples_of(drivetrain, ["planetary.sun.mass=0.3:0.6:25"])
    todo = sweep_plan(
        drivetrain,
        found,
        Band(100.0, 2000.0, 100.0),
        (DOFS[0], DOFS[0]),
        4,
        "equations",
        streamed=True,
    )
    return found, todo, sweep(todo, found.rows)


def pieces(rng: random.Random, folder: Path) -> str:
    """A sweep's kept pieces, changed: the result is the same, whatever was there."""
    found, todo, expected = _swept()
    kept = Pieces(todo, found.rows, folder, streamed=True)
    room = kept.magnitude(expected.magnitude.shape)
    sweep(todo, found.rows, store=kept, magnitude=room)
    for _ in range(rng.choice((1, 2, 3))):
        _damage(rng, kept.directory)
    told: list[str] = []
    again = Pieces(todo, found.rows, folder, streamed=True)
    room = again.magnitude(expected.magnitude.shape)
    outcome = sweep(todo, found.rows, store=again, magnitude=room, warn=told.append)
    for name in FIELDS:
        if not np.array_equal(getattr(outcome, name), getattr(expected, name)):
            raise Fault(f"{name} is not what it was; told {told}")
    return REFUSED if told else ACCEPTED


def _damage(rng: random.Random, directory: Path) -> None:
    files = sorted(path for path in directory.iterdir() if path.is_file())
    if not files:
        return
    one, other = rng.choice(files), rng.choice(files)
    match rng.randrange(5):
        case 0:
            one.write_bytes(changed_bytes(rng, one.read_bytes()))
        case 1:
            content = one.read_bytes()
            one.write_bytes(other.read_bytes())
            other.write_bytes(content)
        case 2:
            one.unlink()
        case 3:
            one.unlink()
            one.symlink_to(rng.choice(("/dev/zero", "/dev/null", "/nowhere", str(directory))))
        case _:
            KeptPieces(directory, "another").save("0", {"status": np.array(["ok"])})

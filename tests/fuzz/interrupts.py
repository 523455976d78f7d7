"""`python -m tests.fuzz.interrupts N`: interrupt commands, and let the same commands go on.

Ctrl-C goes to all processes of a terminal, SIGTERM and SIGKILL to the command alone. After either
nothing of it runs 5 s later; the results of the same command, run again, are bit for bit those of
one that was not interrupted, and nothing else is left in the folder.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parents[2]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
PATIENCE = 5.0  # s until nothing is left
LONGEST = 300.0
VOLATILE = (
    "seconds",
    "made",
    "provenance",
    "timing",
    "date",
    "written",
)  # keys of JSON that tell of the run itself
SWEEP = (
    "sweep", "lin-parker-3", "--vary", "planetary.sun.mass=0.3:0.6:300", "--response",
    "planetary.sun.w", "--excitation", "planetary.sun.w", "--df", "50", "--out", "out",
)  # fmt: skip
COMMANDS: Mapping[str, tuple[str, ...]] = {
    "run": ("run", "lin-parker-3", "--df", "20", "--no-time", "--out", "out"),
    "simulate": (
        "simulate", "lin-parker-3", "--excitation", "noise@planetary.sun.w:fmax=2000", "--duration",
        "1.1", "--response", "planetary.sun.w", "--save", "npz", "--out", "out",
    ),
    "sweep": (*SWEEP, "--workers", "1"),
    "sweep, streamed": (*SWEEP, "--workers", "1", "--stream"),
    "sweep, two processes": (*SWEEP, "--workers", "2"),
    "sweep, two processes, streamed": (*SWEEP, "--workers", "2", "--stream"),
    "speed": ("speed", "paper-table2", "--speed", "600:1500:10", "--out", "out"),
}  # fmt: skip


@dataclass(frozen=True)
class Reference:
    """A command's results where nothing interrupts it, and how long it takes (s)."""

    results: Mapping[str, Any]
    seconds: float
    code: int


def command(name: str, folder: Path) -> subprocess.Popen[str]:
    """Start a command in a session of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "validation", *COMMANDS[name]],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(HERE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # what runs in the background of a shell inherits an ignored SIGINT
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def results(out: Path) -> dict[str, Any]:
    """What a command has found: arrays by their bits, JSON but for what tells of the run itself."""
    found: dict[str, Any] = {"names": sorted(path.name for path in out.iterdir())}
    for path in sorted(out.iterdir()):
        if path.suffix == ".npz":
            with np.load(path) as file:
                found[path.name] = {
                    n: (file[n].dtype.str, file[n].shape, file[n].tobytes())
                    for n in file.files
                    if n not in ("files", "sha256", "metadata")
                }
        elif path.suffix in (".csv", ".npy"):
            found[path.name] = path.read_bytes()
        elif path.suffix == ".json":
            found[path.name] = _lasting(json.loads(path.read_text(encoding="utf-8")))
    return found


def _lasting(value: Any) -> Any:
    if isinstance(value, dict):
        kept = {k: v for k, v in value.items() if not any(word in k for word in VOLATILE)}
        return {k: _lasting(v) for k, v in kept.items()}
    return [_lasting(item) for item in value] if isinstance(value, list) else value


def running(session: int) -> list[str]:
    """Command lines of what runs in a session."""
    return [line for sid, line in _processes() if sid == session]


def _processes() -> Iterator[tuple[int, str]]:
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, *rest = (entry / "stat").read_text().rpartition(")")[2].split()
                line = (entry / "cmdline").read_text().replace("\0", " ")
            except OSError:  # gone meanwhile
                continue
            if state != "Z":
                yield int(rest[2]), line


def reference(name: str) -> Reference:
    """Run a command to its end."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        process = command(name, Path(folder))
        _, told = process.communicate(timeout=LONGEST)
        if process.returncode not in (0, 1):
            raise RuntimeError(f"{name}: {process.returncode}: {told}")
        return Reference(
            results(Path(folder, "out")), time.perf_counter() - began, process.returncode
        )


def interrupted(name: str, number: int, whole: Reference) -> str:
    """Interrupt a command some times, let it go on, and say what is wrong ("": nothing)."""
    rng = random.Random(f"{name} {number}")
    with tempfile.TemporaryDirectory() as name_of_folder:
        folder = Path(name_of_folder)
        for _ in range(rng.choice((1, 1, 2))):
            sent = rng.choice(SIGNALS)
            process = command(name, folder)
            try:
                process.wait(rng.uniform(0.3, 1.0) * whole.seconds)
            except subprocess.TimeoutExpired:
                if sent == signal.SIGINT:
                    os.killpg(process.pid, sent)
                else:
                    process.send_signal(sent)
            began = time.perf_counter()
            _, told = process.communicate(timeout=LONGEST)
            took = time.perf_counter() - began
            allowed = (0, 1, 130, -sent)
            if process.returncode not in allowed or "fault of crosscheck" in told:
                return f"{sent.name}: exit code {process.returncode}: {told}"
            if process.returncode == 130 and took > 2.0 * PATIENCE:
                return f"{sent.name}: took {took:.1f} s to end"
            while running(process.pid) and time.perf_counter() - began < took + PATIENCE:
                time.sleep(0.05)
            if left := running(process.pid):
                os.killpg(process.pid, signal.SIGKILL)
                return f"{sent.name}: still runs after {PATIENCE:g} s: {left}"
        process = command(name, folder)
        _, told = process.communicate(timeout=LONGEST)
        if process.returncode != whole.code:
            return f"resumed: exit code {process.returncode}: {told}"
        found = results(folder / "out")
        wrong = [key for key in whole.results if found.get(key) != whole.results[key]]
        return f"resumed: other {', '.join(wrong)}: {found['names']}" if wrong else ""


def killed_with_workers(folder: Path) -> None:
    """Kill a sweep on two processes, and assert that both are gone soon after.

    Raises
    ------
    AssertionError
        They are not, or never began.
    """
    process = command("sweep, two processes", folder)
    patience = time.perf_counter() + LONGEST
    while not list(folder.rglob("*.piece")) and time.perf_counter() < patience:
        assert process.poll() is None, process.communicate()
        time.sleep(0.05)
    assert len(running(process.pid)) >= 3, "no workers"
    process.kill()
    patience = time.perf_counter() + PATIENCE
    while running(process.pid) and time.perf_counter() < patience:
        time.sleep(0.05)
    left = running(process.pid)
    if left:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not left


def main(count: int) -> int:
    """Interrupt so often; print the table and what was wrong."""
    print("| command | interrupted | wrong |\n| --- | --- | --- |")
    total = 0
    for index, name in enumerate(COMMANDS):
        tries = range(index, count, len(COMMANDS))
        whole = reference(name)
        wrong = [
            f"{number}: {said}" for number in tries if (said := interrupted(name, number, whole))
        ]
        total += len(wrong)
        print(f"| {name} | {len(tries)} | {len(wrong)} |", flush=True)
        print("\n".join(wrong), file=sys.stderr, flush=True)
    return int(total > 0)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))

"""Inputs that only a process of its own can be given: streams, environment, limits."""

from __future__ import annotations

import os
import random
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from .trial import ACCEPTED, REFUSED, Fault, Trial

CODES = (0, 1, 2, 130, 141)


def streams(rng: random.Random, folder: Path) -> str:
    """Streams that are closed, full, cut off or know few characters; other environments."""
    command = rng.choice(
        (
            "check /no/such.toml",
            "presets",
            "modes lin-parker-3",
            "schema",
            "check paper",
            "rnu",
            "frf lin-parker-3 --response all --excitation planetary.sun.w --df 1000 --output a.svg",
            "sweep lin-parker-3 --vary planetary.sun.mass=1,2 --out out --workers 1",
            "run lin-parker-3 --df 1000 --no-time --out out",
        )
    )
    redirect = rng.choice(
        (
            ">/dev/full",
            ">&-",
            "2>&-",
            "2>/dev/full",
            ">&- 2>&-",
            "<&- >&- 2>&-",
            "| head -c 10",
            "2>&1 | head -c 1",
            ">/dev/null",
            "",
            "",
        )
    )
    environment = rng.choice(
        (
            {},
            {"PYTHONIOENCODING": "ascii"},
            {"PYTHONIOENCODING": "latin-1"},
            {"LC_ALL": "C", "PYTHONUTF8": "0"},
            {"MPLBACKEND": "nonsense"},
            {"MPLBACKEND": "TkAgg"},
            {"HOME": "/nonexistent"},
            {"HOME": ""},
            {"TERM": "dumb"},
            {"TERM": ""},
            {"COLUMNS": "1"},
            {"COLUMNS": "-5"},
            {"NO_COLOR": "1"},
            {"TMPDIR": "/nonexistent"},
            {"MPLCONFIGDIR": "/proc/1/nothing"},
            {"OMP_NUM_THREADS": "x"},
            {"FORCE_COLOR": "1"},
            {"LANG": "nonsense"},
        )
    )
    limit = rng.choice(
        ("", "", "", "ulimit -n 24; ", "ulimit -f 1; ", "ulimit -f 0; ", "ulimit -v 2000000; ")
    )
    python = shlex.quote(sys.executable)
    line = f"{limit}{python} -m validation {command} {redirect}; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", line],
        capture_output=True,
        timeout=60,
        check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), **environment},
    )
    told = done.stderr.decode(errors="replace")
    shown = f"{environment} {line}: {done.returncode}: {told[-2000:]}"
    if done.returncode not in CODES or "Traceback" in told or "Exception ignored" in told:
        raise Fault(shown)
    bad = command.startswith(("check /no", "rnu"))
    if bad and done.returncode != 2:
        raise Fault(f"bad input: {shown}")
    if done.returncode == 1:
        raise Fault(f"a disagreement: {shown}")
    for path in Path("out").glob("*") if Path("out").exists() else ():
        if path.suffix in (".html", ".json") and path.stat().st_size < 1000:
            raise Fault(f"{path} is half written: {shown}")
    return REFUSED if done.returncode == 2 else ACCEPTED


PROCESSES: Mapping[str, tuple[Trial, int]] = {"streams and environment": (streams, 2)}

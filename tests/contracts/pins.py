"""What is pinned: command lines to run, and the texts in ``expected/`` they are compared with."""

from __future__ import annotations

import ast
import contextlib
import difflib
import io
import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import fbs
import mbs_models
import validation
from validation import cli

from .faces import READERS, Lines, command_names, json_lines, option_lines, schema_lines

HERE = Path(__file__).parent
README = HERE.parents[1] / "README.md"
MODELS = HERE / "models"
EXPECTED = HERE / "expected"
HEAD = "# Renewed, where a change is meant, by: python -m tests.contracts.renew"

PACKAGES = (mbs_models, fbs, validation)

Sections = dict[str, Lines]


@dataclass(frozen=True)
class Called:
    """How a command line ended, and what it printed."""

    code: int
    out: str
    err: str


def call(*arguments: str) -> Called:
    """Run the command line in this process."""
    code = 0
    with (
        contextlib.redirect_stdout(io.StringIO()) as out,
        contextlib.redirect_stderr(io.StringIO()) as err,
    ):
        try:
            cli.main(list(arguments))
        except SystemExit as exit_:
            code = int(exit_.code or 0)
    return Called(code, out.getvalue(), err.getvalue())


@dataclass(frozen=True)
class Pin:
    """Command lines whose files, or whose printed text, are pinned.

    Attributes
    ----------
    lines
        With ``{out}`` (the folder that is read), ``{aside}`` (another one), ``{models}``, and
        ``{soft}``, pair.toml with a softer mesh.
    printed
        Reads what the last one prints.
    slow
        Takes more than a few seconds.
    """

    lines: tuple[str, ...]
    printed: Callable[[str], Lines] | None = None
    slow: bool = False

    def sections(self, folder: Path) -> Sections:
        """Run them all, each to its exit code 0, and read what is there."""
        places = {"out": folder / "out", "aside": folder / "aside", "models": MODELS}
        for name in ("out", "aside"):
            places[name].mkdir()
        places["soft"] = folder / "soft.toml"
        own = (MODELS / "pair.toml").read_text(encoding="utf-8")
        places["soft"].write_text(own.replace("2.0e8", "1.5e8"), encoding="utf-8")
        for line in self.lines:
            called = call(*(word.format(**places) for word in shlex.split(line)))
            assert called.code == 0, f"crosscheck {line}: {called}"
        paths = sorted(places["out"].iterdir())
        found = {"files": [path.name for path in paths]} if paths else {}
        found |= {p.name: READERS[p.suffix](p) for p in paths if p.suffix in READERS}
        return found | ({"printed": self.printed(called.out)} if self.printed else {})


STAGE_FILES = tuple(
    f"frf lin-parker-3 --response {dofs} --excitation {dofs} --fmin 100 --fmax 3000 --df 100"
    f" --output {{aside}}/{name}.npz"
    for name, dofs in (
        ("sun", "planetary.sun.w,planetary.carrier.w"),
        ("planet", "planetary.ring.w,planetary.planet1.v"),
    )
)
"""FRFs of two parts, such as tests would give."""

PINS: Mapping[str, Pin] = {
    "run": Pin(("run {models}/pair.toml --fmin 40 --fmax 4000 --df 40 --out {out}",)),
    "run-replace": Pin(
        (
            "frf {soft} --stage pair --response all --excitation all"
            " --fmin 40 --fmax 4000 --df 40 --output {aside}/soft.npz",
            "run {models}/pair.toml --replace pair={aside}/soft.npz --noise 1%,1deg --out {out}",
        )
    ),
    "modes": Pin(("modes {models}/pair.toml --torque 100 --json",), printed=json_lines),
    "frf": Pin(
        tuple(
            "frf lin-parker-3 --response planetary.sun.w,planetary.ring.w"
            f" --excitation planetary.sun.w --df 100 {option} --output {{out}}/{name}"
            for name, option in (
                ("x.npz", ""),
                ("x.csv", ""),
                ("mobility.csv", "--quantity mobility"),
                ("accelerance.csv", "--quantity accelerance"),
                ("x.uff", ""),
                ("x.svg", ""),
            )
        )
    ),
    "paper": Pin(("paper --out {out}",), slow=True),
    "paper-only": Pin(("paper --only table3 --out {out}",)),
    "simulate": Pin(
        (
            "simulate lin-parker-3 --excitation multisine@planetary.sun.w:fmin=100,fmax=2000,df=100"
            " --response planetary.sun.w,planetary.ring.w --levels 1,10"
            " --save npz --save csv --save uff --out {out}",
        )
    ),
    "simulate-at-speed": Pin(
        # Long enough for four turns of the carrier, without which no sidebands are told.
        (
            "simulate {models}/planetary.toml --speed 6000 --torque 100 --duration 0.25"
            " --fmax 4000 --out {out}",
        ),
        slow=True,
    ),
    "speed": Pin(
        (
            "speed {models}/pair.toml --speed 1000:4000:500 --check 1500 --harmonics 2"
            " --executor serial --out {out}",
        )
    ),
    "sweep": Pin(
        (
            "sweep {models}/pair.toml --vary pair.mesh_stiffness=1e8:3e8:3 --vary"
            " pair.pinion.mass=1±5% --samples 4 --df 50 --fmax 2000 --modes 3 --response"
            " pair.pinion.w --excitation pair.pinion.w --metric peak --metric rms:100:1000"
            " --metric mean:100:1000 --metric level:100 --metric drop:100 --metric frequency:2"
            " --executor serial --out {out}",
        )
    ),
    "sweep-stream": Pin(
        (
            "sweep {models}/pair.toml --vary pair.mesh_stiffness=1e8:3e8:3 --df 50 --fmax 2000"
            " --response pair.pinion.w --excitation pair.pinion.w --modes 0 --stream"
            " --executor serial --out {out}",
        )
    ),
    "explain": Pin(
        (
            "frf {soft} --response pair.pinion.w,pair.wheel.y --excitation pair.pinion.w"
            " --fmin 40 --fmax 4000 --df 40 --output {aside}/theirs.npz",
            "explain {models}/pair.toml {aside}/theirs.npz --out {out}",
        )
    ),
    "truncate": Pin(
        ("truncate {models}/pair.toml --band 40:4000:40 --tolerance 0.1dB --out {out}",)
    ),
    "explore": Pin(("explore {models}/pair.toml --out {out}",)),
    "couple": Pin(
        (
            *STAGE_FILES,
            "couple {aside}/sun.npz {aside}/planet.npz --at planetary.sun.w=planetary.ring.w"
            " --joint 1e6,10 --noise 1% --output {out}/x.npz --out {out}",
        )
    ),
    "decouple": Pin(
        (
            *STAGE_FILES,
            "couple {aside}/sun.npz {aside}/planet.npz --at planetary.sun.w=planetary.ring.w"
            " --output {aside}/ab.npz --out {aside}/couple",
            "decouple {aside}/ab.npz {aside}/planet.npz --at planetary.sun.w=planetary.ring.w"
            " --output {out}/x.npz --out {out}",
        )
    ),
    "identify": Pin(
        (
            *STAGE_FILES,
            "couple {aside}/sun.npz {aside}/planet.npz --at planetary.sun.w=planetary.ring.w"
            " --joint 1e6,10 --output {aside}/ab.npz --out {aside}/couple",
            "identify {aside}/ab.npz {aside}/sun.npz {aside}/planet.npz"
            " --at planetary.sun.w=planetary.ring.w --noise 1% --output {out}/x.csv --out {out}",
        )
    ),
    "reduce": Pin(
        (
            "reduce paper --stage planetary --band 100:3000:100 --sizes 8,16"
            " --output {out}/x.npz --out {out}",
        )
    ),
    "schema": Pin(("schema",), printed=schema_lines),
}


def option_sections() -> Sections:
    """The commands, and everything that can follow each."""
    names = command_names()
    found = {"commands": names, "crosscheck": option_lines()}
    return found | {name: option_lines(name) for name in names}


def library_example() -> str:
    """The example of README, `As a library`."""
    found = re.search(
        r"^## As a library$.*?^```python$(.*?)^```$",
        README.read_text(encoding="utf-8"),
        re.DOTALL | re.MULTILINE,
    )
    assert found, "README has no example under 'As a library'"
    return found[1]


def library_sections() -> Sections:
    """Names of use as a library."""
    imports = [
        f"{node.module}.{alias.name}"
        for node in ast.walk(ast.parse(library_example()))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    ]
    exported = {f"{p.__name__}.__all__": sorted(p.__all__) for p in PACKAGES}
    return {"README, As a library": sorted(imports)} | exported


def written(sections: Sections) -> str:
    """The text of an expectation."""
    blocks = ["\n".join([f"[{title}]", *lines]) for title, lines in sections.items()]
    return "\n\n".join([HEAD, *blocks]) + "\n"


def expected(name: str) -> str:
    """The text kept; nothing where there is none yet."""
    path = EXPECTED / f"{name}.txt"
    return path.read_text(encoding="utf-8") if path.exists() else ""


def difference(name: str, sections: Sections) -> str:
    """What was lost (-) and added (+), under the section concerned; empty if nothing."""
    before, now = expected(name).splitlines(), written(sections).splitlines()
    marked = list(difflib.ndiff(before, now))
    titles = [k for k, line in enumerate(marked) if line[2:].startswith("[")]
    changed = [k for k, line in enumerate(marked) if line[:1] in "+-" and line[2:].strip()]
    shown = sorted({*changed, *(max((t for t in titles if t <= k), default=k) for k in changed)})
    return "\n".join(marked[k].rstrip() for k in shown)

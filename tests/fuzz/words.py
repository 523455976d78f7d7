"""Words and options of the command line."""

from __future__ import annotations

import random
from pathlib import Path

from mbs_models.model.model_file import load
from validation.simulation.excitation_spec import parse_excitation
from validation.sweep.parameters import samples_of

from .mutations import odd_number, odd_text
from .trial import DOFS, REFUSED, SMALL, command, ended, left_nothing, refused_or


def sweep_words(rng: random.Random, folder: Path) -> str:
    """--vary, --metric, --samples and the like."""
    paths = (
        "planetary.sun.mass",
        "planetary.planets",
        "planetary.planet_bearing",
        "planetary.sun.bearing",
        "damping.stiffness_proportional",
        "planetary.ring_mesh_stiffness",
        "planetary.pressure_angle",
    )
    number = odd_number
    spec = rng.choice(
        (
            f"{number(rng)},{number(rng)}",
            f"{number(rng)}:{number(rng)}:4",
            "1:2:3log",
            f"{number(rng)}:{number(rng)}:{number(rng)}log",
            f"±{number(rng)}%",
            f"v~{number(rng)}%",
            f"{number(rng)}~3%",
            "3,4,5",
            "2e8,1e300,3e8",
            odd_text(rng),
            "1:2",
            ":::",
            "±5%",
            "1e8",
        )
    )
    path = rng.choice(paths) if rng.random() < 0.9 else odd_text(rng)
    metric = rng.choice(
        (
            "peak",
            "rms:10:2000",
            f"level:{number(rng)}",
            "level:500",
            f"drop:{number(rng)}",
            f"frequency:{number(rng)[:9]}",
            "frequency:planet:2",
            f"peak:{number(rng)}:{number(rng)}",
            odd_text(rng),
            "frequency:1",
            "mean",
        )
    )
    line = [
        "sweep",
        SMALL,
        "--vary",
        f"{path}={spec}",
        "--out",
        "out",
        "--fmax",
        "2000",
        "--df",
        "500",
        "--route",
        rng.choice(("exudyn", "equations")),
        "--workers",
        "1",
    ]
    if rng.random() < 0.7:
        line += ["--response", rng.choice((*DOFS, odd_text(rng))), "--excitation", DOFS[0]]
    if rng.random() < 0.4:
        line += ["--metric", metric]
    samples = rng.choice(("3", "5", number(rng)[:8]))
    if "%" in spec:
        line += ["--samples", samples]
    if rng.random() < 0.2:
        line += [rng.choice(("--seed", "--modes")), number(rng)[:8]]
    if rng.random() < 0.2:
        line += ["--stream"]
    if _many(spec) or ("%" in spec and samples.isdigit() and 20 < int(samples) <= 10**6):
        return refused_or(lambda: samples_of(load(SMALL), [f"{path}={spec}"], 3))
    called = command(*line)
    left_nothing(called.code, Path("out"))
    return ended(called)


def _many(spec: str) -> bool:
    """Whether a grid has more values than are computed in a moment."""
    parts = spec.removesuffix("log").split(":")
    return len(parts) == 3 and parts[2].strip().isdigit() and 20 < int(parts[2][:10]) <= 10**6


def excitation_words(rng: random.Random, folder: Path) -> str:
    """TYPE@DOF:key=value,…: as a table, and where it is short as a run."""
    kinds = ("harmonic", "stepped-sine", "sweep", "multisine", "noise", "impulse", "record", "bang")
    keys = (
        "amplitude",
        "moment",
        "frequency",
        "phase",
        "fmin",
        "fmax",
        "df",
        "duration",
        "taper",
        "law",
        "direction",
        "dwell",
        "periods",
        "ramp",
        "period",
        "seed",
        "contact_time",
        "start",
        "lines",
        "phases",
        "frequencies",
        "file",
        "scale",
        "unit",
    )
    given = ",".join(
        f"{rng.choice(keys)}={rng.choice((odd_number(rng), odd_text(rng), '[1,2,3]'))}"
        for _ in range(rng.randrange(4))
    )
    word = f"{rng.choice(kinds)}@{rng.choice((*DOFS, odd_text(rng)))}:{given}"
    if rng.random() < 0.1:
        word = rng.choice((odd_text(rng), word.replace("@", ""), word.replace("=", "")))
    if rng.random() < 0.7:
        return refused_or(lambda: parse_excitation(word))
    called = command(
        "simulate",
        SMALL,
        "--excitation",
        word,
        "--duration",
        "0.02",
        "--fmax",
        "4000",
        "--once",
        "--response",
        DOFS[0],
        "--out",
        "out",
    )
    left_nothing(called.code, Path("out"))
    return ended(called)


def options(rng: random.Random, folder: Path) -> str:
    """Options of every command with values nobody means."""
    n, t = odd_number, odd_text
    line = rng.choice(
        (
            [
                "frf",
                SMALL,
                "--response",
                rng.choice((*DOFS, t(rng))),
                "--excitation",
                DOFS[0],
                "--df",
                rng.choice(("100", n(rng))),
                "--fmin",
                rng.choice(("100", n(rng))),
                "--fmax",
                rng.choice(("3000", n(rng))),
            ],
            [
                "frf",
                SMALL,
                "--response",
                "all",
                "--excitation",
                DOFS[1],
                "--df",
                "100",
                "--quantity",
                t(rng),
            ],
            [
                "frf",
                SMALL,
                "--response",
                DOFS[0],
                "--excitation",
                DOFS[0],
                "--df",
                "100",
                "--output",
                f"{t(rng)}{rng.choice(('.npz', '.csv', '.uff', '.png', '.svg', '.pdf', ''))}",
            ],
            ["modes", rng.choice((SMALL, t(rng))), "--route", rng.choice(("exudyn", t(rng)))],
            ["modes", "paper-table2", "--torque", n(rng)],
            ["run", SMALL, "--df", n(rng), "--fmax", n(rng), "--out", "out", "--no-time"],
            ["run", SMALL, "--replace", f"planetary={t(rng)}", "--out", "out"],
            [
                "simulate",
                SMALL,
                "--duration",
                n(rng),
                "--fmax",
                n(rng),
                "--step",
                n(rng),
                "--out",
                "out",
            ],
            [
                "simulate",
                SMALL,
                "--levels",
                f"{n(rng)},{n(rng)}",
                "--duration",
                "0.01",
                "--out",
                "out",
            ],
            [
                "simulate",
                SMALL,
                "--speed",
                n(rng),
                "--torque",
                n(rng),
                "--duration",
                "0.01",
                "--out",
                "out",
            ],
            ["speed", "paper-table2", "--speed", f"{n(rng)}:{n(rng)}:{n(rng)}", "--out", "out"],
            [
                "speed",
                "paper-table2",
                "--speed",
                "600,700",
                "--torque",
                n(rng),
                "--harmonics",
                n(rng)[:9],
                "--out",
                "out",
            ],
            ["speed", "paper-table2", "--speed", "600", "--response", t(rng), "--out", "out"],
            ["paper", "--only", t(rng), "--out", "out"],
            ["paper", "--tolerance", n(rng), "--only", t(rng), "--out", "out"],
            ["new", f"{t(rng)}.toml", "--from", rng.choice(("paper", t(rng)))],
            ["check", t(rng)],
            [
                "sweep",
                SMALL,
                "--vary",
                "planetary.sun.mass=1,2",
                "--workers",
                n(rng)[:12],
                "--executor",
                rng.choice(("serial", "processes", "tcp://127.0.0.1:1", t(rng))),
                "--out",
                "out",
            ],
            [t(rng), t(rng)],
            ["schema", t(rng)],
        )
    )
    if _long(line):
        return REFUSED
    called = command(*line)
    if "out" in line:
        left_nothing(called.code, Path("out"))
    return ended(called)


def _long(line: list[str]) -> bool:
    """Whether a command does what it is asked, for longer than is waited."""
    return line[0] == "sweep" and "processes" in line  # the streams' kind has these

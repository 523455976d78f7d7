"""What is tried: an input of each kind, in a folder of its own."""

from __future__ import annotations

import io
import json
import random
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np

from fbs import Quantity, Record, read_uff
from fbs.files.record_files import read_record, write_record
from mbs_models.model.model_file import load, loads, preset_names, template
from validation.routes.bands import Band
from validation.routes.substitution import read_replacements
from validation.runtime.kept import KeptPieces
from validation.simulation.excitation_spec import parse_excitation
from validation.sweep.parameters import Samples, samples_of
from validation.sweep.pieces import FIELDS, Pieces
from validation.sweep.plan import SampleResults, SweepPlan, sweep_plan
from validation.sweep.run import sweep

from .mutations import changed_bytes, changed_text, in_toml, odd_number, odd_text
from .trial import ACCEPTED, REFUSED, Fault, Trial, command, ended, refused_or

SMALL = "lin-parker-3"
DOFS = ("planetary.sun.w", "planetary.sun.u", "planetary.planet1.v", "planetary.carrier.w")


# Model files


def model_files(rng: random.Random, folder: Path) -> str:
    """A preset's text, changed: what is made of it by one command."""
    text = changed_text(rng, template(rng.choice(preset_names())))
    return _used(rng, folder, text)


def model_numbers(rng: random.Random, folder: Path) -> str:
    """A preset with one to three of its numbers extreme."""
    text = template(rng.choice(preset_names()))
    for _ in range(rng.choice((1, 1, 2, 3))):
        found = list(re.finditer(r"(?m)(?<= = )-?[\d.]+(?:e[+-]?\d+)?(?=\s)", text))
        at = rng.choice(found)
        text = text[: at.start()] + odd_number(rng).replace("+", "") + text[at.end() :]
    return _used(rng, folder, text)


def _used(rng: random.Random, folder: Path, text: str) -> str:
    file = folder / "model.toml"
    file.write_text(text, encoding="utf-8", errors="surrogatepass")
    route = rng.choice(("exudyn", "equations"))
    line = rng.choice(
        (
            ("check", str(file)),
            ("check", str(file)),
            ("modes", str(file), "--route", route),
            (
                "frf",
                str(file),
                "--df",
                "500",
                "--response",
                "all",
                "--excitation",
                "all",
                "--route",
                rng.choice(("exudyn", "equations", "fbs")),
            ),
            ("modes", str(file), "--torque", odd_number(rng)),
        )
    )
    return ended(command(*line, within=(0, 2)))


# Files of FRFs and of records


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
    return refused_or(
        lambda: read_replacements(load("paper"), [f"planetary={file}"], None, None, None)
    )


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
    np.savez(file, **arrays)
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


# Words and options of the command line


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
    if "%" in spec:
        line += ["--samples", rng.choice(("3", "5", number(rng)[:8]))]
    if rng.random() < 0.2:
        line += [rng.choice(("--seed", "--modes")), number(rng)[:8]]
    if rng.random() < 0.2:
        line += ["--stream"]
    if _many(spec):
        line = [word if word != "sweep" else "sweep" for word in line]
        return refused_or(lambda: samples_of(load(SMALL), [f"{path}={spec}"], 3))
    called = command(*line)
    _left_nothing(called.code, Path("out"))
    return ended(called)


def _many(spec: str) -> bool:
    """Whether a grid has more values than are computed in a moment."""
    parts = spec.removesuffix("log").split(":")
    return len(parts) == 3 and parts[2].strip().isdigit() and 20 < int(parts[2][:10]) <= 10**6


def _left_nothing(code: int, out: Path) -> None:
    left = [path.name for path in out.rglob("*")] if out.exists() else []
    if code == 2 and left:
        raise Fault(f"refused, and files are left: {left}")
    if code in (0, 1) and ".crosscheck" in left:
        raise Fault(f"done, and unfinished work is left: {left}")


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
    _left_nothing(called.code, Path("out"))
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
        _left_nothing(called.code, Path("out"))
    return ended(called)


def _long(line: list[str]) -> bool:
    """Whether a command does what it is asked, for longer than is waited."""
    return line[0] == "sweep" and "processes" in line  # the streams' kind has these


# Names


def names(rng: random.Random, folder: Path) -> str:
    """What a drivetrain is called, in pictures, pages, tables and on the terminal."""
    text = template(SMALL)
    text = re.sub(r"(?m)^name = .*$", lambda _: f"name = {in_toml(odd_text(rng))}", text, count=1)
    text = re.sub(
        r"(?m)^source = .*$", lambda _: f"source = {in_toml(odd_text(rng))}", text, count=1
    )
    if rng.random() < 0.3:
        text = text.replace('"planetary"', in_toml(odd_text(rng)))
    file = folder / "model.toml"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    picture = f"picture{rng.choice(('.svg', '.svg', '.png', '.pdf'))}"
    lines = [
        ["check", str(file)],
        ["modes", str(file), "--route", "equations"],
        [
            "frf",
            str(file),
            "--response",
            DOFS[0],
            "--excitation",
            DOFS[0],
            "--df",
            "500",
            "--output",
            picture,
        ],
        [
            "sweep",
            str(file),
            "--vary",
            "planetary.sun.mass=1,2,3",
            "--response",
            DOFS[0],
            "--excitation",
            DOFS[0],
            "--df",
            "500",
            "--out",
            "out",
            "--workers",
            "1",
        ],
    ]
    called = command(*rng.choice(lines), within=(0, 2))
    for path in folder.rglob("*.svg"):
        _svg_is_text(path.read_text(encoding="utf-8"))
    for path in folder.rglob("*.html"):
        page = path.read_text(encoding="utf-8")
        if "<script>alert" in page:
            raise Fault("markup of a name stands in a page")
        for svg in re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL):
            _svg_is_text(svg)
    return ended(called)


def _svg_is_text(svg: str) -> None:
    try:
        ElementTree.fromstring(svg)
    except ElementTree.ParseError as error:
        raise Fault(f"an SVG that no viewer reads: {error}") from error
    if "<script" in svg:
        raise Fault("markup of a name stands in an SVG")


# Folders


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


# Pieces on disk


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


# The library


def library(rng: random.Random, folder: Path) -> str:
    """Texts to `loads`, values to what computes."""
    text = template(rng.choice(preset_names()))
    if rng.random() < 0.5:
        return refused_or(lambda: loads(changed_text(rng, text)))
    from fbs import direct_frf, frequency_axis
    from validation.routes.equations import drivetrain_system

    system = drivetrain_system(load(SMALL))
    number = float(odd_number(rng)[:400])
    calls: tuple[Callable[[], object], ...] = (
        lambda: frequency_axis(number, 100.0, 1.0),
        lambda: (
            frequency_axis(0.0, number, 1.0) if abs(number) < 1e6 else frequency_axis(number, 1, 1)
        ),
        lambda: frequency_axis(0.0, 100.0, number) if not abs(number) < 1e-3 else None,
        lambda: direct_frf(system, [number], [DOFS[0]], [DOFS[0]]),
        lambda: direct_frf(system, [1.0], [odd_text(rng)], [DOFS[0]]),
        lambda: load(odd_text(rng)),
        lambda: samples_of(load(SMALL), [odd_text(rng)]),
        lambda: json.dumps(loads(text).model_dump()),
    )
    return refused_or(rng.choice(calls))


KINDS: Mapping[str, tuple[Trial, int]] = {
    "model files, changed": (model_files, 30),
    "numbers of model files": (model_numbers, 20),
    "FRF files": (frf_files, 12),
    "record files": (record_files, 10),
    "force files": (force_files, 3),
    "words of sweeps": (sweep_words, 6),
    "words of excitations": (excitation_words, 10),
    "options": (options, 10),
    "names": (names, 4),
    "folders": (folders, 3),
    "pieces on disk": (pieces, 5),
    "library calls": (library, 15),
}  # and how many of a hundred and some

"""Arguments and options of the command line that several commands share, or that are long."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def named(model: str) -> str:
    """A preset or a file must have a name."""
    if not model.strip():
        raise typer.BadParameter("is empty; must be a preset's name, or the path of a model file")
    return model


def print_version(wanted: bool) -> None:
    """Say which version this is, and end."""
    if not wanted:
        return
    from importlib.metadata import PackageNotFoundError

    try:
        from . import __version__
    except PackageNotFoundError:
        print("crosscheck, not installed (run from source)")
    else:
        print(f"crosscheck {__version__}")
    raise typer.Exit


Version = Annotated[
    bool,
    typer.Option(
        "--version", callback=print_version, is_eager=True, help="Print the version and exit."
    ),
]
Model = Annotated[
    str,
    typer.Argument(
        metavar="MODEL", callback=named, help="A preset's name, or the path of a model file."
    ),
]
Fmin = Annotated[
    float | None, typer.Option(help="First line, Hz (default: the first multiple of df ≥ 1 Hz).")
]
Fmax = Annotated[
    float | None, typer.Option(help="Last line, Hz (default: the last multiple of df ≤ 15 kHz).")
]
Df = Annotated[
    float | None,
    typer.Option(help="Step, Hz (default: 1 Hz; coarser if there are many lines or FRFs)."),
]
InTime = Annotated[
    bool | None,
    typer.Option(
        "--time/--no-time",
        help="Integrate a multisine in time as well (default: up to 60 DoFs, no parts from files).",
    ),
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes (default: by how much there is to compute).")
]
Executor = Annotated[
    str | None,
    typer.Option(
        help="Who computes: processes, serial, mpi, or a dask scheduler as tcp://host:port."
    ),
]

# crosscheck run
WithExplorer = Annotated[
    bool, typer.Option("--explore", help="Write explore.html too, linked from the report.")
]

# crosscheck sweep
Vary = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PATH=SPEC",
        help="A parameter, as reducer.pinion.mass, and its values: from:to:N, from:to:Nlog, "
        "v1,v2,v3, or a tolerance to sample, v±p% (also v+-p%) uniform or v~s% normal; may be "
        "repeated.",
    ),
]
Metrics = Annotated[
    list[str] | None,
    typer.Option(
        metavar="METRIC",
        help="A column of the table: peak[:F1:F2], rms[:F1:F2], mean[:F1:F2], level:F, drop:F "
        "(below the model as it is), frequency:N, frequency:KIND:N; may be repeated "
        "(default: peak and rms).",
    ),
]

# crosscheck speed
Speeds = Annotated[
    str | None,
    typer.Option(
        metavar="FROM:TO:STEP",
        help="Speeds of the input, rpm, or a list as 600,900 (default: the model's speed_range in "
        "300 speeds).",
    ),
]
Torque = Annotated[float | None, typer.Option(help="At the input, N m (default: the model's).")]
Responses = Annotated[
    list[str] | None,
    typer.Option(
        metavar="DOF",
        help="DoFs whose acceleration is shown (repeat, or separate by commas, or all; default: "
        "the loudest of every body).",
    ),
]
Harmonics = Annotated[int, typer.Option(min=1, help="Of each mesh frequency, in the steady state.")]
Checked = Annotated[
    str | None,
    typer.Option(
        metavar="600,1500", help="Speeds, rpm, at which exudyn's time integration is the reference."
    ),
]

# crosscheck frf
Route = Annotated[str, typer.Option(help="exudyn, fbs or equations.")]
FrfResponses = Annotated[
    list[str] | None, typer.Option(help="Response DoFs (repeat, or separate by commas), or all.")
]
FrfExcitations = Annotated[
    list[str] | None, typer.Option(help="Excitation DoFs (repeat, or separate by commas), or all.")
]

# files of FRFs and records
Replace = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PART=FILE",
        help="A stage or inertia whose FRFs come from a file (.uff, .npz, .mat, .csv); may be "
        "repeated. The lines are the file's.",
    ),
]
Resample = Annotated[
    bool,
    typer.Option(
        "--resample", help="Interpolate files whose lines differ to the first one's, or to --df."
    ),
]
FileNoise = Annotated[
    str | None,
    typer.Option(
        "--noise",
        metavar="1%,1deg",
        help="Of the files' FRFs, one standard deviation: bands of the FRFs (default: the scatter "
        "of a file's runs).",
    ),
]
FileSamples = Annotated[
    int,
    typer.Option(
        "--samples",
        metavar="N",
        help="Find the bands by N repetitions with errors drawn, where first order tells too "
        "little (default: to first order).",
    ),
]
FileAverages = Annotated[
    int | None,
    typer.Option(
        "--averages",
        metavar="N",
        help="Of how many averages the files' coherences are, one excitation at a time: bands of "
        "the FRFs (default: what the files say).",
    ),
]
Estimator = Annotated[str, typer.Option(help="H1, H2 or Hv.")]
SignalKind = Annotated[
    str | None, typer.Option(help="hammer or noise (default: as the force looks).")
]
FileQuantity = Annotated[
    str | None,
    typer.Option(
        "--quantity",
        help="receptance, mobility or accelerance, where a file of FRFs does not say it.",
    ),
]
FileUnit = Annotated[
    str | None,
    typer.Option(
        "--unit",
        metavar="UNIT",
        help="Of a file's FRFs, such as m/s^2/N or g/lbf, in place of what it says.",
    ),
]
FileRun = Annotated[
    int | None,
    typer.Option("--run", help="Which of a file's complete runs, from 1 on (default: their mean)."),
]
FileMap = Annotated[
    str | None,
    typer.Option(
        "--map",
        metavar="MAP",
        help="From a file's channels to the model's DoFs: brake.w=12.rx,wheel.y=-7.y, or a TOML "
        "file with a table \\[map].",
    ),
]
Channels = Annotated[
    list[str] | None,
    typer.Option(
        "--channel",
        metavar="NAME=LABEL UNIT",
        help="What a record's channel is, such as '1=hammer.z 50 N'; may be repeated.",
    ),
]

# crosscheck reduce
ReductionBand = Annotated[
    str | None,
    typer.Option(metavar="FROM:TO[:STEP]", help="The lines, Hz (default: 10:4000:10)."),
]
Ports = Annotated[
    list[str] | None,
    typer.Option(
        metavar="DOF",
        help="DoFs that stay, and between which FRFs are compared, beside those where the stage is "
        "coupled (repeat, or separate by commas; default: its first body's rotation).",
    ),
]
Sizes = Annotated[
    str | None,
    typer.Option(
        metavar="4:20", help="Numbers of coordinates to try, or a list (default: a dozen)."
    ),
]
ReducedSystem = Annotated[
    Path | None, typer.Option(help="A file for the chosen system's M, C, K and basis: .npz.")
]

# crosscheck couple, decouple, identify
At = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X=Y",
        help="DoFs that are joined, X of the first file, Y of the second (decouple: of AB and A; "
        "identify: of A and B, both in AB); X alone where both have it; may be repeated, or "
        "separated by commas.",
    ),
]
JointOf = Annotated[
    str | None,
    typer.Option(
        "--joint",
        metavar="K,C",
        help="N/m and N s/m, as 1e6,10; K complex where it is hysteretic, as 1e6+5e4j; or a table "
        "FILE.csv of Hz, Re K, Im K (default: rigid).",
    ),
]
Internal = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X=Y", help="DoFs inside the known part that both files have; may be repeated."
    ),
]
Form = Annotated[
    str | None,
    typer.Option(help="standard, mixed or extended (default: mixed with --internal)."),
]
Rank = Annotated[
    int | None, typer.Option(min=1, help="Keep so many singular values of the interface.")
]
Tikhonov = Annotated[
    float, typer.Option(min=0.0, help="Regularise by this share of the largest singular value.")
]
ResultFile = Annotated[Path | None, typer.Option(help="A file for the FRFs, as frf's.")]
JointFile = Annotated[
    Path | None, typer.Option(help="A file for the joint's stiffness over frequency: .csv.")
]

# crosscheck truncate
TruncatedStages = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME",
        help="A stage or inertia whose modes may be left out; may be repeated (default: all).",
    ),
]
TruncationBand = Annotated[
    str | None,
    typer.Option(metavar="FROM:TO[:STEP]", help="The lines, Hz (default: 1:4000:1)."),
]

# crosscheck simulate
Excitations = Annotated[
    list[str] | None,
    typer.Option(
        metavar="TYPE@DOF:KEY=VALUE,…",
        help="harmonic, stepped-sine, sweep, multisine, noise, impulse or record at a DoF, as "
        "sweep@reducer.pinion.w:fmax=2000,amplitude=0.1; may be repeated (default: the model "
        "file's, else a multisine at the first DoF).",
    ),
]
Levels = Annotated[
    str | None,
    typer.Option(metavar="1,10,…", help="FRF at these multiples of the excitation as well."),
]
Reverse = Annotated[
    bool,
    typer.Option(
        "--reverse/--once",
        help="Run again with the forces reversed: FRFs without geometry's even-order share.",
    ),
]

# crosscheck explain
Theirs = Annotated[
    Path,
    typer.Argument(
        metavar="THEIRS",
        help="Another result of it: FRFs (.uff, .npz, .csv, .mat), natural frequencies (.txt, "
        ".csv), or M, C, K (.npz, .mat, a folder of .mtx).",
    ),
]
Only = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PATTERN",
        help="Parameters that may be wrong, as 'reducer.*'; may be repeated (default: all).",
    ),
]

"""The command line of substructuring (truncate, reduce, couple, decouple, identify) and explain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from .cli_options import (
    At,
    FileMap,
    FileNoise,
    FileQuantity,
    FileRun,
    FileUnit,
    Fmax,
    Fmin,
    Form,
    FrfExcitations,
    FrfResponses,
    Internal,
    JointFile,
    JointOf,
    Model,
    Only,
    Ports,
    Rank,
    ReducedSystem,
    ReductionBand,
    ResultFile,
    Sizes,
    Theirs,
    Tikhonov,
    TruncatedStages,
    TruncationBand,
)


def couple(
    a: Annotated[Path, typer.Argument(metavar="A", help="A file of FRFs.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="A file of FRFs.")],
    at: At = None,
    joint: JointOf = None,
    quantity: FileQuantity = None,
    unit: FileUnit = None,
    test_run: FileRun = None,
    channel_map: FileMap = None,
    fmin: Fmin = None,
    fmax: Fmax = None,
    noise: FileNoise = None,
    output: ResultFile = None,
    out: Annotated[Path, typer.Option(help="Where couple.html goes.")] = Path("crosscheck-couple"),
) -> None:
    """Couple the FRFs of two files: conditioning, quality, and where no digit is left."""
    from .substructuring import command, inputs, run

    pairs, flexible = inputs.parse_pairs("--at", at), inputs.parse_joint(joint)
    files = command.files(
        {"A": a, "B": b}, (quantity, unit, test_run, channel_map), (fmin, fmax), noise, output, out
    )
    command.run_command(
        "couple", files, lambda parts, known: run.run_couple(parts, pairs, flexible, known)
    )


def decouple(
    ab: Annotated[Path, typer.Argument(metavar="AB", help="A file of FRFs of the assembly.")],
    a: Annotated[Path, typer.Argument(metavar="A", help="One of the known part.")],
    at: At = None,
    internal: Internal = None,
    form: Form = None,
    rank: Rank = None,
    tikhonov: Tikhonov = 0.0,
    quantity: FileQuantity = None,
    unit: FileUnit = None,
    test_run: FileRun = None,
    channel_map: FileMap = None,
    fmin: Fmin = None,
    fmax: Fmax = None,
    noise: FileNoise = None,
    output: ResultFile = None,
    out: Annotated[Path, typer.Option(help="Where decouple.html goes.")] = Path(
        "crosscheck-decouple"
    ),
) -> None:
    """Take a known part off an assembly: the FRFs of what was never measured alone."""
    from .substructuring import command, inputs, run

    pairs = inputs.parse_pairs("--at", at)
    options = run.DecouplingOptions(
        inputs.parse_pairs("--internal", internal), form, rank, tikhonov
    )
    files = command.files(
        {"AB": ab, "A": a}, (quantity, unit, test_run, channel_map), (fmin, fmax), noise, output,
        out,
    )  # fmt: skip
    command.run_command(
        "decouple", files, lambda parts, known: run.run_decouple(parts, pairs, options, known)
    )


def identify(
    ab: Annotated[Path, typer.Argument(metavar="AB", help="A file of FRFs of the assembly.")],
    a: Annotated[Path, typer.Argument(metavar="A", help="One of the first part.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="One of the second part.")],
    at: At = None,
    quantity: FileQuantity = None,
    unit: FileUnit = None,
    test_run: FileRun = None,
    channel_map: FileMap = None,
    fmin: Fmin = None,
    fmax: Fmax = None,
    noise: FileNoise = None,
    output: JointFile = None,
    out: Annotated[Path, typer.Option(help="Where identify.html goes.")] = Path(
        "crosscheck-identify"
    ),
) -> None:
    """Find the joint between two parts: stiffness and damping, with intervals."""
    from .substructuring import command, inputs, run

    pairs = inputs.parse_pairs("--at", at)
    files = command.files(
        {"AB": ab, "A": a, "B": b}, (quantity, unit, test_run, channel_map), (fmin, fmax), noise,
        output, out,
    )  # fmt: skip
    command.run_command(
        "identify", files, lambda parts, known: run.run_identify(parts, pairs, known)
    )


def explain(
    model: Model,
    theirs: Theirs,
    ours: Annotated[
        Path | None, typer.Option(help="A file of our FRFs in place of the model's own.")
    ] = None,
    stage: Annotated[
        str | None,
        typer.Option(help="The stage or inertia alone whose result it is, with its half hubs."),
    ] = None,
    only: Only = None,
    quantity: FileQuantity = None,
    unit: FileUnit = None,
    test_run: FileRun = None,
    channel_map: FileMap = None,
    noise: Annotated[
        str | None,
        typer.Option(metavar="1%", help="Of natural frequencies, one standard deviation."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Where explanation.html goes.")] = Path(
        "crosscheck-explanation"
    ),
) -> None:
    """Say which change of the model, or which slip, makes THEIRS and ours equal.

    Exit code 1 if nothing does.
    """
    from .checks.part_uncertainty import parse_noise
    from .explanation.command import run_command
    from .routes.frf_input import file_options

    result = run_command(
        model,
        theirs,
        out,
        ours=ours,
        stage=stage,
        only=only or (),
        options=file_options(quantity, unit, test_run, channel_map),
        noise=parse_noise(noise),
    )
    end(result.agrees)


def truncate(
    model: Model = "paper",
    stage: TruncatedStages = None,
    band: TruncationBand = None,
    tolerance: Annotated[
        str, typer.Option(help="Of every FRF asked for: 0.1dB, or a scaled error, 0.001scaled.")
    ] = "0.1dB",
    response: FrfResponses = None,
    excitation: FrfExcitations = None,
    order: Annotated[int, typer.Option(min=-1, max=9, help="Highest residual kept; -1: none.")] = 2,
    out: Annotated[Path, typer.Option(help="Where truncation.html goes.")] = Path(
        "crosscheck-truncate"
    ),
) -> None:
    """Which modes each stage needs: a bound that is guaranteed, and the true error beside it."""
    from .inspection import frf_output
    from .truncation.command import run_command

    result = run_command(
        model,
        out,
        stages=stage or (),
        band=band,
        tolerance=tolerance,
        responses=() if response is None else frf_output.labels("--response", response),
        excitations=() if excitation is None else frf_output.labels("--excitation", excitation),
        order=order,
    )
    end(result.agrees)


def reduce(
    model: Model = "paper",
    stage: Annotated[str, typer.Option(metavar="NAME", help="The stage or inertia.")] = "",
    band: ReductionBand = None,
    tolerance: Annotated[
        str, typer.Option(help="Of every FRF: 0.1dB, or a scaled error, 0.001scaled.")
    ] = "0.1dB",
    dof: Ports = None,
    sizes: Sizes = None,
    output: ReducedSystem = None,
    out: Annotated[Path, typer.Option(help="Where reduction.html goes.")] = Path(
        "crosscheck-reduce"
    ),
) -> None:
    """Which reduction of a stage meets a tolerance with the fewest coordinates."""
    from .reduction.command import run_command

    result = run_command(
        model,
        stage,
        out,
        band=band,
        tolerance=tolerance,
        dofs=[label for item in dof or () for label in item.split(",") if label],
        sizes=sizes,
        output=output,
    )
    end(result.agrees)


def end(agrees: bool) -> None:
    """End a command that has a verdict."""
    if not agrees:
        raise typer.Exit(1)


EXAMPLES: Mapping[Callable[..., None], str] = {
    explain: "explain gearbox.toml measured.uff --map map.toml",
    truncate: "truncate gearbox.toml --tolerance 0.1dB",
    reduce: "reduce gearbox.toml --stage planetary --tolerance 0.1dB",
    couple: "couple gearbox.uff brake.uff --at out.w=in.w --joint 1e6,10",
    decouple: "decouple both.uff brake.uff --at out.w=in.w --output gearbox.npz",
    identify: "identify both.uff gearbox.uff brake.uff --at out.w=in.w --noise 1%",
}
"""Of what follows `crosscheck`, by command."""

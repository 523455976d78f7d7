"""The command line. Exit codes: 0 agreed or done, 1 a disagreement, 2 bad input."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from .cli_options import (
    Channels,
    Checked,
    Df,
    Estimator,
    Excitations,
    Executor,
    FileAverages,
    FileMap,
    FileNoise,
    FileQuantity,
    FileRun,
    FileSamples,
    FileUnit,
    Fmax,
    Fmin,
    FrfExcitations,
    FrfResponses,
    Harmonics,
    InTime,
    Levels,
    Metrics,
    Model,
    Replace,
    Resample,
    Responses,
    Reverse,
    Route,
    SignalKind,
    Speeds,
    Torque,
    Vary,
    Version,
    WithExplorer,
    Workers,
    named,
)
from .cli_substructuring import EXAMPLES, end
from .errors import CommandError
from .runtime.exit_codes import BAD_INPUT, exit_code
from .runtime.streams import say

NEW_TRAIN = "motor,parallel,planetary,load"

app = typer.Typer(
    name="crosscheck",
    help="Cross-check a gear drivetrain's vibration: exudyn, substructuring (FBS) and equations.",
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; bad input ends in one message and exit code 2."""
    given = sys.argv[1:] if arguments is None else arguments
    code = exit_code(app, given or ["--help"])
    sys.exit(code if given else BAD_INPUT)


@app.callback()
def program(version: Version = False) -> None:
    """Take what belongs to no command."""


@app.command(epilog="Example: crosscheck run gearbox.toml --out report")
def run(
    model: Model = "paper",
    out: Annotated[Path, typer.Option(help="Where report.html and results.json go.")] = Path(
        "crosscheck-report"
    ),
    fmin: Fmin = None,
    fmax: Fmax = None,
    df: Df = None,
    replace: Replace = None,
    quantity: FileQuantity = None,
    unit: FileUnit = None,
    test_run: FileRun = None,
    channel_map: FileMap = None,
    resample: Resample = False,
    noise: FileNoise = None,
    averages: FileAverages = None,
    samples: FileSamples = 0,
    in_time: InTime = None,
    explore: WithExplorer = False,
) -> None:
    """Compare all routes and write a report; exit code 1 if they disagree."""
    from .checks.part_uncertainty import parse_noise
    from .crosscheck.command import run_command
    from .routes.frf_input import file_options

    result = run_command(
        model,
        out,
        fmin=fmin,
        fmax=fmax,
        df=df,
        replace=replace or (),
        options=file_options(quantity, unit, test_run, channel_map, resample, averages),
        noise=parse_noise(noise),
        repetitions=samples,
        in_time=in_time,
        explore=explore,
    )
    end(result.agrees)


@app.command(epilog="Example: crosscheck modes gearbox.toml --torque 95")
def modes(
    model: Model = "paper",
    route: Annotated[str, typer.Option(help="exudyn or equations.")] = "exudyn",
    torque: Annotated[
        float | None,
        typer.Option(help="At the input, N m: frequencies under it beside those at rest."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Machine-readable.")] = False,
) -> None:
    """Natural frequencies, damping ratios and kinds of all modes."""
    from .inspection.commands import modes_command

    modes_command(model, route, torque, as_json=as_json)


@app.command(epilog="Example: crosscheck frf gearbox.toml --response load.w --excitation motor.w")
def frf(
    model: Model = "paper",
    response: FrfResponses = None,
    excitation: FrfExcitations = None,
    fmin: Fmin = None,
    fmax: Fmax = None,
    df: Df = None,
    route: Route = "exudyn",
    stage: Annotated[
        str | None,
        typer.Option(
            help="A stage or inertia alone, with its halves of the hubs: what run --replace reads."
        ),
    ] = None,
    quantity: Annotated[
        str, typer.Option(help="receptance, mobility or accelerance.")
    ] = "receptance",
    output: Annotated[
        Path | None, typer.Option(help="A file: .npz, .csv, .uff, .mat, .png, .svg or .pdf.")
    ] = None,
) -> None:
    """FRFs between DoFs, drawn in the terminal or written to a file."""
    from .inspection.commands import frf_command

    frf_command(
        model,
        response,
        excitation,
        (fmin, fmax, df),
        route=route,
        stage=stage,
        quantity=quantity,
        output=output,
    )


@app.command(epilog="Example: crosscheck paper --only fig13 --only table3")
def paper(
    out: Annotated[Path, typer.Option(help="Where paper.html and paper.json go.")] = Path(
        "crosscheck-paper"
    ),
    only: Annotated[
        str | None,
        typer.Option(metavar="ITEM", help="One item: table3, fig8, fig8a, truncation, claims, …."),
    ] = None,
    tolerance: Annotated[
        str, typer.Option(metavar="DB", help="Largest error where modes are left out.")
    ] = "0.1dB",
) -> None:
    """Check the paper's tables, figures, equations and claims.

    Exit code 1 if our own routes disagree.
    """
    from .paper.command import run_command

    end(run_command(out, only, tolerance).agrees)


@app.command(
    epilog="Example: crosscheck sweep gearbox.toml --vary shaft1.first_stiffness=1e5:1e6:20"
)
def sweep(
    model: Model = "paper",
    vary: Vary = None,
    response: Annotated[str | None, typer.Option(help="Response DoF of an FRF.")] = None,
    excitation: Annotated[str | None, typer.Option(help="Its excitation DoF.")] = None,
    metric: Metrics = None,
    fmin: Fmin = None,
    fmax: Fmax = None,
    df: Df = None,
    n_modes: Annotated[int, typer.Option("--modes", help="How many natural frequencies.")] = 10,
    route: Annotated[str, typer.Option(help="exudyn or equations.")] = "exudyn",
    samples: Annotated[
        int | None,
        typer.Option(help="Draws from the tolerances (default 200)."),
    ] = None,
    sampling: Annotated[
        str | None, typer.Option(help="How they are drawn: lhs (Latin hypercube) or random.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the draws.")] = 0,
    out: Annotated[Path, typer.Option(help="Where table, pictures and report go.")] = Path(
        "crosscheck-sweep"
    ),
    workers: Workers = None,
    executor: Executor = None,
    stream: Annotated[
        bool, typer.Option("--stream", help="Write the FRFs to disk piece by piece.")
    ] = False,
) -> None:
    """Vary parameters: an FRF and natural frequencies, as table and report; goes on if stopped."""
    from .sweep.command import run_command

    run_command(
        model,
        out,
        vary=vary or (),
        response=response,
        excitation=excitation,
        metrics=metric or (),
        limits=(fmin, fmax, df),
        n_modes=n_modes,
        route=route,
        samples=samples,
        sampling=sampling,
        seed=seed,
        workers=workers,
        executor=executor,
        stream=stream,
    )


@app.command(epilog="Example: crosscheck simulate gearbox.toml --out run")
def simulate(
    model: Model = "paper",
    excitation: Excitations = None,
    response: Annotated[
        list[str] | None,
        typer.Option(help="DoFs to record (repeat, or separate by commas; default: all)."),
    ] = None,
    duration: Annotated[float | None, typer.Option(help="How long, s.")] = None,
    speed: Annotated[float | None, typer.Option(help="Of the input, rpm.")] = None,
    torque: Annotated[float | None, typer.Option(help="At the input, N m.")] = None,
    levels: Levels = None,
    reverse: Reverse = True,
    fmax: Annotated[float | None, typer.Option(help="End of the band of interest, Hz.")] = None,
    sampling: Annotated[float | None, typer.Option(help="Sampling frequency kept, Hz.")] = None,
    integrator: Annotated[str | None, typer.Option(help="RK44 or trapezoidal.")] = None,
    step: Annotated[float | None, typer.Option(help="Its step, s.")] = None,
    save: Annotated[
        list[str] | None, typer.Option(help="Keep the record too: npz, csv or uff; repeatable.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Where simulation.html goes.")] = Path(
        "crosscheck-simulation"
    ),
) -> None:
    """Integrate in time: FRFs against FBS, or a gearbox at speed; goes on if stopped."""
    from .inspection import frf_output
    from .simulation.command import run_command
    from .simulation.options import Options

    options = Options(
        responses=None if response is None else frf_output.labels("--response", response),
        duration=duration,
        fmax=fmax,
        sampling_frequency=sampling,
        integrator=integrator,
        step=step,
        speed_rpm=speed,
        torque=torque,
        reverse=reverse,
    )
    result = run_command(
        model,
        out,
        excitation=excitation or (),
        levels=levels,
        save=save or (),
        options=options,
    )
    end(result.agrees)


@app.command(epilog="Example: crosscheck speed gearbox.toml --speed 300:3000:100")
def speed(
    model: Model,
    speed: Speeds = None,
    torque: Torque = None,
    response: Responses = None,
    harmonics: Harmonics = 10,
    check: Checked = None,
    workers: Workers = None,
    executor: Executor = None,
    out: Annotated[Path, typer.Option(help="Where speed.html goes.")] = Path("crosscheck-speed"),
) -> None:
    """Mesh and bearing forces and vibration over the speed range, by harmonic balance."""
    from .inspection import frf_output
    from .speed.command import run_command

    result = run_command(
        model,
        out,
        speed=speed,
        torque=torque,
        responses=() if response is None else frf_output.labels("--response", response),
        harmonics=harmonics,
        check=check,
        workers=workers,
        executor=executor,
    )
    end(result.agrees)


for command, example in EXAMPLES.items():
    app.command(epilog=f"Example: crosscheck {example}")(command)


@app.command(epilog="Example: crosscheck explore paper --out exploring")
def explore(
    model: Model = "paper",
    out: Annotated[Path, typer.Option(help="Where explore.html goes.")] = Path(
        "crosscheck-explore"
    ),
) -> None:
    """Write a page that computes FRFs in the browser: every pair, springs and damping to drag."""
    from .explorer.command import explore_command

    explore_command(model, out)


@app.command(epilog="Example: crosscheck inspect measured.uff")
def inspect(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Of FRFs or records.")],
    model: Annotated[str | None, typer.Option(help="A model whose DoFs the map is for.")] = None,
    quantity: FileQuantity = None,
    unit: FileUnit = None,
    run: FileRun = None,
    channel: Channels = None,
) -> None:
    """Say what a file of FRFs or records holds, how good it is, and print a map to start from."""
    from .inspection.commands import inspect_command

    inspect_command(file, model, (quantity, unit, run), channel or ())


@app.command(epilog="Example: crosscheck estimate hits.uff --output measured.uff")
def estimate(
    records: Annotated[list[Path], typer.Argument(metavar="RECORDS", help="Files of records.")],
    output: Annotated[Path, typer.Option(help="A file: .uff, .npz, .mat or .csv.")],
    method: Estimator = "H1",
    signal: SignalKind = None,
    fmin: Fmin = None,
    fmax: Fmax = None,
    df: Df = None,
    decay: Annotated[float, typer.Option(help="Of an exponential window over blows, 1/s.")] = 0.0,
    channel: Channels = None,
) -> None:
    """Turn records of hammer or shaker tests into FRFs with coherence."""
    from .inspection.commands import estimate_command

    estimate_command(
        records, output, (fmin, fmax, df), channel or (), method=method, signal=signal, decay=decay
    )


@app.command(epilog="Example: crosscheck presets")
def presets() -> None:
    """List the drivetrains that come with the package."""
    from mbs_models.model.model_file import describe, preset_names

    for name in preset_names():
        print(describe(name))


@app.command(epilog="Example: crosscheck new gearbox.toml --for motor,parallel,planetary,load")
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The model file to write.")],
    kinds: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="KINDS",
            help="The train's parts from its fast end to its slow one: motor, generator, flywheel, "
            f"load, rotor, parallel, planetary. [default: {NEW_TRAIN}]",
        ),
    ] = None,
    source: Annotated[
        str | None, typer.Option("--from", metavar="PRESET", help="Copy a preset instead.")
    ] = None,
) -> None:
    """Write a model file to start from, with every key that its tables have; never overwrites."""
    from mbs_models.model.model_file import template, write_new
    from mbs_models.model.new_train import new_train

    if kinds is not None and source is not None:
        raise CommandError("--for and --from: a train or a preset; give one of the two")
    if source is not None:
        write_new(file, template(source))
        say(f"{file}: written, from preset '{source}'")
        return
    words = [word.strip() for word in (kinds or NEW_TRAIN).split(",")]
    write_new(file, new_train(words, file.name))
    say(f"{file}: written, {' – '.join(words)}")


@app.command(epilog="Example: crosscheck check gearbox.toml")
def check(
    file: Annotated[
        str, typer.Argument(metavar="FILE", callback=named, help="A model file, or a preset.")
    ],
) -> None:
    """Validate a model file, say what was understood, and what is probably typed wrong."""
    from .inspection.check_model import check_model

    check_model(file)


@app.command(epilog="Example: crosscheck schema > gearbox.schema.json")
def schema() -> None:
    """Print the model file's JSON schema, for editors."""
    from mbs_models.model.parameters import Drivetrain

    print(json.dumps(Drivetrain.model_json_schema(by_alias=True), indent=1, ensure_ascii=False))


if __name__ == "__main__":
    main()

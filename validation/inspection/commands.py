"""`crosscheck modes`, `frf`, `inspect`, `estimate`: from what is typed to what is printed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from mbs_models.model import model_file

from ..errors import require_frequencies
from ..runtime.streams import warn


def modes_command(model: str, route: str, torque: float | None, *, as_json: bool) -> None:
    """Print the modes of a model, as a table or as JSON."""
    from .modes import print_modes, solved_modes

    drivetrain = model_file.load(model)
    warn(drivetrain.warnings())
    found, at_rest = solved_modes(drivetrain, route, torque)
    if not as_json:
        print_modes(drivetrain.name, route, found, at_rest, torque)
        return
    from ..routes.modes import round_off_warnings
    from .modes import modes_document

    if route == "exudyn":
        warn(round_off_warnings(found))
    document = {"model": model, "route": route, "modes": modes_document(found, at_rest)}
    print(json.dumps(document, indent=1))


def frf_command(
    model: str,
    responses: Sequence[str] | None,
    excitations: Sequence[str] | None,
    limits: tuple[float | None, float | None, float | None],
    *,
    route: str,
    stage: str | None,
    quantity: str,
    output: Path | None,
) -> None:
    """Draw FRFs in the terminal, or write them to a file; the options as typed."""
    from ..routes.bands import band, elastic_frequencies, left_out
    from ..routes.memory import frf_bytes, frf_count, require_memory
    from ..routes.routes import frf_by_name
    from ..routes.source import equations_source
    from . import frf_output
    from .nodes import dof_channels

    rows = frf_output.labels("--response", responses)
    columns = frf_output.labels("--excitation", excitations)
    if output is not None:
        frf_output.check_target(output)
    drivetrain = model_file.load(model)
    n_frfs = frf_count(drivetrain, route, rows, columns, stage)
    lines = band(*limits, n_frfs)
    require_memory(
        lines,
        frf_bytes(n_frfs, drawn=output is not None and frf_output.is_picture(output)),
        f"{n_frfs} FRF{'s' * (n_frfs > 1)}",
        "a larger --df, a narrower band (--fmin, --fmax) or fewer DoFs",
    )
    solved, method = frf_by_name(drivetrain, route, lines.frequency(), rows, columns, stage)
    source = equations_source(drivetrain)
    system = source.whole if stage is None else source.stage(stage)
    warn(left_out(lines, elastic_frequencies(system)))
    result = solved.to(quantity)
    print(f"Method: {method}")
    if output is None:
        frf_output.show(result)
    else:
        subject = drivetrain.name if stage is None else f"{drivetrain.name}: {stage} alone"
        frf_output.write(result, output, f"{subject} ({route})", dof_channels(drivetrain))


def inspect_command(
    file: Path,
    model: str | None,
    said: tuple[str | None, str | None, int | None],
    channels: Sequence[str],
) -> None:
    """Print what a file of FRFs or records holds; `said` is its quantity, unit and run."""
    from ..routes.frf_input import file_options
    from .measured_file import channel_options, inspection

    options, named = file_options(*said), channel_options(channels)
    drivetrain = None if model is None else model_file.load(model)
    print("\n".join(inspection(file, options, named, drivetrain)))


def estimate_command(
    records: Sequence[Path],
    output: Path,
    limits: tuple[float | None, float | None, float | None],
    channels: Sequence[str],
    *,
    method: str,
    signal: str | None,
    decay: float,
) -> None:
    """Write the FRFs estimated from records; the options as typed."""
    from .estimate import estimated, read_all, require_target, summary, write
    from .measured_file import channel_options

    fmin, fmax, df = limits
    require_frequencies(fmin=fmin, fmax=fmax, df=df)
    require_target(output, records)
    taken = read_all(records, channel_options(channels))
    found = estimated(taken, method, signal, df, decay, fmin, fmax)
    write(found, output)
    print("\n".join(summary(found)))

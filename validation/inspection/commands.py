"""`crosscheck modes` and `crosscheck frf`: from what is typed to what is printed or written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from mbs_models.model import model_file

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
    from ..routes.bands import band
    from ..routes.memory import frf_bytes, frf_count, require_memory
    from ..routes.routes import frf_by_name
    from . import frf_output

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
    result = solved.to(quantity)
    print(f"Method: {method}")
    if output is None:
        frf_output.show(result)
    else:
        subject = drivetrain.name if stage is None else f"{drivetrain.name}: {stage} alone"
        frf_output.write(result, output, title=f"{subject} ({route})")

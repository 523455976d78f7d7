"""`crosscheck explore`: from what is typed to a page."""

from __future__ import annotations

from pathlib import Path

from mbs_models.model.model_file import load

from ..routes.source import equations_source, exudyn_source
from ..runtime.interruption import on_interrupt
from ..runtime.output_folder import held, write_together
from ..runtime.streams import say, warn
from .plots import PAGE, require_library


def explore_command(model: str, out: Path) -> Path:
    """Write the page that computes a drivetrain's FRFs in the browser; returns its path.

    Raises
    ------
    ModelError, CommandError
        Bad input, or Bokeh is not installed; nothing is written then.
    """
    require_library()
    drivetrain = load(model)
    warn(drivetrain.warnings())
    with held(out, (PAGE,)), on_interrupt("nothing was written"):
        from .page import explorer_page  # exudyn takes its time to load: bad input is told before

        text = explorer_page(exudyn_source(drivetrain), equations_source(drivetrain))
        (path,) = write_together(out, {PAGE: text})
    say(f"Written: {path}")
    return path

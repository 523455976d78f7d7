"""One HTML page with everything in it: the numbers, the drawing, the library and the scripts."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from mbs_models.gears.orders import orders
from mbs_models.model.parameters import Drivetrain

from ..report.page import source_of
from ..report.pages import environment
from ..report.provenance import provenance
from ..routes.multibody import ExudynSource
from ..routes.source import Source
from .assembly import stages, whole
from .motions import moving_drawing
from .plots import CURVES, Plots, plots

FIRST, LAST = 1.0, 15000.0  # Hz shown at first
SCRIPTS = (
    "algebra.js", "synthesis.js", "modes.js", "files.js", "shapes.js", "plot.js", "page.js",
    "controls.js",
)  # fmt: skip


@dataclass(frozen=True)
class Speeds:
    """Orders over speed: the input's name, first and last speed (rpm), and Hz per rpm by name."""

    driven: str
    range: tuple[float, float]
    lines: tuple[tuple[str, float], ...]


def explorer_page(exudyn: ExudynSource, equations: Source) -> str:
    """The text of the page of a drivetrain."""
    drivetrain, speeds = exudyn.drivetrain, orders_over_speed(exudyn)
    drawn = plots(FIRST, LAST, speeds.range if speeds else None)
    drawing = moving_drawing(exudyn)
    data = numbers(exudyn, equations) | {
        "motions": drawing.motions,
        "orders": _orders(speeds),
        "figures": drawn.figures,
        "colors": {name: color for name, (color, _, _) in CURVES.items()},
    }
    return _rendered(drivetrain, drawn, data, drawing=drawing, campbell=speeds and speeds.driven)


def numbers(exudyn: Source, equations: Source) -> dict[str, Any]:
    """What curves and resonances are computed from."""
    drivetrain, modes = exudyn.drivetrain, exudyn.modes
    labels = exudyn.whole.labels
    turning = [p for part in drivetrain.parts for p in part.drive_points if p.endswith(".w")]
    return {
        "alpha": drivetrain.damping.mass_proportional,
        "beta": drivetrain.damping.stiffness_proportional,
        "band": [FIRST, LAST],
        "dofs": list(labels),
        "response": turning[-1],
        "excitation": turning[0],
        "free": sum(mode.frequency_hz == 0.0 for mode in modes.modes),
        "modes": [{"kind": str(mode.kind)} for mode in modes.modes],
        "routes": [
            route.document()
            for source in (exudyn, equations)
            for route in (stages(source), whole(source))
        ],
    }


def orders_over_speed(exudyn: ExudynSource) -> Speeds | None:
    """Every harmonic of the input's orders; None where the model has no operation."""
    operation = exudyn.drivetrain.operation
    found = orders(exudyn.drivetrain, exudyn.components)
    if operation is None or not found:
        return None
    lines = tuple((o.label(h), o.frequency(h, 1.0)) for o in found for h in o.harmonics)
    return Speeds(operation.input, operation.speed_range, lines)


def _orders(speeds: Speeds | None) -> dict[str, Any] | None:
    if speeds is None:
        return None
    lines = [{"name": name, "slope": slope} for name, slope in speeds.lines]
    return {"range": list(speeds.range), "lines": lines}


def script(names: Sequence[str] = SCRIPTS) -> str:
    """The page's modules as one."""
    return "\n".join(_text(name) for name in names)


def _text(name: str) -> str:
    return (files(__package__) / "templates" / name).read_text(encoding="utf-8")


def _rendered(drivetrain: Drivetrain, drawn: Plots, data: Mapping[str, Any], **more: Any) -> str:
    own = script((*SCRIPTS, "start.js"))
    return (
        environment()
        .from_string(_text("explore.html"))
        .render(
            name=drivetrain.name,
            source=source_of(drivetrain.source),
            style=_text("explore.css"),
            library=drawn.script,
            script=own,
            hashes=" ".join(map(_hashed, (drawn.script, own))),
            data=_in_script(data),
            made=provenance(),
            **more,
        )
    )


def _in_script(data: Mapping[str, Any]) -> str:
    """JSON in which nothing can end the element it stands in."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _hashed(text: str) -> str:
    """What the page's policy calls a script that may run."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"

"""The page's axes, as Bokeh models: the page itself fills their sources."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import CommandError
from ..report.style import BLUE, INK, MUTED, VERMILLION

if TYPE_CHECKING:
    from bokeh.models import ColumnDataSource
    from bokeh.plotting import figure as Figure

FONT = "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', sans-serif"
# name of the source → colour (3 : 1 against white at least), dashes, width: the curve, what it is
# held against, and two files
CURVES: Mapping[str, tuple[str, str, float]] = {
    "against": ("#b07800", "solid", 1.5),
    "file1": (VERMILLION, "dashed", 1.5),
    "file2": ("#00805d", "dotdash", 1.5),
    "shown": (BLUE, "solid", 1.8),
}
PAGE = "explore.html"
TOOLS = "box_zoom,xwheel_zoom,pan,undo,reset"
MISSING = (
    "crosscheck explore draws with Bokeh, which is not installed: "
    "pip install 'drivetrain-crosscheck[explore]'"
)


@dataclass(frozen=True)
class Plots:
    """The library, and the figures by the name of the element they stand in."""

    script: str
    figures: Mapping[str, Any]


def require_library() -> None:
    """Refuse before anything is computed.

    Raises
    ------
    CommandError
        Bokeh is not installed.
    """
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise CommandError(MISSING) from error


def plots(first: float, last: float, speeds: tuple[float, float] | None) -> Plots:
    """The figures over a band (Hz) and, where speeds (rpm) are given, over them."""
    import bokeh
    from bokeh.embed import json_item

    figures = {"frf": _frf(first, last)}
    if speeds is not None:
        figures["campbell"] = _campbell(*speeds)
    library = Path(bokeh.__file__).parent / "server" / "static" / "js" / "bokeh.min.js"
    items = {name: json.loads(json.dumps(json_item(own, name))) for name, own in figures.items()}
    return Plots(library.read_text(encoding="utf-8"), items)


def _frf(first: float, last: float) -> Any:
    """Magnitude over phase (or difference), on one frequency axis, with resonances and a cursor."""
    from bokeh.core.properties import value
    from bokeh.layouts import column
    from bokeh.models import ColumnDataSource, HoverTool, LinearAxis, Range1d, Span

    sources = {name: _source(name, "f", "level", "below") for name in CURVES}
    level = _figure("level", 340, x_axis_type="log", y_axis_type="log", tools=TOOLS)
    level.x_range = Range1d(first, last, name="frequency")
    below = _figure("below", 220, x_axis_type="log", tools="", x_range=level.x_range)
    for name, (color, dash, width) in CURVES.items():
        for one, y in ((level, "level"), (below, "below")):
            one.line("f", y, source=sources[name], color=color, line_dash=dash, line_width=width)
    marks = ColumnDataSource({k: [] for k in ("f", "level", "number", "words")}, name="marks")
    dots = level.scatter(
        "f", "level", source=marks, size=7, fill_color="white", line_color=INK, line_width=1.3
    )
    level.text(
        "f", "level", "number", source=marks, text_font=value(FONT), text_font_size="11px",
        text_color=INK, text_align="center", text_baseline="bottom", y_offset=-5,
    )  # fmt: skip
    level.add_tools(HoverTool(renderers=[dots], tooltips="@words"))
    for one in (level, below):
        cursor = Span(dimension="height", location=first, line_color=INK, line_dash="dotted")
        cursor.name = f"cursor-{one.name}"
        one.add_layout(cursor)
    below.xaxis.axis_label = "Frequency (Hz)"
    assert isinstance(below.yaxis[0], LinearAxis)
    return column(level, below, sizing_mode="stretch_width")


def _campbell(first: float, last: float) -> Any:
    """Natural frequencies, level, and orders, through the origin."""
    from bokeh.models import HoverTool, Range1d

    shown = _figure("campbell", 340, tools=TOOLS)
    shown.x_range = Range1d(first, last, name="speed")
    shown.xaxis.axis_label, shown.yaxis.axis_label = "Speed (rpm)", "Frequency (Hz)"
    for name, color, width in (("levels", BLUE, 1.0), ("orders", MUTED, 1.4)):
        lines = shown.multi_line(
            "x", "y", source=_source(name, "x", "y", "words"), color=color, line_width=width
        )
        shown.add_tools(HoverTool(renderers=[lines], tooltips="@words", line_policy="interp"))
    return shown


def _figure(name: str, height: int, **options: Any) -> Figure:
    from bokeh.plotting import figure

    one = figure(
        name=name, height=height, sizing_mode="stretch_width", toolbar_location="above",
        active_scroll=None, active_drag="box_zoom" if options.get("tools") else None,
        min_border_right=12, **options,
    )  # fmt: skip
    one.toolbar.logo = None
    for axis in one.axis:
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font = axis.major_label_text_font = FONT
        axis.axis_label_text_font_size = axis.major_label_text_font_size = "13px"
        axis.axis_label_text_color = axis.major_label_text_color = INK
    one.outline_line_color = None
    one.grid.grid_line_color = "#e6eaee"
    return one


def _source(name: str, *columns: str) -> ColumnDataSource:
    from bokeh.models import ColumnDataSource

    return ColumnDataSource({column: [] for column in columns}, name=name)

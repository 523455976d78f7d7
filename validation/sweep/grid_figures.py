"""Pictures of a sweep over a grid: the FRF, and each metric, over the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from ..arrays import FloatArray, IndexArray
from ..report.figure import frequency_axis, level_axis
from ..report.frf_panel import Curve, FrfPanel, draw_magnitude
from ..report.style import (
    MUTED,
    WIDTH,
    along_axis,
)
from .axes import (
    MANY,
    Family,
    families,
    graded_colors,
    main_parameter,
    metric_axis,
    number,
    parameter_axis,
    parameter_value,
    varying,
)
from .metrics import decibels
from .result import SweepResult

Rows = Mapping[str, IndexArray]

MAP_COLUMNS, MAP_ROWS = 1200, 400
PANELS = 6  # FRFs of as many values of the other parameters
CURVES = 6  # as many can be told apart: more make a map
LABELLED = 8  # curves with a name each
LEVEL = "|H| (dB re 1 m/N)"


def draw_frfs(sweep: SweepResult, figure: Figure) -> None:
    """The FRF over frequency and the main parameter, a panel for each value of the others."""
    every = families(sweep, np.flatnonzero(sweep.results.ok))
    at = np.unique(np.linspace(0, len(every) - 1, PANELS).astype(int))
    shown = [every[k] for k in at]
    across = 1 if len(shown) <= 3 else 2
    down = -(-len(shown) // across)
    height = 0.55 if down == 1 else 0.32 * down
    figure.set_size_inches(WIDTH, height * WIDTH)
    panels = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True).ravel()
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    if max(len(family.rows) for family in shown) > CURVES:
        _maps(sweep, figure, list(panels), shown)
    else:
        _curves(sweep, list(panels), shown)
    for k, axes in enumerate(panels[: len(shown)]):
        lowest = k + across >= len(shown)
        frequency_axis(axes, sweep.frequency[0], sweep.frequency[-1], label=lowest)
        axes.xaxis.set_tick_params(labelbottom=lowest)
        axes.set_title(shown[k].label, fontweight="normal")
    part = f"; {len(shown)} of {len(every)} families" if len(shown) < len(every) else ""
    figure.suptitle(f"{sweep.title}: {sweep.frf_name}{part}", x=0.01, ha="left", fontweight="bold")


def _maps(
    sweep: SweepResult, figure: Figure, panels: Sequence[Axes], shown: Sequence[Family]
) -> None:
    """Levels in colours, one scale for all panels; each column is the highest of its lines."""
    main = main_parameter(sweep)
    along = along_axis(sweep.frequency)
    starts = np.unique(np.searchsorted(along, np.linspace(along[0], along[-1], MAP_COLUMNS)))
    starts = starts[starts < len(along)]
    levels, picked = [], []
    for family in shown:
        thinned = np.linspace(0, len(family.rows) - 1, MAP_ROWS).astype(int)
        rows = family.rows[np.unique(thinned)]
        highest = [np.maximum.reduceat(sweep.results.magnitude[row], starts) for row in rows]
        levels.append(decibels(np.array(highest)))
        picked.append(rows)
    finite = np.concatenate([level[np.isfinite(level)] for level in levels])
    low, high = np.percentile(finite, (1.0, 99.5))
    drawn: list[QuadMesh] = []
    for axes, rows, level in zip(panels, picked, levels, strict=False):
        drawn.append(
            axes.pcolormesh(
                sweep.frequency[starts],
                sweep.values[rows, main],
                level,
                shading="nearest",
                cmap="viridis",
                vmin=low,
                vmax=high,
                rasterized=True,
            )
        )
        parameter_axis(axes, sweep.parameter_labels[main], sweep.values[rows, main], vertical=True)
        axes.grid(visible=False)
    figure.colorbar(drawn[0], ax=list(panels), label=LEVEL)


def _curves(sweep: SweepResult, panels: Sequence[Axes], shown: Sequence[Family]) -> None:
    """One curve for each value of the main parameter."""
    main = main_parameter(sweep)
    colors = dict(
        zip(
            values := np.unique(sweep.values[:, main]).tolist(),
            graded_colors(len(values)),
            strict=True,
        )
    )
    for axes, family in zip(panels, shown, strict=False):
        curves = tuple(
            Curve(
                parameter_value(sweep, main, value := sweep.values[row, main]),
                sweep.results.magnitude[row], colors[value], 0.9,
            )
            for row in family.rows
        )  # fmt: skip
        draw_magnitude(axes, FrfPanel(sweep.frequency, curves), MAP_COLUMNS)
        level_axis(axes)
    panels[0].legend()


def draw_metrics(sweep: SweepResult, figure: Figure, shown: Rows) -> None:
    """Each metric over the main parameter, a curve for each value of the others.

    Of two parameters with more values than curves can be told apart, a map instead.
    """
    panels = metric_panels(figure, len(shown))
    for axes, (name, rows) in zip(panels, shown.items(), strict=True):
        members = families(sweep, rows)
        if len(members) > LABELLED and len(varying(sweep)) == 2:
            _metric_map(sweep, figure, axes, name, members)
        else:
            _metric_curves(sweep, axes, name, members)
    handles, labels = panels[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), 4))


def metric_panels(figure: Figure, count: int) -> list[Axes]:
    """A panel for each of so many metrics, three in a row."""
    across = min(count, 3)
    down = -(-count // across)
    figure.set_size_inches(WIDTH, 0.6 + 2.4 * down)
    panels = figure.subplots(down, across, squeeze=False).ravel()
    for axes in panels[count:]:
        axes.set_axis_off()
    return list(panels[:count])


def _metric_curves(sweep: SweepResult, axes: Axes, name: str, members: Sequence[Family]) -> None:
    """A curve for each family; more than can be told apart are drawn as one with gaps."""
    main = main_parameter(sweep)
    rows = np.concatenate([family.rows for family in members])
    x, y = sweep.values[rows, main], sweep.metrics[name][rows]
    ends = np.cumsum([len(family.rows) for family in members])[:-1]

    def curve(x: FloatArray, y: FloatArray, color: object, label: str | None = None) -> None:
        many = len(rows) > MANY
        axes.plot(x, y, ".-", color=color, ms=3, lw=0.8, label=label, rasterized=many)

    if len(members) > LABELLED:
        curve(np.insert(x, ends, np.nan), np.insert(y, ends, np.nan), MUTED)
    else:
        labels = [family.label if len(members) > 1 else None for family in members]
        colors = graded_colors(len(members))
        for part in zip(np.split(x, ends), np.split(y, ends), colors, labels, strict=True):
            curve(*part)
    parameter_axis(axes, sweep.parameter_labels[main], x, vertical=False)
    metric_axis(axes, sweep.metric_labels[name], y, vertical=True)


def _metric_map(
    sweep: SweepResult, figure: Figure, axes: Axes, name: str, members: Sequence[Family]
) -> None:
    """A metric in colours over both parameters; white where a sample has none."""
    main = main_parameter(sweep)
    (other,) = (k for k in varying(sweep) if k != main)
    along = np.unique(sweep.values[:, main])
    values = np.full((len(members), len(along)), np.nan)
    for line, family in zip(values, members, strict=True):
        line[np.searchsorted(along, sweep.values[family.rows, main])] = sweep.metrics[name][
            family.rows
        ]
    across = np.array([family.others[0] for family in members])
    picture = axes.pcolormesh(
        along, across, values, shading="nearest", cmap="viridis", rasterized=True
    )
    parameter_axis(axes, sweep.parameter_labels[main], along, vertical=False)
    parameter_axis(axes, sweep.parameter_labels[other], across, vertical=True)
    axes.grid(visible=False)
    figure.colorbar(picture, ax=axes, label=sweep.metric_labels[name], format=number)

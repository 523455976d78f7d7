"""Axes of a sweep's pictures: which parameters vary, along which one to draw, scales and ticks."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from ..arrays import FloatArray, IndexArray
from .result import SweepResult

MANY = 5000  # points: drawn as an image, for each would be an element of the page
FEW = 12  # values that each get a tick
ROUND_OFF = 1e-9  # a metric that varies less is constant


@dataclass(frozen=True, eq=False)
class Family:
    """Samples that differ in one parameter only.

    Attributes
    ----------
    label
        The other parameters that vary, with their values.
    others
        Those values.
    rows
        The samples that succeeded, in the order of the one parameter.
    """

    label: str
    others: tuple[float, ...]
    rows: IndexArray


def varying(sweep: SweepResult) -> list[int]:
    """Parameters that take more than one value."""
    return [k for k in range(len(sweep.samples.paths)) if np.ptp(sweep.values[:, k]) > 0.0]


def main_parameter(sweep: SweepResult) -> int:
    """The parameter to draw along: of those that vary, the first with the most values."""
    return max(varying(sweep), key=lambda k: len(np.unique(sweep.values[:, k])))


def families(sweep: SweepResult, rows: IndexArray) -> list[Family]:
    """Some samples of a grid, as families along the main parameter."""
    main = main_parameter(sweep)
    others = [k for k in varying(sweep) if k != main]
    members: dict[tuple[float, ...], list[int]] = {}
    for row in rows[np.argsort(sweep.values[rows, main], kind="stable")]:
        members.setdefault(tuple(sweep.values[row, others].tolist()), []).append(int(row))
    return [
        Family(
            ", ".join(parameter_value(sweep, k, v) for k, v in zip(others, at, strict=True)),
            at,
            np.array(members[at]),
        )
        for at in sorted(members)
    ]


def parameter_value(sweep: SweepResult, parameter: int, value: float) -> str:
    """``coupling.second_stiffness = 1e+06 N/m``."""
    return f"{sweep.samples.paths[parameter]} = {value:.6g} {sweep.units[parameter]}".rstrip()


def graded_colors(count: int) -> list[tuple[float, ...]]:
    """Colours in an order, dark to bright, none too bright for white paper."""
    return [tuple(c) for c in matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, count))]


def logarithmic(values: FloatArray) -> bool:
    """Whether values are better shown on a logarithmic axis."""
    return bool(values.min() > 0.0 and values.max() / values.min() > 20.0)


def parameter_axis(axes: Axes, label: str, values: FloatArray, *, vertical: bool) -> None:
    """A parameter's label and scale; few values each with a tick."""
    scale = "log" if logarithmic(values) else "linear"
    if vertical:
        axes.set(ylabel=label, yscale=scale)
    else:
        axes.set(xlabel=label, xscale=scale)
    axis = axes.yaxis if vertical else axes.xaxis
    ticks = np.unique(values)
    if len(ticks) <= FEW and (ticks == np.round(ticks)).all():  # numbers of things: no fractions
        axis.set_major_locator(FixedLocator(ticks.tolist()))
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(number))
    axis.set_minor_formatter(NullFormatter())


def constant_limits(values: FloatArray) -> tuple[float, float] | None:
    """Limits around a metric that is constant up to round-off; None for one that varies."""
    low, high = float(values.min()), float(values.max())
    if high - low > ROUND_OFF * max(abs(low), abs(high)):
        return None
    half = 0.05 * abs(low) or 1.0
    return low - half, high + half


def metric_axis(axes: Axes, label: str, values: FloatArray, *, vertical: bool) -> None:
    """A metric's scale and short numbers; what is constant up to round-off is drawn so."""
    scale = "log" if logarithmic(values) else "linear"
    limits = constant_limits(values)
    if vertical:
        axes.set(ylabel=label, yscale=scale, ylim=limits)
    else:
        axes.set(xlabel=label, xscale=scale, xlim=limits)
    axis = axes.yaxis if vertical else axes.xaxis
    axis.set_major_formatter(FuncFormatter(number))
    axis.set_minor_formatter(NullFormatter())


def number(value: float, _: object = None) -> str:
    """A tick's number: 12000 or 1e5, not 100000 or 1e+05."""
    text = f"{value:.6g}" if abs(value) < 1e5 else f"{value:.4g}"
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}e{int(exponent)}" if e else text

"""The Campbell diagram: natural frequencies against orders over a speed range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from mbs_models.orders import Order, orders
from mbs_models.parameters import Operation
from mbs_models.resonances import Crossing, crossings

from ..results import CrossCheck
from .style import KIND_COLORS, MUTED, ROUTE_COLORS, VERMILLION, WIDTH, styled, svg

LISTED = 30  # crossings in the table
LEAST_SHARE = 0.01  # crossings with less are counted, not listed
LOGARITHMIC = 30.0  # ratio of the highest order to the lowest from which the axis is logarithmic


@dataclass(frozen=True)
class Campbell:
    """The picture, the orders drawn, and the crossings that matter."""

    svg: str
    operation: Operation
    orders: tuple[Order, ...]
    listed: tuple[Crossing, ...]
    total: int


def draw_campbell(result: CrossCheck) -> Campbell | None:
    """The diagram of a drivetrain whose operation is given, if its input can turn freely."""
    operation, found = result.drivetrain.operation, orders(result.drivetrain, result.components)
    if operation is None or not found:
        return None
    met = all_crossings(result)
    telling = tuple(crossing for crossing in met if crossing.share >= LEAST_SHARE)
    with styled():
        picture = _picture(result, operation, found, telling)
    return Campbell(picture, operation, found, telling[:LISTED], len(met))


def all_crossings(result: CrossCheck) -> tuple[Crossing, ...]:
    """Every crossing within the speed range; none where no operation is given."""
    operation = result.drivetrain.operation
    if operation is None:
        return ()
    found = orders(result.drivetrain, result.components)
    return crossings(found, result.modes, result.components, operation.speed_range)


def crossings_document(result: CrossCheck) -> list[dict[str, Any]]:
    """The crossings as results.json has them."""
    return [
        {
            "order": crossing.order.name,
            "harmonic": crossing.harmonic,
            "per_turn": crossing.harmonic * crossing.order.factor,
            "speed_rpm": crossing.speed_rpm,
            "frequency_hz": crossing.frequency_hz,
            "mode": crossing.mode + 1,
            "energy_share": crossing.share,
        }
        for crossing in all_crossings(result)
    ]


def _picture(
    result: CrossCheck, operation: Operation, found: Sequence[Order], met: Sequence[Crossing]
) -> str:
    figure = Figure(figsize=(WIDTH, 5.2))
    axes = figure.add_axes((0.075, 0.1, 0.735, 0.87))
    first, last = operation.speed_range
    lowest, highest = _limits(found, last)
    axes.set_xlim(first, last)
    axes.set_ylim(lowest, highest)
    if lowest > 0.0:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(f"Speed of {operation.input} (rpm)")
    axes.set_ylabel("Frequency (Hz)")
    for mode in result.modes.modes:
        if lowest < mode.frequency_hz < highest:
            axes.axhline(mode.frequency_hz, color=KIND_COLORS[mode.kind], lw=0.8, alpha=0.55)
    _draw_orders(axes, found, first, last)
    for crossing in met:
        axes.plot(
            [crossing.speed_rpm], [crossing.frequency_hz], "o", zorder=5, clip_on=False,
            ms=3.0 + 13.0 * math.sqrt(crossing.share), mfc=VERMILLION, mec="white", mew=0.7,
            alpha=0.9,
        )  # fmt: skip
    return svg(figure, "campbell", "Campbell diagram: natural frequencies, orders and crossings")


def _limits(found: Sequence[Order], last: float) -> tuple[float, float]:
    """Frequencies drawn: from well below the lowest order's to above the highest's."""
    ends = [h * order.factor * last / 60.0 for order in found for h in order.harmonics]
    highest = 1.25 * max(ends)
    if max(ends) > LOGARITHMIC * min(ends):
        return 0.5 * min(ends), highest
    return 0.0, highest


def _draw_orders(axes: Axes, found: Sequence[Order], first: float, last: float) -> None:
    speed = np.linspace(first, last, 200)
    labels: list[tuple[float, str, str]] = []
    for number, order in enumerate(found):
        color = ROUTE_COLORS[number % len(ROUTE_COLORS)] if order.rows else MUTED
        for harmonic in order.harmonics:
            values = harmonic * order.factor * speed / 60.0
            dashes = _dashes(harmonic)
            axes.plot(speed, values, color=color, ls=dashes, lw=1.4 if order.rows else 1.0)
            labels.append((float(values[-1]), order.label(harmonic), color))
    _label_ends(axes, sorted(labels))


def _dashes(harmonic: int) -> str | tuple[float, tuple[float, ...]]:
    """Solid for the first harmonic, then as many dots between two dashes as it is above it."""
    return "solid" if harmonic == 1 else (0.0, (6.0, 2.0, *(1.0, 2.0) * (harmonic - 2)))


def _label_ends(axes: Axes, labels: Sequence[tuple[float, str, str]]) -> None:
    """Names at the right end of the lines, moved apart where lines end close together."""
    to_axes = axes.transData + axes.transAxes.inverted()
    right = axes.get_xlim()[1]
    heights = [float(to_axes.transform((right, value))[1]) for value, _, _ in labels]
    apart = 0.033
    for i in range(1, len(heights)):
        heights[i] = max(heights[i], heights[i - 1] + apart)
    over = max(0.0, heights[-1] - 1.0)
    for i in range(len(heights) - 1, -1, -1):
        limit = 1.0 if i == len(heights) - 1 else heights[i + 1] - apart
        heights[i] = min(heights[i], limit) if over else heights[i]
    for height, (_, words, color) in zip(heights, labels, strict=True):
        axes.text(
            1.012, height, words, transform=axes.transAxes, color=color, fontsize=7.5, va="center"
        )

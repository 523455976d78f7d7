"""The report's figures, each an SVG element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from mbs_models.modal.mode_kinds import Kind

from ..report.curves import extremes, relative_difference
from ..report.style import (
    CURVE_COLUMNS,
    KIND_COLORS,
    REFERENCE_COLOR,
    WIDTH,
    along_axis,
    decades,
    envelope,
    frequency_axis,
    log_axis,
    part_colors,
    route_colors,
    styled,
    svg,
)
from .error_figures import error_figure, heat_map, kernel_figure, worst_comparison
from .results import CrossCheck

FloatArray = NDArray[np.float64]

DASH = 5.0  # points: coincident routes take turns, each a dash of this length


@dataclass(frozen=True)
class CurveFigure:
    """The FRFs of one pair of DoFs by every route."""

    response: str
    excitation: str
    svg: str


@dataclass(frozen=True)
class Figures:
    """All figures; an empty string where there is nothing to draw."""

    shares: str
    curves: tuple[CurveFigure, ...]
    errors: str
    heat_map: str
    kernel: str


def draw_figures(result: CrossCheck) -> Figures:
    """Draw everything a report shows."""
    with styled():
        return Figures(
            shares=_shares(result),
            curves=tuple(
                CurveFigure(*pair, _curve(result, number, pair))
                for number, pair in enumerate(result.curves, start=1)
            ),
            errors=error_figure(result),
            heat_map=heat_map(worst_comparison(result), result.dofs),
            kernel=kernel_figure(result),
        )


# --- modes ----------------------------------------------------------------------------------


def _shares(result: CrossCheck) -> str:
    """Kinetic and strain energy of every mode by stage and coupling, as stacked bars."""
    modes = result.modes.modes
    drivetrain = result.drivetrain
    parts = [part.name for part in drivetrain.items]
    figure = Figure(figsize=(WIDTH, 3.9))
    top, bottom = figure.subplots(2, 1, sharex=True)
    figure.subplots_adjust(left=0.075, right=0.995, top=0.91, bottom=0.14, hspace=0.16)
    numbers = np.arange(1, len(modes) + 1)
    for axes, energy in ((top, "kinetic"), (bottom, "strain")):
        base = np.zeros(len(modes))
        for part, color in part_colors(parts).items():
            share = np.array([getattr(mode.shares, energy)[part] for mode in modes])
            axes.bar(numbers, share, 0.8, base, color=color, edgecolor="white", linewidth=0.5)
            base += share
        axes.set_ylim(0.0, 1.0)
        axes.set_yticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
        axes.set_ylabel(f"{energy.capitalize()} energy")
        axes.grid(visible=False, axis="x")
    step = ceil(len(modes) / 45)
    bottom.set_xticks(
        numbers[::step],
        [_short(mode.frequency_hz) for mode in modes[::step]],
        rotation=90,
        fontsize=7.0,
    )
    bottom.set_xlim(0.4, len(modes) + 0.6)
    handles = [Patch(color=color, label=part) for part, color in part_colors(parts).items()]
    figure.legend(handles=handles, loc="upper left", ncols=8, bbox_to_anchor=(0.065, 1.0))
    return svg(figure, "shares", "Energy shares of every mode by stage and coupling")


def _short(frequency: float) -> str:
    """A natural frequency in few characters."""
    return f"{frequency:.5g}" if frequency < 1e5 else f"{frequency:.1e}".replace("e+0", "e")


# --- FRFs -----------------------------------------------------------------------------------


def _curve(result: CrossCheck, number: int, pair: tuple[str, str]) -> str:
    """|H| by every route, the modes above it, and every route's relative difference below it."""
    by_route = result.curves[pair]
    reference = by_route[result.reference]
    routes = [route for route in by_route if route != result.reference]
    kinds = _kinds_in_band(result)
    heights = [0.14 * max(len(kinds), 1), 2.5, 1.3]
    legend_height, axis_height = 0.2 + 0.17 * ceil((len(routes) + 1) / 3), 0.45
    height = sum(heights) + 0.2 + legend_height + axis_height
    figure = Figure(figsize=(WIDTH, height))
    strip, magnitude, difference = figure.subplots(3, 1, sharex=True, height_ratios=heights)
    figure.subplots_adjust(
        left=0.105,
        right=0.985,
        top=1.0 - legend_height / height,
        bottom=axis_height / height,
        hspace=0.08,
    )
    _mode_strip(strip, kinds)
    _magnitudes(magnitude, result.frequency, reference, by_route, routes)
    differences = {route: relative_difference(reference, by_route[route]) for route in routes}
    _differences(difference, result.frequency, differences)
    frequency_axis(difference, result.frequency[0], result.frequency[-1])
    figure.legend(
        handles=_route_handles(result.reference, routes),
        loc="upper left",
        ncols=3,
        handlelength=3.2,
        bbox_to_anchor=(0.095, 1.0),
        borderaxespad=0.0,
    )
    return svg(figure, f"curve{number}", f"FRF {pair[0]} over {pair[1]} by every route")


def _kinds_in_band(result: CrossCheck) -> dict[str, list[float]]:
    """Natural frequencies within the band by kind of mode."""
    first, last = result.frequency[0], result.frequency[-1]
    kinds: dict[str, list[float]] = {}
    for kind in Kind:
        found = [m.frequency_hz for m in result.modes.modes if m.kind == kind]
        if inside := [f for f in found if first <= f <= last]:
            kinds[kind] = inside
    return kinds


def _mode_strip(axes: Axes, kinds: Mapping[str, Sequence[float]]) -> None:
    for row, (kind, frequencies) in enumerate(kinds.items()):
        axes.vlines(frequencies, row - 0.38, row + 0.38, color=KIND_COLORS[kind], linewidth=1.8)
    axes.set_ylim(len(kinds) - 0.4, -0.6)
    axes.set_yticks(range(len(kinds)), list(kinds), fontsize=7.0)
    axes.tick_params(length=0.0, which="both")
    axes.tick_params(axis="x", labelbottom=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.grid(visible=False, axis="x")


def _magnitudes(
    axes: Axes,
    frequency: FloatArray,
    reference: NDArray[np.complex128],
    by_route: Mapping[str, NDArray[np.complex128]],
    routes: Sequence[str],
) -> None:
    position = along_axis(frequency)
    level = _decibels(reference)
    at = extremes(position, level, CURVE_COLUMNS)
    axes.plot(frequency[at], level[at], color=REFERENCE_COLOR, linewidth=4.0)
    for number, (route, color) in enumerate(route_colors(routes).items()):
        level = _decibels(by_route[route])
        at = extremes(position, level, CURVE_COLUMNS)
        axes.plot(
            frequency[at],
            level[at],
            color=color,
            linewidth=1.2,
            linestyle=_turn(number, len(routes)),
            dash_capstyle="butt",
        )
    axes.set_ylabel("|H| (dB re 1 m/N)")
    axes.tick_params(axis="x", labelbottom=False)


def _turn(number: int, of: int) -> tuple[float, tuple[float, float]] | str:
    """A dash pattern that leaves room for all other routes' dashes."""
    return (number * DASH, (DASH, (of - 1) * DASH)) if of > 1 else "dashed"


def _differences(axes: Axes, frequency: FloatArray, differences: Mapping[str, FloatArray]) -> None:
    lowest, highest = decades(list(differences.values()))
    for number, (route, color) in enumerate(route_colors(list(differences)).items()):
        # Dashed over solid, and the dashed ones in turn, so that coincident routes all show.
        line = "solid" if number < 2 else (number * DASH, (DASH, DASH))
        envelope(axes, frequency, differences[route], 10.0**lowest, color=color, lw=1.3, ls=line)
    log_axis(axes, lowest, highest, most=4)
    axes.set_ylabel("|ΔH| / |H|")


def _route_handles(reference: str, routes: Sequence[str]) -> list[Line2D]:
    handles = [Line2D([], [], color=REFERENCE_COLOR, lw=4.0, label=f"{reference} (reference)")]
    handles += [
        Line2D([], [], color=color, lw=1.6, label=route)
        for route, color in route_colors(routes).items()
    ]
    return handles


def _decibels(receptance: NDArray[np.complex128]) -> FloatArray:
    with np.errstate(divide="ignore"):
        level: FloatArray = 20.0 * np.log10(np.abs(receptance))
    return level

"""How the report's figures look: colours, axes and what is drawn of a curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count, cycle, islice
from math import ceil, floor, log10
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mbs_models.modal.mode_kinds import Kind

from .curves import largest

FloatArray = NDArray[np.float64]

# Okabe & Ito (2008): told apart by every kind of colour vision, and by lightness in grey.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"

INK, MUTED = "#1a1f26", "#5b6570"
REFERENCE_COLOR, FLOOR_COLOR = "#c3c9cf", "#dfe3e7"

ROUTE_COLORS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY)
PART_COLORS = (BLUE, ORANGE, SKY, GREEN, PURPLE, YELLOW, VERMILLION)
KIND_COLORS: Mapping[str, str] = {
    Kind.RIGID_BODY: MUTED,
    Kind.ROTATIONAL: BLUE,
    Kind.TRANSLATIONAL: ORANGE,
    Kind.PLANET: GREEN,
    Kind.PARALLEL_STAGE: PURPLE,
    Kind.STAGE: SKY,
    Kind.GLOBAL: BLACK,
    Kind.MIXED: VERMILLION,
}

WIDTH = 10.0  # inches; the page scales it
CURVE_COLUMNS = 1000
ERROR_COLUMNS = 400
LOWEST_ERROR = -18  # decades; what is below (exact equality) is drawn there


class Canvas(Protocol):
    """What curves are drawn on: matplotlib's axes, or `plots.Axes`."""

    def plot(self, *args: Any, **kwargs: Any) -> Any:
        """A line through points."""

    def fill_between(self, *args: Any, **kwargs: Any) -> Any:
        """An area between two lines."""

    def set_ylabel(self, *args: Any, **kwargs: Any) -> Any:
        """The name of the vertical axis."""


def route_colors(routes: Sequence[str]) -> dict[str, str]:
    """A colour for each compared route."""
    return dict(zip(routes, islice(cycle(ROUTE_COLORS), len(routes)), strict=True))


def part_colors(parts: Sequence[str]) -> dict[str, str]:
    """A colour for each stage and coupling."""
    return dict(zip(parts, islice(cycle(PART_COLORS), len(parts)), strict=True))


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def power_of_ten(exponent: int) -> str:
    """10⁻⁸ as plain text."""
    return "10" + str(exponent).translate(SUPERSCRIPTS)


def decade_labels(lowest: int, highest: int, most: int) -> dict[float, str]:
    """The decades that are labelled, at most so many of them."""
    step = next(s for s in count(1) if (highest - lowest) / s <= most)
    exponents = range(highest - (highest - lowest) // step * step, highest + 1, step)
    return {10.0**e: power_of_ten(e) for e in exponents}


def is_logarithmic(first: float, last: float) -> bool:
    """Whether a band is drawn on a logarithmic axis."""
    return first > 0.0 and last / first > 10.0


def along_axis(frequency: FloatArray) -> FloatArray:
    """Where along the frequency axis each line is drawn."""
    return np.log10(frequency) if is_logarithmic(frequency[0], frequency[-1]) else frequency


def decades(errors: Sequence[FloatArray], least: float = 1e-12) -> tuple[int, int]:
    """Whole decades that hold all errors and ``least``."""
    positive = np.concatenate([e[np.isfinite(e) & (e > 0.0)] for e in errors])
    low, high = (positive.min(), positive.max()) if len(positive) else (least, least)
    lowest = max(floor(log10(low)), LOWEST_ERROR)
    return min(lowest, LOWEST_ERROR + 2), max(ceil(log10(max(high, least))), lowest + 1)


def envelope(
    axes: Canvas, frequency: FloatArray, values: FloatArray, lowest: float, **style: Any
) -> None:
    """Draw the largest value of each column."""
    at = largest(along_axis(frequency), values, ERROR_COLUMNS)
    axes.plot(frequency[at], np.maximum(values[at], lowest), **style)


def spread(wanted: FloatArray, width: float) -> FloatArray:
    """Ascending places in [0, 1] at least ``width`` apart, nearest to those wanted.

    The least squares under y_{i+1} − y_i ≥ width is an isotonic regression of y_i − i·width.
    Where they do not fit they share the axis evenly.
    """
    from scipy.optimize import isotonic_regression

    count = len(wanted)
    step = min(width, 1.0 / count)
    steps = step * np.arange(count)
    moved = isotonic_regression(wanted - steps).x
    return np.asarray(np.clip(moved, step / 2.0, 1.0 - step * (count - 0.5)) + steps)

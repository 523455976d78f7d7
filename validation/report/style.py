"""How the report's figures look: colours, lines and markers, and a figure as inline SVG."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from html import escape
from io import StringIO
from itertools import count, cycle, islice
from math import ceil, floor, log10
from typing import Any, Protocol

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import TICKDOWN
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator
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

STYLE: Mapping[str, Any] = {
    "svg.fonttype": "none",  # text stays text: searchable, and in the page's own typeface
    "svg.hashsalt": "crosscheck",
    "font.family": "DejaVu Sans",  # comes with matplotlib and runs wide: others fit its layout
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # else every label is measured to place a title above it
    "axes.labelsize": 8.5,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6eaee",
    "grid.linewidth": 0.6,
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.solid_capstyle": "round",
    "path.simplify": True,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
}


class Canvas(Protocol):
    """What curves are drawn on: matplotlib's axes, or `plots.Axes`."""

    def plot(self, *args: Any, **kwargs: Any) -> Any:
        """A line through points."""

    def fill_between(self, *args: Any, **kwargs: Any) -> Any:
        """An area between two lines."""

    def set_ylabel(self, *args: Any, **kwargs: Any) -> Any:
        """The name of the vertical axis."""


def styled() -> AbstractContextManager[None]:
    """Context in which the figures are drawn; nothing of it outlives the context."""
    return matplotlib.style.context(["default", dict(STYLE)])


def route_colors(routes: Sequence[str]) -> dict[str, str]:
    """A colour for each compared route."""
    return dict(zip(routes, islice(cycle(ROUTE_COLORS), len(routes)), strict=True))


def part_colors(parts: Sequence[str]) -> dict[str, str]:
    """A colour for each stage and coupling."""
    return dict(zip(parts, islice(cycle(PART_COLORS), len(parts)), strict=True))


def svg(figure: Figure, name: str, alternative: str) -> str:
    """A figure as an SVG element to stand inside a page.

    Parameters
    ----------
    figure
        What to draw.
    name
        Prefix that keeps the ids of several figures in one page apart.
    alternative
        What the figure shows, for those who cannot see it.
    """
    stream = StringIO()
    metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(stream, format="svg", metadata=metadata)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r'(id="|href="#|url\(#)', rf"\1{name}-", text)
    text = re.sub(r' d="[^"]*"', _shortened, text)
    text = re.sub(r"font-family: [^;\"]*;? ?", "", text)
    text = re.sub(r'(<svg\b[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg\b[^>]*?) height="[^"]*"', r"\1", text, count=1)
    return text.replace("<svg", f'<svg role="img" aria-label="{escape(alternative)}"', 1)


def _shortened(path: re.Match[str]) -> str:
    """Path data to a hundredth of a point, which is finer than any screen."""
    return re.sub(r"(\.\d\d)\d+", r"\1", path[0])


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def power_of_ten(exponent: int) -> str:
    """10⁻⁸ as plain text."""
    return "10" + str(exponent).translate(SUPERSCRIPTS)


def decade_labels(lowest: int, highest: int, most: int) -> dict[float, str]:
    """The decades that are labelled, at most so many of them."""
    step = next(s for s in count(1) if (highest - lowest) / s <= most)
    exponents = range(highest - (highest - lowest) // step * step, highest + 1, step)
    return {10.0**e: power_of_ten(e) for e in exponents}


def log_axis(axes: Axes, lowest: int, highest: int, most: int = 7) -> None:
    """A logarithmic y axis over whole decades, with at most ``most`` of them labelled."""
    labels = decade_labels(lowest, highest, most)
    axes.set_yscale("log")
    axes.set_ylim(10.0**lowest, 10.0**highest)
    axes.yaxis.set_major_locator(FixedLocator(list(labels)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: labels.get(value, "")))
    axes.yaxis.set_minor_locator(FixedLocator([]))


def level_axis(axes: Axes) -> None:
    """A vertical axis of dB."""
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−")))


def frequency_axis(axes: Axes, first: float, last: float, *, label: bool = True) -> None:
    """The frequency axis: logarithmic where the band spans more than a decade."""
    if is_logarithmic(first, last):
        axes.set_xscale("log")
        _mark_digits(axes, first, last)
    axes.xaxis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{value:,.6g}".replace(",", " "))
    )
    if last > first:
        axes.set_xlim(first, last)
    if label:
        axes.set_xlabel("Frequency (Hz)")


def _mark_digits(axes: Axes, first: float, last: float) -> None:
    """The marks of 2, 3, … 9 in each decade, as one line: a tick each would take most of the time
    that a page is drawn in.
    """
    axes.xaxis.set_minor_locator(NullLocator())
    decades = 10.0 ** np.arange(floor(log10(first)), ceil(log10(last)))
    digits = np.outer(decades, np.arange(2, 10)).ravel()
    shown = digits[(digits >= first) & (digits <= last)]
    axes.plot(
        shown, np.zeros(len(shown)), transform=axes.get_xaxis_transform(), clip_on=False, lw=0.0,
        marker=TICKDOWN, ms=2.0, mew=0.6, mec=MUTED,
    )  # fmt: skip


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

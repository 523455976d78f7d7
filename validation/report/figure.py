"""Figures that matplotlib draws, in the report's style, as inline SVG."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import AbstractContextManager
from html import escape
from io import StringIO
from math import ceil, floor, log10
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import TICKDOWN
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from .style import INK, MUTED, decade_labels, is_logarithmic

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


def styled() -> AbstractContextManager[None]:
    """Context in which the figures are drawn; nothing of it outlives the context."""
    return matplotlib.style.context(["default", dict(STYLE)])


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

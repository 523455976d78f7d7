"""The paper's pictures as FRF panels: modes, curves, and differences to the first curve."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ..report import frf_panel as panel
from ..report.plots import Dash
from ..report.style import INK, KIND_COLORS, MUTED, ROUTE_COLORS, WIDTH
from .item import Item, Picture

HALF = 6.0  # inches; two pictures side by side
DECADES = 8  # of the differences, below the largest one
DASHES: tuple[Dash, ...] = (
    "solid",
    (0.0, (5.0, 2.0)),
    (0.0, (1.2, 1.4)),
    (0.0, (7.0, 1.6, 1.4, 1.6)),
    (0.0, (3.0, 1.4)),
    (0.0, (9.0, 3.0)),
)
ONE_BY_ONE = re.compile(r"(\d+) left out")
UNTOUCHED = "no mode left out"  # shows that nothing but the truncation is at work


def draw(item: Item, shown: Picture, *, wide: bool) -> str:
    """A picture as SVG, over the page's width or half of it."""
    curves = _curves(shown)
    in_decibel = any(np.isfinite(each.decibel).any() for each in shown.differences)
    values = {
        each.curve: np.abs(each.decibel) if in_decibel else each.scaled
        for each in shown.differences
    }
    names = dict(zip((c.name for c in shown.curves), curves, strict=True))
    differences = tuple(
        panel.Curve("", values[name], c.color, c.width, c.dash)
        for name, c in names.items()
        if name in values
    )
    systems = {mark.system for mark in shown.resonances}
    modes = tuple(
        panel.Mode(
            f"{mark.system}: {mark.kind}" if len(systems) > 1 else str(mark.kind),
            mark.frequency_hz, KIND_COLORS[mark.kind], mark.visible,
        )
        for mark in shown.resonances
    )  # fmt: skip
    label = "|Difference| (dB)" if in_decibel else "|ΔH| / √(hᵢ hⱼ)"
    frf = panel.FrfPanel(
        shown.frequency, curves, (panel.Difference(label, differences, decades=DECADES),), modes,
        through=True, width=WIDTH if wide else HALF, from_zero=True,
    )  # fmt: skip
    return panel.frf_figure(
        frf, item.id, f"{item.place}: {item.title}, by {len(shown.curves)} curves"
    )


def _curves(shown: Picture) -> tuple[panel.Curve, ...]:
    """The first curve broad and grey, those of a series thin, every other in a style of its own."""
    first, *others = shown.curves
    series = [c.name for c in others if ONE_BY_ONE.fullmatch(c.name)]
    own = [c.name for c in others if c.name not in (*series, UNTOUCHED)]
    styles = dict(zip(own, zip(ROUTE_COLORS, DASHES, strict=False), strict=False))
    found = [panel.reference_curve(first.name, first.values)]
    for each in others:
        if each.name in series:
            legend = _series_legend(series) if each.name == series[0] else ""
            found.append(panel.Curve(legend, each.values, MUTED, 0.6))
        elif each.name == UNTOUCHED:
            found.append(panel.Curve(each.name, each.values, INK, 0.8, (0.0, (1.0, 3.0))))
        else:
            found.append(panel.Curve(each.name, each.values, styles[each.name][0], 1.3,
                                     styles[each.name][1]))  # fmt: skip
    return tuple(found)


def _series_legend(series: Sequence[str]) -> str:
    numbers = [int(name.split()[0]) for name in series]
    return f"{min(numbers)}, {min(numbers) + 1}, … {max(numbers)} left out, from the top"

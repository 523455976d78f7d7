"""The largest error of every pair of DoFs, a colour for each decade."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from io import BytesIO
from math import ceil

import numpy as np
from PIL import Image

from ..arrays import FloatArray
from ..checks.frfs import FrfComparison
from ..report.plots import plot_svg, text, upright
from ..report.style import MUTED, decades, power_of_ten

MANY_DOFS = 60  # more than that cannot be labelled one by one
LIGHT, DARK = (247, 251, 255), (8, 48, 107)  # a single hue, told apart by lightness
MOST_COLORS = 12


def heat_map(comparison: FrfComparison, dofs: Sequence[str]) -> str:
    """Largest scaled error over all lines of every pair of DoFs."""
    count = len(dofs)
    side = 72.0 * min(max(0.2 * count, 2.6), 6.6)
    left, top = 97.0, 6.0
    lowest, highest = decades([comparison.pair_max])
    step = ceil((highest - lowest) / MOST_COLORS)
    bounds = np.arange(float(lowest), highest + step, step)
    colors = _colors(len(bounds) - 1)
    exponent = np.log10(np.clip(comparison.pair_max, 10.0**lowest, None))
    decade = np.clip(np.searchsorted(bounds, exponent, "right") - 1, 0, len(colors) - 1)
    parts = [
        _image(colors[decade], left, top, side, side),
        "" if count > MANY_DOFS else _lines(count, left, top, side),
        *_labels(dofs, left, top, side),
        *_scale(bounds, colors, left + side + 18.0, top + 0.15 * side, 0.7 * side),
    ]
    words = f"Largest scaled error of every FRF, {comparison.route}"
    return plot_svg((left + side + 97.0, top + side + 97.0), (), "heatmap", words, *parts)


def _colors(count: int) -> FloatArray:
    """(count, 3) from light to dark."""
    return np.asarray(np.linspace(LIGHT, DARK, count)).round()


def _image(colors: FloatArray, left: float, top: float, width: float, height: float) -> str:
    """Cells (row, column, 3) of one colour each: an image of a pixel a cell, however many."""
    stream = BytesIO()
    Image.fromarray(colors.astype(np.uint8)).save(stream, "PNG")
    return (
        f'<image x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" '
        f'preserveAspectRatio="none" style="image-rendering:pixelated" '
        f'href="data:image/png;base64,{b64encode(stream.getvalue()).decode()}"/>'
    )


def _lines(count: int, left: float, top: float, side: float) -> str:
    """White lines between the cells."""
    at = side / count * np.arange(1, count)
    path = "".join(f"M{left:g} {top + y:.2f}h{side:.2f}" for y in at)
    path += "".join(f"M{left + x:.2f} {top:g}v{side:.2f}" for x in at)
    return f'<path d="{path}" stroke="#fff" stroke-width="0.3"/>'


def _labels(dofs: Sequence[str], left: float, top: float, side: float) -> list[str]:
    many = len(dofs) > MANY_DOFS
    size = 7.5 if many else min(7.5, 7.5 * 30 / len(dofs))
    ticks, names = part_ticks(dofs) if many else (np.arange(len(dofs)) + 0.5, list(dofs))
    at = side / len(dofs) * ticks
    rows = [
        text(left - 5.0, top + y + 0.35 * size, name, anchor="end", size=size)
        for y, name in zip(at, names, strict=True)
    ]
    columns = [
        upright(left + x, top + side + 5.0, name, size) for x, name in zip(at, names, strict=True)
    ]
    turned = f'transform="translate(10 {top + side / 2.0:.1f}) rotate(-90)"'
    return [
        *rows, *columns,
        text(0.0, 0.0, "Response", anchor="middle", more=turned),
        text(left + side / 2.0, top + side + 93.0, "Excitation", anchor="middle"),
    ]  # fmt: skip


def _scale(
    bounds: FloatArray, colors: FloatArray, left: float, top: float, height: float
) -> list[str]:
    """The colours with the decades between them."""
    at = top + height * (1.0 - np.arange(len(bounds)) / (len(bounds) - 1))
    turned = f'transform="translate({left + 60.0:.1f} {top + height / 2.0:.1f}) rotate(-90)"'
    return [
        _image(colors[::-1, None], left, top, 12.0, height),
        f'<rect x="{left:g}" y="{top:g}" width="12" height="{height:g}" fill="none" '
        f'stroke="{MUTED}" stroke-width="0.4"/>',
        *(
            text(left + 18.0, y + 3.0, power_of_ten(int(exponent)))
            for y, exponent in zip(at, bounds, strict=True)
        ),
        text(0.0, 0.0, "Largest scaled error", anchor="middle", more=turned),
    ]


def part_ticks(dofs: Sequence[str]) -> tuple[FloatArray, list[str]]:
    """One tick in the middle of every run of DoFs of the same part."""
    parts = [dof.partition(".")[0] for dof in dofs]
    starts = [i for i, part in enumerate(parts) if i == 0 or part != parts[i - 1]]
    ends = [*starts[1:], len(parts)]
    middles = np.array([(a + b) / 2.0 for a, b in zip(starts, ends, strict=True)])
    return middles, [parts[i] for i in starts]

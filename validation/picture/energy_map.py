"""Where every mode's energy sits: a map of components over modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from mbs_models.modal.energy import ComponentShares
from mbs_models.modal.mode_kinds import Mode
from mbs_models.system.components import SpringKind

from .symbols import number, text

FloatArray = NDArray[np.float64]

LEVELS = (0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.75)  # a share's colour is that of the level below it
BLUES = ("#e6f0f8", "#cbe0f0", "#a3c9e4", "#73add5", "#4490c3", "#1f6fab", "#0a4c86")
ORANGES = ("#fdeee0", "#fbdcbf", "#f8bf8d", "#f09a56", "#e0762d", "#c05412", "#8f3a06")

HEAD, ROW, BLOCK_GAP = 22.0, 13.0, 30.0
LETTER = 5.9  # widest mean width of a letter of a name
COLUMN_WIDTHS = (9.0, 26.0)
FOOT = 62.0


@dataclass(frozen=True)
class Grid:
    """Where the columns are: the first one's left edge, their width, and how many."""

    left: float
    width: float
    count: int

    @property
    def right(self) -> float:
        """Where the last column ends."""
        return self.left + self.width * self.count


def energy_map(shares: ComponentShares, modes: Sequence[Mode]) -> str:
    """Bodies' kinetic and springs' strain energy, a column for each mode."""
    width = min(max(780.0 / len(modes), COLUMN_WIDTHS[0]), COLUMN_WIDTHS[1])
    left = 14.0 + LETTER * max(map(len, (*shares.bodies, *shares.springs, " " * 23)))
    grid = Grid(left, width, len(modes))
    kinetic, bottom = _block("Kinetic energy", shares.bodies, shares.kinetic, BLUES, grid, 0.0)
    order = _in_order(shares)
    springs = [shares.springs[i] for i in order]
    strain, bottom = _block(
        "Strain energy", springs, shares.strain[order], ORANGES, grid, bottom + BLOCK_GAP
    )
    content = kinetic + strain + _frequencies(modes, grid, bottom) + _key(grid, bottom + FOOT + 8.0)
    across, height = max(grid.right + 10.0, left + 330.0), bottom + FOOT + 34.0
    label = "Energy shares of every body and spring in every mode"
    return (
        f'<svg role="img" aria-label="{escape(label)}" class="model energy" '
        f'style="max-width:{number(across)}px;min-width:{number(0.8 * across)}px" '
        f'viewBox="0 0 {number(across)} {number(height)}">{content}</svg>'
    )


def _block(
    heading: str,
    names: Sequence[str],
    values: FloatArray,
    colors: Sequence[str],
    grid: Grid,
    top: float,
) -> tuple[str, float]:
    """Names, grid and cells of one kind of energy; and where it ends."""
    top += HEAD
    bottom = top + ROW * len(names)
    drawn = text((grid.left, top - 8.0), heading, "title", "start")
    separators = [
        top + ROW * i
        for i in range(len(names) + 1)
        if i in (0, len(names)) or _stage(names[i]) != _stage(names[i - 1])
    ]
    rules = "".join(f"M{number(grid.left)} {number(y)}H{number(grid.right)}" for y in separators)
    for row, name in enumerate(names):
        drawn += text((grid.left - 6.0, top + ROW * row + 9.8), name, "name", "end")
    for level, color in enumerate(colors):
        cells = _cells(np.searchsorted(LEVELS, values, side="right") == level + 1, top, grid)
        if cells:
            drawn += f'<path style="fill:{color}" class="cell" d="{cells}"/>'
    return drawn + f'<path class="axis" d="{rules}"/>', bottom


def _stage(name: str) -> str:
    """The stage (or shafts) a component belongs to."""
    words = name.split()
    dotted = [word for word in words if "." in word]
    return words[0] if words[0] == SpringKind.SHAFT else (dotted or words)[0].partition(".")[0]


def _in_order(shares: ComponentShares) -> list[int]:
    """Springs by stage, then by what they are there for, the meshes of one gear together."""
    stages = list(dict.fromkeys(map(_stage, shares.springs)))
    kinds = list(SpringKind)

    def key(i: int) -> tuple[int, int, str]:
        name, kind = shares.springs[i], shares.kinds[i]
        gear = name.split(" – ")[0] if kind is SpringKind.MESH else ""
        return stages.index(_stage(name)), kinds.index(kind), gear

    return sorted(range(len(shares.springs)), key=key)


def _cells(chosen: NDArray[np.bool_], top: float, grid: Grid) -> str:
    box = f"h{number(grid.width - 1.0)}v{number(ROW - 1.0)}h-{number(grid.width - 1.0)}z"
    corners = (
        (grid.left + grid.width * column + 0.5, top + ROW * row + 0.5)
        for row, column in np.argwhere(chosen)
    )
    return "".join(f"M{number(x)} {number(y)}{box}" for x, y in corners)


def _frequencies(modes: Sequence[Mode], grid: Grid, bottom: float) -> str:
    drawn = ""
    for column, mode in enumerate(modes):
        x, y = grid.left + grid.width * (column + 0.5) + 3.0, bottom + 6.0
        value = mode.frequency_hz
        words = f"{value:.5g}" if value < 1e5 else f"{value:.1e}".replace("e+0", "e")
        turned = f"rotate(-90 {number(x)} {number(y)})"
        drawn += (
            f'<text class="name" x="{number(x)}" y="{number(y)}" text-anchor="end" '
            f'transform="{turned}">{words}</text>'
        )
    return drawn + text((grid.left - 6.0, bottom + 16.0), "Natural frequency (Hz)", "about", "end")


def _key(grid: Grid, top: float) -> str:
    """The colours, and the shares they begin at."""
    drawn = text((grid.left - 6.0, top + 13.0), "Share of the mode, from", "about", "end")
    for level, share in enumerate(LEVELS):
        x = grid.left + 44.0 * level
        for half, colors in enumerate((BLUES, ORANGES)):
            left = number(x + 21.0 * half)
            drawn += (
                f'<rect style="fill:{colors[level]}" x="{left}" y="{number(top)}" '
                'width="21" height="9"/>'
            )
        drawn += text((x, top + 20.0), f"{100 * share:g} %", "about", "start")
    return drawn

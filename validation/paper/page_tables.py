"""The paper report's tables, arranged to be read: truncation, shaft stiffness, locked systems."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from .results import LockedCheck, StiffnessRow
from .truncation_results import TruncationRow, TruncationStudy

REPEATED = 1e-6  # natural frequencies this close (relative) are one, repeated
NEGLIGIBLE_DB = 1e-3
SHADES = 5


@dataclass(frozen=True)
class Cell:
    """An error in dB, and its shade: 0 within the tolerance, then darker by half decades."""

    text: str
    shade: int


@dataclass(frozen=True)
class BasisRow:
    """One basis: what is left out, how many modes are kept, and its errors order by order."""

    left_out: str
    kept: int
    hub_mode: bool
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class HeatTable:
    """Modes kept × residual order → worst error of every FRF."""

    orders: tuple[str, ...]
    frfs: tuple[str, ...]
    rows: tuple[BasisRow, ...]
    smallest_frac: float
    largest_db: float


def heat_table(study: TruncationStudy) -> HeatTable:
    """Arrange every basis of a truncation study by modes kept and residual order."""
    frfs = tuple(study.rows[0].worst_db)
    orders = tuple(dict.fromkeys(row.residual_order for row in study.rows))
    rows = []
    for (left_out, hub_mode), group in groupby(study.rows, lambda r: (r.left_out, r.hub_mode)):
        by_order = {row.residual_order: row for row in group}
        cells = tuple(
            _cell(by_order[order].worst_db[frf], study.tolerance_db)
            for order in orders
            for frf in frfs
        )
        kept = next(iter(by_order.values())).kept
        rows.append(BasisRow(_left_out(left_out, hub_mode), kept, hub_mode, cells))
    smallest = min(value for row in study.rows for value in _finite(row))
    largest = max(row.largest_db for row in study.rows)
    return HeatTable(tuple(map(order_in_words, orders)), frfs, tuple(rows), smallest, largest)


def order_in_words(order: int | None) -> str:
    """A residual's order: none, static, ω², ω⁴ …."""
    if order is None:
        return "no residual"
    return "static residual" if order == 0 else f"up to ω{'²⁴⁶⁸'[order - 1]}"


def decibel(value: float) -> str:
    """An error in dB in few characters."""
    if math.isnan(value):
        return "H = 0"
    if value < NEGLIGIBLE_DB:
        return "0" if value == 0.0 else "<.001"
    return f"{value:.3f}" if value < 0.1 else f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


def _finite(row: TruncationRow) -> list[float]:
    return [value for value in row.frac.values() if math.isfinite(value)]


def _cell(value: float, tolerance: float) -> Cell:
    over = math.log10(value / tolerance) if value > tolerance else 0.0
    shade = min(SHADES, 1 + int(2.0 * over)) if value > tolerance else 0
    return Cell(decibel(value), shade)


def _left_out(count: int, hub_mode: bool) -> str:
    if count == 0:
        return "none"
    if hub_mode:
        return f"{count} below the hub’s"
    return "the hub’s" if count == 1 else f"the hub’s and {count - 1} below"


@dataclass(frozen=True)
class StiffnessLine:
    """A DoF's FRF for every k_sw: how it changes, and how far the two methods differ."""

    words: str
    label: str
    changes: tuple[str, ...]
    routes: float


def stiffness_table(rows: Sequence[StiffnessRow]) -> tuple[tuple[float, ...], list[StiffnessLine]]:
    """Every k_sw of a stiffness study, ascending, and a line for each DoF."""
    shafts = tuple(sorted({row.shaft_stiffness for row in rows}))
    lines = []
    for dof in dict.fromkeys(row.dof for row in rows):
        own = {row.shaft_stiffness: row for row in rows if row.dof == dof}
        changes = tuple(_change(own[shaft].change_db) for shaft in shafts[1:])
        routes = max(row.routes_scaled for row in own.values())
        lines.append(StiffnessLine(dof.words, dof.label, changes, routes))
    return shafts, lines


def _change(value: float) -> str:
    return "none" if value < 1e-6 else f"{decibel(value)} dB"


def locked_frequencies(check: LockedCheck) -> str:
    """Natural frequencies in Hz, repeated ones once with their number."""
    return ", ".join(
        (f"{f:.1f}" if f < 1e5 else f"{f:.3g}") + (f"({n})" if n > 1 else "")
        for f, n in _repeated(check.frequencies_hz)
    )


def _repeated(frequencies: Iterable[float]) -> Iterator[tuple[float, int]]:
    """Each frequency with how often it occurs."""
    groups: list[list[float]] = []
    for frequency in sorted(frequencies):
        if groups and frequency - groups[-1][0] <= REPEATED * frequency:
            groups[-1].append(frequency)
        else:
            groups.append([frequency])
    return ((group[0], len(group)) for group in groups)


def longest(seconds: Mapping[str, float], most: int = 12) -> dict[str, float]:
    """The items that took longest, the longest first."""
    ordered = sorted(seconds.items(), key=lambda entry: -entry[1])
    return dict(ordered[:most])

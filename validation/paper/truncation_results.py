"""What the study of modal truncation finds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class TruncationRow:
    """One basis of subsystem B and how wrong it makes the coupled FRFs below the band's end.

    Attributes
    ----------
    left_out
        How many modes beyond the band are left out.
    hub_mode
        Whether the hub's own mode (the highest) is kept.
    kept
        How many modes are kept.
    residual_order
        None: no residual; 0: static; k: up to ω^(2k).
    worst_db, worst_db_hz, level_there
        FRF (in words) → largest error in dB, at which line, and how |H| stands there against its
        median over the band (dB; far below it in an antiresonance).
    worst_scaled, frac
        FRF → largest scaled error, FRAC.
    """

    left_out: int
    hub_mode: bool
    kept: int
    residual_order: int | None
    worst_db: Mapping[str, float]
    worst_db_hz: Mapping[str, float]
    level_there: Mapping[str, float]
    worst_scaled: Mapping[str, float]
    frac: Mapping[str, float]

    @property
    def largest_db(self) -> float:
        """The largest error over all FRFs of the row that are not zero (dB)."""
        return max((v for v in self.worst_db.values() if not np.isnan(v)), default=0.0)


@dataclass(frozen=True)
class SmallestBasis:
    """The fewest modes that meet the tolerance with residuals up to an order (None: none)."""

    residual_order: int | None
    kept: int | None
    highest_kept_hz: float
    worst_db: float


@dataclass(frozen=True)
class TruncationStudy:
    """Modes of subsystem B left out one by one from the top (Figs. 13–16).

    Attributes
    ----------
    band_hz, loss_factor
        Upper end of the band; η of the structural damping of every spring.
    rows
        Every basis.
    tolerance_db, smallest
        The tolerance and, by residual order, the smallest basis that meets it in the FRFs listed.
    series_limit_hz
        The first mode beyond the band, below which the residual series converges.
    order_ratio
        Scaled error over *all* FRFs at the band's end, by residual order 0, 1, 2, …; the last
        entry of each pair is its ratio to the one before (None for the first).
    expected_ratio
        (band/series limit)², what one more order is worth at the band's end.
    note
        How the errors are judged, in words.
    """

    band_hz: float
    loss_factor: float
    rows: tuple[TruncationRow, ...]
    tolerance_db: float
    smallest: tuple[SmallestBasis, ...]
    series_limit_hz: float
    order_ratio: tuple[tuple[int, float, float | None], ...]
    expected_ratio: float
    note: str

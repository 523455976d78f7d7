"""Modal truncation of subsystem B (Figs. 13–16): modes beyond the band left out from the top.

    H_B ≈ Σ_kept φφᵀ/(μω_r² − ω²) + Σ_k R_k ω^2k/μ^(k+1),    μ = 1 + jη

is coupled with the exact FRFs of A and held against the full system. The highest mode of B is the
hub's (the paper's coupling mode).

An error counts by what the two DoFs do at that line, |ΔH_ij|/√(h_i h_j) with h the row norms of H:
in a deep antiresonance H_ij nearly vanishes and a tiny absolute error is many dB, where there is
next to no motion to measure. Errors in dB are shown; verdicts rest on the scaled ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf, TruncatedPart, bounded_frf, couple, direct_frf, modal_frf, truncate

from ..arrays import FloatArray
from ..checks.metrics import frac, scaled_error
from .bench import Bench, PaperBand, RouteName, difference, points_of, scale, with_loss_factor
from .item import Curve, Difference

BAND = PaperBand(4000.0, 1.0)
LOSS_FACTOR = 0.01
ORDERS: tuple[int | None, ...] = (None, 0, 1, 2)
HIGHEST_ORDER = 3


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

    @property
    def largest_scaled(self) -> float:
        """The largest scaled error over all FRFs of the row."""
        return max(self.worst_scaled.values())


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
    """

    band_hz: float
    loss_factor: float
    rows: tuple[TruncationRow, ...]
    tolerance_db: float
    smallest: tuple[SmallestBasis, ...]
    series_limit_hz: float
    order_ratio: tuple[tuple[int, float, float | None], ...]
    expected_ratio: float

    def row(self, left_out: int, hub_mode: bool, order: int | None) -> TruncationRow:
        """The row of a basis."""
        wanted = (left_out, hub_mode, order)
        return next(r for r in self.rows if (r.left_out, r.hub_mode, r.residual_order) == wanted)

    @property
    def beyond(self) -> int:
        """How many modes lie beyond the band."""
        return max(row.left_out for row in self.rows)


@dataclass(frozen=True)
class Basis:
    """Which modes of B are kept, and the residual's order (None: none)."""

    left_out: int
    hub_mode: bool
    residual_order: int | None

    def kept(self, count: int) -> list[int]:
        """Indices of the kept modes among ``count`` ascending ones."""
        if self.hub_mode and self.left_out:
            return [*range(count - 1 - self.left_out), count - 1]
        return list(range(count - self.left_out))


class TruncationBench:
    """Coupled FRFs with a truncated subsystem B, and the exact ones of the full system."""

    def __init__(self, bench: Bench, shaft: float | None = None) -> None:
        case = bench.case
        self.bench = bench
        self.shaft = case.shaft_stiffness if shaft is None else shaft
        self.model = bench.exudyn(self.shaft)
        self.a, self.b = case.a, case.b
        self.frequency = bench.axis(BAND, self.shaft).frequency
        self.system = with_loss_factor(self.model.stages[self.b], LOSS_FACTOR)
        self.modes = bench.modes(self.b, self.shaft)
        stage = with_loss_factor(self.model.stages[self.a], LOSS_FACTOR)
        labels = points_of(stage, self.labels)
        self.stage_a = direct_frf(stage, self.frequency, labels, labels)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the FRFs compared or drawn."""
        names = ("A.pinion.w", "A.pinion.y", "hub", "B.sun.u", "B.sun.w")
        return tuple(map(self.bench.case.label, names))

    @property
    def count(self) -> int:
        """Number of modes of B."""
        return int(self.modes.angular_frequency.size)

    @property
    def beyond(self) -> int:
        """How many modes of B lie beyond the band."""
        return int(np.sum(self.modes.natural_frequencies > BAND.end))

    @property
    def pairs(self) -> dict[str, tuple[str, str]]:
        """The FRFs compared, by name: (response, excitation)."""
        hub, sun, pinion = self.bench.case.hub, f"{self.b}.sun", f"{self.a}.pinion.w"
        return {
            "hub": (hub, hub),
            "sun w": (f"{sun}.w", f"{sun}.w"),
            "sun u": (f"{sun}.u", f"{sun}.u"),
            "pinion w": (pinion, pinion),
            "pinion w to sun w": (f"{sun}.w", pinion),
        }

    def full(self) -> Frf:
        """The full system's exact FRFs."""
        return self.bench.frf(RouteName.EXUDYN, BAND, self.shaft, loss_factor=LOSS_FACTOR)

    def stage(self, basis: Basis) -> Frf:
        """FRFs of B alone from a basis."""
        kept = basis.kept(self.count)
        truncated = truncate(self.system, kept, basis.residual_order, self.modes)
        labels = points_of(self.system, self.labels)
        return modal_frf(self.system, self.frequency, labels, labels, modes=truncated)

    def coupled(self, basis: Basis) -> Frf:
        """FRFs of AB with B from a basis."""
        return couple({self.a: self.stage_a, self.b: self.stage(basis)}, self.model.joints).frf

    def bound(self, basis: Basis, pair: tuple[str, str], alone: bool = False) -> FloatArray:
        """What an FRF of AB, or of B alone, from a basis is guaranteed to be wrong by (m/N)."""
        kept = basis.kept(self.count)
        part = TruncatedPart.of(self.system, kept, basis.residual_order, self.modes)
        parts: dict[str, TruncatedPart | Frf] = {self.b: part}
        if not alone:
            parts[self.a] = self.stage_a
        joints = () if alone else self.model.joints
        return bounded_frf(parts, joints, self.frequency, pair[:1], pair[1:]).between(*pair)

    def guaranteed(self, basis: Basis) -> float:
        """The largest scaled error that the bounds allow of all FRFs compared; infinite: none."""
        exact = self.full()
        return max(
            float((self.bound(basis, pair) / scale(exact, *pair)).max())
            for pair in self.pairs.values()
        )

    def row(self, basis: Basis) -> TruncationRow:
        """Errors of the coupled FRFs with a basis."""
        exact, coupled = self.full(), self.coupled(basis)
        found: dict[str, Difference] = {}
        criterion: dict[str, float] = {}
        level: dict[str, float] = {}
        for name, pair in self.pairs.items():
            h, g = exact.between(*pair), coupled.between(*pair)
            row_scale = scale(exact, *pair)
            found[name] = difference(self.frequency, Curve("", "", h), Curve("", "", g), row_scale)
            level[name] = self._level(np.abs(h), found[name].worst_db_hz)
            criterion[name] = frac(h, g)
        return TruncationRow(
            basis.left_out, basis.hub_mode, self.count - basis.left_out, basis.residual_order,
            {name: d.worst_db for name, d in found.items()},
            {name: d.worst_db_hz for name, d in found.items()},
            level, {name: d.worst_scaled for name, d in found.items()}, criterion,
        )  # fmt: skip

    def _level(self, size: FloatArray, frequency: float) -> float:
        """|H| at a line against its median (dB); NaN where no line is the worst, for H = 0."""
        if np.isnan(frequency):
            return float("nan")
        line = int(np.searchsorted(self.frequency, frequency))
        return float(20.0 * np.log10(size[line] / np.median(size)))


def truncation_study(bench: Bench) -> TruncationStudy:
    """Every basis from all modes to none beyond the band, and what its FRFs are worth."""
    trunk, tolerance_db = bench.once(TruncationBench), bench.tolerance_db
    rows = tuple(trunk.row(basis) for basis in _bases(trunk.beyond))
    limit = _first_beyond(trunk)
    ratios = order_errors(trunk)
    return TruncationStudy(
        band_hz=BAND.end,
        loss_factor=LOSS_FACTOR,
        rows=rows,
        tolerance_db=tolerance_db,
        smallest=tuple(_smallest(trunk, rows, order, tolerance_db) for order in ORDERS),
        series_limit_hz=limit,
        order_ratio=tuple(
            (order, error, error / ratios[order - 1] if order else None)
            for order, error in enumerate(ratios)
        ),
        expected_ratio=(BAND.end / limit) ** 2,
    )


def hub_note(trunk: TruncationBench) -> str:
    """Where the hub's mode is, if it is not the highest."""
    share = np.abs(trunk.modes.shapes[trunk.modes.dofs.index(trunk.bench.case.hub)])
    mode = int(np.argmax(share[trunk.modes.n_rigid :])) + trunk.modes.n_rigid
    if mode == trunk.count - 1:
        return ""
    where = trunk.modes.natural_frequencies[mode]
    return (
        f"In this model the hub moves most in the mode at {where:.1f} Hz, which is not the "
        "highest: what is called the hub's mode here is the highest mode."
    )


def _bases(beyond: int) -> list[Basis]:
    """0 … all modes beyond the band left out, the hub's mode kept or not, by residual order."""
    left_out = [(n, False) for n in range(beyond + 1)] + [(n, True) for n in range(1, beyond)]
    return [Basis(n, hub, order) for n, hub in left_out for order in ORDERS]


def _first_beyond(trunk: TruncationBench) -> float:
    frequencies = trunk.modes.natural_frequencies
    return float(frequencies[frequencies > BAND.end][0])


def _smallest(
    trunk: TruncationBench,
    rows: Sequence[TruncationRow],
    order: int | None,
    tolerance_db: float,
) -> SmallestBasis:
    """The fewest modes with residuals of this order whose FRFs meet the tolerance."""
    fit = [r for r in rows if r.residual_order == order and r.largest_db <= tolerance_db]
    if not fit:
        return SmallestBasis(order, None, float("nan"), float("nan"))
    best = min(fit, key=lambda r: (r.kept, r.largest_db))
    kept = Basis(best.left_out, best.hub_mode, order).kept(trunk.count)
    highest = float(trunk.modes.natural_frequencies[kept[-1]])
    return SmallestBasis(order, best.kept, highest, best.largest_db)


def order_errors(trunk: TruncationBench) -> tuple[float, ...]:
    """Largest scaled error over all FRFs at the band's end, by residual order 0, 1, 2, ….

    Modes beyond the band are all left out; the error of one left-out mode falls by (f/f_r)² with
    every order.
    """
    return tuple(
        float(error.max())
        for error in all_errors(
            trunk,
            np.array([BAND.end]),
            [Basis(trunk.beyond, False, order) for order in range(HIGHEST_ORDER + 1)],
        )
    )


def all_errors(
    trunk: TruncationBench, line: FloatArray, bases: Sequence[Basis]
) -> Iterator[FloatArray]:
    """Scaled errors (n_frequency, n, n) over all FRFs of AB, in the whole's labels, by basis."""
    whole = with_loss_factor(trunk.model.whole, LOSS_FACTOR)
    labels = whole.labels
    exact = direct_frf(whole, line)
    a = direct_frf(with_loss_factor(trunk.model.stages[trunk.a], LOSS_FACTOR), line)
    for basis in bases:
        kept = truncate(trunk.system, basis.kept(trunk.count), basis.residual_order, trunk.modes)
        b = modal_frf(trunk.system, line, modes=kept)
        coupled = couple({trunk.a: a, trunk.b: b}, trunk.model.joints).frf
        yield scaled_error(exact.values, coupled.select(labels, labels).values)

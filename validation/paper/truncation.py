"""Modal truncation of subsystem B (Figs. 13–16): modes beyond the band left out from the top.

    H_B ≈ Σ_kept φφᵀ/(μω_r² − ω²) + Σ_k R_k ω^2k/μ^(k+1),    μ = 1 + jη

is coupled with the exact FRFs of A and held against the full system. The highest mode of B is the
hub's (the paper's coupling mode).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fbs import Frf, couple, direct_frf, modal_frf, truncate

from ..checks.metrics import frac, scaled_error
from .curves import FrfBench, PaperBand, RouteName, difference, points_of, scale
from .model import with_loss_factor
from .results import Curve, Difference, FloatArray
from .truncation_results import SmallestBasis, TruncationRow, TruncationStudy

BAND = PaperBand(4000.0, 1.0)
LOSS_FACTOR = 0.01
ORDERS: tuple[int | None, ...] = (None, 0, 1, 2)
HIGHEST_ORDER = 3

NOTE = (
    "Structural damping K(1 + jη) in every spring keeps the peaks finite, so that an error in dB "
    "means something. The FRFs listed are judged in dB. Over all FRFs the scaled error is used, "
    "|ΔH_ij|/√(h_i h_j) with h the row norms of H: in a deep antiresonance H_ij nearly vanishes, a "
    "tiny absolute error is many dB there, where there is next to no motion to measure."
)


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

    def __init__(self, bench: FrfBench, shaft: float | None = None) -> None:
        case = bench.case
        self.bench = bench
        self.shaft = case.shaft_stiffness if shaft is None else shaft
        self.model = bench.systems.exudyn(self.shaft)
        self.a, self.b = case.parallel.name, case.planetary.name
        self.frequency = bench.axis(BAND, self.shaft).frequency
        self.system = with_loss_factor(self.model.stages[self.b], LOSS_FACTOR)
        self.modes = bench.systems.modes(self.b, self.shaft)
        stage = with_loss_factor(self.model.stages[self.a], LOSS_FACTOR)
        labels = points_of(stage, self.labels)
        self.stage_a = direct_frf(stage, self.frequency, labels, labels)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the FRFs judged or drawn."""
        a, b = self.a, self.b
        return f"{a}.pinion.w", f"{a}.pinion.y", self.bench.case.hub, f"{b}.sun.u", f"{b}.sun.w"

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
        """The FRFs judged in dB, by name: (response, excitation)."""
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


def truncation_study(bench: FrfBench, tolerance_db: float) -> TruncationStudy:
    """Every basis from all modes to none beyond the band, and what its FRFs are worth.

    Parameters
    ----------
    bench
        FRFs of the study.
    tolerance_db
        Largest error allowed of the FRFs listed, for the smallest basis.
    """
    trunk = TruncationBench(bench)
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
        note=NOTE + _hub_note(trunk),
    )


def _hub_note(trunk: TruncationBench) -> str:
    """Where the hub's mode is, if it is not the highest."""
    share = np.abs(trunk.modes.shapes[trunk.modes.dofs.index(trunk.bench.case.hub)])
    mode = int(np.argmax(share[trunk.modes.n_rigid :])) + trunk.modes.n_rigid
    if mode == trunk.count - 1:
        return ""
    where = trunk.modes.natural_frequencies[mode]
    return (
        f" In this model the hub moves most in the mode at {where:.1f} Hz, which is not the "
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
    line: FloatArray = np.array([BAND.end])
    whole = with_loss_factor(trunk.model.whole, LOSS_FACTOR)
    labels = whole.labels
    exact = direct_frf(whole, line)
    a = direct_frf(with_loss_factor(trunk.model.stages[trunk.a], LOSS_FACTOR), line)
    errors = []
    for order in range(HIGHEST_ORDER + 1):
        kept = Basis(trunk.beyond, False, order).kept(trunk.count)
        b = modal_frf(trunk.system, line, modes=truncate(trunk.system, kept, order, trunk.modes))
        coupled = couple({trunk.a: a, trunk.b: b}, trunk.model.joints).frf
        error = scaled_error(exact.values, coupled.select(labels, labels).values)
        errors.append(float(error.max()))
    return tuple(errors)

"""Every claim of the paper in one list, each judged by what was computed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load

from ..checks.published import PUBLISHED
from ..routes import equations
from .curves import Bench
from .formula_claims import formula_claims, natural_frequencies
from .method_claims import method_claims
from .model import PaperCase
from .printed_values import (
    HUB_INERTIA,
    PRINTED_TO_HZ,
    TABLE_2_BASE_RADII,
    TABLE_BAND_HZ,
    TIME_SAVED,
)
from .results import Claim, RowVerdict, Timing, TimingStudy, Verdict
from .tables import table_3
from .timing import timing_study
from .truncation import truncation_study
from .truncation_results import TruncationRow, TruncationStudy

LIN_PARKER = ("lin-parker-3", "lin-parker-4", "lin-parker-5")


def claims(
    cases: Mapping[str, PaperCase],
    bench: Bench,
    truncation: TruncationStudy | None,
    timing: TimingStudy | None,
    tolerance_db: float,
) -> tuple[Claim, ...]:
    """All claims; the two studies are made here if they have not been made yet."""
    return (
        *model_claims(cases, bench),
        *formula_claims(bench),
        *method_claims(bench),
        *truncation_claims(truncation or truncation_study(bench, tolerance_db)),
        time_claim(timing or timing_study(bench)),
    )


def model_claims(cases: Mapping[str, PaperCase], bench: Bench) -> Iterator[Claim]:
    """Secs. 2 and 4.1: the parameters and what they give."""
    yield parameters_claim(cases)
    yield lin_parker_claim()
    yield radii_claim()
    yield hub_inertia_claim(bench.case)


@statement(
    "table3-parameters", "Parameters of the planetary stage", "Sec. 4, Tables 2, 3",
    "The mechanical parameters of the studied system are given in Tables 1 and 2; Table 3 has "
    "its frequencies.",
    "the planetary rows of Table 3 with both parameter sets",
)  # fmt: skip
def parameters(bench: Bench) -> Finding:
    table = table_3(cases)
    of_b = [r for r in table.rows if r.kind not in (Kind.PARALLEL_STAGE, Kind.GLOBAL)]
    hits = {
        name: sum(
            name in r.found
            and abs(r.found[name].deviation_hz) <= table.tolerance_hz
            and r.found[name].multiplicity == r.multiplicity
            for r in of_b
        )
        for name in cases
    }
    words = ", ".join(f"{count} of {len(of_b)} rows with {name}" for name, count in hits.items())
    first, second = hits.values()
    missed = [r.printed for r in table.rows if r.verdict != RowVerdict.REPRODUCED]
    return Finding(
        Verdict.HOLDS if second >= first else Verdict.FAILS,
        f"{words}: Table 3's planetary columns are the gear set of Lin & Parker (1999), not Table "
        f"2's. Rows that no set gives as printed: {', '.join(missed) or 'none'}"
        if second < first
        else f"{words}; rows that no set gives as printed: {', '.join(missed) or 'none'}",
        {f"rows_{i}": float(count) for i, count in enumerate(hits.values())},
    )  # fmt: skip


@statement(
    "lin-parker", "Check with the literature", "Sec. 4.1, ref. [33]",
    "Natural frequencies and multiplicities for N = 3, 4, 5 are those of Lin & Parker.",
    "exudyn's modes of the three gear sets against the published tables",
)  # fmt: skip
def lin_parker(bench: Bench) -> Finding:
    from mbs_models.modal.modes import drivetrain_modes  # exudyn takes its time to load

    worst, counted = 0.0, True
    tables = {preset: PUBLISHED[preset] for preset in LIN_PARKER}
    for preset, published in tables.items():
        modes = drivetrain_modes(load(preset)).modes
        for kind, expected in published.by_kind.items():
            found = np.array([mode.frequency_hz for mode in modes if mode.kind == kind])
            counted &= len(found) == len(expected)
            if len(found) == len(expected) and kind != Kind.RIGID_BODY and expected:
                worst = max(worst, float(np.max(np.abs(found / expected - 1.0))))
    holds = counted and worst <= min(published.tolerance for published in tables.values())
    return Finding(
        Verdict.HOLDS if holds else Verdict.FAILS,
        f"the numbers of modes of each kind {'agree' if counted else 'differ'}, the frequencies to "
        f"{worst:.1e}",
        {"worst_relative": worst},
    )  # fmt: skip


@statement(
    "table2-radii", "Base radii", "Table 2",
    "Base radii 0.024 (sun), 0.056 (ring), 0.016 m (planet).",
    "r_r − (r_s + 2 r_p), which equal pressure angles ask to be zero",
)  # fmt: skip
def radii(bench: Bench) -> Finding:
    r = TABLE_2_BASE_RADII
    gap = r["ring"] - r["sun"] - 2.0 * r["planet"]
    return Finding(
        Verdict.HOLDS if abs(gap) <= 5e-4 else Verdict.FAILS,
        f"r_r − (r_s + 2 r_p) = {gap * 1e3:.1f} mm, printed to 1 mm",
        {"gap_m": gap},
    )  # fmt: skip


@statement(
    "hub-unit", "Unit of the hub's inertia", "Table 1",
    f"I_A = {HUB_INERTIA:g} kg m², among inertias I/r² in kg.",
    "natural frequencies to 15 kHz with I_A in kg m² and with I_A/r² in kg",
)  # fmt: skip
def hub_inertia(bench: Bench) -> Finding:
    case = bench.case
    as_mass = case.with_hub(HUB_INERTIA)
    as_inertia = case.with_hub(HUB_INERTIA / case.coupling.radius**2)
    first, second = (
        natural_frequencies(equations.drivetrain_system(c.drivetrain))
        for c in (as_mass, as_inertia)
    )
    inside = first <= TABLE_BAND_HZ
    shift = float(np.max(np.abs(second - first)[inside]))
    return Finding(
        Verdict.HOLDS if shift <= PRINTED_TO_HZ / 2.0 else Verdict.CORRECTED,
        f"no frequency below {TABLE_BAND_HZ / 1000:.0f} kHz moves by more than {shift:.2g} Hz from "
        "one reading to the other",
        {"largest_shift_hz": shift},
    )  # fmt: skip


def truncation_claims(study: TruncationStudy) -> Iterator[Claim]:
    """Sec. 4.4, quantified."""
    beyond = max(row.left_out for row in study.rows)
    no_hub = _row(study.rows, beyond, False, None)
    hub_kept = _row(study.rows, beyond - 1, True, None)
    residuals = [_row(study.rows, beyond, False, order) for order in (0, 1, 2)]
    tolerance = study.tolerance_db
    mended = next((r for r in residuals if r.largest_db <= tolerance), None)
    verdict = Verdict.HOLDS
    if hub_kept.largest_db > tolerance:
        verdict = Verdict.CORRECTED if mended else Verdict.FAILS
    worst_of = max(hub_kept.worst_db, key=lambda name: hub_kept.worst_db[name])
    level = hub_kept.level_there[worst_of]
    by_order = ", ".join(f"order {r.residual_order}: {r.largest_db:.2g} dB" for r in residuals)
    yield Claim(
        "modes-beyond", "Modes beyond the band",
        "All modes outside the frequency range except the coupling DoF's can be neglected.",
        "end of Sec. 4.4, Figs. 13–16; Sec. 5",
        f"B cut at {study.band_hz:g} Hz, coupled, loss factor {study.loss_factor:.0%}, worst error "
        "below the cut against the exact full system",
        verdict,
        f"all {beyond} modes left out: {_listed(no_hub)}; the {beyond - 1} others left out and the "
        f"hub's kept: {_listed(hub_kept)} (the largest where |H| is {level:+.0f} dB from its "
        f"median); all left out and their residual added: {by_order}. FRAC is at least "
        f"{min(*no_hub.frac.values(), *hub_kept.frac.values()):.3f} throughout, whatever the error"
        + (
            f". Within {tolerance:g} dB the modes can go, the hub's too, if a residual of order "
            f"{mended.residual_order} stays"
            if mended
            else ""
        ),
        {
            **{f"all_left_out_{k}_db": v for k, v in no_hub.worst_db.items()},
            **{f"hub_kept_{k}_db": v for k, v in hub_kept.worst_db.items()},
            **{f"residual_{r.residual_order}_db": r.largest_db for r in residuals},
            "smallest_frac": min(*no_hub.frac.values(), *hub_kept.frac.values()),
        },
    )  # fmt: skip
    ratios = [ratio for _, _, ratio in study.order_ratio if ratio is not None]
    static_hub = _row(study.rows, 1, False, 0)
    yield Claim(
        "coupling-mode", "The coupling mode",
        "The FRFs are sensitive to the truncation of the coupling mode.", "Sec. 4.4, Figs. 15, 16",
        "the hub's mode alone left out, without and with its static residual",
        Verdict.HOLDS
        if _row(study.rows, 1, False, None).largest_db > tolerance
        else Verdict.FAILS,
        f"left out: {_listed(_row(study.rows, 1, False, None))}; with its static flexibility (the "
        f"shaft's) in its place: at most {static_hub.largest_db:.2g} dB. Every further "
        f"order multiplies the error over all FRFs at {study.band_hz:g} Hz by {max(ratios):.2f} or "
        f"less (expected: (band/first mode left out)² = {study.expected_ratio:.2f})",
        {"without_db": _row(study.rows, 1, False, None).largest_db,
         "static_db": static_hub.largest_db, "expected_ratio": study.expected_ratio,
         **{f"ratio_{i}": r for i, r in enumerate(ratios, start=1)}},
    )  # fmt: skip


def _row(
    rows: Sequence[TruncationRow], left_out: int, hub_mode: bool, order: int | None
) -> TruncationRow:
    wanted = (left_out, hub_mode, order)
    return next(r for r in rows if (r.left_out, r.hub_mode, r.residual_order) == wanted)


def _listed(row: TruncationRow) -> str:
    return ", ".join(f"{error:.2g} dB at {name}" for name, error in row.worst_db.items())


def _times(timings: Sequence[Timing]) -> str:
    return ", ".join(f"{t.name} {t.seconds * 1e3:.0f} ms" for t in timings)


@statement(
    "time", "Computing time", "Sec. 4.1",
    f"The coupling method reduces the computational time by {TIME_SAVED:.0%}.",
    f"both ways timed side by side: {study.conditions}",
)  # fmt: skip
def time(bench: Bench) -> Finding:
    full = min(t.seconds for t in study.single if t.name.startswith("full"))
    coupled = min(t.seconds for t in study.single if not t.name.startswith("full"))
    sweep_full = min(t.seconds for t in study.sweep if t.name.startswith("full"))
    sweep = min(t.seconds for t in study.sweep if not t.name.startswith("full"))
    saved, saved_sweep = 1.0 - coupled / full, 1.0 - sweep / sweep_full
    verdict = Verdict.FAILS
    if saved_sweep >= TIME_SAVED:
        verdict = Verdict.CORRECTED
    if saved >= TIME_SAVED:
        verdict = Verdict.HOLDS
    return Finding(
        verdict,
        f"once, all FRFs: {_times(study.single)}, so that the faster way to couple takes "
        f"{coupled / full:.2f} times as long as the faster full one; a sweep of k_sw: "
        f"{_times(study.sweep)}, {sweep / sweep_full:.2f} times as long where the stages are "
        "reused",
        {"saved_once": saved, "saved_in_sweep": saved_sweep},
    )  # fmt: skip

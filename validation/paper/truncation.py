"""What the paper says of modal truncation (Sec. 4.4), and the numbers it is held against."""

from __future__ import annotations

import math

from markupsafe import Markup

from ..report.digits import scientific
from ..report.page import Block, Columns, Note, Section, Table
from .bench import Bench
from .item import Finding, Verdict, statement
from .modal_bases import (
    BAND,
    LOSS_FACTOR,
    TruncationBench,
    TruncationRow,
    TruncationStudy,
    hub_note,
    truncation_study,
)

NEGLIGIBLE_DB = 1e-3
SHADES = 5

NOTE = (
    "Structural damping K(1 + jη) in every spring keeps the peaks finite, so that an error in dB "
    "means something. In a deep antiresonance H_ij nearly vanishes, and a tiny absolute error is "
    "many dB there, where there is next to no motion to measure: verdicts rest on the scaled error "
    "|ΔH_ij|/√(h_i h_j), h the row norms of H. "
)


@statement(
    "modes-beyond", "Modes beyond the band", "end of Sec. 4.4, Figs. 13–16; Sec. 5",
    "All modes outside the frequency range except the coupling DoF's can be neglected.",
    f"B cut at {BAND.end:g} Hz, coupled, loss factor {LOSS_FACTOR:.0%}, worst scaled error below "
    "the cut against the exact full system",
)  # fmt: skip
def modes_beyond(bench: Bench) -> Finding:
    """Can modes beyond the band be left out?"""
    study, allowed = bench.once(truncation_study), bench.tolerance
    beyond = study.beyond
    no_hub = study.row(beyond, False, None)
    hub_kept = study.row(beyond - 1, True, None)
    residuals = [study.row(beyond, False, order) for order in (0, 1, 2)]
    mended = next((r for r in residuals if r.largest_scaled <= allowed), None)
    smallest_frac = min(*no_hub.frac.values(), *hub_kept.frac.values())
    worst_of = max(hub_kept.worst_db, key=lambda name: hub_kept.worst_db[name])
    by_order = ", ".join(f"order {r.residual_order}: {_worst(r)}" for r in residuals)
    evidence = (
        f"scaled error, {allowed:.1%} allowed (and dB): all {beyond} modes left out: "
        f"{_listed(no_hub)}; the {beyond - 1} others left out and the hub's kept: "
        f"{_listed(hub_kept)} (the largest in dB where |H| is "
        f"{hub_kept.level_there[worst_of]:+.0f} dB from its median); all left out and their "
        f"residual added: {by_order}. FRAC is at least {smallest_frac:.3f} throughout, whatever "
        "the error"
    )
    if mended:
        evidence += (
            f". Within {allowed:.1%} the modes can go, the hub's too, if a residual of order "
            f"{mended.residual_order} stays"
        )
    return Finding(
        Verdict.of(hub_kept.largest_scaled <= allowed, mended is not None),
        evidence,
        {
            **{f"all_left_out_{k}_db": v for k, v in no_hub.worst_db.items()},
            **{f"hub_kept_{k}_db": v for k, v in hub_kept.worst_db.items()},
            **{f"residual_{r.residual_order}_db": r.largest_db for r in residuals},
            "all_left_out_scaled": no_hub.largest_scaled,
            "hub_kept_scaled": hub_kept.largest_scaled,
            **{f"residual_{r.residual_order}_scaled": r.largest_scaled for r in residuals},
            "smallest_frac": smallest_frac,
        },
        blocks=study_blocks(study, NOTE + hub_note(bench.once(TruncationBench))),
        details={"truncation": study},
    )


@statement(
    "coupling-mode", "The coupling mode", "Sec. 4.4, Figs. 15, 16",
    "The FRFs are sensitive to the truncation of the coupling mode.",
    "the hub's mode alone left out, without and with its static residual",
)  # fmt: skip
def coupling_mode(bench: Bench) -> Finding:
    """Is the hub's mode missed where it is left out?"""
    study = bench.once(truncation_study)
    without, static = study.row(1, False, None), study.row(1, False, 0)
    ratios = [ratio for _, _, ratio in study.order_ratio if ratio is not None]
    return Finding(
        Verdict.of(without.largest_scaled > bench.tolerance),
        f"left out, scaled error (and dB): {_listed(without)}; with its static flexibility (the "
        f"shaft's) in its place: {_worst(static)}. Every further order multiplies the error over "
        f"all FRFs at {study.band_hz:g} Hz by {max(ratios):.2f} or less (expected: (band/first "
        f"mode left out)² = {study.expected_ratio:.2f})",
        {"without_db": without.largest_db, "static_db": static.largest_db,
         "without_scaled": without.largest_scaled, "static_scaled": static.largest_scaled,
         "expected_ratio": study.expected_ratio,
         **{f"ratio_{i}": r for i, r in enumerate(ratios, start=1)}},
    )  # fmt: skip


def _listed(row: TruncationRow) -> str:
    return ", ".join(
        f"{row.worst_scaled[name]:.2g} ({decibel(error)} dB) at {name}"
        for name, error in row.worst_db.items()
    )


def _worst(row: TruncationRow) -> str:
    return f"{row.largest_scaled:.2g} ({decibel(row.largest_db)} dB)"


# --- the study as tables ---


def study_blocks(study: TruncationStudy, note: str) -> tuple[Block, ...]:
    """Errors by modes kept and residual, the smallest bases, and what an order is worth."""
    fracs = [v for row in study.rows for v in row.frac.values() if math.isfinite(v)]
    largest = max(row.largest_db for row in study.rows)
    orders = dict.fromkeys(row.residual_order for row in study.rows)
    tables = tuple(
        Section("", f"Worst error (dB), residual: {order_in_words(o)}", (error_table(study, o),))
        for o in orders
    )
    return (
        Columns(tables),
        Note(
            f"White: within {study.tolerance_db:g} dB; the darker, the further beyond it. The "
            f"smallest FRAC of all is {min(fracs):.3f}, although errors reach {decibel(largest)} "
            "dB: FRAC sees the peaks and little else."
        ),
        Note(note),
        Columns(
            (
                Section("", f"Smallest basis within {study.tolerance_db:g} dB", (_bases(study),)),
                Section(
                    "", "What another order is worth",
                    (
                        _orders(study),
                        Note(
                            f"At {study.band_hz:g} Hz, every mode beyond it left out. Expected by "
                            f"the first mode left out, at {study.series_limit_hz:.0f} Hz: "
                            f"{study.expected_ratio:.2f}."
                        ),
                    ),
                ),
            )
        ),
    )  # fmt: skip


def error_table(study: TruncationStudy, order: int | None) -> Table:
    """A row for each basis with a residual; cells are darker the further they are off."""
    rows = tuple(
        (_left_out(row), str(row.kept),
         *(_cell(error, study.tolerance_db) for error in row.worst_db.values()))
        for row in study.rows
        if row.residual_order == order
    )  # fmt: skip
    headings = ("Left out", "Kept", *study.rows[0].worst_db)
    return Table(headings, rows, frozenset(range(1, len(headings))), style="heat")


def _cell(value: float, tolerance: float) -> str:
    """An error, shaded by half decades beyond the tolerance."""
    text = decibel(value)
    if not value > tolerance:
        return text
    shade = min(SHADES, 1 + int(2.0 * math.log10(value / tolerance)))
    return Markup('<b class="shade-{}">{}</b>').format(shade, text)


def _left_out(row: TruncationRow) -> str:
    if row.left_out == 0:
        return "none"
    if row.hub_mode:
        return f"{row.left_out} below the hub's"
    return "the hub's" if row.left_out == 1 else f"the hub's and {row.left_out - 1} below"


def order_in_words(order: int | None) -> str:
    """A residual's order: none, static, ω², ω⁴ …."""
    if order is None:
        return "none"
    return "static" if order == 0 else f"up to ω{'²⁴⁶⁸'[order - 1]}"


def decibel(value: float) -> str:
    """An error in dB in few characters."""
    if math.isnan(value):
        return "H = 0"
    if value < NEGLIGIBLE_DB:
        return "0" if value == 0.0 else "<.001"
    return f"{value:.3f}" if value < 0.1 else f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


def _bases(study: TruncationStudy) -> Table:
    rows = []
    for basis in study.smallest:
        highest = basis.highest_kept_hz
        found = (
            ("none of these", "", "")
            if basis.kept is None
            else (
                str(basis.kept),
                f"{highest:.5g}" if highest < 1e5 else scientific(highest),
                decibel(basis.worst_db),
            )
        )
        rows.append((order_in_words(basis.residual_order), *found))
    headings = ("Residual", "Modes kept", "Highest kept (Hz)", "Worst error (dB)")
    return Table(headings, tuple(rows), frozenset({1, 2, 3}))


def _orders(study: TruncationStudy) -> Table:
    rows = tuple(
        (order_in_words(order), scientific(error), "–" if ratio is None else f"{ratio:.2f}")
        for order, error, ratio in study.order_ratio
    )
    headings = ("Residual", "Scaled error, all FRFs", "Ratio to the order before")
    return Table(headings, rows, frozenset({1, 2}))

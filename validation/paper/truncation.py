"""What the paper says of modal truncation (Sec. 4.4), and the numbers it is held against."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from ..report.digits import scientific
from ..report.page import Block, Columns, Note, Section, Table
from .bench import Bench, peaks
from .condensed_figures import hz
from .figures import WIDE
from .item import Finding, Verdict, statement
from .modal_bases import (
    BAND,
    LOSS_FACTOR,
    Basis,
    TruncationBench,
    TruncationRow,
    TruncationStudy,
    all_errors,
    hub_note,
    truncation_study,
)

PRINTED_PEAKS_HZ = (1400.0, 1800.0, 2500.0, 2650.0)
"""Sec. 4.4, of Fig. 13."""

PEAK_HZ = 25.0
"""Half of the 50 Hz to which the printed ones are given."""

RIGID_SHAFT = 1e12
"""k_sw (N/m) that no mode of the band can tell from a rigid shaft."""

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
    trunk = bench.once(TruncationBench)
    guaranteed = {"hub_kept": trunk.guaranteed(Basis(beyond - 1, True, None))} | {
        f"residual_{order}": trunk.guaranteed(Basis(beyond, False, order)) for order in (0, 1, 2)
    }
    by_bound = ", ".join(
        f"{'the hub kept' if name == 'hub_kept' else name.replace('_', ' of order ')} {bound:.2g}"
        for name, bound in guaranteed.items()
    )
    evidence = (
        f"scaled error, {allowed:.1%} allowed (and dB): all {beyond} modes left out: "
        f"{_listed(no_hub)}; the {beyond - 1} others left out and the hub's kept: "
        f"{_listed(hub_kept)} (the largest in dB where |H| is "
        f"{hub_kept.level_there[worst_of]:+.0f} dB from its median); all left out and their "
        f"residual added: {by_order}. FRAC is at least {smallest_frac:.3f} throughout, whatever "
        f"the error. Guaranteed by bounds that know no exact FRF: {by_bound}"
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
            **{f"{name}_guaranteed": bound for name, bound in guaranteed.items()},
            "smallest_frac": smallest_frac,
        },
        blocks=study_blocks(study, NOTE + hub_note(trunk)),
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


@statement(
    "fig13-peaks", "Frequencies that truncation brings", "Sec. 4.4, Fig. 13",
    "Frequencies appear around 1400, 1800, 2500 and 2650 Hz in the radial and the rotational FRF, "
    "due to the modes selected.",
    "peaks of the sun's u and w in AB with the hub's mode left out that the full system does not "
    "have, against the modes of AB with a rigid shaft",
)  # fmt: skip
def frequencies_of_truncation(bench: Bench) -> Finding:
    """Which peaks does leaving the hub's mode out bring, and where do they come from?"""
    radial, rotational = (_new_peaks(bench, f"B.sun.{dof}") for dof in "uw")
    rigid = bench.modes("", RIGID_SHAFT).natural_frequencies
    met = [f for f in PRINTED_PEAKS_HZ if any(abs(f - g) <= PEAK_HZ for g in rotational)]
    known = all(np.min(np.abs(rigid - f)) <= PEAK_HZ for f in rotational)
    source = (
        f"modes of AB with a rigid shaft (to {PEAK_HZ:.0f} Hz): without its own mode the hub moves "
        "as the sun does"
        if known
        else "not the modes of AB with a rigid shaft"
    )
    return Finding(
        Verdict.of(len(met) == len(PRINTED_PEAKS_HZ) and bool(radial)),
        f"in w: {hz(rotational)}, which are {source}. In u: {hz(radial)}. Of the printed "
        f"frequencies {hz(met)} are among them (within {PEAK_HZ:.0f} Hz)",
        {
            "met": float(len(met)),
            "new_in_w": float(len(rotational)),
            "new_in_u": float(len(radial)),
        },
    )


@statement(
    "a-in-b", "Frequencies of A in truncated B", "Sec. 4.4, Fig. 13",
    "Some peaks in Fig. 13 correspond to the frequencies of subsystem A.",
    "the same peaks against the natural frequencies of A alone",
)  # fmt: skip
def frequencies_of_a(bench: Bench) -> Finding:
    """Are the new peaks of truncated B those of A?"""
    return _of_the_other(bench, "B.sun.w", bench.case.a)


@statement(
    "b-in-a", "Frequencies of B in A", "Sec. 4.4, Fig. 16",
    "Some clearly seen peaks of A correspond to the rotational frequencies of subsystem B, when "
    "the coupling DoF is truncated.",
    "new peaks of the pinion's w in AB with the hub's mode left out, against the natural "
    "frequencies of B alone",
)  # fmt: skip
def frequencies_of_b(bench: Bench) -> Finding:
    """Are the new peaks of A those of B?"""
    return _of_the_other(bench, "A.pinion.w", bench.case.b)


def _of_the_other(bench: Bench, dof: str, other: str) -> Finding:
    """Whether new peaks at a DoF are natural frequencies of the other subsystem alone."""
    found = _new_peaks(bench, dof)
    natural = bench.modes(other).natural_frequencies
    gaps = {f: float(natural[np.argmin(np.abs(natural - f))]) - f for f in found}
    met = [f for f, gap in gaps.items() if abs(gap) <= BAND.step]
    nearest = ", ".join(f"{f:.0f} Hz ({gap:+.0f})" for f, gap in gaps.items())
    return Finding(
        Verdict.of(bool(met)),
        f"new peaks, and how far the nearest natural frequency of '{other}' alone is: {nearest}; "
        f"{len(met)} of {len(found)} are one of its (fig13-peaks says whose the others are)",
        {"met": float(len(met)), "new": float(len(found))},
    )


def _new_peaks(bench: Bench, dof: str) -> list[float]:
    """Peaks (Hz) with the hub's mode left out that the full system does not have."""
    trunk, label = bench.once(TruncationBench), bench.case.label(dof)
    full, truncated = (
        peaks(trunk.frequency, frf.between(label, label))
        for frf in (trunk.full(), trunk.coupled(Basis(1, False, None)))
    )
    return [float(f) for f in truncated if np.min(np.abs(full - f)) > BAND.step]


@statement(
    "b-affects-a", "Truncating B, felt in A and in B", "end of Sec. 4.4",
    "The truncation of modes of B affects the FRF of subsystem A more than that of B.",
    "scaled errors of all FRFs of A and of B in AB, B truncated, median over lines",
)  # fmt: skip
def truncation_felt(bench: Bench) -> Finding:
    """Which subsystem's FRFs in AB suffer more from modes of B left out?"""
    trunk = bench.once(TruncationBench)
    labels = trunk.model.whole.labels
    parts = [
        [labels.index(label) for label in own]
        for own in (bench.case.internal_a, bench.case.internal_b)
    ]
    n = trunk.beyond
    bases = (Basis(n, False, None), Basis(n - 1, True, None))
    medians = [
        [float(np.median(error[:, own][:, :, own].max(axis=(1, 2)))) for own in parts]
        for error in all_errors(trunk, trunk.frequency[::4], bases)
    ]
    (all_a, all_b), (kept_a, kept_b) = medians
    return Finding(
        Verdict.of(all_a > all_b and kept_a > kept_b, all_a > all_b),
        f"all {n} modes left out: A is off by {all_a:.2g}, B by {all_b:.2g}; the hub's mode kept: "
        f"A by {kept_a:.2g}, B by {kept_b:.2g}"
        + ("" if kept_a > kept_b else ": it is the hub's mode that A feels, and B the others"),
        {"all_left_out_a": all_a, "all_left_out_b": all_b,
         "hub_kept_a": kept_a, "hub_kept_b": kept_b},
    )  # fmt: skip


@statement(
    "outside-band", "Truncation outside the band", "end of Sec. 4.4",
    "The modal truncation does not affect the substructuring method outside the frequency range.",
    f"scaled errors of all FRFs of AB from {BAND.end:g} to {WIDE.end:g} Hz, the modes beyond "
    f"{BAND.end:g} Hz left out",
)  # fmt: skip
def outside_band(bench: Bench) -> Finding:
    """Do FRFs beyond the band survive without its modes?"""
    trunk = bench.once(TruncationBench)
    n = trunk.beyond
    lines = np.arange(BAND.end + 55.0, WIDE.end, 100.0)
    bases = (Basis(n, False, None), Basis(n - 1, True, None))
    every, kept = (
        float(np.median(error.max(axis=(1, 2)))) for error in all_errors(trunk, lines, bases)
    )
    return Finding(
        Verdict.of(max(every, kept) <= bench.tolerance),
        f"median over lines: {every:.2g} with all {n} left out, {kept:.2g} with the hub's kept; "
        f"{bench.tolerance:.1%} allowed. FRFs there are made of the very modes that are left out",
        {"all_left_out": every, "hub_kept": kept},
    )


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

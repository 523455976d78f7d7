"""The paper's parameters, and what they give (Tables 1 and 2, Sec. 4.1)."""

from __future__ import annotations

import numpy as np

from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load

from ..checks.published import PUBLISHED
from ..routes import equations
from .bench import Bench
from .formulas import natural_frequencies
from .item import Finding, Verdict, statement
from .printed_values import HUB_INERTIA, PRINTED_TO_HZ, TABLE_2_BASE_RADII, TABLE_BAND_HZ
from .tables import TOLERANCE_HZ, RowVerdict, table_3

LIN_PARKER = ("lin-parker-3", "lin-parker-4", "lin-parker-5")


@statement(
    "table3-parameters", "Parameters of the planetary stage", "Sec. 4, Tables 2, 3",
    "The mechanical parameters of the studied system are given in Tables 1 and 2; Table 3 has "
    "its frequencies.",
    "the planetary rows of Table 3 with both parameter sets",
)  # fmt: skip
def table_3_parameters(bench: Bench) -> Finding:
    """Do Table 2's parameters give Table 3?"""
    table = bench.once(table_3)
    of_b = [r for r in table.rows if r.kind not in (Kind.PARALLEL_STAGE, Kind.GLOBAL)]
    hits = {
        name: sum(
            name in r.found
            and abs(r.found[name].deviation_hz) <= TOLERANCE_HZ
            and r.found[name].multiplicity == r.multiplicity
            for r in of_b
        )
        for name in bench.cases
    }
    words = ", ".join(f"{count} of {len(of_b)} rows with {name}" for name, count in hits.items())
    first, second = hits.values()
    missed = [r.printed for r in table.rows if r.verdict != RowVerdict.REPRODUCED]
    return Finding(
        Verdict.of(second >= first),
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
    """Are ref. [33]'s frequencies and multiplicities those of the model?"""
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
        Verdict.of(holds),
        f"the numbers of modes of each kind {'agree' if counted else 'differ'}, the frequencies to "
        f"{worst:.1e}",
        {"worst_relative": worst},
    )  # fmt: skip


@statement(
    "table2-radii", "Base radii", "Table 2",
    "Base radii 0.024 (sun), 0.056 (ring), 0.016 m (planet).",
    "r_r − (r_s + 2 r_p), which equal pressure angles ask to be zero",
)  # fmt: skip
def base_radii(bench: Bench) -> Finding:
    """Does Table 2 agree with itself?"""
    r = TABLE_2_BASE_RADII
    gap = r["ring"] - r["sun"] - 2.0 * r["planet"]
    return Finding(
        Verdict.of(abs(gap) <= 5e-4),
        f"r_r − (r_s + 2 r_p) = {gap * 1e3:.1f} mm, printed to 1 mm",
        {"gap_m": gap},
    )  # fmt: skip


@statement(
    "hub-unit", "Unit of the hub's inertia", "Table 1",
    f"I_A = {HUB_INERTIA:g} kg m², among inertias I/r² in kg.",
    "natural frequencies to 15 kHz with I_A in kg m² and with I_A/r² in kg",
)  # fmt: skip
def hub_unit(bench: Bench) -> Finding:
    """Does it matter which unit I_A has?"""
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
        Verdict.of(shift <= PRINTED_TO_HZ / 2.0, corrected=True),
        f"no frequency below {TABLE_BAND_HZ / 1000:.0f} kHz moves by more than {shift:.2g} Hz from "
        "one reading to the other",
        {"largest_shift_hz": shift},
    )  # fmt: skip

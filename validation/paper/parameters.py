"""The paper's parameters, and what they give (Tables 1 and 2, Sec. 4.1)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from fbs import RealModes, SecondOrderSystem
from mbs_models.modal.mode_kinds import REPEATED, Kind
from mbs_models.model.model_file import load

from ..arrays import FloatArray
from ..checks.published import PUBLISHED
from ..routes import equations
from .bench import Bench
from .figures import NARROW, Drawing
from .formulas import natural_frequencies
from .item import Finding, Verdict, statement
from .printed_values import PRINTED_TO_HZ, TABLE_1, TABLE_2, TABLE_BAND_HZ
from .resonances import kinetic_energy
from .tables import TOLERANCE_HZ, RowVerdict, table_3

LEAST_SHARE = 1e-3
"""Of a mode's kinetic energy, for a motion to be named."""

MOTIONS = {"y": "translation in y", "z": "translation in z", "rho": "rocking"}

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
    r = {gear.name: gear.base_radius for gear in TABLE_2.gears}
    gap = r["ring"] - r["sun"] - 2.0 * r["planet"]
    return Finding(
        Verdict.of(abs(gap) <= 5e-4),
        f"r_r − (r_s + 2 r_p) = {gap * 1e3:.1f} mm, printed to 1 mm",
        {"gap_m": gap},
    )  # fmt: skip


@statement(
    "hub-unit", "Unit of the hub's inertia", "Table 1",
    f"I_A = {TABLE_1.hub_inertia:g} kg m², among inertias I/r² in kg.",
    "natural frequencies to 15 kHz with I_A in kg m² and with I_A/r² in kg",
)  # fmt: skip
def hub_unit(bench: Bench) -> Finding:
    """Does it matter which unit I_A has?"""
    case = bench.case
    as_mass = case.with_hub(TABLE_1.hub_inertia)
    as_inertia = case.with_hub(TABLE_1.hub_inertia / case.coupling.radius**2)
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


@statement(
    "kahraman", "Check with Kahraman's gear pair", "Sec. 4.1, ref. [5]",
    "The eigenfrequencies of the parallel stage were compared to Kahraman's; a good accuracy was "
    "evidenced. Eight of his ten DoFs are used.",
    "the pair with the two radial DoFs across the line of action that the paper leaves out, "
    "against the pair without; published figures of ref. [5]",
)  # fmt: skip
def kahraman(bench: Bench) -> Finding:
    """What can be told of a comparison whose figures are not printed?"""
    case = bench.case
    eight = case.uncoupled.stage(case.a)
    across = [gear.support.stiffness[0][0] for gear in (case.parallel.pinion, case.parallel.wheel)]
    masses = [case.parallel.pinion.mass, case.parallel.wheel.mass]
    own = natural_frequencies(eight)
    ten = natural_frequencies(
        SecondOrderSystem(
            block_diag(eight.mass, np.diag(masses)),
            block_diag(eight.damping, np.zeros((2, 2))),
            block_diag(eight.stiffness, np.diag(across)),
            (*eight.dofs, "pinion.x", "wheel.x"),
        )
    )
    added = ", ".join(
        f"{np.sqrt(k / m) / (2.0 * np.pi):.1f}" for k, m in zip(across, masses, strict=True)
    )
    gaps = [float(np.min(np.abs(ten - f))) / max(f, 1.0) for f in own]
    listed = [r for r in bench.once(table_3).rows if r.kind == Kind.PARALLEL_STAGE]
    reproduced = sum(row.verdict == RowVerdict.REPRODUCED for row in listed)
    return Finding(
        Verdict.OPEN,
        f"the paper prints none of Kahraman's frequencies, and his are not publicly at hand: the "
        f"accuracy cannot be told. What can: a mesh force has no part across the line of action, "
        f"so that the two DoFs left out add modes of their own ({added} Hz with the bearings of y) "
        f"and leave the other frequencies as they are, to {max(gaps):.1e}; of Table 3's "
        f"{len(listed)} of this stage {reproduced} are the model's (table3)",
        {"largest_change": max(gaps)},
    )


@statement(
    "fig3-modes", "Rotation and bending modes", "Sec. 4.1, Fig. 3",
    "These peaks present the rotation and the bending modes.",
    "kinetic energy of the modes of subsystem A that the FRFs of Fig. 3 show, by kind of motion",
)  # fmt: skip
def rotation_and_bending(bench: Bench) -> Finding:
    """What moves in the modes that Fig. 3 shows?"""
    modes = bench.modes(bench.case.a)
    energy = kinetic_energy(bench.case, modes)
    shown = {
        mark.frequency_hz: None
        for dof in "yz"
        for mark in Drawing(f"A.pinion.{dof}", NARROW, "A").marks(bench)
        if mark.visible
    }
    shares = {f: _by_motion(modes, energy, f) for f in sorted(shown)}
    words = "; ".join(
        f"{f:.1f} Hz: " + ", ".join(f"{share:.0%} {name}" for name, share in own.items())
        for f, own in shares.items()
    )
    others = [f for f, own in shares.items() if own.get("rotation", 0.0) < LEAST_SHARE]
    return Finding(
        Verdict.of(not others),
        f"{words}. Shafts are rigid in the model (Sec. 2) and bend nowhere: what moves beside the "
        f"rotation are the bearings, and {len(others)} of {len(shares)} peaks turn no gear",
        {f"rotation_at_{f:.0f}_hz": own.get("rotation", 0.0) for f, own in shares.items()},
    )


def _by_motion(modes: RealModes, energy: FloatArray, frequency: float) -> dict[str, float]:
    """Shares of kinetic energy of the modes at a frequency, by motion; none below 0.1 %."""
    at = np.abs(modes.natural_frequencies - frequency) <= REPEATED * frequency
    found: dict[str, float] = {}
    for label, share in zip(modes.dofs, energy[:, at].mean(axis=1), strict=True):
        motion = MOTIONS.get(label.rpartition(".")[2], "rotation")
        found[motion] = found.get(motion, 0.0) + float(share)
    return {motion: share for motion, share in found.items() if share >= LEAST_SHARE}

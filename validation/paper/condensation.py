"""Condensation as printed (Eqs. 18–22, 28–31), held against exudyn with coordinates locked.

    H_MM − H_MS H_SS⁻¹ H_SM        (Eq. 31)

is the receptance with the slaves S blocked, u_S = 0. The reference is a model in which those same
coordinates are locked by constraints, which exudyn projects out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fbs import Frf, SecondOrderSystem, direct_frf, real_modes
from fbs.condensation import block_dofs, condense_blocked

from ..arrays import ComplexArray, FloatArray
from ..checks.check import Check
from ..checks.frfs import FRF_TOLERANCE
from ..checks.metrics import scaled_error
from ..report.digits import scientific
from ..report.page import Block, Note, Table
from . import printed
from .bench import ZERO, Bench, PaperBand, couple_points
from .case import PaperCase
from .item import Finding, Verdict, statement
from .printed_values import PROBE_HZ

BAND = PaperBand(4000.0, 10.0)
FROM_HZ = 100.0
"""Below, the free drivetrain's rigid-body motion makes H much larger than what Eq. (31) leaves of
it, and the subtraction loses the ratio of the two."""
TOLERANCE = 1e-8
TOLERANCE_REASON = (
    "round-off of either way, times its conditioning; one spring 1e-6 wrong would already show"
)

REPEATED = 1e-6
"""Natural frequencies this close (relative) are one, repeated."""

NEAR_POLE = 1e-3
"""Lines this close (relative) to a pole are left out: round-off has no bound at one."""


@dataclass(frozen=True)
class Condensation:
    """What stays (masters) when the rest of AB is condensed, and by which equation."""

    name: str
    equation: str
    masters: tuple[str, ...]


def condensations(case: PaperCase) -> tuple[Condensation, ...]:
    """The paper's condensed systems, and one with slaves of both stages."""
    a, b, hub = case.internal_a, case.internal_b, (case.hub,)
    some = tuple(
        label for label in (*a, *hub, *b) if label not in (a[0], b[0]) and ".planet1." not in label
    )
    return (
        Condensation("A, hub and B blocked", "Eqs. (21), (31)", a),
        Condensation("B, hub and A blocked", "Eqs. (22), (31)", b),
        Condensation("A and hub, B blocked", "Eq. (19)", a + hub),
        Condensation("B and hub, A blocked", "Eq. (20)", hub + b),
        Condensation("AB, pinion w, sun u and the first planet blocked", "Eq. (31)", some),
    )


@dataclass(frozen=True)
class LockedCheck:
    """A condensed system by its formula, by blocked matrices, and by exudyn with locked DoFs.

    Attributes
    ----------
    name, equation
        What is condensed, by which equation.
    locked
        How many coordinates stand still.
    frequencies_hz
        Natural frequencies of exudyn's locked model.
    frequency_error, matrix_error, formula_error
        Largest relative difference of the natural frequencies; largest scaled error of the FRFs
        of the blocked matrices, and of the printed formula, against exudyn's locked model.
    """

    name: str
    equation: str
    locked: int
    frequencies_hz: tuple[float, ...]
    frequency_error: float
    matrix_error: float
    formula_error: float

    @property
    def checks(self) -> tuple[Check, ...]:
        """Each way against exudyn's locked model."""
        return tuple(
            Check(
                "Condensed systems", "condensed systems", ("exudyn, locked", other), measure, value,
                TOLERANCE, TOLERANCE_REASON, note=self.name,
            )
            for other, measure, value in (
                ("blocked matrices", "relative difference of frequencies", self.frequency_error),
                ("blocked matrices", "scaled error", self.matrix_error),
                ("condensation formula", "scaled error", self.formula_error),
            )
        )  # fmt: skip

    @property
    def listed(self) -> str:
        """The natural frequencies in Hz, repeated ones once with their number."""
        return ", ".join(
            (f"{f:.1f}" if f < 1e5 else scientific(f)) + (f"({n})" if n > 1 else "")
            for f, n in _repeated(self.frequencies_hz)
        )


def _repeated(frequencies: Iterable[float]) -> list[tuple[float, int]]:
    """Each frequency, ascending, with how often it occurs."""
    groups: list[tuple[float, int]] = []
    for f in sorted(frequencies):
        if groups and f - groups[-1][0] <= REPEATED * f:
            groups[-1] = (groups[-1][0], groups[-1][1] + 1)
        else:
            groups.append((f, 1))
    return groups


def locked_checks(bench: Bench) -> tuple[LockedCheck, ...]:
    """Every condensed system three ways: formula, blocked matrices, exudyn's locked model."""
    return tuple(_locked_check(bench, condensed) for condensed in condensations(bench.case))


def _locked_check(bench: Bench, condensed: Condensation) -> LockedCheck:
    from mbs_models.system.drivetrain import build_drivetrain  # exudyn takes its time to load
    from mbs_models.system.locking import lock_dofs, project

    case, masters = bench.case, condensed.masters
    labels = tuple(dof.label for dof in case.dofs)
    slaves = tuple(label for label in labels if label not in masters)
    model = bench.exudyn()
    blocked = block_dofs(model.whole, slaves)
    locked = project(lock_dofs(build_drivetrain(case.drivetrain), slaves))
    names = tuple(f"z{k}" for k in range(len(locked.mass)))
    projected = SecondOrderSystem(locked.mass, locked.damping, locked.stiffness, names)
    expected = real_modes(blocked).natural_frequencies
    frequencies = real_modes(projected).natural_frequencies
    lines = _clear_lines(np.concatenate([frequencies, bench.modes().natural_frequencies]))
    rows = [locked.dofs.index(label) for label in masters]
    exact = locked.receptance(lines)[np.ix_(range(len(lines)), rows, rows)]
    by_matrix = direct_frf(blocked, lines, masters, masters).values
    by_formula = condense_blocked(couple_points(model, lines, labels), masters).values
    size = np.where(frequencies > 0.0, frequencies, 1.0)
    return LockedCheck(
        name=condensed.name,
        equation=condensed.equation,
        locked=len(slaves),
        frequencies_hz=tuple(frequencies.tolist()),
        frequency_error=float(np.max(np.abs(expected - frequencies) / size)),
        matrix_error=float(scaled_error(exact, by_matrix).max()),
        formula_error=float(scaled_error(exact, by_formula).max()),
    )


def _clear_lines(poles: FloatArray) -> FloatArray:
    """The band's lines that are not next to a pole of the whole or of the locked model."""
    lines: FloatArray = np.arange(FROM_HZ, BAND.end + BAND.step / 2.0, BAND.step)
    gap = np.abs(lines[:, None] - poles[None, :]) / lines[:, None]
    clear: FloatArray = lines[gap.min(axis=1) > NEAR_POLE]
    return clear


# --- the statements ---


@dataclass(frozen=True)
class Blocks:
    """The coupled FRFs at every DoF, full and coupled, and A with hub and B blocked."""

    coupled: Frf
    full: Frf
    locked_a: ComplexArray
    locked_b: ComplexArray


def blocks_of_ab(bench: Bench) -> Blocks:
    """What Eqs. (18)–(22) partition, on lines off every pole of the presets."""
    case, model = bench.case, bench.exudyn()
    labels = tuple(dof.label for dof in case.dofs)
    locked = (
        _stage_locked(model.stages[name], kept)
        for name, kept in ((case.a, case.internal_a), (case.b, case.internal_b))
    )
    return Blocks(
        couple_points(model, PROBE_HZ, labels).select(labels, labels),
        direct_frf(model.whole, PROBE_HZ, labels, labels),
        *(direct_frf(system, PROBE_HZ).values for system in locked),
    )


def _stage_locked(stage: SecondOrderSystem, kept: tuple[str, ...]) -> SecondOrderSystem:
    """A stage with its hub held; DoFs in the order of ``kept``."""
    blocked = block_dofs(stage, [label for label in stage.dofs if label not in kept])
    at = [blocked.dofs.index(label) for label in kept]
    m, c, k = (x[np.ix_(at, at)] for x in (blocked.mass, blocked.damping, blocked.stiffness))
    return SecondOrderSystem(m, c, k, kept)


@statement(
    "eq14", "Third row of the coupled receptance", "Eq. (14), Sec. 3.1",
    "The third row of the coupled receptance is [H_ab, H_bc, H_bb].",
    "shapes of the printed blocks, and the full system's H_ba against the transpose of its H_ab",
)  # fmt: skip
def third_row(bench: Bench) -> Finding:
    """Does H_ab fit where Eq. (14) has it?"""
    a, b = bench.case.internal_a, bench.case.internal_b
    h_ab, h_ba = (
        bench.once(blocks_of_ab).full.select(rows, columns).values
        for rows, columns in ((a, b), (b, a))
    )
    fits = h_ab.shape[1:] == (len(b), len(a))
    asymmetry = float(np.max(np.abs(h_ba - h_ab.transpose(0, 2, 1))) / np.max(np.abs(h_ba)))
    return Finding(
        Verdict.of(fits, asymmetry <= FRF_TOLERANCE),
        f"H_ab is {len(a)} × {len(b)} and the place is {len(b)} × {len(a)}: H_ba belongs there, as "
        f"Eq. (18) has it, which is H_abᵀ by reciprocity (to {asymmetry:.1e})",
        {"rows_of_h_ab": float(len(a)), "rows_of_the_place": float(len(b)),
         "asymmetry": asymmetry},
    )  # fmt: skip


@statement(
    "eq31", "Meaning of the condensed receptance", "Eqs. (18), (28)–(31), Appendix B",
    "With no force on the slaves, the condensed receptance is H_MM − H_MS H_SS⁻¹ H_SM.",
    "Eq. (31) for A in AB against exudyn with hub and B locked in the model, and against H_MM",
)  # fmt: skip
def condensed_receptance(bench: Bench) -> Finding:
    """Is Eq. (31) the receptance with no force on the slaves?"""
    locked, blocks = bench.once(locked_checks), bench.once(blocks_of_ab)
    check, a = locked[0], bench.case.internal_a
    right = float(scaled_error(blocks.full.values, blocks.coupled.values).max())
    apart = float(scaled_error(blocks.locked_a, blocks.coupled.select(a, a).values).max())
    return Finding(
        Verdict.of(apart <= FRF_TOLERANCE),
        f"Eq. (31) equals exudyn's model with the {check.locked} slave coordinates locked to "
        f"{check.formula_error:.1e} (natural frequencies {check.listed} Hz, to "
        f"{check.frequency_error:.1e}): it is u_S = 0, not f_S = 0. For f_S = 0 the receptance is "
        f"H_MM, which the coupled FRFs give to {right:.1e}; the two differ by a scaled error of up "
        f"to {apart:.2g}. The formula is right for a dynamic stiffness",
        {"formula_against_locked": check.formula_error, "frequency_error": check.frequency_error,
         "locked_against_free": apart},
        blocks=_locked_table(locked),
        details={"condensation": locked},
        checks=tuple(each for check in locked for each in check.checks),
    )  # fmt: skip


def _locked_table(checks: tuple[LockedCheck, ...]) -> tuple[Block, ...]:
    headings = (
        "System", "Formula", "Locked", "Natural frequencies of exudyn's locked model (Hz)",
        "Frequencies", "FRFs, blocked matrices", "FRFs, formula",
    )  # fmt: skip
    rows = tuple(
        (c.name, c.equation, str(c.locked), c.listed,
         *map(scientific, (c.frequency_error, c.matrix_error, c.formula_error)))
        for c in checks
    )  # fmt: skip
    return (
        Table(headings, rows, frozenset({2, 4, 5, 6})),
        Note(
            "Errors against exudyn's model in which the same coordinates are locked: of natural "
            "frequencies relative, of FRFs scaled, |ΔH_ij| / √(h_i h_j), h the norms of the rows."
        ),
    )


@statement(
    "eq19", "No FRF between the stages", "below Eq. (19), Sec. 3.3",
    "[H]_ab = 0.", "largest |H_ab|/√(h_a h_b) of the full system",
)  # fmt: skip
def between_stages(bench: Bench) -> Finding:
    """Does a force on A leave B at rest?"""
    full, n = bench.once(blocks_of_ab).full.values, len(bench.case.internal_a)
    largest = float(scaled_error(full, np.zeros_like(full))[:, :n, n + 1 :].max())
    return Finding(
        Verdict.of(largest <= ZERO),
        f"|H_ab|/√(h_a h_b) is up to {largest:.2g}: a force on A moves B through the hub. It is "
        "the dynamic stiffness that has no entry between them",
        {"largest": largest},
    )


@statement(
    "eq19-lower-left", "Lower left block of Eq. (19)", "Eq. (19), Sec. 3.3",
    "The lower left block is H_ca − H_cb H_bb⁻¹ H_bc.",
    "shapes of the printed terms; with H_ba for the last factor, against A and hub with B blocked",
)  # fmt: skip
def lower_left(bench: Bench) -> Finding:
    """Does the last factor of the lower left block fit?"""
    case, full = bench.case, bench.once(blocks_of_ab).full
    a, b, c = case.internal_a, case.internal_b, (case.hub,)
    h_cb, h_bb, h_ba = (full.select(r, k).values for r, k in ((c, b), (b, b), (b, a)))
    corrected = full.select(c, a).values - h_cb @ np.linalg.solve(h_bb, h_ba)
    exact = direct_frf(block_dofs(bench.exudyn().whole, b), PROBE_HZ, (*a, *c), (*a, *c))
    own = exact.select(c, a).values
    error = float(np.max(np.abs(corrected - own) / np.linalg.norm(own, axis=2, keepdims=True)))
    return Finding(
        Verdict.of(len(a) == len(c), error <= FRF_TOLERANCE),
        f"H_ca is {len(c)} × {len(a)}, the product printed beside it {len(c)} × {len(c)}: the two "
        f"cannot be subtracted. With H_ba for H_bc the block is that of A and hub with B blocked, "
        f"to {error:.1e}",
        {"columns_of_h_ca": float(len(a)), "columns_printed": float(len(c)), "corrected": error},
    )


@statement(
    "eq20", "Condensed hub and B", "Eq. (20), Sec. 3.3",
    "The condensed receptance of AB is that of c and b less the term with H_aa⁻¹.",
    "Eq. (20) against exudyn with the DoFs of A locked",
)  # fmt: skip
def condensed_hub_and_b(bench: Bench) -> Finding:
    """Is Eq. (20) the receptance with A blocked?"""
    check = next(c for c in bench.once(locked_checks) if "(20)" in c.equation)
    return Finding(
        Verdict.of(check.formula_error <= TOLERANCE),
        f"it is the receptance with the {check.locked} DoFs of A locked, to "
        f"{check.formula_error:.1e}: right as a formula for that (see Eq. (31) for what it means)",
        {"formula_error": check.formula_error, "frequency_error": check.frequency_error},
        checks=check.checks,
    )


@statement(
    "eq21", "Condensed subsystem A", "Eq. (21), Sec. 3.3",
    "A_H = H_aa − H_ac (H_cc − H_cb H_bb⁻¹ H_bc)⁻¹ H_ca.",
    "Eq. (21) letter by letter with the coupled FRFs, against exudyn with hub and B locked",
)  # fmt: skip
def condensed_a(bench: Bench) -> Finding:
    """Is Eq. (21) A with hub and B blocked?"""
    case, blocks = bench.case, bench.once(blocks_of_ab)
    return _letter_by_letter(
        bench, 0, blocks.locked_a, (case.internal_a, (case.hub,), case.internal_b), "hub and B"
    )


@statement(
    "eq22", "Condensed subsystem B", "Eq. (22), Sec. 3.3",
    "B_H = H_bb − H_bc (H_cc − H_ca H_aa⁻¹ H_ac)⁻¹ H_cb.",
    "Eq. (22) letter by letter with the coupled FRFs, against exudyn with hub and A locked",
)  # fmt: skip
def condensed_b(bench: Bench) -> Finding:
    """Is Eq. (22) B with hub and A blocked?"""
    case, blocks = bench.case, bench.once(blocks_of_ab)
    return _letter_by_letter(
        bench, 1, blocks.locked_b, (case.internal_b, (case.hub,), case.internal_a), "hub and A"
    )


def _letter_by_letter(
    bench: Bench,
    number: int,
    locked: ComplexArray,
    parts: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]],
    held: str,
) -> Finding:
    """Eq. (21) or (22) as printed, with (masters, hub, other stage)."""
    check = bench.once(locked_checks)[number]
    own = printed.condensed(bench.once(blocks_of_ab).coupled, *parts)
    error = scaled_error(locked, own).max(axis=(1, 2))
    worst = int(np.argmax(error))
    return Finding(
        Verdict.of(float(error[worst]) <= FRF_TOLERANCE, check.formula_error <= TOLERANCE),
        f"it is Eq. (31) less the terms with H_ab: {np.median(error):.1e} (median) but up to "
        f"{error[worst]:.2g} (at {PROBE_HZ[worst]:.0f} Hz) from the system with {held} locked, at "
        f"{check.listed} Hz; by Eq. (31) with both as slaves it is that to "
        f"{check.formula_error:.1e}",
        {"median": float(np.median(error)), "worst": float(error[worst])},
        checks=check.checks,
    )

"""Condensation as printed (Eqs. 19–22, 30, 31), and exudyn as its witness.

    H_MM − H_MS H_SS⁻¹ H_SM        (Eq. 31)

is the receptance with the slaves S blocked, u_S = 0. The witness is a model in which those same
coordinates are locked by constraints, which exudyn projects out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fbs import SecondOrderSystem, direct_frf, real_modes
from fbs.condensation import block_dofs, condense_blocked
from mbs_models.model.parameters import Drivetrain

from ..checks.metrics import scaled_error
from .curves import FrfBench, PaperBand, couple_points
from .model import PaperCase
from .results import ComplexArray, FloatArray, LockedCheck

BAND = PaperBand(4000.0, 10.0)
FROM_HZ = 100.0
"""Below, the free drivetrain's rigid-body motion makes H much larger than what Eq. (31) leaves of
it, and the subtraction loses the ratio of the two."""
TOLERANCE = 1e-8
"""Round-off of either way, times its conditioning; one spring 1e-6 wrong would already show."""

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


def locked_checks(bench: FrfBench) -> tuple[LockedCheck, ...]:
    """Every condensed system three ways: formula, blocked matrices, exudyn's locked model."""
    return tuple(locked_check(bench, condensed) for condensed in condensations(bench.case))


def locked_check(bench: FrfBench, condensed: Condensation) -> LockedCheck:
    """One condensed system three ways."""
    case, masters = bench.case, condensed.masters
    labels = tuple(dof.label for dof in case.dofs)
    slaves = tuple(label for label in labels if label not in masters)
    model = bench.systems.exudyn()
    blocked = block_dofs(model.whole, slaves)
    witness = ExudynLocked.of(case.drivetrain, slaves)
    expected = real_modes(blocked).natural_frequencies
    frequencies = real_modes(witness.projected).natural_frequencies
    lines = _clear_lines(np.concatenate([frequencies, bench.systems.modes().natural_frequencies]))
    exact = witness.receptance(lines, masters)
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
        tolerance=TOLERANCE,
    )


def _clear_lines(poles: FloatArray) -> FloatArray:
    """The band's lines that are not next to a pole of the whole or of the locked model."""
    lines: FloatArray = np.arange(FROM_HZ, BAND.end + BAND.step / 2.0, BAND.step)
    gap = np.abs(lines[:, None] - poles[None, :]) / lines[:, None]
    clear: FloatArray = lines[gap.min(axis=1) > NEAR_POLE]
    return clear


@dataclass(frozen=True)
class ExudynLocked:
    """exudyn's model with coordinates locked: its projected matrices, and labels read off them."""

    projected: SecondOrderSystem
    shapes: FloatArray
    dofs: tuple[str, ...]

    @classmethod
    def of(cls, drivetrain: Drivetrain, slaves: tuple[str, ...]) -> ExudynLocked:
        """Build the whole drivetrain, lock DoFs in the model, let exudyn project them out."""
        from mbs_models.system.drivetrain import build_drivetrain  # exudyn takes its time to load
        from mbs_models.system.locking import lock_dofs, project

        found = project(lock_dofs(build_drivetrain(drivetrain), slaves))
        names = tuple(f"z{k}" for k in range(len(found.mass)))
        projected = SecondOrderSystem(found.mass, found.damping, found.stiffness, names)
        return cls(projected, found.shapes, found.dofs)

    def receptance(self, frequency: FloatArray, labels: tuple[str, ...]) -> ComplexArray:
        """H = S (K − ω²M + jωC)⁻¹ Sᵀ between labels, (n_frequency, n, n) m/N."""
        rows = self.shapes[[self.dofs.index(label) for label in labels]]
        return np.asarray(rows @ direct_frf(self.projected, frequency).values @ rows.T)

"""Modes of the equations route: fbs solves, the energy shares name the kinds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fbs import RealModes, SecondOrderSystem, poles, real_modes
from fbs.damped_modes import is_proportional, modal_damping
from mbs_models.mode_kinds import (
    Mode,
    Modes,
    StageStiffness,
    classify,
    frequency_and_ratio,
    match_poles,
    undamped_estimate,
)
from mbs_models.parameters import Drivetrain

from . import equations

FloatArray = NDArray[np.float64]


def equation_modes(drivetrain: Drivetrain) -> Modes:
    """Natural frequencies, damping ratios and kinds of modes from the paper's matrices."""
    system = equations.drivetrain_system(drivetrain)
    modes = real_modes(system)
    bare = drivetrain.model_copy(update={"couplings": ()})
    stiffness = {}
    for part in bare.parts:
        alone = equations.stage_system(bare, part.name)
        stiffness[part.name] = StageStiffness(alone.dofs, alone.stiffness)
    positions, factors = system.locate()
    kinds, shapes = classify(
        drivetrain,
        system.labels,
        modes.natural_frequencies,
        factors[:, None] * modes.shapes[positions],
        modes.n_rigid,
        stiffness,
    )
    frequencies, ratios = damped_modes(system, modes)
    # Each ω is good to a few eps of the scaled stiffness' condition, far below what is printed.
    relative = len(system.dofs) * np.finfo(float).eps
    listed = tuple(
        Mode(float(f), float(z), kind, shares, float(relative * f))
        for f, z, (kind, shares) in zip(frequencies, ratios, kinds, strict=True)
    )
    return Modes(listed, system.labels, shapes)


def damped_modes(system: SecondOrderSystem, modes: RealModes) -> tuple[FloatArray, FloatArray]:
    """Natural frequency |s|/2π (Hz) and damping ratio −Re s/|s| of each real mode's poles.

    Proportional damping: s from ω_r and γ_r = φᵀCφ; else from the complex modes.
    """
    damping = modal_damping(modes, system.damping)
    expected = undamped_estimate(modes.angular_frequency**2, np.diag(damping))
    if not is_proportional(damping):
        upper = poles(system).values
        found = np.concatenate([upper, upper[upper.imag > 0].conj()])
        n = modes.n_rigid
        expected = np.concatenate([expected[:n], match_poles(found, expected[n:])])
    return frequency_and_ratio(expected, modes.n_rigid)

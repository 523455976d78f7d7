"""Modes of a source's matrices: fbs solves, the energy shares name the kinds."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fbs import RealModes, SecondOrderSystem, poles, real_modes
from fbs.damped_modes import is_proportional, modal_damping
from mbs_models.modal.mode_kinds import (
    Kind,
    Mode,
    Modes,
    StageStiffness,
    classify,
    frequency_and_ratio,
    match_poles,
    undamped_estimate,
)
from mbs_models.model.parameters import Drivetrain

from ..arrays import FloatArray

PRINTED = 0.005  # Hz: half of the last digit that frequencies are printed to
LISTED = 3  # modes a warning names
ADVICE = (
    "an inertia that is next to nothing makes that one: leave it out (a hub: inertia 0, one end "
    '"rigid"), or take the frequencies of the equations (crosscheck modes --route equations)'
)


def matrix_modes(
    drivetrain: Drivetrain, system: SecondOrderSystem, alone: Mapping[str, SecondOrderSystem]
) -> Modes:
    """Natural frequencies, damping ratios and kinds of modes from matrices.

    Parameters
    ----------
    drivetrain
        Whose they are.
    system
        The whole's.
    alone
        Each part's, its couplings taken off: they tell where a mode's strain energy is.
    """
    modes = real_modes(system)
    stiffness = {name: StageStiffness(own.dofs, own.stiffness) for name, own in alone.items()}
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


def round_off_warnings(found: Modes) -> tuple[str, ...]:
    """Which elastic modes the eigensolver's round-off leaves unknown to the digits printed."""
    unknown = [
        (number, mode)
        for number, mode in enumerate(found.modes, start=1)
        if mode.kind != Kind.RIGID_BODY and mode.round_off_hz > PRINTED
    ]
    if not unknown:
        return ()
    listed = []
    for number, mode in unknown:
        frequency, error = known_to(mode)
        listed.append(f"mode {number}: {frequency}{f' ± {error}' if error else ''} Hz")
    more = f" and {len(listed) - LISTED} more" if len(listed) > LISTED else ""
    return (
        f"exudyn's eigensolution knows its frequencies to the round-off of the largest, "
        f"{found.modes[-1].frequency_hz:.3g} Hz: {', '.join(listed[:LISTED])}{more}; {ADVICE}",
    )


def known_to(mode: Mode) -> tuple[str, str]:
    """A frequency in the digits that are known, at most a hundredth of a Hz, and its error (Hz).

    Where nothing but its size is known: what it is below, and no error.
    """
    f, error = mode.frequency_hz, mode.round_off_hz
    if mode.kind == Kind.RIGID_BODY or error <= PRINTED:
        return f"{f:.2f}", ""
    if error >= f:
        step = 10.0 ** (math.floor(math.log10(f + error)) - 1)
        return f"< {math.ceil((f + error) / step) * step:.0f}", ""
    digits = min(2, -math.floor(math.log10(error)))
    return f"{round(f, digits):.{max(digits, 0)}f}", f"{float(f'{error:.2g}'):g}"


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

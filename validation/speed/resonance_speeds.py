"""SteadyStates that a coarse range would step over: where a harmonic of a mesh meets a mode.

A resonance is as wide as its damping, ζ of its speed to either side. Where that is less than the
step of the speeds asked for, its peak would be missed or cut; speeds are added there.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from mbs_models.gears.orders import orders
from mbs_models.gears.resonances import crossings
from mbs_models.modal.mode_kinds import Modes

from ..arrays import FloatArray
from .turning import Turning

# Around the middle, in half widths: a peak so sampled is cut by (0.25)²/2 = 3 % at most.
AROUND = (-3.0, -1.5, -0.5, 0.0, 0.5, 1.5, 3.0)
MOST = 300  # speeds added; resonances with more of their energy in the meshes come first
COARSE = 0.5  # steps: what is wider than that, the range shows


def resonance_speeds(turning: Turning, modes: Modes) -> FloatArray:
    """SteadyStates (rpm) to add to those of a plan, ascending; none to a list of single speeds."""
    plan = turning.plan
    if not plan.is_range:
        return np.zeros(0)
    step = float(np.diff(plan.speeds).max())
    first, last = float(plan.speeds[0]), float(plan.speeds[-1])
    loaded = loaded_frequencies(turning)
    known = [order for order in orders(plan.drivetrain, turning.parts) if order.rows]
    added: list[float] = []
    for crossing in crossings(known, modes, turning.parts, (first, last)):
        mode = modes.modes[crossing.mode]
        middle = crossing.speed_rpm * loaded[crossing.mode] / mode.frequency_hz
        half_width = mode.damping_ratio * middle
        if crossing.telling and half_width < COARSE * step and len(added) < MOST:
            added += [middle + half_width * place for place in AROUND]
    inside = np.unique([speed for speed in added if first < speed < last])
    return np.setdiff1d(inside, plan.speeds)


def loaded_frequencies(turning: Turning) -> FloatArray:
    """Natural frequencies (Hz) under the torque, as many as the modes and in their order."""
    system = turning.periodic.system
    squares = eigh(system.stiffness, system.mass, eigvals_only=True)
    frequencies: FloatArray = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    return frequencies

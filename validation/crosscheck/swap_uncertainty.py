"""What a swap changes, beside what the measurement of its parts can tell, in words."""

from __future__ import annotations

import numpy as np

from mbs_models.model.parameters import Drivetrain

from ..routes.part_uncertainty import Known, Noise, how_well_known
from ..routes.routes import EQUATIONS, build_model
from .results import CurveChange, Swap
from .swap import in_words

FIRST_ORDER = 6.0  # dB at 95 %: σ = 0.35 of H, whose second order is a sixth of the first


def swap_words(drivetrain: Drivetrain, swap: Swap, noise: Noise | None) -> list[str]:
    """What the swap changes, and how well that is known, line by line.

    Parameters
    ----------
    drivetrain
        Whose other parts are the model's.
    swap
        What was compared.
    noise
        Stated noise of the files' FRFs (None: the scatter of their runs, if there are several).
    """
    pairs = [(curve.response, curve.excitation) for curve in swap.curves]
    model = build_model(EQUATIONS, drivetrain)
    known = how_well_known(model, swap.replacements, pairs, noise)
    frequency = swap.replacements[0].frf.frequency
    found = [
        f"  {curve.name}: {_telling(curve, known[pair], frequency)}"
        for curve, pair in zip(swap.curves, pairs, strict=True)
        if pair in known
    ]
    return [*in_words(swap), *found]


def _telling(curve: CurveChange, known: Known, frequency: np.ndarray) -> str:
    """The band at the largest change, whether that is beyond it, and where the error comes from."""
    part, response, excitation = known.main
    origin = f"{known.share:.0%} of it by {part}'s {response} ← {excitation}"
    comparable = np.isfinite(curve.decibel) & np.isfinite(known.level)
    if not comparable.any() or not np.isfinite(curve.largest_db):
        return f"known to ±{np.median(known.level):.2g} dB (95 %) typically, {origin}"
    at = int(np.argmin(np.abs(frequency - curve.at_hz)))
    beyond = int((np.abs(curve.decibel[comparable]) > known.level[comparable]).sum())
    level = known.level[at]
    if level > FIRST_ORDER:
        return (
            f"hardly known at {curve.at_hz:.6g} Hz: errors reach more than ±{FIRST_ORDER:g} dB "
            f"(95 %) there, beyond what first order tells, {origin}; its change is beyond them at "
            f"{beyond} of {int(comparable.sum())} lines"
        )
    verdict = (
        "the change there is beyond that"
        if abs(curve.largest_db) > level
        else "the change there is within that: it cannot be told from none"
    )
    return (
        f"known to ±{level:.2g} dB (95 %) at {curve.at_hz:.6g} Hz, {origin}; {verdict}; "
        f"beyond it at {beyond} of {int(comparable.sum())} lines"
    )

"""Accelerations that alternate from step to step: the trapezoidal rule's, not the drivetrain's.

The rule multiplies a mode by (1 + hs/2)/(1 − hs/2) in a step, which goes to −1 where h|s| is large:
what a jump of the force on a near-massless hub leaves in its mode far above the band changes its
sign at every step and hardly dies out. Displacement and velocity show none of it, an acceleration
may show nothing else. Runs start without it (`start_acceleration`); what comes later is told here.
"""

from __future__ import annotations

import numpy as np

from mbs_models.integration.transient_record import TransientRecord

LOOKED_AT = 1 << 16  # samples at the end of a record
# RMS of (a_k+1 − a_k)/2 over that of a: 1 for what alternates, sin(πf/fs) for a sine.
ALTERNATES = 0.9
ROUNDINGS = 100.0  # in a step of a body's equation


def ringing(record: TransientRecord) -> tuple[str, ...]:
    """Labels whose acceleration alternates with the steps."""
    if record.acceleration is None or record.n_samples < 3:
        return ()
    end = np.asarray(record.acceleration[-LOOKED_AT:])
    size = end.std(axis=0)
    steps = np.diff(end, axis=0).std(axis=0) / 2.0
    rings = (size > _round_off(record)) & (steps > ALTERNATES * size)
    return tuple(np.array(record.labels)[rings].tolist())


def _round_off(record: TransientRecord) -> float:
    """ε x/h² of the largest displacement x: accelerations of a drivetrain that hardly moves."""
    if record.displacement is None:
        return 0.0
    largest = float(np.abs(np.asarray(record.displacement[-LOOKED_AT:])).max())
    return ROUNDINGS * float(np.finfo(float).eps) * largest / record.integrator.step**2


def ringing_warning(labels: tuple[str, ...]) -> tuple[str, ...]:
    """What to know of such accelerations; nothing where there are none."""
    if not labels:
        return ()
    return (
        f"acceleration of {', '.join(labels)}: alternates from step to step, which is the "
        "trapezoidal rule's doing in a mode far above the band and no motion; take displacement "
        "or velocity there (the figures of accelerations leave it out)",
    )

"""Accelerations that alternate with the integrator's steps are named, others are not."""

from __future__ import annotations

import numpy as np

from mbs_models.integration.integrators import TRAPEZOIDAL, Integrator
from mbs_models.integration.transient_record import TransientRecord
from validation.simulation.ringing import ringing, ringing_warning


def record(**accelerations: np.ndarray) -> TransientRecord:
    columns = np.stack(list(accelerations.values()), axis=1)
    return TransientRecord(
        sampling_frequency=1e4,
        start=0.0,
        labels=tuple(accelerations),
        excitations=(),
        forces=np.zeros((len(columns), 0)),
        integrator=Integrator(TRAPEZOIDAL, 1e-4, ""),
        acceleration=columns,
    )


def test_what_alternates_is_named() -> None:
    """A sine at a quarter of the sampling frequency changes by sin(π/4) of 2 only."""
    k = np.arange(4000)
    found = record(
        hub=1e3 * (-1.0) ** k + np.sin(0.1 * k), gear=np.sin(np.pi / 2.0 * k), still=0.0 * k
    )
    assert ringing(found) == ("hub",)
    assert "acceleration of hub: alternates" in ringing_warning(("hub",))[0]
    assert ringing_warning(()) == ()

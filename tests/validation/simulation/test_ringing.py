"""Accelerations that alternate with the integrator's steps are named, others are not."""

from __future__ import annotations

import numpy as np

from mbs_models.integration.integrators import TRAPEZOIDAL, Integrator
from mbs_models.integration.transient_record import TransientRecord
from mbs_models.model.excitation import Excitation
from mbs_models.signals.lines import BandNoise
from tests.geared import geared_reducer
from tests.strategies import paper
from validation.simulation.options import Options
from validation.simulation.result import SimulationResult
from validation.simulation.ringing import ringing, ringing_warning
from validation.simulation.run import run_simulation


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


def rms(simulation: SimulationResult, label: str) -> float:
    record = simulation.record
    assert record.acceleration is not None
    measured = record.acceleration[round(simulation.run_in * record.sampling_frequency) :]
    return float(measured[:, record.labels.index(label)].std())


def test_at_speed_a_hub_shakes_like_the_wheel_it_sits_on() -> None:
    """1e8 N/m hold it to the wheel, 1e5 N/m to the sun, and the sun shakes less: to 1e-3."""
    found = run_simulation(geared_reducer(), Options(speed_rpm=2000.0, torque=20.0, duration=0.05))
    assert ringing(found.record) == ()
    assert not any("alternates" in warning for warning in found.warnings)
    assert rms(found, "planetary.sun.w") < rms(found, "reducer.wheel.w")
    ratio = rms(found, "coupling.w") / rms(found, "reducer.wheel.w")
    assert abs(ratio - 1.0) < 2e-3  # both differ by 1e5/(1e8 + 1e5) of theirs


def test_noise_on_a_hub_of_45_micrograms_makes_it_alternate() -> None:
    """It jumps there at t = 0, by F/m = 1e7 m/s² for each N: 3e-5 of that is left of the start."""
    noise = BandNoise(10.0, 4000.0, 1.0, 1.0, 1)
    force = Excitation("coupling.w", noise)
    found = run_simulation(paper(), Options(excitations=(force,), duration=0.05, reverse=False))
    assert ringing(found.record) == ("coupling.w",)
    assert any("coupling.w: alternates" in warning for warning in found.warnings)

"""The report's sections: peak-hold of sweeps, and records of any length."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.lines import Signal
from mbs_models.signals.sines import HalfSine, SteppedSine, Sweep, stepped_sine
from validation.report.frf_panel import FrfPanel
from validation.simulation import sections as report
from validation.simulation.options import Options
from validation.simulation.result import SimulationResult
from validation.simulation.run import run_simulation

W = "planetary.sun.w"
STEPS = (1400.0, 1450.0, 1500.0, 1550.0, 1600.0, 1650.0, 1700.0)


@functools.cache
def ran(signal: Signal, duration: float | None = None) -> SimulationResult:
    options = Options(excitations=(Excitation(W, signal),), duration=duration, reverse=False)
    return run_simulation(load("lin-parker-4"), options)


def held(simulation: SimulationResult) -> FrfPanel:
    """The peak-hold figure's data."""
    assert "Peak-hold of the sweep" in [section.title for section in report.sections(simulation)]
    panel = report.swept_panel(simulation)
    assert panel is not None
    return panel


@pytest.mark.parametrize("down", [False, True])
def test_a_sweep_holds_its_peaks_where_theory_puts_them(
    down: bool,
) -> None:
    """2.6 kHz/s over the 1537 Hz mode, 0.75 % damped: lower by 2 dB, 20 Hz late.

    The free drivetrain drifts away under a sweep (its force has momentum): displacement would hold
    the drift. 0.5 dB: the theory is of one mode alone, its neighbours add a few per cent; half a
    band of frequencies is 1 %.
    """
    signal = Sweep(400.0, 3000.0, 1.0, 0.01, down=down)
    panel = held(ran(signal))
    driving, hold, theory = panel.curves
    frequency, steady = panel.frequency, np.abs(driving.values)
    at, size, places, heights = hold.frequency, hold.values, theory.frequency, theory.values
    assert at is not None
    assert places is not None
    for number, (first, last) in enumerate(((1450.0, 1700.0), (1900.0, 2100.0))):
        near = (at > first) & (at < last)
        peak = size[near].argmax()
        assert 20.0 * np.log10(size[near][peak] / heights[number]) == pytest.approx(0.0, abs=0.5)
        assert at[near][peak] == pytest.approx(places[number], rel=0.015)
        inside = (frequency > first) & (frequency < last)
        late = frequency[inside][steady[inside].argmax()]
        assert (places[number] < late) == down
    # Where no mode rings, the held value is |H| itself.
    between = (at > 700.0) & (at < 1000.0)
    if not down:  # downwards, modes above ring on at their own frequencies
        expected = np.interp(at[between], frequency, steady)
        assert 20.0 * np.log10(size[between] / expected) == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize(
    "signal",
    [
        Sweep(10.0, 3000.0, 0.05, 0.01),  # passes less than a sample in the first bands
        stepped_sine(STEPS, 0.01, periods=20.0),
    ],
    ids=["fast", "stepped"],
)
def test_every_band_of_a_peak_hold_is_passed(
    signal: Sweep | SteppedSine,
) -> None:
    _, hold, *theory = held(ran(signal)).curves
    at = hold.frequency
    assert at is not None
    assert (np.diff(at) > 0.0).all()
    assert np.isfinite(hold.values).all()
    if not isinstance(signal, Sweep):
        assert at == pytest.approx(STEPS)
        assert not theory


def test_a_record_shorter_than_a_spectrogram_line_is_reported() -> None:
    simulation = ran(HalfSine(1.0, 2.5e-4), duration=1e-3)
    assert simulation.estimated == ()  # it has not died away
    assert [section.title for section in report.sections(simulation)] == ["Motion"]


def test_a_long_spectrogram_says_what_it_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "LONGEST_MAP", 20_000)
    simulation = ran(Sweep(400.0, 3000.0, 1.0, 0.01))
    *_, motion = report.sections(simulation)
    shown = 20_000 / simulation.record.sampling_frequency
    assert f"The spectrogram is of the first {shown:.3g} s." in motion.paragraphs

"""FRFs against drive level: where linearity ends, and motions that diverge."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mbs_models.model.excitation import Excitation
from mbs_models.model.model_file import load
from mbs_models.signals.lines import schroeder_multisine
from validation.report.publish import publish
from validation.simulation.drive_level import DriveLevels, Level
from validation.simulation.options import Options
from validation.simulation.result import SimulationResult
from validation.simulation.run import run_simulation

SIGNAL = schroeder_multisine(50.0, 2000.0, 50.0, 0.1)
SAMPLES = 726  # a period at 36.3 kHz
MULTISINE = Excitation("planetary.sun.w", SIGNAL)


def ran(*levels: float, reverse: bool = False) -> SimulationResult:
    options = Options(excitations=(MULTISINE,), levels=levels, reverse=reverse)
    return run_simulation(load("lin-parker-4"), options)


def test_what_geometry_adds_grows_with_the_force() -> None:
    """Motions of second order in the force are, against the first, 20 dB a decade.

    One run at each level, not reversed: measured 0.0184, 0.186, 2.07 dB at 0.1, 1 and 10 N a line.
    """
    found = ran(100.0, 1.0, 10.0)
    assert found.levels is not None
    levels = found.levels.levels
    assert [level.factor for level in levels] == [1.0, 10.0, 100.0]  # by rising level
    low, middle, high = (level.worst_db for level in levels)
    # A third order, of the share itself: 1 % at 0.19 dB, and 20 log10(1 + x) bends by x/2 = 12 %.
    assert middle / low == pytest.approx(10.0, rel=0.03)
    assert high / middle == pytest.approx(10.0, rel=0.15)
    assert found.levels.linear_up_to is levels[0]
    assert levels[0].peak_force == np.abs(SIGNAL.samples(SAMPLES)).max()
    assert levels[2].peak_force == pytest.approx(100.0 * levels[0].peak_force, rel=1e-12)
    force = f"{levels[0].peak_force:.3g} N (peak) at planetary.sun.w"
    assert f"FBS applies up to {force}" in found.levels.conclusion
    assert "FBS no longer applies" in found.levels.conclusion


def test_half_the_difference_of_both_directions_is_of_third_order() -> None:
    """What the even orders add is gone: 40 dB a decade, and 1e-5 dB where they were 0.02 dB.

    Measured 1.6e-4 and 0.0164 dB at 1 and 10 N a line: carriers turn, lines of action tilt.
    """
    found = ran(100.0, 10.0, reverse=True)
    assert found.levels is not None
    middle, high = (level.worst_db for level in found.levels.levels)
    assert high / middle == pytest.approx(100.0, rel=0.05)
    assert high < 0.02


def test_a_level_that_diverges_is_told_and_drawn(tmp_path: Path) -> None:
    found = ran(1.0, 1e13)
    assert found.levels is not None
    beyond = found.levels.levels[1]
    assert beyond.estimated is None
    assert beyond.worst_db == np.inf
    assert "off by any amount (the motion diverged)" in found.levels.conclusion
    publish(found, tmp_path)
    assert '"worst_db":null' in (tmp_path / "simulation.json").read_text(encoding="utf-8")


def test_all_levels_may_diverge(tmp_path: Path) -> None:
    """There is no FRF to draw then, and the report says why."""
    found = ran(1e13)
    assert found.levels is not None
    assert found.levels.linear == ()
    publish(found, tmp_path)
    html = (tmp_path / "simulation.html").read_text(encoding="utf-8")
    assert "Already at the lowest level" in html
    assert "the motion diverged" in html


def test_a_motion_that_drowns_in_round_off_does_not_hide_the_linear_range() -> None:
    found = ran(0.1, 1.0)
    assert found.levels is not None
    good = found.levels.levels
    # A level whose motion does not repeat agrees with nothing, whatever its FRF.
    drowned = replace(good[0], factor=1e-9, peak_force=1e-9, period_change=1.0)
    levels = DriveLevels(MULTISINE, (drowned, *good))
    assert levels.linear == good
    assert levels.conclusion.startswith(f"From {good[0].peak_force:.3g} to ")
    diverged = Level(100.0, 5.0, 1.0, None, np.inf)
    assert DriveLevels(MULTISINE, (drowned, *good, diverged)).linear_up_to is good[-1]

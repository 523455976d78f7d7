"""Gunter & Chen 2001, Introduction to Dynamics of Rotor-Bearing Systems, Example 8.1.

A marine steam-turbine drive: 177.7, 220.2 and 1282.6 cpm, printed to 0.1 cpm. The source's gears
are rigid; the preset's springs of 3e13 N/m lower them by less than 0.02 cpm.
"""

import pytest

from mbs_models.modal.mode_kinds import Kind
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import load
from validation.routes.source import equations_source


@pytest.mark.parametrize(
    "solve",
    [drivetrain_modes, lambda drivetrain: equations_source(drivetrain).modes],
    ids=["exudyn", "equations"],
)
def test_torsional_frequencies(solve: object) -> None:
    assert callable(solve)
    modes = solve(load("geared-torsional")).modes
    assert [mode.kind for mode in modes].count(Kind.RIGID_BODY) == 1
    cpm = [60.0 * mode.frequency_hz for mode in modes[1:4]]
    assert cpm == pytest.approx([177.7, 220.2, 1282.6], abs=0.05 + 0.02)

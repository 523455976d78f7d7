"""What a difference of FRFs is traced to, and what it is not."""

from __future__ import annotations

import numpy as np
import pytest

from fbs import SecondOrderSystem, direct_frf
from validation.checks.diagnosis import locate

LABELS = ("gear", "shaft", "encoder")
LINES = np.linspace(50.0, 4000.0, 24)


def system(stiff: float, bearing: float) -> SecondOrderSystem:
    """A gear on a bearing, a shaft on the gear, and an encoder of 0.4 mg on the shaft."""
    k = 1e8
    stiffness = np.array(
        [[bearing + k, -k, 0.0], [-k, k + stiff, -stiff], [0.0, -stiff, stiff]]
    )  # fmt: skip
    mass = np.diag([3.0, 1.2, 4e-7])
    return SecondOrderSystem(mass, 1e-6 * stiffness, stiffness, LABELS)


@pytest.mark.parametrize("stiff", [1e9, 1e11, 1e13, 1e15])
@pytest.mark.parametrize("factor", [1.01, 1.0 + 1e-6])
def test_what_differs_is_found_and_no_mass_where_there_are_no_digits(
    stiff: float, factor: float
) -> None:
    """The encoder moves with the shaft to K_gear/K_stiff; its own mass shows by eps of that."""
    bearing = 5e8
    ours, theirs = (
        direct_frf(system(stiff, value), LINES) for value in (bearing, factor * bearing)
    )
    found = locate(LINES, ours.values, theirs.values, ours.round_off + theirs.round_off, LABELS)
    assert [(entry.matrix, entry.row, entry.column) for entry in found][:1] == [
        ("stiffness", "gear", "gear")
    ]
    assert {(entry.row, entry.column) for entry in found} == {("gear", "gear")}
    assert found[0].other - found[0].reference == pytest.approx((factor - 1.0) * bearing, rel=1e-3)

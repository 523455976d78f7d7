"""Verdicts on poles: what a frequency, a damping ratio and a shape may be off by."""

from __future__ import annotations

import pytest

from validation.checks.pole_checks import PoleRow, _pole_checks_of

OURS, THEIRS = "exudyn", "equations"


def row(
    frequency: float = 1.0, damping: float = 0.02, ratio: float = 1.0, mac: float = 1.0
) -> PoleRow:
    """A pole at 100 Hz: theirs times ``frequency``, its damping ratio times ``ratio``."""
    return PoleRow(
        "rotational",
        {OURS: 100.0, THEIRS: 100.0 * frequency},
        {OURS: damping, THEIRS: damping * ratio},
        {THEIRS: mac},
        1e-9,
    )


def values(*rows: PoleRow) -> dict[str, float]:
    checks = _pole_checks_of(OURS, THEIRS, rows, [1e-6] * len(rows))
    return {check.name: check.value for check in checks}


def test_frequencies_are_held_to_1e_6() -> None:
    assert values(row(frequency=1.0 + 3e-6))["Natural frequencies"] == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize(
    ("damping", "ratio", "expected"),
    [
        (0.02, 1.0 + 1e-4, 2.0),  # 2e-6 of critical damping
        (0.02, 1.0 + 1e-5, 0.2),
        (4.0, 1.0 + 3e-6, 3.0),  # beyond critical: of ζ itself, not 12
        (1.0, 1.0 + 3e-6, 3.0),
    ],
)
def test_damping_is_held_to_1e_6_of_critical_or_of_itself(
    damping: float, ratio: float, expected: float
) -> None:
    found = values(row(damping=damping, ratio=ratio))["Damping ratios"]
    assert found == pytest.approx(expected, rel=1e-4)


def test_shapes_are_held_by_what_mac_lacks_of_one() -> None:
    assert values(row(mac=1.0))["Mode shapes"] == 0.0
    assert values(row(mac=1.0 - 5e-6))["Mode shapes"] == pytest.approx(5.0, rel=1e-6)
    assert values(row(mac=1.0), row(mac=0.0))["Mode shapes"] == pytest.approx(1e6)

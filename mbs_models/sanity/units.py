"""Lengths in mm, angles in radians."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..model.parameters import Coupling, Part
from ..stages.bodies import Table
from ..stages.mesh_tables import TransmissionError
from .finding import Finding

# Radii (m): instrument gears of 1 mm in diameter to girth gears of 16 m. In mm everything from a
# radius of 10 mm on is above.
SMALLEST_RADIUS, LARGEST_RADIUS = 5e-4, 10.0
# Backlash (m): a twentieth of a module as a rule, 5 mm is a girth gear's. Errors: tenths of a mm
# are a damaged gear's. In mm hundredths of each are above.
LARGEST_GAP, LARGEST_ERROR = 5e-3, 5e-4
# Degrees. Standard are 14.5 to 25, working ones of profile-shifted gears 12 to 30. All of them are
# below 1 in radians.
SMALLEST_PRESSURE_ANGLE, LARGEST_PRESSURE_ANGLE = 10.0, 40.0
# Degrees: less than 1 is no helix that is made (standard are 8 to 35), 20° is 0.35 rad.
SMALLEST_HELIX_ANGLE = 1.0


def lengths_in_metres(part: Part | Coupling) -> Iterator[Finding]:
    """Radii that no gear has in m, and most have in mm."""
    for key, value in _numbers(part, "radius"):
        if not SMALLEST_RADIUS <= value <= LARGEST_RADIUS:
            reason = f"expected {SMALLEST_RADIUS:g} to {LARGEST_RADIUS:g} m"
            if SMALLEST_RADIUS <= value / 1000.0 <= LARGEST_RADIUS:
                reason += f"; {value:g} mm are {value / 1000.0:g} m"
            yield Finding(part.name, key, f"{value:g} m", reason)


def gaps_and_errors_in_metres(part: Part) -> Iterator[Finding]:
    """Backlash and transmission errors that no gear has in m, and most have in mm or µm."""
    errors = (
        (f"{key}.harmonics", max((amplitude for amplitude, _ in value.harmonics), key=abs))
        for key, value in _given(part)
        if isinstance(value, TransmissionError)
    )
    for found, largest in ((_numbers(part, "backlash"), LARGEST_GAP), (errors, LARGEST_ERROR)):
        for key, value in found:
            if abs(value) > largest:
                reason = f"expected at most {largest:g} m; is it in mm or µm?"
                yield Finding(part.name, key, f"{value:g} m", reason)


def pressure_angles_in_degrees(part: Part) -> Iterator[Finding]:
    """Pressure angles that no gear has in degrees."""
    for key, value in _numbers(part, "pressure_angle"):
        if not SMALLEST_PRESSURE_ANGLE <= value <= LARGEST_PRESSURE_ANGLE:
            expected = f"expected {SMALLEST_PRESSURE_ANGLE:g} to {LARGEST_PRESSURE_ANGLE:g}°"
            yield _angle(part, key, value, expected)


def helix_angles_in_degrees(part: Part) -> Iterator[Finding]:
    """Helix angles that are next to nothing in degrees, but one in radians."""
    for key, value in _numbers(part, "helix_angle"):
        if 0.0 < abs(value) < SMALLEST_HELIX_ANGLE:
            expected = f"expected 0 or at least {SMALLEST_HELIX_ANGLE:g}° either way"
            yield _angle(part, key, value, expected)


def _angle(part: Part, key: str, value: float, expected: str) -> Finding:
    if abs(value) < 1.0:
        expected += f"; {value:g} rad are {math.degrees(value):.4g}°"
    return Finding(part.name, key, f"{value:g}°", expected)


def _numbers(table: Table, ending: str) -> Iterator[tuple[str, float]]:
    """(key, number) of all keys that end so."""
    for key, value in _given(table):
        if key.endswith(ending) and isinstance(value, float):
            yield key, value


def _given(table: Table, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted key, value) of a table and those in it."""
    for key, value in table:
        yield prefix + key, value
        if isinstance(value, Table):
            yield from _given(value, f"{prefix}{key}.")

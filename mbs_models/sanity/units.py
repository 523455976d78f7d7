"""Lengths in mm, angles in radians."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..model.parameters import Coupling, Part
from .finding import Finding
from .quantities import Quantity, gaps, helix_angles, lengths, pressure_angles, transmission_errors

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
    for length in lengths(part):
        if not SMALLEST_RADIUS <= length.value <= LARGEST_RADIUS:
            reason = f"expected {SMALLEST_RADIUS:g} to {LARGEST_RADIUS:g} m"
            if SMALLEST_RADIUS <= length.value / 1000.0 <= LARGEST_RADIUS:
                reason += f"; {length.value:g} mm are {length.value / 1000.0:g} m"
            yield Finding(part.name, length.key, f"{length.value:g} m", reason)


def gaps_and_errors_in_metres(part: Part | Coupling) -> Iterator[Finding]:
    """Backlash and transmission errors that no gear has in m, and most have in mm or µm."""
    for found, largest in ((gaps(part), LARGEST_GAP), (transmission_errors(part), LARGEST_ERROR)):
        for length in found:
            if abs(length.value) > largest:
                reason = f"expected at most {largest:g} m; is it in mm or µm?"
                yield Finding(part.name, length.key, f"{length.value:g} m", reason)


def pressure_angles_in_degrees(part: Part | Coupling) -> Iterator[Finding]:
    """Pressure angles that no gear has in degrees."""
    for angle in pressure_angles(part):
        if not SMALLEST_PRESSURE_ANGLE <= angle.value <= LARGEST_PRESSURE_ANGLE:
            expected = f"expected {SMALLEST_PRESSURE_ANGLE:g} to {LARGEST_PRESSURE_ANGLE:g}°"
            yield _angle(part, angle, expected)


def helix_angles_in_degrees(part: Part | Coupling) -> Iterator[Finding]:
    """Helix angles that are next to nothing in degrees, but one in radians."""
    for angle in helix_angles(part):
        if 0.0 < abs(angle.value) < SMALLEST_HELIX_ANGLE:
            expected = f"expected 0 or at least {SMALLEST_HELIX_ANGLE:g}° either way"
            yield _angle(part, angle, expected)


def _angle(part: Part | Coupling, angle: Quantity, expected: str) -> Finding:
    if abs(angle.value) < 1.0:
        expected += f"; {angle.value:g} rad are {math.degrees(angle.value):.4g}°"
    return Finding(part.name, angle.key, f"{angle.value:g}°", expected)

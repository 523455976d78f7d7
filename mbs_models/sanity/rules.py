"""The table of rules, and what they find in a drivetrain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from ..model.parameters import Coupling, Drivetrain, Part
from .finding import Finding
from .masses import diametral_inertias_fit_polar, inertias_fit_masses, masses_fit_radii
from .stiffnesses import off_their_neighbours, stiffnesses_in_range
from .teeth import ring_closes, teeth_fit_radii
from .units import (
    gaps_and_errors_in_metres,
    helix_angles_in_degrees,
    lengths_in_metres,
    pressure_angles_in_degrees,
)

T = TypeVar("T", bound=Part | Coupling)

# Masses, inertias, teeth and mesh stiffness are judged by the radii: nothing is said of them where
# a radius is wrong itself.
OF_ANY = (stiffnesses_in_range, off_their_neighbours)
OF_PARTS: tuple[Callable[[Part], Iterable[Finding]], ...] = (
    gaps_and_errors_in_metres,
    pressure_angles_in_degrees,
    helix_angles_in_degrees,
    teeth_fit_radii,
    ring_closes,
    masses_fit_radii,
    inertias_fit_masses,
    diametral_inertias_fit_polar,
    *OF_ANY,
)


def findings(drivetrain: Drivetrain) -> tuple[Finding, ...]:
    """What is probably typed wrong, of every value what the first rule says."""
    return (
        *speed_within_its_range(drivetrain),
        *(finding for part in drivetrain.parts for finding in _of(part, OF_PARTS)),
        *(finding for coupling in drivetrain.couplings for finding in _of(coupling, OF_ANY)),
    )


def speed_within_its_range(drivetrain: Drivetrain) -> Iterator[Finding]:
    """An operating speed, of either sense, outside the range that margins are looked for in."""
    operation = drivetrain.operation
    if operation is None or operation.speed is None:
        return
    first, last = operation.speed_range
    if not first <= abs(operation.speed) <= last:
        reason = f"expected within speed_range = [{first:g}, {last:g}] rpm"
        yield Finding("operation", "speed", f"{operation.speed:g} rpm", reason)


def _of(item: T, rules: Iterable[Callable[[T], Iterable[Finding]]]) -> tuple[Finding, ...]:
    said: dict[tuple[str, str], Finding] = {}
    found = list(lengths_in_metres(item)) or (f for rule in rules for f in rule(item))
    for finding in found:
        said.setdefault(finding.place, finding)
    return tuple(said.values())

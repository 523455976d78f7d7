"""The table of rules, and what they find in a drivetrain."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ..model.parameters import Coupling, Drivetrain, Part
from .finding import Finding
from .masses import diametral_inertias_fit_polar, inertias_fit_masses, masses_fit_radii
from .neighbours import off_their_neighbours
from .stiffness_ranges import stiffnesses_in_range
from .tooth_rules import ring_closes, teeth_fit_radii
from .units import (
    gaps_and_errors_in_metres,
    helix_angles_in_degrees,
    lengths_in_metres,
    pressure_angles_in_degrees,
)

Rule = Callable[[Part | Coupling], Iterable[Finding]]

# Masses, inertias, teeth and mesh stiffness are judged by the radii: nothing is said of them where
# a radius is wrong itself.
LENGTHS: tuple[Rule, ...] = (lengths_in_metres,)
RULES: tuple[Rule, ...] = (
    gaps_and_errors_in_metres,
    pressure_angles_in_degrees,
    helix_angles_in_degrees,
    teeth_fit_radii,
    ring_closes,
    masses_fit_radii,
    inertias_fit_masses,
    diametral_inertias_fit_polar,
    stiffnesses_in_range,
    off_their_neighbours,
)


def findings(drivetrain: Drivetrain) -> tuple[Finding, ...]:
    """What is probably typed wrong, part by part; of every value what the first rule says."""
    parts = (*drivetrain.parts, *drivetrain.couplings)
    return tuple(finding for part in parts for finding in _of_part(part))


def _of_part(part: Part | Coupling) -> tuple[Finding, ...]:
    said: dict[tuple[str, str], Finding] = {}
    for rules in (LENGTHS, RULES):
        for rule in rules:
            for finding in rule(part):
                said.setdefault(finding.place, finding)
        if said:
            break
    return tuple(said.values())

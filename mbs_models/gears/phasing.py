"""What harmonics of a mesh frequency excite in a planetary stage, and what phasing suppresses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from ..errors import ModelError
from ..stages.part import Kind
from ..stages.planet_set import PlanetSet, check_assembly

EQUALLY_SPACED = 1e-9  # rad


@dataclass(frozen=True)
class Phasing:
    """What a harmonic of the mesh frequency excites in a stage with equally spaced planets.

    Attributes
    ----------
    harmonic
        l.
    phasing_number
        k = l z_s mod N.
    excited
        The only family of modes it excites; the other two are suppressed.
    """

    harmonic: int
    phasing_number: int
    excited: Kind

    @property
    def suppressed(self) -> tuple[Kind, ...]:
        """The families that do not respond."""
        families = (Kind.ROTATIONAL, Kind.TRANSLATIONAL, Kind.PLANET)
        return tuple(kind for kind in families if kind is not self.excited)


def phasing(planets: PlanetSet, harmonics: int = 5) -> tuple[Phasing, ...]:
    """What each harmonic of the mesh frequency excites; k = l z_s mod N.

    k = 0: rotational modes only; k = 1 or N − 1: translational only; else planet modes only
    (Parker 2000, J. Sound Vib. 236, 561–573; Ambarisha & Parker 2006, J. Vib. Control 12, 3–28).

    Parameters
    ----------
    planets
        Equally spaced, all their meshes alike.
    harmonics
        How many harmonics, from l = 1.

    Raises
    ------
    ModelError
        Teeth are missing, the stage is not cyclically symmetric, or it cannot be assembled.
    """
    z_s, _ = planets.teeth
    check_assembly(planets)
    _check_symmetry(planets)
    count = len(planets.planets)
    found = []
    for harmonic in range(1, harmonics + 1):
        number = harmonic * z_s % count
        kind = Kind.PLANET
        if number == 0:
            kind = Kind.ROTATIONAL
        elif number in (1, count - 1):
            kind = Kind.TRANSLATIONAL
        found.append(Phasing(harmonic, number, kind))
    return tuple(found)


def _check_symmetry(planets: PlanetSet) -> None:
    angles = sorted(angle % (2.0 * math.pi) for angle in planets.angles)
    pitch = 2.0 * math.pi / len(angles)
    steps = [b - a for a, b in pairwise(angles)]
    if any(abs(step - pitch) > EQUALLY_SPACED for step in steps):
        raise ModelError(
            f"stage '{planets.stage}': planet_angles are not equally spaced: tooth numbers alone "
            "do not tell what a harmonic suppresses"
        )
    if not planets.meshes_alike:
        raise ModelError(
            f"stage '{planets.stage}': mesh stiffness differs from planet to planet: no harmonic "
            "suppresses a family of modes exactly"
        )

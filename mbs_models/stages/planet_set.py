"""A set of planets between a sun and a ring: their teeth, and the phases of their meshes.

Seen from the carrier the sun's teeth pass every planet, the planet at angle ψ later by the time the
sun needs to turn there. With the sun turning counter-clockwise against the carrier (and so planets
and ring clockwise), in mesh periods (Parker & Lin 2004, J. Mech. Des. 126, 365–370):

    γ_sn = ± z_s ψ_n/2π,    γ_rn = ∓ z_r ψ_n/2π + γ_rs    (lower signs: clockwise)

A mesh of phase γ does at time t what the first planet's sun mesh does at t − γ T. γ_rs, between
sun and ring mesh of one planet, is how long a planet's tooth takes from passing the sun's pitch
point with one flank to passing the ring's with the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import ModelError

# Of a mesh period: how far a planet angle in a file may be from one at which the planet can be
# put in (half a degree with a hundred teeth is a rounded angle; half a period is a wrong one).
ASSEMBLY_TOLERANCE = 0.15


@dataclass(frozen=True)
class PlanetSet:
    """Planets that one carrier carries between one sun and one ring.

    Attributes
    ----------
    stage
        Its stage's name.
    sun, ring, carrier, planets
        Names of the bodies.
    angles
        ψ of each planet (rad).
    counted
        Whether the file says how many there are, and not where they stand.
    sun_teeth, ring_teeth, planet_teeth
        If they are given.
    sun_angle, ring_angle
        Working pressure angles of the meshes (rad).
    one_angle
        Whether the file gives one for both, an average where profiles are shifted.
    ring_mesh_phase
        γ_rs if the file gives it (mesh periods).
    meshes_alike
        Whether all planets' meshes are equally stiff.
    """

    stage: str
    sun: str
    ring: str
    carrier: str
    planets: tuple[str, ...]
    angles: tuple[float, ...]
    counted: bool
    sun_teeth: int | None
    ring_teeth: int | None
    planet_teeth: int | None
    sun_angle: float
    ring_angle: float
    one_angle: bool
    ring_mesh_phase: float | None
    meshes_alike: bool

    @property
    def teeth(self) -> tuple[int, int]:
        """z_s and z_r.

        Raises
        ------
        ModelError
            One is missing.
        """
        if self.sun_teeth is None or self.ring_teeth is None:
            gear = "sun" if self.sun_teeth is None else "ring"
            raise ModelError(
                f"stage '{self.stage}': {gear}.teeth is missing: the phases of the planets' "
                "meshes follow from the teeth of sun and ring"
            )
        return self.sun_teeth, self.ring_teeth

    @property
    def standard_ring(self) -> int | None:
        """z_s + 2 z_p, if both are given."""
        if self.sun_teeth is None or self.planet_teeth is None:
            return None
        return self.sun_teeth + 2 * self.planet_teeth

    @property
    def teeth_over(self) -> int:
        """z_r − (z_s + 2 z_p) where the set is said to be a standard one; 0 if it is not."""
        standard = self.standard_ring
        if standard is None or self.ring_teeth is None or not self.one_angle:
            return 0
        return self.ring_teeth - standard


@dataclass(frozen=True)
class MeshPhases:
    """γ of each planet's mesh with the sun and with the ring, in mesh periods from 0 to 1."""

    sun: tuple[float, ...]
    ring: tuple[float, ...]


def mesh_phases(planets: PlanetSet, *, turning: float = 1.0, sun_drives: bool = True) -> MeshPhases:
    """γ_sn and γ_rn of every planet; the equations are this module's.

    Parameters
    ----------
    planets
        With the teeth of sun and ring, and of the planet or ``ring_mesh_phase``.
    turning
        Sign of the sun's rotation against the carrier, counter-clockwise in the stage's frame.
    sun_drives
        Whether the sun's teeth push in the direction they move, seen from the carrier.

    Raises
    ------
    ModelError
        Teeth are missing, or planets cannot be put in where they stand.
    """
    z_s, z_r = planets.teeth
    check_assembly(planets)
    between = sun_to_ring_phase(planets, sun_drives=sun_drives)
    way = math.copysign(1.0, turning)
    turns = [(angle - planets.angles[0]) / (2.0 * math.pi) for angle in planets.angles]
    return MeshPhases(
        sun=tuple(_within_a_period(way * z_s * turn) for turn in turns),
        ring=tuple(_within_a_period(between - way * z_r * turn) for turn in turns),
    )


def sun_to_ring_phase(planets: PlanetSet, *, sun_drives: bool = True) -> float:
    """γ_rs = z_p/2 ∓ z_p (σ_s + σ_r)/4π, by how much the ring's mesh is behind the sun's.

    σ is the angle of the planet's tooth on its pitch circle with sun or ring, the upper sign for a
    driving sun. σ_s = π/z_p, half a pitch, is assumed, and σ_r = σ_s + 2 inv α_s − 2 inv α_r
    follows: with equal pressure angles 1/2 for an even number of teeth, 0 for an odd one.
    ``ring_mesh_phase`` in the model file takes its place.

    Raises
    ------
    ModelError
        The planet's teeth are missing.
    """
    if planets.ring_mesh_phase is not None:
        return planets.ring_mesh_phase
    z_p = planets.planet_teeth
    if z_p is None:
        raise ModelError(
            f"stage '{planets.stage}': planet.teeth is missing: the phase between sun and ring "
            "mesh follows from it; give it, or ring_mesh_phase (mesh periods)"
        )
    widening = 2.0 * (_involute(planets.sun_angle) - _involute(planets.ring_angle))
    both = 2.0 * math.pi / z_p + widening  # σ_s + σ_r
    way = 1.0 if sun_drives else -1.0
    return z_p / 2.0 - way * z_p * both / (4.0 * math.pi)


def check_assembly(planets: PlanetSet) -> None:
    """Refuse planets that cannot be put in: (z_s + z_r) ψ/2π must be whole from planet to planet.

    Equally spaced planets: (z_s + z_r)/N must be whole.

    Raises
    ------
    ModelError
        Teeth are missing, or the condition is not met.
    """
    z_s, z_r = planets.teeth
    for number, angle in enumerate(planets.angles, start=1):
        pitches = (z_s + z_r) * (angle - planets.angles[0]) / (2.0 * math.pi)
        if abs(pitches - round(pitches)) > ASSEMBLY_TOLERANCE:
            what = (
                f"planet_angles: from planet 1 to planet {number} (z_s + z_r) ψ/2π = {pitches:.4g}"
            )
            if planets.counted:
                count = len(planets.planets)
                what = f"planets = {count}: (z_s + z_r)/N = {(z_s + z_r) / count:g}"
            raise ModelError(
                f"stage '{planets.stage}': {what} with z_s = {z_s} and z_r = {z_r} is not whole: "
                "teeth of sun and ring do not meet the planet's there, it cannot be assembled; "
                f"nearest are {_nearest_assembly(planets, z_s, z_r)}"
            )


def _nearest_assembly(planets: PlanetSet, z_s: int, z_r: int) -> str:
    """What would do: teeth for equally spaced planets, or angles that are whole pitches apart."""
    if planets.counted:
        fewer = (z_s + z_r) % len(planets.planets)
        more = len(planets.planets) - fewer
        gears = (("ring.teeth", z_r), ("sun.teeth", z_s))
        return ", ".join(f"{key} = {z - fewer} or {z + more}" for key, z in gears)
    first, pitch = math.degrees(planets.angles[0]), 360.0 / (z_s + z_r)
    turns = (round((math.degrees(angle) - first) / pitch) for angle in planets.angles)
    return f"planet_angles = [{', '.join(f'{first + turn * pitch:.7g}' for turn in turns)}]"


def _involute(angle: float) -> float:
    return math.tan(angle) - angle


def _within_a_period(phase: float) -> float:
    """A phase modulo 1; what round-off leaves below a whole number is 0."""
    return round(phase % 1.0, 12) % 1.0

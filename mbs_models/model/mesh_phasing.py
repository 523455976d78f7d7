"""Phases of a planetary stage's meshes, from tooth numbers, and what they excite and suppress.

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
from .parameters import PlanetaryStage

# Of a mesh period: how far a planet angle in a file may be from one at which the planet can be
# put in (half a degree with a hundred teeth is a rounded angle; half a period is a wrong one).
ASSEMBLY_TOLERANCE = 0.15


@dataclass(frozen=True)
class MeshPhases:
    """γ of each planet's mesh with the sun and with the ring, in mesh periods from 0 to 1."""

    sun: tuple[float, ...]
    ring: tuple[float, ...]


def mesh_phases(
    stage: PlanetaryStage, *, turning: float = 1.0, sun_drives: bool = True
) -> MeshPhases:
    """γ_sn and γ_rn of every planet; the equations are this module's.

    Parameters
    ----------
    stage
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
    z_s, z_r = sun_and_ring_teeth(stage)
    check_assembly(stage)
    between = sun_to_ring_phase(stage, sun_drives=sun_drives)
    way = math.copysign(1.0, turning)
    turns = [(angle - stage.angles[0]) / (2.0 * math.pi) for angle in stage.angles]
    return MeshPhases(
        sun=tuple(_within_a_period(way * z_s * turn) for turn in turns),
        ring=tuple(_within_a_period(between - way * z_r * turn) for turn in turns),
    )


def sun_to_ring_phase(stage: PlanetaryStage, *, sun_drives: bool = True) -> float:
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
    if stage.ring_mesh_phase is not None:
        return stage.ring_mesh_phase
    z_p = stage.planet.teeth
    if z_p is None:
        raise ModelError(
            f"stage '{stage.name}': planet.teeth is missing: the phase between sun and ring mesh "
            "follows from it; give it, or ring_mesh_phase (mesh periods)"
        )
    widening = 2.0 * (_involute(stage.sun_mesh_angle) - _involute(stage.ring_mesh_angle))
    both = 2.0 * math.pi / z_p + widening  # σ_s + σ_r
    way = 1.0 if sun_drives else -1.0
    return z_p / 2.0 - way * z_p * both / (4.0 * math.pi)


def check_assembly(stage: PlanetaryStage) -> None:
    """Refuse planets that cannot be put in: (z_s + z_r) ψ/2π must be whole from planet to planet.

    Equally spaced planets: (z_s + z_r)/N must be whole.

    Raises
    ------
    ModelError
        Teeth are missing, or the condition is not met.
    """
    z_s, z_r = sun_and_ring_teeth(stage)
    for number, angle in enumerate(stage.angles, start=1):
        pitches = (z_s + z_r) * (angle - stage.angles[0]) / (2.0 * math.pi)
        if abs(pitches - round(pitches)) > ASSEMBLY_TOLERANCE:
            what = (
                f"planet_angles: from planet 1 to planet {number} (z_s + z_r) ψ/2π = {pitches:.4g}"
            )
            if stage.planets is not None:
                what = f"planets = {stage.planets}: (z_s + z_r)/N = {(z_s + z_r) / stage.planets:g}"
            raise ModelError(
                f"stage '{stage.name}': {what} with z_s = {z_s} and z_r = {z_r} is not whole: "
                "teeth of sun and ring do not meet the planet's there, it cannot be assembled; "
                f"nearest are {_nearest_assembly(stage, z_s, z_r)}"
            )


def _nearest_assembly(stage: PlanetaryStage, z_s: int, z_r: int) -> str:
    """What would do: teeth for equally spaced planets, or angles that are whole pitches apart."""
    if stage.planets is not None:
        fewer = (z_s + z_r) % stage.planets
        more = stage.planets - fewer
        gears = (("ring.teeth", z_r), ("sun.teeth", z_s))
        return ", ".join(f"{key} = {z - fewer} or {z + more}" for key, z in gears)
    first, pitch = math.degrees(stage.angles[0]), 360.0 / (z_s + z_r)
    turns = (round((math.degrees(angle) - first) / pitch) for angle in stage.angles)
    return f"planet_angles = [{', '.join(f'{first + turn * pitch:.7g}' for turn in turns)}]"


def sun_and_ring_teeth(stage: PlanetaryStage) -> tuple[int, int]:
    """Teeth of sun and ring; refuses a stage in which one is missing."""
    for gear in ("sun", "ring"):
        if getattr(stage, gear).teeth is None:
            raise ModelError(
                f"stage '{stage.name}': {gear}.teeth is missing: the phases of the planets' "
                "meshes follow from the teeth of sun and ring"
            )
    assert stage.sun.teeth is not None
    assert stage.ring.teeth is not None
    return stage.sun.teeth, stage.ring.teeth


def _involute(angle: float) -> float:
    return math.tan(angle) - angle


def _within_a_period(phase: float) -> float:
    """A phase modulo 1; what round-off leaves below a whole number is 0."""
    return round(phase % 1.0, 12) % 1.0

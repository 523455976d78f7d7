"""Lines of a spectrum with names: mesh harmonics and their sidebands.

Harmonic l of a mesh and n turns of what passes the sensor make the line l f_m + n f_c. In a
planetary stage f_c is the carrier's speed relative to the ring; in a parallel stage a shaft's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..parameters import Drivetrain, PlanetaryStage

FloatArray = NDArray[np.float64]

MINUS, TIMES = "−", "·"


@dataclass(frozen=True)
class MeshTone:
    """A mesh at a steady speed.

    Attributes
    ----------
    name
        What to call its lines: "mesh planetary".
    mesh_frequency
        f_m (Hz).
    carrier_frequency, planets
        f_c (Hz) relative to the ring, positive along positive w, and N, of a planetary stage. Of
        a parallel one the speed of the shaft whose sidebands are looked for, and 0.
    """

    name: str
    mesh_frequency: float
    carrier_frequency: float = 0.0
    planets: int = 0


@dataclass(frozen=True)
class GearLine:
    """A line theory knows: harmonic·f_m + offset·f_c of a tone."""

    tone: MeshTone
    harmonic: int
    offset: int

    @property
    def frequency(self) -> float:
        """Hz."""
        passing = abs(self.tone.carrier_frequency)
        return self.harmonic * self.tone.mesh_frequency + self.offset * passing

    @property
    def name(self) -> str:
        """ "2·mesh planetary − 1·planet pass"; turns of the carrier where planets are split."""
        base = f"{self.harmonic}{TIMES}{self.tone.name}"
        if not self.offset:
            return base
        count, unit = abs(self.offset), "carrier" if self.tone.planets else "shaft"
        if self.tone.planets and count % self.tone.planets == 0:
            count, unit = count // self.tone.planets, "planet pass"
        sign = MINUS if self.offset < 0 else "+"
        return f"{base} {sign} {count}{TIMES}{unit}"


@dataclass(frozen=True)
class MeasuredLine:
    """A line as a spectrum has it.

    Attributes
    ----------
    line
        What theory calls it.
    frequency, amplitude
        Of the largest value within a line of the spectrum around it.
    distinct
        Whether no other named line is so near that the spectrum cannot tell them apart.
    """

    line: GearLine
    frequency: float
    amplitude: float
    distinct: bool

    @property
    def name(self) -> str:
        """The line's name."""
        return self.line.name


def mesh_tones(
    drivetrain: Drivetrain, mesh_frequencies: Mapping[str, float], speeds: Mapping[str, float]
) -> tuple[MeshTone, ...]:
    """Tones of all stages that have a mesh frequency.

    Parameters
    ----------
    drivetrain
        Whose stages they are.
    mesh_frequencies
        Stage → f_m (Hz).
    speeds
        Body → rad/s in the sense of its positive w.
    """
    tones = []
    for stage in drivetrain.stages:
        if stage.name in mesh_frequencies:
            carrier, planets = 0.0, 0
            if isinstance(stage, PlanetaryStage):
                carrier = speeds[f"{stage.name}.carrier"] - speeds[f"{stage.name}.ring"]
                planets = len(stage.angles)
            frequency = mesh_frequencies[stage.name]
            tones.append(
                MeshTone(f"mesh {stage.name}", frequency, carrier / (2.0 * math.pi), planets)
            )
    return tuple(tones)


def gear_lines(
    tones: Sequence[MeshTone], *, harmonics: int, sidebands: int, highest: float
) -> tuple[GearLine, ...]:
    """Mesh harmonics 1 … ``harmonics`` with up to ``sidebands`` carrier turns either side.

    Parameters
    ----------
    tones
        The meshes.
    harmonics, sidebands
        How many; tones without a carrier have no sidebands.
    highest
        Lines above 0 and up to this frequency (Hz) are given, ascending.
    """
    lines = [
        GearLine(tone, harmonic, offset)
        for tone in tones
        for harmonic in range(1, harmonics + 1)
        for offset in (range(-sidebands, sidebands + 1) if tone.carrier_frequency else (0,))
    ]
    return tuple(
        sorted((x for x in lines if 0.0 < x.frequency <= highest), key=lambda x: x.frequency)
    )


def measured_lines(
    lines: Sequence[GearLine], frequency: FloatArray, amplitude: FloatArray
) -> tuple[MeasuredLine, ...]:
    """Read the lines out of a spectrum.

    Parameters
    ----------
    lines
        What to look for.
    frequency
        (nf,) uniform axis (Hz).
    amplitude
        (nf,) of one channel.

    Raises
    ------
    ModelError
        Shapes that do not fit, or a line beyond the axis.
    """
    if frequency.shape != amplitude.shape or frequency.ndim != 1 or len(frequency) < 3:
        raise ModelError(
            f"spectrum: frequencies {frequency.shape} and amplitudes {amplitude.shape}; one "
            "channel of 3 lines or more is needed"
        )
    step = float(frequency[1] - frequency[0])
    found = []
    for line in lines:
        if not frequency[0] <= line.frequency <= frequency[-1]:
            raise ModelError(
                f"spectrum: {line.name} at {line.frequency:g} Hz is not between "
                f"{frequency[0]:g} and {frequency[-1]:g} Hz"
            )
        centre = round((line.frequency - frequency[0]) / step)
        near = slice(max(centre - 1, 0), centre + 2)
        at = near.start + int(np.argmax(amplitude[near]))
        others = (abs(o.frequency - line.frequency) for o in lines if o is not line)
        distinct = all(distance >= 4.0 * step for distance in others)
        found.append(MeasuredLine(line, float(frequency[at]), float(amplitude[at]), distinct))
    return tuple(found)

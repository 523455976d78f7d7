"""Lines with names: mesh harmonics and their sidebands, and how large they are in a record.

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
from ..model.parameters import Drivetrain
from .line_fit import fit_tones

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
    """A line as a record has it.

    Attributes
    ----------
    line
        What theory calls it.
    amplitude
        At its frequency.
    distinct
        Whether no other named line is so near that the record is too short to tell them apart; the
        amplitude is what both make together, else.
    """

    line: GearLine
    amplitude: float
    distinct: bool

    @property
    def frequency(self) -> float:
        """The line's frequency (Hz): speeds are known."""
        return self.line.frequency

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
            for own in stage.planet_sets():
                carrier = speeds[own.carrier] - speeds[own.ring]
                planets = len(own.planets)
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
    lines: Sequence[GearLine], samples: FloatArray, sampling_frequency: float
) -> tuple[tuple[MeasuredLine, ...], ...]:
    """Amplitudes of the lines in every channel of a record, by `fit_tones`.

    Parameters
    ----------
    lines
        What to look for.
    samples
        (n, n_channel).
    sampling_frequency
        Hz.

    Raises
    ------
    ModelError
        A record that cannot be read, or a line beyond half the sampling frequency.
    """
    for line in lines:
        if not 0.0 < line.frequency <= sampling_frequency / 2.0:
            raise ModelError(
                f"record: {line.name} at {line.frequency:g} Hz is not above 0 and up to half the "
                f"sampling frequency, {sampling_frequency / 2.0:g} Hz"
            )
    fit = fit_tones(samples, sampling_frequency, [line.frequency for line in lines])
    return tuple(
        tuple(
            MeasuredLine(line, float(amplitude), bool(distinct))
            for line, amplitude, distinct in zip(lines, channel, fit.distinct, strict=True)
        )
        for channel in np.abs(fit.amplitudes).T
    )

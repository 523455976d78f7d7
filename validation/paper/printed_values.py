"""The numbers the paper prints. Nothing is computed from them but deviations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbs_models.modal.mode_kinds import Kind


@dataclass(frozen=True)
class PrintedMode:
    """A natural frequency as a table prints it."""

    number: int
    frequency_hz: float
    multiplicity: int
    column: str
    kind: Kind

    def __str__(self) -> str:
        repeated = f"({self.multiplicity})" if self.multiplicity > 1 else ""
        return f"{self.frequency_hz:.0f}{repeated}"


_COLUMNS = {
    Kind.GLOBAL: "Global mode",
    Kind.RIGID_BODY: "Planetary stage, rotational mode",
    Kind.ROTATIONAL: "Planetary stage, rotational mode",
    Kind.TRANSLATIONAL: "Planetary stage, translational mode",
    Kind.PLANET: "Planetary stage, planet mode",
    Kind.PARALLEL_STAGE: "Parallel stage",
}


def _mode(number: int, frequency_hz: float, kind: Kind, multiplicity: int = 1) -> PrintedMode:
    return PrintedMode(number, frequency_hz, multiplicity, _COLUMNS[kind], kind)


TABLE_3 = (
    _mode(1, 0.0, Kind.RIGID_BODY),
    _mode(2, 71.0, Kind.GLOBAL),
    _mode(3, 727.0, Kind.TRANSLATIONAL, 2),
    _mode(4, 1091.0, Kind.TRANSLATIONAL, 2),
    _mode(5, 1125.0, Kind.PARALLEL_STAGE, 2),
    _mode(6, 1537.0, Kind.ROTATIONAL),
    _mode(7, 1566.0, Kind.PARALLEL_STAGE),
    _mode(8, 1808.0, Kind.PLANET),
    _mode(9, 1893.0, Kind.TRANSLATIONAL, 2),
    _mode(10, 1971.0, Kind.ROTATIONAL),
    _mode(11, 2105.0, Kind.PARALLEL_STAGE),
    _mode(12, 2202.0, Kind.PARALLEL_STAGE),
    _mode(13, 2343.0, Kind.TRANSLATIONAL, 2),
    _mode(14, 2626.0, Kind.ROTATIONAL),
    _mode(15, 3972.0, Kind.PARALLEL_STAGE),
    _mode(16, 5964.0, Kind.PLANET),
    _mode(17, 6981.0, Kind.PLANET),
    _mode(18, 7190.0, Kind.TRANSLATIONAL, 2),
    _mode(19, 7774.0, Kind.ROTATIONAL),
    _mode(20, 10438.0, Kind.ROTATIONAL, 2),
)
"""Table 3, Full system natural frequencies (Hz)."""

TABLE_4 = (
    (0.0, 0.0),
    (1550.0, 1537.0),
    (1982.0, 1971.0),
    (2626.0, 2626.0),
    (7774.0, 7774.0),
    (10438.0, 10438.0),
)
"""Table 4, Comparison of the rotational modes (Hz): full system, coupling method."""

PRINTED_TO_HZ = 1.0
"""Tables 3 and 4 print whole Hz."""

TABLE_BAND_HZ = 15000.0
"""The band of Fig. 4, which shows the modes Table 3 lists."""

GEAR_INERTIAS_KG = {"I/r² of a gear (Table 1)": 0.58, "J/r² of a gear (Table 1)": 1.16}
"""Table 1: what else could have been typed in where the hub's inertia belongs."""


@dataclass(frozen=True)
class ParallelTable:
    """Table 1; SI units, inertias I/r² in kg, pressure angle in degrees."""

    mass: float
    diametral: float
    polar: float
    bearing_y: float
    bearing_z: float
    rocking: float
    pressure_angle: float
    mesh: float
    hub_inertia: float


@dataclass(frozen=True)
class Gear:
    """A gear of Table 2: teeth, mass (kg), I/r² (kg), base radius (m)."""

    name: str
    teeth: int
    mass: float
    inertia: float
    base_radius: float


@dataclass(frozen=True)
class PlanetaryTable:
    """Table 2; module (mm), width (m), pressure angle (degrees)."""

    gears: tuple[Gear, ...]
    module: float
    width: float
    pressure_angle: float


TABLE_1 = ParallelTable(2.0, 0.58, 1.16, 3.5e8, 1e8, 1e8, 20.0, 2e8, 4.48e-8)

TABLE_2 = PlanetaryTable(
    (
        Gear("sun", 30, 0.46, 0.272, 0.024),
        Gear("planet", 20, 0.177, 0.1, 0.016),
        Gear("ring", 70, 0.588, 0.759, 0.056),
    ),
    module=1.7,
    width=0.025,
    pressure_angle=21.34,
)

SHAFT_STIFFNESSES = (1e5, 1e6, 1e7)
"""Sec. 4.2: k_sw (N/m)."""

TIME_SAVED = 0.70
"""Sec. 4.1: "the coupling method reduces the computational time by 70%"."""

GLOBAL_PEAK_HZ = 70.0
"""Sec. 4.3, of Fig. 10b: "the peak appearing at around 70 Hz is due to the coupling DoF"."""

NUMBERED_AS_SECOND_PLANET = 13
"""Fig. 6(b): the DoF whose caption says u of the second planet."""

PROBE_HZ = np.arange(105.0, 4000.0, 10.0)
"""Lines on which printed formulas are compared, off the poles of the presets."""

"""What a turning or loaded gearbox does: mesh forces, lines of the meshes, planets that pass."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fbs.periodic.floquet import stability_by_period
from fbs.signal.spectra import Spectrum, amplitude_spectrum, line_amplitudes
from mbs_models.errors import ModelError
from mbs_models.gears.gear_lines import (
    MeasuredLine,
    MeshTone,
    gear_lines,
    measured_lines,
    mesh_tones,
)
from mbs_models.gears.gear_response import MeshLoad, mesh_loads
from mbs_models.gears.operating_point import OperatingPoint
from mbs_models.gears.phasing import Phasing, phasing
from mbs_models.gears.sidebands import expected_sidebands, passing_window, ring_sensor
from mbs_models.integration.transient_record import TransientRecord
from mbs_models.modal.mode_kinds import rigid_body_count
from mbs_models.model.parameters import Drivetrain
from mbs_models.stages.part import MeshFamily
from mbs_models.stages.planet_set import PlanetSet
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize, round_off_force

from ..arrays import BoolArray, FloatArray
from ..checks.check import Check
from ..report.digits import engineering
from ..routes.periodic_meshes import parametric

NOTHING_EXCITES = (
    "Nothing excites: no mesh has a stiffness that varies or a transmission error, so that every "
    "mesh carries its static force. Give mesh_variation or mesh_transmission_error."
)
HARMONICS = 6  # of a mesh that are named and followed: as many as the band has
PASSES = 2  # planet passings either side of a harmonic that are named
LEAST_TURNS = 4.0  # of a carrier in the measured part: a Hann window's lines are four bins wide
# Samples transformed at once: spectra of a longer run are averaged, and a sensor hears its end.
LONGEST_SPECTRUM = 1 << 20
UNCHANGED = 1e-7  # relative, of a natural frequency
RESOLVED = 2.0  # lines of a spectrum that two sines must be apart: half a Hann window's main lobe
WINDOW_HARMONICS = 12  # of the transfer path from ring mesh to sensor


@dataclass(frozen=True, eq=False)
class RingSensor:
    """What a sensor on a stage's ring feels of the planets' mesh forces, against theory.

    Attributes
    ----------
    stage
        Its name.
    passing
        How often the carrier passes the ring (Hz).
    spectrum
        (nf, 1) N.
    lines
        The lines named.
    orders, frequency, measured, expected
        Orders of the carrier around the mesh's harmonics, their frequencies (Hz), and the amplitude
        of each (N): as in the run, and from tooth numbers and the first planet's mesh force alone.
    foreign
        (n_line,) which of them lie on harmonics of other meshes, heard through the passing planets
        too: theory knows this stage's mesh alone.
    """

    stage: str
    passing: float
    spectrum: Spectrum
    lines: tuple[MeasuredLine, ...]
    orders: NDArray[np.int_]
    frequency: FloatArray
    measured: FloatArray
    expected: FloatArray
    foreign: BoolArray

    @property
    def deviation(self) -> float:
        """Largest difference of any line that is not foreign, of the largest line."""
        difference = np.abs(self.measured - self.expected)[~self.foreign]
        return float(difference.max(initial=0.0) / self.expected.max())

    @property
    def sentence(self) -> str:
        """How far run and theory are apart."""
        left_out = int(self.foreign.sum())
        words = f"{self.deviation:.2g} of the largest line"
        if left_out:
            words += f"; {left_out} of {len(self.foreign)} lines are other meshes' and left out"
        return f"Sidebands at the ring of {self.stage}: run and theory differ by at most {words}."


@dataclass(frozen=True)
class Stability:
    """What Floquet theory says of meshes that vary together: the largest growth of a motion (1/s).

    ``stages`` are those whose meshes share a period; others are at their mean.
    """

    stages: tuple[str, ...]
    growth_rate: float

    @property
    def sentence(self) -> str:
        """What it means for the run."""
        stages = " and ".join(self.stages)
        if self.growth_rate > 0.0:
            return (
                f"Parametric instability: with the mesh stiffness of {stages} varying like this, "
                f"Floquet theory on the linear model lets a motion grow by a factor of e in "
                f"{1.0 / self.growth_rate:.3g} s, until teeth part."
            )
        return (
            f"Floquet theory on the linear model: stable, the mesh stiffness of {stages} may vary "
            f"like this; every free motion falls by a factor of e in "
            f"{-1.0 / self.growth_rate:.3g} s or less."
            if self.growth_rate < 0.0
            else f"Floquet theory on the linear model: the mesh stiffness of {stages} lets no "
            "motion grow; nothing damps some."
        )


@dataclass(frozen=True, eq=False)
class GearRun:
    """Gears in a run.

    Attributes
    ----------
    point
        Speed, torque and what follows from them.
    loads
        Force of every mesh.
    mesh_forces, mesh_spectrum
        (n, n_mesh) N of the measured part, and its spectrum (nf, n_mesh); the spectrum is None
        at standstill.
    lines
        Mesh → its named lines.
    sensors
        One for each planetary stage that turns so often that its sidebands can be told apart.
    phasing
        Stage → what each harmonic of its mesh excites, where tooth numbers tell.
    stability
        By Floquet theory, one for each group of stages whose meshes share a period.
    frequencies_at_rest, frequencies_loaded
        Natural frequencies of the elastic modes (Hz), as built and under the torque.
    """

    point: OperatingPoint
    loads: tuple[MeshLoad, ...]
    mesh_forces: FloatArray
    mesh_spectrum: Spectrum | None
    lines: Mapping[str, tuple[MeasuredLine, ...]]
    sensors: tuple[RingSensor, ...]
    phasing: Mapping[str, tuple[Phasing, ...]]
    stability: tuple[Stability, ...] = ()
    frequencies_at_rest: FloatArray = field(default_factory=lambda: np.zeros(0))
    frequencies_loaded: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def loaded_sentence(self) -> str:
        """What the torque does to natural frequencies, in a sentence; empty without one."""
        if not self.point.torque or not len(self.frequencies_at_rest):
            return ""
        change = self.frequencies_loaded / self.frequencies_at_rest - 1.0
        most = int(np.abs(change).argmax())
        if abs(change[most]) < UNCHANGED:
            return (
                f"Linearised under {engineering(self.point.torque, 'N m')}, natural frequencies do "
                "not change."
            )
        return (
            f"Linearised under {engineering(self.point.torque, 'N m')}, natural frequencies change "
            f"by {change[most]:+.2g} at most (relative; {self.frequencies_at_rest[most]:.5g} Hz at "
            f"rest, {self.frequencies_loaded[most]:.5g} Hz under load)."
        )

    @property
    def excites(self) -> bool:
        """Whether any mesh varies: else every mesh carries its static force, and nothing moves."""
        return any(law.varies for law in self.point.laws.values())

    @property
    def says_nothing_excites(self) -> bool:
        """Whether that is worth a word: at speed, not where the meshes stand still."""
        return self.point.speed_rpm is not None and not self.excites


def gear_run(
    drivetrain: Drivetrain, point: OperatingPoint, record: TransientRecord, run_in: float
) -> GearRun:
    """Analyse the meshes of a run after its run-in.

    Parameters
    ----------
    drivetrain, point
        What was run, and at which operating point.
    record
        With its mesh forces and which flanks touch.
    run_in
        What is left out at the start (s).
    """
    assert record.mesh_forces is not None
    measured = record.span(math.ceil(run_in * record.sampling_frequency))
    assert measured.mesh_forces is not None
    forces, rate = np.asarray(measured.mesh_forces), record.sampling_frequency
    assert measured.contact is not None
    nothing = round_off_force(build_drivetrain(drivetrain))
    loads = mesh_loads(record.meshes, forces, measured.contact, nothing=nothing)
    tones = mesh_tones(drivetrain, point.mesh_frequencies, point.speeds)
    at_rest, loaded = _frequencies(drivetrain, point)
    if not (tones and any(law.varies for law in point.laws.values())):
        return GearRun(
            point, loads, forces, None, {}, (), {},
            frequencies_at_rest=at_rest, frequencies_loaded=loaded,
        )  # fmt: skip
    length = min(len(forces), LONGEST_SPECTRUM)
    spectrum = amplitude_spectrum(forces, rate, resolution=rate / length)
    named = gear_lines(tones, harmonics=HARMONICS, sidebands=0, highest=rate / 2.0)
    lines = measured_lines(named, forces, rate)
    return GearRun(
        point=point,
        loads=loads,
        mesh_forces=forces,
        mesh_spectrum=spectrum,
        lines=dict(zip(record.meshes, lines, strict=True)),
        sensors=tuple(_sensors(drivetrain, point, measured.span(len(forces) - length), tones)),
        phasing=_phasing(drivetrain, point),
        stability=_stability(drivetrain, point),
        frequencies_at_rest=at_rest,
        frequencies_loaded=loaded,
    )


def steady_checks(gears: GearRun | None) -> tuple[Check, ...]:
    """Whether there is a steady state at all: teeth without play let an instability grow on."""
    if gears is None or any(law.backlash for law in gears.point.laws.values()):
        return ()
    return tuple(
        Check(
            "steady state", " and ".join(each.stages), ("Floquet theory", "exudyn in time"),
            "growth of the fastest growing motion, 1/s", each.growth_rate, 0.0,
            "what grows by parametric instability ends in no steady state, and only play, as teeth "
            "part, would end it",
            (each.sentence,) if each.growth_rate > 0.0 else (),
        )
        for each in gears.stability
        if each.growth_rate > 0.0
    )  # fmt: skip


def flank_warnings(point: OperatingPoint | None) -> tuple[str, ...]:
    """Said where a torque presses the flanks that the model's lines of action are not of."""
    if point is None or not any(law.flank < 0.0 for law in point.laws.values()):
        return ()
    return (
        "the torque presses the other flanks than those the lines of action are drawn for "
        "(positive torque on a stage's first gear): forces are right, but what a preload does to "
        "natural frequencies has the wrong sign; mirror the model, or reverse torque and speed",
    )


def _frequencies(drivetrain: Drivetrain, point: OperatingPoint) -> tuple[FloatArray, FloatArray]:
    """Elastic modes' natural frequencies (Hz), at rest and under the torque."""
    rest = linearize(build_drivetrain(drivetrain))
    rigid = rigid_body_count(rest.stiffness)
    squares = [
        eigh(linear.stiffness, linear.mass, eigvals_only=True)[rigid:]
        for linear in (rest, point.linear)
    ]
    # An equilibrium is stable, or there is no operating point: what is below 0 is round-off.
    at_rest, loaded = (np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi) for values in squares)
    return at_rest, loaded


def _stability(drivetrain: Drivetrain, point: OperatingPoint) -> tuple[Stability, ...]:
    assert point.speed_rpm is not None
    periodic = parametric(drivetrain, point)
    turns = np.array([abs(point.speed_rpm) / 60.0])
    stage_of = {name: family.stage for family in drivetrain.mesh_families for name in family.names}
    stabilities = []
    for group, growth in stability_by_period(periodic.system, periodic.springs, turns):
        stages = dict.fromkeys(stage_of[periodic.springs[m].name] for m in group)
        stabilities.append(Stability(tuple(stages), float(growth.growth_rate[0])))
    return tuple(stabilities)


def _phasing(drivetrain: Drivetrain, point: OperatingPoint) -> dict[str, tuple[Phasing, ...]]:
    phasings = {}
    for stage in drivetrain.stages:
        for planets in stage.planet_sets() if stage.name in point.mesh_frequencies else ():
            try:
                phasings[stage.name] = phasing(planets, HARMONICS)
            except ModelError:
                continue  # planets that differ: tooth numbers alone do not tell
    return phasings


def _sensors(
    drivetrain: Drivetrain,
    point: OperatingPoint,
    record: TransientRecord,
    tones: tuple[MeshTone, ...],
) -> list[RingSensor]:
    sensors = []
    for stage in drivetrain.stages:
        tone = next((tone for tone in tones if tone.name == f"mesh {stage.name}"), None)
        if tone is None:
            continue
        turns = abs(tone.carrier_frequency) * record.n_samples / record.sampling_frequency
        if turns < LEAST_TURNS or tone.mesh_frequency >= record.sampling_frequency / 2.0:
            continue
        for planets, _, ring in stage.planet_meshes():
            phases = [point.phases[name] for name in ring.names if name in point.phases]
            if phases:
                others = [other.mesh_frequency for other in tones if other is not tone]
                sensors.append(_sensor(planets, ring, tone, phases, record, others))
    return sensors


def _sensor(
    planets: PlanetSet,
    ring: MeshFamily,
    tone: MeshTone,
    phases: Sequence[float],
    record: TransientRecord,
    others: Sequence[float],
) -> RingSensor:
    assert record.mesh_forces is not None
    rate, (_, teeth), count = record.sampling_frequency, planets.teeth, len(planets.planets)
    columns = [record.meshes.index(name) for name in ring.names]
    forces, time = np.asarray(record.mesh_forces)[:, columns], record.time
    forces = forces - forces.mean(axis=0)
    window = passing_window(count, WINDOW_HARMONICS)
    felt = ring_sensor(forces, time, planets.angles, tone.carrier_frequency, window)
    spectrum = amplitude_spectrum(felt[:, None], rate)
    lines = gear_lines(
        [tone],
        harmonics=HARMONICS,
        sidebands=PASSES * count,
        highest=rate / 2.0,
    )
    # What the record is too slow for is in no line of it.
    highest = math.ceil(rate / 2.0 / tone.mesh_frequency) - 1
    harmonics = np.arange(1, min(HARMONICS, highest) + 1)
    mesh = line_amplitudes(forces[:, 0], rate, harmonics * tone.mesh_frequency)
    # Phases are counted from the start of the run, where the carrier is at 0.
    mesh = mesh * np.exp(-2j * np.pi * harmonics * tone.mesh_frequency * time[0])
    way = math.copysign(1.0, tone.carrier_frequency)
    expected = expected_sidebands(
        teeth,
        [way * angle for angle in planets.angles],  # counted as the carrier turns
        [0.0, *(mesh * np.exp(2j * np.pi * harmonics * phases[0]))],
        window,
        phases=[-2.0 * np.pi * phase for phase in phases],
    )
    passing = abs(tone.carrier_frequency)
    near = [band for band in expected if band.harmonic and abs(band.offset) <= PASSES * count]
    # Not order · f_c: radii in a file fit the teeth within their rounding only.
    frequency = np.array(
        [band.harmonic * tone.mesh_frequency + band.offset * passing for band in near]
    )
    shown = (frequency > 0.0) & (frequency < rate / 2.0)
    heard = harmonics_heard(others, passing, rate / 2.0)
    apart = RESOLVED * rate / len(time)
    return RingSensor(
        stage=planets.stage,
        passing=passing,
        spectrum=spectrum,
        lines=measured_lines(lines, felt[:, None], rate)[0],
        orders=np.array([band.order for band in near])[shown],
        frequency=frequency[shown],
        measured=np.abs(line_amplitudes(felt, rate, frequency[shown])),
        expected=np.array([band.amplitude for band in near])[shown],
        foreign=np.any(np.abs(frequency[shown, None] - heard) < apart, axis=1),
    )


def harmonics_heard(meshes: Sequence[float], passing: float, highest: float) -> FloatArray:
    """Where a sensor on a ring hears other meshes: k f ± m f_c (Hz)."""
    passes = passing * np.arange(-WINDOW_HARMONICS, WINDOW_HARMONICS + 1)
    centres = [
        frequency * np.arange(1, int(highest / frequency) + 1) for frequency in meshes if frequency
    ]
    return np.asarray(np.add.outer(np.concatenate([np.empty(0), *centres]), passes)).ravel()

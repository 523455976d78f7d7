"""The report of a run, section by section: what is said, and the figures that show it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fbs.spectra import amplitude_spectrum, spectrogram
from fbs.swept_sine import peak_hold
from mbs_models.meshing.gear_response import rms_per_body
from mbs_models.signals.sines import SteppedSine, Sweep

from .drive_level import DriveLevels, frf_of
from .estimates import DECIBEL_TOLERANCE, DEGREE_TOLERANCE, EstimatedFrfs
from .frf_figures import FrfPair, LevelCurve, frf_figure, level_figure, peak_hold_figure
from .gear_run import GearRun, RingSensor
from .order_figures import Theory, order_figure
from .record_figures import (
    history_figure,
    mesh_figure,
    rms_figure,
    spectrogram_figure,
    spectrum_figure,
)
from .results import Simulation

FloatArray = NDArray[np.float64]

UNIT = "m/N"
DRAWN = 4  # FRFs, or channels of a record
SPECTRUM_LINES = 2000  # of the spectra of a long record, averaged
SPECTROGRAM_LINES = 400
MESH_PERIODS = 8  # of mesh forces drawn
HELD_LINES = 120  # of a peak-hold


@dataclass(frozen=True)
class Section:
    """A heading, paragraphs below it, and figures (SVG)."""

    anchor: str
    title: str
    words: tuple[str, ...]
    figures: tuple[str, ...]


def sections(found: Simulation) -> tuple[Section, ...]:
    """Everything the report shows beside its verdicts and tables."""
    return tuple(_sections(found))


def _sections(found: Simulation) -> Iterator[Section]:
    for number, estimated in enumerate(found.estimated):
        yield _frfs(estimated, number)
    if found.levels is not None:
        yield _levels(found.levels)
    if found.gears is not None:
        yield from _gears(found, found.gears)
    swept = _swept(found)
    if swept is not None:
        yield swept
    yield _motion(found)


def _frfs(estimated: EstimatedFrfs, place: int) -> Section:
    frf, reference = estimated.estimate.frf, estimated.reference
    coherence = estimated.estimate.coherence
    words = [
        f"{len(frf.frequency)} lines by the estimator “{estimated.estimate.kind}”"
        + (
            f" over {estimated.estimate.n_averages} averages"
            if estimated.estimate.n_averages > 1
            else ""
        )
        + f"; median difference {np.median(estimated.decibels[estimated.compared]):.2g} dB on the "
        "lines within 80 dB of each response’s peak."
    ]
    if estimated.estimate.kind == "H1" and coherence is not None:
        words.append(
            f"Coherence: median {np.median(coherence):.4f}, lowest {coherence.min():.2f}. Where it "
            "is low the estimate scatters, and is allowed to."
        )
    figures = [
        frf_figure(
            f"frf{place}-{number}",
            frf.frequency,
            FrfPair(
                f"{frf.responses[i]} ← {frf.excitations[j]}",
                frf.values[:, i, j],
                reference.values[:, i, j],
                estimated.compared[:, i, j],
            ),
            UNIT,
            allowed=(DECIBEL_TOLERANCE, DEGREE_TOLERANCE),
        )
        for number, (i, j) in enumerate(_shown(estimated))
    ]
    title = f"FRFs from {', '.join(frf.excitations)}, against FBS"
    return Section(f"frfs{place}", title, tuple(words), tuple(figures))


def _shown(estimated: EstimatedFrfs) -> list[tuple[int, int]]:
    """The worst FRF, those at the excited DoFs, and the largest others."""
    frf = estimated.estimate.frf
    compared = np.asarray(estimated.compared.any(axis=0))
    worst = np.unravel_index(estimated.decibels.max(axis=0).argmax(), compared.shape)
    order = [(int(worst[0]), int(worst[1]))]
    order += [
        (frf.responses.index(dof), j)
        for j, dof in enumerate(frf.excitations)
        if dof in frf.responses
    ]
    size = np.abs(estimated.reference.values).max(axis=0)
    order += [
        (int(i), int(j))
        for i, j in zip(*np.unravel_index(np.argsort(-size, axis=None), size.shape), strict=True)
    ]
    return [pair for pair in dict.fromkeys(order) if compared[pair]][:DRAWN]


def _levels(levels: DriveLevels) -> Section:
    reference = frf_of(levels)
    if reference is None:
        return Section("levels", "FRF against drive level", (levels.conclusion,), ())
    at = reference.excitations[0]
    row = reference.responses.index(at) if at in reference.responses else 0
    curves = [
        LevelCurve(
            level.peak_force,
            None if level.found is None else level.found.estimate.frf.values[:, row, 0],
            level.worst_db,
            level.median_db,
        )
        for level in levels.levels
    ]
    figure = level_figure(
        "levels",
        reference.frequency,
        reference.values[:, row, 0],
        curves,
        UNIT,
        f"{reference.responses[row]} ← {at}",
        DECIBEL_TOLERANCE,
    )
    words = (
        levels.conclusion,
        "Each curve is the best linear approximation at its level: the multisine’s spectrum ratio "
        "in the last of three periods. A gearbox that is driven harder turns its lines of action "
        "and lifts its teeth; FBS couples FRFs of small motions about the state as built.",
    )
    return Section("levels", "FRF against drive level", words, (figure,))


def _gears(found: Simulation, gears: GearRun) -> Iterator[Section]:
    rate = found.record.sampling_frequency
    point = gears.point
    lowest = min(point.mesh_frequencies.values(), default=0.0)
    count = len(gears.mesh_forces)
    shown = min(count, round(MESH_PERIODS * rate / lowest)) if lowest else count
    time = found.run_in + np.arange(shown) / rate
    yield Section(
        "meshes",
        "Mesh forces",
        (
            "Tension of each mesh spring along its line of action; the dynamic factor is the "
            "largest force over the mean one.",
        ),
        (mesh_figure("meshes", time, gears.mesh_forces[:shown], gears.loads),),
    )
    if gears.mesh_spectrum is not None:
        band = gears.mesh_spectrum.frequency <= highest_shown(found)
        figures = [
            order_figure(
                f"orders{column}",
                gears.mesh_spectrum.frequency[band],
                gears.mesh_spectrum.values[band, column],
                gears.lines[load.name],
                "N",
                load.name,
            )
            for column, load in enumerate(gears.loads)
            if load.name in _first_of_each(gears)
        ]
        yield Section("orders", "Orders of the mesh forces", _phasing_words(gears), tuple(figures))
    for sensor in gears.sensors:
        yield _sensor(sensor, highest_shown(found))


def _first_of_each(gears: GearRun) -> set[str]:
    """One mesh of every kind: the planets' are alike but for their phase."""
    kinds: dict[tuple[str, ...], str] = {}
    for load in gears.loads:
        kind = tuple(word.rstrip("0123456789") for word in load.name.split())
        kinds.setdefault(kind, load.name)
    return set(kinds.values())


def _phasing_words(gears: GearRun) -> tuple[str, ...]:
    words = [
        "Meshes whose stiffness varies or that carry a transmission error excite at their mesh "
        "frequency and its multiples; through torque that one stage passes on, so do other stages."
    ]
    for stage, harmonics in gears.phasing.items():
        told = ", ".join(
            f"{phasing.harmonic}·mesh excites {phasing.excited} modes only" for phasing in harmonics
        )
        words.append(f"Planet phasing of {stage} (from its tooth numbers): {told}.")
    return tuple(words)


def _sensor(sensor: RingSensor, highest: float) -> Section:
    passing = sensor.passing
    band = sensor.spectrum.frequency <= highest
    figure = order_figure(
        f"sensor-{sensor.stage}",
        sensor.spectrum.frequency[band],
        sensor.spectrum.values[band, 0],
        sensor.lines,
        "N",
        f"ring of {sensor.stage}, seen by a fixed sensor",
        theory=Theory(np.asarray(sensor.orders * passing), sensor.expected),
    )
    words = (
        "A sensor fixed to the ring hears each planet as it passes: the ring’s mesh forces, "
        "weighted by how near each planet is. Of the orders of the carrier only those remain in "
        "which the planets do not cancel (McFadden & Smith 1985); theory here is tooth numbers and "
        "the first planet’s mesh force alone.",
        f"Largest difference between run and theory: {sensor.deviation:.2g} of the largest line.",
    )
    return Section(f"sensor-{sensor.stage}", f"Sidebands of {sensor.stage}", words, (figure,))


def _swept(found: Simulation) -> Section | None:
    """Peak-hold of a sine that glides, over FBS' FRF."""
    if not found.estimated or len(found.excitations) != 1:
        return None
    excitation = found.excitations[0]
    signal, record = excitation.signal, found.record
    frf = found.estimated[0].reference
    if not isinstance(signal, Sweep | SteppedSine) or excitation.dof not in frf.responses:
        return None
    during = record.time <= signal.duration
    assert record.displacement is not None
    motion = record.displacement[during, record.labels.index(excitation.dof)]
    held = peak_hold(
        motion,
        signal.amplitude,
        signal.instantaneous_frequency(record.time[during]),
        np.geomspace(*signal.band, HELD_LINES + 1),
    )
    figure = peak_hold_figure(
        "held",
        held.frequency,
        held.magnitude,
        frf.frequency,
        frf.between(excitation.dof, excitation.dof),
        UNIT,
        f"{excitation.dof} ← {excitation.dof}",
    )
    words = (
        "What an operator reads off a sweep: the largest motion while the sine is within a band, "
        "over its force. A sweep that is fast for a resonance does not let it build up: the peak "
        "is lower, and later.",
    )
    return Section("held", "Peak-hold of the sweep", words, (figure,))


def _motion(found: Simulation) -> Section:
    record = found.record
    first = round(found.run_in * record.sampling_frequency)
    assert record.acceleration is not None
    motion = np.asarray(record.acceleration)[first:]
    channels = _loudest(found, motion)
    time = record.time[first:]
    shown = {label: motion[:, record.labels.index(label)] for label in channels}
    rate = record.sampling_frequency
    resolution = rate / len(motion) * max(1.0, len(motion) / (2.0 * SPECTRUM_LINES))
    spectrum = amplitude_spectrum(
        np.stack(list(shown.values()), axis=1), rate, resolution=resolution
    )
    band = (spectrum.frequency > 0.0) & (spectrum.frequency <= highest_shown(found))
    figures = [
        history_figure("history", time, shown, "m/s²"),
        spectrum_figure(
            "spectrum",
            spectrum.frequency[band],
            {label: spectrum.values[band, k] for k, label in enumerate(shown)},
            "m/s²",
        ),
    ]
    if any(excitation.signal.duration is not None for excitation in found.excitations):
        label, values = next(iter(shown.items()))
        gram = spectrogram(values, rate, resolution=highest_shown(found) / SPECTROGRAM_LINES)
        kept = gram.frequency <= highest_shown(found)
        figures.append(
            spectrogram_figure(
                "spectrogram",
                gram.time,
                gram.frequency[kept],
                gram.values[:, kept],
                "m/s²",
                label,
            )
        )
    figures.append(rms_figure("rms", rms_per_body(record.labels, motion), "m/s²"))
    words = (
        "Accelerations of the DoFs that move most, their spectra, and the RMS of every body "
        "(rotations as r·θ).",
    )
    return Section("motion", "Motion", words, tuple(figures))


def highest_shown(found: Simulation) -> float:
    """End of the band that figures show (Hz)."""
    bands = [excitation.signal.band[1] for excitation in found.excitations]
    if found.gears is not None:
        bands += [6.0 * f for f in found.gears.point.mesh_frequencies.values()]
    return min(1.25 * max(bands, default=1000.0), found.record.sampling_frequency / 2.0)


def _loudest(found: Simulation, motion: FloatArray) -> list[str]:
    """Excited DoFs first, then the largest of other bodies."""
    labels = found.record.labels
    chosen = [e.dof for e in found.excitations if e.dof in labels]
    bodies = {label.rpartition(".")[0] for label in chosen}
    for column in np.argsort(-motion.std(axis=0)):
        body = labels[column].rpartition(".")[0]
        if body not in bodies:
            chosen.append(labels[column])
            bodies.add(body)
    return list(dict.fromkeys(chosen))[:DRAWN]

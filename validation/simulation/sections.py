"""Sections of a run's page: what is said, and the figures that show it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fbs.signal.spectra import amplitude_spectrum, spectrogram
from fbs.signal.swept_sine import peak_hold, sweep_error
from mbs_models.gears.gear_response import rms_per_body
from mbs_models.signals.sines import SteppedSine, Sweep

from ..arrays import FloatArray
from ..report.frf_panel import FrfPanel, frf_figure
from ..report.page import (
    Block,
    Picture,
    Section,
)
from ..routes.source import equations_source
from .drive_level import DriveLevels, frf_of
from .estimates import DECIBEL_TOLERANCE, DEGREE_TOLERANCE, EstimatedFrfs, estimator
from .frf_figures import LevelCurve, estimate_panel, level_figure, peak_hold_panel
from .gear_run import LEAST_TURNS, NOTHING_EXCITES, GearRun, RingSensor
from .long_records import thinned, thinned_places
from .order_figures import Theory, order_figure
from .record_figures import (
    history_figure,
    mesh_figure,
    rms_figure,
    spectrogram_figure,
    spectrum_figure,
)
from .result import SimulationResult
from .ringing import ringing

PLAY = (
    "Gears with play that are lightly loaded may have several steady states at one speed, one of "
    "them rattling; which one a run ends in its start decides, here the static equilibrium."
)
DRAWN = 4  # FRFs, or channels of a record
SPECTRUM_LINES = 2000  # of the spectra of a long record, averaged
SPECTROGRAM_LINES = 400
LONGEST_MAP = 1 << 22  # samples of a spectrogram
HISTORY_COLUMNS = 10_000  # of a history that is drawn: far more than it has pixels
MESH_PERIODS = 8  # of mesh forces drawn
HELD_LINES = 120  # of a peak-hold


def sections(result: SimulationResult) -> Iterator[Section]:
    """Everything the page shows beside its verdicts and tables."""
    for number, estimated in enumerate(result.estimated):
        yield _frfs(estimated, number)
    if result.levels is not None:
        yield _levels(result.levels)
    if result.gears is not None:
        yield from _gears(result, result.gears)
    swept = _swept(result)
    if swept is not None:
        yield swept
    yield _motion(result)


def _frfs(estimated: EstimatedFrfs, place: int) -> Section:
    frf, reference = estimated.estimate.frf, estimated.reference
    coherence = estimated.estimate.coherence
    words = [
        f"{len(frf.frequency)} lines by the estimator “{estimator(estimated.estimate)}”"
        + (
            f" over {estimated.estimate.n_averages} averages"
            if estimated.estimate.n_averages > 1
            else ""
        )
        + f"; {estimated.median_difference}."
    ]
    if estimated.estimate.kind == "H1" and coherence is not None:
        words.append(
            f"Coherence: median {np.median(coherence):.4f}, lowest {coherence.min():.2f}. Where it "
            "is low the estimate scatters, and is allowed to."
        )
    panels = (
        estimate_panel(
            f"{frf.responses[i]} ← {frf.excitations[j]}",
            frf.frequency,
            frf.values[:, i, j],
            reference.values[:, i, j],
            estimated.compared[:, i, j],
            (
                estimated.allowed_db[:, i, j],
                estimated.allowed_db[:, i, j] * (DEGREE_TOLERANCE / DECIBEL_TOLERANCE),
            ),
        )
        for i, j in _shown(estimated)
    )
    pictures = (
        Picture(frf_figure(panel, f"frf{place}-{number}", f"FRF {panel.title} in time and by FBS"))
        for number, panel in enumerate(panels)
    )
    title = f"FRFs from {', '.join(frf.excitations)}, against FBS"
    return Section(f"frfs{place}", title, (*words, *pictures))


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
        return Section("levels", "FRF against drive level", (levels.conclusion,))
    at = reference.excitations[0]
    row = reference.responses.index(at) if at in reference.responses else 0
    curves = [
        LevelCurve(
            level.peak_force,
            None if level.estimated is None else level.estimated.estimate.frf.values[:, row, 0],
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
        f"{reference.responses[row]} ← {at}",
        DECIBEL_TOLERANCE,
    )
    words = (
        levels.conclusion,
        "Each curve is the best linear approximation at its level: the multisine’s spectrum ratio "
        "in the last of three periods. A gearbox that is driven harder tilts its lines of action "
        "and lifts its teeth; FBS couples FRFs of small motions about the state it is in.",
    )
    return Section("levels", "FRF against drive level", (*words, Picture(figure)))


def _gears(result: SimulationResult, gears: GearRun) -> Iterator[Section]:
    rate = result.record.sampling_frequency
    point = gears.point
    lowest = min(point.mesh_frequencies.values(), default=0.0)
    count = len(gears.mesh_forces)
    shown = min(count, round(MESH_PERIODS * rate / lowest)) if lowest else count
    time = result.run_in + np.arange(count - shown, count) / rate  # the last: settled
    figure = mesh_figure("meshes", time, gears.mesh_forces[count - shown :], gears.loads)
    yield Section(
        "meshes",
        "Mesh forces",
        (
            *([NOTHING_EXCITES] if gears.says_nothing_excites else []),
            "Force of each mesh along its line of action, positive where the loaded flanks press; "
            "the dynamic factor is the largest force over the mean one.",
            *([PLAY] if any(law.backlash for law in point.laws.values()) else []),
            Picture(figure),
        ),
    )
    if gears.mesh_spectrum is not None:
        band = gears.mesh_spectrum.frequency <= highest_shown(result)
        figures = (
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
        )
        blocks: tuple[Block, ...] = (*_phasing_words(gears), *map(Picture, figures))
        yield Section("orders", "Orders of the mesh forces", blocks)
    for sensor in gears.sensors:
        yield _sensor(sensor, highest_shown(result))


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
        excited = ", ".join(
            f"{phasing.harmonic}·mesh excites {phasing.excited} modes only" for phasing in harmonics
        )
        words.append(f"Planet phasing of {stage} (from its tooth numbers): {excited}.")
        if stage not in [sensor.stage for sensor in gears.sensors]:
            words.append(
                f"Sidebands of {stage} are not shown: its carrier turns less than {LEAST_TURNS:g} "
                "times in what is measured, too few to tell them apart; run longer."
            )
    return tuple(words)


def _sensor(sensor: RingSensor, highest: float) -> Section:
    band = sensor.spectrum.frequency <= highest
    figure = order_figure(
        f"sensor-{sensor.stage}",
        sensor.spectrum.frequency[band],
        sensor.spectrum.values[band, 0],
        sensor.lines,
        "N",
        f"ring of {sensor.stage}, seen by a fixed sensor",
        theory=Theory(sensor.frequency, sensor.expected),
    )
    words = (
        "A sensor fixed to the ring hears each planet as it passes: the ring’s mesh forces, "
        "weighted by how near each planet is. Of the orders of the carrier only those remain in "
        "which the planets do not cancel (McFadden & Smith 1985); theory here is tooth numbers and "
        "the first planet’s mesh force alone.",
        sensor.sentence,
    )
    blocks = (*words, Picture(figure))
    return Section(f"sensor-{sensor.stage}", f"Sidebands of {sensor.stage}", blocks)


def _swept(result: SimulationResult) -> Section | None:
    """Peak-hold of a sine that glides, over FBS' FRF."""
    panel = swept_panel(result)
    if panel is None:
        return None
    words = (
        "What an operator reads off a sweep: the largest acceleration while the sine is within a "
        "band, over its force and ω². A sweep that is fast for a resonance does not let it build "
        "up: the peak is lower, and later, and what rings on hides antiresonances."
    )
    figure = frf_figure(panel, "held", f"Peak-hold of a sweep over the FRF {panel.title}")
    return Section("held", "Peak-hold of the sweep", (words, Picture(figure)))


def swept_panel(result: SimulationResult) -> FrfPanel | None:
    """The same as a figure's data; None where nothing glides, or no FRF is known."""
    if not result.estimated or len(result.excitations) != 1:
        return None
    excitation = result.excitations[0]
    signal, record = excitation.signal, result.record
    frf = result.estimated[0].reference
    if not isinstance(signal, Sweep | SteppedSine) or excitation.dof not in frf.responses:
        return None
    assert record.acceleration is not None
    time = record.time
    # 0 Hz, in no band, after the sweep: what rings on then lets the record end at rest.
    swept = np.zeros_like(time)
    during = time <= signal.duration
    swept[during] = signal.instantaneous_frequency(time[during])
    held = peak_hold(
        record.acceleration[:, record.labels.index(excitation.dof)],
        signal.amplitude,
        swept,
        _held_bands(signal, swept[during]),
    )
    driving = frf.between(excitation.dof, excitation.dof)
    return peak_hold_panel(
        f"{excitation.dof} ← {excitation.dof}",
        frf.frequency,
        driving,
        held.frequency,
        held.magnitude / (2.0 * np.pi * held.frequency) ** 2,
        _swept_peaks(result, signal, frf.frequency, np.abs(driving)),
    )


def _held_bands(signal: Sweep | SteppedSine, swept: FloatArray) -> FloatArray:
    """Edges of the bands in which a peak is held: of each sine, or evenly over log f."""
    if isinstance(signal, SteppedSine):
        edges = np.unique(swept)
        return np.append(edges, edges[-1] * 1.001)
    edges = np.geomspace(*signal.band, HELD_LINES + 1)
    passed = np.histogram(swept, edges)[0] > 0  # a fast sweep jumps over the narrowest
    return np.asarray(edges[np.append(True, passed)])


def _swept_peaks(
    result: SimulationResult, signal: Sweep | SteppedSine, frequency: FloatArray, size: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Where the sweep's rate should leave the peaks of |H| that stand alone, and how high."""
    if not isinstance(signal, Sweep):
        return None
    inner = size[1:-1]
    peaks = frequency[1:-1][(inner > size[:-2]) & (inner > size[2:])]
    first, last = signal.band
    places = []
    for mode in equations_source(result.drivetrain).modes.modes:
        f, ratio = mode.frequency_hz, mode.damping_ratio
        if not (first < f < last and 0.0 < ratio < 0.1 and (np.abs(peaks - f) < ratio * f).any()):
            continue
        rate = f * np.log(last / first) if signal.logarithmic else last - first
        late = sweep_error(f, ratio, (-1.0 if signal.down else 1.0) * rate / signal.duration)
        places.append((f + late.shift, np.interp(f, frequency, size) * (1.0 - late.attenuation)))
    if not places:
        return None
    at, height = np.array(places).T
    return at, height


def _motion(result: SimulationResult) -> Section:
    record = result.record
    first = round(result.run_in * record.sampling_frequency)
    assert record.acceleration is not None
    motion = np.asarray(record.acceleration)[first:]
    rms = _without(rms_per_body(record.labels, motion), ringing(record))
    shown = {label: motion[:, record.labels.index(label)] for label in _loudest(result, rms)}
    rate = record.sampling_frequency
    resolution = rate / min(len(motion), 2 * SPECTRUM_LINES)
    spectra = {
        label: amplitude_spectrum(values, rate, resolution=resolution)
        for label, values in shown.items()
    }
    frequency = next(iter(spectra.values())).frequency
    band = (frequency > 0.0) & (frequency <= highest_shown(result))
    places = thinned_places(len(motion), HISTORY_COLUMNS)
    figures = [
        history_figure(
            "history",
            (first + places) / rate,
            {label: thinned(values, HISTORY_COLUMNS) for label, values in shown.items()},
            "m/s²",
        ),
        spectrum_figure(
            "spectrum",
            frequency[band],
            {label: spectrum.values[band] for label, spectrum in spectra.items()},
            "m/s²",
        ),
    ]
    words = [
        "Accelerations of the DoFs that move most, their spectra, and the RMS of every body "
        "(rotations as r·θ)."
    ]
    if any(excitation.signal.duration is not None for excitation in result.excitations):
        label, values = next(iter(shown.items()))
        if len(values) > LONGEST_MAP:
            words.append(f"The spectrogram is of the first {LONGEST_MAP / rate:.3g} s.")
            values = values[:LONGEST_MAP]
        finest = highest_shown(result) / SPECTROGRAM_LINES
        gram = spectrogram(values, rate, resolution=max(finest, rate / len(values)))
        kept = gram.frequency <= highest_shown(result)
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
    figures.append(rms_figure("rms", rms, "m/s²"))
    return Section("motion", "Motion", (*words, *map(Picture, figures)))


def _without(
    rms: Mapping[str, Mapping[str, float]], labels: Sequence[str]
) -> dict[str, dict[str, float]]:
    """The RMS of bodies without some DoFs, and without bodies that have no others."""
    kept = {
        body: {dof: value for dof, value in dofs.items() if f"{body}.{dof}" not in labels}
        for body, dofs in rms.items()
    }
    return {body: dofs for body, dofs in kept.items() if dofs} or {
        body: dict(dofs) for body, dofs in rms.items()
    }


def highest_shown(result: SimulationResult) -> float:
    """End of the band that figures show (Hz)."""
    bands = [excitation.signal.band[1] for excitation in result.excitations]
    if result.gears is not None:
        bands += [6.0 * f for f in result.gears.point.mesh_frequencies.values()]
    return min(1.25 * max(bands, default=1000.0), result.record.sampling_frequency / 2.0)


def _loudest(result: SimulationResult, rms: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Excited DoFs first, then the largest of other bodies."""
    labels = result.record.labels
    chosen = [e.dof for e in result.excitations if e.dof in labels]
    bodies = {label.rpartition(".")[0] for label in chosen}
    others = [
        (max(dofs.values()), f"{body}.{max(dofs, key=lambda dof: dofs[dof])}")
        for body, dofs in rms.items()
        if body not in bodies
    ]
    chosen += [label for _, label in sorted(others, key=lambda pair: -pair[0])]
    return list(dict.fromkeys(chosen))[:DRAWN]

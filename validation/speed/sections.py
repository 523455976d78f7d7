"""The report of a speed study, section by section: what is said, tables, figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..report.digits import engineering
from .figures import (
    LineMap,
    Mark,
    Shades,
    curves_figure,
    growth_figure,
    order_map_figure,
    waterfall_figure,
    witness_figure,
)
from .findings import family_heights
from .lines import line_names
from .steady import Speeds
from .study import SpeedResult
from .witness import Witness
from .words import margin_in_words, peak_energy, peak_mode, unstable_in_words

FloatArray = NDArray[np.float64]

DRAWN_MAPS, DRAWN_VIBRATIONS = 6, 3  # order maps of meshes, and of accelerations
DRAWN_CHANNELS = 3  # of a witness, of forces and of accelerations
LISTED_MARGINS = 12
# Of the largest force or acceleration: less is the round-off of what symmetry keeps still.
NOTHING = 1e-9
STILL = ("–", "–", "kept still by symmetry", "–")
NAMED = 4  # peaks named beside a natural frequency


@dataclass(frozen=True)
class Table:
    """A table: headings and rows of texts; columns of numbers stand to the right."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Section:
    """A heading, paragraphs below it, tables, and figures (SVG)."""

    anchor: str
    title: str
    words: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[str, ...] = ()


def sections(result: SpeedResult) -> tuple[Section, ...]:
    """Everything the report shows beside its verdicts."""
    return tuple(_sections(result))


def _sections(result: SpeedResult) -> Iterator[Section]:
    found = result.found
    if found is None:
        yield _static(result)
    else:
        yield _forces(result, found)
        yield _lines(result, found)
        yield _stability(result, found)
        yield _bearings(result, found)
        yield _accelerations(result, found)
        for number, witness in enumerate(result.witnesses):
            yield _witness(witness, number)
    if result.margins:
        yield _margins(result)


def _static(result: SpeedResult) -> Section:
    turning = result.turning
    rows = tuple(
        (name, engineering(force, "N", 4))
        for name, force in zip(turning.meshes, turning.static_forces, strict=True)
    )
    words = (
        "Nothing excites: every mesh force is constant, and every dynamic factor 1.000, at any "
        "speed.",
    )
    table = Table(("Mesh", "Static force"), rows, frozenset({1}))
    return Section("forces", "Mesh forces", words, (table,))


def shades(result: SpeedResult) -> Shades:
    """What is shaded behind curves over the speed."""
    return Shades(
        tuple(unstable.range for unstable in result.unstable),
        tuple(reach for parting in result.partings for reach in parting.ranges),
    )


def _forces(result: SpeedResult, found: Speeds) -> Section:
    turning = result.turning
    heights = family_heights(turning, found)
    loaded = bool(np.any(turning.static_forces > 0.0))
    marks = [
        Mark(number, peak.speed_rpm, peak.height)
        for number, peak in enumerate(result.peaks, start=1)
    ]
    figure = curves_figure(
        "factors", "Dynamic factor", found.rpm, heights,
        "Dynamic factor max F / static F" if loaded else "Largest vibrating force",
        unit="" if loaded else "N", marks=marks, shades=shades(result),
        floor_at=1.0 if loaded else 0.0,
    )  # fmt: skip
    words = (
        "Largest mesh force in the steady state over its static force, of the family’s most "
        "loaded mesh. Numbers are those of the table of resonances.",
        "Stages whose mesh frequencies share no period come to stand to each other in every way: "
        "the largest force is that of the worst."
        if turning.lines.n_phases > 1
        else "The largest force is that over the meshes’ common period.",
    )
    return Section(
        "forces",
        "Mesh forces over speed",
        words,
        (_resonances(result), _families(result, found)),
        (figure,),
    )


def _resonances(result: SpeedResult) -> Table:
    names = line_names(result.turning)
    loaded = bool(np.any(result.turning.static_forces > 0.0))
    rows = tuple(
        (
            str(number),
            f"{peak.speed_rpm:.5g}",
            peak.family,
            f"{names[peak.line]} ({peak.order:.5g})",
            f"{peak.frequency_hz:.5g}",
            peak_mode(result, peak),
            peak_energy(result, peak),
            f"{peak.height:.3f}" if loaded else "–",
            engineering(peak.swing, "N"),
        )
        for number, peak in enumerate(result.peaks, start=1)
    )
    headings = (
        "#", "Speed, rpm", "Felt most by", "Harmonic (order)", "Frequency, Hz", "Mode",
        "Its strain energy", "Dynamic factor", "Above mean",
    )  # fmt: skip
    return Table(headings, rows, frozenset({0, 1, 4, 7, 8}))


def _families(result: SpeedResult, found: Speeds) -> Table:
    turning, static = result.turning, result.turning.static_forces
    heights = family_heights(turning, found)
    loaded = bool(np.any(static > 0.0))
    rows = []
    for family in turning.families:
        columns = list(family.columns)
        most = int(np.nanargmax(np.nan_to_num(heights[family.name])))
        mean = found.mesh[:, 0, columns].real
        rows.append(
            (
                family.name,
                engineering(float(static[columns].max()), "N", 4),
                engineering(float(np.nanmax(found.mesh_max[:, columns])), "N", 4),
                engineering(float(np.nanmin(found.mesh_min[:, columns])), "N", 4),
                engineering(float(np.nanmax(found.mesh_rms[:, columns])), "N"),
                f"{heights[family.name][most]:.3f}" if loaded else "–",
                f"{found.rpm[most]:.5g}",
                _drift(mean, static[columns]),
            )
        )
    headings = (
        "Meshes", "Static", "Largest", "Smallest", "RMS about mean", "Dynamic factor",
        "at, rpm", "Mean off static by",
    )  # fmt: skip
    return Table(headings, tuple(rows), frozenset(range(1, 8)))


def _drift(mean: FloatArray, static: FloatArray) -> str:
    if not np.any(static):
        return "–"
    share = 100.0 * float(np.nanmax(np.abs(mean - static)) / np.abs(static).max())
    return f"{share:.2g} %" if share >= 1e-3 else "< 0.001 %"


def mesh_maps(result: SpeedResult) -> tuple[LineMap, ...]:
    """Amplitudes of every line by family: its largest mesh's."""
    found, turning = result.found, result.turning
    assert found is not None
    names = line_names(turning)
    return tuple(
        LineMap(
            family.name,
            turning.lines.orders[1:],
            names[1:],
            np.abs(found.mesh[:, 1:, list(family.columns)]).max(axis=2),
            "N",
        )
        for family in turning.families
    )


def _lines(result: SpeedResult, found: Speeds) -> Section:
    maps = mesh_maps(result)
    modes: dict[float, list[str]] = {}
    for number, peak in enumerate(result.peaks, start=1):
        frequency = result.modes.modes[peak.mode].frequency_hz
        modes.setdefault(frequency, []).append(str(number))
    named = {
        frequency: ", ".join(numbers[:NAMED]) + (" …" if len(numbers) > NAMED else "")
        for frequency, numbers in modes.items()
    }
    drawn = [shown for shown in maps if np.nanmax(shown.amplitude) > 0.0]
    figures = [waterfall_figure("waterfall", found.rpm, drawn[:DRAWN_MAPS], named)]
    figures += [
        order_map_figure(
            f"orders{number}", found.rpm, replace(shown, title=f"{shown.title}: orders")
        )
        for number, shown in enumerate(drawn[:DRAWN_MAPS])
    ]
    words = (
        "Mesh force line by line: the largest of the family’s meshes. Each ray is one order; "
        "dashed are the natural frequencies of the modes of the numbered resonances.",
        "Below, the loudest orders as rows (in brackets: periods per turn of the input).",
    )
    return Section("orders", "Mesh forces by order", words, (), tuple(figures))


def _stability(result: SpeedResult, found: Speeds) -> Section:
    if not np.isfinite(found.growth).any():
        return Section(
            "stability", "Stability", ("No mesh stiffness varies: nothing can become unstable.",)
        )
    words = [
        "Growth rate of the fastest growing free motion by Floquet theory: above 0 the steady "
        "state is left, until geometry or parting teeth end the growth."
    ]
    if result.turning.lines.n_phases > 1:
        words.append(
            "Stages without a common period are asked one by one, the others’ meshes at their "
            "mean: instability by combinations of two stages’ meshes is not looked for."
        )
    words += [f"Unstable: {unstable_in_words(unstable)}." for unstable in result.unstable]
    if not result.unstable:
        words.append("Stable at every speed.")
    figure = growth_figure("growth", found.rpm, found.growth, shades(result))
    return Section("stability", "Stability", tuple(words), (), (figure,))


def _bearings(result: SpeedResult, found: Speeds) -> Section:
    bearings = result.turning.bearings
    groups: dict[str, list[int]] = {}
    for number, bearing in enumerate(bearings):
        groups.setdefault(_family_of(bearing.name), []).append(number)
    curves = {name: found.bearing_peak[:, own].max(axis=1) for name, own in groups.items()}
    names = line_names(result.turning)
    rows = []
    for name, own in groups.items():
        at, which = np.unravel_index(
            int(np.nanargmax(np.nan_to_num(found.bearing_peak[:, own]))), (len(found.rpm), len(own))
        )
        if found.bearing_peak[at, own[which]] <= NOTHING * np.nanmax(found.bearing_peak):
            rows.append((name, *STILL))
            continue
        amplitudes = found.bearing[at, 1:, own[which]]
        line = int(np.argmax(amplitudes)) + 1
        rows.append(
            (
                name,
                engineering(float(found.bearing_peak[at, own[which]]), "N"),
                f"{found.rpm[at]:.5g}",
                f"{names[line]} ({result.turning.lines.orders[line]:.5g})",
                engineering(float(amplitudes[line - 1]), "N"),
            )
        )
    words = (
        "Longest vibrating force of every bearing that exudyn was given, spring and damper, "
        "without the static force; planets’ bearings share a curve.",
    )
    headings = ("Bearing", "Largest", "at, rpm", "Loudest line there (order)", "Its amplitude")
    figure = curves_figure(
        "bearings", "Bearing forces", found.rpm, curves, "Vibrating force", unit="N",
        shades=shades(result), floor_at=0.0,
    )  # fmt: skip
    table = Table(headings, tuple(rows), frozenset({1, 2, 4}))
    return Section("bearings", "Bearing forces", words, (table,), (figure,) if curves else ())


def _family_of(body: str) -> str:
    """``planetary.planets`` of planets; other bodies stand alone."""
    bare = body.rstrip("0123456789")
    return f"{bare}s" if bare != body and bare.endswith("planet") else body


def _accelerations(result: SpeedResult, found: Speeds) -> Section:
    dofs = result.turning.parts.dofs
    names = line_names(result.turning)
    columns = [_column(result, label) for label in result.responses]
    loudest_anywhere = np.nanmax(np.abs(found.acceleration[:, 1:]))
    curves, maps, rows = {}, [], []
    for label, (column, factor) in zip(result.responses, columns, strict=True):
        lines = np.abs(factor) * np.abs(found.acceleration[:, 1:, column])
        level = np.sqrt(0.5 * np.sum(lines**2, axis=1))
        curves[label] = level
        maps.append(LineMap(label, result.turning.lines.orders[1:], names[1:], lines, "m/s²"))
        at = int(np.nanargmax(np.nan_to_num(level)))
        if level[at] <= NOTHING * loudest_anywhere:
            rows.append((label, *STILL))
            continue
        line = int(np.argmax(lines[at]))
        rows.append(
            (
                label,
                _plain(float(level[at]), "m/s²"),
                f"{found.rpm[at]:.5g}",
                f"{names[line + 1]} ({result.turning.lines.orders[line + 1]:.5g})",
                _plain(float(lines[at, line]), "m/s²"),
            )
        )
    words = (f"Of {len(dofs)} DoFs; rotations w = r·θ at their radius. RMS of all lines.",)
    headings = ("DoF", "Largest RMS", "at, rpm", "Loudest line there (order)", "Its amplitude")
    figures = [
        curves_figure(
            "accelerations", "Acceleration", found.rpm, curves, "RMS acceleration (m/s²)",
            shades=shades(result), floor_at=0.0,
        )
    ]  # fmt: skip
    loudest = sorted(maps, key=lambda shown: -float(np.nanmax(shown.amplitude)))
    figures += [
        order_map_figure(
            f"vibration{number}", found.rpm, replace(shown, title=f"{shown.title}: orders")
        )
        for number, shown in enumerate(loudest[:DRAWN_VIBRATIONS])
        if np.nanmax(shown.amplitude) > 0.0
    ]
    table = Table(headings, tuple(rows), frozenset({1, 2, 4}))
    return Section("accelerations", "Accelerations", words, (table,), tuple(figures))


def _plain(value: float, unit: str) -> str:
    """Three digits without a prefix: nobody says km/s²."""
    return f"{float(f'{value:.3g}'):,.10g} {unit}".replace(",", "\u202f")


def _column(result: SpeedResult, label: str) -> tuple[int, float]:
    """Which DoF a label is, and by what factor."""
    system = result.turning.periodic.system
    leader, factor = system.derived.get(label, (label, 1.0))
    return system.dofs.index(leader), factor


def _witness(found: Witness, number: int) -> Section:
    n = len(found.meshes)
    figures = []
    for first, last, unit in ((0, n, "N"), (n, len(found.channels), "m/s²")):
        size = np.where(found.judged, np.abs(found.balance), 0.0)[:, first:last]
        loudest = np.argsort(-size.max(axis=0))[:DRAWN_CHANNELS] + first
        channels = {
            found.channels[c]: (
                np.where(found.judged[:, c], np.abs(found.balance[:, c]), np.nan),
                np.where(found.judged[:, c], np.abs(found.time[:, c]), np.nan),
            )
            for c in loudest
            if found.judged[:, c].any()
        }
        if channels:
            figures.append(
                witness_figure(f"witness{number}-{unit[0]}", found.frequency, channels, unit)
            )
    words = (
        "exudyn’s time integration (trapezoidal rule, step "
        f"{engineering(found.integrator.step, 's')}; the balance it is held against has the same "
        "bend of frequencies), started in the steady state; "
        f"{found.run_in:.3g} s of run-in, {found.measured:.3g} s measured, lines fitted by least "
        "squares at their known frequencies. Nothing of the harmonic balance is in the run but "
        "where it starts.",
    )
    return Section(
        f"witness{number}", f"exudyn in time at {found.speed_rpm:g} rpm", words, (), tuple(figures)
    )


def _margins(result: SpeedResult) -> Section:
    operation = result.turning.plan.drivetrain.operation
    assert operation is not None
    rows = tuple(
        (
            margin.order.label(margin.harmonic),
            f"{margin.order_hz:.5g}",
            f"{margin.mode_hz:.5g}",
            f"{margin.kind}" + (f" (×{margin.repeated})" if margin.repeated > 1 else ""),
            f"{100.0 * margin.change:+.2g} %".replace("-", "−"),
            f"{100.0 * margin.share:.2g} %",
        )
        for margin in result.margins[:LISTED_MARGINS]
    )
    words = (
        f"At {operation.speed:g} rpm, the nearest natural frequency each order reaches (planet "
        "phasing taken into account), the closest first. Margin: by how much the speed must "
        "change to meet it. " + margin_in_words(result.margins[0]).capitalize() + ".",
    )
    headings = ("Order", "Its frequency, Hz", "Mode, Hz", "Kind", "Margin", "Energy reached")
    table = Table(headings, rows, frozenset({1, 2, 4, 5}))
    return Section("margins", "Resonances near the operating speed", words, (table,))

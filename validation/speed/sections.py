"""The page of a speed study: head, sections, figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from markupsafe import Markup

from mbs_models.model.model_file import dumps

from ..report.digits import engineering, grouped
from ..report.page import (
    Block,
    Bullets,
    Fact,
    Page,
    Picture,
    Section,
    Table,
    Verdict,
    Verdicts,
    model_section,
    source_of,
)
from .describe import conclusions, describe_margin, describe_unstable, verdict
from .figures import (
    LineMap,
    Mark,
    Shades,
    curves_figure,
    growth_figure,
    order_map_figure,
    reference_figure,
    waterfall_figure,
)
from .findings import family_heights
from .lines import line_names
from .result import ARRAYS, SpeedResult
from .steady import SteadyStates
from .tables import family_table, margin_table, resonance_table, static_table
from .time_reference import TimeReference

DRAWN_MAPS, DRAWN_VIBRATIONS = 6, 3  # order maps of meshes, and of accelerations
DRAWN_CHANNELS = 3  # of a reference in time, of forces and of accelerations
# Of the largest force or acceleration: less is the round-off of what symmetry keeps still.
NOTHING = 1e-9
STILL = ("–", "–", "kept still by symmetry", "–")
NAMED = 4  # peaks named beside a natural frequency
NOTHING_EXCITES = (
    "Nothing excites: every mesh force is constant, and every dynamic factor 1.000, at any speed."
)
NOT_ASKED = Markup(
    "exudyn in time was not asked: <code>--check 600,1500</code> integrates at these speeds and "
    "compares every order."
)
METHOD = (
    "The drivetrain is linear about its loaded state and vibrates about the mean rotation: no "
    "gyroscopic or centrifugal terms.",
    "Mesh stiffness and transmission error vary with the phase that tooth numbers give every mesh; "
    "steady states are those of a harmonic balance over all lines at once.",
)


def speed_page(result: SpeedResult) -> Page:
    """What speed.html says."""
    turning, plan = result.turning, result.turning.plan
    drivetrain = plan.drivetrain
    agrees = result.agrees if result.compared_in_time or not result.agrees else None
    arrays = "" if result.states is None else f", every line at every speed in {ARRAYS}"
    return Page(
        eyebrow="Drivetrain cross-check · over the speed range",
        heading=drivetrain.name,
        title="over the speed range",
        source=source_of(drivetrain.source),
        verdict=Verdict(verdict(result), agrees),
        conclusions=conclusions(result),
        warnings=result.warnings,
        facts=(
            Fact(
                f"Speeds of {plan.input}",
                f"{plan.speeds[0]:.5g}–{plan.speeds[-1]:.5g} rpm",
                _speeds_computed(result),
            ),
            Fact("Torque at the input", engineering(plan.torque, "N m", 4), _taken(result)),
            *_lines_fact(result),
            Fact(
                "DoFs",
                str(len(turning.parts.dofs)),
                f"{len(turning.meshes)} meshes, {len(turning.bearings)} bearings",
            ),
        ),
        sections=(*_sections(result), _checks(result), model_section(dumps(drivetrain))),
        timings=result.seconds,
        footer=f"findings and curves are in speed.json{arrays} beside it",
    )


def _speeds_computed(result: SpeedResult) -> str:
    speeds, states = result.turning.plan.speeds, result.states
    words = f"{grouped(len(speeds))} speeds"
    if states is not None and len(states.rpm) > len(speeds):
        words += f" and {len(states.rpm) - len(speeds)} at narrow resonances"
    seconds = result.seconds.get("steady states")
    return words if seconds is None else f"{words}, in {seconds:.1f} s"


def _taken(result: SpeedResult) -> str:
    output = result.turning.point.output
    return f"taken by {output}" if output else ""


def _lines_fact(result: SpeedResult) -> tuple[Fact, ...]:
    shown = result.turning.lattice
    if shown is None:
        return ()
    more = ", and combinations" if shown.n_phases > 1 else ""
    words = f"{result.turning.plan.harmonics} harmonics of each mesh{more}"
    return (Fact("Lines", str(len(shown.points) - 1), words),)


def _sections(result: SpeedResult) -> Iterator[Section]:
    states = result.states
    if states is None:
        yield Section("forces", "Mesh forces", (NOTHING_EXCITES, static_table(result)))
    else:
        yield _forces(result, states)
        yield _lines(result, states)
        yield _stability(result, states)
        yield _bearings(result, states)
        yield _accelerations(result, states)
        for number, reference in enumerate(result.references):
            yield _in_time(reference, number)
    if result.margins:
        yield _margins(result)


def _checks(result: SpeedResult) -> Section:
    blocks: list[Block] = [
        Verdicts(result.checks) if result.checks else "Nothing to check: nothing vibrates."
    ]
    if result.checks and not result.references:
        blocks.append(NOT_ASKED)
    return Section("checks", "Checks", (*blocks, Bullets(METHOD)))


def shades(result: SpeedResult) -> Shades:
    """What is shaded behind curves over the speed."""
    return Shades(
        tuple(unstable.range for unstable in result.unstable),
        tuple(reach for parting in result.partings for reach in parting.ranges),
    )


def _forces(result: SpeedResult, states: SteadyStates) -> Section:
    turning = result.turning
    heights = family_heights(turning, states)
    loaded = bool(np.any(turning.static_forces > 0.0))
    marks = [
        Mark(number, peak.speed_rpm, peak.height)
        for number, peak in enumerate(result.peaks, start=1)
    ]
    figure = curves_figure(
        "factors", "Dynamic factor", states.rpm, heights,
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
    tables = resonance_table(result), family_table(result, states)
    return Section("forces", "Mesh forces over speed", (*words, Picture(figure), *tables))


def mesh_maps(result: SpeedResult) -> tuple[LineMap, ...]:
    """Amplitudes of every line by family: its largest mesh's."""
    states, turning = result.states, result.turning
    assert states is not None
    names = line_names(turning)
    return tuple(
        LineMap(
            family.name,
            turning.lines.orders[1:],
            names[1:],
            np.abs(states.mesh[:, 1:, list(family.columns)]).max(axis=2),
            "N",
        )
        for family in turning.families
    )


def _lines(result: SpeedResult, states: SteadyStates) -> Section:
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
    figures = [waterfall_figure("waterfall", states.rpm, drawn[:DRAWN_MAPS], named)]
    figures += [
        order_map_figure(
            f"orders{number}", states.rpm, replace(shown, title=f"{shown.title}: orders")
        )
        for number, shown in enumerate(drawn[:DRAWN_MAPS])
    ]
    words = (
        "Mesh force line by line: the largest of the family’s meshes. Each ray is one order; "
        "dashed are the natural frequencies of the modes of the numbered resonances.",
        "Below, the loudest orders as rows (in brackets: periods per turn of the input).",
    )
    return Section("orders", "Mesh forces by order", (*words, *map(Picture, figures)))


def _stability(result: SpeedResult, states: SteadyStates) -> Section:
    if not np.isfinite(states.growth).any():
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
    words += [f"Unstable: {describe_unstable(unstable)}." for unstable in result.unstable]
    if not result.unstable:
        words.append("Stable at every speed.")
    figure = growth_figure("growth", states.rpm, states.growth, shades(result))
    return Section("stability", "Stability", (*words, Picture(figure)))


def _bearings(result: SpeedResult, states: SteadyStates) -> Section:
    bearings = result.turning.bearings
    groups: dict[str, list[int]] = {}
    for number, bearing in enumerate(bearings):
        groups.setdefault(_family_of(bearing.name), []).append(number)
    curves = {name: states.bearing_peak[:, own].max(axis=1) for name, own in groups.items()}
    names = line_names(result.turning)
    rows = []
    for name, own in groups.items():
        at, which = np.unravel_index(
            int(np.nanargmax(np.nan_to_num(states.bearing_peak[:, own]))),
            (len(states.rpm), len(own)),
        )
        if states.bearing_peak[at, own[which]] <= NOTHING * np.nanmax(states.bearing_peak):
            rows.append((name, *STILL))
            continue
        amplitudes = states.bearing[at, 1:, own[which]]
        line = int(np.argmax(amplitudes)) + 1
        rows.append(
            (
                name,
                engineering(float(states.bearing_peak[at, own[which]]), "N"),
                f"{states.rpm[at]:.5g}",
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
        "bearings", "Bearing forces", states.rpm, curves, "Vibrating force", unit="N",
        shades=shades(result), floor_at=0.0,
    )  # fmt: skip
    table = Table(headings, tuple(rows), frozenset({1, 2, 4}))
    pictures = (Picture(figure),) if curves else ()
    return Section("bearings", "Bearing forces", (*words, *pictures, table))


def _family_of(body: str) -> str:
    """``planetary.planets`` of planets; other bodies stand alone."""
    bare = body.rstrip("0123456789")
    return f"{bare}s" if bare != body and bare.endswith("planet") else body


def _accelerations(result: SpeedResult, states: SteadyStates) -> Section:
    dofs = result.turning.parts.dofs
    names = line_names(result.turning)
    columns = [_column(result, label) for label in result.responses]
    loudest_anywhere = np.nanmax(np.abs(states.acceleration[:, 1:]))
    curves, maps, rows = {}, [], []
    for label, (column, factor) in zip(result.responses, columns, strict=True):
        lines = np.abs(factor) * np.abs(states.acceleration[:, 1:, column])
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
                f"{states.rpm[at]:.5g}",
                f"{names[line + 1]} ({result.turning.lines.orders[line + 1]:.5g})",
                _plain(float(lines[at, line]), "m/s²"),
            )
        )
    words = (f"Of {len(dofs)} DoFs; rotations w = r·θ at their radius. RMS of all lines.",)
    headings = ("DoF", "Largest RMS", "at, rpm", "Loudest line there (order)", "Its amplitude")
    figures = [
        curves_figure(
            "accelerations", "Acceleration", states.rpm, curves, "RMS acceleration (m/s²)",
            shades=shades(result), floor_at=0.0,
        )
    ]  # fmt: skip
    loudest = sorted(maps, key=lambda shown: -float(np.nanmax(shown.amplitude)))
    figures += [
        order_map_figure(
            f"vibration{number}", states.rpm, replace(shown, title=f"{shown.title}: orders")
        )
        for number, shown in enumerate(loudest[:DRAWN_VIBRATIONS])
        if np.nanmax(shown.amplitude) > 0.0
    ]
    table = Table(headings, tuple(rows), frozenset({1, 2, 4}))
    first, *maps_drawn = map(Picture, figures)
    return Section("accelerations", "Accelerations", (*words, first, table, *maps_drawn))


def _plain(value: float, unit: str) -> str:
    """Three digits without a prefix: nobody says km/s²."""
    return f"{float(f'{value:.3g}'):,.10g} {unit}".replace(",", "\u202f")


def _column(result: SpeedResult, label: str) -> tuple[int, float]:
    """Which DoF a label is, and by what factor."""
    system = result.turning.periodic.system
    leader, factor = system.derived.get(label, (label, 1.0))
    return system.dofs.index(leader), factor


def _in_time(reference: TimeReference, number: int) -> Section:
    n = len(reference.meshes)
    figures = []
    for first, last, unit in ((0, n, "N"), (n, len(reference.channels), "m/s²")):
        size = np.where(reference.comparable, np.abs(reference.balance), 0.0)[:, first:last]
        loudest = np.argsort(-size.max(axis=0))[:DRAWN_CHANNELS] + first
        channels = {
            reference.channels[c]: (
                np.where(reference.comparable[:, c], np.abs(reference.balance[:, c]), np.nan),
                np.where(reference.comparable[:, c], np.abs(reference.time[:, c]), np.nan),
            )
            for c in loudest
            if reference.comparable[:, c].any()
        }
        if channels:
            figures.append(
                reference_figure(f"witness{number}-{unit[0]}", reference.frequency, channels, unit)
            )
    words = (
        "exudyn’s time integration (trapezoidal rule, step "
        f"{engineering(reference.integrator.step, 's')}; the balance it is held against has the "
        "same bend of frequencies), started in the steady state; "
        f"{reference.run_in:.3g} s of run-in, {reference.measured:.3g} s measured, lines fitted "
        "by least squares at their known frequencies. Nothing of the harmonic balance is in the "
        "run but where it starts.",
    )
    title = f"exudyn in time at {reference.speed_rpm:g} rpm"
    return Section(f"witness{number}", title, (*words, *map(Picture, figures)))


def _margins(result: SpeedResult) -> Section:
    operation = result.turning.plan.drivetrain.operation
    assert operation is not None
    words = (
        f"At {operation.speed:g} rpm, the nearest natural frequency each order reaches (planet "
        "phasing taken into account), the closest first. Margin: by how much the speed must "
        f"change to meet it. The closest: {describe_margin(result.margins[0])}."
    )
    blocks = (words, margin_table(result))
    return Section("margins", "Resonances near the operating speed", blocks)

"""The coupling method: coupled against full system, and what depends on k_sw (Secs. 4.1, 4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fbs import RealModes
from mbs_models.modal.mode_kinds import Kind

from ..arrays import ComplexArray, FloatArray
from ..checks.check import Check
from ..checks.frfs import FRF_REASON, FRF_TOLERANCE
from ..checks.metrics import scaled_error
from ..checks.poles import filtered_poles
from ..report.digits import scientific
from ..report.page import Note, Table
from .bench import ZERO, Bench, RouteName, at_shaft, couple_points, difference, scale
from .figures import WIDE, WIDE_NOT_STATED, Drawing, relative_size, routes_error
from .item import DofName, Finding, Verdict, statement
from .printed_values import NUMBERED_AS_SECOND_PLANET, PRINTED_TO_HZ, SHAFT_STIFFNESSES
from .resonances import mode_kinds, repeated

SAME = 1e-9
"""Natural frequencies this close (relative) are one: round-off leaves a thousandth of it."""

POLE_TOLERANCE = 1e-8
"""Poles read off coupled FRFs, relative; what a table printed to 1 Hz could show is 1e-4."""


def worst_over_all(bench: Bench, shaft: float) -> float:
    """Largest scaled error of the coupled FRFs, all against all, over the band of Fig. 8."""
    from ..routes import multibody  # exudyn takes its time to load

    model = bench.exudyn(shaft)
    lines = bench.axis(WIDE, shaft).frequency
    labels = tuple(dof.label for dof in bench.case.dofs)
    full = multibody.frf(model.whole, lines).select(labels, labels)
    coupled = couple_points(model, lines, labels).select(labels, labels)
    return float(scaled_error(full.values, coupled.values).max())


def _by_shaft(values: dict[float, float]) -> str:
    return ", ".join(f"{value:.1e} with {at_shaft(shaft)}" for shaft, value in values.items())


def _numbers(name: str, values: dict[float, float]) -> dict[str, float]:
    return {f"{name}_{shaft:.0e}".replace("e+0", "e"): value for shaft, value in values.items()}


@statement(
    "coupled-equals-full", "Coupling against the full system", "Sec. 4.1, Figs. 5–7; Sec. 5",
    "The curves of the coupled and of the full system are identical; a good agreement for all "
    "FRFs.",
    "FBS of exudyn's stages against exudyn's full system, all FRFs between all DoFs, 10 Hz to "
    "15 kHz",
)  # fmt: skip
def coupled_equals_full(bench: Bench) -> Finding:
    """Is coupled equal to full?"""
    worst = bench.once(worst_over_all, bench.case.shaft_stiffness)
    n = len(bench.case.dofs)
    check = Check(
        "FRFs of the whole", f"{n} × {n} FRFs of the drivetrain",
        ("exudyn", "FBS of exudyn stages"), "scaled error", worst, FRF_TOLERANCE, FRF_REASON,
    )  # fmt: skip
    return Finding(
        Verdict.of(check.agrees),
        f"largest scaled error {worst:.1e} of {n} × {n} FRFs, with −B_H_jc in Eq. (15); round-off "
        f"explains up to {FRF_TOLERANCE:.0e}",
        {"worst": worst},
        checks=(check,),
    )


@statement(
    "difference-grows", "Difference growing with the shaft stiffness",
    "Sec. 4.2, Figs. 8, 9; Sec. 5",
    "A small difference in magnitude between both methods, which becomes considerable with k_sw.",
    "the same comparison for every k_sw of the paper",
)  # fmt: skip
def difference_grows(bench: Bench) -> Finding:
    """Does the difference grow with k_sw?"""
    errors = {shaft: bench.once(worst_over_all, shaft) for shaft in SHAFT_STIFFNESSES}
    grows = max(errors.values()) > FRF_TOLERANCE
    return Finding(
        Verdict.of(grows),
        f"largest scaled error {_by_shaft(errors)}: "
        + ("more than round-off" if grows else "round-off for any, no difference of the method"),
        _numbers("worst", errors),
    )  # fmt: skip


@statement(
    "frequencies-differ", "Frequencies of the coupled FRFs", "Sec. 4.2, Table 4, Fig. 9",
    "The rotational frequencies differ: 1550 and 1982 Hz (full system), 1537 and 1971 Hz "
    "(coupling); the coupling method shifts them down.",
    "poles of the coupled FRFs, by modal filter, against the full system's up to 15 kHz",
)  # fmt: skip
def frequencies_differ(bench: Bench) -> Finding:
    """Do both methods have the same natural frequencies?"""
    shifts = {shaft: _pole_shift(bench, shaft) for shaft in SHAFT_STIFFNESSES}
    worst = max(shifts.values())
    return Finding(
        Verdict.of(worst > POLE_TOLERANCE),
        f"largest relative difference {_by_shaft(shifts)}: "
        + ("the poles differ" if worst > POLE_TOLERANCE else "both methods have the same poles")
        + "; Table 4's rows say where its numbers come from",
        _numbers("shift", shifts),
    )  # fmt: skip


def _pole_shift(bench: Bench, shaft: float) -> float:
    modes: RealModes = bench.modes("", shaft)
    model = bench.exudyn(shaft)
    dofs = model.whole.dofs
    natural = modes.natural_frequencies
    groups = [g for g in repeated(modes) if natural[g[0]] <= WIDE.end]

    def receptance(lines: FloatArray) -> ComplexArray:
        return couple_points(model, lines, dofs).select(dofs, dofs).values

    found = filtered_poles(
        receptance, model.whole.mass, [(float(natural[g[0]]), modes.shapes[:, g]) for g in groups]
    )
    expected = np.array([natural[mode] for g in groups for mode in g])
    return float(np.max(np.abs([pole.frequency_hz for pole in found] - expected) / expected))


@statement(
    "new-frequency", "New frequency in the sun's radial FRF", "Sec. 4.2, Fig. 8c",
    "A new frequency appears in the coupled FRF of the sun's radial direction for k_sw = 1e7 "
    "N/m.",
    "coupled against full system at the sun's u, and the kinds of the modes that move it",
)  # fmt: skip
def new_frequency(bench: Bench) -> Finding:
    """Does the coupled FRF of Fig. 8c have a new frequency?"""
    shaft = max(SHAFT_STIFFNESSES)
    scaled, decibel = routes_error(bench, Drawing("B.sun.u", WIDE, shaft=shaft))
    modes = bench.modes("", shaft)
    kinds = bench.once(mode_kinds, "", shaft)
    row = modes.dofs.index(bench.case.label("B.sun.u"))
    seen = {
        str(kinds[g[0]]): None
        for g in repeated(modes)
        if modes.natural_frequencies[g[0]] <= WIDE.end
        and np.any(np.abs(modes.shapes[row, g]) > 1e-6)
    }
    return Finding(
        Verdict.of(scaled > FRF_TOLERANCE),
        f"the two FRFs differ by a scaled error of {scaled:.1e} ({decibel:.1e} dB) at most; modes "
        f"that move the sun's u: {', '.join(seen)}",
        {"scaled": scaled, "decibel": decibel},
    )  # fmt: skip


@dataclass(frozen=True)
class StiffnessRow:
    """One planetary DoF's drive-point FRF for one k_sw (Figs. 8, 9, 12, for u, v and w).

    Attributes
    ----------
    shaft_stiffness
        k_sw (N/m).
    dof
        The degree of freedom.
    routes_db, routes_scaled
        Coupled against full system: largest error (dB, and scaled).
    change_db, change_scaled
        Full system against the smallest k_sw of the study: largest change (dB, and scaled).
    """

    shaft_stiffness: float
    dof: DofName
    routes_db: float
    routes_scaled: float
    change_db: float
    change_scaled: float


def stiffness_rows(bench: Bench) -> tuple[StiffnessRow, ...]:
    """Drive points of the members and a planet for every k_sw: by two routes, and their change."""
    names = [f"B.{body}.{d}" for body in (*bench.case.planetary.bodies, "planet1") for d in "uvw"]
    return tuple(_stiffness_row(bench, name, k) for name in names for k in SHAFT_STIFFNESSES)


def _stiffness_row(bench: Bench, name: str, shaft: float) -> StiffnessRow:
    scaled, decibel = routes_error(bench, Drawing(name, WIDE, shaft=shaft))
    soft = Drawing(name, WIDE, shaft=min(SHAFT_STIFFNESSES))
    first = bench.frf(RouteName.EXUDYN, WIDE, soft.shaft)
    change = difference(
        soft.lines(bench),
        soft.curve(bench, RouteName.EXUDYN, ""),
        Drawing(name, WIDE, shaft=shaft).curve(bench, RouteName.EXUDYN, ""),
        scale(first, *soft.pair(bench)),
    )
    dof = bench.case.dof(bench.case.label(name))
    return StiffnessRow(shaft, dof, decibel, scaled, change.worst_db, change.worst_scaled)


@statement(
    "sun-radial", "Sun's radial FRF and the shaft", "Sec. 4.2, Fig. 8",
    "The sun's radial FRF is sensitive to the shaft stiffness.",
    "drive points of the planetary stage in the full system for every k_sw, and the sun's u "
    "without the reducer",
)  # fmt: skip
def sun_radial(bench: Bench) -> Finding:
    """Does the sun's radial FRF know the shaft, or the reducer?"""
    rows = bench.once(stiffness_rows)
    sun = Drawing("B.sun.u", WIDE, shaft=min(SHAFT_STIFFNESSES))
    change = max(r.change_scaled for r in rows if r.dof.label == bench.case.label("B.sun.u"))
    reducer = difference(
        sun.lines(bench),
        sun.curve(bench, RouteName.EXUDYN, ""),
        sun.curve(bench, RouteName.EXUDYN, "", bench.case.b),
        scale(bench.frf(RouteName.EXUDYN, WIDE, sun.shaft), *sun.pair(bench)),
    ).worst_scaled
    affected = max(change, reducer) > FRF_TOLERANCE
    worst = max(rows, key=lambda row: row.routes_scaled)
    check = Check(
        "FRFs over k_sw", "drive points of the planetary stage", ("exudyn", "FBS of exudyn stages"),
        "scaled error", worst.routes_scaled, FRF_TOLERANCE, FRF_REASON,
        note=f"{worst.dof.label}, {at_shaft(worst.shaft_stiffness)}",
    )  # fmt: skip
    return Finding(
        Verdict.of(affected),
        f"from the softest to the stiffest shaft it changes by a scaled {change:.1e}, without the "
        f"reducer by {reducer:.1e}: "
        + (
            "the planets let the sun's translation feel the shaft"
            if affected
            else "with equally spaced planets, translational modes do not turn the sun"
        ),
        {"change_with_shaft": change, "change_without_reducer": reducer},
        blocks=_stiffness_table(rows),
        details={"stiffness": rows},
        checks=(check,),
    )


def _stiffness_table(rows: tuple[StiffnessRow, ...]) -> tuple[Table, Note]:
    shafts = sorted(SHAFT_STIFFNESSES)
    headings = (
        "Degree of freedom", "Label",
        *(f"Change, {at_shaft(k)} (dB)" for k in shafts[1:]), "Coupled against full (scaled)",
    )  # fmt: skip
    lines = []
    for dof in dict.fromkeys(row.dof for row in rows):
        own = {row.shaft_stiffness: row for row in rows if row.dof == dof}
        changes = (_change(own[k].change_db) for k in shafts[1:])
        routes = max(row.routes_scaled for row in own.values())
        lines.append((dof.words, dof.label, *changes, scientific(routes)))
    n = len(headings)
    note = (
        f"Drive points in the full system: largest change against {at_shaft(shafts[0])} (none: "
        "below 1e-6 dB; large changes come from resonances that move), and how far the coupled FRF "
        "is from the full system's, at worst over k_sw."
    )
    return Table(headings, tuple(lines), frozenset(range(2, n))), Note(note)


def _change(value: float) -> str:
    return "none" if value < 1e-6 else f"{value:.2g}"


@statement(
    "h-9-10", "FRF from hub to the sun's u", "Sec. 4.1, Fig. 7",
    "H_9,10 has resonances, and both methods agree except a small difference in magnitude.",
    "largest |H_9,10|/√(h_9 h_10) of the full system",
)  # fmt: skip
def hub_to_sun_u(bench: Bench) -> Finding:
    """Is there an FRF between hub and sun u?"""
    size = relative_size(bench, Drawing("hub", WIDE_NOT_STATED, excitation="B.sun.u"))
    return Finding(
        Verdict.of(size > ZERO),
        f"it is {size:.1e}: "
        + ("zero but for round-off, by symmetry" if size <= ZERO else "not zero"),
        {"largest": size},
    )  # fmt: skip


@statement(
    "dof-13", "Number of a DoF", "Sec. 4.1, Fig. 6(b)",
    "DoF 13 is the radial direction u_p2 of the second planet.",
    "the position of both in the order of Eq. (11)",
)  # fmt: skip
def dof_13(bench: Bench) -> Finding:
    """Which DoF is number 13?"""
    case = bench.case
    numbered = case.dofs[NUMBERED_AS_SECOND_PLANET - 1]
    named = case.dof(case.label("B.planet2.u"))
    number = int(named.paper.split(",")[0])
    return Finding(
        Verdict.of(numbered == named, corrected=True),
        f"DoF {NUMBERED_AS_SECOND_PLANET} is {numbered.paper.split(', ')[1]} ({numbered.words}); "
        f"the second planet's u is DoF {number}",
        {"number_of_second_planet_u": float(number)},
    )  # fmt: skip


@statement(
    "b-shifts-down", "Frequencies of B when coupled", "end of Sec. 4.2",
    "The eigenfrequencies of subsystem B shift to a lower frequency in the system AB.",
    "rotational modes of B with its half hub, alone and in AB (Hz)",
)  # fmt: skip
def b_shifts_down(bench: Bench) -> Finding:
    """Do B's frequencies fall when it is coupled?"""
    alone, whole = bench.modes(bench.case.b), bench.modes()
    kinds = bench.once(mode_kinds, bench.case.b, None)
    rotational = [
        float(f)
        for f, kind in zip(alone.natural_frequencies, kinds, strict=True)
        if kind in (Kind.ROTATIONAL, Kind.MIXED) and f <= WIDE.end
    ]
    moved = {
        f: float(whole.natural_frequencies[np.argmin(np.abs(whole.natural_frequencies - f))])
        for f in rotational
    }
    falls = all(after < before for before, after in moved.items())
    listed = ", ".join(f"{before:.2f} → {after:.2f}" for before, after in moved.items())
    return Finding(
        Verdict.of(falls),
        f"{listed} Hz: " + ("they fall" if falls else "coupling adds stiffness, and they rise"),
        {f"shift_of_{before:.0f}_hz": after - before for before, after in moved.items()},
    )  # fmt: skip


@statement(
    "second-radial", "The two radial directions of the sun", "Sec. 4.2",
    "The new frequency is not present in the second radial displacement's FRF; new frequencies "
    "appear in the two radial directions.",
    f"the sun's u and v in the full system and coupled, {at_shaft(max(SHAFT_STIFFNESSES))}",
)  # fmt: skip
def second_radial(bench: Bench) -> Finding:
    """Can u have a frequency that v has not?"""
    shaft = max(SHAFT_STIFFNESSES)
    u, v = (Drawing(f"B.sun.{d}", WIDE, shaft=shaft) for d in "uv")
    row_scale = scale(bench.frf(RouteName.EXUDYN, WIDE, shaft), *u.pair(bench))
    apart = {
        route: difference(
            u.lines(bench), u.curve(bench, route, "u"), v.curve(bench, route, "v"), row_scale
        ).worst_scaled
        for route in (RouteName.EXUDYN, RouteName.FBS)
    }
    worst = max(apart.values())
    return Finding(
        Verdict.of(worst > FRF_TOLERANCE),
        f"u and v have one FRF, full to {apart[RouteName.EXUDYN]:.1e} and coupled to "
        f"{apart[RouteName.FBS]:.1e}: "
        + (
            "planets at unequal angles tell them apart"
            if worst > FRF_TOLERANCE
            else "with equally spaced planets the two directions cannot be told apart"
        ),
        {"full": apart[RouteName.EXUDYN], "coupled": apart[RouteName.FBS]},
    )


@statement(
    "unchanged-modes", "Frequencies that coupling leaves alone", "Sec. 4.1",
    "For the planetary stage, some natural frequencies remain identical when it is coupled; the "
    "changed modes are global modes.",
    "natural frequencies of the stages with their half hubs, alone and in AB, by kind",
)  # fmt: skip
def unchanged_modes(bench: Bench) -> Finding:
    """Which modes of the stages are modes of AB?"""
    whole = bench.modes().natural_frequencies
    parts = (bench.case.a, bench.case.b)
    shifts: dict[str, list[float]] = {}
    for part in parts:
        modes, kinds = bench.modes(part), bench.once(mode_kinds, part, None)
        for f, kind in list(zip(modes.natural_frequencies, kinds, strict=True))[modes.n_rigid :]:
            if f <= WIDE.end:
                shifts.setdefault(kind, []).append(float(np.min(np.abs(whole - f)) / f))
    same = {kind: sum(shift <= SAME for shift in own) for kind, own in shifts.items()}
    words = ", ".join(f"{same[kind]} of {len(own)} {kind}" for kind, own in shifts.items())
    moved = max(max(own) for own in shifts.values())
    stages = np.concatenate([bench.modes(p).natural_frequencies for p in parts])
    new = {
        f"{f:.1f} Hz ({kind})": kind
        for f, kind in zip(whole, bench.once(mode_kinds, "", None), strict=True)
        if f <= WIDE.end and np.min(np.abs(stages - f)) > PRINTED_TO_HZ / 2.0
    }
    return Finding(
        Verdict.of(any(same.values()) and set(new.values()) <= {Kind.GLOBAL}),
        f"unchanged to {SAME:g}: {words} modes; the others move by {moved:.1e} of themselves or "
        f"less. Modes of AB that no stage has to the printed 1 Hz: {', '.join(new) or 'none'}",
        {f"unchanged_{kind.replace(' ', '_')}": float(count) for kind, count in same.items()},
    )


@statement(
    "shaft-frequencies", "Natural frequencies and the shaft", "Sec. 4.2",
    "The natural frequencies of the overall system are sensitive to the coupling stiffness; they "
    "fall when it is decreased.",
    "natural frequencies of AB up to 15 kHz for every k_sw",
)  # fmt: skip
def shaft_frequencies(bench: Bench) -> Finding:
    """Do natural frequencies of AB rise with k_sw, and which?"""
    shafts = sorted(SHAFT_STIFFNESSES)
    found = [bench.modes("", k).natural_frequencies for k in shafts]
    soft, *stiffer = (f[f <= WIDE.end] for f in found)
    rises = all(bool(np.all(f[: len(soft)] >= soft * (1.0 - SAME))) for f in stiffer)
    moved = int(np.sum(stiffer[-1][: len(soft)] > soft * (1.0 + SAME)))
    lowest = {k: float(f[f > 0.0][0]) for k, f in zip(shafts, found, strict=True)}
    listed = ", ".join(f"{f:.1f} Hz with {at_shaft(k)}" for k, f in lowest.items())
    return Finding(
        Verdict.of(moved > 0 and rises),
        f"the lowest elastic mode is at {listed}; from the softest to the stiffest shaft {moved} "
        f"of {len(soft)} natural frequencies move, {'none' if rises else 'some'} of them down. "
        "That is so in either method, which have the same poles (frequencies-differ)",
        {"moved": float(moved), **_numbers("lowest_hz", lowest)},
    )


@statement(
    "h-11", "Number of the sun's radial FRF", "Sec. 4.1, Figs. 4, 7",
    "H_11 is the translational FRF of the sun's u; in Fig. 7 index 1 is the coupling DoF of B and "
    "index 2 the sun's radial one.",
    "the position of both in the order of Eq. (5)",
)  # fmt: skip
def h_11(bench: Bench) -> Finding:
    """Is the sun's u the first DoF of B?"""
    order = (bench.case.hub, *bench.case.internal_b)
    number = order.index(bench.case.label("B.sun.u")) + 1
    return Finding(
        Verdict.of(number == 1, corrected=True),
        f"in the order of Eq. (5) the coupling DoF is number 1 and the sun's u is number {number}, "
        f"as Fig. 7 counts: Fig. 4 shows H_{number}{number}, not H_11",
        {"number_of_sun_u": float(number)},
    )

"""Tables 1 and 2: what each printed value can be checked by."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, radians, sqrt

import numpy as np

from ..report.page import Block, Note, Table
from .bench import Bench
from .item import Finding, Verdict, statement
from .printed_values import TABLE_1, TABLE_2, TABLE_3, Gear
from .tables import ROW_LOOKS, RowVerdict

STEEL = 7850.0
"""kg/m³."""

FEWEST_TEETH = 17
"""Of a gear cut at 20° without undercut: the largest teeth a gear of given size can have."""

ADDENDUM, DEDENDUM = 1.0, 1.25
"""Of standard teeth, in modules (ISO 53)."""


@dataclass(frozen=True)
class ValueRow:
    """A printed value, what it is checked by, and what that gives.

    Attributes
    ----------
    number, printed
        Its place in the table, and the value as printed.
    by, reason
        What it is checked by; what was found.
    verdict
        Whether that gives the printed value.
    """

    number: int
    printed: str
    by: str
    verdict: RowVerdict
    reason: str


Row = tuple[str, str, RowVerdict, str]  # a ValueRow without its number


@statement(
    "table1", "Parameters of the parallel stage", "Table 1, Sec. 4.1",
    "The parameters of the parallel stage.",
    "inertias against discs of the printed mass; springs by the natural frequencies they give, "
    "against Table 3; the unit of I_A against Eq. (6)", subject="tables",
)  # fmt: skip
def parallel_stage(bench: Bench) -> Finding:
    """Is Table 1 consistent with itself and with Table 3?"""
    t, hub = TABLE_1, TABLE_1.hub_inertia
    reach = sqrt(2.0 * t.polar / t.mass) * cos(radians(t.pressure_angle))
    size = 1e3 * (32.0 * hub / (pi * STEEL)) ** 0.2
    springs = _spring_frequencies()
    rows: list[Row] = [
        (f"J_i/r_i² = {t.polar:g} kg", "a solid disc of mass m_i",
         _within(reach, *_reach_of_teeth(FEWEST_TEETH)),
         f"it reaches to {reach:.3f} of the pitch radius, among the teeth"),
        (f"I_i/r_i² = {t.diametral:g} kg", "a thin disc, I = J/2",
         _rounded(t.polar / 2.0, t.diametral, 0.01), f"J/2 = {t.polar / 2.0:g} kg"),
        *((f"{name}", f"natural frequencies {words}, in Table 3", *_listed(found))
          for name, words, found in springs),
        (f"I_A = {hub:g} kg m²", "its place beside inertias I/r² in kg (Eq. 6)",
         RowVerdict.CORRECTED,
         "it lacks the division by r² (item hub-unit: what that changes); a steel cylinder of that "
         f"inertia is {size:.0f} mm long and wide"),
    ]  # fmt: skip
    return _finding(
        rows, "not given: the base radii r₁ and r₂, tooth numbers, and what holds the hub to the "
        "wheel",
    )  # fmt: skip


def _spring_frequencies() -> list[tuple[str, str, list[float]]]:
    """Springs, in words, and the natural frequencies (Hz) that two equal gears have by them.

    Both gears alike move freely of the mesh: √(k/m). Against each other (w, y) strain it:

        K = [[2k, 2k], [2k, 2k + k_y]],    M = diag(J/r², m)
    """
    t, k = TABLE_1, 2.0 * TABLE_1.mesh
    root = np.sqrt([t.polar, t.mass])
    against = np.array([[k, k], [k, k + t.bearing_y]]) / np.outer(root, root)
    meshed = (np.sqrt(np.linalg.eigvalsh(against)) / (2.0 * pi)).tolist()
    single = [
        ("k_zi", t.bearing_z, t.mass), ("k_yi", t.bearing_y, t.mass),
        ("k_bρyi/r_i²", t.rocking, t.diametral),
    ]  # fmt: skip
    found = [
        (f"{name} = {stiffness:.1e} N/m".replace("e+0", "e"), "√(k/m)/2π of a gear on it",
         [sqrt(stiffness / mass) / (2.0 * pi)])
        for name, stiffness, mass in single
    ]  # fmt: skip
    mesh = f"k_moy = {t.mesh:.0e} N/m".replace("e+0", "e")
    return [*found, (mesh, "of two gears against each other", meshed)]


def _listed(frequencies: list[float]) -> tuple[RowVerdict, str]:
    """Whether Table 3 lists the frequencies among those of the parallel stage."""
    printed = [mode.frequency_hz for mode in TABLE_3 if mode.column == "Parallel stage"]
    gaps = [min(abs(f - p) for p in printed) for f in frequencies]
    words = ", ".join(f"{f:.1f}" for f in frequencies)
    if max(gaps) <= 1.0:
        return RowVerdict.REPRODUCED, f"{words} Hz, as Table 3 lists"
    return RowVerdict.MISSED, (
        f"{words} Hz, which Table 3 does not list (nearest: {max(gaps):.1f} Hz away)"
    )


@statement(
    "table2", "Parameters of the planetary stage", "Table 2, Sec. 4.1",
    "The planetary gear parameters.",
    "base radii by m z cos α / 2, tooth numbers by how the gears fit, inertias and masses against "
    "steel discs of the printed width", subject="tables",
)  # fmt: skip
def planetary_stage(bench: Bench) -> Finding:
    """Is Table 2 consistent with itself?"""
    t = TABLE_2
    sun, planet, ring = t.gears
    planets = bench.case.planetary.planet_count
    fits = ring.teeth == sun.teeth + 2 * planet.teeth
    spaced = (sun.teeth + ring.teeth) % planets == 0
    outer = t.module * (sun.teeth + planet.teeth) / 2.0
    inner = t.module * (ring.teeth - planet.teeth) / 2.0
    rows: list[Row] = [
        *(_base_radius(gear) for gear in t.gears),
        (f"{sun.teeth}, {planet.teeth}, {ring.teeth} teeth",
         f"z_r = z_s + 2 z_p; (z_s + z_r)/{planets} whole",
         RowVerdict.REPRODUCED if fits and spaced else RowVerdict.MISSED,
         f"{sun.teeth + 2 * planet.teeth}; {(sun.teeth + ring.teeth) / planets:g}"),
        (f"α_s = α_r = {t.pressure_angle:g}°", "both centre distances, m (z_s + z_p)/2 and "
         "m (z_r − z_p)/2", _rounded(inner, outer, 0.0),
         f"{outer:.2f} and {inner:.2f} mm: one distance, and so one working angle"),
        *(_disc(gear) for gear in (sun, planet)),
        _rim(ring),
    ]  # fmt: skip
    return _finding(
        rows, "not given: the carrier's bearing stiffness, which Eq. (23) needs; what the values "
        "give for Table 3 is an item of its own (table3-parameters)",
    )  # fmt: skip


def _base_radius(gear: Gear) -> Row:
    """r_b = m z cos α / 2, with the printed (working) angle and with Table 1's."""
    printed = f"base radius {1e3 * gear.base_radius:g} mm ({gear.name})"
    own, cut = (
        TABLE_2.module * gear.teeth * cos(radians(angle)) / 2.0
        for angle in (TABLE_2.pressure_angle, TABLE_1.pressure_angle)
    )
    verdict = _rounded(own, 1e3 * gear.base_radius, 1.0)
    if verdict == RowVerdict.MISSED and _rounded(cut, 1e3 * gear.base_radius, 1.0) != verdict:
        verdict = RowVerdict.CORRECTED
    return printed, f"m z cos α / 2, α = {TABLE_2.pressure_angle:g}°", verdict, (
        f"{own:.2f} mm; {cut:.2f} mm with {TABLE_1.pressure_angle:g}°, the angle of Table 1, at "
        f"which the gears are cut if {TABLE_2.pressure_angle:g}° is the working angle"
    )  # fmt: skip


def _disc(gear: Gear) -> Row:
    """I/r² and mass against a steel disc; what its radius would be of the pitch radius."""
    pitch = TABLE_2.module * gear.teeth / 2.0
    by_inertia = sqrt(2.0 * gear.inertia / gear.mass) * 1e3 * gear.base_radius / pitch
    by_mass = 1e3 * sqrt(gear.mass / (STEEL * pi * TABLE_2.width)) / pitch
    low, high = _reach_of_teeth(gear.teeth)
    # two digits of the mass: half a unit of the last one
    slack = 0.005 / gear.mass / 2.0
    both = max(by_inertia, by_mass) <= high + slack and min(by_inertia, by_mass) >= low - slack
    verdict = RowVerdict.REPRODUCED if both else RowVerdict.MISSED
    printed = f"m = {gear.mass:g} kg, I/r² = {gear.inertia:g} kg ({gear.name})"
    return (
        printed,
        f"a steel disc {1e3 * TABLE_2.width:g} mm wide",
        verdict,
        (
            f"it reaches to {by_mass:.2f} of the pitch radius by its mass, to {by_inertia:.2f} by "
            f"its inertia; the teeth lie between {low:.2f} and {high:.2f}"
        ),
    )


def _rim(ring: Gear) -> Row:
    """A steel ring from among the teeth outwards, its outer radius by I/m = (R_i² + R_o²)/2."""
    pitch = TABLE_2.module * ring.teeth / 2.0
    gyration = sqrt(ring.inertia / ring.mass) * 1e3 * ring.base_radius
    masses = [
        STEEL * pi * 2.0 * (gyration**2 - inner**2) * TABLE_2.width * 1e-6
        for inner in (pitch + DEDENDUM * TABLE_2.module, pitch - ADDENDUM * TABLE_2.module)
    ]
    printed = f"m = {ring.mass:g} kg, I/r² = {ring.inertia:g} kg (ring)"
    return (
        printed,
        "a steel rim with that radius of gyration",
        _within(ring.mass, *masses),
        (
            f"R_g = {gyration:.1f} mm; from the teeth outwards that is {masses[0]:.2f} to "
            f"{masses[1]:.2f} kg"
        ),
    )


def _reach_of_teeth(teeth: int) -> tuple[float, float]:
    """Root and tip radius of standard teeth as shares of the pitch radius."""
    return 1.0 - 2.0 * DEDENDUM / teeth, 1.0 + 2.0 * ADDENDUM / teeth


def _within(value: float, low: float, high: float) -> RowVerdict:
    return RowVerdict.REPRODUCED if low <= value <= high else RowVerdict.MISSED


def _rounded(value: float, printed: float, digit: float) -> RowVerdict:
    """Whether a value, rounded to the printed digit, is what is printed."""
    return RowVerdict.REPRODUCED if abs(value - printed) <= digit / 2.0 else RowVerdict.MISSED


def _finding(rows: list[Row], not_given: str) -> Finding:
    numbered = tuple(ValueRow(i, *row) for i, row in enumerate(rows, start=1))
    counts = {v: sum(row.verdict == v for row in numbered) for v in RowVerdict}
    words = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    n = len(numbered)
    return Finding(
        Verdict.of(counts[RowVerdict.REPRODUCED] == n, counts[RowVerdict.MISSED] == 0),
        f"of {n} values that can be checked: {words}; {not_given}",
        {f"rows_{v.name.lower()}": float(count) for v, count in counts.items()},
        blocks=_blocks(numbered),
        details={"rows": numbered},
    )


def _blocks(rows: tuple[ValueRow, ...]) -> tuple[Block, ...]:
    headings = ("No.", "Printed", "Checked by", "Verdict", "Found")
    cells = tuple((str(r.number), r.printed, r.by, r.verdict, r.reason) for r in rows)
    looks = {i: ROW_LOOKS[r.verdict] for i, r in enumerate(rows) if r.verdict in ROW_LOOKS}
    note = Note("Values that nothing else in the paper depends on cannot be checked.")
    return Table(headings, cells, frozenset({0}), style="rows", row_styles=looks), note

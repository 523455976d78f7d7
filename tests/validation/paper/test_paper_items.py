"""Single items: closed forms behind them, and that another model gives another verdict."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from math import cos, radians

import numpy as np
import pytest

from mbs_models.model.model_file import load
from validation.paper import (
    condensed_figures,
    coupling,
    formulas,
    parameter_tables,
    parameters,
    timing,
    truncation,
    varying_stiffness,
)
from validation.paper.bench import Bench
from validation.paper.case import PaperCase
from validation.paper.item import Statement, Verdict
from validation.paper.printed_values import TABLE_1, TABLE_2, TIME_SAVED
from validation.paper.tables import RowVerdict
from validation.routes.floquet import tongues


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


@pytest.fixture(scope="module")
def unequal() -> Bench:
    case = PaperCase(load("paper"))
    stage = case.planetary.model_copy(
        update={"planets": None, "planet_angles": (0.0, 80.0, 170.0, 260.0)}
    )
    return Bench(case.drivetrain.model_copy(update={"stages": (case.parallel, stage)}))


# --- Tables 1 and 2 -------------------------------------------------------------------------


def test_the_ring_is_56_mm_only_if_cut_at_20_degrees(bench: Bench) -> None:
    """m z cos α / 2 = 1.7 · 70 · cos α / 2: 55.4 mm at the printed 21.34°, 55.9 mm at 20°."""
    assert 59.5 * cos(radians(21.34)) == pytest.approx(55.42, abs=0.005)
    assert 59.5 * cos(radians(20.0)) == pytest.approx(55.91, abs=0.005)
    rows = parameter_tables.planetary_stage.examine(bench).details["rows"]
    verdicts = {row.printed.split()[-1]: row.verdict for row in rows[:3]}
    assert verdicts == {
        "(sun)": RowVerdict.REPRODUCED,
        "(planet)": RowVerdict.REPRODUCED,
        "(ring)": RowVerdict.CORRECTED,
    }


def test_springs_of_table_1_give_the_models_frequencies(bench: Bench) -> None:
    """The closed forms against exudyn's stage, which carries half a hub of m_h = 2.24e-8 kg.

    It lowers a frequency by half its share of the modal mass, at most m_h/(2 · 1.16 kg) = 1e-8.
    """
    natural = bench.modes(bench.case.a).natural_frequencies
    for *_, frequencies in parameter_tables._spring_frequencies():
        for f in frequencies:
            assert np.min(np.abs(natural / f - 1.0)) < 1e-8


def test_a_wrong_value_in_a_table_is_seen(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    sun, planet, ring = TABLE_2.gears
    wrong = (replace(sun, teeth=31), replace(planet, mass=0.3), replace(ring, inertia=0.5))
    for gears in ((wrong[0], planet, ring), (sun, wrong[1], ring), (sun, planet, wrong[2])):
        monkeypatch.setattr(parameter_tables, "TABLE_2", replace(TABLE_2, gears=gears))
        assert parameter_tables.planetary_stage.examine(bench).verdict == Verdict.FAILS
    monkeypatch.setattr(parameter_tables, "TABLE_1", replace(TABLE_1, rocking=1.1102e8))
    found = parameter_tables.parallel_stage.examine(bench).details["rows"]
    assert found[4].verdict == RowVerdict.REPRODUCED  # 2202 Hz


# --- Eqs. (3), (6), (17) --------------------------------------------------------------------


def test_what_a_varying_stiffness_changes_is_of_second_order(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Median change of an FRF at half the variation is a quarter, up to the next order a⁴."""
    system = varying_stiffness.varying_stage(bench)
    whole = np.median(varying_stiffness.changed_frf(system, 1050.0))
    monkeypatch.setattr(varying_stiffness, "VARIATION", varying_stiffness.VARIATION / 2.0)
    half = np.median(varying_stiffness.changed_frf(system, 1050.0))
    assert half / whole == pytest.approx(0.25, abs=0.02)


def test_mesh_frequencies_of_the_printed_teeth(bench: Bench) -> None:
    assert varying_stiffness.mesh_frequency(60.0) == pytest.approx(30.0 * 70.0 / 100.0)
    first = min(t.centre for t in tongues(varying_stiffness.varying_stage(bench), (1,))[:3])
    assert varying_stiffness.sun_speed(first) == pytest.approx(first * 60.0 / 21.0)


def test_the_hub_is_an_angle_unless_its_radius_is_one_metre(bench: Bench) -> None:
    coupling_of = bench.case.drivetrain.couplings[0]
    unit = coupling_of.model_copy(update={"radius": 1.0})
    other = Bench(bench.case.drivetrain.model_copy(update={"couplings": (unit,)}))
    assert formulas.mass_matrices.examine(bench).verdict == Verdict.CORRECTED
    assert formulas.mass_matrices.examine(other).verdict == Verdict.HOLDS


# --- sentences ------------------------------------------------------------------------------


@pytest.mark.parametrize("item", [coupling.second_radial, coupling.sun_radial])
def test_unequal_planets_tell_directions_apart(
    bench: Bench, unequal: Bench, item: Statement
) -> None:
    assert item.examine(bench).verdict == Verdict.FAILS
    assert item.examine(unequal).verdict == Verdict.HOLDS


def test_a_stiff_shaft_leaves_the_stages_frequencies_no_more(bench: Bench) -> None:
    assert coupling.unchanged_modes.examine(bench).verdict == Verdict.HOLDS
    stiff = Bench(bench.case.with_shaft(1e9).drivetrain)
    found = coupling.unchanged_modes.examine(stiff)
    assert found.verdict == Verdict.FAILS
    assert found.numbers["unchanged_translational"] == 12.0  # six pairs, which feel no shaft


def test_without_the_hubs_mode_the_shaft_is_rigid(bench: Bench) -> None:
    """The peaks that leaving it out brings are the modes of AB with k_sw → ∞."""
    found = truncation.frequencies_of_truncation.examine(bench)
    assert "modes of AB with a rigid shaft" in found.evidence
    assert (found.numbers["met"], found.numbers["new_in_u"]) == (2.0, 0.0)


def test_a_hub_of_a_gears_inertia_has_its_peak_at_70_hz(bench: Bench) -> None:
    """71.07 Hz is √(k/m) of the sun's side on k_sw with half a hub of 1.16 kg, B alone."""
    assert condensed_figures.peak_at_70.examine(bench).verdict == Verdict.FAILS
    stiff = Bench(bench.case.with_shaft(2.8e5).drivetrain)  # 42 Hz · √2.8 = 70 Hz
    assert condensed_figures.peak_at_70.examine(stiff).verdict == Verdict.HOLDS


def test_kahraman_cannot_be_told(bench: Bench) -> None:
    found = parameters.kahraman.examine(bench)
    assert found.verdict == Verdict.OPEN
    assert found.numbers["largest_change"] < 1e-12


# --- computing time -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("saved", "verdict"),
    [
        ((0.71, 0.75, 0.0), Verdict.HOLDS),
        ((0.1, 0.75, 0.0), Verdict.FAILS),
        ((0.1, -0.5, 0.9), Verdict.CORRECTED),
        ((0.1, -0.5, 0.6), Verdict.FAILS),
    ],
)
def test_verdict_on_time_follows_the_readings(saved: tuple[float, ...], verdict: Verdict) -> None:
    readings = tuple(timing.Reading(f"{s:g}", "all", 1.0, 1.0 - s) for s in saved)
    found = timing.judged(timing.TimingStudy("made up", readings))
    assert found.verdict == verdict
    assert ("no reading" in found.evidence) == (max(saved[2:]) < TIME_SAVED)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no way to keep to one core here")
def test_verdict_on_time_does_not_hang_on_the_load(bench: Bench) -> None:
    """Two busy loops beside it, and one core for all of it."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    cores = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(cores)})
        found = timing.judged(timing.timing_study(bench))
    finally:
        os.sched_setaffinity(0, cores)
        for each in busy:
            each.kill()
            each.wait()
    assert found.verdict == Verdict.CORRECTED

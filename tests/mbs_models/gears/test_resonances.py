"""What orders reach of modes, where they meet them, and how far a speed is from it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mbs_models.gears.orders import Order, mesh_harmonics, orders
from mbs_models.gears.phasing import phasing
from mbs_models.gears.resonances import crossings, margins, mode_energies, reach
from mbs_models.modal.mode_kinds import Kind, Modes
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from mbs_models.system.components import Components
from mbs_models.system.read_back import drivetrain_components
from tests.geared import geared_reducer, lin_parker, speed_for
from tests.strategies import changed, with_coupling, with_stage

# Exact zeros in theory: shapes are known to about 1e-6 where frequencies are close, their squares
# to 1e-12.
NOTHING = 1e-9


def solved(drivetrain: Drivetrain) -> tuple[tuple[Order, ...], Modes, Components]:
    parts = drivetrain_components(drivetrain)
    return orders(drivetrain, parts), drivetrain_modes(drivetrain), parts


def mesh_order(found: tuple[Order, ...], stage: str) -> Order:
    return next(order for order in found if order.name == f"mesh {stage}")


# --- reach ----------------------------------------------------------------------------------


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_the_rules_of_planet_phasing_follow(planets: int) -> None:
    """A family that Parker's rule lets through is reached in full, the others not at all."""
    drivetrain = lin_parker(planets)
    found, modes, parts = solved(drivetrain)
    energies = mode_energies(modes, parts)
    order = mesh_order(found, "planetary")
    (planet_set,) = drivetrain.stages[0].planet_sets()
    for rule in phasing(planet_set, 2 * planets):
        reached = reach(order, rule.harmonic, energies)
        for number, mode in enumerate(modes.modes):
            if mode.kind in rule.suppressed:
                assert reached.share[number] < NOTHING
            elif mode.kind == rule.excited:
                assert reached.energy[number] > 0.0
                assert reached.share[number] == pytest.approx(reached.energy[number], rel=1e-6)


def test_reach_is_the_modal_force_of_the_harmonic() -> None:
    """Σ_n k s_n exp(−2πj l γ_n) of sun and ring meshes, summed mode by mode, against the shares.

    In a row |F|² = k (½ N or, in phase, N) (√k |P s|)²; both rows have their own k and F.
    """
    drivetrain = lin_parker(4)
    found, modes, parts = solved(drivetrain)
    energies = mode_energies(modes, parts)
    order = mesh_order(found, "planetary")
    shapes = modes.shapes[[modes.labels.index(dof) for dof in parts.dofs]]
    springs = {spring.name: spring for spring in parts.springs}
    strain = np.sum([2.0 * spring.energy(shapes) for spring in parts.springs], axis=0)
    teeth = 27
    for harmonic in (1, 2, 3, 4):
        waves = np.exp(-2j * np.pi * harmonic * teeth * np.arange(4) / 4)
        size = 4.0 if harmonic * teeth % 4 in (0, 2) else 2.0  # Σ cos² of the pattern
        expected = np.zeros(len(modes.modes))
        for member in ("sun", "ring"):
            row = [springs[f"mesh planetary.{member} – planet{n}"] for n in range(1, 5)]
            force = sum(
                w * (s.stiffness @ s.deflection @ shapes)[0]
                for w, s in zip(waves, row, strict=True)
            )
            expected += np.abs(force) ** 2 / (size * row[0].stiffness[0, 0])
        share = reach(order, harmonic, energies).share
        for number, mode in enumerate(modes.modes):
            if mode.kind != Kind.RIGID_BODY:
                assert share[number] == pytest.approx(expected[number] / strain[number], abs=1e-9)


def test_without_net_torque_nothing_outside_the_stage_is_reached() -> None:
    """k ≠ 0: no mode that turns shafts beyond the stage; k = 0: what it has in the meshes."""
    found, modes, parts = solved(load("paper-table2"))
    energies = mode_energies(modes, parts)
    order = mesh_order(found, "planetary")  # z_s = 30, N = 4: k = 2, 0, 2
    shared = [n for n, mode in enumerate(modes.modes) if mode.kind == Kind.GLOBAL]
    assert reach(order, 1, energies).share[shared].max() < NOTHING
    in_phase = reach(order, 2, energies)
    assert in_phase.share[shared].max() > 1e4 * NOTHING
    np.testing.assert_allclose(in_phase.share[shared], in_phase.energy[shared], rtol=1e-6)


def test_a_coupled_translation_is_reached_by_a_net_force_alone() -> None:
    """The sun's u coupled with the reducer's y: k = ±1 pulls at it, and so reaches the reducer."""
    drivetrain = load("paper-table2")
    joined = with_coupling(drivetrain, dofs={"u": {"stiffness": 1e9}})
    energies = {}
    for name, train in (("apart", drivetrain), ("joined", joined)):
        found, modes, parts = solved(train)
        order = replace(mesh_order(found, "planetary"), phases=(0.0, 0.25, 0.5, 0.75))  # k = 1
        away = [n for n, m in enumerate(modes.modes) if m.shares.kinetic["reducer"] > 0.2]
        energies[name] = reach(order, 1, mode_energies(modes, parts)).share[away].max()
    assert energies["apart"] < NOTHING
    assert energies["joined"] > 1e-3


def test_planets_that_differ_suppress_nothing() -> None:
    drivetrain = lin_parker(4)
    (stage,) = drivetrain.stages_of(PlanetaryStage)
    stiffness = list(stage.sun_meshes)
    one = [1.1 * stiffness[0], *stiffness[1:]]
    for keys in ({"sun_mesh_stiffness": one}, {"planets": None, "planet_angles": UNEVEN}):
        found, modes, parts = solved(with_stage(drivetrain, "planetary", **keys))
        order = mesh_order(found, "planetary")
        assert order.phasing == ()
        reached = reach(order, 1, mode_energies(modes, parts))
        np.testing.assert_allclose(reached.share, reached.energy, rtol=1e-9)


# Steps of 360°/124, z_s + z_r = 124: diametrically opposed pairs, 90.97° apart instead of 90°.
UNEVEN = [0.0, 360.0 * 32 / 124, 180.0, 180.0 + 360.0 * 32 / 124]


@pytest.mark.parametrize("turn", [0.3, 1.1])
def test_repeated_modes_may_be_combined_at_will(turn: float) -> None:
    """An eigensolver returns any combination of a repeated pair; what is reached stays."""
    found, modes, parts = solved(lin_parker(4))
    energies = mode_energies(modes, parts)
    pairs = [group for group in energies.groups if len(group) == 2]
    assert pairs
    shapes = modes.shapes.copy()
    c, s = math.cos(turn), math.sin(turn)
    for first, second in pairs:
        # Scaled differently, too: shares do not ask for a normalisation.
        shapes[:, [first, second]] = shapes[:, [first, second]] @ np.array(
            [[c, -2 * s], [s, 2 * c]]
        )
    other = mode_energies(replace(modes, shapes=shapes), parts)
    for order in found:
        one, two = reach(order, 1, energies), reach(order, 1, other)
        np.testing.assert_allclose(two.share, one.share, atol=1e-9)
        np.testing.assert_allclose(two.energy, one.energy, atol=1e-9)


# --- crossings and margins ------------------------------------------------------------------


def test_crossings_lie_on_their_order_and_are_sorted_by_share() -> None:
    found, modes, parts = solved(load("paper-table2"))
    met = crossings(found, modes, parts, (0.0, 3000.0))
    assert met
    for crossing in met:
        frequency = crossing.order.frequency(crossing.harmonic, crossing.speed_rpm)
        assert frequency == pytest.approx(modes.modes[crossing.mode].frequency_hz)
        assert 0.0 <= crossing.speed_rpm <= 3000.0
        assert 0.0 <= crossing.share <= crossing.energy + 1e-12 <= 1.0 + 1e-9
        assert not (crossing.telling and crossing.suppressed)
    values = [crossing.share for crossing in met]
    np.testing.assert_allclose(values, sorted(values, reverse=True), atol=1e-6)
    # z_s = 30, N = 4: the mesh frequency itself (k = 2) excites planet modes alone.
    first = [c for c in met if c.order.name == "mesh planetary" and c.harmonic == 1 and c.telling]
    assert {modes.modes[c.mode].kind for c in first} <= {Kind.PLANET}
    assert any(c.suppressed for c in met)


def test_a_speed_on_a_resonance_has_no_margin() -> None:
    """k = 3 of 4: l = 1 reaches translational modes; the speed is put on the second pair."""
    drivetrain = lin_parker(4)
    found, modes, parts = solved(drivetrain)
    pair = [n for n, mode in enumerate(modes.modes) if mode.kind == Kind.TRANSLATIONAL][2:4]
    target = modes.modes[pair[0]].frequency_hz
    share = reach(mesh_order(found, "planetary"), 1, mode_energies(modes, parts)).share[pair[0]]
    assert share > 0.01
    speed = speed_for(drivetrain, target)
    (nearest, *others) = margins(found, modes, parts, speed)
    assert (nearest.order.name, nearest.harmonic) == ("mesh planetary", 1)
    assert (nearest.mode, nearest.repeated, nearest.kind) == (pair[0], 2, Kind.TRANSLATIONAL)
    # Teeth fit the radii within 2 %: the mesh frequency is that of the teeth.
    assert nearest.change == pytest.approx(0.0, abs=0.02)
    assert nearest.close
    assert [abs(m.change) for m in others] == sorted(abs(m.change) for m in others)
    on = speed * (1.0 + nearest.change)
    assert margins(found, modes, parts, on)[0].change == pytest.approx(0.0, abs=1e-12)
    slower = {(m.order.name, m.harmonic): m for m in margins(found, modes, parts, on / 1.08)}
    assert slower["mesh planetary", 1].change == pytest.approx(0.08, rel=1e-9)
    backwards = margins(found, modes, parts, -on)
    assert backwards == margins(found, modes, parts, on)


def test_what_phasing_suppresses_is_no_resonance() -> None:
    """27 teeth, 4 planets: l = 1 reaches translational, l = 2 planet modes; others are nearer."""
    found, modes, parts = solved(lin_parker(4))
    nearest = {m.harmonic: m for m in margins(found, modes, parts, 3000.0) if m.order.rows}
    assert nearest[1].kind == Kind.TRANSLATIONAL
    assert nearest[2].kind == Kind.PLANET
    blind = tuple(
        replace(order, rows=tuple((name,) for row in order.rows for name in row), phases=(0.0,))
        for order in found
        if order.rows
    )
    unphased = {m.harmonic: m for m in margins(blind, modes, parts, 3000.0)}
    assert unphased[2].kind != Kind.PLANET
    assert abs(unphased[2].change) < abs(nearest[2].change)


def test_without_teeth_there_are_the_shafts() -> None:
    drivetrain = changed(
        load("lin-parker-3"),
        operation={"input": "planetary.sun", "speed_range": [0.0, 5000.0], "speed": 1000.0},
    )
    found, modes, parts = solved(drivetrain)
    names = [m.order.name for m in margins(found, modes, parts, 1000.0)]
    assert sorted(names) == sorted(order.name for order in found)
    assert names
    assert all(name.startswith("shaft") for name in names)


def test_a_mesh_without_stiffness_has_no_order() -> None:
    open_mesh = with_stage(geared_reducer(), "reducer", mesh_stiffness=0.0)
    found, modes, parts = solved(open_mesh)
    assert [order.name for order in found] == ["shaft reducer.pinion"]
    assert all(m.order.bodies for m in margins(found, modes, parts, 1000.0))


# --- harmonics ------------------------------------------------------------------------------


def test_a_mesh_without_a_law_has_three_harmonics() -> None:
    assert mesh_harmonics(lin_parker(4).stages[0]) == (1, 2, 3)


def test_a_mesh_law_adds_its_harmonics() -> None:
    """Half the period with two pairs: −2h sin(π l/2)… has odd harmonics only, falling as 1/l²."""
    five = {"shape": "harmonics", "harmonics": [[0.1, 0.0], *[[0.01, 0.0]] * 3, [0.001, 0.0]]}
    (stage, *_) = geared_reducer().stages
    keys = stage.model_dump(exclude_unset=True)
    half = {"shape": "trapezoid", "contact_ratio": 1.5, "transition": 0.1}
    error = {"harmonics": [[1e-6, 0.0]] + [[0.0, 0.0]] * 6 + [[1.1e-8, 0.0], [0.9e-8, 0.0]]}

    def harmonics(**changes: object) -> tuple[int, ...]:
        return mesh_harmonics(type(stage).model_validate(keys | changes))

    assert harmonics(mesh_variation=five) == (1, 2, 3, 4, 5)
    assert harmonics(mesh_variation=half) == (1, 2, 3, 5, 7, 9)
    constant = {"shape": "constant"}
    assert harmonics(mesh_variation=constant, mesh_transmission_error=error) == (1, 2, 3, 8)

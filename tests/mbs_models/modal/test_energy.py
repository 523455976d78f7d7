"""Components read back from exudyn, their energies, and the orders that excite them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from mbs_models.errors import ModelError
from mbs_models.gears.orders import orders, speeds
from mbs_models.modal.energy import component_shares, kinetic_energies, strain_energies
from mbs_models.modal.mode_kinds import Kind
from mbs_models.modal.modes import drivetrain_modes
from mbs_models.model.model_file import dumps, load, loads
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from mbs_models.system.components import SpringKind
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.linearization import linearize
from mbs_models.system.read_back import components, drivetrain_components
from tests.strategies import changed, drivetrains, paper, with_coupling, with_stage

PRESETS = ["paper", "lin-parker-3", "wind-turbine", "geared-torsional"]


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


# --- components -----------------------------------------------------------------------------


@settings(max_examples=15, deadline=None)
@given(drivetrain=drivetrains())
def test_springs_and_bodies_add_up_to_exudyns_matrices(drivetrain: Drivetrain) -> None:
    try:
        system = build_drivetrain(drivetrain)
    except ModelError:
        return  # a loop of rigid couplings
    parts, linear = components(system), linearize(system)
    stiffness = sum(s.deflection.T @ s.stiffness @ s.deflection for s in parts.springs)
    mass = sum(parts.motions[b].T @ m @ parts.motions[b] for b, m in parts.masses.items())
    assert relative(np.asarray(stiffness), linear.stiffness) < 1e-12
    assert relative(np.asarray(mass), linear.mass) < 1e-12


def test_every_spring_of_the_paper_is_found_and_named() -> None:
    springs = drivetrain_components(paper()).springs
    names = [spring.name for spring in springs]
    assert len(set(names)) == len(names)
    kinds = [spring.kind for spring in springs]
    assert kinds.count(SpringKind.MESH) == 9
    assert kinds.count(SpringKind.BEARING) == 9
    assert kinds.count(SpringKind.ROCKING) == 2
    assert kinds.count(SpringKind.TORSION) == 1
    assert kinds.count(SpringKind.SHAFT) == 2
    assert "mesh planetary.sun – planet3" in names
    assert "torsional support planetary.ring" in names


def test_an_open_coupling_has_no_spring() -> None:
    springs = drivetrain_components(with_coupling(paper(), second_stiffness=0.0)).springs
    assert [s.name for s in springs if s.kind is SpringKind.SHAFT] == [
        "shaft reducer.wheel – coupling"
    ]


# --- energy ---------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", PRESETS)
def test_energies_add_up_to_the_modes(preset: str) -> None:
    drivetrain = load(preset)
    modes, parts = drivetrain_modes(drivetrain), drivetrain_components(drivetrain)
    linear = linearize(build_drivetrain(drivetrain))
    shapes = modes.shapes[[modes.labels.index(dof) for dof in parts.dofs]]
    elastic = [i for i, mode in enumerate(modes.modes) if mode.kind != Kind.RIGID_BODY]
    strain = 0.5 * np.einsum("im,ij,jm->m", shapes, linear.stiffness, shapes)[elastic]
    kinetic = 0.5 * np.einsum("im,ij,jm->m", shapes, linear.mass, shapes)
    # The quadratic form of K cancels where soft modes meet stiff springs; the sum of squares not.
    stiffest = np.abs(shapes[:, elastic] ** 2 * np.diag(linear.stiffness)[:, None]).sum(axis=0)
    found = strain_energies(parts, shapes)
    assert np.all(np.abs(found.sum(axis=0)[elastic] - strain) <= 1e-12 * stiffest)
    np.testing.assert_allclose(kinetic_energies(parts, shapes).sum(axis=0), kinetic, rtol=1e-12)
    assert np.all(found >= 0.0)


@pytest.mark.parametrize("preset", PRESETS)
def test_shares_add_up_and_are_those_of_the_stages(preset: str) -> None:
    drivetrain = load(preset)
    modes = drivetrain_modes(drivetrain)
    shares = component_shares(drivetrain_components(drivetrain), modes)
    np.testing.assert_allclose(shares.kinetic.sum(axis=0), 1.0, rtol=1e-12)
    for i, mode in enumerate(modes.modes):
        rigid = mode.kind == Kind.RIGID_BODY
        assert shares.strain[:, i].sum() == pytest.approx(0.0 if rigid else 1.0, abs=1e-12)
        for stage in drivetrain.stages:
            own = [body.partition(".")[0] == stage.name for body in shares.bodies]
            expected = mode.shares.kinetic[stage.name]
            assert shares.kinetic[own, i].sum() == pytest.approx(expected, abs=1e-9)


def test_energy_tells_what_a_mode_is_about() -> None:
    drivetrain = paper()
    modes = drivetrain_modes(drivetrain)
    shares = component_shares(drivetrain_components(drivetrain), modes)
    names = [name for name, _ in shares.most("strain", 1)]
    assert names == ["shaft planetary.sun – coupling"]  # 42 Hz: the soft side of the coupling
    ((name, share),) = shares.most("kinetic", len(modes.modes) - 1)
    assert name == "coupling"
    assert share == pytest.approx(1.0)
    # Lin & Parker: in planet modes the central members stand still.
    planet = [i for i, mode in enumerate(modes.modes) if mode.kind == Kind.PLANET]
    still = [shares.bodies.index(f"planetary.{b}") for b in ("sun", "ring", "carrier")]
    assert shares.kinetic[np.ix_(still, planet)].max() < 1e-9


# --- orders ---------------------------------------------------------------------------------


def test_speeds_are_those_of_the_textbook() -> None:
    """Carrier over sun with the ring held: z_s/(z_s + z_r); the pair turns against itself."""
    ratio = speeds(drivetrain_components(load("paper-table2")), "reducer.pinion")
    assert ratio["reducer.wheel"] == pytest.approx(-1.0)
    assert ratio["planetary.carrier"] / ratio["planetary.sun"] == pytest.approx(30 / 100)
    assert ratio["planetary.ring"] == pytest.approx(0.0, abs=1e-12)
    # Seen from the carrier, sun and ring turn as their teeth.
    from_carrier = {
        k: ratio[f"planetary.{k}"] - ratio["planetary.carrier"] for k in ("sun", "ring")
    }
    assert from_carrier["ring"] / from_carrier["sun"] == pytest.approx(-30 / 70)


def test_wind_turbine_meshes_as_often_as_its_teeth_say() -> None:
    drivetrain = load("wind-turbine")
    found = {o.name: o.factor for o in orders(drivetrain, drivetrain_components(drivetrain))}
    ratio = speeds(drivetrain_components(drivetrain), "rotor")
    assert abs(ratio["generator"]) == pytest.approx(96.354, abs=0.02)  # Nejad et al. 2016
    assert found["mesh low_speed"] == pytest.approx(56.0, rel=1e-4)  # ring held: z_r per turn
    assert found["mesh high_speed"] == pytest.approx(24 * 96.354, rel=1e-3)


def test_only_orders_whose_teeth_are_given() -> None:
    drivetrain = load("paper-table2")
    names = [order.name for order in orders(drivetrain, drivetrain_components(drivetrain))]
    assert "mesh planetary" in names
    assert "mesh reducer" not in names


def test_a_held_input_has_no_orders() -> None:
    drivetrain = load("paper-table2")
    (stage,) = drivetrain.stages_of(PlanetaryStage)
    carrier = changed(stage.carrier, torsional_support=1e8)
    held = with_stage(drivetrain, "planetary", carrier=carrier.model_dump(exclude_unset=True))
    assert orders(held, drivetrain_components(held)) == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("teeth = 70", "teeth = 80", r"ring\.teeth = 80: contradicts sun\.teeth = 30.* give 70"),
        ("teeth = 20", "teeth = 2", r"planet\.teeth = 2: must be a whole number, at least 3"),
        ("teeth = 20", "teeth = 20.5", r"planet\.teeth = 20\.5: must be a whole number"),
        ('input = "reducer.pinion"', 'input = "reducer.sun"', r"operation.*not a body.*allowed"),
        ("[0.0, 3000.0]", "[3000.0, 0.5]", r"speed_range = \[3000\.0, 0\.5\]: the second"),
    ],
)
def test_wrong_teeth_and_operation_are_refused(old: str, new: str, message: str) -> None:
    text = dumps(load("paper-table2"))
    assert old in text
    with pytest.raises(ModelError, match=message):
        loads(text.replace(old, new))

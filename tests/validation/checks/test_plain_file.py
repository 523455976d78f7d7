"""Masses, ratios and stiffnesses by hand from a model file's text, against built systems."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians

import numpy as np
import pytest
from hypothesis import given, settings

from mbs_models import load
from mbs_models.model.model_file import dumps, loads, model_text, preset_names
from mbs_models.model.parameters import Drivetrain
from tests.strategies import drivetrains, paper, with_stage
from validation.checks.plain_file import plain_checks
from validation.checks.plain_train import plain_train
from validation.crosscheck.study import cross_check
from validation.routes.bands import Band
from validation.routes.equations import drivetrain_system
from validation.routes.source import exudyn_source


@pytest.mark.parametrize("preset", preset_names())
def test_presets_are_what_their_files_say_by_hand(preset: str) -> None:
    checks = plain_checks(model_text(preset), exudyn_source(load(preset)).whole, "exudyn")
    assert len(checks) >= 4
    assert [check.findings for check in checks if not check.agrees] == []


@settings(max_examples=60)
@given(drivetrains())
def test_no_right_drivetrain_is_blamed(drivetrain: Drivetrain) -> None:
    checks = plain_checks(dumps(drivetrain), drivetrain_system(drivetrain), "equations")
    assert [check.findings for check in checks if not check.agrees] == []


def test_a_support_behind_a_rigid_hub_is_counted() -> None:
    """Hub, wheel and sun are one: the sun's w is no DoF, and its support acts at the wheel's."""
    text = model_text("paper").replace("torsional_support = 0.0", "torsional_support = 1.0e6", 1)
    text = text.replace("first_stiffness = 1.0e8", 'first_stiffness = "rigid"')
    text = text.replace("second_stiffness = 1.0e5", 'second_stiffness = "rigid"')
    checks = plain_checks(text, drivetrain_system(loads(text)), "equations")
    assert [check.findings for check in checks if not check.agrees] == []


def test_a_branch_that_bears_a_load_is_no_static_path() -> None:
    """A sun that is held takes a share through its shaft: statics alone do not tell how much."""
    text = model_text("paper").replace("torsional_support = 0.0", "torsional_support = 6.0e8", 1)
    text = text.replace("torsional_support = 1.0e9", "torsional_support = 0.0")
    checks = plain_checks(text, drivetrain_system(loads(text)), "equations")
    assert [check.findings for check in checks if not check.agrees] == []
    assert not [check.name for check in checks if check.name.startswith("Stiffness")]


def test_the_paper_by_hand() -> None:
    """Table 1 and Lin & Parker's Table 1, N = 4: every number typed anew."""
    import tomllib

    train = plain_train(tomllib.loads(model_text("paper")))
    assert train is not None
    assert train.mass == pytest.approx(2 * 2.0 + 0.4 + 2.35 + 5.43 + 4 * 0.66)
    alpha = radians(24.6)
    # sun 1, ring held: w_c = w_s/(2 cos α), planets spin by w_c cos α − w_s = −1/2
    assert train.turning["planetary.carrier.w"] == pytest.approx(1.0 / (2.0 * cos(alpha)))
    assert train.turning["planetary.planet3.w"] == pytest.approx(-0.5)
    # pinion, two bearings and the mesh; both shaft springs; two meshes, bearing and ring support
    reducer = 2.0 / 3.5e8 + 1.0 / 2e8
    shaft = 1.0 / 1e8 + 1.0 / 1e5
    planets = 4.0 * (2.0 * 0.25**2 / 5e8 + (2.0 * cos(alpha) * 0.25) ** 2 / 1e8) + 1.0 / 1e9
    _, _, compliance = train.paths["Stiffness from input to output"]
    assert compliance == pytest.approx(reducer + shaft + planets)
    assert train.paths["Stiffness of the first stage"][2] == pytest.approx(reducer)


@pytest.mark.parametrize(
    ("name", "label", "factor", "check"),
    [
        ("mass", "planetary.planet1.u", 1.01, "Total mass"),
        ("mass", "planetary.carrier.w", 1.01, "Inertia of the turning train"),
        ("stiffness", "planetary.planet1.w", 1.01, "Turning strains nothing"),
        ("stiffness", "reducer.pinion.y", 1.01, "Stiffness of the first stage"),
    ],
)
def test_an_entry_that_is_wrong_is_caught(name: str, label: str, factor: float, check: str) -> None:
    system = drivetrain_system(paper())
    at = system.dofs.index(label)
    matrix = getattr(system, name).copy()
    matrix[at, at] *= factor
    wrong = replace(system, **{name: matrix})
    failed = [c for c in plain_checks(dumps(paper()), wrong, "x") if not c.agrees]
    assert any(c.name.startswith(check) or c.subject.startswith(check) for c in failed)
    assert all(c.findings for c in failed)


def test_a_defect_that_both_routes_share_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pressure angles that are wrong in what the tables give to all: only the file's text knows."""
    band = Band(100.0, 1000.0, 100.0)
    wrong = with_stage(paper(), "planetary", pressure_angle=25.0)
    text = dumps(paper())
    result = cross_check(wrong, band, text=text)
    found = {check.name for check in result.checks if not check.agrees}
    assert "Turning strains nothing" in found
    assert cross_check(paper(), band, text=text).agrees


@pytest.mark.parametrize(
    ("target", "value"),
    [
        ("mbs_models.stages.planetary.PlanetaryStage.carrier_radius", property(lambda s: 0.1)),
        ("mbs_models.stages.planetary.PlanetaryStage.ring_radius", property(lambda s: 0.13)),
        (
            "mbs_models.stages.planetary.PlanetaryStage.angles",
            property(lambda s: tuple(1.6 * p for p in range(s.planets))),
        ),
        (
            "mbs_models.stages.bodies.Body.rotary_mass",
            lambda s, r: 1.01 * s._over_r2("polar_inertia", r),
        ),
        ("mbs_models.stages.bodies.ParallelGear.rocking_mass", property(lambda s: 0.6)),
        ("mbs_models.stages.bodies.ParallelGear.rocking_stiffness", property(lambda s: 1.1e8)),
        ("mbs_models.model.couplings.Coupling.hub_mass", property(lambda s: 1e-6)),
    ],
)
def test_what_the_builder_derives_the_equations_do_not(
    target: str, value: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Defects in what mbs_models derives from tables: the equations derive it themselves."""
    drivetrain = load("paper")
    monkeypatch.setattr(target, value)
    result = cross_check(drivetrain, Band(100.0, 1000.0, 100.0))
    assert not result.agrees


def test_hubs_and_translations_are_derived_by_the_equations(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reference = drivetrain_system(paper())
    for name in ("hub_ratios", "translation_ends", "turnings"):
        monkeypatch.setattr(f"mbs_models.model.placement.{name}", lambda *_: 1 / 0)
    np.testing.assert_array_equal(drivetrain_system(paper()).stiffness, reference.stiffness)


def test_loops_are_left_out_even_beside_a_part_alone() -> None:
    rotor = {"radius": 0.1, "polar_inertia": 1.0}
    names = ("a", "b", "c", "alone")
    ends = (("a", "b"), ("b", "c"), ("c", "a"))
    data = {
        "inertia": [{"name": name, **rotor} for name in names],
        "coupling": [{"name": f"k{a}{b}", "first": a, "second": b} for a, b in ends],
    }
    train = plain_train(data)
    assert train is not None
    assert not train.turning
    assert not train.paths


def test_other_stage_types_are_left_out() -> None:
    assert plain_train({"stage": [{"type": "bevel", "name": "b"}]}) is None

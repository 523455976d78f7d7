"""What must not change: radii, numbering and orientation; and what physics demands of an FRF."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbs import direct_frf, real_modes
from mbs_models.model.parameters import Drivetrain, PlanetaryStage
from mbs_models.system.drivetrain import build_drivetrain
from mbs_models.system.harmonic_response import harmonic_response
from mbs_models.system.linearization import linearize
from tests.strategies import changed, damped, drivetrains, paper, planetary_stages, with_stage
from validation.checks.metrics import scaled_error
from validation.routes import equations, multibody
from validation.routes.routes import couple_stages
from validation.routes.source import equations_source, exudyn_source

LINES = np.geomspace(5.0, 20000.0, 60)

# Two solutions of one system of random stiffness (three decades) and mass (two) differ by its
# conditioning times round-off; 1e-8 is the bound the product itself promises.
FRF_TOLERANCE = 1e-8


def scaled_radii(drivetrain: Drivetrain, factor: float) -> Drivetrain:
    """The same drivetrain with every radius multiplied, everything else given per radius²."""
    data = drivetrain.model_dump(by_alias=True, exclude_unset=True)
    for stage in data["stage"]:
        for body in ("pinion", "wheel", "sun", "planet"):
            if body in stage:
                stage[body]["base_radius"] *= factor
    for table in (*data["coupling"], *data["inertia"]):
        table["radius"] *= factor
    return Drivetrain.model_validate(data)


@settings(max_examples=30)
@given(drivetrains(), st.floats(0.1, 10.0))
def test_radii_do_not_matter_when_all_is_given_over_r2(
    drivetrain: Drivetrain, factor: float
) -> None:
    one = multibody.drivetrain_system(drivetrain)
    other = multibody.drivetrain_system(scaled_radii(drivetrain, factor))
    for name in ("mass", "damping", "stiffness"):
        ours, theirs = getattr(one, name), getattr(other, name)
        assert np.abs(ours - theirs).max() <= 1e-12 * np.abs(ours).max()


@settings(max_examples=25)
@given(planetary_stages(), st.data())
def test_planets_can_be_renumbered(stage: PlanetaryStage, data: st.DataObject) -> None:
    n = stage.planet_count
    order = data.draw(st.permutations(range(n)))
    moved_with = {
        key: [getattr(stage, key)[p] for p in order]
        for key in ("planet_angles", "sun_mesh_stiffness")
    }
    shuffled = changed(stage, **moved_with)
    systems = [
        multibody.drivetrain_system(
            damped(changed(paper(), stage=[s.model_dump(exclude_unset=True)], coupling=[]))
        )
        for s in (stage, shuffled)
    ]
    frequencies = [real_modes(system).natural_frequencies for system in systems]
    np.testing.assert_allclose(frequencies[0], frequencies[1], rtol=1e-9, atol=1e-6)
    frfs = [direct_frf(system, LINES).values for system in systems]
    dofs = list(systems[0].dofs)
    places = [
        dofs.index(label.replace(f"planet{order[p] + 1}.", f"planet{p + 1}."))
        if (p := _position(label, order)) is not None
        else dofs.index(label)
        for label in dofs
    ]
    moved = frfs[1][:, places][:, :, places]
    assert scaled_error(frfs[0], moved).max() <= FRF_TOLERANCE


def _position(label: str, order: list[int]) -> int | None:
    """Where the planet of a label stands after shuffling."""
    body = label.split(".")[1]
    return order.index(int(body[6:]) - 1) if body.startswith("planet") else None


@settings(max_examples=25)
@given(st.floats(-360.0, 360.0))
def test_turning_all_planets_changes_no_frequency(turn: float) -> None:
    """Isotropic bearings: the gear set has no preferred direction."""
    angles = [turn + angle for angle in (0.0, 80.0, 170.0, 260.0)]
    turned = with_stage(paper(), "planetary", planets=None, planet_angles=angles)
    plain = with_stage(paper(), "planetary", planets=None, planet_angles=[0.0, 80.0, 170.0, 260.0])
    ours, theirs = (
        real_modes(multibody.drivetrain_system(d)).natural_frequencies for d in (turned, plain)
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-9)


@settings(max_examples=30)
@given(drivetrains())
def test_fbs_is_the_whole(drivetrain: Drivetrain) -> None:
    """Coupled stages = assembled system, for exudyn's stages and for the equations'."""
    whole = multibody.drivetrain_system(drivetrain)
    reference = direct_frf(whole, LINES).select(whole.dofs, whole.dofs).values
    for source in (exudyn_source, equations_source):
        coupled = couple_stages(source(drivetrain), LINES).frf
        error = scaled_error(reference, coupled.select(whole.dofs, whole.dofs).values)
        assert error.max() <= FRF_TOLERANCE


@settings(max_examples=30)
@given(drivetrains())
def test_reciprocity_and_passivity(drivetrain: Drivetrain) -> None:
    model = exudyn_source(drivetrain)
    dofs = model.whole.dofs
    frf = couple_stages(model, LINES).frf.select(dofs, dofs)
    transposed = frf.values.transpose(0, 2, 1)
    assert scaled_error(frf.values, transposed).max() <= FRF_TOLERANCE
    # Re of the drive-point mobility is the power a unit force puts in: never negative.
    power = np.einsum("kii->ki", frf.to("mobility").values).real
    size = np.abs(np.einsum("kii->ki", frf.to("mobility").values))
    assert np.all(power >= -1e-9 * size)


@pytest.mark.parametrize("damping", [False, True])
def test_the_order_of_stages_does_not_matter(damping: bool) -> None:
    drivetrain = damped(paper()) if damping else paper()
    data = drivetrain.model_dump(by_alias=True, exclude_unset=True)
    data["stage"] = tuple(reversed(data["stage"]))
    reordered = Drivetrain.model_validate(data)
    one, other = (equations.drivetrain_system(d) for d in (drivetrain, reordered))
    two = multibody.drivetrain_system(reordered)
    reference = direct_frf(one, LINES)
    for system in (other, two):
        frf = direct_frf(system, LINES).select(one.dofs, one.dofs)
        assert scaled_error(reference.values, frf.values).max() <= FRF_TOLERANCE


def test_the_harmonic_response_is_the_direct_solve() -> None:
    """Two solvers, one of mbs_models and one of fbs, on the same matrices."""
    linear = linearize(build_drivetrain(damped(paper())))
    ours = harmonic_response(linear, LINES)
    theirs = direct_frf(multibody.as_second_order(linear), LINES).values
    assert scaled_error(theirs, ours).max() <= FRF_TOLERANCE

"""The cross-check's verdicts: right models agree, wrong ones are caught and traced."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mbs_models.errors import ModelError
from mbs_models.modal.mode_kinds import Kind
from mbs_models.model.model_file import load
from mbs_models.model.parameters import Drivetrain, ParallelStage
from tests.strategies import changed, damped, paper, with_coupling, with_stage
from validation.checks.metrics import scaled_error
from validation.crosscheck.result import CrossCheck
from validation.crosscheck.study import cross_check
from validation.routes import equations
from validation.routes.bands import Band
from validation.routes.routes import comparison_routes, whole_route
from validation.routes.source import Source, equations_source, exudyn_source

COARSE = Band(5.0, 15000.0, 5.0)


def check_against(
    perturb: Callable[[Drivetrain], Drivetrain], drivetrain: Drivetrain | None = None
) -> CrossCheck:
    """A cross-check whose equations are of another drivetrain."""
    return cross_check(
        drivetrain or damped(paper()), COARSE, equations=lambda d: equations_source(perturb(d))
    )


def disagreements(result: CrossCheck) -> dict[str, tuple[str, ...]]:
    return {f"{c.name} | {c.routes[1]}": c.findings for c in result.checks if not c.agrees}


@pytest.mark.slow
@pytest.mark.parametrize("damping", [False, True], ids=["undamped", "damped"])
@pytest.mark.parametrize("k_sw", [1e5, 1e6, 1e7])
def test_all_900_frfs_of_the_paper(k_sw: float, damping: bool) -> None:
    """1–15 000 Hz at 1 Hz: FBS, equations and modal synthesis against exudyn's whole system."""
    drivetrain = paper(second_stiffness=k_sw)
    result = cross_check(damped(drivetrain) if damping else drivetrain)
    assert len(result.frequency) == 15000
    assert len(result.dofs) == 30
    assert len(result.comparisons) == 5
    for comparison in result.comparisons:
        # No line is left out: even undamped, no line of this grid is nearer to a pole than 1e-6.
        assert comparison.line_max.max() <= 1e-8, comparison.route
        assert np.median(comparison.line_max) <= 1e-12, comparison.route
    assert result.agrees


@pytest.mark.parametrize("preset", ["paper", "paper-table2", "lin-parker-3", "lin-parker-5"])
def test_presets_agree(preset: str) -> None:
    result = cross_check(load(preset), COARSE, published=preset)
    assert disagreements(result) == {}
    assert result.agrees


@pytest.mark.parametrize(
    "drivetrain",
    [
        with_coupling(paper(), first_stiffness="rigid"),
        with_coupling(paper(), first_stiffness="rigid", second_stiffness="rigid", radius=0.05),
        with_coupling(paper(), first="reducer.pinion", second="planetary.carrier"),
        with_coupling(paper(), second_stiffness=0.0),
        with_stage(paper(), "reducer", helix_angle=20.0),
        changed(paper(), coupling=[]),
    ],
    ids=["rigid wheel", "one shaft", "pinion-carrier", "hub apart", "helical", "unconnected"],
)
def test_other_drivetrains_agree(drivetrain: Drivetrain) -> None:
    result = cross_check(damped(drivetrain), COARSE)
    assert disagreements(result) == {}


@pytest.mark.parametrize("values_per_block", [2**19, 40 * 30**2])
def test_the_errors_are_those_of_all_lines_at_once(
    values_per_block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Largest and median by line, largest by pair, and where: by blocks as by the definition."""
    monkeypatch.setattr("validation.checks.frfs.VALUES_PER_BLOCK", values_per_block)
    drivetrain = damped(paper())
    result = cross_check(drivetrain, Band(50.0, 15000.0, 50.0))
    source, lines, dofs = exudyn_source(drivetrain), result.frequency, result.dofs
    exact = whole_route(source).frf(lines, dofs, dofs).values
    routes = comparison_routes(source, equations_source(drivetrain))
    for route, found in zip(routes, result.comparisons, strict=True):
        error = scaled_error(exact, route.frf(lines, dofs, dofs).values)
        # Where a thread's block begins moves LAPACK's last digits: two roundings of an error.
        near: dict[str, Any] = {"rtol": 0.5, "atol": 1e-15}
        np.testing.assert_allclose(found.pair_max, error.max(axis=0), **near)
        np.testing.assert_allclose(found.line_max, error.max(axis=(1, 2)), **near)
        median = np.median(error.reshape(len(lines), -1), axis=1)
        np.testing.assert_allclose(found.line_median, median, **near)
        at, response, excitation = found.worst
        place = list(lines).index(at), dofs.index(response), dofs.index(excitation)
        assert error[place] == pytest.approx(error.max(), rel=0.5)


def test_poles_of_every_route() -> None:
    result = cross_check(damped(paper()), COARSE)
    elastic = [row for row in result.poles if row.kind != Kind.RIGID_BODY]
    assert len(elastic) == 29
    for row in elastic:
        ours = row.frequency_hz["exudyn"]
        # exudyn's dense eigensolution carries eps·λ_max = 3 rad²/s² of the 7.5 MHz hub.
        allowed = max(1e-6 * ours, row.round_off_hz)
        assert row.frequency_hz["equations"] == pytest.approx(ours, abs=allowed)
        # Equations' modes and FBS' coupled FRFs have no such error: they agree much closer.
        assert row.frequency_hz["FBS of exudyn stages"] == pytest.approx(
            row.frequency_hz["equations"], rel=1e-10
        )
        assert row.damping_ratio["FBS of exudyn stages"] == pytest.approx(
            row.damping_ratio["equations"], rel=1e-8
        )
        assert min(row.subspace_mac.values()) > 1.0 - 1e-10


def test_a_bearing_one_percent_off_is_found() -> None:
    def perturb(drivetrain: Drivetrain) -> Drivetrain:
        (reducer,) = drivetrain.stages_of(ParallelStage)
        return with_stage(
            drivetrain, "reducer", pinion=changed(reducer.pinion, bearing_y=3.535e8).model_dump()
        )

    result = check_against(perturb)
    assert not result.agrees
    found = disagreements(result)
    matrix = found["Stiffness matrix, entry by entry | equations"]
    assert len(matrix) == 1
    assert "reducer.pinion.y" in matrix[0]
    assert "5.5e8 against 5.535e8 N/m" in matrix[0]
    # From the FRFs alone: the same entry, and by how much, for the whole and for FBS.
    for route in ("equations", "FBS of equations stages"):
        findings = found[f"FRFs, worst line | {route}"]
        assert "stiffness at reducer.pinion.y: 5.5e8 against 5.535e8" in findings[1]
    # Routes that share nothing with the wrong one still agree.
    assert "FRFs, worst line | FBS of exudyn stages" not in found


def test_a_flipped_mesh_direction_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    original = equations.ring_mesh

    def flipped(stage: Any, planet: Any, phi: Any) -> Any:
        deflection = dict(original(stage, planet, phi))
        if planet == "planet3":
            deflection["planetary.ring.w"] *= -1.0
        return deflection

    monkeypatch.setattr(equations, "ring_mesh", flipped)
    result = cross_check(damped(paper()), COARSE)
    assert not result.agrees
    found = disagreements(result)
    matrix = " ".join(found["Stiffness matrix, entry by entry | equations"])
    assert "planetary.ring.w" in matrix
    assert "planetary.planet3.w" in matrix
    frfs = " ".join(found["FRFs, worst line | equations"])
    assert "planetary.ring.w" in frfs
    assert "planetary.planet3" in frfs
    assert "reducer" not in " ".join(found["FRFs, worst line | equations"][1:])


def test_a_missing_half_of_the_hub_is_found() -> None:
    """2.2e-8 kg of 17 kg: visible in no FRF by eye, and found."""

    def without_half(drivetrain: Drivetrain, name: str) -> Any:
        if name == "planetary":
            drivetrain = with_coupling(drivetrain, inertia_over_r2=4.48e-12)
        return equations.stage_system(drivetrain, name)

    def source(drivetrain: Drivetrain) -> Source:
        return Source("equations", drivetrain, equations.drivetrain_system, without_half)

    result = cross_check(damped(paper()), COARSE, equations=source)
    assert not result.agrees
    found = disagreements(result)
    assert "mass at coupling.w" in found["Mass matrix, entry by entry | equations"][0]
    assert "mass at coupling.w" in found["Mass matrix, stages put together | equations stages"][0]
    frfs = found["FRFs, worst line | FBS of equations stages"]
    assert any("mass at coupling.w" in finding for finding in frfs)
    assert "FRFs, worst line | equations" not in found


def test_damping_that_differs_is_found() -> None:
    result = check_against(
        lambda d: changed(d, damping={"stiffness_proportional": 1.1e-6, "mass_proportional": 1.0})
    )
    found = disagreements(result)
    matrix = found["Damping matrix, entry by entry | equations"]
    assert all(finding.startswith(("damping", "and")) for finding in matrix)
    assert "Stiffness matrix, entry by entry | equations" not in found
    assert all(
        "damping at" in f or f.startswith(("largest", "and", "this explains"))
        for f in found["FRFs, worst line | equations"]
    )
    assert "Damping ratios | equations" in found
    assert "Natural frequencies | equations" not in found


def test_what_cannot_vibrate_is_refused() -> None:
    rotor = {"name": "rotor", "radius": 0.1, "polar_inertia": 1.0}
    alone = Drivetrain.model_validate({"name": "rotor", "inertia": [rotor]})
    with pytest.raises(ModelError, match="rotor: nothing in it vibrates: no spring holds a body"):
        cross_check(alone, Band(1.0, 10.0, 1.0))


def test_published_values_are_checked() -> None:
    drivetrain = with_stage(load("lin-parker-4"), "planetary", sun_mesh_stiffness=5.2e8)
    result = cross_check(drivetrain, COARSE, published="lin-parker-4")
    (check,) = [c for c in result.checks if c.name == "Published natural frequencies"]
    assert not check.agrees
    assert any("published" in finding for finding in check.findings)


@pytest.mark.slow
def test_a_chain_of_ten_stages() -> None:
    """167 DoFs, ten substructures: all 27 889 FRFs on the default lines of so large a system."""
    planetary = load("lin-parker-4").stage("planetary").model_dump(exclude_unset=True)
    parallel = paper().stage("reducer").model_dump(exclude_unset=True)
    stages = [(planetary if i % 3 else parallel) | {"name": f"s{i}"} for i in range(10)]
    ends = {"planetary": ("sun", "carrier"), "parallel": ("pinion", "wheel")}
    couplings = [
        {
            "name": f"c{i}",
            "first": f"s{i}.{ends[stages[i]['type']][1]}",
            "second": f"s{i + 1}.{ends[stages[i + 1]['type']][0]}",
            "radius": 0.05,
            "inertia_over_r2": 0.01,
            "first_stiffness": 1e8,
            "second_stiffness": 1e7,
        }
        for i in range(9)
    ]
    drivetrain = changed(paper(), name="chain", stage=stages, coupling=couplings)
    result = cross_check(damped(drivetrain), Band(50.0, 15000.0, 50.0))
    assert disagreements(result) == {}
    assert len(result.dofs) == 167
